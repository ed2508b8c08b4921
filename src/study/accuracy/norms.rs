//! What differences of states are relative to.

use super::Quantity;
use super::errors::{Distance, Errors, Kept};
use crate::model::State;
use crate::run::Simulation;
use crate::study::differences::Norm;
use crate::study::measures::Measures;
use crate::study::sweep::Plan;

/// Changes below this, relative to what changes, are none.
const STILL: f64 = 1e-6;

/// What differences of states are relative to.
pub(super) struct Yardstick {
    norm: Norm,
    moves: bool,
}

impl Yardstick {
    /// That of a member; none if its scene can no longer be set up.
    pub(super) fn of(plan: &Plan, number: usize) -> Option<Self> {
        let scene = plan.scene(number).ok()?;
        let simulation = Simulation::new(&scene, &plan.search()).ok()?;
        let model = simulation.model();
        Some(Self { norm: Norm::of(model), moves: model.moves() })
    }

    /// The two references that are the least apart, two of different methods if there are any, the one that is
    /// preferred first; or the only one.
    pub(super) fn closest(
        &self,
        references: &[(String, String, Kept)],
    ) -> Option<(usize, Option<usize>)> {
        let mut best: Option<((bool, f64), usize, usize)> = None;
        for (a, (_, method, first)) in references.iter().enumerate() {
            for (b, (_, other, second)) in references.iter().enumerate().skip(a + 1) {
                let course = self.course(&second.states, &first.states);
                let apart = course.iter().map(Distance::largest).fold(0.0, f64::max);
                if course.is_empty() {
                    continue;
                }
                let rank = (method == other, apart);
                if best.is_none_or(|(least, ..)| rank < least) {
                    best = Some((rank, a, b));
                }
            }
        }
        match best {
            Some((_, a, b)) => Some((a, Some(b))),
            None => (!references.is_empty()).then_some((0, None)),
        }
    }

    /// Distances of states from those at the same time.
    pub(super) fn course(&self, states: &[State], truth: &[State]) -> Vec<Distance> {
        let mut course = Vec::new();
        for state in states {
            let near = |s: &&State| (s.time - state.time).abs() <= 1e-9 * state.time.abs();
            let Some(same) = truth.iter().find(near) else { continue };
            let found = self.norm.differences(state, same);
            let species = found.worst_species().map_or(0.0, |(_, by)| by.relative());
            course.push(Distance { time: state.time, species, shape: found.shape.relative() });
        }
        course
    }

    /// Whether neither species nor shape change along a run.
    pub(super) fn is_still(&self, states: &[State], measures: &[Measures]) -> bool {
        let Some(first) = states.first() else { return false };
        let species = |state: &State| {
            let found = self.norm.differences(state, first);
            found.worst_species().map_or(0.0, |(_, by)| by.relative())
        };
        let heights = || measures.iter().map(|m| m.amplitude);
        let (least, most) =
            heights().fold((f64::INFINITY, 0.0f64), |(l, m), x| (l.min(x), m.max(x)));
        states.iter().all(|state| species(state) <= STILL) && !(most - least > STILL * most)
    }

    pub(super) fn errors(&self, run: &Kept, truth: &Kept, parted: Option<f64>) -> Errors {
        let course = self.course(&run.states, &truth.states);
        let before = |d: &&Distance| parted.is_none_or(|parted| d.time < parted);
        let largest = |of: fn(&Distance) -> f64| {
            let later = course.iter().filter(|d| d.time > 0.0).filter(before);
            later
                .map(of)
                .fold(None, |largest: Option<f64>, e| Some(largest.map_or(e, |l| l.max(e))))
        };
        let of = Quantity::ALL.map(|quantity| match quantity {
            Quantity::Species if self.norm.species() > 0 => largest(|d| d.species),
            Quantity::Shape if self.moves => largest(|d| d.shape),
            Quantity::Species | Quantity::Shape => None,
            measure => measure.error(&run.found.measures, &truth.found.measures),
        });
        Errors { of, course }
    }
}
