//! Bytes that the page holds as base64, each once.

use std::collections::HashMap;
use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

/// Bytes of the element around a block, about.
const ELEMENT_BYTES: usize = 64;

/// The blocks of a page.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    known: HashMap<Vec<u8>, usize>,
    html: String,
}

impl Blocks {
    /// Adds `bytes`; the number of their block, which may be that of equal bytes.
    pub(super) fn add(&mut self, bytes: Vec<u8>) -> usize {
        if let Some(number) = self.known.get(&bytes) {
            return *number;
        }
        let number = self.known.len();
        let text = BASE64.encode(&bytes);
        let _ = writeln!(
            self.html,
            "<script type=\"text/plain\" id=\"block-{number}\">{text}</script>"
        );
        self.known.insert(bytes, number);
        number
    }

    /// All of them as HTML.
    pub(super) fn html(&self) -> &str {
        &self.html
    }

    /// Bytes that a block of so many bytes takes in the page.
    pub(super) fn size(bytes: usize) -> usize {
        bytes.div_ceil(3) * 4 + ELEMENT_BYTES
    }
}
