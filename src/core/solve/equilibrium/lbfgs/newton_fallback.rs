//! Fallback from L-BFGS to Newton's method and back, until one of them converges.
//!
//! What makes one of them stall need not hinder the other: L-BFGS has no curvature where the energy is not convex,
//! and each step of Newton's method costs a factorisation. They alternate, each time with twice the iterations of the
//! last time, so the cost is bounded by a multiple of what the better of them needs alone.

use super::super::newton::{Newton, NewtonSpec};
use super::super::stop::{after, stalled};
use super::super::{Equilibrium, Goal, Relaxation};
use super::Lbfgs;
use super::progress::{Outcome, newton_iterations, patience};
use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::record::{Malformed, Record};
use crate::solve::SolveError;

impl Equilibrium for Lbfgs {
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let mut done = Relaxation::default();
        for round in 0.. {
            let max_iterations = goal.max_iterations.saturating_sub(done.iterations);
            let left = Goal { max_iterations, ..*goal };
            let (more, outcome) = self
                .iterate(potential, x, &left, patience(round))
                .map_err(|error| after(done.iterations, error))?;
            done.add(&more);
            if outcome == Outcome::AtRest {
                return Ok(done);
            }
            if !self.may_hand_over() {
                return Err(stalled(&done, goal));
            }
            // The factor belongs to a shape that is left behind.
            self.factor.ready = false;
            let left = goal.max_iterations.saturating_sub(done.iterations);
            let left = Goal { max_iterations: left.min(newton_iterations(round)), ..*goal };
            let area_share = self.options.area_share;
            let mut newton =
                Newton::new(potential.mechanics(), NewtonSpec::for_fallback(area_share))?;
            let later = newton.relax(potential, x, &left);
            newton.free();
            match later {
                Ok(later) => {
                    done.add(&later);
                    return Ok(done);
                }
                // Its turn is over.
                Err(SolveError::NotConverged { iterations, .. }) => done.iterations += iterations,
                Err(SolveError::Stalled { .. }) if outcome == Outcome::Poor => {}
                Err(error) => return Err(after(done.iterations, error)),
            }
        }
        Err(stalled(&done, goal))
    }

    fn is_minimum(&mut self, potential: &mut Potential, x: &[Vec3]) -> Option<bool> {
        self.factorise_whole(potential, x)
    }

    fn begin_step(&mut self) {
        self.take_snapshot();
    }

    fn roll_back(&mut self, mechanics: &Mechanics) {
        self.restore_snapshot(mechanics);
    }

    fn memory(&self) -> Record {
        self.written()
    }

    fn restore(&mut self, memory: &Record, mechanics: &Mechanics) -> Result<(), Malformed> {
        self.take_over(memory.read()?, mechanics)
    }
}
