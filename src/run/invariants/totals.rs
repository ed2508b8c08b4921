//! Totals of species that stay as they are.
//!
//! ```text
//! T = Σ_s w_s Σ_i A_i c_s,i,     value = |T - T(0)| / largest Σ |w_s| A_i |c_s,i| so far
//! ```
//!
//! The areas A_i are the current ones for a concentration on a sheet that does not move, and else those of the rest
//! state. At a vertex they are a third of the triangles around it, as in diffusion and in the ledger.

use super::{InspectedStep, Monitor, Reading};
use crate::effects::Measure;
use crate::kinetics::Descriptor;
use crate::model::{Model, State};
use crate::run::Result;
use crate::scene::{Scene, path_to};

/// The law of one total. It remembers the total at the start and the largest sum of sizes.
pub(super) struct Total {
    name: String,
    /// Numbers of species with their weights.
    species: Vec<(usize, f64)>,
    /// Areas that go with the points.
    share: Vec<f64>,
    unit: &'static str,
}

impl Total {
    /// The total that `name` spells in `scene`.
    ///
    /// # Errors
    /// A name that is none, with the place.
    pub(super) fn new(scene: &Scene, name: &str, model: &Model, state: &State) -> Result<Self> {
        let path = path_to("invariants.totals", name);
        let Some(chemistry) = model.chemistry() else {
            return Err(scene.error_at(&path, "the scene has no species", None).into());
        };
        let species = parsed(scene, &path, name, chemistry.descriptor())?;
        let sheet = model.sheet();
        let still = !model.moves() && chemistry.measure() == Measure::Concentration;
        let (share, unit) = match sheet.triangles().is_empty() {
            true => (vec![1.0; state.x.len()], "concentration"),
            false => {
                let x = if still { &state.x[..] } else { sheet.rest() };
                (chemistry.point_areas(sheet, x), "amount")
            }
        };
        Ok(Self { name: name.to_owned(), species, share, unit })
    }

    /// The total and the sum of sizes.
    fn sums(&self, state: &State) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for &(s, weight) in &self.species {
            for (c, share) in state.species[s].iter().zip(&self.share) {
                let amount = weight * c * share;
                sums[0] += amount;
                sums[1] += amount.abs();
            }
        }
        sums
    }
}

/// Species with weights, of `a + 2 b`.
fn parsed(
    scene: &Scene,
    path: &str,
    name: &str,
    descriptor: &Descriptor,
) -> Result<Vec<(usize, f64)>> {
    let mut all = Vec::new();
    for term in name.split('+').map(str::trim) {
        let end = term.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(term.len());
        let (number, rest) = term.split_at(end);
        let species = rest.trim_start_matches([' ', '*']);
        let weight = if number.is_empty() { Ok(1.0) } else { number.parse::<f64>() };
        match (descriptor.species_index(species), weight) {
            (Some(index), Ok(weight)) if weight > 0.0 => all.push((index, weight)),
            _ => {
                let names: Vec<&str> = descriptor.species.iter().map(|s| s.name.as_str()).collect();
                let message = format!("`{term}` is neither a species nor a number times a species");
                let help = format!(
                    "species: {}; a total is as \"{}\" or \"a + 2 b\"",
                    names.join(", "),
                    names.first().unwrap_or(&"a")
                );
                return Err(scene.error_at(path, &message, Some(&help)).into());
            }
        }
    }
    Ok(all)
}

impl Monitor for Total {
    fn law(&self) -> (String, &'static str) {
        let advice = "a law makes or destroys some of it, flux, exchange or hold lets it in or out, or values have been \
                      clipped at the end of their range (species.NAME.lower); on a sheet that moves the total of a \
                      concentration is not conserved, that of kinetics.measure = \"amount\" is; where it is the \
                      integrator's error, try a smaller time.integrator.rtol";
        (format!("the conservation of the total of {} (relative)", self.name), advice)
    }

    fn columns(&self) -> Vec<String> {
        vec![format!("change of the total of {} [{}]", self.name, self.unit)]
    }

    fn inspect(&mut self, step: &mut InspectedStep<'_>, memory: &mut Vec<f64>) -> Result<Reading> {
        let [now, size] = self.sums(step.after);
        let (start, largest) = match memory[..] {
            [start, largest] => (start, size.max(largest)),
            _ => (now, size),
        };
        *memory = vec![start, largest];
        let change = now - start;
        let value = if change == 0.0 { 0.0 } else { change.abs() / largest };
        let place = format!("the total was {start:.6e} at the start and changes by {change:.3e}");
        Ok(Reading { row: vec![change], value, place })
    }
}
