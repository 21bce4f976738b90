//! `elastocap completions`: prints scripts that complete the command line in a shell, generated from the
//! definition of its arguments.

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap completions bash > ~/.local/share/bash-completion/completions/elastocap
  elastocap completions zsh > ~/.zfunc/_elastocap        with ~/.zfunc in fpath, before compinit
  elastocap completions fish > ~/.config/fish/completions/elastocap.fish
  elastocap completions powershell >> $PROFILE
  elastocap completions elvish > ~/.config/elvish/lib/elastocap.elv";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(crate) fn execute(arguments: &Arguments) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut crate::Arguments::command(), "elastocap", &mut script);
    match output::result(&String::from_utf8_lossy(&script)) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}
