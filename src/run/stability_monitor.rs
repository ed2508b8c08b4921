//! Stability monitor of a run: counts the negative-curvature modes at every accepted
//! state, reports every change between none and some, and leaves saddles if the scene requests it.
//!
//! What is seen are saddles on which a relaxation comes to rest: perfectly flat or symmetric ones. A
//! sheet with an imperfection grows past its buckling point along a smooth branch of stable shapes,
//! and one that snaps is seen after it has come to rest elsewhere; neither is an event.
//!
//! Where the policy gives the shape storage it does not rest: states are counted as they are, and
//! nothing is relaxed, which would replace the motion by its end. Of such states those are displaced
//! along their mode that no force pulls that way, flat or symmetric ones; the motion under drag does
//! the rest.

use std::path::Path;
use std::sync::Arc;

use super::ranks::Piece;
use super::stability::{add_modes, directions};
use super::{Error, Result, Simulation};
use crate::Vec3;
use crate::output::events::{Event, Events};
use crate::output::{Compression, Progress, ResultDirectory, vtu};
use crate::scene::Scene;
use crate::solve::equilibrium::Relaxation;
use crate::solve::stability::{Inertia, Mode, Stability};
use crate::solve::{SolveError, StepReport};

/// Most vertices of a flat start that is checked without being asked: the factor of a larger sheet
/// costs minutes and gigabytes.
const MAX_CHECKED_VERTICES: usize = 200_000;

/// How a saddle is left, for messages.
const REMEDY: &str = "a run does not leave it by itself: break the symmetry of the start with \
                      sheet.imperfection or sheet.bump, or follow the mode with stability.perturb";
/// The event of a displacement along a mode that came to nothing.
const FELL_BACK: &str = "not left along the mode";
/// The event of a displacement of a shape that moves on from there.
const DISPLACED_EVENT: &str = "displaced along the mode";
/// A force along a mode counts as none below this share of what a displacement would bring.
const NO_PULL: f64 = 1e-3;
/// The event of a first equilibrium that is none.
const AT_START: &str = "saddle at the start";
/// And from a saddle that a run comes to.
const LATER_REMEDY: &str = "integrator = \"staggered\" leaves it at its next check, unless the shape is perfectly flat; others \
    and a flat shape stay: follow the mode with stability.perturb";

/// Whether an event of this kind leaves a run at a saddle.
pub(crate) fn stays_at_saddle(kind: &str) -> bool {
    matches!(kind, AT_START | FELL_BACK)
}

/// The stability monitor of one run.
pub(super) struct StabilityMonitor {
    stability: Stability,
    modes: usize,
    perturb: Option<f64>,
    /// Whether the shape has storage, and so moves rather than rests.
    moving: bool,
    directory: ResultDirectory,
    compression: Compression,
    written: usize,
    /// Whether the last state had a direction down; `None` before the first look.
    unstable: Option<bool>,
}

impl StabilityMonitor {
    /// The monitor of `scene`, if it asks for one; of a resumed run, from where that was.
    ///
    /// # Errors
    /// A sheet too large for a factor, or files that cannot be made.
    pub(super) fn open(
        scene: &Scene,
        simulation: &mut Simulation,
        directory: &ResultDirectory,
        from: Option<(usize, Option<bool>)>,
    ) -> Result<Option<Self>> {
        let Some(spec) = scene.stability.as_ref().filter(|s| s.watch) else { return Ok(None) };
        let (written, unstable) = from.unwrap_or_default();
        let modes = directory.modes();
        std::fs::create_dir_all(&modes)
            .map_err(|source| crate::output::OutputError::Write { path: modes, source })?;
        Ok(Some(Self {
            stability: Stability::new(simulation.model().mechanics())?
                .with_control(&simulation.stepper.workspace.control),
            modes: spec.modes.get(),
            perturb: spec.perturb.map(f64::from),
            moving: scene.time.policy.mass_weights().mechanics > 0.0,
            directory: directory.clone(),
            compression: scene.output.compression,
            written,
            unstable,
        }))
    }

    /// Modes written, and whether the last state had a direction down.
    pub(super) fn seen(&self) -> (usize, Option<bool>) {
        (self.written, self.unstable)
    }

    /// As [`StabilityMonitor::inspect`] after the step of `report`, whose work it adds to; NaN if it is interrupted.
    ///
    /// # Errors
    /// As there.
    pub(super) fn analyse(
        &mut self,
        simulation: &mut Simulation,
        report: &mut StepReport,
        to: (&mut Events, &mut Progress),
    ) -> Result<f64> {
        let under_way = self.is_under_way(simulation, report);
        let tally = simulation.model().tally();
        let _scope = tally.meter("solver", "stability analysis").scope("shapes");
        let (seen, spent) = simulation.spend(|s| match under_way {
            true => Ok(self.count(s, to.1)?.map_or(f64::NAN, |i| crate::num::real(i.negative))),
            false => self.inspect(s, &mut report.relaxation, to),
        });
        report.work += spent.work;
        match seen {
            // The state is then still the saddle.
            Err(Error::Solve(SolveError::Interrupted)) => Ok(f64::NAN),
            seen => seen,
        }
    }

