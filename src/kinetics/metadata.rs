//! Whether what a plugin says about itself makes sense.

use std::collections::BTreeSet;

use super::descriptor::{Default, Descriptor, Parameter, Species};
use super::signal::Signal;
use rumple_numerics::num::Short;

/// A part of a descriptor and what is wrong with it.
pub(super) type Problem = (String, String);

/// Refuses names that scenes cannot use, numbers without meaning and contradictions.
pub(super) fn check(descriptor: &Descriptor) -> Result<(), Problem> {
    for (place, text) in [("id", &descriptor.id), ("name", &descriptor.name)] {
        if text.trim().is_empty() {
            return Err((place.to_owned(), "is empty".to_owned()));
        }
    }
    if descriptor.species.is_empty() {
        return Err(("species".to_owned(), "there are none; expected at least one".to_owned()));
    }
    unique("species", descriptor.species.iter().map(|species| species.name.as_str()))?;
    unique("parameter", descriptor.parameters.iter().map(|parameter| parameter.name.as_str()))?;
    unique("observable", descriptor.observables.iter().map(|o| o.name.as_str()))?;
    for observable in &descriptor.observables {
        let name = &observable.name;
        let place = |problem: String| (format!("observable `{name}`"), problem);
        identifier(name).map_err(place)?;
        not_a_signal(name).map_err(place)?;
        if descriptor.species_index(name).is_some() {
            return Err(place("has the name of a species; expected another".to_owned()));
        }
    }
    unique("signal", descriptor.signals.iter().map(|read| read.signal.name()))?;
    for species in &descriptor.species {
        check_species(species)
            .map_err(|problem| (format!("species `{}`", species.name), problem))?;
        if species.location != descriptor.species[0].location {
            return Err((
                format!("species `{}`", species.name),
                format!(
                    "has another location than `{}`; expected one location for all species of a \
                     plugin",
                    descriptor.species[0].name
                ),
            ));
        }
    }
    for parameter in &descriptor.parameters {
        check_parameter(parameter)
            .map_err(|problem| (format!("parameter `{}`", parameter.name), problem))?;
    }
    for read in &descriptor.signals {
        positive("typical magnitude", read.typical)
            .map_err(|problem| (format!("signal `{}`", read.signal), problem))?;
    }
    Ok(())
}

fn check_species(species: &Species) -> Result<(), String> {
    identifier(&species.name)?;
    not_a_signal(&species.name)?;
    positive("typical magnitude", species.magnitude())?;
    ordered(species.lower, species.upper)?;
    if !(species.diffusion >= 0.0 && species.diffusion.is_finite()) {
        return Err(format!(
            "default diffusion coefficient is {}; expected a finite number >= 0",
            Short(species.diffusion)
        ));
    }
    Ok(())
}

fn check_parameter(parameter: &Parameter) -> Result<(), String> {
    identifier(&parameter.name)?;
    ordered(parameter.lower, parameter.upper)?;
    match parameter.default {
        Default::Value(value) if !parameter.allows(value) => {
            Err(format!("default is {}; allowed: {}", Short(value), parameter.range()))
        }
        Default::Value(_) | Default::SameAs(_) => Ok(()),
    }
}

fn identifier(name: &str) -> Result<(), String> {
    let mut characters = name.chars();
    let starts_well = characters.next().is_some_and(|first| first.is_ascii_alphabetic());
    if starts_well && characters.all(|next| next.is_ascii_alphanumeric() || next == '_') {
        Ok(())
    } else {
        Err("is not a valid name; expected a letter, then letters, digits or `_`".to_owned())
    }
}

fn not_a_signal(name: &str) -> Result<(), String> {
    if Signal::ALL.iter().any(|signal| signal.name() == name || signal.columns().contains(&name)) {
        return Err("has the name of a signal; expected another".to_owned());
    }
    Ok(())
}

fn positive(what: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{what} is {}; expected a finite number > 0", Short(value)))
    }
}

fn ordered(lower: f64, upper: f64) -> Result<(), String> {
    if lower <= upper {
        Ok(())
    } else {
        Err(format!("valid range is {lower} to {upper}; expected lower <= upper, none of them NaN"))
    }
}

fn unique<'a>(kind: &str, names: impl Iterator<Item = &'a str>) -> Result<(), Problem> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err((format!("{kind} `{name}`"), "is declared twice".to_owned()));
        }
    }
    Ok(())
}
