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
use crate::model::{Chemistry, State, Surface};
use crate::num::real;
use crate::run::{Error, Result};
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
    /// A name that is none, and a total that the scene does not conserve, with the place.
    pub(super) fn of(
        scene: &Scene,
        name: &str,
        workspace: &mut Workspace,
        state: &State,
    ) -> Result<Self> {
        let path = path_to("invariants.totals", name);
        let model = workspace.model.clone();
        let Some(chemistry) = model.chemistry() else {
            return Err(scene.error_at(&path, "the scene has no species", None).into());
        };
        let species = parsed(scene, &path, name, chemistry.descriptor())?;
        let (share, unit) = conserving(scene, &path, &species, workspace, state)?;
        let made = Self { name: name.to_owned(), species, share, unit };
        made.check_reaction(scene, &path, workspace, state)?;
        Ok(made)
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

    /// Refuses laws that make some of it where a run begins.
    fn check_reaction(
        &self,
        scene: &Scene,
        path: &str,
        workspace: &mut Workspace,
        state: &State,
    ) -> Result<()> {
        let model = workspace.model.clone();
        let Some(chemistry) = model.chemistry() else { return Ok(()) };
        let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
        let mut rates: Vec<Vec<f64>> = species.iter().map(|c| vec![0.0; c.len()]).collect();
        let mut out: Vec<&mut [f64]> = rates.iter_mut().map(Vec::as_mut_slice).collect();
        let signals = workspace.at(state).signals()?.clone();
        chemistry.reaction(&species, &signals, &mut out)?;
        let made = |i: usize| self.species.iter().map(|&(s, w)| w * rates[s][i]).sum::<f64>();
        let size = |i: usize| self.species.iter().map(|&(s, w)| (w * rates[s][i]).abs()).sum();
        let scale: f64 = (0..self.share.len()).map(size).fold(0.0, f64::max);
        let worst = (0..self.share.len()).max_by(|a, b| made(*a).abs().total_cmp(&made(*b).abs()));
        match worst {
            Some(point) if made(point).abs() > ROUND_OFF * scale => {
                let message = format!(
                    "the laws make `{}` at a rate of {:.2e} at {} {point}, at the start of the run: this \
                     total is not conserved",
                    self.name,
                    made(point),
                    chemistry.location().noun()
                );
                let help = "a total is of species that only move or turn into one another: \"a + b\", or \
                            \"a + 2 b\" where one b is made of two a";
                Err(scene.error_at(path, &message, Some(help)).into())
            }
            _ => Ok(()),
        }
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

/// The areas with which the transports of these species conserve their totals, and the unit of the total.
fn conserving(
    scene: &Scene,
    path: &str,
    species: &[(usize, f64)],
    workspace: &Workspace,
    state: &State,
) -> Result<(Vec<f64>, &'static str)> {
    let model = &workspace.model;
    let (sheet, moves) = (model.sheet(), model.moves());
    let Some(chemistry) = model.chemistry() else { return Ok((Vec::new(), "amount")) };
    let shares = |x: &[Vec3]| shares(sheet, chemistry.location(), x);
    if sheet.triangles().is_empty() {
        return Ok((shares(&state.x), "concentration"));
    }
    let rest = shares(sheet.rest());
    // A shape that a moving sheet may have.
    let mut x = state.x.clone();
    if moves {
        let size = (rest.iter().sum::<f64>() / real(rest.len().max(1))).sqrt();
        let wave = |k: usize| (real(k) * 0.61).sin();
        x.iter_mut().enumerate().for_each(|(i, x)| x.x += 0.1 * size * wave(5 * i + 1));
    }
    let mut candidates = vec![rest];
    if !moves && chemistry.measure() == Measure::Concentration {
        candidates.insert(0, shares(&state.x));
    }
    let holds =
        |share: &Vec<f64>| species.iter().all(|(s, _)| conserves(chemistry, sheet, &x, *s, share));
    if let Some(share) = candidates.into_iter().find(holds) {
        return Ok((share, "amount"));
    }
    let sources = |(s, _): &(usize, f64)| {
        let mut flows = chemistry.transports().iter().filter(|t| t.species() == *s);
        flows.any(|t| t.has_sources()) || !chemistry.held().of(*s).is_empty()
    };
    let message = match (chemistry.location(), moves) {
        _ if species.iter().any(sources) => {
            "an effect lets this species flow in or out (flux, exchange or hold), so its total changes"
        }
        (Location::Vertex, true) => {
            "on a sheet that moves the total of a concentration is not conserved, since nothing dilutes it"
        }
        _ => "the transport of this species does not conserve its total",
    };
    let help = "kinetics.measure = \"amount\" conserves totals on a sheet that moves, and so does metric = \"rest\" of \
                diffusion; species on faces have diffusion that conserves on flat sheets at rest only";
    Err(Error::Scene(scene.error_at(path, message, Some(help))))
}

/// Whether the transports of a species conserve its total with these areas on the shape `x`, whatever it is.
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
        "a law makes or destroys some of it, or values have been clipped at the end of their range: check the \
         rates and at species.NAME.lower; where it is the integrator's error, try a smaller time.integrator.rtol"
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
