//! Whether a sheet passes through itself: pairs of triangles that cross, counted at every frame and at the end of
//! a run. There is no contact of a sheet with itself, so that such shapes are no results.

use super::observe::{Observer, StepInfo};
use super::{Result, Simulation};
use crate::Vec3;
use crate::geometry::{Crossings, Found};
use crate::model::Evaluation;
use crate::num::Short;
use crate::sheet::Sheet;

/// What helps, in words.
const ADVICE: &str = "there is no contact of a sheet with itself, and results from here on are not those \
    of one; `invariants.crossings = 0` ends a run there";

/// Counts pairs of triangles that cross at output times and at the end of a run.
#[derive(Debug, Default)]
pub(super) struct SelfIntersection {
    /// Of the last shape that was looked at.
    pairs: Option<usize>,
    /// What is to be said of it, once in a run.
    news: Option<String>,
    told: bool,
}

impl SelfIntersection {
    /// Pairs of the last shape that was looked at; none where no shape moves.
    pub(super) fn pairs(&self) -> Option<usize> {
        self.pairs
    }

    /// A message when a shape passes through itself for the first time.
    pub(super) fn news(&mut self) -> Option<String> {
        self.news.take()
    }
}

impl Observer for SelfIntersection {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if !info.frame || !at.model().moves() {
            return Ok(());
        }
        let _scope = at.model().tally().meter("output", "self-intersection", &["shapes"]).scope(0);
        let (sheet, state) = (at.model().sheet(), at.state());
        // Its boxes are not kept: frames are seldom, and memory is not.
        let found = Crossings::new(sheet).find(sheet, &state.x);
        self.pairs = Some(found.pairs);
        if found.pairs > 0 && !std::mem::replace(&mut self.told, true) {
            self.news = Some(format!(
                "warning: time {}: {}, {}; {ADVICE}",
                Short(state.time),
                words(found.pairs),
                place(sheet, &state.x, &found)
            ));
        }
        Ok(())
    }
}

/// The pairs of the last good state of a simulation with their place, in words; none where the sheet does not pass
/// through itself.
pub(super) fn of(simulation: &Simulation) -> Option<String> {
    if !simulation.model().moves() {
        return None;
    }
    let (sheet, x) = (simulation.sheet(), &simulation.state().x);
    let found = Crossings::new(sheet).find(sheet, x);
    (found.pairs > 0).then(|| format!("{}, {}", words(found.pairs), place(sheet, x, &found)))
}

/// `the sheet passes through itself: 12 pairs of triangles cross`.
#[must_use]
pub fn words(pairs: usize) -> String {
    match pairs {
        1 => "the sheet passes through itself: 1 pair of triangles crosses".into(),
        _ => format!("the sheet passes through itself: {pairs} pairs of triangles cross"),
    }
}

/// Where the first pair of triangles crosses in the shape `x`; empty where none does.
pub(super) fn place(sheet: &Sheet, x: &[Vec3], found: &Found) -> String {
    let Some([a, b]) = found.first else { return String::new() };
    let of = |t: usize| sheet.triangles()[t];
    let centre = of(a).map(|v| x[v as usize]).iter().sum::<Vec3>() / 3.0;
    format!(
        "first triangles {a} (vertices {:?}) and {b} (vertices {:?}) near ({:.4}, {:.4}, {:.4})",
        of(a),
        of(b),
        centre.x,
        centre.y,
        centre.z
    )
}
