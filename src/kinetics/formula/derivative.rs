//! Derivatives of nodes by inputs, by the chain rule, as nodes of the same graph.
//!
//! A function of an argument that does not change has the slope 0, even at the edge of its domain, where it has no
//! derivative: so `sqrt(pos(u))` for u < 0. Factors of the chain rule that are 0 make products 0 ([`Op::Chain`]).

use super::graph::{Graph, Id, Op, TooLarge};

impl Graph {
    /// ∂node/∂input. At the kinks of `pos`, `abs`, `min` and `max` one of the two slopes is taken; the
    /// jump of `step` has none.
    ///
    /// # Errors
    /// [`TooLarge`] where the graph would become that.
    pub(super) fn slope(&mut self, id: Id, input: u32) -> Result<Id, TooLarge> {
        // Operands come first, so all slopes up to `id` can be made in order, without recursion.
        let mut slopes = self.slopes.remove(&input).unwrap_or_default();
        for k in rumple_numerics::num::index(slopes.len())..=id {
            let slope = self.slope_of(self.ops()[k as usize], k, input, &slopes);
            slopes.push(slope);
            self.stored += 1;
            self.room()?;
        }
        let slope = slopes[id as usize];
        self.slopes.insert(input, slopes);
        Ok(slope)
    }

    /// The slope of one node from those of its operands.
    fn slope_of(&mut self, op: Op, id: Id, input: u32, slopes: &[Id]) -> Id {
        let [a, b] = op.operands();
        let zero = self.constant(0.0);
        let of = |k: Option<Id>| k.map_or(zero, |k| slopes[k as usize]);
        let (da, db) = (of(a), of(b));
        if a.is_some() && da == zero && db == zero {
            return zero;
        }
        if let Some(factor) = self.slope_factor(op, id) {
            return self.add(Op::Chain(factor, da));
        }
        match op {
            Op::Input(k) => self.constant(if k == input { 1.0 } else { 0.0 }),
            Op::Constant(_) | Op::Step(_) | Op::Sign(_) => zero,
            Op::Add(..) => self.add(Op::Add(da, db)),
            Op::Subtract(..) => self.add(Op::Subtract(da, db)),
            Op::Multiply(a, b) | Op::Chain(a, b) => {
                let (p, q) = (self.add(Op::Chain(da, b)), self.add(Op::Chain(a, db)));
                self.add(Op::Add(p, q))
            }
            Op::Divide(_, b) => {
                // (da - (a/b) db)/b
                let q = self.add(Op::Chain(id, db));
                let top = self.add(Op::Subtract(da, q));
                self.add(Op::Divide(top, b))
            }
            Op::Power(a, b) => {
                // b a^{b-1} da + a^b ln(a) db; the second only where the exponent moves.
                let one = self.constant(1.0);
                let less = self.add(Op::Subtract(b, one));
                let power = self.add(Op::Power(a, less));
                let factor = self.add(Op::Multiply(b, power));
                let first = self.add(Op::Chain(factor, da));
                if db == zero {
                    return first;
                }
                let log = self.add(Op::Log(a));
                let factor = self.add(Op::Chain(id, log));
                let second = self.add(Op::Chain(factor, db));
                self.add(Op::Add(first, second))
            }
            Op::Negative(_) => self.add(Op::Negative(da)),
            Op::Log(a) => self.add(Op::Divide(da, a)),
            Op::Min(a, b) => self.chosen(b, a, (da, db)),
            Op::Max(a, b) => self.chosen(a, b, (da, db)),
            Op::PowerI(..)
            | Op::Exp(_)
            | Op::Sqrt(_)
            | Op::Tanh(_)
            | Op::Sin(_)
            | Op::Cos(_)
            | Op::Abs(_)
            | Op::Pos(_)
            | Op::Logistic(_) => zero,
        }
    }

    /// The derivative of a function of one argument by it, of the node `id`; none for other operations.
    fn slope_factor(&mut self, op: Op, id: Id) -> Option<Id> {
        Some(match op {
            Op::PowerI(a, n) => {
                let power = self.add(Op::PowerI(a, n - 1));
                let n = self.constant(f64::from(n));
                self.add(Op::Multiply(n, power))
            }
            Op::Exp(_) => id,
            Op::Sqrt(_) => {
                let half = self.constant(0.5);
                self.add(Op::Divide(half, id))
            }
            Op::Tanh(_) => {
                let one = self.constant(1.0);
                let square = self.add(Op::Multiply(id, id));
                self.add(Op::Subtract(one, square))
            }
            Op::Sin(a) => self.add(Op::Cos(a)),
            Op::Cos(a) => {
                let sine = self.add(Op::Sin(a));
                self.add(Op::Negative(sine))
            }
            Op::Abs(a) => self.add(Op::Sign(a)),
            Op::Pos(a) => self.add(Op::Step(a)),
            Op::Logistic(_) => {
                let one = self.constant(1.0);
                let rest = self.add(Op::Subtract(one, id));
                self.add(Op::Multiply(id, rest))
            }
            _ => return None,
        })
    }

    /// `db` where the `p > q` fails to hold against it, else `da`: slopes of min and max.
    fn chosen(&mut self, p: Id, q: Id, (da, db): (Id, Id)) -> Id {
        // step(p - q) da + (1 - step(p - q)) db, where the other of the two may have no value
        let apart = self.add(Op::Subtract(p, q));
        let first = self.add(Op::Step(apart));
        let one = self.constant(1.0);
        let second = self.add(Op::Subtract(one, first));
        let (a, b) = (self.add(Op::Chain(first, da)), self.add(Op::Chain(second, db)));
        self.add(Op::Add(a, b))
    }
}
