//! The parts of a graph that depend on the time alone, or on the time and on what does not change at a point.

use super::graph::{Graph, Id, Op};
use super::interval::Interval;

/// Operations that depend on the time, with all that they are made of.
#[derive(Debug, Clone, Default)]
pub(super) struct TimeGraph {
    /// Operations with the numbers of their operands, which come first; of an input but the time, its number among `others`.
    pub(super) ops: Vec<(Op, [usize; 2])>,
    /// The input that is the time.
    time: u32,
    /// The other inputs that they read.
    pub(super) others: Vec<usize>,
}

impl TimeGraph {
    /// What `wanted` is made of, and the numbers of these among its operations.
    pub(super) fn gather(graph: &Graph, wanted: &[Id], time: u32) -> (Self, Vec<usize>) {
        let needed = needed(graph.ops(), wanted);
        let (mut ops, mut others) = (Vec::new(), Vec::new());
        let mut place = vec![0; needed.len()];
        for (k, op) in graph.ops().iter().enumerate().filter(|(k, _)| needed[*k]) {
            let mut operands = op.operands().map(|id| id.map_or(0, |id| place[id as usize]));
            if let Op::Input(number) = op
                && *number != time
            {
                operands[0] = others.len();
                others.push(*number as usize);
            }
            place[k] = ops.len();
            ops.push((*op, operands));
        }
        let places = wanted.iter().map(|id| place[*id as usize]).collect();
        (Self { ops, time, others }, places)
    }

    /// Bounds of all operations at these times, for such values of the other inputs.
    pub(super) fn evaluate(&self, inputs: &[f64], times: Interval, values: &mut Vec<Interval>) {
        values.clear();
        for (op, operands) in &self.ops {
            let [a, b] =
                operands.map(|operand| values.get(operand).copied().unwrap_or(Interval::WHOLE));
            values.push(match op {
                Op::Input(number) if *number == self.time => times,
                Op::Input(_) => Interval::point(inputs[operands[0]]),
                _ => op.bounds(a, b),
            });
        }
    }

    /// The values of the other inputs at a point, where `input` gives them by their numbers and that of the point.
    pub(super) fn inputs(&self, point: usize, input: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        self.others.iter().map(|&other| input(other, point)).collect()
    }
}

/// What a node depends on.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reads {
    pub(super) time: bool,
    /// Something that changes in time and is not known beforehand.
    pub(super) unknown: bool,
    pub(super) jumps: bool,
}

/// What every node depends on.
pub(super) fn dependencies(graph: &Graph, time: u32, fixed: impl Fn(u32) -> bool) -> Vec<Reads> {
    let mut reads: Vec<Reads> = Vec::with_capacity(graph.ops().len());
    for op in graph.ops() {
        let mut all = Reads::default();
        for part in op.operands().into_iter().flatten().map(|id| reads[id as usize]) {
            all.time |= part.time;
            all.unknown |= part.unknown;
            all.jumps |= part.jumps;
        }
        match op {
            Op::Input(number) if *number == time => all.time = true,
            Op::Input(number) => all.unknown = !fixed(*number),
            Op::Step(_) | Op::Sign(_) => all.jumps = all.time,
            _ => {}
        }
        reads.push(all);
    }
    reads
}

/// Which nodes `outputs` are made of.
pub(super) fn needed(ops: &[Op], outputs: &[Id]) -> Vec<bool> {
    let mut needed = vec![false; ops.len()];
    outputs.iter().for_each(|id| needed[*id as usize] = true);
    for k in (0..ops.len()).rev() {
        if needed[k] {
            ops[k].operands().into_iter().flatten().for_each(|id| needed[id as usize] = true);
        }
    }
    needed
}
