//! Formulas as one graph of operations: nothing is computed twice, and derivatives are part of it.
//!
//! Every operation is found again by what it does (common subexpressions), constants are folded,
//! and `x + 0`, `1 x`, `0 x` and the like never become operations. Derivatives ([`derivative`]
//! (super::derivative)) are nodes of the same graph.

use std::collections::HashMap;

use super::parse::{FormulaError, Function, Kind, Operation, Tree};

/// A node, by its number.
pub(super) type Id = u32;

/// What a node does. Operands come before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    Input(u32),
    Constant(f64),
    Add(Id, Id),
    Subtract(Id, Id),
    Multiply(Id, Id),
    /// The product of the chain rule: 0 where one factor is, even if the other has no value there.
    Chain(Id, Id),
    Divide(Id, Id),
    /// Base to an integer.
    PowerI(Id, i32),
    Power(Id, Id),
    Negative(Id),
    Exp(Id),
    Log(Id),
    Sqrt(Id),
    Tanh(Id),
    Sin(Id),
    Cos(Id),
    Abs(Id),
    Sign(Id),
    Pos(Id),
    Step(Id),
    Logistic(Id),
    Min(Id, Id),
    Max(Id, Id),
}

impl Op {
    /// The operands.
    pub(super) fn operands(self) -> [Option<Id>; 2] {
        use Op::{
            Abs, Add, Chain, Constant, Cos, Divide, Exp, Input, Log, Logistic, Max, Min, Multiply,
            Negative, Pos, Power, PowerI, Sign, Sin, Sqrt, Step, Subtract, Tanh,
        };
        match self {
            Input(_) | Constant(_) => [None, None],
            Add(a, b)
            | Subtract(a, b)
            | Multiply(a, b)
            | Chain(a, b)
            | Divide(a, b)
            | Power(a, b)
            | Min(a, b)
            | Max(a, b) => [Some(a), Some(b)],
            PowerI(a, _)
            | Negative(a)
            | Exp(a)
            | Log(a)
            | Sqrt(a)
            | Tanh(a)
            | Sin(a)
            | Cos(a)
            | Abs(a)
            | Sign(a)
            | Pos(a)
            | Step(a)
            | Logistic(a) => [Some(a), None],
        }
    }

    /// The value for given operands.
    pub(super) fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Op::Input(_) => f64::NAN,
            Op::Constant(c) => c,
            Op::Add(..) => a + b,
            Op::Subtract(..) => a - b,
            Op::Multiply(..) => a * b,
            Op::Chain(..) => {
                if a == 0.0 || b == 0.0 {
                    0.0
                } else {
                    a * b
                }
            }
            Op::Divide(..) => a / b,
            Op::PowerI(_, n) => a.powi(n),
            Op::Power(..) => a.powf(b),
            Op::Negative(_) => -a,
            Op::Exp(_) => a.exp(),
            Op::Log(_) => a.ln(),
            Op::Sqrt(_) => a.sqrt(),
            Op::Tanh(_) => a.tanh(),
            Op::Sin(_) => a.sin(),
            Op::Cos(_) => a.cos(),
            Op::Abs(_) => a.abs(),
            Op::Sign(_) => sign(a),
            // Comparisons, so that NaN stays NaN where a value is asked for.
            Op::Pos(_) => {
                if a < 0.0 {
                    0.0
                } else {
                    a
                }
            }
            Op::Step(_) => {
                if a > 0.0 {
                    1.0
                } else if a <= 0.0 {
                    0.0
                } else {
                    a
                }
            }
            Op::Logistic(_) => logistic(a),
            Op::Min(..) => {
                if b < a {
                    b
                } else {
                    a
                }
            }
            Op::Max(..) => {
                if b > a {
                    b
                } else {
                    a
                }
            }
        }
    }

    /// A key under which the same operation is found again.
    fn key(self) -> (std::mem::Discriminant<Self>, u64, u64) {
        let [a, b] = self.operands().map(|id| id.map_or(u64::MAX, u64::from));
        let kind = std::mem::discriminant(&self);
        match self {
            Op::Input(k) => (kind, u64::from(k), 0),
            Op::Constant(c) => (kind, c.to_bits(), 0),
            Op::PowerI(_, n) => (kind, a, u64::from(n.cast_unsigned())),
            Op::Add(..) | Op::Multiply(..) | Op::Chain(..) => (kind, a.min(b), a.max(b)),
            _ => (kind, a, b),
        }
    }
}

