//! The lines of a text around a place, as messages show them: of a long line only what is near.

use std::sync::Arc;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Longest line that is shown as a whole, bytes. A longer one is unreadable, and far out in one that has
/// more than 65535 columns nothing can be pointed to.
const MAX_LINE_BYTES: usize = 1000;
/// So much of a longer one is shown on either side, bytes.
const CONTEXT_BYTES: usize = 60;

/// A text from which lines are shown.
#[derive(Debug, Clone)]
pub(super) struct Excerpt(pub(super) Arc<str>);

impl Excerpt {
    /// The end of what is pointed to from `start`: `end`, or before that where it is far.
    pub(super) fn end(&self, start: usize, end: usize) -> usize {
        if end - start > MAX_LINE_BYTES {
            self.0.floor_char_boundary(start + CONTEXT_BYTES)
        } else {
            end
        }
    }

    /// What is near `span` in its line.
    fn near(&self, span: &SourceSpan) -> MietteSpanContents<'_> {
        let at = self.0.floor_char_boundary(span.offset());
        let line = self.0[..at].rfind('\n').map_or(0, |end| end + 1);
        let end = self.0[at..].find('\n').map_or(self.0.len(), |length| at + length);
        let from = self.0.floor_char_boundary(at.saturating_sub(CONTEXT_BYTES)).max(line);
        let to = self.0.ceil_char_boundary(at + span.len() + CONTEXT_BYTES).min(end);
        let number = self.0[..line].matches('\n').count();
        let (part, place) = (&self.0.as_bytes()[from..to], (from, to - from).into());
        MietteSpanContents::new(part, place, number, from - line, 1)
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let found = self.0.read_span(span, before, after)?;
        if found.data().split(|byte| *byte == b'\n').all(|line| line.len() <= MAX_LINE_BYTES) {
            return Ok(found);
        }
        Ok(Box::new(self.near(span)))
    }
}
