//! Parts of a schema that repeat, as regions and fields do, written once below `definitions`.

use std::collections::BTreeMap;

use serde_json::{Map, Value as Json, json};

/// A part of fewer characters stays where it is: a reference is not much shorter.
const LEAST_LENGTH: usize = 200;

/// Writes the parts that repeat once, with references to them.
pub(super) fn share(schema: &mut Json) {
    let mut counts = BTreeMap::new();
    below(schema, "scene", &mut |part, _| count(part, &mut counts));
    let mut shared = Shared { counts, names: BTreeMap::new(), definitions: Map::new() };
    below(schema, "scene", &mut |part, key| shared.replace(part, key));
    schema["definitions"] = shared.definitions.into();
}

/// Hands over the schemas right below `schema`, each with the key that it is of.
fn below(schema: &mut Json, key: &str, each: &mut dyn FnMut(&mut Json, &str)) {
    let Json::Object(parts) = schema else { return };
    for (word, part) in parts {
        match (word.as_str(), part) {
            ("properties", Json::Object(all)) => all.iter_mut().for_each(|(key, p)| each(p, key)),
            ("anyOf", Json::Array(all)) => all.iter_mut().for_each(|one| each(one, key)),
            ("items" | "additionalProperties", part @ Json::Object(_)) => each(part, key),
            _ => {}
        }
    }
}

/// Counts where each part occurs; what is within an equal one is counted once.
fn count(part: &mut Json, counts: &mut BTreeMap<String, usize>) {
    let text = part.to_string();
    if text.len() < LEAST_LENGTH {
        return;
    }
    let found = counts.entry(text).or_insert(0);
    *found += 1;
    if *found == 1 {
        below(part, "", &mut |inner, _| count(inner, counts));
    }
}

/// The parts that have been moved.
struct Shared {
    counts: BTreeMap<String, usize>,
    /// Names of their definitions.
    names: BTreeMap<String, String>,
    definitions: Map<String, Json>,
}

impl Shared {
    /// Replaces a part that repeats, or those within it; `key` is the one that has it.
    fn replace(&mut self, part: &mut Json, key: &str) {
        let text = part.to_string();
        if self.counts.get(&text).is_none_or(|count| *count < 2) {
            return below(part, key, &mut |inner, key| self.replace(inner, key));
        }
        if !self.names.contains_key(&text) {
            let numbered = |k: usize| if k == 1 { key.to_owned() } else { format!("{key}-{k}") };
            let free = |name: &String| !self.names.values().any(|taken| taken == name);
            let name = (1..).map(numbered).find(free).unwrap_or_default();
            self.names.insert(text.clone(), name.clone());
            let mut definition = part.clone();
            below(&mut definition, key, &mut |inner, key| self.replace(inner, key));
            self.definitions.insert(name, definition);
        }
        *part = json!({ "$ref": format!("#/definitions/{}", self.names[&text]) });
    }
}
