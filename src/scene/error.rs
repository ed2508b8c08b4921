//! What is wrong with a scene, as a person reads it.

use std::path::Path;
use std::sync::Arc;

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, NamedSource, SourceSpan};

use super::excerpt::Excerpt;
use crate::document::Index;
use crate::document::{DocumentError, Explanation};

/// So many problems of one scene are reported in full, each with its lines; more would not be read, and all
/// of a file of nothing else would take hours.
const MAX_REPORTED: usize = 20;

/// What is wrong with a scene and where.
///
/// Shown on one line it reads `models/x.toml:12:3: message`; [`SceneError::rendered`] shows the
/// line of the scene itself, with help. Everything wrong that was found at once is reported
/// together.
#[derive(Clone, thiserror::Error, Diagnostic)]
#[error("{}{}", prefix(&.0.origin, .0.position), .0.message)]
#[diagnostic(transparent)]
pub struct SceneError(Box<Report>);

/// The same for the report, whose head already shows the place.
#[derive(Debug, Clone, thiserror::Error, Diagnostic)]
#[error("{}{message}", if span.is_some() { String::new() } else { prefix(origin, None) })]
struct Report {
    message: String,
    origin: String,
    position: Option<(usize, usize)>,
    key: Option<String>,
    text_label: String,
    #[source_code]
    text: Option<NamedSource<Excerpt>>,
    #[label("{text_label}")]
    span: Option<SourceSpan>,
    #[help]
    help: Option<String>,
    #[related]
    others: Vec<Report>,
}

/// As rendered: this is what a `main` that returns errors prints.
impl std::fmt::Debug for SceneError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.rendered(false))
    }
}

fn prefix(origin: &str, position: Option<(usize, usize)>) -> String {
    match position {
        Some((line, column)) => format!("{origin}:{line}:{column}: "),
        None => format!("{origin}: "),
    }
}

impl SceneError {
    /// A scene file that could not be read at all.
    pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> Self {
        Self(Box::new(Report {
            message: format!("cannot read the scene: {error}"),
            origin: path.display().to_string(),
            position: None,
            key: None,
            text_label: String::new(),
            text: None,
            span: None,
            help: None,
            others: Vec::new(),
        }))
    }

    /// What is wrong, without the place.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// Allowed names or ranges and the nearest right word, where that helps.
    #[must_use]
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// What the scene was read from: a file, or the name of a text.
    #[must_use]
    pub fn origin(&self) -> &str {
        &self.0.origin
    }

    /// Line and column in the scene file, from 1, where there is one place to point to.
    #[must_use]
    pub fn position(&self) -> Option<(usize, usize)> {
        self.0.position
    }

    /// Path of the key there, as `material.young`.
    #[must_use]
    pub fn key(&self) -> Option<&str> {
        self.0.key.as_deref()
    }

    /// What else is wrong, found at the same time.
    pub fn others(&self) -> impl Iterator<Item = SceneError> {
        self.0.others.iter().map(|report| SceneError(Box::new(report.clone())))
    }

    /// The error with other words in its message and help, by pairs of what stands there and what is to: where options of the
    /// program go by other names.
    #[must_use]
    pub fn reworded(&self, words: &[(&str, &str)]) -> Self {
        let mut report = self.0.clone();
        for (there, here) in words {
            report.message = report.message.replace(there, here);
            report.help = report.help.map(|help| help.replace(there, here));
        }
        Self(report)
    }

    /// The error with its lines of the scene and help, in colours or without, for a terminal.
    #[must_use]
    pub fn rendered(&self, colours: bool) -> String {
        let mut out = String::new();
        let theme = match colours {
            true => GraphicalTheme::unicode(),
            false => GraphicalTheme::unicode_nocolor(),
        };
        match GraphicalReportHandler::new_themed(theme).render_report(&mut out, &*self.0) {
            Ok(()) => out,
            Err(_) => self.to_string(),
        }
    }
}

/// The texts a scene was read from, with the places of its keys.
#[derive(Debug, Clone)]
pub(crate) struct Origin {
    pub(crate) name: String,
    pub(crate) text: Arc<str>,
    pub(crate) overrides: Vec<Arc<str>>,
    /// How many of them are `--set`.
    pub(crate) set: usize,
    /// The option that gives the others.
    pub(crate) other: &'static str,
    pub(crate) index: Index,
}

impl Origin {
    /// The option that gives override `k`, and which of its kind it is, in words.
    pub(crate) fn option(&self, k: usize) -> (&'static str, String) {
        match k.checked_sub(self.set) {
            None => ("--set", format!("--set number {}", k + 1)),
            Some(k) => (self.other, format!("{} number {}", self.other, k + 1)),
        }
    }

    /// Combines problems into one error; `None` where there are none.
    pub(crate) fn report(&self, problems: &[DocumentError]) -> Option<SceneError> {
        let mut errors = problems.iter().take(MAX_REPORTED).map(|problem| self.error(problem));
        let mut first = errors.next()?;
        first.0.others = errors.map(|error| *error.0).collect();
        if let Some(more) = problems.len().checked_sub(MAX_REPORTED).filter(|more| *more > 0) {
            let message = format!("and {more} more; fix these first");
            first.0.others.push(*self.error(&DocumentError::plain(message)).0);
        }
        Some(first)
    }

    /// Gives a problem the text around it.
    pub(crate) fn error(&self, problem: &DocumentError) -> SceneError {
        let Explanation { message, label, help } = problem.explain();
        let mut report = Report {
            message,
            origin: self.name.clone(),
            position: None,
            key: problem.place().and_then(|place| self.index.key_at(place)),
            text_label: label,
            text: None,
            span: None,
            help,
            others: Vec::new(),
        };
        if let Some(place) = problem.place() {
            let number = place.source.checked_sub(1);
            let from_override = number.and_then(|k| Some((k, self.overrides.get(k)?)));
            let text = from_override.map_or(&self.text, |(_, text)| text);
            let mut name = self.name.as_str();
            match from_override {
                Some((k, text)) => {
                    name = self.option(k).0;
                    report.origin = format!("{name} {text}");
                }
                None => report.position = Some(line_and_column(text, place.span.start)),
            }
            let start = place.span.start.min(text.len());
            let end = place.span.end.clamp(start, text.len());
            let text = Excerpt(Arc::clone(text));
            report.span = Some((start, text.end(start, end) - start).into());
            report.text = Some(NamedSource::new(name, text));
        }
        SceneError(Box::new(report))
    }
}

/// Line and column of a byte, both from 1; columns count characters.
fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let line = before.iter().filter(|b| **b == b'\n').count() + 1;
    let start = before.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
    // Continuation bytes of a character begin with the bits 10.
    let column = before[start..].iter().filter(|b| **b & 0xc0 != 0x80).count() + 1;
    (line, column)
}
