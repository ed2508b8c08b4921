//! `rumple picture DIR` and `rumple movie DIR`: results as they are shown in a talk.

use std::path::PathBuf;

use clap::Args;

use super::{Waiting, finite};
use crate::num::{Short, plural};
use crate::run::Result;
use crate::view::picture::{self, ColourRange, DrawingOptions, View};

/// How sheets are drawn.
#[derive(Debug, Args)]
struct DrawingArgs {
    /// The directory that run, sweep, compare or accuracy wrote.
    directory: PathBuf,
    /// The field that colours the sheet, with or without its unit: `c`, `mean curvature`, `velocity, magnitude`; by default
    /// the first one.
    #[arg(long, value_name = "NAME")]
    field: Option<String>,
    /// The range of the colours: `all` frames, each `frame`, or `LEAST,LARGEST`.
    #[arg(long, value_name = "RANGE", default_value = "all", value_parser = range, allow_hyphen_values = true)]
    range: ColourRange,
    /// The colour map: `viridis`, `cividis` or `coolwarm`.
    #[arg(long, default_value = "viridis")]
    map: String,
    /// From where: `oblique`, `top`, `front`, `side`, or azimuth and elevation in degrees, `-50,35`.
    #[arg(long, value_name = "VIEW", default_value = "oblique", value_parser = view, allow_hyphen_values = true)]
    view: View,
    /// How near.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = finite, allow_hyphen_values = true)]
    zoom: f64,
    /// Pixels of the picture of a sheet, without title and colour bar, at 96 an inch.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1200x800", value_parser = size)]
    size: Size,
    /// Pixels an inch: with 300 the picture has 300/96 times as many pixels and the same size on paper.
    #[arg(long, value_name = "N", default_value_t = 96.0, value_parser = finite, allow_hyphen_values = true)]
    dpi: f64,
    /// Text above the picture.
    #[arg(long, default_value = "")]
    title: String,
    /// Draw the edges of the mesh.
    #[arg(long)]
    edges: bool,
    /// Do not shade the sheet.
    #[arg(long)]
    flat: bool,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
}

impl DrawingArgs {
    fn drawing(&self) -> DrawingOptions {
        let [browser, ffmpeg] = super::defaults().programs();
        DrawingOptions {
            field: self.field.clone(),
            range: self.range,
            map: self.map.clone(),
            view: self.view.clone(),
            zoom: self.zoom,
            size: self.size.0,
            dpi: self.dpi,
            title: self.title.clone(),
            edges: self.edges,
            light: !self.flat,
            browser,
            ffmpeg,
        }
    }
}

/// Arguments of `picture`.
#[derive(Debug, Args)]
pub(super) struct PictureArgs {
    #[command(flatten)]
    drawing: DrawingArgs,
    /// The PNG file; by default picture.png in the directory.
    #[arg(short, long = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// The time of the frame, the nearest one is drawn; by default the last.
    #[arg(long, value_name = "TIME", value_parser = finite, allow_hyphen_values = true)]
    time: Option<f64>,
}

/// Arguments of `movie`.
#[derive(Debug, Args)]
pub(super) struct MovieArgs {
    #[command(flatten)]
    drawing: DrawingArgs,
    /// The file, .gif, .mp4 or .webm; by default movie.gif in the directory. MP4 and WebM need ffmpeg.
    #[arg(short, long = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Frames a second.
    #[arg(long, value_name = "RATE", default_value_t = 8.0, value_parser = finite, allow_hyphen_values = true)]
    rate: f64,
    /// Most frames, the first and the last always among them.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u16).range(2..))]
    frames: u16,
}

pub(super) fn picture(args: &PictureArgs) -> Result<()> {
    let root = &args.drawing.directory;
    let path = args.out.clone().unwrap_or_else(|| root.join("picture.png"));
    let _waiting = Waiting::on("a browser draws", false);
    let files = (root.as_path(), path.as_path(), args.drawing.force);
    let time = picture::picture(files, &args.drawing.drawing(), args.time)?;
    let other = args.time.filter(|wanted| *wanted != time);
    let nearest = other.map(|wanted| format!(", that of the frame nearest to {}", Short(wanted)));
    say!("{}: time {}{}", path.display(), Short(time), nearest.unwrap_or_default());
    Ok(())
}

pub(super) fn movie(args: &MovieArgs) -> Result<()> {
    let root = &args.drawing.directory;
    let path = args.out.clone().unwrap_or_else(|| root.join("movie.gif"));
    let _waiting = Waiting::on("a browser draws", false);
    let files = (root.as_path(), path.as_path(), args.drawing.force);
    let frames = picture::movie(files, &args.drawing.drawing(), (args.frames.into(), args.rate))?;
    say!("{}: {}", path.display(), plural(frames, "frame", "frames"));
    Ok(())
}

/// Two numbers with something between them.
fn pair(text: &str, between: char) -> Option<[f64; 2]> {
    let (first, second) = text.split_once(between)?;
    Some([finite(first.trim()).ok()?, finite(second.trim()).ok()?])
}

fn range(text: &str) -> Result<ColourRange, String> {
    match text {
        "all" => Ok(ColourRange::All),
        "frame" => Ok(ColourRange::Frame),
        _ => pair(text, ',').map(ColourRange::Fixed).ok_or_else(|| {
            "expected `all`, `frame`, or the least and the largest value, as 0,2.5".to_owned()
        }),
    }
}

fn view(text: &str) -> Result<View, String> {
    Ok(pair(text, ',').map_or_else(|| View::Named(text.to_owned()), View::Angles))
}

/// Width and height.
#[derive(Debug, Clone, Copy)]
struct Size([u32; 2]);

fn size(text: &str) -> Result<Size, String> {
    let sizes = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sizes.map(Size).ok_or_else(|| "expected width and height, as 1200x800".to_owned())
}
