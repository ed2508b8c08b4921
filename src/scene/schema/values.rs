//! Values that a reader takes: names, texts, lists, and tables with their keys, which of them are needed, and how they depend
//! on the kind that a tag names.

use std::collections::BTreeSet;

use serde_json::{Map, Value as Json, json};

use super::meaning::Meanings;
use super::numbers::numbers;
use super::probe::{Described, Probe, UNKNOWN_WORD, node, table_of};
use crate::document::{DocumentError, Value};

/// Keys that name a kind, on which the other keys depend.
const TAGS: [&str; 3] = ["kind", "method", "shape"];

/// Keys that select other keys by being there: of a text, and of a list.
const SELECTORS: [&str; 2] = ["file", "regions"];

/// An entry of a table.
type Entry = (String, Value);

/// All forms of table that can stand at a place.
pub(super) fn tables(probe: &Probe, meanings: &Meanings) -> Vec<Described> {
    let mut all = Vec::new();
    if let Some((tag, names)) = tag(probe) {
        for name in names {
            let entry = (tag.to_owned(), text(&name));
            all.extend(closed(probe, &[entry], &meanings.of_kind(&name)));
        }
        let untagged = probe.problem(table_of(Vec::new()));
        if untagged.is_none_or(|problem| problem.missing() != Some(tag)) {
            all.extend(closed(probe, &[], meanings).map(|table| without(table, tag)));
        }
    } else if let Some(names) = variants(probe) {
        all.extend(names.iter().filter_map(|name| variant(probe, name, meanings)));
    } else if let Some(table) = closed(probe, &[], meanings) {
        all.push(table);
    } else {
        all.extend(open(probe, meanings));
    }
    for selector in SELECTORS {
        let value = if selector == "file" { text(UNKNOWN_WORD) } else { Value::Array(Vec::new()) };
        let entry = [(selector.to_owned(), value)];
        let selected = keys(probe, &entry).filter(|keys| keys.contains(selector));
        if selected.is_some() && selected != keys(probe, &[]) {
            all.extend(closed(probe, &entry, meanings));
        }
    }
    all
}

fn text(text: &str) -> Value {
    Value::String(text.to_owned())
}

/// What is wrong with a table of these entries and one of a key that none has.
fn refused(probe: &Probe, entries: &[Entry]) -> Option<DocumentError> {
    let mut entries = entries.to_vec();
    entries.push((UNKNOWN_WORD.to_owned(), table_of(Vec::new())));
    probe.problem(table_of(entries))
}

/// The keys of a table with these entries, where it has no others.
fn keys(probe: &Probe, entries: &[Entry]) -> Option<BTreeSet<String>> {
    let problem = refused(probe, entries)?;
    let closed = problem.is_unknown_key() && probe.concerns(&problem);
    closed.then(|| problem.allowed().iter().cloned().collect())
}

/// The key that names the kind of a table here, and the kinds.
fn tag(probe: &Probe) -> Option<(&'static str, Vec<String>)> {
    let base = keys(probe, &[]);
    TAGS.into_iter().find_map(|tag| {
        let problem = probe.problem(table_of(vec![(tag.to_owned(), text(UNKNOWN_WORD))]))?;
        let below = probe.key(tag, &[]);
        let named = problem.as_unknown_name().is_some();
        if !named || !(probe.concerns(&problem) || below.concerns(&problem)) {
            return None;
        }
        let names = problem.allowed().to_vec();
        let of = |name: &String| keys(probe, &[(tag.to_owned(), text(name))]);
        // Of an enum of tables, this is one name of many.
        let read: Vec<_> = names.iter().map(of).collect();
        let depends = read.iter().any(|keys| *keys != base);
        (depends && read.iter().any(Option::is_some)).then_some((tag, names))
    })
}

/// The names of a table with one entry, whose key is one of them.
fn variants(probe: &Probe) -> Option<Vec<String>> {
    let problem = refused(probe, &[])?;
    let named = problem.as_unknown_name().is_some() && probe.concerns(&problem);
    named.then(|| problem.allowed().to_vec())
}

/// `{ name = … }`, where the name takes a value.
fn variant(probe: &Probe, name: &str, meanings: &Meanings) -> Option<Described> {
    if SELECTORS.contains(&name) {
        return None;
    }
    let below = probe.key(name, &[]);
    // Of a name alone the reader says that it takes no value.
    let alone = probe.problem(table_of(vec![(name.to_owned(), Value::Boolean(true))]));
    if alone.is_some_and(|problem| probe.concerns(&problem)) {
        return None;
    }
    let value = describe(&below, &meanings.of_key(name));
    let example = value.example.map(|value| table_of(vec![(name.to_owned(), value)]));
    let schema = json!({
        "type": "object",
        "properties": { name: value.schema },
        "required": [name],
        "additionalProperties": false,
    });
    Some(Described { schema, example })
}

