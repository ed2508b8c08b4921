//! Functions of the time: the breakpoints at which integrators end steps, so that none passes over a kink or a jump, and how
//! long steps between them may be, so that none passes over a pulse.
//!
//! Of formulas both are known with certainty ([`formula`](crate::formula)).
//! What is known by its values alone is sampled at [`SAMPLES`] intervals. The samples are simplified to a polygon
//! (Ramer, Comput. Graph. Image Process. 1 (1972) 244, doi:10.1016/S0146-664X(72)80017-0) that is nowhere further off than
//! a share `TOLERANCE` of the range of the values. Its corners are breakpoints where the pace changes at once: where a
//! segment is `PACE_RATIO` times as long as the next one, in which a step that has grown with the longer one would pass over
//! what follows. A jump between two samples is located by bisection. No step passes over two corners.

use rumple_numerics::num::real;

use crate::formula::FormulaCourse;

/// Where functions of the time have kinks and jumps, and their course between them.
#[derive(Debug, Clone, Default)]
pub struct TimeDependence {
    /// Times of kinks, jumps and onsets of pulses, in any order.
    pub breakpoints: Vec<f64>,
    /// How long steps may be between them.
    pub courses: Vec<Course>,
}

impl TimeDependence {
    /// Adds the kinks and jumps of another function, and its course.
    pub fn add(&mut self, other: Self) {
        self.breakpoints.extend(other.breakpoints);
        self.courses.extend(other.courses);
    }

    /// Times within the longest steps from 0 to `until` that pass over nothing, at most `most` of them: the function there is
    /// near to any of its values within the step.
    #[must_use]
    pub fn sample_times(&self, until: f64, most: usize) -> Vec<f64> {
        let mut ends = self.breakpoints.clone();
        ends.extend([0.0, until]);
        ends.retain(|end| (0.0..=until).contains(end));
        ends.sort_unstable_by(f64::total_cmp);
        let mut times = Vec::new();
        for pair in ends.windows(2) {
            let mut time = pair[0];
            while time < pair[1] && times.len() < most {
                let length = pair[1] - time;
                let limit = |length, course: &Course| course.longest_step(time, length);
                let length = self.courses.iter().fold(length, limit);
                times.push(time + 0.5 * length);
                time += length;
            }
        }
        times
    }
}

/// The course of a function of the time, which limits steps.
#[derive(Debug, Clone)]
pub struct Course(Known);

#[derive(Debug, Clone)]
enum Known {
    Formula(FormulaCourse),
    /// Corners of a polygon near its samples, ascending.
    Corners(Vec<f64>),
}

impl Course {
    pub(crate) fn formula(course: FormulaCourse) -> Self {
        Self(Known::Formula(course))
    }

    /// Whether it changes after `time`.
    #[must_use]
    pub fn changes_after(&self, time: f64) -> bool {
        match &self.0 {
            Known::Formula(course) => course.changes_after(time),
            Known::Corners(corners) => corners.last().is_some_and(|last| *last > time),
        }
    }

    /// The longest step from `time` that passes over no change that its ends do not show, at most `length`.
    #[must_use]
    pub fn longest_step(&self, time: f64, length: f64) -> f64 {
        match &self.0 {
            Known::Formula(course) => course.longest_step(time, length),
            Known::Corners(corners) => {
                let next = corners.partition_point(|corner| *corner <= time);
                corners.get(next + 1).map_or(length, |corner| length.min(corner - time))
            }
        }
    }
}

/// Intervals in which a span is sampled.
pub const SAMPLES: usize = 2048;
/// Largest error of the polygon, relative to the range of the values: features below a twentieth are left to the error
/// control.
const TOLERANCE: f64 = 0.05;
/// Lengths of neighbouring segments that differ by this factor are a change of pace. Smooth oscillations stay below 4,
/// integrators lengthen steps by 2 to 10 at once.
const PACE_RATIO: f64 = 8.0;
/// Corners that are breakpoints after an onset, so that a step ends within the pulse, and after a jump.
const FOLLOWING_CORNERS: [usize; 2] = [3, 1];
/// A change between two samples that a bisection leaves as large as this share is a jump.
const JUMP_SHARE: f64 = 0.5;
/// Halvings after which a steep change has to have become smaller, and those that locate a jump.
const HALVINGS: [usize; 2] = [12, 60];
/// Jumps that are located; a function with more is noise.
const MAX_JUMPS: usize = 256;

