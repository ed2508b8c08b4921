//! Parameter values from what a scene gives, the defaults and the bounds.

use std::collections::BTreeMap;

use super::descriptor::{Default, Descriptor};
use super::error::{KineticsError, nearest};

/// Values in the order of the descriptor.
///
/// # Errors
/// [`KineticsError::UnknownParameter`] or [`KineticsError::ParameterOutOfBounds`].
pub(super) fn resolve(
    descriptor: &Descriptor,
    given: &BTreeMap<String, f64>,
) -> Result<Vec<f64>, KineticsError> {
    let names = || descriptor.parameters.iter().map(|parameter| parameter.name.as_str());
    if let Some(name) = given.keys().find(|name| !names().any(|known| known == name.as_str())) {
        return Err(KineticsError::UnknownParameter {
            plugin: descriptor.name.clone(),
            name: name.clone(),
            nearest: nearest(name, names()),
            allowed: names().map(str::to_owned).collect(),
        });
    }
    let mut values: Vec<f64> = Vec::with_capacity(descriptor.parameters.len());
    for parameter in &descriptor.parameters {
        let value = match (given.get(&parameter.name), parameter.default) {
            (Some(value), _) => *value,
            (None, Default::Value(value)) => value,
            (None, Default::SameAs(earlier)) => values.get(earlier).copied().unwrap_or(f64::NAN),
        };
        if !parameter.allows(value) {
            return Err(KineticsError::ParameterOutOfBounds {
                plugin: descriptor.name.clone(),
                name: parameter.name.clone(),
                value,
                range: parameter.range(),
            });
        }
        values.push(value);
    }
    Ok(values)
}
