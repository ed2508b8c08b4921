//! `rumple paraview DIR`: a Python macro that opens the results of a run in ParaView.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::output::{Inputs, ResultDirectory, ResultFile};
use crate::run::{Error, Result};
use crate::sheet::read;
use crate::view;

/// Arguments of `paraview`.
#[derive(Debug, Args)]
pub(super) struct ParaviewArgs {
    /// The directory of a run.
    directory: PathBuf,
    /// The array that colours the sheet, with or without its unit; by default the first one of the frames.
    #[arg(long, value_name = "NAME")]
    array: Option<String>,
    /// Replace an existing macro.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &ParaviewArgs) -> Result<()> {
    let root = &args.directory;
    let refuse = |what: String| Error::Refused(format!("{}: {what}", root.display()));
    let frames = view::frames(root)?;
    let (_, last) = frames.last().ok_or_else(|| {
        refuse("has no frames; expected the directory of a run (of a sweep, the directory of one member)".into())
    })?;
    let path = root.join(ResultDirectory::MACRO);
    let file = ResultFile::new(&path, args.force, &Inputs::default())?;
    let (array, association) = choose(last, args.array.as_deref()).map_err(refuse)?;
    let text = include_str!("paraview/macro.py")
        .replace("@ARRAY@", &json!(array).to_string())
        .replace("@ASSOCIATION@", &json!(association).to_string());
    file.write(|writer| writer.write_all(text.as_bytes()))?;
    say!("paraview --script={}", path.display());
    say!("pvbatch {} PICTURE.png", path.display());
    Ok(())
}

/// The array of this name in `frame`, or the first one that is not a displacement, and the elements it is of as ParaView names them.
fn choose(
    frame: &std::path::Path,
    wanted: Option<&str>,
) -> std::result::Result<(String, &'static str), String> {
    let frame = read::surface(frame).map_err(|error| error.to_string())?;
    let points = frame.point_arrays.iter().map(|array| (&*array.name, "POINTS"));
    let cells = frame.cell_arrays.iter().map(|array| (&*array.name, "CELLS"));
    let all: Vec<(&str, &'static str)> = points.chain(cells).collect();
    let bare = |name: &str| name.split(" [").next().unwrap_or_default().to_owned();
    let found = match wanted {
        None => all.iter().find(|(name, _)| bare(name) != "displacement").or(all.first()),
        Some(wanted) => all.iter().find(|(name, _)| *name == wanted || bare(name) == wanted),
    };
    let (name, association) = found.ok_or_else(|| {
        let names: Vec<String> = all.iter().map(|(name, _)| bare(name)).collect();
        format!("no array \"{}\"; its frames have {}", wanted.unwrap_or_default(), names.join(", "))
    })?;
    Ok(((*name).to_owned(), association))
}
