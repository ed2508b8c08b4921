//! The JSON Schema: kinds from the registries, closed tables, types; `tests/scripts/schema.py` validates scenes by it.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::run::program::{passes, rumple, text};

/// The schema with every reference replaced by what it names.
fn schema() -> Value {
    fn written_out(part: &Value, root: &Value) -> Value {
        if let Some(name) = part["$ref"].as_str() {
            let target = root.pointer(name.trim_start_matches('#'));
            return written_out(target.unwrap_or_else(|| panic!("{name}")), root);
        }
        match part {
            Value::Object(parts) => {
                parts.iter().map(|(key, part)| (key.clone(), written_out(part, root))).collect()
            }
            Value::Array(parts) => parts.iter().map(|part| written_out(part, root)).collect(),
            _ => part.clone(),
        }
    }
    let root = rumple::scene::schema();
    written_out(&root, &root)
}

/// All tables of a kind of schema within one: those of `anyOf`, or itself.
fn forms(schema: &Value) -> Vec<&Value> {
    schema["anyOf"].as_array().map_or_else(|| vec![schema], |all| all.iter().collect())
}

/// The names of the tag in the tables of a schema.
fn names<'a>(schema: &'a Value, tag: &str) -> BTreeSet<&'a str> {
    forms(schema).iter().filter_map(|form| form["properties"][tag]["const"].as_str()).collect()
}

/// The table whose tag is `name`.
fn of<'a>(schema: &'a Value, tag: &str, name: &str) -> &'a Value {
    let forms = forms(schema);
    forms.into_iter().find(|form| form["properties"][tag]["const"] == name).unwrap()
}

#[test]
fn kinds_are_those_of_the_registries() {
    let schema = schema();
    let effects = &schema["properties"]["effect"]["items"];
    let kinds: BTreeSet<&str> = rumple::effects::kinds().into_iter().collect();
    assert_eq!(names(effects, "kind"), kinds);
    // One that only these tests register.
    assert!(kinds.contains("test-spring"));
    let integrators = &schema["properties"]["time"]["properties"]["integrator"];
    assert_eq!(names(integrators, "kind"), BTreeSet::from(["explicit", "monolithic", "staggered"]));
    let methods = &schema["properties"]["equilibrium"];
    assert_eq!(names(methods, "method"), BTreeSet::from(["descent", "lbfgs", "newton"]));
    let shapes = names(&schema["properties"]["sheet"], "shape");
    assert!(shapes.contains("annulus") && shapes.contains("point"), "{shapes:?}");
}

#[test]
fn keys_types_ranges_and_meanings_are_there() {
    let schema = schema();
    let material = &schema["properties"]["material"];
    assert_eq!(material["required"], serde_json::json!(["young", "poisson", "thickness"]));
    let young = &material["properties"]["young"];
    let ways = young["anyOf"].as_array().unwrap();
    let number = ways.iter().find(|way| way["type"] == "number").unwrap();
    assert_eq!(number["exclusiveMinimum"], 0.0, "{young}");
    assert!(ways.iter().any(|way| way["type"] == "string"), "{young}");
    let table = ways.iter().find(|way| way["type"] == "object").unwrap();
    assert_eq!(table["properties"]["default"]["exclusiveMinimum"], 0.0, "{young}");
    assert!(young["description"].as_str().unwrap().starts_with("Young's modulus E"), "{young}");
    let poisson = &material["properties"]["poisson"];
    let ways = poisson["anyOf"].as_array().unwrap();
    let number = ways.iter().find(|way| way["type"] == "number").unwrap();
    assert_eq!(number["maximum"], 0.5, "{poisson}");
    let effects = &schema["properties"]["effect"]["items"];
    let pin = of(effects, "kind", "pin");
    assert_eq!(pin["required"], serde_json::json!(["kind", "where", "axes"]), "{pin}");
    let displacement = &pin["properties"]["displacement"];
    assert_eq!((&displacement["minItems"], &displacement["maxItems"]), (&3.into(), &3.into()));
    let lbfgs = of(&schema["properties"]["equilibrium"], "method", "lbfgs");
    assert!(lbfgs["properties"]["collapse"]["enum"].as_array().unwrap().contains(&"hold".into()));
    // No table of the format is open but those whose keys are the user's.
    let mut open = BTreeSet::new();
    walk(&schema, "", &mut open);
    // Regions of regions are described once.
    let users = [
        "initial",
        "let",
        "observables",
        "parameters",
        "rates",
        "rename",
        "species",
        "totals",
        "units",
    ];
    assert_eq!(open, users.map(str::to_owned).into());
}

/// Collects the keys of tables that take any key, or that take anything.
fn walk(schema: &Value, key: &str, open: &mut BTreeSet<String>) {
    match schema {
        Value::Object(object) => {
            if object.get("type") == Some(&"object".into())
                && object.get("additionalProperties") != Some(&false.into())
            {
                open.insert(key.to_owned());
            }
            for (name, inside) in
                object.get("properties").and_then(Value::as_object).into_iter().flatten()
            {
                assert!(
                    // Regions of regions are described once.
                    ["all-of", "any-of", "not"].contains(&name.as_str())
                        || inside.as_object().is_some_and(|inside| !inside.is_empty()),
                    "{name} takes anything"
                );
                walk(inside, name, open);
            }
            for inside in
                ["items", "additionalProperties", "anyOf"].iter().filter_map(|k| object.get(*k))
            {
                walk(inside, key, open);
            }
        }
        Value::Array(all) => all.iter().for_each(|one| walk(one, key, open)),
        _ => {}
    }
}

/// Regions and fields are written once: the schema stays readable, and editors load it at once.
#[test]
fn what_repeats_is_written_once() {
    let (short, long) = (rumple::scene::schema().to_string(), schema().to_string());
    assert!(5 * short.len() < long.len(), "{} {}", short.len(), long.len());
}

#[test]
fn it_is_printed_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let printed = rumple(folder.path(), &["schema"]);
    let schema: Value = serde_json::from_str(&text(&printed.stdout)).unwrap();
    assert_eq!(schema["title"], "Scene of rumple");
    passes(folder.path(), "schema --out s.json");
    assert_eq!(std::fs::read(folder.path().join("s.json")).unwrap(), printed.stdout);
    assert_eq!(rumple(folder.path(), &["schema", "--out", "s.json"]).status.code(), Some(2));
}
