//! `rumple fit SCENE DATA.csv --with KEY=LOW:HIGH`: parameters of a scene from data.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use super::{SceneArgs, warn};
use crate::output::{Claim, Interrupt, OutputError, atomic};
use crate::run::{Error, Result, provenance};
use crate::solve::{Control, SolveError};
use crate::study::directory::{names, refuse};
use crate::study::fit::{Bounded, Data, Direction, Fit, FitRequest, Fitted};
use crate::study::gradient::SceneSource;

/// Arguments of `fit`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FitArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Comma-separated values with a head. Columns: t; measures, as mean(uz); with x and y (and z), formulas of species and displacements at these
    /// places of the sheet at rest, as c; `sigma COLUMN`, the standard errors of a column.
    #[arg(value_name = "DATA")]
    data: PathBuf,
    /// A number of the scene, as `--set` names it, with its bounds; may be repeated.
    #[arg(long, value_name = "KEY[=LOW:HIGH]", required = true)]
    with: Vec<Bounded>,
    /// Data without times are those of the equilibrium that the scene begins with, rather than of that at its end.
    #[arg(long)]
    at_start: bool,
    /// Starts: the values of the scene, and others at random within the bounds.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    starts: u16,
    /// Directory for the results; SCENE-fit if not given. The same command continues an interrupted fit.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Remove the results of another fit in the directory.
    #[arg(long)]
    force: bool,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Print no progress.
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Examples:
  rumple fit spots.toml growth.csv --with kinetics.parameters.w=0.1:10 --with effect.diffusion.coefficient=0:5
  rumple fit plate.toml heights.csv --with material.young=1e3:1e5 --starts 4

The sum of squares is minimised by the method of Levenberg and Marquardt. Without standard errors every column is weighed by its spread, and the
errors of the parameters follow from the residuals. A parameter that the data do not determine is said.";

/// What a directory of a fit holds.
const REQUEST: &str = "request.json";
const RECORD: &str = "evaluations.jsonl";
const RESULT: &str = "fit.json";
const TABLE: &str = "fitted.csv";

pub(super) fn run(args: &FitArgs) -> Result<()> {
    args.scene.with_threads(|| run_in_pool(args))
}

fn run_in_pool(args: &FitArgs) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    let data = Data::read(&args.data)?;
    let root = args.out.clone().unwrap_or_else(|| {
        let stem = args.scene.scene.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("{stem}-fit"))
    });
    let mut inputs = provenance::inputs(&scene, &[]);
    inputs.add("the data", &args.data);
    inputs.outside(&root)?;
    let about = serde_json::json!({
        "scene": scene.resolved()?,
        "data": fs::read_to_string(&args.data).map_err(OutputError::read(&args.data))?,
        "with": args.with.iter().map(|p| format!("{p:?}")).collect::<Vec<_>>(),
        "starts": args.starts,
        "at_start": args.at_start,
        "version": crate::VERSION,
    });
    let interrupt = Interrupt::install()?;
    let control = Control::new(move || interrupt.requested(), |_| ());
    let request = FitRequest {
        scene: SceneSource::File(args.scene.scene.clone()),
        set: args.scene.overrides.clone(),
        parameters: args.with.clone(),
        data,
        at_start: args.at_start,
        starts: args.starts,
    };
    let fit = Fit::new(request, search, control)?;
    let (_claim, continues) = prepare(&root, &about.to_string(), args.force)?;
    if continues {
        warn(&format!("continues the fit in {}", root.display()));
    }
    let quiet = args.quiet;
    let told = Box::new(move |text: &str| {
        if !quiet {
            warn(text);
        }
    });
    let fitted = fit.run(&root.join(RECORD), told).inspect_err(|error| {
        if matches!(error, Error::Solve(SolveError::Interrupted)) {
            warn("interrupted: the same command continues");
        }
    })?;
    let text = serde_json::to_string_pretty(&fitted).unwrap_or_default();
    atomic::replace(&root.join(RESULT), |writer| writeln!(writer, "{text}"))?;
    atomic::replace(&root.join(TABLE), |writer| table(&fitted, writer))?;
    fitted.doubts.iter().for_each(|doubt| warn(doubt));
    match args.json {
        true => say!("{text}"),
        false => print(&fitted, args, &root),
    }
    Ok(())
}

