//! `rumple plugin …`: from an idea to a law that a scene can name.

mod describe;
mod law_args;
mod new;
mod validate;

use clap::{Args, Subcommand};

use crate::Result;
use law_args::{LawArgs, LawSource, SearchArgs};

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
    List(describe::ListArgs),
    /// Describe what a plugin, or the law of a scene, reads and provides.
    Describe(describe::DescribeArgs),
    /// Look for faults: bad numbers, wrong derivatives, hidden state, …
    Validate(validate::ValidateArgs),
}

pub(super) fn run(args: &PluginArgs) -> Result<()> {
    match &args.command {
        Command::New(args) => new::run(args),
        Command::List(args) => describe::list(args),
        Command::Describe(args) => describe::run(args),
        Command::Validate(args) => validate::run(args),
    }
}
