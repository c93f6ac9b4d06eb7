//! Ctrl-C and SIGTERM. The first signal ends a command that can be resumed, or that plays several files, after the episodes
//! under way. For other commands, and the second time, everything ends at once, external driving systems included.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use avastra_drivers::external;
use nix::sys::signal::{SigSet, Signal};

use super::output::remark;

/// The flag of a command that ends in good order.
static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Listens for Ctrl-C, and for SIGTERM, by which schedulers, containers and `timeout` end a command.
pub fn listen() {
    // Every later thread inherits that it does not receive SIGTERM, so the one that waits for it does. Processes would inherit
    // it, too: `external::link` clears the mask where it starts one.
    let mut terminate = SigSet::empty();
    terminate.add(Signal::SIGTERM);
    if terminate.thread_block().is_ok() {
        let wait = move || {
            while terminate.wait().is_ok() {
                stop(143);
            }
        };
        if std::thread::Builder::new().spawn(wait).is_err() {
            // Without a listener, SIGTERM ends the command at once, as usual.
            let _ = terminate.thread_unblock();
        }
    }
    if let Err(error) = ctrlc::set_handler(|| stop(130)) {
        remark(&format!("warning: cannot listen for Ctrl-C: {error}"));
    }
}

fn stop(status: i32) {
    match STOP.get() {
        Some(stop) if !stop.swap(true, Ordering::Relaxed) => {
            remark("finishing the episodes under way; a second signal leaves them");
        }
        _ => {
            external::end_all();
            std::process::exit(status);
        }
    }
}

/// A flag that the first Ctrl-C sets; the second ends the process at once.
pub fn stop_on_interrupt() -> Arc<AtomicBool> {
    Arc::clone(STOP.get_or_init(Arc::default))
}