/// -1, 0 or 1.
pub(super) fn sign(a: f64) -> f64 {
    f64::from(a > 0.0) - f64::from(a < 0.0)
}

/// `1/(1 + e^{-a})` without overflow.
pub(super) fn logistic(a: f64) -> f64 {
    let e = (-a.abs()).exp();
    (if a < 0.0 { e } else { 1.0 }) / (1.0 + e)
}

/// Operations that a law may have with all its derivatives for every byte of its text: twice what 500 species
/// need of which each depends on the sum of all, …
const OPERATIONS_PER_BYTE: usize = 128;
/// … at least, as short products of many factors have more, …
const MIN_OPERATIONS: usize = 1 << 16;
/// … and at most: some 300 MB, a hundred times what the largest laws that people write need.
const MAX_OPERATIONS: usize = 1 << 21;

/// A law has more than so many of them.
#[derive(Debug)]
pub(super) struct TooLarge(usize);

impl TooLarge {
    /// The same about the formula `text`, at which it was found.
    pub(super) fn in_formula(self, text: &str) -> FormulaError {
        let message = format!("the law has more than {} operations with its derivatives", self.0);
        let help =
            "every rate is differentiated by every species and signal: fewer species, or a plugin";
        FormulaError::new(0..text.len(), message).help(help)
    }
}

/// The graph.
#[derive(Debug, Default)]
pub(super) struct Graph {
    ops: Vec<Op>,
    known: HashMap<(std::mem::Discriminant<Op>, u64, u64), Id>,
    /// By input: the slopes of all nodes up to the last that was asked for.
    pub(super) slopes: HashMap<u32, Vec<Id>>,
    /// How many these are.
    pub(super) stored: usize,
    /// Most operations, and half the slopes that may be kept.
    most: usize,
}

impl Graph {
    /// That of formulas with so many bytes in all.
    pub(super) fn with_budget(bytes: usize) -> Self {
        let most = bytes.saturating_mul(OPERATIONS_PER_BYTE).clamp(MIN_OPERATIONS, MAX_OPERATIONS);
        Self { most, ..Self::default() }
    }

    /// Forgets what only matters while it grows: that is most of its memory.
    pub(super) fn complete(&mut self) {
        (self.known, self.slopes) = Default::default();
    }

    pub(super) fn ops(&self) -> &[Op] {
        &self.ops
    }

    /// That there is room for more.
    pub(super) fn room(&self) -> Result<(), TooLarge> {
        let large = self.ops.len() > self.most || self.stored > 2 * self.most;
        if large { Err(TooLarge(self.most)) } else { Ok(()) }
    }

    pub(super) fn input(&mut self, number: u32) -> Id {
        self.add(Op::Input(number))
    }

    pub(super) fn constant(&mut self, value: f64) -> Id {
        // One zero only.
        self.add(Op::Constant(value + 0.0))
    }

