//! Where disturbances begin to grow between two points of a branch.
//!
//! The derivative of the imbalance g by u = (x, c) and that of its shape alone are
//!
//! ```text
//! ∂g/∂u = [ H  C ]        H = ∂²U/∂x²,  C = ∂²U/∂x∂c,  S = K - G H⁻¹ C
//!         [ G  K ]        det ∂g/∂u = det H det S
//! ```
//!
//! Where the policy gives the shape no storage, disturbances are those of the shape at given species, as many as H has
//! negative eigenvalues, which grow at once, and those of the species with the shape slaved to them, `dc/dt = -S c`. These
//! are the growth rates of both under a drag ε in the limit ε → 0. Two blocks of eigenvalues are counted, and one changes
//! its number where
//!
//! * **S is singular**: a bifurcation of steady states, or an oscillation (Hopf);
//! * **H and ∂g/∂u are singular**, as where the mode v of H changes no rate (G v = 0) or no species pushes along it
//!   (Cᵀ v = 0): a bifurcation of steady states along v;
//! * **H alone is singular**: an eigenvalue of S goes through infinity. No other branch passes (singularity-induced
//!   bifurcation).
//!
//! A bifurcation by a mode is sought as the zero of τ = 1/(f · (∂g/∂u)⁻¹ f), the test function of the matrix bordered by a form f
//! of the mode: the place where ∂g/∂u is singular depends on no storage, and τ is regular where H alone is singular. Only
//! where τ keeps its sign is the eigenvalue itself used.
//!
//! References: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM 2000), section 3.3,
//! doi:10.1137/1.9780898719543; Venkatasubramanian, Schättler & Zaborszky, IEEE Trans. Automat. Control 40 (1995) 1992,
//! doi:10.1109/9.478226 (singularity-induced bifurcations).

use std::ops::Range;

use super::special::{Step, zero};
use super::system::{Equilibrium, System};
use super::{Block, Continuation, CriticalMode, Event, Point, SolveError, Unknowns};
use crate::solve::continuation::branch::MAX_LOCATED;

/// An eigenvalue below this share of its change over the step is 0: that is the error of λ in units of the step.
const ZERO_EIGENVALUE_SHARE: f64 = 1e-5;
/// What stays above this share has no zero: it jumps, or goes through infinity.
const MAX_ZERO_RESIDUAL: f64 = 1e-3;
/// Bifurcations nearer to one another than this share of a step are one; and an eigenvalue of H below this share of its change
/// is 0 where ∂g/∂u is singular.
const COINCIDENCE_SHARE: f64 = 1e-3;

/// A change of sign that is looked for.
struct Sought {
    block: Block,
    /// The number of the eigenvalue in its block, ascending.
    number: usize,
    /// The numbers of all modes of its point.
    own: Range<usize>,
    /// The mode of that number at both ends of the step.
    ends: [CriticalMode; 2],
}

impl Sought {
    /// By how much the eigenvalue changes over the step.
    fn change(&self) -> f64 {
        (self.ends[0].eigenvalue - self.ends[1].eigenvalue).abs()
    }
}

impl<S: System> Continuation<S> {
    /// The lowest `count` eigenvalues of `block` at `at`, with their modes; none if they are not found.
    fn modes(
        &mut self,
        at: &mut Equilibrium<S::Member>,
        block: Block,
        count: usize,
    ) -> Result<Vec<CriticalMode>, SolveError> {
        match self.corrector.system.modes(at, block, count) {
            Err(SolveError::Interrupted) => Err(SolveError::Interrupted),
            found => Ok(found.unwrap_or_default()),
        }
    }

    /// The bifurcations and singularities of `step`, which leads to `last`: those that the fold in it is not.
    pub(super) fn bifurcations(
        &mut self,
        step: &Step<'_>,
        last: &mut Equilibrium<S::Member>,
    ) -> Result<Vec<Point>, S::Error> {
        let before = self.point.unstable_directions();
        let Some(mut first) = self.between(step, 0.0)? else { return Ok(Vec::new()) };
        let mut all: Vec<Point> = Vec::new();
        for block in Block::ALL {
            let [from, to] = [before, step.unstable].map(|unstable| unstable.in_block(block));
            if from == to {
                continue;
            }
            let high = from.max(to);
            let mut ends = [Vec::new(), Vec::new()];
            for (modes, at) in ends.iter_mut().zip([&mut first, &mut *last]) {
                *modes = self.modes(at, block, high)?;
            }
            for (number, own) in eigenvalues_to_locate(from, to) {
                let [Some(start), Some(end)] = [0, 1].map(|k: usize| ends[k].get(number)) else {
                    continue;
                };
                let sought = Sought { block, number, own, ends: [start.clone(), end.clone()] };
                let Some(point) = self.locate(step, [&mut first, &mut *last], &sought)? else {
                    continue;
                };
                add(&mut all, point, COINCIDENCE_SHARE * step.length);
            }
        }
        Ok(all)
    }

    /// The point of what is sought, if it is found.
    fn locate(
        &mut self,
        step: &Step<'_>,
        ends: [&mut Equilibrium<S::Member>; 2],
        sought: &Sought,
    ) -> Result<Option<Point>, S::Error> {
        let found = match self.singular(step, ends, sought)? {
            Some(found) => Some(found),
            None => self.vanishing(step, sought)?,
        };
        let Some((mut at, event)) = found else { return Ok(None) };
        Ok(Some(self.special_point(&mut at, event)?))
    }

