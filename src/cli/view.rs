//! `rumple view DIR`: a viewer of results in one HTML file.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::num::real;
use crate::output::{Inputs, ResultDirectory, ResultFile};
use crate::run::{Error, Result};
use crate::study::plan::Plan;
use crate::view::{self, Options};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// The directory that run, sweep, compare or accuracy wrote.
    directory: PathBuf,
    /// The HTML file, `-` for standard output; by default report.html in the directory.
    #[arg(short, long = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Most frames of a run, the first and the last always among them.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u16).range(2..))]
    frames: u16,
    /// Most size of the file, MB.
    #[arg(long, value_name = "MB", default_value_t = 20.0, value_parser = megabytes)]
    size_limit: f64,
    /// Show a run in progress: serve the page on this port of the loopback address, a free one if none is given, and load it
    /// again as frames are written.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0", conflicts_with_all = ["out", "force"])]
    watch: Option<u16>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &ViewArgs) -> Result<()> {
    let root = &args.directory;
    if !root.is_dir() {
        let message = "no such directory; expected one that run, sweep, compare or accuracy wrote";
        return Err(Error::Refused(format!("{}: {message}", root.display())));
    }
    let bytes = crate::num::whole(1e6 * args.size_limit);
    let options = Options { frames: args.frames.into(), bytes };
    if let Some(port) = args.watch {
        return view::watch::serve(root, options, port, |address| {
            say!("{address} shows {}; Ctrl-C ends", root.display());
        });
    }
    let path = args.out.clone().unwrap_or_else(|| root.join(ResultDirectory::REPORT));
    let file = ResultFile::new(&path, args.force, &Inputs::default())?;
    let page = view::page(root, options)?;
    file.write(|writer| writer.write_all(page.html.as_bytes()))?;
    page.warnings.iter().for_each(|warning| super::warn(&format!("warning: {warning}")));
    if file != ResultFile::StandardOutput {
        let (size, path) = (real(page.html.len()) / 1e6, path.display());
        say!(
            "{path}: {} of {} frames, {size:.1} MB; open it in a browser",
            page.shown,
            page.total_frames
        );
    }
    Ok(())
}

/// A size in megabytes, above 0.
fn megabytes(text: &str) -> Result<f64, String> {
    let size = text.parse().ok().filter(|size| (1e-3..1e6).contains(size));
    size.ok_or_else(|| format!("{text:?} is not a size in MB from 0.001 to 1000000"))
}

/// Writes the page beside the results of a run or study, if that is `wanted`; its path. The results are complete without
/// it: a failure is a warning.
pub(super) fn write_report(root: &Path, wanted: bool) -> Option<PathBuf> {
    if !wanted {
        return None;
    }
    let warn = |error: Error| {
        super::warn(&format!("warning: no {} is written: {error}", ResultDirectory::REPORT));
    };
    view::write_report(root).map_err(warn).ok()
}

/// Writes the page of a study that was gathered again, unless its scene leaves reports out.
pub(super) fn write_study_report(plan: &Plan, root: &Path) {
    let wanted = plan.scene(0).map_or(true, |scene| scene.output.report);
    write_report(root, wanted);
}
