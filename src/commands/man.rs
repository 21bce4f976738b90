//! `elastocap man`: manual pages, from the same definitions that parse the command line.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::builder::Resettable;
use clap::{Args, Command, CommandFactory as _, ValueHint};
use clap_mangen::Man;
use elastocap_files::{Staged, remove_abandoned};

use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap man | man -l -               shows the page of elastocap itself
  elastocap man ~/.local/share/man/man1  writes elastocap.1, elastocap-run.1 and so on
  man elastocap-run

Pages that are in the folder already are replaced.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Folder for the pages of all commands; without it that of elastocap itself is printed
    #[arg(value_hint = ValueHint::DirPath)]
    folder: Option<PathBuf>,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let pages = match pages() {
        Ok(pages) => pages,
        Err(error) => return failed(&format!("cannot make the manual pages: {error}")),
    };
    let Some(folder) = &arguments.folder else {
        // The last page is that of elastocap itself.
        let text = pages.last().map_or("", |page| page.text.as_str());
        return output::result(text).err().unwrap_or(Exit::Done);
    };
    if let Err(error) = write(folder, &pages) {
        let folder = folder.display();
        return failed(&format!(
            "cannot write manual pages to `{folder}`: {error}; name a folder that can be written to"
        ));
    }
    if common.quiet {
        return Exit::Done;
    }
    let names: String = pages.iter().map(|page| format!("{}\n", folder.join(&page.name).display())).collect();
    output::result(&names).err().unwrap_or(Exit::Done)
}

fn failed(why: &str) -> Exit {
    output::error(why);
    Exit::Failure
}

/// A manual page.
struct Page {
    /// The name of the file.
    name: String,
    /// The text of the page in roff.
    text: String,
}

/// The pages of the subcommands, then that of elastocap itself.
fn pages() -> io::Result<Vec<Page>> {
    let mut whole = crate::Arguments::command().disable_help_subcommand(true);
    whole.build();
    let mut pages = Vec::new();
    for command in whole.get_subcommands().filter(|command| !command.is_hide_set()) {
        pages.push(page(command.clone())?);
    }
    pages.push(page(whole)?);
    Ok(pages)
}

fn page(command: Command) -> io::Result<Page> {
    let closing = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    // The generator would join the lines of the examples into one paragraph, so their section is written
    // here.
    let man = Man::new(command.after_help(Resettable::Reset)).manual("elastocap");
    let mut text = Vec::new();
    man.render(&mut text)?;
    let text = String::from_utf8_lossy(&text).into_owned() + &sections(&closing);
    Ok(Page { name: man.get_filename(), text })
}

/// The text after the options of a help text, as sections: a paragraph that begins with `Examples:` or the
/// like becomes a section whose lines stay as they are, any other one a paragraph.
fn sections(closing: &str) -> String {
    let mut out = String::new();
    let mut has_heading = false;
    for paragraph in closing.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
        let (first, rest) = paragraph.split_once('\n').unwrap_or((paragraph, ""));
        match first.strip_suffix(':') {
            Some(head) if !rest.is_empty() && !head.starts_with(' ') => {
                out.push_str(&format!(
                    ".SH {}\n.nf\n{}.fi\n",
                    escaped(&head.to_uppercase()).trim_end(),
                    escaped(rest)
                ));
                has_heading = false;
            }
            _ => {
                out.push_str(if has_heading { ".PP\n" } else { ".SH NOTES\n" });
                out.push_str(&escaped(paragraph));
                has_heading = true;
            }
        }
    }
    out
}

/// Lines of text as roff: nothing in them is a command, and hyphens remain hyphens when copied.
fn escaped(text: &str) -> String {
    let line = |line: &str| {
        let line = line.replace('\\', "\\e").replace('-', "\\-");
        match line.starts_with(['.', '\'']) {
            true => format!("\\&{line}\n"),
            false => line + "\n",
        }
    };
    text.lines().map(line).collect()
}

/// Writes all pages, or none.
fn write(folder: &Path, pages: &[Page]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    remove_abandoned(folder);
    let staged: Vec<Staged> = pages
        .iter()
        .map(|page| Staged::new(&folder.join(&page.name), page.text.as_bytes()))
        .collect::<io::Result<_>>()?;
    staged.into_iter().try_for_each(Staged::replace_file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_keep_their_lines_and_nothing_is_taken_for_a_command() {
        let roff = sections("Examples:\n  a --b\n  c\\d\n\nA note.\n.dot\n\nAnother.");
        assert_eq!(
            roff,
            ".SH EXAMPLES\n.nf\n  a \\-\\-b\n  c\\ed\n.fi\n.SH NOTES\nA note.\n\\&.dot\n.PP\nAnother.\n"
        );
    }
}
