//! Kinks and jumps of formulas in time, found with certainty.
//!
//! `step(g)`, `pos(g)`, `abs(g)` switch where g = 0, and `min(a, b)`, `max(a, b)` where a - b = 0. Where g depends
//! on the time t alone, or on what does not change at a point, its roots are isolated by bisection of the interval
//! I of times, with the tests
//!
//! ```text
//! 0 ∉ G(I)                            no root in I
//! 0 ∉ G(m) + G'(I) (I - m)            no root in I          m the middle of I
//! 0 ∉ G'(I)                           at most one root in I: a change of sign shows it
//! ```
//!
//! G and G' are the interval extensions of g and dg/dt, so that no pulse is too short to be found. A g that
//! jumps itself has the first test alone.

use super::course::FormulaCourse;
use super::graph::{Graph, Id, Op};
use super::interval::Interval;
use super::time_graph::{Reads, TimeGraph, dependencies, needed};
use crate::Signal;
use crate::breakpoints::{Course, TimeDependence};

/// Evaluations for the roots at all points: a tenth of a second.
const EVALUATION_BUDGET: usize = 200_000;
/// A root is known to this share of its time, or of the interval.
const RESOLUTION: f64 = 4.0 * f64::EPSILON;

/// The functions of time at whose roots a formula switches, and all its parts that depend on the time alone.
#[derive(Debug, Clone, Default)]
pub(super) struct Kinks {
    graph: TimeGraph,
    switches: Vec<Switch>,
    /// Parts that depend on the time alone.
    parts: Vec<usize>,
    /// Derivatives of the outputs by the time, where their turning points end steps.
    slopes: Vec<usize>,
}

/// One of them, by the numbers of its value and its derivative by the time among the operations.
#[derive(Debug, Clone, Copy)]
struct Switch {
    value: usize,
    slope: Option<usize>,
}

impl Kinks {
    /// Numbers, as [`Names`](super::names::Names) gives them, of the time and of the first parameter that varies.
    pub(super) fn numbers(species: usize) -> [usize; 2] {
        let columns =
            |signals: &[Signal]| -> usize { signals.iter().map(|s| s.columns().len()).sum() };
        let time = Signal::ALL.iter().position(|signal| *signal == Signal::Time).unwrap_or(0);
        [species + columns(&Signal::ALL[..time]), species + columns(&Signal::ALL)]
    }

    /// Those of the rates of a law of so many species.
    pub(super) fn of_rates(graph: &mut Graph, rates: &[Id], species: usize) -> Self {
        let [time, varying] = Self::numbers(species).map(rumple_numerics::num::index);
        Self::find(graph, rates, (time, false), |input| input >= varying)
    }

    /// Those of `outputs`, of which the input `time` is the time and which end steps where they are `turning`; `fixed`
    /// says of other inputs whether they stay as they are at every point.
    pub(super) fn find(
        graph: &mut Graph,
        outputs: &[Id],
        (time, turning): (u32, bool),
        fixed: impl Fn(u32) -> bool,
    ) -> Self {
        let reads = dependencies(graph, time, fixed);
        let needed = needed(graph.ops(), outputs);
        let alone = |id: Id| reads[id as usize].time && !reads[id as usize].unknown;
        let all = 0..rumple_numerics::num::index(needed.len());
        let parts: Vec<Id> = all.filter(|id| needed[*id as usize] && alone(*id)).collect();
        let switches = Self::switches(graph, (&needed, &reads), time);
        let turning = outputs.iter().filter(|id| turning && alone(**id));
        let slopes: Vec<Id> = turning.filter_map(|id| graph.slope(*id, time).ok()).collect();
        let (values, changes): (Vec<Id>, Vec<Option<Id>>) = switches.into_iter().unzip();
        let known: Vec<Id> = changes.iter().copied().flatten().collect();
        let wanted: Vec<Id> = [&parts[..], &slopes, &values, &known].concat();
        let (graph, mut places) = TimeGraph::gather(graph, &wanted, time);
        let mut known = places.split_off(parts.len() + slopes.len() + values.len()).into_iter();
        let values = places.split_off(parts.len() + slopes.len());
        let slopes = places.split_off(parts.len());
        let switches = values
            .into_iter()
            .zip(changes)
            .map(|(value, change)| Switch { value, slope: change.and_then(|_| known.next()) });
        Self { switches: switches.collect(), graph, parts: places, slopes }
    }

