//! What is wrong with one value, collected on the way from where it was noticed to the root.

use std::fmt::Display;

use serde::de::{Expected, Unexpected};

use super::{Place, Segment, key_path};

/// A problem inside a document: what was expected, where, and under which key.
///
/// It is the error type of deserialisation, so a `Deserialize` implementation that calls
/// `Error::invalid_value(Unexpected::Float(x), &"a number above 0")` ends as
/// `material.young must be a number above 0, not -1.0` at the place of that number.
#[derive(Debug, Clone)]
pub struct DocumentError(Box<Inner>);

#[derive(Debug, Clone)]
struct Inner {
    what: What,
    help: Option<String>,
    place: Option<Place>,
    /// Innermost step first.
    path: Vec<Segment>,
}

#[derive(Debug, Clone)]
enum What {
    Syntax(String),
    Custom(String),
    Missing { noun: &'static str, key: String },
    UnknownKey { key: String, allowed: Vec<String> },
    UnknownName { noun: String, name: String, allowed: Vec<String> },
    Mismatch { expected: String, found: String },
}

impl DocumentError {
    fn new(what: What) -> Self {
        Self(Box::new(Inner { what, help: None, place: None, path: Vec::new() }))
    }

    /// A problem in plain words at a known place.
    pub fn located(place: Place, message: impl Display) -> Self {
        Self::new(What::Custom(message.to_string())).placed(&place)
    }

    /// A problem in plain words whose place is yet to be given.
    pub fn plain(message: impl Into<String>) -> Self {
        Self::new(What::Custom(message.into()))
    }

    /// The text is not TOML.
    pub fn syntax(message: &str, place: Option<Place>) -> Self {
        let mut problem = Self::new(What::Syntax(message.to_owned()));
        problem.0.place = place;
        problem
    }

    /// A table that must be there is not.
    pub fn missing_table(key: &str) -> Self {
        Self::new(What::Missing { noun: "table", key: format!("[{key}]") })
    }

    /// A key that must be there is not.
    pub fn missing_key(key: &str) -> Self {
        Self::new(What::Missing { noun: "key", key: key.to_owned() })
    }

    /// A key that is none of `allowed`.
    pub fn unknown_key<S: AsRef<str>>(key: &str, allowed: &[S]) -> Self {
        Self::new(What::UnknownKey { key: key.to_owned(), allowed: words(allowed) })
    }

    /// A name that is none of `allowed`; `noun` says what it should name.
    pub fn unknown_name<S: AsRef<str>>(noun: &str, name: &str, allowed: &[S]) -> Self {
        Self::new(What::UnknownName {
            noun: noun.to_owned(),
            name: name.to_owned(),
            allowed: words(allowed),
        })
    }

    /// A value of the wrong type.
    pub fn mismatch(expected: &str, found: String) -> Self {
        Self::new(What::Mismatch { expected: expected.to_owned(), found })
    }

    /// Adds advice, unless there is some.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help.get_or_insert_with(|| help.into());
        self
    }

    /// Sets the place, unless a nearer one is known.
    #[must_use]
    pub fn placed(mut self, place: &Place) -> Self {
        self.0.place.get_or_insert_with(|| place.clone());
        self
    }

    /// Says in which table entry the problem is.
    #[must_use]
    pub fn under(mut self, key: &str) -> Self {
        self.0.path.push(Segment::Key(key.to_owned()));
        self
    }

    /// Says in which list element the problem is.
    #[must_use]
    pub fn under_index(mut self, index: usize) -> Self {
        self.0.path.push(Segment::Index(index));
        self
    }

    /// Adds words that are also allowed: keys that were taken out of a table before the rest of it
    /// was read, or names that are distinguished elsewhere.
    ///
    /// Only a problem with this very table or value is concerned, not one further inside.
    #[must_use]
    pub fn also_allowed(mut self, keys: &[&str]) -> Self {
        if self.0.path.is_empty()
            && let What::UnknownKey { allowed, .. } | What::UnknownName { allowed, .. } =
                &mut self.0.what
        {
            let mut all = words(keys);
            all.append(allowed);
            *allowed = all;
        }
        self
    }

    /// The key of this very table that is not known.
    pub(crate) fn unknown_key_here(&self) -> Option<&str> {
        match &self.0.what {
            What::UnknownKey { key, .. } if self.0.path.is_empty() => Some(key),
            _ => None,
        }
    }

    /// The name that is unknown, where it is one.
    pub fn as_unknown_name(&self) -> Option<&str> {
        match &self.0.what {
            What::UnknownName { name, .. } => Some(name),
            _ => None,
        }
    }

