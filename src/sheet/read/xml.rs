//! Just enough XML for VTK's files: tags, attributes and the text between them.
//!
//! VTK puts raw bytes into an XML file, so it is taken as bytes and never as one string. Comments,
//! declarations and the five named entities are understood; document types are not, on purpose.

/// A piece of the file.
#[derive(Debug)]
pub(super) enum Token<'a> {
    /// `<name …>`, or `<name …/>`.
    Start(Tag<'a>),
    /// `</name>`.
    End(&'a str),
    /// What stands between tags, undecoded.
    Text(&'a [u8]),
}

/// An opening tag.
#[derive(Debug, Clone)]
pub(super) struct Tag<'a> {
    pub(super) name: &'a str,
    attributes: Vec<(&'a str, String)>,
    /// Closed at once by `/>`.
    pub(super) empty: bool,
    /// Line of the file.
    pub(super) line: usize,
}

impl Tag<'_> {
    /// The value of an attribute.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.0 == name).map(|a| a.1.as_str())
    }

    /// An attribute that holds an integer.
    pub(super) fn count(&self, name: &str) -> Result<Option<usize>, String> {
        self.get(name)
            .map(|text| {
                text.trim()
                    .parse()
                    .map_err(|_| format!("line {}: {name}=\"{text}\" is not an integer", self.line))
            })
            .transpose()
    }
}

/// Walks through a file.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1 }
    }

    /// Everything that has not been walked through.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The line that has been reached.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// The next piece; `None` at the end of the file.
    pub(super) fn token(&mut self) -> Result<Option<Token<'a>>, String> {
        loop {
            let rest = self.rest();
            let Some(&first) = rest.first() else { return Ok(None) };
            if first != b'<' {
                let length = rest.iter().position(|&b| b == b'<').unwrap_or(rest.len());
                return Ok(Some(Token::Text(self.take(length))));
            }
            if rest.starts_with(b"<?") {
                self.skip_past(b"?>")?;
            } else if rest.starts_with(b"<!--") {
                self.skip_past(b"-->")?;
            } else if rest.starts_with(b"<!") {
                return Err(format!("line {}: document types are not read", self.line));
            } else {
                return self.tag().map(Some);
            }
        }
    }

    fn take(&mut self, length: usize) -> &'a [u8] {
        let taken = &self.rest()[..length];
        self.at += length;
        self.line += taken.iter().filter(|&&b| b == b'\n').count();
        taken
    }

    fn skip_past(&mut self, end: &[u8]) -> Result<(), String> {
        let found = self.rest().windows(end.len()).position(|w| w == end);
        let length = found.ok_or_else(|| self.cut_short())?;
        self.take(length + end.len());
        Ok(())
    }

    fn cut_short(&self) -> String {
        format!("line {}: the file ends in the middle of a tag", self.line)
    }

    fn tag(&mut self) -> Result<Token<'a>, String> {
        let line = self.line;
        let mut quote = None;
        let end = self.rest().iter().position(|&b| match (quote, b) {
            (None, b'>') => true,
            (None, b'"' | b'\'') => {
                quote = Some(b);
                false
            }
            (Some(q), _) if q == b => {
                quote = None;
                false
            }
            _ => false,
        });
        let length = end.ok_or_else(|| self.cut_short())?;
        let inside = std::str::from_utf8(&self.take(length + 1)[1..length])
            .map_err(|_| format!("line {line}: a tag that is not text"))?;
        if let Some(name) = inside.strip_prefix('/') {
            return Ok(Token::End(name.trim()));
        }
        let empty = inside.ends_with('/');
        let inside = inside.strip_suffix('/').unwrap_or(inside);
        let split = inside.find(|c: char| c.is_ascii_whitespace()).unwrap_or(inside.len());
        let (name, mut rest) = inside.split_at(split);
        let mut attributes = Vec::new();
        loop {
            rest = rest.trim_start();
            if rest.is_empty() {
                break;
            }
            let (key, value, after) = attribute(rest)
                .ok_or_else(|| format!("line {line}: bad attribute in the tag <{name}>"))?;
            attributes.push((key, value));
            rest = after;
        }
        Ok(Token::Start(Tag { name, attributes, empty, line }))
    }
}

/// Splits `key="value" rest`.
fn attribute(text: &str) -> Option<(&str, String, &str)> {
    let (key, after) = text.split_once('=')?;
    let after = after.trim_start();
    let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    let (value, after) = after[1..].split_once(quote)?;
    let mut value = value.to_owned();
    // The ampersand last, or it would make new entities.
    for (entity, meaning) in
        [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")]
    {
        if value.contains(entity) {
            value = value.replace(entity, meaning);
        }
    }
    Some((key.trim(), value, after))
}
