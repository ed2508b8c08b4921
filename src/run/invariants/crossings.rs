//! A sheet does not pass through itself, neither at the ends of steps nor, under `quasi-static`, on the way.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Invariant, InvariantValue, Step};
use crate::Vec3;
use crate::geometry::Crossings;
use crate::model::State;
use crate::num::real;
use crate::run::Result;
use crate::sheet::Sheet;
use crate::solve::{PathObserver, Workspace};

/// The law.
pub(super) struct NoCrossings(Arc<Mutex<Look>>);

/// What it looks with, and what it has seen on the way.
struct Look {
    sheet: Arc<Sheet>,
    /// With the tree of boxes.
    crossings: Crossings,
    /// Most pairs on the way, and where the first of them is.
    worst: (usize, String),
}

impl Look {
    fn see(&mut self, x: &[Vec3]) {
        let found = self.crossings.find(&self.sheet, x);
        if found.pairs > self.worst.0 {
            self.worst = (found.pairs, found.place(&self.sheet, x));
        }
    }

    /// What there is to say of the way to `state`.
    fn reading(&mut self, state: &State) -> InvariantValue {
        self.see(&state.x);
        let (pairs, place) = std::mem::take(&mut self.worst);
        InvariantValue { row: vec![real(pairs)], value: real(pairs), place, memory: Vec::new() }
    }
}

/// The same, where a step comes by.
struct Watcher(Arc<Mutex<Look>>);

fn on<T>(look: &Mutex<Look>, act: impl FnOnce(&mut Look) -> T) -> T {
    act(&mut look.lock().unwrap_or_else(PoisonError::into_inner))
}

impl PathObserver for Watcher {
    fn begin(&mut self) {
        on(&self.0, |look| look.worst = Default::default());
    }

    fn see(&mut self, x: &[Vec3]) {
        on(&self.0, |look| look.see(x));
    }
}

impl NoCrossings {
    /// For the shapes that `workspace` makes.
    pub(super) fn of(workspace: &mut Workspace) -> Self {
        let sheet = Arc::clone(workspace.model.sheet());
        let crossings = Crossings::new(&sheet);
        let look = Arc::new(Mutex::new(Look { sheet, crossings, worst: Default::default() }));
        workspace.observe_path(Box::new(Watcher(Arc::clone(&look))));
        Self(look)
    }
}

impl Invariant for NoCrossings {
    fn name(&self) -> String {
        "the rule that a sheet does not pass through itself (pairs of triangles that cross)".into()
    }

    fn advice(&self) -> &'static str {
        "list the effect `contact`, end the run before, or change what folds it"
    }

    fn columns(&self) -> Vec<String> {
        vec!["crossings [pairs of triangles]".into()]
    }

    fn begin(&mut self, _: &mut Workspace, state: &State) -> Result<InvariantValue> {
        Ok(on(&self.0, |look| look.reading(state)))
    }

    fn inspect(&mut self, step: &mut Step<'_>, _: &[f64]) -> Result<InvariantValue> {
        Ok(on(&self.0, |look| look.reading(step.after)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_crosses_on_the_way_counts_once() {
        // Two triangles that share an edge, and a third one that they may pass.
        let x = |z: f64| {
            let near = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
            let far = [[0.5, 0.5], [0.5, 0.6], [0.6, 0.5]].map(|[x, y]| Vec3::new(x, y, z));
            let mut all = [near, far].concat();
            all[5].z = 1.0;
            all
        };
        let sheet = Arc::new(Sheet::new(x(0.5), vec![[0, 1, 2], [3, 4, 5]]).unwrap());
        let crossings = Crossings::new(&sheet);
        let look = Arc::new(Mutex::new(Look { sheet, crossings, worst: Default::default() }));
        let (mut watcher, end) = (Watcher(Arc::clone(&look)), x(0.5));
        let state = State { time: 0.0, step: 0, x: end.into(), ..State::default() };
        watcher.see(&x(-0.5));
        let reading = on(&look, |look| look.reading(&state));
        assert!(
            reading.value == 1.0 && !reading.place.is_empty(),
            "{} {}",
            reading.value,
            reading.place
        );
        watcher.see(&x(-0.5));
        watcher.begin();
        assert_eq!(on(&look, |look| look.reading(&state)).value, 0.0);
    }
}
