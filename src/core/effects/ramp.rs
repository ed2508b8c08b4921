//! Factors that change in time: of loads, pressures and displacements.
//!
//! ```text
//! ramp = { formula = "min(t/2, 1)" }                  of t, as laws are written
//! ramp = { points = [[0, 0], [2, 1], [5, 0.5]] }      straight between [time, factor], constant outside
//! ```

use serde::{Deserialize, Serialize};

use super::EffectError;
use crate::Vec3;
use crate::kinetics::breakpoints::{self, TimeDependence};
use crate::kinetics::formula::FieldFormula;
use crate::num::checked::{Finite, LARGEST};

/// Times at which two factors are compared at most.
pub(super) const MAX_SAMPLES: usize = 2048;

/// A factor of time as a scene gives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ramp {
    /// A formula of `t`.
    Formula(String),
    /// Pairs of time and factor, in ascending times.
    Points(Vec<[Finite; 2]>),
}

/// A factor of time, ready to be evaluated; 1 if there is none.
///
/// ```
/// # use rumple_core as rumple;
/// use rumple::effects::{RampFactor, Ramp};
///
/// let ramp = Ramp::Formula("min(t/2, 1)".into());
/// assert_eq!(RampFactor::new(Some(&ramp))?.factor_at(1.0), 0.5);
/// # Ok::<(), rumple::effects::EffectError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct RampFactor(Option<Profile>);

#[derive(Debug, Clone)]
enum Profile {
    Formula(Box<FieldFormula>),
    Points(Vec<[f64; 2]>),
}

impl RampFactor {
    /// The factor that a scene's ramp gives.
    ///
    /// # Errors
    /// A formula that cannot be read or depends on the position, times that do not ascend; blamed on the
    /// key `ramp`.
    pub fn new(ramp: Option<&Ramp>) -> Result<Self, EffectError> {
        let refuse =
            |message: String, help: Option<String>| Err(EffectError { key: "ramp", message, help });
        let made = Self(match ramp {
            None => None,
            Some(Ramp::Formula(text)) => match FieldFormula::new(text, true) {
                Err(error) => return refuse(error.message, error.help),
                Ok(formula) if formula.depends_on_position() => {
                    return refuse("a ramp is a formula of the time t alone".into(), None);
                }
                Ok(formula) => Some(Profile::Formula(Box::new(formula))),
            },
            Some(Ramp::Points(points)) => {
                let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(Finite::get)).collect();
                if points.is_empty() {
                    let help = "write [[time, factor], …], as in [[0, 0], [2, 1]]";
                    return refuse("a ramp needs at least one point".into(), Some(help.into()));
                }
                if !points.windows(2).all(|p| p[0][0] < p[1][0]) {
                    let message = "the times of a ramp must increase";
                    let help = "write [[time, factor], …], as in [[0, 0], [2, 1]]";
                    return refuse(message.into(), Some(help.into()));
                }
                Some(Profile::Points(points))
            }
        });
        let start = made.factor_at(0.0);
        if !(start.abs() <= LARGEST) {
            return refuse(
                format!("the ramp is {} at time 0", crate::num::Short(start)),
                Some(format!("its size must be at most {LARGEST:e} at every time of the run")),
            );
        }
        Ok(made)
    }

    /// Whether there is a ramp.
    #[must_use]
    pub fn changes(&self) -> bool {
        self.0.is_some()
    }

    /// The factor at `time`.
    #[must_use]
    pub fn factor_at(&self, time: f64) -> f64 {
        match &self.0 {
            None => 1.0,
            Some(Profile::Formula(formula)) => {
                formula.evaluate(&[Vec3::zeros()], time).iter().sum()
            }
            Some(Profile::Points(points)) => {
                let later = points.iter().position(|p| p[0] > time);
                match later {
                    Some(0) => points[0][1],
                    None => points.last().map_or(1.0, |p| p[1]),
                    Some(k) => {
                        let ([t0, s0], [t1, s1]) = (points[k - 1], points[k]);
                        s0 + (s1 - s0) * (time - t0) / (t1 - t0)
                    }
                }
            }
        }
    }

    /// Where it has kinks and jumps from time 0 to `until`, and its course between them.
    #[must_use]
    pub fn time_dependence(&self, until: f64) -> TimeDependence {
        let mut found = TimeDependence::default();
        match &self.0 {
            None => {}
            Some(Profile::Points(points)) => {
                let times = points.iter().map(|point| point[0]);
                found.breakpoints.extend(times.filter(|t| (0.0..=until).contains(t)));
            }
            Some(Profile::Formula(formula)) => {
                formula.time_dependence(&[Vec3::zeros()], until, &mut found);
                let values = |times: &[f64]| {
                    let values: Vec<f64> = times.iter().map(|time| self.factor_at(*time)).collect();
                    values.iter().all(|value| value.is_finite()).then(|| vec![values])
                };
                let onsets = breakpoints::sampled(until, values).unwrap_or_default();
                found.breakpoints.extend(onsets.breakpoints);
            }
        }
        found
    }

    /// The same of a scene's ramp; nothing of one that cannot be read.
    pub(super) fn time_dependence_of(ramp: Option<&Ramp>, until: f64) -> TimeDependence {
        Self::new(ramp)
            .map_or_else(|_| TimeDependence::default(), |ramp| ramp.time_dependence(until))
    }

    /// Times from 0 to `until` at which factors that differ do: breakpoints, and times between them at which pulses are seen.
    #[must_use]
    pub(crate) fn samples(&self, until: f64) -> Vec<f64> {
        let known = self.time_dependence(until);
        let mut times = known.sample_times(until, MAX_SAMPLES);
        times.extend(known.breakpoints);
        times.extend([0.0, until]);
        times
    }

    /// Largest factor of points; 1 of a formula, which may have none.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match &self.0 {
            Some(Profile::Points(points)) => points.iter().fold(0.0, |m, p| m.max(p[1].abs())),
            _ => 1.0,
        }
    }
}
