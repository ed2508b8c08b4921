//! `rumple new`: commented scenes to begin with, from the templates beside this file.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::schema;
use crate::output::{Inputs, ResultFile};
use crate::{Error, Result};

/// Arguments of `new`.
#[derive(Debug, Args)]
pub(super) struct NewArgs {
    /// Name of the scene: the file NAME.toml is written.
    name: PathBuf,
    /// What to begin with.
    #[arg(long = "from", value_enum, value_name = "TEMPLATE", default_value_t = Template::ModelI)]
    template: Template,
    /// Write the JSON Schema of scenes beside it as well, which completes keys and marks mistakes in editors.
    #[arg(long)]
    schema: bool,
    /// Replace files that exist.
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Template {
    /// Model I: curvature feedback on a disc, by a shipped plugin.
    ModelI,
    /// A Turing pattern on a shell that grows, as text.
    Turing,
    /// A plate under pressure: mechanics alone.
    Plate,
    /// A closed shell that loses volume and buckles: mechanics alone.
    Shell,
    /// A law of your own, as text.
    OwnLaw,
}

impl Template {
    const fn text(self) -> &'static str {
        match self {
            Self::ModelI => include_str!("templates/model-i.toml"),
            Self::Turing => include_str!("templates/turing.toml"),
            Self::Plate => include_str!("templates/plate.toml"),
            Self::Shell => include_str!("templates/shell.toml"),
            Self::OwnLaw => include_str!("templates/own-law.toml"),
        }
    }
}

/// Name of the schema beside a scene.
const SCHEMA: &str = "rumple.schema.json";

pub(super) fn run(args: &NewArgs) -> Result<()> {
    let path = scene_path(&args.name)?;
    let file = ResultFile::new(&path, args.force, &Inputs::default())?;
    let mut text = String::new();
    if args.schema {
        let path = path.with_file_name(SCHEMA);
        // An older one of the same program may be replaced.
        ResultFile::new(&path, true, &Inputs::default())?.write(schema::write)?;
        // Read by taplo and the editors that use it.
        text = format!("#:schema ./{SCHEMA}\n");
    }
    text.push_str(args.template.text());
    file.write(|out| out.write_all(text.as_bytes()))?;
    let (scene, results) = (path.display(), path.with_extension(""));
    say!("{scene} is written. Next:");
    say!("  rumple check {scene}");
    say!("  rumple run {scene} --out {}-results", results.display());
    say!("  rumple explain {}-results      # what that cost", results.display());
    Ok(())
}

/// The file of a scene called `name`, which may end with `.toml` already.
fn scene_path(name: &Path) -> Result<PathBuf> {
    let Some(stem) = name.file_name() else {
        let message =
            format!("{:?} is not a name; expected one such as `my-sheet`", name.display());
        return Err(Error::Refused(message));
    };
    if name.extension().is_some_and(|extension| extension == "toml") {
        return Ok(name.to_owned());
    }
    let mut file = stem.to_owned();
    file.push(".toml");
    Ok(name.with_file_name(file))
}
