//! What Ctrl-C does.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_results::OutputFolder;

use crate::output;

/// The first signal ends the work and keeps what is finished; the second ends the process, without half-written files.
pub(super) fn stop_on_signal(cancel: &Arc<AtomicBool>, folder: &OutputFolder) {
    let (cancel, staging) = (Arc::clone(cancel), folder.staging().to_owned());
    let asked = AtomicBool::new(false);
    let installed = ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::Relaxed) {
            let _ = std::fs::remove_dir_all(&staging);
            std::process::exit(130);
        }
        cancel.store(true, Ordering::Relaxed);
        output::message("stopping: what is finished will be kept; press Ctrl-C again to end at once");
    });
    if let Err(error) = installed {
        output::warning(&format!("Ctrl-C will end the run without results: {error}"));
    }
}
