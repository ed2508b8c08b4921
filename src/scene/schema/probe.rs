//! What a reader takes at a path, found out by giving it values there.
//!
//! A value is refused where the reader's problem is about that very place: of another type, out of range, an unknown
//! name. A problem elsewhere, as of a key that is missing beside it, says nothing about the value.

use serde_json::{Value as Json, json};

use super::meaning::Meanings;
use super::{numbers, table};
use crate::document::{DocumentError, Key, Node, Place, Segment, Value};
use crate::scene::misplaced_key::Reader;

/// What no key and no name is.
pub(super) const UNKNOWN_WORD: &str = "?";

/// Tables and lists within one another that are described; regions of a field of a drag have ten.
const MAX_DEPTH: usize = 12;

/// Keys of regions that are made of others.
const COMBINATIONS: [&str; 3] = ["all-of", "any-of", "not"];

/// Texts of which every free text takes one: any, an axis, a formula.
const FREE_TEXTS: [&str; 4] = [UNKNOWN_WORD, "x", "1", "a.vtu"];

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

    fn item(&self) -> Self {
        let mut below = self.clone();
        below.steps.push(Step::Item);
        below
    }

    /// Whether it stands in a region of a region of a region: regions within others are described once.
    fn recurs(&self) -> bool {
        let combines = |step: &&Step| matches!(step, Step::Key(key, _) if COMBINATIONS.contains(&key.as_str()));
        self.steps.last().as_ref().is_some_and(combines)
            && self.steps.iter().filter(combines).count() > 1
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

/// What can stand at a place.
pub(super) fn describe(probe: &Probe, meanings: &Meanings) -> Described {
    if probe.steps.len() > MAX_DEPTH || probe.recurs() {
        return Described { schema: json!({}), example: None };
    }
    let mut all = Vec::new();
    all.extend(texts(probe));
    all.extend(truths(probe));
    all.extend(numbers::numbers(probe));
    all.extend(table::tables(probe, meanings));
    all.extend(list(probe, meanings));
    let example = all.iter_mut().find_map(|one| one.example.take());
    let mut schemas: Vec<Json> = all.into_iter().map(|one| one.schema).collect();
    let mut schema = match schemas.len() {
        0 => json!({}),
        1 => schemas.remove(0),
        _ => json!({ "anyOf": schemas }),
    };
    if let (Some(text), Json::Object(object)) = (meanings.own_text(), &mut schema) {
        object.insert("description".to_owned(), text.into());
    }
    Described { schema, example }
}

/// Names, or any text.
fn texts(probe: &Probe) -> Option<Described> {
    let text = |text: &str| Value::String(text.to_owned());
    if let Some(names) = probe.names() {
        // Some of them need a value, and so a table.
        let alone = |name: &String| {
            !probe.problem(text(name)).is_some_and(|problem| probe.concerns(&problem))
        };
        let names: Vec<String> = names.into_iter().filter(alone).collect();
        let first = names.first().map(|name| text(name));
        return first
            .map(|first| Described { schema: json!({ "enum": names }), example: Some(first) });
    }
    let taken = FREE_TEXTS.into_iter().find(|one| probe.refusal(text(one)).is_none())?;
    Some(Described { schema: json!({ "type": "string" }), example: Some(text(taken)) })
}

/// `true`, `false` or both.
fn truths(probe: &Probe) -> Option<Described> {
    let taken = |value: &bool| probe.refusal(Value::Boolean(*value)).is_none();
    let all: Vec<bool> = [true, false].into_iter().filter(taken).collect();
    let schema = if all.len() == 2 { json!({ "type": "boolean" }) } else { json!({ "enum": all }) };
    all.first().map(|first| Described { schema, example: Some(Value::Boolean(*first)) })
}

/// A list, with the numbers of elements that it can have.
fn list(probe: &Probe, meanings: &Meanings) -> Option<Described> {
    const MAX_ENTRIES: usize = 6;
    let of = |item: &Value, length| Value::Array(vec![node(item.clone()); length]);
    // Of a wrong element the reader complains about that, not about the list.
    let wrong = Value::Date(String::new());
    if [0, 1].into_iter().all(|length| probe.refusal(of(&wrong, length)).is_some()) {
        return None;
    }
    let item = describe(&probe.item(), meanings);
    let mut schema = json!({ "type": "array", "items": item.schema });
    let example = item.example?;
    let fits = |length: &usize| probe.refusal(of(&example, *length)).is_none();
    let lengths: Vec<usize> = (0..=MAX_ENTRIES).filter(fits).collect();
    let (least, most) = (*lengths.first()?, *lengths.last()?);
    if least > 0 {
        schema["minItems"] = least.into();
    }
    if most < MAX_ENTRIES {
        schema["maxItems"] = most.into();
    }
    Some(Described { schema, example: Some(of(&example, least)) })
}
