//! What a reader takes at a path, found out by giving it values there.
//!
//! A value is refused where the reader's problem is about that very place: of another type, out of range, an unknown
//! name. A problem elsewhere, as of a key that is missing beside it, says nothing about the value.

use serde_json::Value as Json;

use crate::document::{DocumentError, Key, Node, Place, Segment, Value};
use crate::scene::misplaced_key::Reader;

/// What no key and no name is.
pub(super) const UNKNOWN_WORD: &str = "?";

/// Tables and lists within one another that are described; regions of a field of a drag have ten.
const MAX_DEPTH: usize = 12;

/// Keys of regions that are made of others.
const COMBINATIONS: [&str; 3] = ["all-of", "any-of", "not"];

/// A place to which values can be given.
#[derive(Clone)]
pub(super) struct Probe {
    reader: Reader,
    steps: Vec<Step>,
}

/// One step from the root to it.
#[derive(Clone)]
enum Step {
    /// A key, with the entries that stand before it in its table.
    Key(String, Vec<(String, Value)>),
    /// The first element of a list.
    Item,
}

/// What is known of a place.
pub(super) struct Described {
    /// Its schema; accepts all where nothing is known.
    pub(super) schema: Json,
    /// A value that it takes.
    pub(super) example: Option<Value>,
}

impl Probe {
    /// The root of what `reader` reads.
    pub(super) fn new(reader: Reader) -> Self {
        Self { reader, steps: Vec::new() }
    }

    /// The value of `key` in a table here that has these entries as well.
    pub(super) fn key(&self, key: &str, beside: &[(String, Value)]) -> Self {
        let mut below = self.clone();
        below.steps.push(Step::Key(key.to_owned(), beside.to_vec()));
        below
    }

    pub(super) fn item(&self) -> Self {
        let mut below = self.clone();
        below.steps.push(Step::Item);
        below
    }

    /// Whether it is below so many others, or in a region of a region of a region: regions within others are described once.
    pub(super) fn is_too_deep(&self) -> bool {
        let combines = |step: &&Step| matches!(step, Step::Key(key, _) if COMBINATIONS.contains(&key.as_str()));
        let recurs = self.steps.last().as_ref().is_some_and(combines)
            && self.steps.iter().filter(combines).count() > 1;
        recurs || self.steps.len() > MAX_DEPTH
    }

    /// What is wrong if `value` stands here, wherever it is wrong.
    pub(super) fn problem(&self, value: Value) -> Option<DocumentError> {
        let mut value = value;
        for step in self.steps.iter().rev() {
            value = match step {
                Step::Item => Value::Array(vec![node(value)]),
                Step::Key(key, beside) => {
                    let mut entries = beside.clone();
                    entries.push((key.clone(), value));
                    table_of(entries)
                }
            };
        }
        (self.reader)(node(value))
    }

    /// Whether a problem is about the value here itself, not about one inside or beside it.
    pub(super) fn concerns(&self, problem: &DocumentError) -> bool {
        let path = problem.path();
        let same = |(step, segment): (&Step, &Segment)| match (step, segment) {
            (Step::Key(key, _), Segment::Key(name)) => key == name,
            (Step::Item, Segment::Index(0)) => true,
            _ => false,
        };
        path.len() == self.steps.len() && self.steps.iter().zip(&path).all(same)
    }

    /// Why `value` cannot stand here for its type or range, if it cannot.
    pub(super) fn refusal(&self, value: Value) -> Option<String> {
        let problem = self.problem(value)?;
        let expected = problem.expected().map(str::to_owned);
        expected.filter(|_| self.concerns(&problem))
    }

    /// The names that can stand here, as the error about another one lists them.
    pub(super) fn names(&self) -> Option<Vec<String>> {
        let problem = self.problem(Value::String(UNKNOWN_WORD.to_owned()))?;
        let named = problem.as_unknown_name().is_some() && self.concerns(&problem);
        named.then(|| problem.allowed().to_vec())
    }
}

/// A value without a place.
pub(super) fn node(value: Value) -> Node {
    Node { value, place: Place { source: 0, span: 0..0 } }
}

/// A table without places.
pub(super) fn table_of(entries: Vec<(String, Value)>) -> Value {
    let place = Place { source: 0, span: 0..0 };
    let entry = |(name, value)| (Key { name, place: place.clone() }, node(value));
    Value::Table(entries.into_iter().map(entry).collect())
}