    pub(super) fn value(&self, id: Id) -> Option<f64> {
        match self.ops[id as usize] {
            Op::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// The node that does `op`, simplified.
    pub(super) fn add(&mut self, op: Op) -> Id {
        if let Some(id) = self.simplified(op) {
            return id;
        }
        let next = rumple_numerics::num::index(self.ops.len());
        let id = *self.known.entry(op.key()).or_insert(next);
        if id == next {
            self.ops.push(op);
        }
        id
    }

    fn simplified(&mut self, op: Op) -> Option<Id> {
        let [a, b] = op.operands();
        let (x, y) = (a.and_then(|a| self.value(a)), b.and_then(|b| self.value(b)));
        let foldable = a.is_some() && x.is_some() && (b.is_none() || y.is_some());
        if foldable {
            let value = op.apply(x?, y.unwrap_or(0.0));
            // What has no value is left for the evaluation to complain about.
            return value.is_finite().then(|| self.constant(value));
        }
        match op {
            Op::Add(a, _) if y == Some(0.0) => Some(a),
            Op::Add(_, b) if x == Some(0.0) => Some(b),
            Op::Subtract(a, _) if y == Some(0.0) => Some(a),
            Op::Subtract(_, b) if x == Some(0.0) => Some(self.add(Op::Negative(b))),
            Op::Subtract(a, b) if a == b => Some(self.constant(0.0)),
            Op::Multiply(a, _) | Op::Chain(a, _) if y == Some(1.0) => Some(a),
            Op::Multiply(_, b) | Op::Chain(_, b) if x == Some(1.0) => Some(b),
            Op::Multiply(a, _) | Op::Chain(a, _) if y == Some(-1.0) => {
                Some(self.add(Op::Negative(a)))
            }
            Op::Multiply(_, b) | Op::Chain(_, b) if x == Some(-1.0) => {
                Some(self.add(Op::Negative(b)))
            }
            Op::Multiply(..) | Op::Chain(..) if x == Some(0.0) || y == Some(0.0) => {
                Some(self.constant(0.0))
            }
            Op::Divide(a, _) if y == Some(1.0) => Some(a),
            Op::Divide(..) if x == Some(0.0) => Some(self.constant(0.0)),
            Op::Divide(a, _)
                if y.is_some_and(|y| y != 0.0 && (1.0 / y).is_finite() && exact(y)) =>
            {
                let by = self.constant(1.0 / y?);
                Some(self.add(Op::Multiply(a, by)))
            }
            Op::PowerI(_, 0) => Some(self.constant(1.0)),
            Op::PowerI(a, 1) => Some(a),
            Op::PowerI(a, 2) => Some(self.add(Op::Multiply(a, a))),
            Op::PowerI(a, -1) => {
                let one = self.constant(1.0);
                Some(self.add(Op::Divide(one, a)))
            }
            Op::Power(a, _) => {
                let whole = y.and_then(whole)?;
                Some(self.add(Op::PowerI(a, whole)))
            }
            Op::Negative(a) => match self.ops[a as usize] {
                Op::Negative(inner) => Some(inner),
                Op::Subtract(p, q) => Some(self.add(Op::Subtract(q, p))),
                _ => None,
            },
            _ => None,
        }
    }

    /// Puts `tree` into the graph; `names` says what a name stands for.
    pub(super) fn insert(
        &mut self,
        tree: &Tree,
        names: &mut impl FnMut(&mut Self, &str) -> Result<Id, String>,
    ) -> Result<Id, FormulaError> {
        match &tree.kind {
            Kind::Number(value) => Ok(self.constant(*value)),
            Kind::Name(name) => names(self, name).map_err(|help| {
                let message = format!("unknown name `{name}`");
                FormulaError::new(tree.span.clone(), message).help(help)
            }),
            Kind::Negative(inner) => {
                let inner = self.insert(inner, names)?;
                Ok(self.add(Op::Negative(inner)))
            }
            Kind::Binary(operation, left, right) => {
                let (a, b) = (self.insert(left, names)?, self.insert(right, names)?);
                if *operation == Operation::Divide && self.value(b) == Some(0.0) {
                    return Err(FormulaError::new(right.span.clone(), "division by zero"));
                }
                Ok(self.add(match operation {
                    Operation::Add => Op::Add(a, b),
                    Operation::Subtract => Op::Subtract(a, b),
                    Operation::Multiply => Op::Multiply(a, b),
                    Operation::Divide => Op::Divide(a, b),
                    Operation::Power => Op::Power(a, b),
                }))
            }
            Kind::Call(function, arguments) => {
                let mut all = Vec::new();
                for argument in arguments {
                    all.push(self.insert(argument, names)?);
                }
                Ok(self.call(*function, &all))
            }
        }
    }

    fn call(&mut self, function: Function, all: &[Id]) -> Id {
        let a = all[0];
        let op = match function {
            Function::Pos => Op::Pos(a),
            Function::Step => Op::Step(a),
            Function::Exp => Op::Exp(a),
            Function::Log => Op::Log(a),
            Function::Sqrt => Op::Sqrt(a),
            Function::Tanh => Op::Tanh(a),
            Function::Sin => Op::Sin(a),
            Function::Cos => Op::Cos(a),
            Function::Abs => Op::Abs(a),
            Function::Logistic => Op::Logistic(a),
            Function::Min => Op::Min(a, all[1]),
            Function::Max => Op::Max(a, all[1]),
            Function::Hill => {
                // r = (x/k)^n, r/(1 + r): a fraction of large numbers is never formed.
                let x = self.add(Op::Pos(a));
                let ratio = self.add(Op::Divide(x, all[1]));
                let power = self.add(Op::Power(ratio, all[2]));
                let one = self.constant(1.0);
                let below = self.add(Op::Add(one, power));
                Op::Divide(power, below)
            }
        };
        self.add(op)
    }
}

/// A power of two: its reciprocal is exact.
fn exact(value: f64) -> bool {
    value.abs().log2().fract() == 0.0
}

/// A whole number that is an exponent.
fn whole(value: f64) -> Option<i32> {
    (-16..=16).find(|n| f64::from(*n) == value)
}
