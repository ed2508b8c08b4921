//! Refuses numbers so large or small that what is made of them cannot be computed with, and names
//! them: the first sign would else be an energy that is infinite, far from its cause.

use super::Result;
use crate::effects::{EnergyTerm, Material, TransportTerm};
use crate::num::checked::{LARGEST, SMALLEST};
use crate::num::{Short, real};
use crate::problem::{ProblemError, ProblemPart};
use crate::scene::Scene;
use crate::sheet::Sheet;

/// The range of length factors at the start: relaxations from further away do not end.
const LENGTH_FACTORS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// How messages end.
const OUTSIDE: &str = "outside the range that can be computed with";

fn representable(value: f64) -> bool {
    (SMALLEST..=LARGEST).contains(&value)
}

/// Inspects what the material makes of the sheet.
///
/// # Errors
/// The key whose value is furthest from 1, where a modulus or a force is out of bounds.
pub(super) fn check(scene: &Scene, sheet: &Sheet, material: &Material) -> Result<()> {
    if sheet.edges().is_empty() {
        return Ok(());
    }
    let x = sheet.rest();
    let lengths = sheet.edges().iter().map(|edge| {
        let [a, b] = edge.vertices.map(|v| x[v as usize]);
        (a - b).norm()
    });
    let edge = lengths.sum::<f64>() / real(sheet.edges().len());
    let (y, b) = (material.stretching_modulus(), material.bending_rigidity());
    let made = [
        ("Y = E h/(1-ν²)", "force/length", y),
        ("B = E h³/(12(1-ν²))", "energy", b),
        ("Y times the mean edge length", "force", y * edge),
        ("Y times the square of the mean edge length", "energy", y * edge * edge),
    ];
    let Some((what, unit, value)) = made.into_iter().find(|(.., value)| !representable(*value))
    else {
        return Ok(());
    };
    let given = [
        ("material.young", material.young),
        ("material.thickness", material.thickness),
        ("sheet", edge),
    ];
    let far = |value: f64| value.log10().abs();
    let (key, _) = given
        .into_iter()
        .fold(given[0], |most, one| if far(one.1) > far(most.1) { one } else { most });
    let message = format!("{what} is {} {unit}, {OUTSIDE}", short(value));
    let help = format!("between {SMALLEST:e} and {LARGEST:e}: choose other units");
    Err(scene.error_at(key, &message, Some(&help)).into())
}

/// Inspects the force that the effect number `number` of the scene puts on vertices.
///
/// # Errors
/// The effect, if the force is too large.
pub(super) fn check_load(
    number: usize,
    energy: &EnergyTerm,
    material: Option<&Material>,
) -> Result<(), ProblemError> {
    let force = energy.applied_force();
    let modulus = material.map_or(1.0, Material::stretching_modulus);
    if force == 0.0 || (force / modulus).abs() <= LARGEST && force <= LARGEST {
        return Ok(());
    }
    Err(too_large(number, "", &format!("a force of {} on a vertex is", short(force))))
}

/// Inspects how fast the effect number `number` of the scene levels out a species at rest.
///
/// # Errors
/// Its coefficient, if that is too fast.
pub(super) fn check_transport(
    number: usize,
    transport: &TransportTerm,
    sheet: &Sheet,
) -> Result<(), ProblemError> {
    let rate = transport.spectral_bound((sheet, 0.0), &transport.operator_on(sheet, sheet.rest()));
    // NaN does not count as a rate below the bound either.
    if rate <= LARGEST {
        return Ok(());
    }
    let what = format!("decay rates up to {} per time are", short(rate));
    Err(too_large(number, transport.speed_key(), &what))
}

/// That `what` of the key of effect `number` is out of bounds.
fn too_large(number: usize, key: &str, what: &str) -> ProblemError {
    let help = format!("at most {LARGEST:e}: choose other units");
    ProblemError::new(
        ProblemPart::Effect(number, key.into()),
        format!("{what} {OUTSIDE}"),
        Some(&help),
    )
}

/// Inspects the length factors of the edges at the start.
///
/// # Errors
/// The law, or else the effects, if one is too large or too small.
pub(super) fn check_length_factor(scene: &Scene, sheet: &Sheet, factor: &[f64]) -> Result<()> {
    let Some(e) = factor.iter().position(|factor| !LENGTH_FACTORS.contains(factor)) else {
        return Ok(());
    };
    let ([a, b], value) = (sheet.edges()[e].vertices, short(factor[e]));
    let message = format!(
        "the length factor of laws and growth together is {value} between vertices {a} and {b} at the start, {OUTSIDE}"
    );
    let (from, to) = (LENGTH_FACTORS.start(), LENGTH_FACTORS.end());
    let key = if scene.kinetics.is_empty() { "effect" } else { "kinetics" };
    Err(scene.error_at(key, &message, Some(&format!("between {from:e} and {to:e}"))).into())
}

/// In a few digits.
fn short(value: f64) -> Short {
    Short(format!("{value:.2e}").parse().unwrap_or(value))
}