    /// The values at whose roots something switches, and their derivatives by the time.
    fn switches(
        graph: &mut Graph,
        (needed, reads): (&[bool], &[Reads]),
        time: u32,
    ) -> Vec<(Id, Option<Id>)> {
        let mut wanted = Vec::new();
        for k in 0..needed.len() {
            let (a, b) = match graph.ops()[k] {
                Op::Step(a) | Op::Sign(a) | Op::Pos(a) | Op::Abs(a) => (a, None),
                Op::Min(a, b) | Op::Max(a, b) => (a, Some(b)),
                _ => continue,
            };
            let parts =
                [Some(a), b].map(|id| id.map_or_else(Reads::default, |id| reads[id as usize]));
            if !needed[k] || parts.iter().any(|p| p.unknown) || !parts.iter().any(|p| p.time) {
                continue;
            }
            let jumps = parts.iter().any(|part| part.jumps);
            let value = b.map_or(a, |b| graph.add(Op::Subtract(a, b)));
            // A law too large for more derivatives does without.
            let slope = if jumps { None } else { graph.slope(value, time).ok() };
            wanted.push((value, slope));
        }
        wanted.sort_unstable();
        wanted.dedup();
        wanted
    }

    /// Adds the times from 0 to `until` at which something switches at one of `count` points, where `input` gives the
    /// values of the other inputs by their numbers and that of the point, and the course between them; whether the
    /// times are all.
    pub(super) fn at_points(
        &self,
        until: f64,
        count: usize,
        input: impl Fn(usize, usize) -> f64,
        found: &mut TimeDependence,
    ) -> bool {
        if !self.parts.is_empty() && count > 0 {
            let of = (&self.graph, &self.parts[..], &self.slopes[..]);
            found.courses.push(Course::formula(FormulaCourse::new(of, until, count, &input)));
        }
        let points = if self.graph.others.is_empty() { count.min(1) } else { count };
        let mut budget = EVALUATION_BUDGET;
        let mut known: Option<Vec<f64>> = None;
        (0..points).all(|point| {
            let inputs = self.graph.inputs(point, &input);
            // Neighbours often have the same ones.
            if known.as_ref() == Some(&inputs) {
                return true;
            }
            let values = Vec::with_capacity(self.graph.ops.len());
            let mut search = RootSearch {
                graph: &self.graph,
                until,
                inputs: &inputs,
                values,
                budget: &mut budget,
            };
            let times = &mut found.breakpoints;
            let all = self.switches.iter().all(|switch| search.roots(*switch, times));
            known = Some(inputs);
            all
        })
    }
}

/// A search for roots at one point.
struct RootSearch<'a> {
    graph: &'a TimeGraph,
    until: f64,
    /// Values of the inputs but the time.
    inputs: &'a [f64],
    values: Vec<Interval>,
    /// Evaluations that are left.
    budget: &'a mut usize,
}

impl RootSearch<'_> {
    /// Bounds of all operations at these times.
    fn evaluate(&mut self, times: Interval) {
        *self.budget = self.budget.saturating_sub(1);
        self.graph.evaluate(self.inputs, times, &mut self.values);
    }

    fn value(&mut self, which: usize, time: f64) -> f64 {
        self.evaluate(Interval::point(time));
        self.values[which].middle()
    }

    /// Adds the roots of one function; whether they are all.
    fn roots(&mut self, switch: Switch, found: &mut Vec<f64>) -> bool {
        let mut open = vec![Interval { low: 0.0, high: self.until }];
        while let Some(times) = open.pop() {
            if *self.budget == 0 {
                return false;
            }
            self.evaluate(times);
            let value = self.values[switch.value];
            let nothing = value.low == 0.0 && value.high == 0.0;
            if nothing || !value.may_be_zero() {
                continue;
            }
            let (Interval { low, high }, middle) = (times, times.middle());
            if high - low <= RESOLUTION * high || !(low < middle && middle < high) {
                found.push(middle);
                continue;
            }
            if let Some(slope) = switch.slope {
                let slope = self.values[slope];
                if slope.low > 0.0 || slope.high < 0.0 {
                    found.extend(self.bisect(switch.value, times));
                    continue;
                }
                let change = slope.multiply(Interval::new(low - middle, high - middle));
                let around = Interval::point(self.value(switch.value, middle)).add(change);
                if !around.may_be_zero() {
                    continue;
                }
            }
            open.extend([Interval { low: middle, high }, Interval { low, high: middle }]);
        }
        true
    }

    /// The root of a monotone function, if its sign changes.
    fn bisect(&mut self, which: usize, Interval { mut low, mut high }: Interval) -> Option<f64> {
        let (at_low, at_high) = (self.value(which, low), self.value(which, high));
        if at_low == 0.0 || at_high == 0.0 {
            return Some(if at_low == 0.0 { low } else { high });
        }
        if at_low.signum() == at_high.signum() || at_low.is_nan() || at_high.is_nan() {
            return None;
        }
        loop {
            let middle = Interval { low, high }.middle();
            if !(low < middle && middle < high) {
                return Some(high);
            }
            match self.value(which, middle) {
                0.0 => return Some(middle),
                value if value.signum() == at_low.signum() => low = middle,
                _ => high = middle,
            }
        }
    }
}
