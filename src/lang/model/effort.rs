//! A budget of steps for the proofs about a space. Each thread has a count of its own.
//!
//! Rows, roads, rules, states and the operations of conditions multiply, so a short text can ask for endless proofs. Each
//! proof counts its steps ([`spend`]), and the checker limits all proofs together ([`within`]). Once the steps are spent,
//! loops end early ([`is_spent`]). The checker then drops their results and says that the space is too large. Steps are
//! counted because a count is the same on every machine and a clock is not. Outside `within`, as in an episode, there is no
//! limit.

use core::cell::Cell;

thread_local! {
    static SPENT: Cell<u64> = const { Cell::new(0) };
    static LIMIT: Cell<u64> = const { Cell::new(u64::MAX) };
}

/// Counts steps. One step is about the evaluation of one operation, or the copy of one value.
pub(crate) fn spend(steps: usize) {
    SPENT.set(SPENT.get().wrapping_add(steps as u64));
}

/// Whether the steps of the innermost [`within`] are spent.
pub(crate) fn is_spent() -> bool {
    SPENT.get() > LIMIT.get()
}

/// Allows further steps to the innermost [`within`].
pub(crate) fn grant(steps: u64) {
    LIMIT.set(LIMIT.get().saturating_add(steps));
}

/// Gives up now if so many steps, which are to come, will not suffice.
pub(crate) fn foresee(steps: u64) {
    if SPENT.get().saturating_add(steps) > LIMIT.get() {
        SPENT.set(LIMIT.get().saturating_add(1));
    }
}

/// Does some work. Returns its result and the steps that it took.
pub fn counted<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let begun = SPENT.get();
    let done = work();
    (done, SPENT.get().wrapping_sub(begun))
}

/// Does some work with a limit of steps. Returns its result, and whether the steps sufficed.
pub(crate) fn within<T>(steps: u64, work: impl FnOnce() -> T) -> (T, bool) {
    let _restore = Restore(LIMIT.replace(SPENT.get().saturating_add(steps)));
    let done = work();
    (done, !is_spent())
}

/// Restores the limit, even if the work panics, because the language server goes on after a panic.
struct Restore(u64);

impl Drop for Restore {
    fn drop(&mut self) {
        LIMIT.set(self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_spent_within_a_limit_alone() {
        assert!(!is_spent());
        assert!(within(10, || spend(10)).1);
        assert!(!within(10, || spend(11)).1);
        let (inner, is_outer_enough) = within(100, || within(10, || spend(11)).1);
        assert!(!inner && is_outer_enough);
        assert!(!is_spent(), "the limit ends with the work");
    }

    #[test]
    fn what_is_granted_is_added_and_what_is_foreseen_ends_it() {
        assert_eq!(counted(|| spend(7)), ((), 7));
        let granted = || {
            grant(5);
            spend(15);
        };
        assert!(within(10, granted).1 && !within(9, granted).1);
        let foreseen = |steps| within(10, || (spend(4), foresee(steps))).1;
        assert!(foreseen(6) && !foreseen(7));
    }
}