    /// Where ∂g/∂u is singular along the mode that is sought, if it is.
    fn singular(
        &mut self,
        step: &Step<'_>,
        ends: [&mut Equilibrium<S::Member>; 2],
        sought: &Sought,
    ) -> Result<Option<Located<S>>, S::Error> {
        let mode = &sought.ends[1];
        if mode.frequency != 0.0 {
            return Ok(None);
        }
        let mut values = [f64::NAN; 2];
        for (value, at) in values.iter_mut().zip(ends) {
            let Some((tested, _)) = self.corrector.system.test_function(at, mode)? else {
                return Ok(None);
            };
            *value = tested;
        }
        let unit = (values[0] - values[1]).abs();
        if !(values[0] * values[1] < 0.0 && unit.is_finite()) {
            return Ok(None);
        }
        let mut evaluate = |s: f64| {
            let Some(mut at) = self.between(step, s)? else { return Ok(None) };
            let tested = self.corrector.system.test_function(&mut at, mode)?;
            Ok::<_, S::Error>(tested.map(|(value, null)| (value / unit, (at, null))))
        };
        let found = zero(
            step.length,
            values.map(|value| value / unit),
            ZERO_EIGENVALUE_SHARE,
            &mut evaluate,
        )?;
        let Some((_, (mut at, null))) = found.filter(|(left, _)| left.abs() <= MAX_ZERO_RESIDUAL)
        else {
            return Ok(None);
        };
        let of_shape = self.null_vectors_of_shape(&mut at, sought, null)?;
        let modes = match of_shape {
            Some(modes) => modes,
            None => {
                let mut modes = self.modes(&mut at, Block::Coupled, usize::MAX)?;
                modes.retain(|mode| mode.frequency == 0.0);
                modes.sort_by(|a, b| a.eigenvalue.abs().total_cmp(&b.eigenvalue.abs()));
                modes.truncate(sought.own.len());
                modes
            }
        };
        Ok(Some((at, Event::Bifurcation(modes))))
    }

    /// The modes that are sought, if they are of H and that is singular at `at`, where the null vector of ∂g/∂u is `null`.
    fn null_vectors_of_shape(
        &mut self,
        at: &mut Equilibrium<S::Member>,
        sought: &Sought,
        null: Unknowns,
    ) -> Result<Option<Vec<CriticalMode>>, SolveError> {
        let Sought { block: Block::Shape, number, ref own, .. } = *sought else { return Ok(None) };
        let mut modes = self.modes(at, Block::Shape, own.end)?;
        let Some(mode) = modes.get_mut(number) else { return Ok(None) };
        if mode.eigenvalue.abs() > COINCIDENCE_SHARE * sought.change() {
            return Ok(None);
        }
        mode.shape = null;
        Ok(Some(modes.into_iter().skip(own.start).collect()))
    }

    /// Where the eigenvalue that is sought is 0, if it is.
    fn vanishing(
        &mut self,
        step: &Step<'_>,
        sought: &Sought,
    ) -> Result<Option<Located<S>>, S::Error> {
        let Sought { block, number, ref own, .. } = *sought;
        let unit = sought.change();
        let values = [0, 1].map(|k: usize| sought.ends[k].eigenvalue / unit);
        let mut evaluate = |s: f64| {
            let Some(mut at) = self.between(step, s)? else { return Ok(None) };
            let modes = self.modes(&mut at, block, own.end)?;
            let value = modes.get(number).map(|mode| mode.eigenvalue / unit);
            Ok::<_, S::Error>(value.map(|value| (value, (at, modes))))
        };
        let found = zero(step.length, values, ZERO_EIGENVALUE_SHARE, &mut evaluate)?;
        let Some((_, (mut at, modes))) = found.filter(|(left, _)| left.abs() <= MAX_ZERO_RESIDUAL)
        else {
            return Ok(None);
        };
        let regular = match block {
            Block::Shape => self.corrector.system.test_function(&mut at, &modes[number])?.is_some(),
            Block::Coupled => false,
        };
        let modes = modes.into_iter().take(own.end).skip(own.start).collect();
        let event = if regular { Event::Singularity(modes) } else { Event::Bifurcation(modes) };
        Ok(Some((at, event)))
    }
}

/// A special point with its event.
type Located<S> = (Equilibrium<<S as System>::Member>, Event);

/// The numbers of the eigenvalues that are located where `from` of them are negative before a step and `to` after, and for each
/// the numbers of the modes of its point.
fn eigenvalues_to_locate(from: usize, to: usize) -> Vec<(usize, Range<usize>)> {
    let (low, high) = (from.min(to), from.max(to));
    match high - low {
        ..=MAX_LOCATED => (low..high).map(|k| (k, k..k + 1)).collect(),
        _ if from == low => vec![(low, low..high)],
        _ => vec![(high - 1, low..high)],
    }
}

/// Adds `point` to `all`, or its modes to a point of the same kind nearer than `near`.
fn add(all: &mut Vec<Point>, point: Point, near: f64) {
    let same = |other: &&mut Point| (other.arc - point.arc).abs() <= near;
    match (all.iter_mut().find(same).map(|other| &mut other.event), &point.event) {
        (Some(Event::Bifurcation(others)), Event::Bifurcation(modes))
        | (Some(Event::Singularity(others)), Event::Singularity(modes)) => {
            others.extend(modes.iter().cloned());
        }
        _ => all.push(point),
    }
}