    /// Whether a quasi-static shape is in the middle of a snap: negative directions are counted then, but are no event.
    fn is_under_way(&self, simulation: &Simulation, report: &StepReport) -> bool {
        let tolerance = simulation.stepper.workspace.force_tolerance();
        !self.moving && report.relaxation.residual > tolerance
    }

    /// Inspects the accepted state of `simulation`; returns the negative-curvature directions, for the ledger.
    ///
    /// Where a second relaxation leads is added to `done`. A factor dominated by round-off is reported and
    /// gives NaN.
    ///
    /// # Errors
    /// Files that cannot be written, or a relaxation that fails on its way from a saddle; the state
    /// is the saddle then.
    fn inspect(
        &mut self,
        simulation: &mut Simulation,
        done: &mut Relaxation,
        (events, progress): (&mut Events, &mut Progress),
    ) -> Result<f64> {
        let Some(inertia) = self.count(simulation, progress)? else { return Ok(f64::NAN) };
        let (now, negative) = (inertia.negative > 0, crate::num::real(inertia.negative));
        let before = self.unstable.replace(now);
        let kind = match (before, now) {
            (None, true) => AT_START,
            (Some(false), true) => "loss of stability",
            (Some(true), false) => "stability regained",
            _ => "",
        };
        // A shape that moves is asked once, when negative-curvature directions appear: modes cost many solves.
        let leaves = now && self.perturb.is_some() && !(self.moving && kind.is_empty());
        if kind.is_empty() && !leaves {
            return Ok(negative);
        }
        let modes = self.modes(simulation, progress)?;
        if !kind.is_empty() {
            self.report(simulation, (kind, inertia.negative), &modes, (events, progress))?;
        }
        let (Some(by), Some(mode), true) = (self.perturb, modes.first(), leaves) else {
            return Ok(negative);
        };
        if !self.moving {
            return self.leave(simulation, (mode, by), done, (events, progress));
        }
        if self.is_stuck(simulation, mode, by)? {
            displace(simulation, mode, by)?;
            done.residual = simulation.evaluate().residual()?;
            let event = (DISPLACED_EVENT, inertia.negative);
            self.report(simulation, event, &modes, (events, progress))?;
        }
        Ok(negative)
    }

    fn count(
        &mut self,
        simulation: &mut Simulation,
        progress: &mut Progress,
    ) -> Result<Option<Inertia>> {
        let mut at = simulation.evaluate();
        let x = &at.state().x;
        let counted = self.stability.inertia(at.potential()?, x);
        known(counted, "the stability could not be determined", progress)
    }

    /// The softest modes; none if they cannot be found.
    fn modes(&mut self, simulation: &mut Simulation, progress: &mut Progress) -> Result<Vec<Mode>> {
        let mut at = simulation.evaluate();
        let x = &at.state().x;
        let spectrum = self.stability.spectrum(at.potential()?, x, self.modes);
        let spectrum = known(spectrum, "the modes could not be computed", progress)?;
        Ok(spectrum.map_or_else(Vec::new, |spectrum| spectrum.modes))
    }

    /// Whether nothing pulls the shape along `mode` that a displacement by so much would not exceed
    /// by far: it then stays where it is in that direction.
    fn is_stuck(&self, simulation: &mut Simulation, mode: &Mode, by: f64) -> Result<bool> {
        let model = Arc::clone(simulation.model());
        let gradient = simulation.evaluate().gradient()?;
        let (sheet, mass, shape) = (model.sheet(), self.stability.mass(), &mode.shape);
        let sum = |of: &(dyn Fn(usize) -> f64 + Sync)| sheet.reduction().sum(shape.len(), of);
        let pull = sum(&|i| gradient[i].dot(&shape[i]));
        let weight = sum(&|i| mass[i] * shape[i].norm_squared());
        Ok(pull.abs() <= NO_PULL * (mode.eigenvalue * by).abs() * weight)
    }

    /// Displaces the shape along `mode` and relaxes; returns the negative-curvature directions there.
    fn leave(
        &mut self,
        simulation: &mut Simulation,
        (mode, by): (&Mode, f64),
        done: &mut Relaxation,
        (events, progress): (&mut Events, &mut Progress),
    ) -> Result<f64> {
        let saddle = simulation.stepper.state.x.clone();
        displace(simulation, mode, by)?;
        match simulation.relax() {
            Ok(later) => done.add(&later),
            Err(error) => {
                simulation.stepper.state.x = saddle;
                return Err(error);
            }
        }
        let Some(inertia) = self.count(simulation, progress)? else { return Ok(f64::NAN) };
        self.unstable = Some(inertia.negative > 0);
        let modes = self.modes(simulation, progress)?;
        let kind = if inertia.negative == 0 { "left along the mode" } else { FELL_BACK };
        self.report(simulation, (kind, inertia.negative), &modes, (events, progress))?;
        Ok(crate::num::real(inertia.negative))
    }