    /// What could stand there, where a key or name is unknown.
    pub fn allowed(&self) -> &[String] {
        match &self.0.what {
            What::UnknownKey { allowed, .. } | What::UnknownName { allowed, .. } => allowed,
            _ => &[],
        }
    }

    /// Keys and indices from the root to the value that is wrong.
    #[must_use]
    pub fn path(&self) -> Vec<Segment> {
        self.0.path.iter().rev().cloned().collect()
    }

    /// The key that is missing, where one is.
    #[must_use]
    pub fn missing(&self) -> Option<&str> {
        match &self.0.what {
            What::Missing { key, .. } => Some(key),
            _ => None,
        }
    }

    /// What was expected, where the value is of the wrong type or out of range.
    #[must_use]
    pub fn expected(&self) -> Option<&str> {
        match &self.0.what {
            What::Mismatch { expected, .. } => Some(expected),
            _ => None,
        }
    }

    /// Whether a key is unknown, of whatever table.
    #[must_use]
    pub fn is_unknown_key(&self) -> bool {
        matches!(self.0.what, What::UnknownKey { .. })
    }

    /// Whether the text is not TOML at all.
    pub fn is_syntax(&self) -> bool {
        matches!(self.0.what, What::Syntax(_))
    }

    /// Where the problem is, if that is known.
    pub fn place(&self) -> Option<&Place> {
        self.0.place.as_ref()
    }

    /// Message, short label for the place, and advice.
    pub fn explain(&self) -> Explanation {
        let path = key_path(self.0.path.iter().rev());
        let (message, label, mut help) = match &self.0.what {
            What::Syntax(m) => (format!("not valid TOML: {m}"), m.clone(), None),
            What::Custom(m) if path.is_empty() => (m.clone(), "here".to_owned(), None),
            What::Custom(m) => (format!("{path}: {m}"), "here".to_owned(), None),
            What::Missing { noun, key } => {
                let message = format!("missing {noun} {key}{}", place_in_words(&path));
                (message, format!("{key} is needed"), None)
            }
            What::UnknownKey { key, allowed } => {
                let message = format!("unknown key {key}{}", place_in_words(&path));
                (
                    message,
                    "not a key of this table".to_owned(),
                    Some(formula_in_a_table(key, allowed).unwrap_or_else(|| choices(key, allowed))),
                )
            }
            What::UnknownName { noun, name, allowed } => {
                let message = match path.as_str() {
                    "" => format!("unknown {noun} {name:?}"),
                    _ => format!("{path}: unknown {noun} {name:?}"),
                };
                (message, format!("unknown {noun}"), Some(choices(name, allowed)))
            }
            What::Mismatch { expected, found } => {
                let subject = if path.is_empty() { "the value" } else { &path };
                let message = format!("{subject} must be {expected}, not {found}");
                (message, format!("must be {expected}"), None)
            }
        };
        if self.0.help.is_some() {
            help.clone_from(&self.0.help);
        }
        Explanation { message, label, help }
    }
}

/// A problem in words.
pub struct Explanation {
    /// What is wrong.
    pub message: String,
    /// What stands beside the place.
    pub label: String,
    /// What to write instead.
    pub help: Option<String>,
}

fn words<S: AsRef<str>>(allowed: &[S]) -> Vec<String> {
    allowed.iter().map(|s| s.as_ref().to_owned()).collect()
}

fn place_in_words(path: &str) -> String {
    match path {
        "" => String::new(),
        _ if path.ends_with(']') => format!(" in {path}"),
        _ => format!(" in [{path}]"),
    }
}

/// The help where a formula has a table around it, and the table is one by regions or of a file.
fn formula_in_a_table(key: &str, allowed: &[String]) -> Option<String> {
    let has = |wanted: &str| allowed.iter().any(|known| known == wanted);
    (key == "formula" && has("regions") && has("file")).then(|| {
        format!(
            "a formula is written as a string, without a table around it, as in \"1 + 0.1*x\"; {ALLOWED_TITLE}: {}",
            allowed.join(", ")
        )
    })
}

/// What else could stand there, after what to write in place of a key or name that was removed.
fn choices(name: &str, allowed: &[String]) -> String {
    let choices = choices_in_words(name, ALLOWED_TITLE, allowed);
    match removed(name, allowed) {
        Some(instead) => format!("{name} is removed: {instead}; {choices}"),
        None => choices,
    }
}

