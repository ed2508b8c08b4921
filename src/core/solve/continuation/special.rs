//! Special points between two points of a branch: folds, and what `bifurcations.rs` finds.
//!
//! Along the chord `s = ⟨t₀, u - u₀⟩` of one step the branch is a function of s. A fold is the zero of λ̇(s), by regula falsi
//! with the Illinois weights (Dowell & Jarratt, BIT 11 (1971) 168, doi:10.1007/BF01934364); guesses are those of the cubic
//! between the two ends.

use super::corrector::CorrectorOutcome;
use super::system::{Equilibrium, System};
use super::{Continuation, Direction, Event, Point, SolveError, Unknowns, UnstableDirections};

/// |λ̇| in units of Λ below which a point is the fold: the error of λ there is of the order of its square.
const FOLD_TOLERANCE: f64 = 1e-5;
/// Most points tried for one zero.
const MAX_POINTS: usize = 30;

/// One step: from the point of a branch to an equilibrium.
pub(super) struct Step<'a> {
    at: &'a Unknowns,
    parameter: f64,
    tangent: &'a Direction,
    /// Length of the chord.
    pub(super) length: f64,
    pub(super) unstable: UnstableDirections,
}

impl<S: System> Continuation<S> {
    /// The special points before `at`, where the tangent is `tangent` and so many disturbances grow, in their order; one of
    /// them a fold where λ turns back.
    pub(super) fn special(
        &mut self,
        at: &mut Equilibrium<S::Member>,
        (tangent, unstable): (&Direction, UnstableDirections),
        fold: bool,
    ) -> Result<Vec<Point>, S::Error> {
        let changed = unstable.distance(self.point.unstable_directions());
        if !fold && changed == 0 {
            return Ok(Vec::new());
        }
        let length = self.chord(at);
        let (end, parameter) = (at.at.clone(), at.parameter);
        let step = Step { at: &end, parameter, tangent, length, unstable };
        let mut found = Vec::new();
        if fold {
            found.extend(self.fold(&step)?);
        }
        // The eigenvalue that the fold turns has changed its sign with λ̇.
        if changed != usize::from(fold) {
            found.extend(self.bifurcations(&step, at)?);
        }
        found.sort_by(|a, b| a.arc.total_cmp(&b.arc));
        Ok(found)
    }

    /// Length of the chord to `at`: `⟨t₀, u - u₀⟩`.
    fn chord(&self, at: &Equilibrium<S::Member>) -> f64 {
        let unknowns = at.at.plus(-1.0, &self.point.at);
        let way = Direction { unknowns, parameter: at.parameter - self.point.parameter };
        self.corrector.metric.inner(&self.tangent, &way)
    }

    /// The equilibrium at `s` of `step`.
    pub(super) fn between(
        &mut self,
        step: &Step<'_>,
        s: f64,
    ) -> Result<Option<Equilibrium<S::Member>>, S::Error> {
        let (h, share) = (step.length, s / step.length);
        let slope = 1.0 / self.corrector.metric.inner(&self.tangent, step.tangent);
        let rest = 1.0 - share;
        let [from, to] = [rest * rest * (1.0 + 2.0 * share), share * share * (3.0 - 2.0 * share)];
        let [leave, reach] = [h * share * rest * rest, -h * share * share * rest * slope];
        let (point, tangent) = (&self.point, &self.tangent);
        let mut guess = point.at.clone();
        guess.scale(from);
        let guess = guess.plus(to, step.at).plus(leave, &tangent.unknowns);
        let guess = guess.plus(reach, &step.tangent.unknowns);
        let parameter = from * point.parameter
            + to * step.parameter
            + leave * tangent.parameter
            + reach * step.tangent.parameter;
        Ok(match self.correct_from((guess, parameter), &self.tangent.clone(), s)? {
            CorrectorOutcome::Found(at) => Some(*at),
            CorrectorOutcome::Lost(_) => None,
        })
    }

    /// The point of `at`, with its event.
    pub(super) fn special_point(
        &mut self,
        at: &mut Equilibrium<S::Member>,
        event: Event,
    ) -> Result<Point, SolveError> {
        // An eigenvalue is 0 here, of either sign: where it cannot be counted the number before is as true.
        let unstable = match self.corrector.system.unstable_directions(at) {
            Err(SolveError::Linear(_)) => self.point.unstable_directions(),
            counted => counted?,
        };
        let arc = self.point.arc + self.distance(at);
        Ok(Point { event, ..Point::new(at, arc, unstable) })
    }

    fn fold(&mut self, step: &Step<'_>) -> Result<Option<Point>, S::Error> {
        let scale = self.corrector.metric.scale();
        let ends = [self.tangent.parameter / scale, step.tangent.parameter / scale];
        let mut evaluate = |s: f64| {
            let Some(mut at) = self.between(step, s)? else { return Ok(None) };
            let slope = self.tangent_at(&mut at)?.parameter / scale;
            Ok::<_, S::Error>(Some((slope, at)))
        };
        let found = zero(step.length, ends, FOLD_TOLERANCE, &mut evaluate)?;
        let found = found.map(|(_, mut at)| self.special_point(&mut at, Event::Fold));
        Ok(found.transpose()?)
    }
}

/// The zero of a function of s between 0 and `length` with the values `ends` there, to the value `tolerance`: what was
/// evaluated nearest to it, with its value. None where nothing could be evaluated.
pub(super) fn zero<T, E>(
    length: f64,
    ends: [f64; 2],
    tolerance: f64,
    evaluate: &mut dyn FnMut(f64) -> Result<Option<(f64, T)>, E>,
) -> Result<Option<(f64, T)>, E> {
    let (mut a, mut b) = ((0.0, ends[0]), (length, ends[1]));
    let mut best: Option<(f64, T)> = None;
    for _ in 0..MAX_POINTS {
        let inner = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
        let s = if inner.is_finite() { inner } else { 0.5 * (a.0 + b.0) };
        let Some((value, what)) = evaluate(s)? else { break };
        if best.as_ref().is_none_or(|(least, _)| value.abs() < least.abs()) {
            best = Some((value, what));
        }
        if value.abs() <= tolerance || (b.0 - a.0).abs() <= tolerance * tolerance * length {
            break;
        }
        if value * b.1 < 0.0 {
            a = b;
        } else {
            a.1 *= 0.5;
        }
        b = (s, value);
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::zero;

    #[test]
    fn a_zero_is_found_to_its_tolerance() {
        let f = |s: f64| s * s * s - 0.2;
        let mut evaluate = |s: f64| Ok::<_, ()>(Some((f(s), s)));
        let (_, found) = zero(2.0, [f(0.0), f(2.0)], 1e-9, &mut evaluate).unwrap().unwrap();
        assert!((found - 0.2f64.cbrt()).abs() < 1e-8, "{found}");
    }
}