    /// Writes the modes and the event, and says it.
    fn report(
        &mut self,
        simulation: &mut Simulation,
        (kind, negative): (&str, usize),
        modes: &[Mode],
        (events, progress): (&mut Events, &mut Progress),
    ) -> Result<()> {
        let model = Arc::clone(simulation.model());
        let mut frame = simulation.frame()?;
        add_modes(&mut frame, modes);
        let path = self.directory.mode(self.written);
        match model.sheet().reduction().periods() {
            [] => vtu::write(&path, &frame, self.compression)?,
            _ => {
                let piece = Piece::new(model.sheet(), &frame);
                vtu::write(&path, &piece.frame(model.sheet(), &frame), self.compression)?;
            }
        }
        self.written += 1;
        let file = path.strip_prefix(self.directory.root()).unwrap_or(&path);
        let eigenvalue = modes.first().map_or(f64::NAN, |m| m.eigenvalue);
        events.append(&Event {
            time: simulation.stepper.state.time,
            step: simulation.stepper.state.step,
            kind,
            eigenvalue: Some(eigenvalue),
            negative: Some(negative),
            modes: &slashed(file),
            ..Event::default()
        })?;
        let mut text = format!(
            "time {}: {kind}; {}, smallest eigenvalue {eigenvalue:.3e} force/length^3, modes in {}",
            simulation.stepper.state.time,
            directions(negative),
            path.display()
        );
        if kind == FELL_BACK {
            text += "; a larger stability.perturb may leave it";
        }
        // What moves may be on its way already.
        if negative > 0 && self.perturb.is_none() && (kind == AT_START || !self.moving) {
            text += "; ";
            text += if kind == AT_START { REMEDY } else { LATER_REMEDY };
        }
        progress.message(&text);
        Ok(())
    }
}

/// The result of an analysis; none, and a message, where it failed for another reason than an interruption.
fn known<T>(
    outcome: std::result::Result<T, SolveError>,
    failure: &str,
    progress: &mut Progress,
) -> Result<Option<T>> {
    match outcome {
        Ok(found) => Ok(Some(found)),
        Err(SolveError::Interrupted) => Err(SolveError::Interrupted.into()),
        Err(error) => {
            progress.message(&format!("{failure}: {error}"));
            Ok(None)
        }
    }
}

/// Moves the shape along `mode`.
///
/// # Errors
/// If the plugin fails there; the shape is as before then.
fn displace(simulation: &mut Simulation, mode: &Mode, by: f64) -> Result<()> {
    let before = simulation.stepper.state.x.clone();
    for (x, v) in simulation.stepper.state.x.iter_mut().zip(&mode.shape) {
        *x += by * v;
    }
    let evaluated = simulation.evaluate().potential().map(|_| ());
    Ok(evaluated.inspect_err(|_| simulation.stepper.state.x = before)?)
}

/// A relative path as every system writes it.
fn slashed(path: &Path) -> String {
    path.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

/// Reports a perfectly flat first equilibrium, whether or not the scene has a watch: one
/// factorisation, once in a run, and only where all z are the same.
pub(super) fn warn_of_flat_start(
    simulation: &mut Simulation,
    progress: &mut Progress,
) -> Result<()> {
    let mechanics = simulation.model().mechanics().clone();
    let x: &[Vec3] = &simulation.stepper.state.x;
    let flat = x.iter().all(|v| v.z == x[0].z);
    // With all z fixed the sheet cannot leave the plane: no warning.
    let fixed = mechanics.pins().iter().all(|p| p[2]);
    if !flat || fixed || mechanics.is_empty() || x.len() > MAX_CHECKED_VERTICES {
        return Ok(());
    }
    let mut at = simulation.evaluate();
    let x = &at.state().x;
    let potential = at.potential()?;
    let inertia = Stability::new(&mechanics).and_then(|mut s| s.inertia(potential, x));
    progress.message(&match inertia {
        Ok(Inertia { negative: 0, .. }) => {
            "the initial shape is perfectly flat, and stable; under \
             compression it would stay flat on a saddle (list [stability] to have it reported, \
             sheet.imperfection or sheet.bump to leave the plane)"
                .into()
        }
        Ok(Inertia { negative, .. }) => format!(
            "warning: the initial shape is perfectly flat and a saddle: {}; {REMEDY}",
            directions(negative)
        ),
        Err(error) => {
            format!(
                "the initial shape is perfectly flat; whether it is stable is not known: \
                {error}"
            )
        }
    });
    Ok(())
}
