//! One scene under several policies and integrators, from the same start.
//!
//! Every member is a run of its own, with frames and ledger. At the output times all have in common they
//! are measured: before shapes part at a bifurcation by the distance of their fields, after it by what
//! does not hang on which of equal branches was taken (energy, number of spots, separation, amplitude).

use std::path::Path;

use nalgebra::Matrix3;
use serde::Serialize;

use super::run::{self, Summary};
use super::{Setup, prepare};
use crate::geometry::{AreaRule, Shape, VertexArea};
use crate::kinetics::Search;
use crate::num::real;
use crate::output::{Interrupt, Progress, ResultDirectory};
use crate::scene::Scene;
use crate::solve::stability::Stability;
use crate::state::State;
use crate::system::System;
use crate::{Error, Result, Vec3};

/// What of a state can be compared whichever branch it is on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measures {
    /// Time.
    pub time: f64,
    /// Elastic energy.
    pub energy: f64,
    /// Largest displacement out of the rest shape.
    pub amplitude: f64,
    /// Connected regions where the first species is above half way between its least and largest
    /// values.
    pub spots: usize,
    /// Mean distance of a region's centre from the nearest other; NaN for fewer than two.
    pub separation: f64,
}

/// One member of a comparison.
pub struct Member {
    /// `policy, integrator`.
    pub name: String,
    /// What became of it.
    pub outcome: Result<Ran>,
}

/// A member that ran.
pub struct Ran {
    /// Work and times.
    pub summary: Summary,
    /// States at the output times.
    pub states: Vec<State>,
    /// Measures at the output times.
    pub measures: Vec<Measures>,
    /// Typical magnitudes of the species.
    pub typical: Vec<f64>,
}

/// Relative distances of two states: RMS of the difference of positions, after the rigid motion that
/// makes it least, over the RMS displacement of `b`; and the largest over species of the same for
/// their values.
#[must_use]
pub fn distance(a: &State, b: &State, rest: &[Vec3], typical: &[f64]) -> (f64, f64) {
    let rms = |v: &mut dyn Iterator<Item = f64>| -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for v in v {
            sum += v;
            count += 1;
        }
        (sum / real(count.max(1))).sqrt()
    };
    let aligned = aligned(&a.x, &b.x);
    let moved = rms(&mut b.x.iter().zip(rest).map(|(b, r)| (b - r).norm_squared()));
    let apart = rms(&mut aligned.iter().zip(&b.x).map(|(a, b)| (a - b).norm_squared()));
    let shape = if apart == 0.0 { 0.0 } else { apart / moved.max(f64::MIN_POSITIVE) };
    let species = a.species.iter().zip(&b.species).zip(typical).map(|((a, b), typical)| {
        let size = rms(&mut b.iter().map(|b| b * b)).max(1e-3 * typical);
        rms(&mut a.iter().zip(b).map(|(a, b)| (a - b) * (a - b))) / size
    });
    (shape, species.fold(0.0, f64::max))
}

/// `from` moved rigidly so that it lies nearest to `to` (Kabsch, doi:10.1107/S0567739476001873).
fn aligned(from: &[Vec3], to: &[Vec3]) -> Vec<Vec3> {
    let count = real(from.len().max(1));
    let centre = |x: &[Vec3]| x.iter().sum::<Vec3>() / count;
    let (a, b) = (centre(from), centre(to));
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(x, y)| (y - b) * (x - a).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return from.to_vec() };
    let mut keep = Matrix3::identity();
    // No mirror image: the least direction takes the sign.
    let least = svd.singular_values.imin();
    keep[(least, least)] = (u * v).determinant().signum();
    let turn = u * keep * v;
    from.iter().map(|x| turn * (x - a) + b).collect()
}

/// How fast the shape relaxes under drag against how fast the chemistry changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Timescales {
    /// Rate of the slowest mode of the shape, `λ/drag` per vertex, 1/time.
    pub shape: f64,
    /// Largest rate of change of a species relative to its size, 1/time.
    pub chemistry: f64,
}

