//! The report of a failure, for people.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use super::blame::FailureCause;
use crate::Stepper;
use crate::Vec3;
use crate::kinetics::Location;
use crate::model::State;
use crate::num::Short;
use crate::output::ResultDirectory;
use crate::run::{Error, Simulation, self_intersection};
use crate::scene::Scene;
use crate::solve::rejections::Rejection;

/// The text: of `error`, whom `blame` names, in a directory; with the path of the state, if it was written.
pub(super) fn text(
    scene: &Scene,
    simulation: &mut Simulation,
    error: &Error,
    blame: &FailureCause,
    files: (&ResultDirectory, Option<&Path>),
) -> String {
    let mut text = String::from("# The run stopped\n\n");
    let _ = writeln!(text, "{error}\n");
    facts(&mut text, scene, simulation, (blame, error));
    // A law of nature is broken somewhere else than where the residual is largest.
    if !matches!(error, Error::Broken(_)) {
        forces(&mut text, simulation, blame);
        species_terms(&mut text, simulation, blame);
    }
    rejected(&mut text, simulation);
    commands(&mut text, scene, simulation.state().time, files);
    text
}

/// A row of a table.
fn row(text: &mut String, cells: &[String]) {
    let _ = writeln!(text, "| {} |", cells.join(" | ").replace('\n', " "));
}

/// The head of a table.
fn head(text: &mut String, titles: &[&str]) {
    row(text, &titles.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>());
    row(text, &titles.iter().map(|_| "---".to_owned()).collect::<Vec<_>>());
}

fn facts(
    text: &mut String,
    scene: &Scene,
    simulation: &Simulation,
    (blame, error): (&FailureCause, &Error),
) {
    let State { time, step, x, .. } = simulation.state();
    head(text, &["", ""]);
    let mut fact = |what: &str, is: String| row(text, &[what.to_owned(), is]);
    fact("time", format!("{time} of {}", Short(scene.time.span.until.get())));
    fact("last good step", step.to_string());
    fact("policy", scene.time.policy.name().to_owned());
    fact("integrator", scene.time.integrator.name());
    if !blame.causes.is_empty() {
        fact("to blame", blame.causes.join(", "));
    }
    if let Error::Broken(broken) = error {
        fact("to blame", broken.law.clone());
        fact("where", broken.place.clone());
    } else if let Some(place) = blame.place(simulation, x) {
        let what = if blame.is_named { "where" } else { "where the residual is largest" };
        fact(what, place);
    }
    if let Some(crossings) = self_intersection::describe(simulation) {
        fact("self-intersection", crossings);
    }
    text.push('\n');
}

/// The force of every effect at the vertex to blame.
fn forces(text: &mut String, simulation: &mut Simulation, blame: &FailureCause) {
    let Some(vertex) = blame.vertex.filter(|_| simulation.model().moves()) else { return };
    let stuck = simulation.stepper.workspace.stuck().cloned();
    let now = simulation.state().clone();
    let states = [("the last good state", Some(now)), ("where the last try stuck", stuck)];
    for (what, state) in states.into_iter().filter_map(|(what, state)| Some((what, state?))) {
        let Some(all) = forces_at(simulation, &state, vertex) else { continue };
        let _ = writeln!(text, "## Forces at vertex {vertex}, {what}\n");
        head(text, &["effect", "x", "y", "z", "magnitude"]);
        for (name, force) in all {
            let numbers = [force.x, force.y, force.z, force.norm()];
            let cells = numbers.iter().map(|number| format!("{number:.4e}"));
            row(text, &std::iter::once(name).chain(cells).collect::<Vec<_>>());
        }
        text.push('\n');
    }
}

/// The forces on a vertex by effect, the largest first, and the residual in the directions in which it may move.
fn forces_at(
    simulation: &mut Simulation,
    state: &State,
    vertex: usize,
) -> Option<Vec<(String, Vec3)>> {
    let model = Arc::clone(simulation.model());
    let mut at = simulation.stepper.workspace.at(state);
    let residual = -*at.gradient().ok()?.get(vertex)?;
    let potential = at.potential().ok()?;
    let mut all: Vec<(String, Vec3)> = Vec::new();
    for (which, name) in model.mechanics().names().enumerate() {
        all.push((name.to_owned(), *potential.force_of(which, &state.x).get(vertex)?));
    }
    for (which, name) in model.mechanics().constraint_names().enumerate() {
        all.push((name.to_owned(), *potential.constraint_force(which, &state.x).get(vertex)?));
    }
    all.sort_by(|a, b| b.1.norm().total_cmp(&a.1.norm()));
    all.push(("residual, without pinned directions".to_owned(), residual));
    Some(all)
}