/// What to write instead of a key or name that was removed from those `allowed` at its place.
fn removed(name: &str, allowed: &[String]) -> Option<&'static str> {
    let (one_of_them, instead) = match name {
        "fire" => {
            ("lbfgs", "write \"lbfgs\", the default, or \"descent\" for the overdamped motion")
        }
        "exponential" => {
            ("chebyshev", "write \"bdf\" for fast kinetics, or \"chebyshev\", the default")
        }
        "none" => ("multigrid", "write \"blocks\", or \"auto\", the default"),
        "gauss-bonnet" => ("crossings", "leave it out"),
        _ => return None,
    };
    allowed.iter().any(|name| name == one_of_them).then_some(instead)
}

/// What a list of choices is called.
pub const ALLOWED_TITLE: &str = "allowed";

/// "did you mean …? allowed: …", or what else `title` calls them; a word counts as meant when it is spelt
/// much the same.
pub fn choices_in_words(word: &str, title: &str, allowed: &[String]) -> String {
    if allowed.is_empty() {
        return format!("{title}: none");
    }
    let first = allowed.get(..MAX_LISTED).unwrap_or(allowed);
    let more = if first.len() < allowed.len() { ", …" } else { "" };
    let list = format!("{title}: {}{more}", first.join(", "));
    match nearest(word, allowed) {
        Some(meant) => format!("did you mean {meant}? {list}"),
        None => list,
    }
}

/// So many allowed words are listed.
const MAX_LISTED: usize = 100;

/// Longer words (bytes) are no misspelt ones; to compare them takes their length times that of every
/// allowed one.
const LONGEST_WORD: usize = 200;

/// The closest of `allowed` by edits, one per started three letters (at least one) or a
/// common beginning.
fn nearest<'a>(word: &str, allowed: &'a [String]) -> Option<&'a String> {
    if word.len() > LONGEST_WORD {
        return None;
    }
    let lower = word.to_lowercase();
    allowed
        .iter()
        .filter(|candidate| candidate.len() <= LONGEST_WORD)
        .map(|candidate| {
            (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate)
        })
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, candidate)| {
            let letters = word.chars().count().max(candidate.chars().count());
            *distance <= letters.div_ceil(3)
                || (lower.len() >= 3 && candidate.to_lowercase().starts_with(&lower))
        })
        .map(|(_, candidate)| candidate)
}

/// What integers are called.
const INTEGER: &str = "an integer";

fn expected_in_words(expected: &dyn Expected) -> String {
    let raw = expected.to_string();
    match raw.as_str() {
        "f64" | "f32" => "a number".to_owned(),
        "usize" | "u64" | "u32" | "u16" | "u8" => format!("{INTEGER} from 0"),
        "isize" | "i64" | "i32" | "i16" | "i8" => INTEGER.to_owned(),
        "a string" | "string" => "a string in quotes".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" => "a table".to_owned(),
        "path string" => "a path in quotes".to_owned(),
        _ if raw.starts_with("struct ") || raw.starts_with("unit struct ") => "a table".to_owned(),
        _ if raw.starts_with("enum ") => "a name or a table".to_owned(),
        _ => match raw.strip_prefix("an array of length ").or(raw.strip_prefix("a tuple of size "))
        {
            Some(n) => format!("a list of {n} values"),
            None => raw,
        },
    }
}

fn found_in_words(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(b) => b.to_string(),
        Unexpected::Unsigned(i) => i.to_string(),
        Unexpected::Signed(i) => i.to_string(),
        Unexpected::Float(x) => format!("{x:?}"),
        Unexpected::Char(c) => format!("the string {c:?}"),
        Unexpected::Str(s) => format!("the string {s:?}"),
        Unexpected::Seq => "a list".to_owned(),
        Unexpected::Map => "a table".to_owned(),
        other => other.to_string(),
    }
}

impl Display for DocumentError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.explain().message)
    }
}

impl std::error::Error for DocumentError {}

impl serde::de::Error for DocumentError {
    fn custom<T: Display>(message: T) -> Self {
        Self::new(What::Custom(message.to_string()))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let expectation = expected_in_words(expected);
        let problem = Self::mismatch(&expectation, found_in_words(found));
        match found {
            Unexpected::Float(x) if expectation.starts_with(INTEGER) && x.fract() == 0.0 => {
                problem.help(format!("write {x:.0}, without a point or exponent"))
            }
            _ => problem,
        }
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        Self::mismatch(&expected_in_words(expected), format!("a list of {length}"))
    }

    fn unknown_variant(name: &str, allowed: &'static [&'static str]) -> Self {
        Self::unknown_name("name", name, allowed)
    }

    fn unknown_field(key: &str, allowed: &'static [&'static str]) -> Self {
        Self::unknown_key(key, allowed)
    }

    fn missing_field(key: &'static str) -> Self {
        Self::missing_key(key)
    }
}
