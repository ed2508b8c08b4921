//! How far a step may lead without passing over changes of the parts of a formula that depend on the time alone.
//!
//! ```text
//! range f([t, t + h]) ≤ s range f([0, T])       of every such part f of the formula
//! ```
//!
//! The range over a step is an interval extension: no pulse is too short to be noticed. That over the span of the run is
//! sampled, at the points where the formula is evaluated.

use super::interval::Interval;
use super::time_graph::TimeGraph;
use rumple_numerics::num::real;

/// s: a sine takes ten steps a period at least, fewer than any error control below a per cent.
const SHARE: f64 = 0.2;
/// Parts of the span for the ranges over it.
const PARTS: usize = 2048;
/// A part that changes by less than this share of its range has settled.
const STEADY_SHARE: f64 = 1e-3;
/// A sampled range below this share of the bounds may have missed a pulse, and the bounds count.
const MISSED_SHARE: f64 = 0.01;
/// Points at which a formula of the place is followed, …
const MAX_POINTS: usize = 64;
/// … fewer where their ranges would take more evaluations of an operation than this: a tenth of a second.
const MAX_EVALUATIONS: usize = 4_000_000;
/// Steps are not limited below this share of the span: what changes faster is a jump, …
const SHORTEST: f64 = 1e-10;
/// … nor for parts without bounds over this one: there a law has no values, and its own errors limit steps.
const UNBOUNDED: f64 = 1e-3;
/// Halvings of the uncertainty of the longest step.
const REFINEMENTS: usize = 3;

/// The parts of a formula that depend on the time alone, over the span of a run.
#[derive(Debug, Clone)]
pub(crate) struct FormulaCourse {
    graph: TimeGraph,
    /// The parts and their ranges over the span.
    parts: Vec<(usize, f64)>,
    /// dv/dt of values whose turning points end steps.
    slopes: Vec<usize>,
    /// Values of the other inputs at the points.
    points: Vec<Vec<f64>>,
    until: f64,
}

impl FormulaCourse {
    /// Of these `parts` of `graph`, until the time `until`, at some of `count` points where `input` gives the values
    /// of the other inputs by their numbers and that of the point.
    pub(super) fn new(
        (graph, parts, slopes): (&TimeGraph, &[usize], &[usize]),
        until: f64,
        count: usize,
        input: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let most = (MAX_EVALUATIONS / (PARTS * graph.ops.len().max(1))).clamp(1, MAX_POINTS);
        let chosen = if graph.others.is_empty() { 1 } else { count.min(most) };
        let mut points: Vec<Vec<f64>> =
            (0..chosen).map(|k| graph.inputs(k * count / chosen, &input)).collect();
        points.dedup();
        let mut made = Self {
            graph: graph.clone(),
            parts: parts.iter().map(|part| (*part, 0.0)).collect(),
            slopes: slopes.to_vec(),
            points,
            until,
        };
        let each: Vec<Vec<f64>> = made.points.iter().map(|point| made.ranges(point, 0.0)).collect();
        for (k, (_, range)) in made.parts.iter_mut().enumerate() {
            *range = each.iter().fold(0.0, |most: f64, ranges| most.max(ranges[k]));
        }
        made
    }

    /// The ranges of the parts from a time to the end of the span at a point.
    fn ranges(&self, point: &[f64], from: f64) -> Vec<f64> {
        let empty = Interval { low: f64::INFINITY, high: f64::NEG_INFINITY };
        let (mut bounds, mut sampled) =
            (vec![empty; self.parts.len()], vec![empty; self.parts.len()]);
        let mut values = Vec::new();
        let time = |k: usize| from + (self.until - from) * real(k) / real(PARTS);
        for k in 0..PARTS {
            let part = Interval { low: time(k), high: time(k + 1) };
            for (times, hulls) in
                [(part, &mut bounds), (Interval::point(part.middle()), &mut sampled)]
            {
                self.graph.evaluate(point, times, &mut values);
                for ((part, _), hull) in self.parts.iter().zip(hulls) {
                    let Interval { low, high } = values[*part];
                    if low.is_finite() && high.is_finite() {
                        (hull.low, hull.high) = (hull.low.min(low), hull.high.max(high));
                    }
                }
            }
        }
        let width = |hull: &Interval| (hull.high - hull.low).max(0.0);
        let chosen = |(bounds, sampled): (&Interval, &Interval)| {
            let (bounds, sampled) = (width(bounds), width(sampled));
            if sampled < MISSED_SHARE * bounds { bounds } else { sampled }
        };
        bounds.iter().zip(&sampled).map(chosen).collect()
    }

