//! Work on threads: the one loop of every command that plays episodes by number.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

/// Runs `work` for each item, on at most `threads` threads. What `work` reports by `tell` is handed to `on` on the
/// calling thread, in the order of arrival. Stops early, between items, when `stop` is set or `on` fails; `tell`
/// returns false then.
///
/// # Errors
/// The first error of `on`.
pub fn on_threads<I: Sync, T: Send, E>(
    items: &[I],
    threads: usize,
    stop: &AtomicBool,
    work: impl Fn(&I, &mut dyn FnMut(T) -> bool) + Sync,
    on: &mut dyn FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let is_over = || stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads.min(items.len()) {
            // Moved into the thread, so that the channel closes when the last one is done.
            let sender = sender.clone();
            let (next, work, is_over) = (&next, &work, &is_over);
            scope.spawn(move || {
                let mut tell = |news| sender.send(news).is_ok() && !is_over();
                while !is_over() {
                    let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                    work(item, &mut tell);
                }
            });
        }
        drop(sender);
        let result = receiver.into_iter().try_for_each(on);
        failed.store(result.is_err(), Ordering::Relaxed);
        result
    })
}
