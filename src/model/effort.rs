//! How many steps the proofs about a space may take: a count, kept by the thread that proves.
//!
//! What a text asks of the proofs multiplies: rows, roads, rules, states, and the operations of each condition. So
//! whatever a proof does costs steps ([`spend`]), and the checker sets a limit for all proofs together ([`within`]).
//! Once the steps are spent, the loops end early ([`is_spent`]). What they found then counts for nothing: the checker
//! says that the space is too large, and makes none of it. A count is the same on every machine, and a clock is not.
//! Where no limit was set, as in an episode, there is none.

use core::cell::Cell;

thread_local! {
    static SPENT: Cell<u64> = const { Cell::new(0) };
    static LIMIT: Cell<u64> = const { Cell::new(u64::MAX) };
}

/// Counts steps. One is about the evaluation of one operation, or the copy of one value.
pub(crate) fn spend(steps: usize) {
    SPENT.set(SPENT.get().wrapping_add(steps as u64));
}

/// Whether the steps of the work around are spent.
pub(crate) fn is_spent() -> bool {
    SPENT.get() > LIMIT.get()
}

/// Does some work with at most so many steps. Gives what it gives, and whether the steps sufficed.
pub(crate) fn within<T>(steps: u64, work: impl FnOnce() -> T) -> (T, bool) {
    let _restore = Restore(LIMIT.replace(SPENT.get().saturating_add(steps)));
    let done = work();
    (done, !is_spent())
}

/// Sets the limit back, also where the work panics: the editor's server goes on after that.
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
}
