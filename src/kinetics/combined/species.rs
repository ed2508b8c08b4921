//! Names of species and observables of several laws, and species that laws share.

use std::collections::BTreeMap;

use crate::descriptor::{Descriptor, FORMULA, Species};

/// Refuses to rename what the law does not have.
pub(super) fn known_names(
    own: &Descriptor,
    rename: &BTreeMap<String, String>,
) -> Result<(), (String, String)> {
    let species = own.species.iter().map(|s| s.name.as_str());
    let known: Vec<&str> = species.chain(own.observables.iter().map(|o| o.name.as_str())).collect();
    let Some(name) = rename.keys().find(|name| !known.contains(&name.as_str())) else {
        return Ok(());
    };
    let message = format!("`{}` has no `{name}`; it has {}", own.name, known.join(", "));
    Err((format!("rename.{name}"), message))
}

/// Error of a law whose species `one`, as `name`, is an earlier law's without being shared.
pub(super) fn taken(own: &Descriptor, one: &Species, name: &str) -> (String, String) {
    let other = if own.id.starts_with(FORMULA) {
        "give it another name here".to_owned()
    } else {
        format!("rename = {{ {} = \"…\" }}", one.name)
    };
    let message = format!(
        "the species `{name}` belongs to an earlier law already; if it is the same concentration, say \
         shared = [\"{name}\"], else {other}"
    );
    (String::new(), message)
}

/// Error of a law that shares a species `name` no earlier law has.
pub(super) fn not_shared(all: &Descriptor, name: &str) -> (String, String) {
    let names: Vec<&str> = all.species.iter().map(|s| s.name.as_str()).collect();
    let there = if names.is_empty() {
        "this is the first law: the later one says `shared`".to_owned()
    } else {
        format!("there are {}", names.join(", "))
    };
    ("shared".into(), format!("no earlier law has a species `{name}`; {there}"))
}

/// What two laws say of one species: a range that suits both.
pub(super) fn share(known: &mut Species, other: &Species) -> Result<(), (String, String)> {
    // "1" is also what a law says that does not care.
    if known.unit == "1" {
        known.unit.clone_from(&other.unit);
    } else if other.unit != "1" && other.unit != known.unit {
        let message = format!(
            "the species `{}` is in {} here, and in {} in an earlier law",
            known.name, other.unit, known.unit
        );
        return Err(("shared".into(), message));
    }
    known.typical = known.typical.or(other.typical);
    known.lower = known.lower.max(other.lower);
    known.upper = known.upper.min(other.upper);
    if known.lower >= known.upper {
        let message = format!(
            "no value of `{}` is valid for both this law and an earlier \
            one",
            known.name
        );
        return Err(("shared".into(), message));
    }
    Ok(())
}
