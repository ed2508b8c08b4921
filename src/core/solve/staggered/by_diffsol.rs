//! A shape under drag moved by TR-BDF2 of diffsol, with steps of its own.

use super::Staggered;
use crate::model::{Part, State, TimeCourse};
use crate::ode::OdeMethod;
use crate::solve::chemistry::ChemistryMethod;
use crate::solve::equilibrium::Relaxation;
use crate::solve::monolithic::Monolithic;
use crate::solve::{Result, Workspace, under_way};

/// Tolerance of the shape within a step, relative to that of the coupling where this is
/// [`USUAL`](super::USUAL): its solution is costly.
const INNER_OF_SHAPE: f64 = 0.1;

impl Staggered {
    pub(super) fn move_by_diffsol(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        next: &mut State,
        course: TimeCourse,
    ) -> Result<Relaxation> {
        let mut moving = state.clone();
        let inner = self.inner_of(INNER_OF_SHAPE, ChemistryMethod::TrBdf2.power());
        let mover = self
            .by_diffsol
            .get_or_insert_with(|| Monolithic::of_part(Part::Shape, OdeMethod::TrBdf2, inner));
        mover.set_course(course);
        let mut done = Relaxation::default();
        while moving.time < next.time {
            let span = (state.time, moving.time, next.time);
            workspace.control.report(|| under_way("moving the shape", span));
            done.add(&mover.step(workspace, &mut moving, next.time)?.relaxation);
        }
        next.x = moving.x;
        Ok(done)
    }
}
