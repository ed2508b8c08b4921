//! `rumple gradient SCENE --measure J --with KEY`: derivatives of an equilibrium, or of a run in time, by parameters.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{SceneArgs, warn};
use crate::output::{Compression, Field, Frame, Interrupt, Mode, Progress, ResultFile, vtu};
use crate::run::{Error, Result, provenance};
use crate::solve::Control;
use crate::study::gradient::{Evaluated, Objective, Parameter, Place, Request, SceneSource};

/// Arguments of `gradient`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct GradientArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// What is differentiated: energy, volume, integral(FORMULA), mean(FORMULA) or shape(FILE), the distance from the points
    /// of a mesh; a number and * before it is its weight. Formulas read x, y, z at rest, the displacement ux, uy, uz, species, t and
    /// distance_to_boundary. May be repeated: the sum.
    #[arg(long, value_name = "MEASURE", required = true, allow_hyphen_values = true)]
    measure: Vec<String>,
    /// A number of the scene, as `--set` names it: the derivative by it; may be repeated.
    #[arg(long, value_name = "KEY", required_unless_present = "map")]
    with: Vec<String>,
    /// A field of the scene: the derivatives by its values at the vertices, as a map; may be repeated.
    #[arg(long, value_name = "KEY", requires = "vtu")]
    map: Vec<String>,
    /// Differentiate the equilibrium that the scene begins with, at the species there, rather than that at its end.
    #[arg(long)]
    at_start: bool,
    /// Differentiate the run in time, which need not come to rest: J of the state at its end.
    #[arg(long, conflicts_with = "at_start")]
    in_time: bool,
    /// The same at these times, ascending, with commas between them: J is the sum.
    #[arg(long, value_name = "T", value_delimiter = ',', conflicts_with = "at_start")]
    at_times: Vec<f64>,
    /// File for the maps, on the shape: derivatives per rest area, which do not depend on the mesh.
    #[arg(long, visible_alias = "out", value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Overwrite an existing file, but not input files.
    #[arg(long)]
    force: bool,
    /// Print the measure and all derivatives by numbers as JSON.
    #[arg(long)]
    json: bool,
    /// Print no progress.
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  rumple gradient plate.toml --measure 'mean(uz)' --with material.thickness --with effect.load.force.per-area[2]
  rumple gradient spots.toml --measure 'integral((c - 0.5)^2)' --with kinetics.parameters.k --in-time
  rumple gradient leaf.toml --measure 'shape(target.obj)' --map effect.growth.factor --vtu map.vtu

Differentiated is the equilibrium at the end of the scene's time; with a law the steady state of shape and chemistry there. One linear
solution gives the derivatives by any number of parameters. With --in-time it is the state of a run that does not rest, by the adjoint of
a replay. Not covered: species on triangles of a moving sheet, constraints, remodelling and plasticity, periodic sheets.";

pub(super) fn run(args: &GradientArgs) -> Result<()> {
    args.scene.with_threads(|| run_in_pool(args))
}

fn run_in_pool(args: &GradientArgs) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    let inputs = provenance::inputs(&scene, &[]);
    let file =
        args.vtu.as_ref().map(|path| ResultFile::new(path, args.force, &inputs)).transpose()?;
    let interrupt = Interrupt::install()?;
    let progress = Progress::without_end(if args.quiet { Mode::Silent } else { Mode::detect() });
    let aside = progress.aside();
    let control = Control::new(move || interrupt.requested(), move |text| aside.report(text));
    let request = Request {
        scene: SceneSource::File(args.scene.scene.clone()),
        set: args.scene.overrides.clone(),
        measures: args.measure.clone(),
        numbers: args.with.clone(),
        fields: args.map.clone(),
        place: match (args.at_start, args.in_time || !args.at_times.is_empty()) {
            (true, _) => Place::Start,
            (false, true) => Place::InTime(args.at_times.clone()),
            (false, false) => Place::End,
        },
    };
    let mut objective = Objective::new(request, search, control)?;
    let start = objective.values();
    let mut evaluated = objective.evaluate(&start)?;
    let gradient = objective.gradient(&mut evaluated)?;
    let check = objective.check_by_replay(&evaluated, &gradient)?;
    progress.finish();
    if let Some(count @ 1..) = evaluated.negative_modes() {
        warn(&format!(
            "the shape is a saddle with {count} unstable directions: a run does not stay there"
        ));
    }
    if evaluated.changes_with_rigid_motions() {
        warn(
            "the measure changes with rigid motions that nothing hinders: it is differentiated as if they were held",
        );
    }
    let doubts = evaluated.course().map(|course| course.doubts(evaluated.value));
    doubts.into_iter().flatten().chain(check).for_each(|doubt| warn(&doubt));
    let rows = || objective.parameters().iter().zip(&gradient);
    match args.json {
        true => print_json(args, &evaluated, rows()),
        false => print_table(args, &evaluated, rows()),
    }
    if let Some(file) = &file {
        let frame = frame(&objective, &evaluated, rows());
        let bytes = vtu::encode(&frame, Compression::default())?;
        file.write(|writer| writer.write_all(&bytes)).map_err(Error::from)?;
    }
    Ok(())
}

