//! A tree of values, each with the place where it is written, and errors that name such places: what settings are read
//! from, whatever the format of the file.

mod deserialize;
mod error;

use std::ops::Range;

pub use self::error::DocumentError;

pub use self::deserialize::read;
pub use self::error::{Explanation, choices_in_words};

/// Tables and lists may be nested this deep; scenes need five levels. The bound keeps every
/// recursion over a document far from the end of the stack.
pub const MAX_DEPTH: usize = 24;

/// Where something is written: a byte range of one of the texts a scene is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// 0 for the scene file, k for the k-th override (from 1).
    pub source: usize,
    /// Bytes of that text.
    pub span: Range<usize>,
}

/// One step of a key path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Segment {
    /// Key of a table.
    Key(String),
    /// Element of a list, from 0.
    Index(usize),
}

/// `a.b[0]."odd key"`: the notation of key paths in messages, overrides and `rumple::scene::Scene::error_at`.
pub fn key_path<'a>(segments: impl IntoIterator<Item = &'a Segment>) -> String {
    let mut path = String::new();
    for segment in segments {
        match segment {
            Segment::Index(i) => path.push_str(&format!("[{i}]")),
            Segment::Key(key) => {
                if !path.is_empty() {
                    path.push('.');
                }
                let bare = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
                if !key.is_empty() && key.chars().all(bare) {
                    path.push_str(key);
                } else {
                    path.push_str(&format!("{key:?}"));
                }
            }
        }
    }
    path
}

/// A key of a table.
#[derive(Debug, Clone)]
pub struct Key {
    /// The key itself, unquoted.
    pub name: String,
    /// Where it is written.
    pub place: Place,
}

/// A value of a scene document with its place.
#[derive(Debug, Clone)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Where it is written.
    pub place: Place,
}

/// What a [`Node`] holds; tables keep the order of the file.
#[derive(Debug, Clone)]
pub enum Value {
    /// A text.
    String(String),
    /// An integer of 64 bits.
    Integer(i64),
    /// A real number.
    Float(f64),
    /// A truth value.
    Boolean(bool),
    /// A date, which nothing takes.
    Date(String),
    /// A list.
    Array(Vec<Node>),
    /// A table.
    Table(Vec<(Key, Node)>),
}

impl Value {
    /// The value in words for messages; of a list or a table its type alone.
    pub fn describe(&self) -> String {
        match self {
            Self::String(s) => format!("the string {s:?}"),
            Self::Integer(i) => format!("{i}"),
            Self::Float(x) => format!("{x:?}"),
            Self::Boolean(b) => format!("{b}"),
            Self::Date(d) => format!("the date {d}"),
            Self::Array(_) => "a list".to_owned(),
            Self::Table(_) => "a table".to_owned(),
        }
    }
}

impl Node {
    /// A table without entries.
    pub fn empty_table(place: Place) -> Self {
        Self { value: Value::Table(Vec::new()), place }
    }

    /// A text that stands for what is not written, at the place where it could be.
    pub fn default_text(text: &str, place: Place) -> Self {
        Self { value: Value::String(text.to_owned()), place }
    }

    /// Whether this is a table.
    #[must_use]
    pub fn is_table(&self) -> bool {
        matches!(self.value, Value::Table(_))
    }

    /// The value of `key`, where this is a table that has it.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|(k, _)| k.name == key).map(|(_, v)| v),
            _ => None,
        }
    }

    /// Takes the entry of `key` out, where this is a table that has it.
    pub fn take(&mut self, key: &str) -> Option<(Key, Self)> {
        match &mut self.value {
            Value::Table(entries) => {
                let at = entries.iter().position(|(k, _)| k.name == key)?;
                Some(entries.remove(at))
            }
            _ => None,
        }
    }

    /// Adds an entry, where this is a table without one of that key.
    pub fn insert_if_absent(&mut self, key: &str, value: Value) {
        let place = self.place.clone();
        if self.get(key).is_none()
            && let Value::Table(entries) = &mut self.value
        {
            let name = key.to_owned();
            entries.push((Key { name, place: place.clone() }, Self { value, place }));
        }
    }

    /// Moves the places of everything inside by `offset` bytes.
    pub fn shift_children(&mut self, offset: usize) {
        let shift = |place: &mut Place| {
            place.span.start += offset;
            place.span.end += offset;
        };
        match &mut self.value {
            Value::Array(items) => {
                for item in items {
                    shift(&mut item.place);
                    item.shift_children(offset);
                }
            }
            Value::Table(entries) => {
                for (key, item) in entries {
                    shift(&mut key.place);
                    shift(&mut item.place);
                    item.shift_children(offset);
                }
            }
            _ => {}
        }
    }
}