/// A table whose keys are known, beginning with some entries, which it needs.
fn closed(probe: &Probe, entries: &[Entry], meanings: &Meanings) -> Option<Described> {
    let keys = keys(probe, entries)?;
    let mut properties = Map::new();
    let mut examples = Vec::new();
    for key in keys {
        let meanings = meanings.of_key(&key);
        if let Some((_, value)) = entries.iter().find(|(given, _)| *given == key)
            && let Value::String(name) = value
            && !SELECTORS.contains(&key.as_str())
        {
            properties.insert(key, json!({ "const": name }));
            continue;
        }
        let beside: Vec<_> = entries.iter().filter(|(given, _)| *given != key).cloned().collect();
        if excluded(probe, &key, &beside) {
            continue;
        }
        let value = describe(&probe.key(&key, &beside), &meanings);
        examples.extend(value.example.map(|example| (key.clone(), example)));
        properties.insert(key, value.schema);
    }
    let (needed, example) = required(probe, entries, &examples);
    let mut schema = json!({
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    });
    if !needed.is_empty() {
        schema["required"] = needed.into();
    }
    Some(Described { schema, example })
}

/// Whether a key cannot stand beside these entries, whatever its value: the table as a whole is refused then.
fn excluded(probe: &Probe, key: &str, beside: &[Entry]) -> bool {
    let below = probe.key(key, beside);
    [text(UNKNOWN_WORD), Value::Boolean(true), Value::Float(1.0)].into_iter().all(|value| {
        below.problem(value).is_some_and(|problem| {
            let type_or_missing = problem.expected().is_some() || problem.missing().is_some();
            probe.concerns(&problem) && problem.allowed().is_empty() && !type_or_missing
        })
    })
}

/// The keys that a table beginning with `given` needs, and one with all of them if that can be made.
fn required(probe: &Probe, given: &[Entry], examples: &[Entry]) -> (Vec<String>, Option<Value>) {
    let missing = |entries: &[Entry]| {
        let problem = probe.problem(table_of(entries.to_vec()))?;
        let key = problem.missing().map(str::to_owned);
        key.filter(|_| probe.concerns(&problem))
    };
    let mut needed: Vec<String> = given.iter().map(|(key, _)| key.clone()).collect();
    let mut entries = given.to_vec();
    while let Some(key) = missing(&entries) {
        // One of several keys that will do is not needed.
        let other = |entry: &&Entry| entry.0 != key && !needed.contains(&entry.0);
        let instead = examples.iter().filter(other).any(|entry| {
            let entries = [&entries[..], std::slice::from_ref(entry)].concat();
            let problem = probe.problem(table_of(entries));
            problem.is_none_or(|problem| {
                probe.concerns(&problem) && problem.missing().is_some_and(|other| other != key)
            })
        });
        let example = examples.iter().find(|entry| entry.0 == key);
        let (false, Some(example)) = (instead, example) else { return (needed, None) };
        entries.push(example.clone());
        needed.push(key);
    }
    (needed, Some(table_of(entries)))
}

/// A table whose keys are the user's.
fn open(probe: &Probe, meanings: &Meanings) -> Option<Described> {
    const NAME: &str = "c";
    if probe.refusal(table_of(Vec::new())).is_some() {
        return None;
    }
    let value = describe(&probe.key(NAME, &[]), &meanings.of_key(NAME));
    let entry = value.example.map(|value| table_of(vec![(NAME.to_owned(), value)]));
    let schema = json!({ "type": "object", "additionalProperties": value.schema });
    Some(Described { schema, example: entry })
}

/// The same without the key of a tag.
fn without(mut table: Described, tag: &str) -> Described {
    if let Some(Json::Object(properties)) = table.schema.get_mut("properties") {
        properties.remove(tag);
    }
    table
}

/// What can stand at a place.
pub(super) fn describe(probe: &Probe, meanings: &Meanings) -> Described {
    if probe.is_too_deep() {
        return Described { schema: json!({}), example: None };
    }
    let mut all = Vec::new();
    all.extend(texts(probe));
    all.extend(truths(probe));
    all.extend(numbers(probe));
    all.extend(tables(probe, meanings));
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

/// Texts of which every free text takes one: any, an axis, a formula.
const FREE_TEXTS: [&str; 4] = [UNKNOWN_WORD, "x", "1", "a.vtu"];