impl Timescales {
    /// At the relaxed start of `setup`: one factorisation with its modes.
    ///
    /// # Errors
    /// If the plugin fails, or the modes are not found.
    pub fn of(setup: &mut Setup) -> Result<Option<Self>> {
        if !setup.system.moves() || setup.system.chemistry().is_none() {
            return Ok(None);
        }
        let drag = setup.system.drag();
        let (sheet, x) = (setup.sheet.clone(), setup.state.x.clone());
        let mechanics = setup.system.mechanics();
        let spectrum = Stability::new(mechanics)?.spectrum(mechanics, &x, 1)?;
        let area = VertexArea::new(&sheet, AreaRule::Barycentric);
        let total: f64 = mechanics.with_shape(&x, |shape: &Shape<'_>| {
            (0..sheet.triangle_count()).map(|t| area.corners(shape, t).iter().sum::<f64>()).sum()
        });
        let mean = total / real(sheet.vertex_count());
        let slowest = spectrum.modes.first().map_or(f64::NAN, |mode| mode.eigenvalue);
        let chemistry = setup.system.unrest(&setup.state)?;
        Ok(Some(Self { shape: slowest * mean / drag, chemistry }))
    }

    /// Chemical over elastic rate.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.chemistry / self.shape
    }

    /// What that means, in a sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let ratio = self.ratio();
        let sentence = if !(self.shape > 0.0) {
            "the start is not stable: its softest mode grows rather than relaxes, and how fast it \
             does is up to the drag; quasi-static jumps to where it leads"
        } else if ratio < 0.01 {
            "the shape follows the chemistry at once: quasi-static is justified"
        } else if ratio < 0.3 {
            "the shape lags a little: quasi-static errs by about this ratio"
        } else if ratio < 30.0 {
            "shape and chemistry are about as fast as one another: only simultaneous is justified"
        } else {
            "the chemistry is faster than the slowest modes of the shape: chemistry-fast may be \
             justified, quasi-static is not"
        };
        format!(
            "slowest mode of the shape {:.3e}, chemistry {:.3e} per unit of time, ratio {ratio:.2e}: \
             {sentence}",
            self.shape, self.chemistry
        )
    }
}

/// Runs one member into `root`.
///
/// # Errors
/// Whatever ends a run, and pairings that make no sense.
pub fn member(
    scene: &Scene,
    search: &Search,
    root: &Path,
    force: bool,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Ran> {
    let mut setup = prepare(scene, search)?;
    let directory = ResultDirectory::prepare(root, force)?;
    let typical = setup
        .system
        .chemistry()
        .map(|c| c.descriptor().species.iter().map(|s| s.typical).collect())
        .unwrap_or_default();
    let (mut states, mut measures) = (Vec::new(), Vec::new());
    let mut observe = |system: &mut System, state: &State| {
        measures.push(measure(system, state));
        states.push(state.clone());
    };
    let summary = run::observed(scene, &mut setup, &directory, progress, interrupt, &mut observe)?;
    if summary.ending == run::Ending::Interrupted {
        return Err(Error::Solve(crate::solve::SolveError::Interrupted));
    }
    Ok(Ran { summary, states, measures, typical })
}

fn measure(system: &mut System, state: &State) -> Measures {
    let energy = system.mechanics().energy(&state.x);
    let sheet = system.mechanics().sheet().clone();
    let amplitude =
        sheet.rest().iter().zip(&state.x).map(|(r, x)| (x - r).norm()).fold(0.0, f64::max);
    let mut measures =
        Measures { time: state.time, energy, amplitude, spots: 0, separation: f64::NAN };
    let Some(chemistry) = system.chemistry() else { return measures };
    let at_vertices = chemistry.at_vertices(&sheet, &state.species);
    let Some(c) = at_vertices.first() else { return measures };
    let (least, largest) =
        c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(*c), h.max(*c)));
    let threshold = 0.5 * (least + largest);
    if !(largest > least) {
        return measures;
    }
    let mut seen = vec![false; c.len()];
    let mut centres: Vec<Vec3> = Vec::new();
    for start in 0..c.len() {
        if seen[start] || c[start] <= threshold {
            continue;
        }
        let (mut stack, mut sum, mut count) = (vec![start], Vec3::zeros(), 0usize);
        seen[start] = true;
        while let Some(i) = stack.pop() {
            sum += state.x[i];
            count += 1;
            for &(_, j) in sheet.vertex_edges().of(i) {
                let j = j as usize;
                if !seen[j] && c[j] > threshold {
                    seen[j] = true;
                    stack.push(j);
                }
            }
        }
        centres.push(sum / real(count));
    }
    measures.spots = centres.len();
    if centres.len() > 1 {
        let nearest = |k: usize| {
            let others = centres.iter().enumerate().filter(|(other, _)| *other != k);
            others.map(|(_, other)| (other - centres[k]).norm()).fold(f64::INFINITY, f64::min)
        };
        let sum: f64 = (0..centres.len()).map(nearest).sum();
        measures.separation = sum / real(centres.len());
    }
    measures
}
