//! Output: results go to stdout, everything else to stderr.

use std::io::{self, ErrorKind, IsTerminal as _, Write as _};

use crate::exit::Exit;

/// Prints a result. A closed pipe (`elastocap schema | head`) is not a failure.
pub(crate) fn result(text: &str) -> Result<(), Exit> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => {
            self::error(&format!("cannot write to the standard output: {error}"));
            Err(Exit::Failure)
        }
    }
}

/// Prints a message without a prefix.
pub(crate) fn message(text: &str) {
    // If stderr is not writable, there is nowhere to report it.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Prints an error.
pub(crate) fn error(text: &str) {
    message(&format!("error: {}", plain(text)));
}

/// Prints a warning.
pub(crate) fn warning(text: &str) {
    message(&format!("warning: {}", plain(text)));
}

/// A text without control characters for the terminal: titles and names may come from a file of others.
pub(crate) fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && !matches!(c, '\n' | '\t') { '\u{fffd}' } else { c }).collect()
}

/// Whether messages may be coloured: <https://no-color.org>.
pub(crate) fn stderr_has_colour() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stderr().is_terminal() && !set("NO_COLOR")
}
