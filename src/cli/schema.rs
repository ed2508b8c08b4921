//! `rumple schema`: the JSON Schema of scenes, for editors.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;

use crate::Result;
use crate::output::{Inputs, ResultFile};
use crate::scene;

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub(super) struct SchemaArgs {
    /// File to write; standard output with `-`.
    #[arg(short, long, value_name = "FILE|-", default_value = "-")]
    out: PathBuf,
    /// Replace that file if it exists.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &SchemaArgs) -> Result<()> {
    Ok(ResultFile::new(&args.out, args.force, &Inputs::default())?.write(write)?)
}

/// Writes the schema.
pub(super) fn write(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{:#}", scene::schema())
}
