//! Walks along one branch after another: each to its end, then those that leave it at its bifurcations.

use std::collections::VecDeque;

use super::record::BranchRecord;
use super::{FollowEvent, FollowSummary, Request};
use crate::num::Short;
use crate::run::{Error, Result};
use crate::solve::SolveError;
use crate::solve::continuation::{Continuation, CriticalMode, Event, Point, System};

/// Follows `branch` and those that leave it, as `request` says; the listener gets the progress.
///
/// # Errors
/// A branch without equilibrium, an interruption, files that cannot be written.
pub(super) fn walk<S: System<Error = Error>>(
    request: &Request,
    branch: Continuation<S>,
    record: BranchRecord<'_>,
    (listener, found): (&mut dyn FnMut(FollowEvent<'_>), &mut FollowSummary),
) -> Result<()> {
    let mut walk = Walk { request, branch, record, listener, found };
    let outcome = walk.all();
    // What there is of a branch that is lost is drawn as well.
    let drawn = walk.record.write_diagram();
    outcome?;
    drawn
}

/// Branches that are being followed.
struct Walk<'a, S: System> {
    request: &'a Request,
    branch: Continuation<S>,
    record: BranchRecord<'a>,
    listener: &'a mut dyn FnMut(FollowEvent<'_>),
    found: &'a mut FollowSummary,
}

impl<S: System<Error = Error>> Walk<'_, S> {
    /// The first branch, and those that it is left for.
    fn all(&mut self) -> Result<()> {
        let start = self.branch.point().clone();
        self.add(&[start])?;
        let bifurcations = self.follow()?;
        if self.request.switch > 0 && bifurcations.is_empty() {
            let text = "no bifurcation was located on branch 0: --switch follows no other one";
            (self.listener)(FollowEvent::Event(text));
        }
        let ways: &[bool] = if self.request.both_ways { &[false, true] } else { &[false] };
        let mut left: VecDeque<(Point, usize, bool)> = VecDeque::new();
        for point in bifurcations.into_iter().take(self.request.switch) {
            let Event::Bifurcation(modes) = &point.event else { continue };
            let steady = (0..modes.len()).filter(|k| modes[*k].frequency == 0.0);
            let each = steady.flat_map(|k| ways.iter().map(move |way| (k, *way)));
            let each: Vec<_> = each.collect();
            left.extend(each.into_iter().map(|(k, way)| (point.clone(), k, way)));
        }
        while let Some((point, mode, reverse)) = left.pop_front() {
            self.found.branches += 1;
            let first = match self.branch.switch(&point, mode, reverse) {
                Ok(first) => first,
                Err(Error::Solve(error @ SolveError::Continuation { .. })) => {
                    self.found.branches -= 1;
                    let side = if reverse { "backwards" } else { "forwards" };
                    let at = six_digits(point.parameter);
                    let (key, number) = (&self.request.along, mode + 1);
                    let text = format!("mode {number} at {key} = {at}, {side}: {error}");
                    (self.listener)(FollowEvent::Event(&text));
                    continue;
                }
                Err(error) => return Err(error),
            };
            let start = Point { event: Event::Start, ..point };
            self.add(&[start])?;
            self.add(&first)?;
            self.follow()?;
        }
        self.found.branches += 1;
        Ok(())
    }

    /// Follows the branch to its end, or for so many steps; the bifurcations on it.
    fn follow(&mut self) -> Result<Vec<Point>> {
        let mut bifurcations = Vec::new();
        for _ in 0..self.request.steps {
            if self.branch.has_ended() {
                break;
            }
            let points = self.branch.advance()?;
            self.add(&points)?;
            bifurcations.extend(
                points.into_iter().filter(|point| matches!(point.event, Event::Bifurcation(_))),
            );
        }
        self.tell_end();
        Ok(bifurcations)
    }

    /// Says where the branch ended, and why.
    fn tell_end(&mut self) {
        let Request { along, to, steps, .. } = self.request;
        let (number, last) = (self.found.branches, self.branch.point().parameter);
        let at = six_digits(last);
        let text = if !self.branch.has_ended() {
            format!(
                "branch {number}: stops at {along} = {at} after {steps} steps; --steps lets it continue"
            )
        } else if last == *to {
            format!("branch {number}: reaches {along} = {at}")
        } else {
            format!(
                "branch {number}: leaves the range at {along} = {at}, and not at {to}; --within lets it continue"
            )
        };
        (self.listener)(FollowEvent::Event(&text));
    }

    /// Records `points`.
    fn add(&mut self, points: &[Point]) -> Result<()> {
        let number = self.found.branches;
        self.record.add(number, points)?;
        for point in points {
            self.found.points += 1;
            let Some(what) = in_words(&point.event) else { continue };
            let [at, arc] = [point.parameter, point.arc].map(six_digits);
            let key = &self.request.along;
            let text = format!("branch {number}: {what} at {key} = {at}, arc length {arc}");
            (self.listener)(FollowEvent::Event(&text));
            self.found.events.push(text);
        }
        if let Some(Point { parameter, negative, .. }) = points.last() {
            let (key, at, count) = (&self.request.along, six_digits(*parameter), self.found.points);
            let text = format!(
                "branch {number}: {count} points, {key} = {at}, {negative} negative eigenvalues"
            );
            (self.listener)(FollowEvent::Step(&text));
        }
        Ok(())
    }
}

/// A number in six digits.
fn six_digits(value: f64) -> Short {
    Short(format!("{value:.5e}").parse().unwrap_or(value))
}

/// What is special about a point, if anything is.
fn in_words(event: &Event) -> Option<String> {
    let swings = |mode: &CriticalMode| mode.frequency != 0.0;
    Some(match event {
        Event::Fold => "fold".to_owned(),
        Event::Bifurcation(modes) => match &modes[..] {
            [mode, ..] if swings(mode) => {
                format!(
                    "bifurcation of oscillations (Hopf), frequency {}",
                    six_digits(mode.frequency)
                )
            }
            [] | [_] => "bifurcation".to_owned(),
            several => format!("bifurcation along {} modes", several.len()),
        },
        Event::Singularity(modes) => {
            let modes = match modes.len() {
                ..=1 => "a mode".to_owned(),
                several => format!("{several} modes"),
            };
            format!(
                "stability of the shape at given species changes along {modes}, without another branch (singularity-induced bifurcation),"
            )
        }
        Event::Passed(count) => format!(
            "sign change of {count} eigenvalues, not located (try a shorter --longest-step), in the step that ends"
        ),
        Event::None | Event::Start | Event::End => return None,
    })
}
