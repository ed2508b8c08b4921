//! `rumple inspect SCENE --state FILE`: looks into one state.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::SceneArgs;
use crate::output::{Compression, Inputs, ResultFile, vtu};
use crate::run::stability::{StabilityReport, add_modes};
use crate::run::{Error, Result, Simulation, inspect, overview, provenance};
use crate::sheet::{Surface, read};

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The state: points are positions, arrays are species by name; the scene's start if absent.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Time at which ramps, growth and laws are evaluated; by default that of the state's frame, and without one that of
    /// the scene's start.
    #[arg(long, value_name = "T", allow_hyphen_values = true, value_parser = super::follow::finite)]
    time: Option<f64>,
    /// File for all numbers in JSON, `-` for standard output; without --json, --vtu and --stability an overview
    /// is printed.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// File for a frame with the scene's output fields, and the modes if asked for.
    #[arg(long, visible_alias = "out", value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Overwrite existing files, but not input files.
    #[arg(long)]
    force: bool,
    /// Relax the state first.
    #[arg(long)]
    relax: bool,
    /// Report whether the state is a minimum or a saddle, with the smallest eigenvalues of the
    /// energy's Hessian; their modes go to the frame as vector fields.
    #[arg(long)]
    stability: bool,
    /// How many eigenvalues and modes.
    #[arg(long, value_name = "K", default_value_t = 4, requires = "stability",
          value_parser = clap::value_parser!(u16).range(1..))]
    modes: u16,
}

pub(super) fn run(args: &InspectArgs) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    // Read before the scene is set up: a plugin may change the working directory.
    let given = args.state.as_ref().map(read::surface).transpose()?;
    let mut inputs = provenance::inputs(&scene, &[]);
    if let Some(path) = &args.state {
        inputs.add("the state", path);
    }
    let [json, vtu] = result_files(args, &inputs)?;
    let mut simulation = Simulation::new(&scene, &search)?;
    let read = provenance::inputs(&scene, simulation.plugins());
    for file in [&json, &vtu].into_iter().flatten() {
        file.check_inputs(&read)?;
    }
    if let Some(surface) = &given {
        inspect::take_state(&mut simulation, surface)?;
    }
    let (time, whose) = time_of(args, given.as_ref(), simulation.stepper.state.time);
    simulation.stepper.state.time = time;
    // Standard output is for the numbers.
    simulation.notes.iter().for_each(|note| super::warn(note));
    let relaxation = match args.relax {
        true => Some(relax(&mut simulation)?),
        false => None,
    };
    let stability = match args.stability {
        true => Some(StabilityReport::new(&mut simulation, args.modes.into())?),
        false => None,
    };
    let shown = [&json, &vtu].contains(&&Some(ResultFile::StandardOutput));
    if !shown {
        say!("evaluated at time {time}, {whose}");
    }
    if let Some(report) = stability.as_ref().filter(|_| !shown) {
        say!("{}", report.to_string().trim_end());
    }
    let mut result = inspect::inspect(&mut simulation)?;
    if let Some(all) = result.as_object_mut() {
        all.extend(stability.as_ref().map(|report| ("stability".into(), report.to_json())));
        all.extend(relaxation.map(|work| ("relaxation".into(), work)));
    }
    match &json {
        Some(file) => {
            let text = serde_json::to_string(&result).unwrap_or_default();
            file.write(|writer| writeln!(writer, "{text}"))?;
        }
        None if vtu.is_none() && stability.is_none() => {
            say!("{}", overview::overview(&result).trim_end());
        }
        None => {}
    }
    if let Some(file) = &vtu {
        write_frame(file, &mut simulation, stability.as_ref())?;
    }
    Ok(())
}

/// Relaxes the shape: the work that this took.
fn relax(simulation: &mut Simulation) -> Result<serde_json::Value> {
    let done = simulation.relax()?;
    let (iterations, residual, tolerance) =
        (done.iterations, done.residual, simulation.force_tolerance());
    super::warn(&format!(
        "relaxed: {iterations} iterations, force residual {residual:.3e} (tolerance {tolerance:.1e})"
    ));
    Ok(json!({ "iterations": iterations, "residual": residual, "tolerance": tolerance }))
}

/// The time at which a state is evaluated, and whose it is.
fn time_of(args: &InspectArgs, state: Option<&Surface>, start: f64) -> (f64, &'static str) {
    match (args.time, state.and_then(|state| state.time).filter(|time| time.is_finite())) {
        (Some(time), _) => (time, "as --time says"),
        (None, Some(time)) => (time, "that of the frame"),
        (None, None) if state.is_some() => {
            (start, "that of the start, as the state has none: --time gives another")
        }
        (None, None) => (start, "that of the start"),
    }
}

/// Writes the frame of the state, with the modes of `stability`.
fn write_frame(
    file: &ResultFile,
    simulation: &mut Simulation,
    stability: Option<&StabilityReport>,
) -> Result<()> {
    let mut frame = simulation.frame()?;
    if let Some(report) = stability {
        add_modes(&mut frame, &report.spectrum.modes);
    }
    let bytes = vtu::encode(&frame, Compression::default())?;
    file.write(|writer| writer.write_all(&bytes))?;
    Ok(())
}

/// The files that `--json` and `--vtu` name, which must differ.
fn result_files(args: &InspectArgs, inputs: &Inputs) -> Result<[Option<ResultFile>; 2]> {
    let json = result_file(args.json.as_ref(), args.force, inputs)?;
    let vtu = result_file(args.vtu.as_ref(), args.force, inputs)?;
    if json.is_some() && json == vtu {
        return Err(Error::Refused("--json and --vtu name the same file".to_owned()));
    }
    Ok([json, vtu])
}

/// The file that a result goes to, if it is asked for.
fn result_file(path: Option<&PathBuf>, force: bool, inputs: &Inputs) -> Result<Option<ResultFile>> {
    Ok(path.map(|path| ResultFile::new(path, force, inputs)).transpose()?)
}