/// Value, rate and terms of every species at the point to blame.
fn species_terms(text: &mut String, simulation: &mut Simulation, blame: &FailureCause) {
    let model = Arc::clone(simulation.model());
    let (Some(chemistry), Some(point)) = (model.chemistry(), blame.point) else { return };
    let Stepper { workspace, state, .. } = &mut simulation.stepper;
    let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
    let mut at = workspace.at(state);
    let Ok(signals) = at.signals().cloned() else { return };
    let zeros = || species.iter().map(|c| vec![0.0; c.len()]).collect::<Vec<_>>();
    let mut reaction = zeros();
    let mut out: Vec<&mut [f64]> = reaction.iter_mut().map(Vec::as_mut_slice).collect();
    // A law that has no value here has been named already.
    let reacts = chemistry.reaction(&species, &signals, &mut out).is_ok();
    let mut terms: Vec<(usize, String, f64)> = Vec::new();
    let names = chemistry.transport_names().map(str::to_owned);
    let values = chemistry.signal_values(&signals);
    for ((term, operator), name) in
        chemistry.transports().iter().zip(at.surface().operators()).zip(names)
    {
        let s = term.species();
        let mut rate = vec![0.0; species[s].len()];
        let (on, read) = ((&**model.sheet(), state.time), (&species[..], values));
        let added = term.add_rate_of(on, operator, read, &mut rate);
        let rate = rate.get(point).copied().filter(|_| added.is_ok());
        terms.push((s, name, rate.unwrap_or(f64::NAN)));
    }
    let noun = if chemistry.location() == Location::Face { "triangle" } else { "vertex" };
    let _ = writeln!(text, "## Species at {noun} {point}, the last good state\n");
    head(text, &["species", "value", "term", "rate"]);
    for (s, about) in chemistry.descriptor().species.iter().enumerate() {
        let Some(value) = species[s].get(point) else { continue };
        let value = format!("{value:.6e}");
        let law = if reacts { format!("{:.4e}", reaction[s][point]) } else { "no value".into() };
        row(text, &[about.name.clone(), value, "law".into(), law]);
        for (_, name, rate) in terms.iter().filter(|(which, ..)| *which == s) {
            row(text, &[String::new(), String::new(), name.clone(), format!("{rate:.4e}")]);
        }
    }
    text.push('\n');
}

/// Rejected step attempts that are listed.
const MAX_REJECTIONS: usize = 20;

/// The last rejected step attempts.
fn rejected(text: &mut String, simulation: &Simulation) {
    let all: Vec<&Rejection> = simulation.stepper.workspace.rejections().last().collect();
    if all.is_empty() {
        return;
    }
    let _ = writeln!(text, "## The last rejected step attempts\n");
    head(text, &["step", "time", "length", "cause", "message"]);
    for Rejection { step, time, length, cause, message, .. } in
        &all[all.len().saturating_sub(MAX_REJECTIONS)..]
    {
        let numbers = [step.to_string(), time.to_string(), format!("{length:.3e}")];
        row(text, &[&numbers[..], &[cause.name().to_owned(), message.clone()]].concat());
    }
    text.push('\n');
}

/// What to type.
fn commands(
    text: &mut String,
    scene: &Scene,
    time: f64,
    (run, state): (&ResultDirectory, Option<&Path>),
) {
    let quoted = |path: &Path| format!("'{}'", path.display().to_string().replace('\'', r"'\''"));
    let _ = writeln!(text, "## To look, and to try again\n\n```sh");
    let resolved = quoted(&run.resolved());
    if let Some(state) = state.map(quoted) {
        let stability = if scene.effects.is_empty() { "" } else { " --stability" };
        let _ = writeln!(text, "rumple inspect {resolved} --state {state}{stability}");
        let _ =
            writeln!(text, "rumple run {resolved} --from {state} --start-time {time} --out again");
    }
    let _ = writeln!(text, "rumple resume {}\n```\n", quoted(run.root()));
    let _ = writeln!(
        text,
        "`resume` repeats the step that failed, from the last checkpoint. `run --from` begins with the last good state; \
         `--set KEY=VALUE` tries what may help."
    );
}
