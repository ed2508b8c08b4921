//! The text of a scene from its file, or why there is none; its document with the overrides.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use super::error::{Origin, SceneError};
use super::{overrides, toml_tree};
use crate::document::{DocumentError, Index, Node, Place};

/// Largest scene file (bytes): ten thousand times the longest that anybody has written by hand, and
/// read in a second.
const MAX_BYTES: u64 = 1 << 24;

/// Reads the file of a scene. What is not a plain file is not even opened: a pipe would wait for
/// a writer, and some devices never end.
pub(super) fn read(path: &Path) -> Result<String, SceneError> {
    let unreadable = |error| SceneError::unreadable(path, &error);
    let refuse = |message: &str| Err(unreadable(std::io::Error::other(message.to_owned())));
    let about = fs::metadata(path).map_err(unreadable)?;
    if about.is_dir() {
        return refuse("it is a directory, expected a file in TOML");
    }
    if !about.is_file() {
        return refuse("it is a device or a pipe, expected a file in TOML");
    }
    let mut bytes = Vec::new();
    // the size that the system reports may be out of date, or 0 where it is not known.
    let file = File::open(path).map_err(unreadable)?;
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        let size = about.len().max(MAX_BYTES + 1);
        return refuse(&format!("it has {size} bytes or more, and a scene at most {MAX_BYTES}"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let byte = error.as_bytes().get(at).copied().unwrap_or_default();
        // Up to there it is the same text.
        let text = String::from_utf8_lossy(error.as_bytes());
        let place = Place { source: 0, span: at..at + char::REPLACEMENT_CHARACTER.len_utf8() };
        let problem =
            DocumentError::located(place, format!("the byte 0x{byte:02x} here is not UTF-8"))
                .help("save the file in the encoding UTF-8");
        let origin = Origin {
            name: path.display().to_string(),
            text: Arc::from(text),
            overrides: Vec::new(),
            set: 0,
            other: OVER,
            index: Index::default(),
        };
        origin.error(&problem)
    })
}

/// The option that a second group of overrides comes from, if nothing else is said.
pub const OVER: &str = "--over";

/// A second group of overrides, and the option that they come from.
pub(super) type Others<'a> = (&'a [String], &'static str);

/// The document of a scene file after its overrides, its texts, and what each override set.
pub(super) type Changed = (Node, (Origin, Vec<String>));

/// Reads the scene file at `path` and applies the overrides, `set` before `others`.
pub(super) fn changed(
    path: &Path,
    set: &[String],
    others: Others<'_>,
) -> Result<Changed, SceneError> {
    document(&read(path)?, &path.display().to_string(), set, others)
}

/// The document of `text` with the overrides; `name` stands for its file in messages.
pub(super) fn document(
    text: &str,
    name: &str,
    set: &[String],
    (over, other): Others<'_>,
) -> Result<Changed, SceneError> {
    let overrides: Vec<Arc<str>> = set.iter().chain(over).map(|o| Arc::from(o.as_str())).collect();
    let mut origin = Origin {
        name: name.to_owned(),
        text: Arc::from(text),
        overrides,
        set: set.len(),
        other,
        index: Index::default(),
    };
    let mut root = toml_tree::document(text).map_err(|problem| origin.error(&problem))?;
    let (mut problems, mut keys) = (Vec::new(), Vec::new());
    for (k, change) in origin.overrides.iter().enumerate() {
        match overrides::apply(&mut root, change, k + 1) {
            Ok(key) => keys.push(key),
            Err(problem) => problems.push(problem),
        }
    }
    if let Some(error) = origin.report(&problems) {
        return Err(error);
    }
    origin.index = Index::new(&root);
    Ok((root, (origin, keys)))
}