/// Prints J, and a row for every parameter.
fn print_table<'a>(
    args: &GradientArgs,
    evaluated: &Evaluated,
    rows: impl Iterator<Item = (&'a Parameter, &'a Vec<f64>)>,
) {
    let value = evaluated.value;
    let times = match evaluated.course() {
        Some(course) => course.times().collect(),
        None => vec![evaluated.state().time],
    };
    let times: Vec<_> = times.iter().map(f64::to_string).collect();
    let summed = if times.len() > 1 { ", summed" } else { "" };
    say!("J = {} = {value:.9e} at t = {}{summed}", args.measure.join(" + "), times.join(", "));
    if let Some(course) = evaluated.course() {
        let run = course.of_run().map(|run| format!("; J of the run: {run:.9e}"));
        say!("replayed with {} steps{}", course.steps(), run.unwrap_or_default());
    }
    say!("{:<40} {:>14} {:>16} {:>12}", "parameter", "value", "dJ/dp", "p/J dJ/dp");
    for (parameter, slopes) in rows {
        let sum: f64 = slopes.iter().sum();
        match parameter.is_field() {
            false => {
                let at = parameter.value[0];
                say!("{:<40} {at:>14.6e} {sum:>16.8e} {:>12.4}", parameter.key, at * sum / value);
            }
            true => {
                let least = slopes.iter().copied().fold(f64::INFINITY, f64::min);
                let most = slopes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let title = format!("{} (map)", parameter.key);
                say!("{title:<40} {:>14} {sum:>16.8e}   {least:.3e} to {most:.3e} a vertex", "");
            }
        }
    }
}

fn print_json<'a>(
    args: &GradientArgs,
    evaluated: &Evaluated,
    rows: impl Iterator<Item = (&'a Parameter, &'a Vec<f64>)>,
) {
    let row = |(parameter, slopes): (&Parameter, &Vec<f64>)| {
        let sum: f64 = slopes.iter().sum();
        match parameter.is_field() {
            false => {
                json!({ "key": parameter.key, "value": parameter.value[0], "derivative": sum })
            }
            true => json!({ "key": parameter.key, "vertices": slopes.len(), "sum": sum }),
        }
    };
    let course = evaluated
        .course()
        .map(|course| json!({ "steps": course.steps(), "value_of_run": course.of_run() }));
    let all = json!({
        "measure": args.measure,
        "value": evaluated.value,
        "time": evaluated.state().time,
        "negative_modes": evaluated.negative_modes(),
        "replay": course,
        "parameters": rows.map(row).collect::<Vec<_>>(),
    });
    say!("{all:#}");
}

/// The shape with a field for every map.
fn frame<'a>(
    objective: &'a Objective,
    evaluated: &'a Evaluated,
    rows: impl Iterator<Item = (&'a Parameter, &'a Vec<f64>)>,
) -> Frame<'a> {
    let areas = objective.rest_areas();
    let per_area = |slopes: &[f64]| -> Vec<f64> {
        slopes.iter().zip(&areas).map(|(slope, area)| slope / area).collect()
    };
    let mut point = Vec::new();
    for (parameter, slopes) in rows.filter(|(parameter, _)| parameter.is_field()) {
        point.push(Field::scalar(parameter.key.clone(), parameter.value.clone()));
        point.push(Field::scalar(format!("dJ/d({}) [per area]", parameter.key), per_area(slopes)));
    }
    Frame {
        time: evaluated.state().time,
        step: evaluated.state().step,
        points: &evaluated.state().x,
        triangles: objective.sheet().triangles(),
        point,
        cell: Vec::new(),
        field_data: Vec::new(),
    }
}