/// The directory `root` of the fit `about`; whether it was begun before.
fn prepare(root: &Path, about: &str, force: bool) -> Result<(Claim, bool)> {
    let found = names(root)?;
    let own = [REQUEST, RECORD, RESULT, TABLE, Claim::LOCK];
    if let Some(other) = found.iter().find(|name| !own.contains(&name.as_str())) {
        return refuse(
            root,
            format!("holds {other}, which no fit wrote: choose another with --out"),
        );
    }
    fs::create_dir_all(root).map_err(OutputError::write(root))?;
    let claim = Claim::take(root)?;
    let request = root.join(REQUEST);
    let before = fs::read_to_string(&request).ok();
    if before.as_deref() == Some(about) {
        return Ok((claim, true));
    }
    if before.is_some() && !force {
        return refuse(
            root,
            "holds the fit of another scene, other data or other parameters: --force removes it, --out chooses another",
        );
    }
    for name in [RECORD, RESULT, TABLE] {
        match fs::remove_file(root.join(name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(OutputError::write(root)(error).into());
            }
            _ => {}
        }
    }
    atomic::replace(&request, |writer| write!(writer, "{about}"))?;
    Ok((claim, false))
}

/// The data with the values of the model.
fn table(fitted: &Fitted, writer: &mut dyn std::io::Write) -> std::io::Result<()> {
    writeln!(writer, "line,column,value,sigma,model,residual")?;
    for row in &fitted.table {
        let residual = (row.model - row.value) / row.sigma;
        let column = match row.column.contains([',', '"']) {
            true => format!("\"{}\"", row.column.replace('"', "\"\"")),
            false => row.column.clone(),
        };
        let (line, value, sigma, model) = (row.line, row.value, row.sigma, row.model);
        writeln!(writer, "{line},{column},{value},{sigma},{model},{residual}")?;
    }
    Ok(())
}

/// Prints a row for every parameter, and what the data do not determine.
fn print(fitted: &Fitted, args: &FitArgs, root: &Path) {
    say!("{:<40} {:>14} {:>16} {:>14}", "parameter", "start", "value", "standard error");
    let standard = &fitted.uncertainty.standard;
    for (k, key) in fitted.keys.iter().enumerate() {
        let error = match (fitted.at_bound[k], standard[k]) {
            (true, _) => "at its bound".to_owned(),
            (false, Some(error)) => format!("{error:.2e}"),
            (false, None) => "not determined".to_owned(),
        };
        say!("{key:<40} {:>14.6e} {:>16.8e} {error:>14}", fitted.start[k], fitted.values[k]);
    }
    let freedom = fitted.data - fitted.keys.len();
    let unit = if fitted.has_errors { "standard errors" } else { "spreads of the columns" };
    say!(
        "chi^2 = {:.6e} in {unit}: {} values, {freedom} degrees of freedom, {} evaluations",
        fitted.chi_squared,
        fitted.data,
        fitted.evaluations
    );
    if let Some(of_run) = fitted.chi_squared_of_run {
        say!("chi^2 of the run itself: {of_run:.6e}");
    }
    if fitted.starts.len() > 1 {
        let ends = fitted.starts.iter().map(|chi| match chi {
            Some(chi) => format!("{chi:.4e}"),
            None => "failed".to_owned(),
        });
        say!("chi^2 of the starts: {}", ends.collect::<Vec<_>>().join(", "));
    }
    let sloppy = |direction: &&Direction| direction.is_sloppy();
    for direction in fitted.uncertainty.directions.iter().filter(sloppy) {
        say!("not determined by the data: {}", product(&fitted.keys, direction));
    }
    let set = |(key, value): (&String, &f64)| format!("--set {key}={value:?}");
    let set: Vec<String> = fitted.keys.iter().zip(&fitted.values).map(set).collect();
    say!("run it: rumple run {} {}", args.scene.scene.display(), set.join(" "));
    say!("results: {}", root.display());
}

/// A direction as a product of powers of parameters, with its error.
fn product(keys: &[String], direction: &Direction) -> String {
    /// Smaller shares are left out.
    const SHOWN: f64 = 0.1;
    let shown = keys.iter().zip(&direction.components).filter(|(_, share)| share.abs() >= SHOWN);
    let factors: Vec<String> = shown.map(|(key, share)| format!("{key}^{share:.2}")).collect();
    let error = match direction.error {
        Some(error) => format!("relative error {error:.1e}"),
        None => "no value depends on it".to_owned(),
    };
    format!("{} ({error})", factors.join(" * "))
}
