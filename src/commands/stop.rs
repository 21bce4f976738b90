//! What Ctrl-C does.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_results::OutputFolder;

use crate::output;

/// The first signal lets the work end with what is done; the second ends the process, without leaving files half done.
pub(super) fn stop_on_signal(cancel: &Arc<AtomicBool>, folder: &OutputFolder) {
    let (cancel, staging) = (Arc::clone(cancel), folder.staging().to_owned());
    let asked = AtomicBool::new(false);
    let installed = ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::Relaxed) {
            let _ = std::fs::remove_dir_all(&staging);
            std::process::exit(130);
        }
        cancel.store(true, Ordering::Relaxed);
        output::message("stopping: what is done will be kept; once more to end at once");
    });
    if let Err(error) = installed {
        output::warning(&format!("Ctrl-C will end the run without results: {error}"));
    }
}
