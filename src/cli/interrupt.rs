//! Ctrl-C: the first ends a command after the episodes under way, if it can be gone on with; otherwise, and the second
//! time, all ends at once, external driving systems included.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use avastra_drivers::external;

use super::output::remark;

/// The flag of a command that ends in good order.
static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Listens for Ctrl-C.
pub fn listen() {
    let heard = ctrlc::set_handler(|| match STOP.get() {
        Some(stop) if !stop.swap(true, Ordering::Relaxed) => {
            remark("finishing the episodes under way; press again to leave them");
        }
        _ => {
            external::end_all();
            std::process::exit(130);
        }
    });
    if let Err(error) = heard {
        remark(&format!("warning: cannot listen for Ctrl-C: {error}"));
    }
}

/// A flag that the first Ctrl-C sets; the second ends the process at once.
pub fn stop_on_interrupt() -> Arc<AtomicBool> {
    Arc::clone(STOP.get_or_init(Arc::default))
}