/// Places of every key and value of a document, as a tree: their paths would need much more memory than it.
#[derive(Debug, Clone, Default)]
pub struct Index {
    entries: Vec<Entry>,
}

/// One key or element.
#[derive(Debug, Clone)]
struct Entry {
    segment: Segment,
    /// Of key and value.
    places: (Place, Place),
    inside: Vec<Entry>,
}

impl Entry {
    fn overridden(&self) -> bool {
        self.places.1.source > 0 || self.inside.iter().any(Self::overridden)
    }
}

impl Index {
    /// Collects the places of everything below `root`.
    pub fn new(root: &Node) -> Self {
        Self { entries: entries(root) }
    }

    /// Places of key and value at `path`, if it is written out.
    pub fn find_exact(&self, path: &str) -> Option<&(Place, Place)> {
        self.entry(path).map(|entry| &entry.places)
    }

    /// Whether an override gives the value at `path`, or a part of it.
    pub fn overridden(&self, path: &str) -> bool {
        self.entry(path).is_some_and(Entry::overridden)
    }

    /// The path of the innermost key whose name or value covers `place`.
    pub fn key_at(&self, place: &Place) -> Option<String> {
        fn within<'a>(entries: &'a [Entry], at: &Place, path: &mut Vec<&'a Segment>) -> bool {
            let covers = |of: &Place| {
                let span = &of.span;
                of.source == at.source && span.start <= at.span.start && at.span.end <= span.end
            };
            entries.iter().any(|Entry { segment, places: (key, value), inside }| {
                path.push(segment);
                let found = within(inside, at, path) || covers(key) || covers(value);
                if !found {
                    path.pop();
                }
                found
            })
        }
        let mut path = Vec::new();
        within(&self.entries, place, &mut path).then(|| key_path(path))
    }

    fn entry(&self, path: &str) -> Option<&Entry> {
        self.follow(path).filter(|(_, rest)| rest.is_empty()).map(|(entry, _)| entry)
    }

    /// Places of key and value at `path`, or of its nearest ancestor that is written out.
    pub fn find_nearest(&self, path: &str) -> Option<&(Place, Place)> {
        self.follow(path).map(|(entry, _)| &entry.places)
    }

    /// The last entry on `path`, and what of that is left.
    fn follow<'a>(&self, path: &'a str) -> Option<(&Entry, &'a str)> {
        let (mut entries, mut rest, mut found) = (&self.entries, path, None);
        while !rest.is_empty() {
            let key = if found.is_some() { rest.strip_prefix('.') } else { Some(rest) };
            let step = |entry: &Entry| {
                let rest = match entry.segment {
                    Segment::Key(_) => key?,
                    Segment::Index(_) => rest,
                };
                let after = rest.strip_prefix(&key_path([&entry.segment]))?;
                (after.is_empty() || after.starts_with(['.', '['])).then_some(after)
            };
            let next = entries.iter().find_map(|entry| Some((entry, step(entry)?)));
            let Some((entry, after)) = next else { break };
            (entries, rest, found) = (&entry.inside, after, Some((entry, after)));
        }
        found
    }
}

fn entries(node: &Node) -> Vec<Entry> {
    let entry = |segment, key: &Place, child: &Node| Entry {
        segment,
        places: (key.clone(), child.place.clone()),
        inside: entries(child),
    };
    match &node.value {
        Value::Array(items) => {
            let items = items.iter().enumerate();
            items.map(|(i, item)| entry(Segment::Index(i), &item.place, item)).collect()
        }
        Value::Table(pairs) => {
            let pairs = pairs.iter();
            pairs.map(|(key, at)| entry(Segment::Key(key.name.clone()), &key.place, at)).collect()
        }
        _ => Vec::new(),
    }
}
