//! What is followed, and what is found.

use std::path::PathBuf;

use crate::run::follow::Measure;
use crate::run::{Error, Result};

/// What is followed, and how.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// Overrides of it.
    pub set: Vec<String>,
    /// The key.
    pub along: String,
    /// Its first value; that of the scene if not given.
    pub from: Option<f64>,
    /// Its last value.
    pub to: f64,
    /// Further values of the range in which branches are followed, beyond those two.
    pub within: Option<[f64; 2]>,
    /// Time at which ramps and growth are evaluated; the end of the scene if not given.
    pub time: Option<f64>,
    /// Most steps of a branch.
    pub steps: usize,
    /// Arc length of the first step.
    pub first_step: f64,
    /// Arc length of the longest step.
    pub longest_step: f64,
    /// Displacement that counts as much as the whole range, if not a tenth of the square root of the area.
    pub length: Option<f64>,
    /// Bifurcations of the first branch at which another one is followed.
    pub switch: usize,
    /// Whether those are followed both ways.
    pub both_ways: bool,
    /// What the diagram shows: if not given the displacement along the critical mode where branches are switched, else that
    /// along the load.
    pub measure: Option<Measure>,
}

impl Request {
    /// Refuses a range and steps that mean nothing for a branch that begins at `from`.
    pub(super) fn check(&self, from: f64) -> Result<()> {
        let Self { to, within, first_step, longest_step, .. } = *self;
        if let Some([least, largest]) = within
            && !(least <= from.min(to) && from.max(to) <= largest)
        {
            return Err(Error::Refused(format!(
                "--within {least} {largest}: the range is to hold the whole way from {from} to {to}, the least value first"
            )));
        }
        if first_step > longest_step {
            return Err(Error::Refused(format!(
                "--first-step {first_step} is longer than --longest-step {longest_step}"
            )));
        }
        Ok(())
    }
}

/// Message of a continuation in progress.
#[derive(Debug, Clone, Copy)]
pub enum FollowEvent<'a> {
    /// A fold or a bifurcation.
    Event(&'a str),
    /// A step.
    Step(&'a str),
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FollowSummary {
    /// Points on all branches.
    pub points: usize,
    /// Branches.
    pub branches: usize,
    /// Folds and bifurcations, in words.
    pub events: Vec<String>,
}
