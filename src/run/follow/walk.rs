//! Walks along one branch after another: each to its end, then those that leave it at its bifurcations.

use std::collections::VecDeque;

use super::family::SceneFamily;
use super::record::Record;
use super::{Found, News, Request};
use crate::num::Short;
use crate::run::{Error, Result};
use crate::solve::SolveError;
use crate::solve::continuation::{Continuation, Event, Point};

/// Branches that are being followed.
pub(super) struct Walk<'a> {
    pub(super) request: &'a Request,
    pub(super) branch: Continuation<SceneFamily>,
    pub(super) record: Record<'a>,
    pub(super) listener: &'a mut dyn FnMut(News<'_>),
    pub(super) found: Found,
}

impl Walk<'_> {
    /// The first branch, and those that it is left for.
    pub(super) fn all(&mut self) -> Result<()> {
        let start = self.branch.point().clone();
        self.add(&[start])?;
        let bifurcations = self.follow()?;
        if self.request.switch > 0 && bifurcations.is_empty() {
            let text = "no bifurcation was located on branch 0: --switch follows no other one";
            (self.listener)(News::Event(text));
        }
        let ways: &[bool] = if self.request.both_ways { &[false, true] } else { &[false] };
        let mut left: VecDeque<(Point, usize, bool)> = VecDeque::new();
        for point in bifurcations.into_iter().take(self.request.switch) {
            let Event::Bifurcation(modes) = &point.event else { continue };
            let each = (0..modes.len()).flat_map(|k| ways.iter().map(move |way| (k, *way)));
            left.extend(each.map(|(k, way)| (point.clone(), k, way)));
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
                    (self.listener)(News::Event(&text));
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
        (self.listener)(News::Event(&text));
    }

    /// Records `points`.
    fn add(&mut self, points: &[Point]) -> Result<()> {
        let number = self.found.branches;
        self.record.add(self.branch.family(), number, points)?;
        for point in points {
            self.found.points += 1;
            let what = match &point.event {
                Event::Fold => "fold".to_owned(),
                Event::Bifurcation(modes) if modes.len() == 1 => "bifurcation".to_owned(),
                Event::Bifurcation(modes) => format!("bifurcation along {} modes", modes.len()),
                Event::Passed(count) => format!(
                    "{count} eigenvalues changed sign, where was not found (try a shorter --longest-step), before the point"
                ),
                _ => continue,
            };
            let [at, arc] = [point.parameter, point.arc].map(six_digits);
            let key = &self.request.along;
            let text = format!("branch {number}: {what} at {key} = {at}, arc length {arc}");
            (self.listener)(News::Event(&text));
            self.found.events.push(text);
        }
        if let Some(Point { parameter, negative, .. }) = points.last() {
            let (key, at, count) = (&self.request.along, six_digits(*parameter), self.found.points);
            let text = format!(
                "branch {number}: {count} points, {key} = {at}, {negative} negative eigenvalues"
            );
            (self.listener)(News::Step(&text));
        }
        Ok(())
    }
}

/// A number in six digits.
fn six_digits(value: f64) -> Short {
    Short(format!("{value:.5e}").parse().unwrap_or(value))
}
