//! Errors of a case file, and their display: file, line, caret, the error, its correction.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

/// The largest number of errors with their text; further ones are only counted.
pub(super) const KEPT: usize = 10;

/// A line is shown in part if more than so many bytes of it lie before or after an error.
const LONG_LINE: usize = 4_000;
/// The bytes before and after an error that are shown of such a line.
const SHOWN_OF_LINE: usize = 80;

/// One error in a case file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The error, in one line.
    pub message: String,
    /// The bytes of the file at fault; `None` for an error of the file as a whole.
    pub span: Option<Range<usize>>,
    /// The text next to the caret; may be empty.
    pub label: String,
    /// Other places that belong to the error, each with its label.
    pub related: Vec<(Range<usize>, String)>,
    /// The correction to make, if there is one to offer.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error of the file as a whole.
    pub(super) fn of_file(message: impl Into<String>) -> Self {
        Self { message: message.into(), span: None, label: String::new(), related: Vec::new(), help: None }
    }

    /// An error at a place in the file.
    pub(super) fn at(span: &Range<usize>, message: impl Into<String>) -> Self {
        Self { span: Some(span.clone()), ..Self::of_file(message) }
    }

    /// Whether both errors have the same place in the file and the same words, apart from the names in them:
    /// one place, such as the pitch of an array, may be wrong for several bodies.
    pub(super) fn is_same_but_for_names(&self, other: &Self) -> bool {
        let is_same_text = |one: &str, other: &str| {
            // Names stand in quotes.
            one.split('"').step_by(2).eq(other.split('"').step_by(2))
        };
        let places =
            |diagnostic: &Self| diagnostic.related.iter().map(|(span, _)| span.clone()).collect::<Vec<_>>();
        self.span.is_some()
            && self.span == other.span
            && places(self) == places(other)
            && self.help == other.help
            && is_same_text(&self.message, &other.message)
            && is_same_text(&self.label, &other.label)
    }

    pub(super) fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub(super) fn related(mut self, span: &Range<usize>, label: impl Into<String>) -> Self {
        self.related.push((span.clone(), label.into()));
        self
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A case file that cannot be run: all errors in it, in the order of the file.
#[derive(Debug, Clone, thiserror::Error)]
pub struct CaseError {
    /// The file, as the caller named it.
    origin: PathBuf,
    /// The text of the file.
    source_text: String,
    /// The errors with their text, in the order of the file.
    diagnostics: Vec<Diagnostic>,
    /// The number of further errors.
    unshown: usize,
}

impl CaseError {
    pub(super) fn new(
        origin: &Path,
        source_text: &str,
        mut diagnostics: Vec<Diagnostic>,
        unshown: usize,
    ) -> Self {
        diagnostics.sort_by_key(|d| d.span.as_ref().map_or(0, |span| span.start));
        Self { origin: origin.to_owned(), source_text: source_text.to_owned(), diagnostics, unshown }
    }

    /// The error for a file that could not be read as text.
    pub(super) fn of_file(origin: &Path, diagnostic: Diagnostic) -> Self {
        Self::new(origin, "", vec![diagnostic], 0)
    }

    /// The file, as the caller named it.
    pub fn origin(&self) -> &Path {
        &self.origin
    }

    /// The errors, in the order of the file; at least one.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// The line and the column (in characters) where the error starts, both counted from 1.
    pub fn line_column(&self, diagnostic: &Diagnostic) -> Option<(usize, usize)> {
        let start = boundary(&self.source_text, diagnostic.span.as_ref()?.start);
        let before = &self.source_text[..start];
        let line_start = before.rfind('\n').map_or(0, |k| k + 1);
        Some((before.matches('\n').count() + 1, before[line_start..].chars().count() + 1))
    }

    /// All errors in rustc's style, ready to print; with colours for a terminal if `colour`.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let mut out = self.diagnostics.iter().map(|d| self.render_one(d, &renderer)).collect::<Vec<_>>();
        if self.unshown > 0 {
            out.push(format!("and {} more problems in {}", self.unshown, self.shown_origin()));
        }
        out.join("\n\n")
    }

    fn shown_origin(&self) -> String {
        shown_path(&self.origin)
    }

    fn render_one(&self, diagnostic: &Diagnostic, renderer: &Renderer) -> String {
        let mut group = Level::ERROR.primary_title(diagnostic.message.as_str()).elements(
            diagnostic.span.as_ref().map(|span| self.snippet(span, &diagnostic.label, &diagnostic.related)),
        );
        if let Some(help) = &diagnostic.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        renderer.render(&[group])
    }

    /// The lines that the annotations touch; the renderer gets only those, since a file may be long.
    fn snippet<'a>(
        &'a self,
        span: &Range<usize>,
        label: &'a str,
        related: &'a [(Range<usize>, String)],
    ) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
        let text = self.source_text.as_str();
        // The first line of a span of several lines suffices.
        let clamp = |span: &Range<usize>| {
            let start = boundary(text, span.start);
            let end = boundary(text, span.end).max(start);
            start..text[start..end].find('\n').map_or(end, |k| start + k)
        };
        let spans = || std::iter::once(span).chain(related.iter().map(|(span, _)| span)).map(&clamp);
        let first = spans().map(|s| s.start).min().unwrap_or(0);
        let last = spans().map(|s| s.end).max().unwrap_or(0);
        let from = text[..first].rfind('\n').map_or(0, |k| k + 1);
        let to = text[last..].find('\n').map_or(text.len(), |k| last + k);
        // A very long line is shown only around the error, which also saves time.
        let from = if first - from > LONG_LINE { boundary(text, first - SHOWN_OF_LINE) } else { from };
        let to = if to - last > LONG_LINE { boundary(text, last + SHOWN_OF_LINE) } else { to };
        let local = |span: &Range<usize>| {
            let span = clamp(span);
            span.start - from..span.end - from
        };
        let label = (!label.is_empty()).then_some(label);
        Snippet::source(&text[from..to])
            .line_start(text[..from].matches('\n').count() + 1)
            .path(self.shown_origin())
            .annotation(AnnotationKind::Primary.span(local(span)).label(label))
            .annotations(
                related
                    .iter()
                    .map(|(span, label)| AnnotationKind::Context.span(local(span)).label(label.as_str())),
            )
    }
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

/// The last character boundary at or before `at`.
fn boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Text of the user in one line of a message: shortened, with control characters escaped.
pub(super) fn shown(text: &str) -> String {
    let mut out = text.chars().take(40).collect::<String>().escape_debug().to_string().replace("\\\"", "\"");
    out = out.replace("\\'", "'");
    if text.chars().nth(40).is_some() {
        out.push('\u{2026}');
    }
    out
}

/// A path in one line of a message, without control characters.
pub(super) fn shown_path(path: &Path) -> String {
    path.display().to_string().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
