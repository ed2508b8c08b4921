//! The JSON Schema of scenes, by which editors complete keys and mark mistakes.
//!
//! It is not a second description of the format: the readers of scenes are asked, value by value, what they take
//! ([`probe`]), and effects, integrators and methods are those that the program registers. It accepts what
//! the readers accept. What depends on several keys together (a plugin or rates, not both) is left to
//! `rumple check`. Meanings of keys are the reference's ([`meaning`]). What repeats is written once ([`definitions`]).

mod definitions;
mod meaning;
mod numbers;
mod probe;
mod values;

use serde_json::{Map, Value as Json, json};

use self::meaning::Meanings;
use self::probe::Probe;
use super::TABLES;
use super::misplaced_key::READERS;
use crate::effects::EffectSpec;
use crate::registry::choose;

/// The JSON Schema (draft 7) of scene files.
#[must_use]
pub fn schema() -> Json {
    let mut tables = Map::new();
    for (table, reader) in READERS {
        let meanings = Meanings::of_table(table);
        tables.insert(table.to_owned(), values::describe(&Probe::new(reader), &meanings).schema);
    }
    let effect = Probe::new(|node| choose::<dyn EffectSpec>(node, None).err());
    let effect = values::describe(&effect, &Meanings::of_table("effect")).schema;
    tables.insert("effect".to_owned(), json!({ "type": "array", "items": effect }));
    debug_assert!(TABLES.iter().all(|table| tables.contains_key(*table)));
    let mut schema = json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Scene of rumple",
        "description": format!("Scene files of rumple {}", env!("CARGO_PKG_VERSION")),
        "type": "object",
        "properties": tables,
        "required": ["sheet", "time"],
        "additionalProperties": false,
    });
    definitions::share(&mut schema);
    schema
}
