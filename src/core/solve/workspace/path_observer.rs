//! Intermediate shapes of a step, between two accepted states.

use super::super::{Result, SolveError};
use super::Workspace;
use crate::Vec3;
use crate::sheet::is_turned;

/// Observes the intermediate shapes of a step.
pub trait PathObserver: Send {
    /// A step attempt begins.
    fn begin(&mut self);

    /// The path passes the shape `x`.
    fn see(&mut self, x: &[Vec3]);
}

impl Workspace {
    /// From now on `observer` sees the intermediate shapes of a step, where a policy has some.
    pub fn observe_path(&mut self, observer: Box<dyn PathObserver>) {
        self.path_observer = Some(observer);
    }

    /// A step attempt begins.
    pub(in crate::solve) fn begin_path(&mut self) {
        if let Some(observer) = &mut self.path_observer {
            observer.begin();
        }
    }

    /// The path passes `to` after `from`, along a branch of equilibria or by a jump.
    ///
    /// # Errors
    /// [`SolveError::InsideOut`] if it is turned over, unless moving pins lead it there.
    pub(in crate::solve) fn pass(&mut self, from: &[Vec3], to: &[Vec3], jumps: bool) -> Result<()> {
        if let Some(observer) = &mut self.path_observer {
            observer.see(to);
        }
        let prescribed = !jumps && self.model.mechanics().has_prescribed();
        match !prescribed && is_turned(self.model.sheet(), from, to) {
            true => Err(SolveError::InsideOut),
            false => Ok(()),
        }
    }
}