/// The breakpoints from 0 to `until` of functions of the time and their course, where `values` gives one column of each at
/// some times; `None` where they have none.
pub fn sampled(
    until: f64,
    mut values: impl FnMut(&[f64]) -> Option<Vec<Vec<f64>>>,
) -> Option<TimeDependence> {
    let times: Vec<f64> = (0..=SAMPLES).map(|k| until * (real(k) / real(SAMPLES))).collect();
    let mut columns = values(&times)?;
    let mut scale = Vec::new();
    for column in &columns {
        let (least, most) = range(column);
        let round_off = 1e-12 * least.abs().max(most.abs());
        scale.push(if most - least > round_off { 1.0 / (most - least) } else { 0.0 });
    }
    let varies: Vec<bool> = scale.iter().map(|scale| *scale > 0.0).collect();
    let scaled = |mut columns: Vec<Vec<f64>>| {
        let factors = columns.iter_mut().zip(&scale);
        factors.for_each(|(column, scale)| column.iter_mut().for_each(|value| *value *= scale));
        let mut kept = varies.iter();
        columns.retain(|_| kept.next().is_some_and(|varies| *varies));
        columns
    };
    columns = scaled(columns);
    if columns.is_empty() {
        return Some(TimeDependence::default());
    }
    let mut at = |time: f64| -> Option<Vec<f64>> {
        let columns = scaled(values(&[time])?);
        columns.iter().map(|column| column.first().copied()).collect()
    };
    let corners = polygon(&columns);
    let mut nodes = vec![(0.0, false)];
    let mut jumps = 0;
    for pair in corners.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        let of = |k: usize| columns.iter().map(|column| column[k]).collect::<Vec<f64>>();
        let steep = high == low + 1 && difference(&of(low), &of(high)) > TOLERANCE;
        if steep && jumps < MAX_JUMPS {
            jumps += 1;
            let ends = [(times[low], of(low)), (times[high], of(high))];
            if let Some(time) = located(ends, &mut at)? {
                nodes.pop_if(|(time, jump)| !*jump && *time > 0.0);
                nodes.push((time, true));
                continue;
            }
        }
        nodes.push((times[high], false));
    }
    let course = Course(Known::Corners(nodes.iter().map(|node| node.0).collect()));
    Some(TimeDependence { breakpoints: paced(&nodes, until), courses: vec![course] })
}

/// Where pace changes at once, some corners after that, and jumps.
fn paced(nodes: &[(f64, bool)], until: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut after = 0;
    for (k, (time, jump)) in nodes.iter().enumerate().skip(1) {
        let next = nodes.get(k + 1).map_or(until, |node| node.0);
        let onset = time - nodes[k - 1].0 > PACE_RATIO * (next - time) && next < until;
        if (*jump || onset || after > 0) && *time < until {
            found.push(*time);
        }
        after = match (onset, jump) {
            (true, _) => FOLLOWING_CORNERS[0],
            (false, true) => after.max(FOLLOWING_CORNERS[1]),
            (false, false) => after.saturating_sub(1),
        };
    }
    found
}

fn range(column: &[f64]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    column.iter().fold(ends, |(least, most), value| (least.min(*value), most.max(*value)))
}

/// The largest difference of two columns.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// The time between two at which values jump; `None` if they only change fast.
fn located(
    [(mut low, mut before), (mut high, mut behind)]: [(f64, Vec<f64>); 2],
    at: &mut impl FnMut(f64) -> Option<Vec<f64>>,
) -> Option<Option<f64>> {
    let whole = difference(&before, &behind);
    for halving in 0..HALVINGS[1] {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            break;
        }
        let values = at(middle)?;
        if difference(&before, &values) > difference(&values, &behind) {
            (high, behind) = (middle, values);
        } else {
            (low, before) = (middle, values);
        }
        if halving >= HALVINGS[0] && difference(&before, &behind) < JUMP_SHARE * whole {
            return Some(None);
        }
    }
    Some(Some(high))
}

/// The numbers of the samples that are corners of the polygon.
fn polygon(columns: &[Vec<f64>]) -> Vec<usize> {
    let mut corners = vec![0, SAMPLES];
    let mut open = vec![(0, SAMPLES)];
    while let Some((low, high)) = open.pop() {
        let off = |k: usize| {
            let share = real(k - low) / real(high - low);
            columns.iter().fold(0.0, |most: f64, column| {
                let line = column[low] + share * (column[high] - column[low]);
                most.max((column[k] - line).abs())
            })
        };
        let farthest = (low + 1..high).map(|k| (off(k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((off, k)) = farthest.filter(|(off, _)| *off > TOLERANCE) {
            debug_assert!(off.is_finite());
            corners.push(k);
            open.extend([(low, k), (k, high)]);
        }
    }
    corners.sort_unstable();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(until: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let values = |times: &[f64]| Some(vec![times.iter().map(|t| f(*t)).collect()]);
        sampled(until, values).unwrap_or_default().breakpoints
    }

    #[test]
    fn smooth_functions_have_none() {
        assert!(of(100.0, |_| 3.0).is_empty());
        assert!(of(100.0, |t| 2.0 * t).is_empty());
        assert!(of(100.0, |t| (-t).exp()).is_empty());
        for periods in [1.0, 3.0, 10.0, 100.0] {
            let found = of(periods, |t| (std::f64::consts::TAU * t).sin());
            assert!(found.is_empty(), "{periods} periods: {found:?}");
        }
    }

    #[test]
    fn jumps_are_located() {
        let pulse = |t: f64| if (50.0 + 1.0 / 3.0..52.0).contains(&t) { 1.0 } else { 0.0 };
        let found = of(100.0, pulse);
        for jump in [50.0 + 1.0 / 3.0, 52.0] {
            assert!(found.iter().any(|t| (t - jump).abs() < 1e-12), "{found:?}");
        }
    }

    #[test]
    fn steps_end_within_smooth_pulses_and_at_their_onset() {
        for (centre, width) in [(50.0, 1.0), (70.0, 0.1)] {
            let found = of(100.0, |t| (-((t - centre) / width).powi(2)).exp());
            assert!(
                found.iter().any(|t| (centre - 4.0 * width..centre - width).contains(t)),
                "{found:?}"
            );
            assert!(found.iter().any(|t| (t - centre).abs() < 1.5 * width), "{found:?}");
            assert!(found.len() < 8, "{found:?}");
        }
    }

    #[test]
    fn what_has_no_values_has_no_breakpoints() {
        assert!(sampled(1.0, |_| None).is_none());
    }
}
