//! Commands: each parses its arguments, calls the library and prints.

/// Prints a line on standard output. A closed pipe, as in `rumple check … | head`, is not
/// an error.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

mod accuracy;
mod check;
mod compare;
mod completions;
mod explain;
mod findings;
mod fit;
mod follow;
mod gradient;
mod inspect;
pub mod mesh;
mod messages;
mod new;
mod paraview;
mod picture;
mod plugin;
mod ranks;
mod resume;
mod retired;
mod run;
mod scene_args;
mod schema;
mod sweep;
mod user;
mod view;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{ColorChoice, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::Error;
use crate::output::interrupt;
use crate::solve::SolveError;
use findings::Findings;
use messages::{Waiting, warn};
use scene_args::{SceneArgs, absolute, finite, set_threads};
use user::defaults;

/// Thin elastic sheets whose shape and chemistry drive one another.
#[derive(Debug, Parser)]
#[command(name = "rumple", version = crate::VERSION, about, propagate_version = true)]
struct Cli {
    /// Colours in messages: `auto` on a terminal, unless NO_COLOR is set.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    color: ColorChoice,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented scene to begin with.
    New(new::NewArgs),
    /// Run a scene and write frames for ParaView, a ledger and the resolved scene.
    Run(run::RunArgs),
    /// Resume a run that was interrupted or killed, from its last checkpoint.
    Resume(resume::ResumeArgs),
    /// Check a scene without running it and say what it calls for.
    Check(check::CheckArgs),
    /// Run a scene under several policies and integrators and compare them.
    Compare(compare::CompareArgs),
    /// Say what a scene calls for and why; given the directory of a run, what it cost, part by part.
    Explain(explain::ExplainArgs),
    /// Write a viewer of results in one HTML file: the sheet in 3D, ledger, scene, costs.
    View(view::ViewArgs),
    /// Draw a state of results: a PNG, by a browser without a window.
    Picture(Box<picture::PictureArgs>),
    /// Draw all frames of results: an animated GIF, MP4 or WebM.
    Movie(Box<picture::MovieArgs>),
    /// Write a Python macro that opens a run in ParaView, coloured and with the camera set.
    Paraview(paraview::ParaviewArgs),
    /// Evaluate one state: energies, forces, curvatures, signals, rates.
    Inspect(inspect::InspectArgs),
    /// Run a scene over lists and ranges of its keys: tables and plots.
    Sweep(Box<sweep::SweepArgs>),
    /// Follow a branch of equilibria along a key of a scene, through folds: table, frames, diagram.
    Follow(Box<follow::FollowArgs>),
    /// Differentiate an equilibrium by parameters of its scene: numbers, and fields as maps.
    Gradient(Box<gradient::GradientArgs>),
    /// Fit parameters of a scene to data: values with standard errors, and what the data do not determine.
    Fit(Box<fit::FitArgs>),
    /// Say what accuracy costs: a scene by several integrators and tolerances, against references.
    Accuracy(Box<accuracy::AccuracyArgs>),
    /// Generate, check and describe meshes.
    Mesh(mesh::MeshArgs),
    /// Write, list, describe and validate kinetics plugins.
    Plugin(plugin::PluginArgs),
    /// Print the JSON Schema of scenes: editors complete keys and mark mistakes by it.
    Schema(schema::SchemaArgs),
    /// Print completions for a shell.
    Completions(completions::CompletionArgs),
    /// Write pages for `man`.
    Man(completions::ManArgs),
}

/// Runs the command line and returns the exit code: 0 done, 2 bad input, 128 and the number of a
/// signal that ended a run, 1 anything else.
#[must_use]
pub fn main() -> ExitCode {
    let Some(cli) = parsed() else { return ExitCode::from(2) };
    let (code, text) = match user::load().and_then(|()| run_command(&cli.command)) {
        Ok(()) => (0, String::new()),
        // The command has reported it.
        Err(Error::Solve(SolveError::Interrupted)) => (interrupt::exit_status(), String::new()),
        Err(Error::Elsewhere) => (1, String::new()),
        Err(error) => {
            let text = match &error {
                Error::Scene(scene) => scene.rendered(colours(cli.color)),
                other => error_line(other, colours(cli.color)),
            };
            (exit_code(&error), text)
        }
    };
    ranks::end(code, &text)
}

fn run_command(command: &Command) -> crate::Result<()> {
    match command {
        Command::New(args) => new::run(args),
        Command::Run(args) => run::run(args),
        Command::Resume(args) => resume::run(args),
        Command::Check(args) => check::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Explain(args) => explain::run(args),
        Command::View(args) => view::run(args),
        Command::Picture(args) => picture::picture(args),
        Command::Movie(args) => picture::movie(args),
        Command::Paraview(args) => paraview::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Sweep(args) => sweep::run(args),
        Command::Follow(args) => follow::run(args),
        Command::Gradient(args) => gradient::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Accuracy(args) => accuracy::run(args, &Cli::command()),
        Command::Mesh(args) => mesh::run(args),
        Command::Plugin(args) => plugin::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::completions(args, Cli::command()),
        Command::Man(args) => completions::man(args, Cli::command()),
    }
}

/// The command line; none where it has what is retired, with a message.
fn parsed() -> Option<Cli> {
    let given: Vec<String> =
        std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    let choice = colour_choice(&given);
    let parsed = Cli::command().color(choice).try_get_matches_from(std::env::args_os());
    let error = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => return Some(cli),
        Err(error) => error,
    };
    // Help and the version are no errors.
    let instead = retired::find(&given).filter(|_| error.use_stderr());
    let Some((word, instead)) = instead else { error.exit() };
    warn(&error_line(format!("`{word}` is gone: {instead}"), colours(choice)));
    None
}

/// The value of `--color` in a command line that may have mistakes.
fn colour_choice(given: &[String]) -> ColorChoice {
    let mut pairs = given.iter().zip(given.iter().skip(1));
    let apart = pairs.find(|(option, _)| *option == "--color").map(|(_, value)| value.as_str());
    let value = apart.or_else(|| given.iter().find_map(|word| word.strip_prefix("--color=")));
    value.and_then(|value| ColorChoice::from_str(value, false).ok()).unwrap_or_default()
}

/// Whether messages have colours.
fn colours(choice: ColorChoice) -> bool {
    match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        // https://no-color.org
        ColorChoice::Auto => {
            let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
            std::io::stderr().is_terminal() && !plain && !defaults().plain()
        }
    }
}

/// A message that begins with `error:`.
fn error_line(message: impl std::fmt::Display, colours: bool) -> String {
    let error = if colours { "\x1b[1;31merror:\x1b[0m" } else { "error:" };
    format!("{error} {message}")
}

fn exit_code(error: &Error) -> u8 {
    match error {
        Error::Scene(_)
        | Error::Sheet(_)
        | Error::Kinetics(_)
        | Error::Output(_)
        | Error::Refused(_)
        | Error::Solve(
            SolveError::Start { .. }
            | SolveError::NotFollowed { .. }
            | SolveError::NotDifferentiable { .. },
        ) => 2,
        Error::Solve(_)
        | Error::Broken(_)
        | Error::Stopped(_)
        | Error::Incomplete(_)
        | Error::Elsewhere => 1,
    }
}
