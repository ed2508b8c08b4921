//! What a scene calls for, and why: unknowns, effects, signals, solvers, output; and what it spares.
//!
//! Everything is asked from what the scene was built into: what an effect is said to couple, fix, grow or
//! transport is what it contributes to the model, so that a new effect explains itself.

mod absent;
mod effects;
mod solvers;

use serde::Serialize;

use super::{Result, Simulation};
use crate::scene::Scene;

/// What a scene calls for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The name of the scene's file.
    pub scene: String,
    /// Its parts, by subject.
    pub sections: Vec<Section>,
}

/// The lines on one subject.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Section {
    /// The subject.
    pub title: &'static str,
    /// The lines.
    pub lines: Vec<Line>,
}

/// One thing that the scene calls for, or spares.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Line {
    /// Description.
    pub what: String,
    /// Why it is there, or not.
    pub because: String,
    /// What of the scene calls for it, with its line where it is written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
}

impl Line {
    fn new(what: impl Into<String>, because: impl Into<String>) -> Self {
        Self { what: what.into(), because: because.into(), place: None }
    }

    /// Called for by the key or table at `path`, where the scene has it.
    fn at(mut self, scene: &Scene, path: &str) -> Self {
        self.place = place(scene, path);
        self
    }
}

/// `[stability], line 12`, or `effect[0], line 7` as `--set` has it, if the scene has that.
fn place(scene: &Scene, path: &str) -> Option<String> {
    let written = scene.written(path)?;
    Some(match path.contains(['.', '[']) {
        true => format!("{path}, {written}"),
        false => format!("[{path}], {written}"),
    })
}

/// The names of things, as in a sentence.
fn listed<S: AsRef<str>>(names: &[S]) -> String {
    match names {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// `one is`, `several are`.
fn verb<'a, S>(names: &[S], one: &'a str, several: &'a str) -> &'a str {
    if names.len() == 1 { one } else { several }
}

impl Explanation {
    /// Of `scene`, set up as `simulation`, which is evaluated once: what that leaves in memory is counted.
    ///
    /// # Errors
    /// If a law or an effect cannot be evaluated at the start.
    pub fn of(scene: &Scene, simulation: &mut Simulation) -> Result<Self> {
        let sections = vec![
            Section { title: "unknowns", lines: effects::unknowns(scene, simulation) },
            Section { title: "effects", lines: effects::lines(scene, simulation) },
            Section { title: "laws and signals", lines: effects::laws(scene, simulation) },
            Section { title: "solvers", lines: solvers::lines(scene, simulation) },
            Section { title: "output", lines: solvers::output(scene, simulation) },
            Section { title: "not in this scene", lines: absent::lines(scene, simulation) },
        ];
        Ok(Self { scene: scene.name().to_owned(), sections })
    }
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.scene)?;
        for Section { title, lines } in &self.sections {
            writeln!(f, "\n{title}")?;
            for Line { what, because, place } in lines {
                match place {
                    Some(place) => writeln!(f, "  {what}  ({place})")?,
                    None => writeln!(f, "  {what}")?,
                }
                if !because.is_empty() {
                    writeln!(f, "      {because}")?;
                }
            }
        }
        Ok(())
    }
}
