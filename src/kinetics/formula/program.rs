//! A graph as a straight program over blocks of points.
//!
//! One operation at a time runs over 256 points, so that looking up what to do costs nothing and the
//! loops vectorise. Rows are used again as soon as their values are no longer needed, which keeps
//! them in the cache.

use super::graph::{Graph, Id, Op};
use crate::Column;

/// Points in a block.
const BLOCK_POINTS: usize = 256;

/// Operations in order, with rows in place of nodes.
#[derive(Debug, Clone)]
pub(super) struct Program {
    steps: Vec<Step>,
    /// Rows that hold a constant throughout.
    constants: Vec<(usize, f64)>,
    /// Row of each input that is read.
    inputs: Vec<(usize, usize)>,
    /// Row of each output.
    outputs: Vec<usize>,
    rows: usize,
}

#[derive(Debug, Clone, Copy)]
struct Step {
    op: Op,
    to: usize,
    a: usize,
    b: usize,
}

impl Program {
    /// What computes `outputs`, and nothing else.
    pub(super) fn new(graph: &Graph, outputs: &[Id]) -> Self {
        let ops = graph.ops();
        let mut last_use = vec![None; ops.len()];
        for &output in outputs {
            last_use[output as usize] = Some(usize::MAX);
        }
        for k in (0..ops.len()).rev() {
            if last_use[k].is_some() {
                for operand in ops[k].operands().into_iter().flatten() {
                    let known = last_use[operand as usize];
                    last_use[operand as usize] = known.max(Some(k));
                }
            }
        }
        let steps = last_use.iter().filter(|last| last.is_some()).count();
        let mut program = Self {
            steps: Vec::with_capacity(steps),
            constants: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            rows: 0,
        };
        let mut row_of = vec![usize::MAX; ops.len()];
        let mut free: Vec<usize> = Vec::new();
        for (k, &op) in ops.iter().enumerate() {
            if last_use[k].is_none() {
                continue;
            }
            // Brought before the first step: no row that an earlier step writes to.
            let pinned = matches!(op, Op::Constant(_) | Op::Input(_));
            let row = if pinned { None } else { free.pop() }.unwrap_or_else(|| {
                program.rows += 1;
                program.rows - 1
            });
            row_of[k] = row;
            match op {
                Op::Constant(value) => program.constants.push((row, value)),
                Op::Input(number) => program.inputs.push((number as usize, row)),
                _ => {
                    let [a, b] = op.operands().map(|id| id.map(|id| row_of[id as usize]));
                    // An operation of one takes it twice: no row that it might write to.
                    let (a, b) = (a.unwrap_or(row), b.or(a).unwrap_or(row));
                    program.steps.push(Step { op, to: row, a, b });
                }
            }
            let [a, b] = op.operands();
            // An operand that is used twice is freed once.
            for operand in [a, b.filter(|b| Some(*b) != a)].into_iter().flatten() {
                let o = operand as usize;
                let constant = matches!(ops[o], Op::Constant(_));
                if last_use[o] == Some(k) && !constant {
                    free.push(row_of[o]);
                }
            }
        }
        program.outputs = outputs.iter().map(|o| row_of[*o as usize]).collect();
        program
    }

    /// Gives the inputs their numbers among those that a batch has; all that are read have one.
    pub(super) fn renumber(&mut self, number_of: &[Option<usize>]) {
        for (number, _) in &mut self.inputs {
            *number = number_of.get(*number).copied().flatten().unwrap_or(*number);
        }
    }

    /// How many operations a point costs.
    pub(super) fn operation_count(&self) -> usize {
        self.steps.len()
    }

    /// Writes every output at `count` points.
    pub(super) fn run(&self, inputs: &[Column<'_>], count: usize, outputs: &mut [&mut [f64]]) {
        let mut rows = vec![vec![0.0; BLOCK_POINTS]; self.rows];
        for &(row, value) in &self.constants {
            rows[row].fill(value);
        }
        // Rows of inputs are used again for others: every block brings them again.
        for start in (0..count).step_by(BLOCK_POINTS) {
            let lanes = BLOCK_POINTS.min(count - start);
            for &(number, row) in &self.inputs {
                inputs[number].copy_to(start, &mut rows[row][..lanes]);
            }
            for step in &self.steps {
                let mut to = std::mem::take(&mut rows[step.to]);
                step.run(&rows[step.a], &rows[step.b], &mut to);
                rows[step.to] = to;
            }
            for (output, &row) in outputs.iter_mut().zip(&self.outputs) {
                output[start..start + lanes].copy_from_slice(&rows[row][..lanes]);
            }
        }
    }
}

impl Step {
    fn run(&self, a: &[f64], b: &[f64], to: &mut [f64]) {
        macro_rules! each {
            ($op:expr) => {
                for (to, (a, b)) in to.iter_mut().zip(a.iter().zip(b)) {
                    *to = $op.apply(*a, *b);
                }
            };
        }
        // One arm an operation: within it the compiler knows which, and the loop is plain.
        match self.op {
            Op::Add(..) => each!(Op::Add(0, 0)),
            Op::Subtract(..) => each!(Op::Subtract(0, 0)),
            Op::Multiply(..) => each!(Op::Multiply(0, 0)),
            Op::Chain(..) => each!(Op::Chain(0, 0)),
            Op::Divide(..) => each!(Op::Divide(0, 0)),
            Op::Negative(_) => each!(Op::Negative(0)),
            Op::Abs(_) => each!(Op::Abs(0)),
            Op::Sign(_) => each!(Op::Sign(0)),
            Op::Pos(_) => each!(Op::Pos(0)),
            Op::Step(_) => each!(Op::Step(0)),
            Op::Sqrt(_) => each!(Op::Sqrt(0)),
            Op::Min(..) => each!(Op::Min(0, 0)),
            Op::Max(..) => each!(Op::Max(0, 0)),
            Op::Exp(_) => each!(Op::Exp(0)),
            Op::Logistic(_) => each!(Op::Logistic(0)),
            op => each!(op),
        }
    }
}
