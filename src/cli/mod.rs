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
mod follow;
mod inspect;
pub mod mesh;
mod new;
mod paraview;
mod picture;
mod plugin;
mod rank_job;
mod ranks;
mod resume;
mod run;
mod schema;
mod sweep;
mod view;

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use clap::{Args, Parser, Subcommand};

use crate::kinetics::PluginSearch;
use crate::output::{OutputError, interrupt};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::{Error, Result};

/// Thin elastic sheets whose shape and chemistry drive one another.
#[derive(Debug, Parser)]
#[command(name = "rumple", version, about, propagate_version = true)]
struct Cli {
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
    /// Say what accuracy costs: a scene by several integrators and tolerances, against references.
    Accuracy(Box<accuracy::AccuracyArgs>),
    /// Generate, check and describe meshes.
    Mesh(mesh::MeshArgs),
    /// Write, list, describe, validate and time kinetics plugins.
    Plugin(plugin::PluginArgs),
    /// Print the JSON Schema of scenes: editors complete keys and mark mistakes by it.
    Schema(schema::SchemaArgs),
    /// Print completions for a shell.
    Completions(completions::CompletionArgs),
    /// Write pages for `man`.
    Man(completions::ManArgs),
}

/// Bytes of stack of a thread: what the main one has elsewhere.
const STACK_BYTES: usize = 8 << 20;

/// What every command that takes a scene takes.
#[derive(Debug, Clone, Args)]
struct SceneArgs {
    /// The scene file.
    scene: PathBuf,
    /// Override a key of the scene, as in `--set time.until=100`; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Directory to look for plugins in, before RUMPLE_PLUGIN_PATH and the program's own
    /// directory; may be repeated.
    #[arg(long = "plugin-path", value_name = "DIR")]
    plugin_path: Vec<PathBuf>,
    /// Threads to compute with; all cores by default, for a member of a sweep 1. Results do not depend on
    /// it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl SceneArgs {
    /// Sets up the threads.
    fn set_threads(&self) {
        set_threads(self.threads);
    }

    /// Sets up the threads and does `work` on one of them: parallel loops begin there at once, where another
    /// thread would have to wake them and to wait.
    fn with_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.set_threads();
        rayon::scope(|_| work())
    }

    /// The same options word by word, but for the scene: as a job needs them that runs elsewhere.
    fn words(&self) -> Result<Vec<String>> {
        let mut words: Vec<String> = Vec::new();
        self.overrides.iter().for_each(|set| words.extend(["--set".to_owned(), set.clone()]));
        words.extend(self.words_of_plugins()?);
        Ok(words)
    }

    /// Those of them that a resumed run takes as well.
    fn words_of_plugins(&self) -> Result<Vec<String>> {
        let mut words = Vec::new();
        for path in &self.plugin_path {
            let path = absolute(path)?.to_string_lossy().into_owned();
            words.extend(["--plugin-path".to_owned(), path]);
        }
        if let Some(threads) = self.threads {
            words.extend(["--threads".to_owned(), threads.to_string()]);
        }
        Ok(words)
    }

    /// Sets up the threads and reads the scene.
    fn load(&self) -> Result<(Scene, PluginSearch)> {
        self.set_threads();
        let scene = Scene::load(&self.scene, &self.overrides)?;
        Ok((scene, PluginSearch::from_environment(&self.plugin_path)))
    }
}

/// Sets up the threads, as many as there are cores if no number is given.
fn set_threads(threads: Option<u16>) {
    // Only fails if a pool exists already, which then serves as well.
    let threads = threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
    let _ = pool.build_global();
}

/// A path that does not depend on the working directory.
fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path)
        .map_err(|source| OutputError::Read { path: path.to_owned(), source }.into())
}

/// Runs the command line and returns the exit code: 0 done, 2 bad input, 128 and the number of a
/// signal that ended a run, 1 anything else.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match &cli.command {
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
        Command::Accuracy(args) => accuracy::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Plugin(args) => plugin::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::completions(args),
        Command::Man(args) => completions::man(args),
    };
    let (code, text) = match result {
        Ok(()) => (0, String::new()),
        // The command has reported it.
        Err(Error::Solve(SolveError::Interrupted)) => (interrupt::exit_status(), String::new()),
        Err(Error::Elsewhere) => (1, String::new()),
        Err(error) => {
            let text = match &error {
                Error::Scene(scene) => {
                    // https://no-color.org
                    let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
                    scene.rendered(std::io::stderr().is_terminal() && !plain)
                }
                other => format!("error: {other}"),
            };
            (exit_code(&error), text)
        }
    };
    ranks::end(code, &text)
}

/// Progress message on standard error, while this value lives.
struct Waiting {
    /// Whose end is seen.
    _end: Option<mpsc::Sender<()>>,
}

impl Waiting {
    /// Nothing is said in the first seconds, nor ever where `silent`.
    fn on(what: &'static str, silent: bool) -> Self {
        const WARNING_INTERVAL: Duration = Duration::from_secs(4);
        let (end, ended) = mpsc::channel();
        let watch = move || {
            let began = Instant::now();
            while ended.recv_timeout(WARNING_INTERVAL) == Err(mpsc::RecvTimeoutError::Timeout) {
                warn(&format!("{what}, for {:.0} s so far", began.elapsed().as_secs_f64()));
            }
        };
        // Without a thread, no message.
        let told = !silent && thread::Builder::new().spawn(watch).is_ok();
        Self { _end: told.then_some(end) }
    }
}

/// A number of the command line that is finite.
fn finite(text: &str) -> std::result::Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "is not a number".to_owned())?;
    number.is_finite().then_some(number).ok_or_else(|| "is not finite".to_owned())
}

/// Prints a line on standard error, whether anybody reads it or not.
fn warn(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text.trim_end());
}

fn exit_code(error: &Error) -> u8 {
    match error {
        Error::Scene(_)
        | Error::Sheet(_)
        | Error::Kinetics(_)
        | Error::Output(_)
        | Error::Refused(_)
        | Error::Solve(SolveError::Start { .. } | SolveError::NotFollowed { .. }) => 2,
        Error::Solve(_)
        | Error::Broken(_)
        | Error::Stopped(_)
        | Error::Incomplete(_)
        | Error::Elsewhere => 1,
    }
}
