//! The lengths of the steps that are left.
//!
//! A step is as long as the rule allows, and all are equally long up to the next output time, so that fixed steps are
//! counted exactly. Under error control the number of steps per time is extrapolated by a power of time, fitted since
//! [`SINCE`] of the time reached to the lengths that the error estimate allows. Neither output times nor a limit on
//! growth hide these. Where the integrator does not say them, they are the lengths of the steps that no output time
//! cuts.

use super::power_law::PowerLaw;
use super::{FEWEST, Forecast, SAME, SINCE, Taken};
use crate::num::real;
use crate::solve::StepRule;

/// Steps per time stay what they were unless seen otherwise; the second number is the weight of that.
const PRIOR: (f64, f64) = (0.0, 0.2);
/// Steps are taken to be equally long over this share of the time reached: less is slower, more misses the trend.
const STRIDE: f64 = 0.05;

impl Forecast {
    /// Steps and seconds that are left at so many times the tolerance, with this share of how lengths have gone
    /// with time.
    pub(super) fn rest(&self, tolerance: f64, share: f64) -> (f64, f64) {
        let (order, longest) = match self.rule {
            StepRule::Fixed(_) => (1.0, f64::INFINITY),
            StepRule::Controlled { power, longest, .. } => (power, longest),
        };
        let factor = tolerance.powf(1.0 / order);
        let per_time = self.steps_per_time().with_share(share);
        let (way, cost) = (&self.way, self.cost());
        let (mut now, mut steps, mut seconds) = (self.time(), 0.0, 0.0);
        while now < way.until * (1.0 - SAME) {
            let allowed = (factor / per_time.at(now)).min(longest);
            let left = way.next_output(now) - now;
            let number = (left / allowed - SAME).ceil().max(1.0);
            let length = left / number;
            let stride = STRIDE * now;
            let count = if stride < 2.0 * left || left < way.every * (1.0 - SAME) {
                (stride / length).floor().clamp(1.0, number)
            } else {
                // Several intervals between output times are alike.
                number * (stride.min(way.until - now) / left).floor()
            };
            steps += count;
            seconds += count * cost.at(length);
            now += count * length;
        }
        let most = way.max_steps.map_or(steps, |most| real(most.saturating_sub(self.count)));
        if most < steps { (most, seconds * most / steps) } else { (steps, seconds) }
    }

    /// Steps per time, over time.
    fn steps_per_time(&self) -> PowerLaw {
        let since = self.steps.partition_point(|step| step.time <= SINCE * self.time());
        let latest = &self.steps[since.min(self.steps.len().saturating_sub(FEWEST))..];
        let allowed = |step: &Taken| match self.rule {
            StepRule::Fixed(length) => Some(length),
            StepRule::Controlled { .. } => step.allowed.or((!step.cut).then_some(step.length)),
        };
        let all_cut = !latest.iter().any(|step| allowed(step).is_some());
        let point = |step: &Taken| {
            let length = allowed(step).or(all_cut.then_some(step.length))?;
            Some((step.time.ln(), -length.min(self.way.until).ln(), step.length))
        };
        PowerLaw::fit(&latest.iter().filter_map(point).collect::<Vec<_>>(), PRIOR)
    }
}
