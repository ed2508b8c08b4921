//! `rumple plugin …`: from an idea to a law that a scene can name.

mod bench;
mod describe;
mod new;
mod validate;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, Subcommand};

use crate::Result;
use crate::kinetics::{Kinetics, Library, PluginSearch};
use crate::run::laws;
use crate::scene::Scene;

pub(super) use describe::describe_field;

/// Arguments of `plugin`.
#[derive(Debug, Args)]
pub(super) struct PluginArgs {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a plugin that builds and runs unchanged: a crate, or a C file with its header.
    New(new::NewArgs),
    /// List the available plugins.
    List(SearchArgs),
    /// Describe what a plugin, or the law of a scene, reads and provides.
    Describe(describe::DescribeArgs),
    /// Look for faults, in a process of its own: bad numbers, wrong derivatives, hidden state, …
    Validate(validate::ValidateArgs),
    /// Time a law, per point.
    Bench(bench::BenchArgs),
}

/// Where to look for plugins.
#[derive(Debug, Args)]
struct SearchArgs {
    /// Directory to look for plugins in, before RUMPLE_PLUGIN_PATH and the program's own
    /// directory; may be repeated.
    #[arg(long = "plugin-path", value_name = "DIR")]
    plugin_path: Vec<PathBuf>,
}

impl SearchArgs {
    fn search(&self) -> PluginSearch {
        PluginSearch::from_environment(&self.plugin_path)
    }
}

/// A law to inspect.
#[derive(Debug, Args)]
struct LawArgs {
    /// Name of a plugin, path of its library, or a scene (.toml), whose laws are taken.
    law: String,
    #[command(flatten)]
    search: SearchArgs,
}

/// Where a law comes from: a library, or a scene with its plugins and formulas.
enum LawSource {
    Library(Arc<Library>),
    Scene {
        kinetics: Arc<dyn Kinetics>,
        /// Where parameters differ over the sheet: one column a parameter.
        fields: Vec<Vec<f64>>,
    },
}

impl LawArgs {
    fn find(&self) -> Result<LawSource> {
        let search = self.search.search();
        let path = Path::new(&self.law);
        if path.extension().is_some_and(|ending| ending == "toml") {
            let scene = Scene::load(path, &[])?;
            let (laws, fields) = laws::load_with_parameter_fields(&scene, &search)?;
            return Ok(LawSource::Scene { kinetics: laws.kinetics, fields: fields.at_points });
        }
        let file = search.resolve(&self.law, Path::new(""))?;
        Ok(LawSource::Library(Library::load(&file)?))
    }
}

pub(super) fn run(args: &PluginArgs) -> Result<()> {
    match &args.command {
        Command::New(args) => new::run(args),
        Command::List(args) => describe::list(&args.search()),
        Command::Describe(args) => describe::run(args),
        Command::Validate(args) => validate::run(args),
        Command::Bench(args) => bench::run(args),
    }
}
