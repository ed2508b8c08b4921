//! What a command has found: labelled lines of text, or the same as one JSON document.

use std::fmt::Display;

use serde_json::{Map, Value};

/// Labelled lines. In JSON a label is a key, with a value, or with the list of those that may be several.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// Characters before the text of a line.
    width: usize,
    lines: Vec<String>,
    document: Map<String, Value>,
}

impl Findings {
    pub(super) fn new(width: usize) -> Self {
        Self { width, ..Self::default() }
    }

    /// A line without a label, of the text alone.
    pub(super) fn line(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// A value of the document alone.
    pub(super) fn set(&mut self, key: &str, value: impl Into<Value>) {
        self.document.insert(key.to_owned(), value.into());
    }

    /// A value of a list of the document alone.
    pub(super) fn add(&mut self, key: &str, value: impl Into<Value>) {
        let list = self.document.entry(key).or_insert_with(|| Value::Array(Vec::new()));
        if let Value::Array(list) = list {
            list.push(value.into());
        }
    }

    fn labelled(&mut self, label: &str, text: &str) {
        self.lines.push(format!("{label:<width$}{text}", width = self.width));
    }

    /// The line of a label that there is once.
    pub(super) fn one(&mut self, label: &str, text: impl Display) {
        let text = text.to_string();
        self.labelled(label, &text);
        self.set(label, text);
    }

    /// A line of a label that there may be several of, with what the document has for it.
    pub(super) fn each(&mut self, label: &str, text: impl Display, value: impl Into<Value>) {
        self.labelled(label, &text.to_string());
        self.add(label, value);
    }

    /// A line that continues the one before; in the document it has a key of its own.
    pub(super) fn more(&mut self, key: &str, text: impl Display) {
        let text = text.to_string();
        self.labelled("", &text);
        self.add(key, text);
    }

    /// Prints the lines, or the document.
    pub(super) fn print(&self, json: bool) {
        match json {
            true => say!("{}", serde_json::to_string_pretty(&self.document).unwrap_or_default()),
            false => self.lines.iter().for_each(|line| say!("{line}")),
        }
    }
}
