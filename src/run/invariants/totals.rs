//! Totals of species that stay as they are.
//!
//! ```text
//! T = Σ_s w_s Σ_i A_i c_s,i,     value = |T - T(0)| / largest Σ |w_s| A_i |c_s,i| so far
//! ```
//!
//! The areas A_i are those of the rest state for an amount, and for a concentration those of the surface that diffusion
//! conserves it on: the current one of a sheet that does not move, or that of rest where `metric = "rest"`.
//! At a vertex they are a third of the triangles around it, as in diffusion and in the ledger.

use super::{Invariant, InvariantValue, Step};
use crate::Vec3;
use crate::effects::Measure;
use crate::geometry::Face;
use crate::kinetics::{Descriptor, Location};
use crate::model::{Chemistry, Model, State, Surface};
use crate::num::real;
use crate::run::Result;
use crate::scene::{Scene, path_to};
use crate::sheet::Sheet;
use crate::solve::Workspace;

/// Bound of round-off.
const ROUND_OFF: f64 = 1e-8;

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
    pub(super) fn of(scene: &Scene, name: &str, model: &Model, state: &State) -> Result<Self> {
        let path = path_to("invariants.totals", name);
        let Some(chemistry) = model.chemistry() else {
            return Err(scene.error_at(&path, "the scene has no species", None).into());
        };
        let species = parsed(scene, &path, name, chemistry.descriptor())?;
        let (share, unit) = areas(model, chemistry, &species, state);
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

    fn reading(&self, state: &State, memory: Option<&[f64]>) -> InvariantValue {
        let [now, size] = self.sums(state);
        let (start, largest) = match memory {
            Some(&[start, largest]) => (start, size.max(largest)),
            _ => (now, size),
        };
        let change = now - start;
        let value = if change == 0.0 { 0.0 } else { change.abs() / largest };
        let place = format!("the total was {start:.6e} at the start and changes by {change:.3e}");
        InvariantValue { row: vec![change], value, place, memory: vec![start, largest] }
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

/// Areas that go with the points of `location` in the shape `x`; 1 for a well-mixed system.
fn shares(sheet: &Sheet, location: Location, x: &[Vec3]) -> Vec<f64> {
    let area = |t: &[u32; 3]| Face::of(&t.map(|v| x[v as usize])).area;
    let areas: Vec<f64> = sheet.triangles().iter().map(area).collect();
    match location {
        _ if areas.is_empty() => vec![1.0; x.len()],
        Location::Vertex => {
            let around = |v: usize| sheet.vertex_triangles().of(v).iter();
            let share = |v: usize| around(v).map(|&(t, _)| areas[t as usize] / 3.0).sum();
            (0..x.len()).map(share).collect()
        }
        Location::Face | Location::Edge => areas,
    }
}

/// The areas with which the transports of these species conserve their totals, those of rest if none does; and the unit
/// of the total.
fn areas(
    model: &Model,
    chemistry: &Chemistry,
    species: &[(usize, f64)],
    state: &State,
) -> (Vec<f64>, &'static str) {
    let (sheet, moves) = (model.sheet(), model.moves());
    let shares = |x: &[Vec3]| shares(sheet, chemistry.location(), x);
    if sheet.triangles().is_empty() {
        return (shares(&state.x), "concentration");
    }
    let rest = shares(sheet.rest());
    if !moves && chemistry.measure() == Measure::Concentration {
        let now = shares(&state.x);
        if species.iter().all(|(s, _)| conserves(chemistry, sheet, &state.x, *s, &now)) {
            return (now, "amount");
        }
    }
    (rest, "amount")
}

/// Whether the transports of a species conserve its total with these areas on the shape `x`.
fn conserves(
    chemistry: &Chemistry,
    sheet: &Sheet,
    x: &[Vec3],
    species: usize,
    share: &[f64],
) -> bool {
    if !chemistry.held().of(species).is_empty() {
        return false;
    }
    let mut surface = Surface::default();
    chemistry.transport(sheet, x, &mut surface);
    let c: Vec<f64> = (0..share.len()).map(|i| 1.0 + (real(i) * 1.7).sin()).collect();
    let mut rate = vec![0.0; c.len()];
    for (term, operator) in chemistry.transports().iter().zip(surface.operators()) {
        if term.species() == species {
            term.add_rate(sheet, operator, &c, &mut rate);
        }
    }
    let each = || rate.iter().zip(share).map(|(rate, share)| rate * share);
    each().sum::<f64>().abs() <= ROUND_OFF * each().map(f64::abs).sum::<f64>()
}

impl Invariant for Total {
    fn name(&self) -> String {
        format!("the conservation of the total of {} (relative)", self.name)
    }

    fn advice(&self) -> &'static str {
        "a law makes or destroys some of it, flux, exchange or hold lets it in or out, or values have been clipped at the \
         end of their range (species.NAME.lower); on a sheet that moves the total of a concentration is not conserved, \
         that of kinetics.measure = \"amount\" is; where it is the integrator's error, try a smaller time.integrator.rtol"
    }

    fn columns(&self) -> Vec<String> {
        vec![format!("change of the total of {} [{}]", self.name, self.unit)]
    }

    fn begin(&mut self, _: &mut Workspace, state: &State) -> Result<InvariantValue> {
        Ok(self.reading(state, None))
    }

    fn inspect(&mut self, step: &mut Step<'_>, memory: &[f64]) -> Result<InvariantValue> {
        Ok(self.reading(step.after, Some(memory)))
    }
}
