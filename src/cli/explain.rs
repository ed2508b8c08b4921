//! `rumple explain DIR`: what a run cost.

use std::path::PathBuf;

use clap::Args;

use crate::run::{Costs, Error, Result};

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// The result directory.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &ExplainArgs) -> Result<()> {
    if args.directory.is_file() {
        let scene = args.directory.display();
        return Err(Error::Refused(format!(
            "{scene}: `rumple check {scene}` lists what a scene calls for; \
             `rumple explain DIR` shows what a run cost"
        )));
    }
    let costs = Costs::read(&args.directory)?;
    match args.json {
        true => say!("{}", serde_json::to_string_pretty(&costs).unwrap_or_default()),
        false => say!("{}", costs.to_string().trim_end()),
    }
    Ok(())
}
