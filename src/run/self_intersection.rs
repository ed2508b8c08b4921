//! Whether a sheet passes through itself: pairs of triangles that cross, and closed sheets turned inside out, looked
//! for at every frame and at the end of a run: such shapes are no results. Nor are those inside of a body, where pins win.

use super::observe::Observer;
use super::{Result, Simulation, StepInfo};
use crate::Vec3;
use crate::effects::NO_CROSSINGS_ADVICE;
use crate::geometry::Crossings;
use crate::model::Evaluation;
use crate::num::Short;
use crate::output::SelfIntersection;
use crate::sheet::{Sheet, is_turned};

/// Looks for self-intersection at output times and at the end of a run.
#[derive(Debug, Default)]
pub(super) struct Intersections {
    last: Option<SelfIntersection>,
    /// What is to be said of it, once in a run.
    news: Option<String>,
    told: bool,
    /// Whether it was said that the sheet is inside of a body.
    entered: bool,
}

impl Intersections {
    /// Of the last shape that was inspected; none where no shape moves.
    pub(super) fn last(&self) -> Option<SelfIntersection> {
        self.last
    }

    /// A message when a shape passes through itself for the first time.
    pub(super) fn first_message(&mut self) -> Option<String> {
        self.news.take()
    }
}

impl Observer for Intersections {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        // A part of a sheet crosses parts of other ranks, which it does not know.
        let spread = at.model().sheet().reduction().distribution().is_some();
        if !info.frame || !at.model().moves() || spread {
            return Ok(());
        }
        let _scope = at.model().tally().meter("output", "self-intersection").scope("shapes");
        let (sheet, state) = (at.model().sheet(), at.state());
        let (found, place) = find(sheet, &state.x);
        self.last = Some(found);
        if let Some(words) = found.words().filter(|_| !self.told) {
            self.told = true;
            let time = Short(state.time);
            self.news = Some(format!(
                "warning: time {time}: {words}{place}; results from here on are not those of a sheet; {NO_CROSSINGS_ADVICE}; \
                 `invariants.crossings = 0` ends a run there"
            ));
        } else if let Some(words) = inside_body(at)?.filter(|_| !self.entered) {
            self.entered = true;
            self.news = Some(format!("warning: time {}: {words}", Short(at.state().time)));
        }
        Ok(())
    }
}

/// What there is to be said of a sheet that is inside of a body.
fn inside_body(at: &mut Evaluation<'_>) -> Result<Option<String>> {
    let (model, x) = (at.model(), at.state().x.clone());
    for k in model.mechanics().contacts() {
        let depth = at.potential()?.touching(k, &x).map_or(0.0, |touching| -touching.gap);
        if depth > 0.0 {
            let name = model.mechanics().names().nth(k).unwrap_or_default();
            let depth = format!("{depth:.2e}");
            return Ok(Some(format!(
                "the sheet is inside of the {name} by up to {depth}: pins, or another body, hold it there, or it started there"
            )));
        }
    }
    Ok(None)
}

/// What there is to be said of the last good state of a simulation, with the place; none where its sheet does not
/// pass through itself.
pub(super) fn describe(simulation: &Simulation) -> Option<String> {
    if !simulation.model().moves() {
        return None;
    }
    let (found, place) = find(simulation.sheet(), &simulation.state().x);
    found.words().map(|words| words + &place)
}

/// Inspects the shape `x`; also where the first pair of triangles crosses.
fn find(sheet: &Sheet, x: &[Vec3]) -> (SelfIntersection, String) {
    // Its boxes are not kept: frames are seldom, and memory is not.
    let found = Crossings::new(sheet).find(sheet, x);
    let inside_out = is_turned(sheet, sheet.rest(), x);
    let place = found.place(sheet, x);
    let place = if place.is_empty() { place } else { format!(", {place}") };
    (SelfIntersection { crossings: found.pairs, inside_out }, place)
}