    /// Whether a value that is not part of another changes after `time` by more than a negligible share of its range.
    pub(crate) fn changes_after(&self, time: f64) -> bool {
        let mut inner = vec![false; self.graph.ops.len()];
        for (k, (_, operands)) in self.graph.ops.iter().enumerate().rev() {
            if inner[k] || self.parts.iter().any(|(part, _)| *part == k) {
                operands.iter().filter(|operand| **operand < k).for_each(|o| inner[*o] = true);
            }
        }
        self.points.iter().any(|point| {
            let mut later = self.parts.iter().zip(self.ranges(point, time));
            later.any(|((part, range), width)| !inner[*part] && width > STEADY_SHARE * range)
        })
    }

    /// The longest step from `time`, at most `length`.
    pub(crate) fn longest_step(&self, time: f64, length: f64) -> f64 {
        let mut values = Vec::new();
        let limit = |length: f64, point: &Vec<f64>| self.limit(point, (time, length), &mut values);
        let longest = self.points.iter().fold(length, limit);
        self.before_turning(time, longest)
    }

    /// The longest step at a point.
    fn limit(&self, point: &[f64], (time, length): (f64, f64), values: &mut Vec<Interval>) -> f64 {
        let mut parts = self.parts.clone();
        let mut evaluate = |step: f64, parts: &mut Vec<(usize, f64)>, finite: bool| {
            let times = Interval { low: time, high: time + step };
            self.graph.evaluate(point, times, values);
            let width = |part: usize| values[part].high - values[part].low;
            if finite {
                parts.retain(|(part, _)| width(*part).is_finite());
            }
            parts.iter().all(|(part, range)| width(*part) <= SHARE * range)
        };
        if evaluate(length, &mut parts, false) {
            return length;
        }
        let shortest = SHORTEST * self.until;
        evaluate(length.min(UNBOUNDED * self.until), &mut parts, true);
        if length <= shortest || evaluate(length, &mut parts, false) {
            return length;
        }
        let mut step = length;
        while step > shortest && !evaluate(step, &mut parts, false) {
            step *= 0.5;
        }
        let mut more = 0.5 * step;
        for _ in 0..REFINEMENTS {
            if step + more < length && evaluate(step + more, &mut parts, false) {
                step += more;
            }
            more *= 0.5;
        }
        step.max(shortest)
    }

    /// A step that ends at the turning point of a value.
    fn before_turning(&self, time: f64, length: f64) -> f64 {
        let Some(point) = self.points.first().filter(|_| !self.slopes.is_empty()) else {
            return length;
        };
        let mut values = Vec::new();
        let mut slope = |which: usize, step: f64| {
            self.graph.evaluate(point, Interval::point(time + step), &mut values);
            values[which].middle()
        };
        let mut longest = length;
        for &which in &self.slopes {
            let (first, last) = (slope(which, 0.0), slope(which, longest));
            if first * last < 0.0 {
                let (mut low, mut high) = (0.0, longest);
                while low < 0.5 * (low + high)
                    && 0.5 * (low + high) < high
                    && high - low > SHORTEST * self.until
                {
                    let middle = 0.5 * (low + high);
                    if slope(which, middle) * first > 0.0 { low = middle } else { high = middle }
                }
                longest = high;
            }
        }
        longest
    }
}
