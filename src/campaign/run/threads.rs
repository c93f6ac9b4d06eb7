//! Work on threads: the one loop of every command that plays episodes by number. A system may refuse a thread: those that it
//! gives do all the work, and without any the calling one does.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread::Builder;

/// Runs `work` for each item, on at most `threads` threads. Reports of `work` by `tell` are handed to `on` on the
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
        let mut is_alone = true;
        for _ in 0..threads.min(items.len()) {
            // Moved into the thread, so that the channel closes when the last one is done.
            let sender = sender.clone();
            let (next, work, is_over) = (&next, &work, &is_over);
            let worker = move || {
                let mut tell = |news| sender.send(news).is_ok() && !is_over();
                while !is_over() {
                    let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                    work(item, &mut tell);
                }
            };
            if Builder::new().spawn_scoped(scope, worker).is_err() {
                break;
            }
            is_alone = false;
        }
        drop(sender);
        let mut result = Ok(());
        if is_alone {
            let mut tell = |news| {
                if !failed.load(Ordering::Relaxed) {
                    result = on(news);
                    failed.store(result.is_err(), Ordering::Relaxed);
                }
                !is_over()
            };
            items.iter().take_while(|_| !is_over()).for_each(|item| work(item, &mut tell));
        } else {
            result = receiver.into_iter().try_for_each(on);
            failed.store(result.is_err(), Ordering::Relaxed);
        }
        result
    })
}
