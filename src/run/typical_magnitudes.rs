//! Typical magnitudes of species, the units of absolute tolerances, where a law in the scene gives none.
//!
//! ```text
//! typical = min(1, max |c|)                       at the start
//!           min(1, max |R| / max |∂R/∂c|)         where that is 0: the size of the value that the rate R leads to
//! ```
//!
//! A species without either is as large as the largest of the others.

use crate::Stepper;
use crate::model::Chemistry;
use crate::num::Short;
use crate::scene::Scene;

/// Sets those of the species of `stepper` at its start, and notes where the absolute tolerance is above all values there.
pub(super) fn set(scene: &Scene, stepper: &mut Stepper, notes: &mut Vec<String>) {
    let model = stepper.model().clone();
    let Some(chemistry) = model.chemistry() else { return };
    let free = not_given(scene, chemistry);
    let reduction = model.sheet().reduction();
    let largest = |values: &[f64]| reduction.max(values.len(), |i| values[i].abs());
    let start: Vec<f64> = stepper.state.species.iter().map(|c| largest(c)).collect();
    // Collective: the same on all ranks, as all of it is.
    if free.iter().zip(&start).any(|(free, size)| *free && *size < 1.0) {
        let led_to = values_led_to(stepper, chemistry);
        let size = |(start, led_to): (&f64, &f64)| if *start > 0.0 { *start } else { *led_to };
        let sizes: Vec<f64> = start.iter().zip(&led_to).map(size).collect();
        let given = (0..sizes.len()).map(|s| if free[s] { sizes[s] } else { chemistry.typical(s) });
        let others = given.filter(|size| size.is_finite()).fold(0.0, f64::max);
        let of = |s: usize| {
            let size = if sizes[s] > 0.0 { sizes[s] } else { others };
            let usable = free[s] && size.is_normal() && size < 1.0;
            if usable { size } else { chemistry.typical(s) }
        };
        chemistry.set_typical((0..sizes.len()).map(of).collect());
    }
    let Some(atol) = scene.time.integrator.atol() else { return };
    for (s, species) in chemistry.descriptor().species.iter().enumerate() {
        let absolute = atol * chemistry.typical(s);
        if start[s] > 0.0 && absolute > start[s] {
            notes.push(format!(
                "the absolute tolerance of species {} is {}, above its largest value at the start, {}: errors as large as \
                 the values pass; lower its typical magnitude ({}) or time.integrator.atol",
                species.name,
                Short(absolute),
                Short(start[s]),
                Short(chemistry.typical(s))
            ));
        }
    }
}

/// Whether each species is of a law in the scene that does not give its typical magnitude.
fn not_given(scene: &Scene, chemistry: &Chemistry) -> Vec<bool> {
    let given = |name: &String| {
        scene.kinetics.iter().any(|law| law.species.get(name).is_some_and(|s| s.typical.is_some()))
    };
    let free: Vec<&String> = scene
        .kinetics
        .iter()
        .filter(|law| law.plugin.is_none())
        .flat_map(|law| law.without_typical())
        .filter(|name| !given(name))
        .collect();
    let species = chemistry.descriptor().species.iter();
    species.map(|s| s.typical == 1.0 && free.contains(&&s.name)).collect()
}

/// The sizes of the values that the rates lead to; 0 where they are not known.
fn values_led_to(stepper: &mut Stepper, chemistry: &Chemistry) -> Vec<f64> {
    let model = stepper.model().clone();
    let reduction = model.sheet().reduction();
    let count = stepper.state.species.len();
    let here = rates_and_slopes(stepper, chemistry);
    if reduction.any(here.is_none()) {
        return vec![0.0; count];
    }
    let [rates, partials] = here.unwrap_or_default();
    let largest = |values: &[f64]| reduction.max(values.len(), |i| values[i].abs());
    let size = |(rate, slope): (&Vec<f64>, &Vec<f64>)| largest(rate) / largest(slope);
    let sizes = rates.iter().zip(&partials).map(size);
    sizes.map(|size| if size.is_finite() { size } else { 0.0 }).collect()
}

/// The rates of the species and their derivatives by the species itself, if the law has values at the start.
fn rates_and_slopes(stepper: &mut Stepper, chemistry: &Chemistry) -> Option<[Vec<Vec<f64>>; 2]> {
    let species = stepper.state.species.clone();
    let mut at = stepper.evaluate();
    let rates = at.rates().ok()?.to_vec();
    let signals = at.signals().ok()?.clone();
    let columns: Vec<&[f64]> = species.iter().map(Vec::as_slice).collect();
    let partials = chemistry.reaction_partials(&columns, &signals).ok()?;
    let inputs = chemistry.descriptor().inputs();
    let slopes = (0..species.len()).map(|s| partials.column(s * inputs + s).to_vec()).collect();
    Some([rates, slopes])
}
