//! Pictures and movies of results: the page draws them in a browser without a window.
//!
//! ```text
//! page with what is wanted → browser --headless --dump-dom → a PNG a frame → PNG, GIF, or MP4 and WebM by ffmpeg
//! ```

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use gif::{Encoder, EncodingError, Frame, Repeat};
use png::{ColorType, Transformations};
use serde::{Deserialize, Serialize};

use super::programs::{NamedProgram, browser, ffmpeg};
use super::{Options, page, runs};
use crate::num::whole;
use crate::output::{Inputs, ResultFile};
use crate::run::{Error, Result};

/// Pixels an inch of a screen.
const SCREEN_DPI: f64 = 96.0;
/// Most bytes of the page of a picture: what a browser holds.
const MOST_BYTES: usize = 300_000_000;
/// How long the last picture of a GIF stays, 1/100 s.
const LAST: u16 = 150;
/// Speed of the quantisation of colours of a GIF, 1 (best) to 30.
const QUANTISATION: i32 = 10;

/// How sheets are drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DrawingOptions {
    /// The field that colours the sheet, with or without its unit; the first one if none is given.
    pub field: Option<String>,
    /// The range of the colours.
    pub range: ColourRange,
    /// `viridis`, `cividis` or `coolwarm`.
    pub map: String,
    /// From where.
    pub view: View,
    /// How near, 1 for the whole sheet.
    pub zoom: f64,
    /// Width and height of the picture of a sheet, without title and colour bar, pixels at 96 an inch.
    pub size: [u32; 2],
    /// Pixels an inch: the picture has `dpi`/96 times as many as `size`.
    pub dpi: f64,
    /// Text above.
    pub title: String,
    /// Whether edges are drawn.
    pub edges: bool,
    /// Whether the sheet is shaded.
    pub light: bool,
    /// The browser that draws, unless RUMPLE_BROWSER names one.
    #[serde(skip)]
    pub browser: Option<NamedProgram>,
    /// The program that encodes movies, unless RUMPLE_FFMPEG names one.
    #[serde(skip)]
    pub ffmpeg: Option<NamedProgram>,
}

impl Default for DrawingOptions {
    fn default() -> Self {
        Self {
            field: None,
            range: ColourRange::All,
            map: "viridis".to_owned(),
            view: View::Named("oblique".to_owned()),
            zoom: 1.0,
            size: [1200, 800],
            dpi: SCREEN_DPI,
            title: String::new(),
            edges: false,
            light: true,
            browser: None,
            ffmpeg: None,
        }
    }
}

impl DrawingOptions {
    /// That of a JSON object; what it does not have is the default.
    ///
    /// # Errors
    /// [`Error::Refused`] for a key or a value of another kind.
    pub fn from_json(text: &str) -> Result<Self> {
        serde_json::from_str(text).map_err(|error| Error::Refused(error.to_string()))
    }

    /// The same with the size in pixels of the picture.
    ///
    /// # Errors
    /// [`Error::Refused`] for numbers and names that cannot be drawn with.
    fn in_pixels(&self) -> Result<Self> {
        let pixels = |size: u32| whole(f64::from(size) * self.dpi / SCREEN_DPI);
        let size = self.size.map(|size| u32::try_from(pixels(size)).unwrap_or(u32::MAX));
        self.check(size)?;
        Ok(Self { size, ..self.clone() })
    }

    fn check(&self, pixels: [u32; 2]) -> Result<()> {
        let refuse = |what: String| Err(Error::Refused(what));
        let known = |what: &str, name: &str, names: &[&str]| match names.contains(&name) {
            true => Ok(()),
            false => Err(Error::Refused(format!("{what} {name:?}: expected {}", names.join(", ")))),
        };
        known("map", &self.map, &["viridis", "cividis", "coolwarm"])?;
        match &self.view {
            View::Named(name) => known(
                "view",
                name,
                &["oblique", "top", "front", "side", "azimuth and elevation as -50,35"],
            )?,
            View::Angles([azimuth, elevation]) => {
                if !(azimuth.is_finite() && elevation.abs() <= 90.0) {
                    return refuse(
                        "view: expected an azimuth and an elevation from -90 to 90 degrees".into(),
                    );
                }
            }
        }
        if let ColourRange::Fixed([least, largest]) = self.range
            && !(least.is_finite() && largest.is_finite() && least < largest)
        {
            return refuse(format!(
                "range {least},{largest}: expected the least and the largest value"
            ));
        }
        if !(self.dpi > 0.0 && self.dpi.is_finite()) {
            return refuse(format!("dpi {}: expected pixels an inch, a number above 0", self.dpi));
        }
        if !pixels.iter().all(|pixels| (80..=8192).contains(pixels)) {
            return refuse(format!(
                "size {:?} at dpi {}: expected width and height from 80 to 8192 pixels, found {pixels:?}",
                self.size, self.dpi
            ));
        }
        if !(self.zoom > 0.0 && self.zoom <= 100.0) {
            return refuse(format!("zoom {}: expected a factor above 0 and up to 100", self.zoom));
        }
        Ok(())
    }
}

/// The range of colours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourRange {
    /// Over all frames.
    All,
    /// Of each frame.
    Frame,
    /// From the one to the other.
    #[serde(untagged)]
    Fixed([f64; 2]),
}

/// A direction to look from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum View {
    /// `oblique`, `top`, `front` or `side`.
    Named(String),
    /// Azimuth and elevation, degrees.
    Angles([f64; 2]),
}

/// What the page is asked for.
#[derive(Debug, Serialize)]
pub(super) struct Wanted<'a> {
    #[serde(flatten)]
    drawing: &'a DrawingOptions,
    movie: bool,
    time: Option<f64>,
}

/// Draws the results in `root` at the frame nearest to `time`, or the last one, into the PNG file `path`; the time of the
/// frame.
///
/// # Errors
/// As [`super::page`]; [`Error::Refused`] without a browser, for a field that no frame has, and where `path` exists already
/// unless `force`.
pub fn picture(
    (root, path, force): (&Path, &Path, bool),
    drawing: &DrawingOptions,
    time: Option<f64>,
) -> Result<f64> {
    let drawing = &drawing.in_pixels()?;
    extension(path, &["png"])?;
    let file = ResultFile::new(path, force, &Inputs::default())?;
    let frames = u16::MAX.into();
    let wanted = Wanted { drawing, movie: false, time };
    let (time, png) = drawn(root, path, frames, &wanted)?.remove(0);
    file.write(|writer| writer.write_all(&png))?;
    Ok(time)
}

/// Draws at most `frames` frames of the results in `root`, `rate` a second, into the GIF, MP4 or WebM file `path`; how many.
///
/// # Errors
/// As [`picture`]; and [`Error::Refused`] where MP4 or WebM is asked for without ffmpeg.
pub fn movie(
    (root, path, force): (&Path, &Path, bool),
    drawing: &DrawingOptions,
    (frames, rate): (usize, f64),
) -> Result<usize> {
    let drawing = &drawing.in_pixels()?;
    if !(0.1..=60.0).contains(&rate) {
        return Err(Error::Refused(format!(
            "rate {rate}: expected frames a second from 0.1 to 60"
        )));
    }
    let kind = extension(path, &["gif", "mp4", "webm"])?;
    let file = ResultFile::new(path, force, &Inputs::default())?;
    let encoder = (kind != "gif").then(|| ffmpeg(kind, drawing.ffmpeg.as_ref())).transpose()?;
    let wanted = Wanted { drawing, movie: true, time: None };
    let pictures = drawn(root, path, frames, &wanted)?;
    let bytes = match encoder {
        None => gif(&pictures, rate).map_err(|error| refused(path, &error))?,
        Some(program) => encoded(&program, &pictures, rate, (path, kind))?,
    };
    file.write(|writer| writer.write_all(&bytes))?;
    Ok(pictures.len())
}

fn refused(path: &Path, what: &str) -> Error {
    Error::Refused(format!("{}: {what}", path.display()))
}

/// The extension of `path`, one of `known`.
fn extension(path: &Path, known: &[&'static str]) -> Result<&'static str> {
    let given = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    known.iter().copied().find(|known| given.eq_ignore_ascii_case(known)).ok_or_else(|| {
        let known: Vec<_> = known.iter().map(|name| format!(".{name}")).collect();
        refused(path, &format!("expected the name of a file that ends in {}", known.join(", ")))
    })
}

/// Times and PNG files of what is `wanted`, by a browser that works beside the file `out`.
fn drawn(
    root: &Path,
    out: &Path,
    frames: usize,
    wanted: &Wanted<'_>,
) -> Result<Vec<(f64, Vec<u8>)>> {
    let browser = browser(wanted.drawing.browser.as_ref())?;
    let options = Options { frames, bytes: MOST_BYTES };
    let page = page::render(
        root,
        &runs::find(root)?,
        options,
        Some(serde_json::json!({ "pictures": wanted })),
    )?;
    if page.runs == 0 {
        return Err(refused(root, "has no frames"));
    }
    // Browsers in a sandbox of their own see neither /tmp nor hidden folders.
    let beside = std::path::absolute(out).ok().and_then(|path| path.parent().map(Path::to_owned));
    let beside = beside.unwrap_or_else(env::temp_dir);
    let failed = |error: std::io::Error| refused(&beside, &error.to_string());
    let folder = tempfile::Builder::new().prefix("rumple-picture-").tempdir_in(&beside);
    let folder = folder.map_err(failed)?;
    let output = dumped(&browser, folder.path(), &page.html)?;
    let text = String::from_utf8_lossy(&output.stdout);
    let answer =
        text.split("<pre id=\"pictures\">").nth(1).and_then(|rest| rest.split("</pre>").next());
    let Some(answer) = answer else {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or("it says nothing");
        return Err(refused(&browser, &format!("drew nothing ({}): {last}", output.status)));
    };
    if let Some(error) = answer.strip_prefix("error: ") {
        let plain = error.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
        return Err(refused(root, &plain));
    }
    let line = |line: &str| {
        let (time, url) = line.split_once(' ')?;
        let png = BASE64_STANDARD.decode(url.strip_prefix("data:image/png;base64,")?).ok()?;
        Some((time.parse().ok()?, png))
    };
    let all: Option<Vec<_>> = answer.lines().map(line).collect();
    all.filter(|all| !all.is_empty())
        .ok_or_else(|| refused(&browser, "drew a picture that is cut off"))
}

/// What the browser prints of a page in `folder` once its script has run.
fn dumped(browser: &Path, folder: &Path, html: &str) -> Result<Output> {
    let file = folder.join("page.html");
    fs::write(&file, html).map_err(|error| refused(folder, &error.to_string()))?;
    let mut command = Command::new(browser);
    command.args([
        "--headless",
        "--disable-dev-shm-usage",
        "--no-first-run",
        "--use-angle=swiftshader",
    ]);
    command.args(["--enable-unsafe-swiftshader", "--dump-dom"]);
    // Chromium's sandbox refuses to run as root.
    #[cfg(unix)]
    if rustix::process::geteuid().is_root() {
        command.arg("--no-sandbox");
    }
    command.arg(format!("--user-data-dir={}", folder.join("profile").display()));
    command.arg(format!("file://{}", file.display()));
    command.stdin(Stdio::null()).output().map_err(|error| refused(browser, &error.to_string()))
}

/// An animation that is repeated without end, or why a picture cannot be read or written.
fn gif(pictures: &[(f64, Vec<u8>)], rate: f64) -> std::result::Result<Vec<u8>, String> {
    let unwritten = |error: EncodingError| error.to_string();
    let mut animation = None;
    // Rates below 1/655 s have the longest delay that the format has.
    let delay = u16::try_from(whole((100.0 / rate).round())).unwrap_or(u16::MAX);
    for (k, (_, png)) in pictures.iter().enumerate() {
        let (width, height, mut pixels) = rgba(png)?;
        let mut frame = Frame::from_rgba_speed(width, height, &mut pixels, QUANTISATION);
        // The end is to be seen before it begins again.
        frame.delay = if k + 1 == pictures.len() { LAST } else { delay };
        if animation.is_none() {
            let mut encoder = Encoder::new(Vec::new(), width, height, &[]).map_err(unwritten)?;
            encoder.set_repeat(Repeat::Infinite).map_err(unwritten)?;
            animation = Some(encoder);
        }
        if let Some(encoder) = &mut animation {
            encoder.write_frame(&frame).map_err(unwritten)?;
        }
    }
    let written = animation.map(|encoder| encoder.into_inner());
    written.transpose().map(Option::unwrap_or_default).map_err(|error| error.to_string())
}

/// Width, height and pixels of a PNG, red, green, blue and opacity each.
fn rgba(png: &[u8]) -> std::result::Result<(u16, u16, Vec<u8>), String> {
    let unread = |error: png::DecodingError| error.to_string();
    let mut decoder = png::Decoder::new(Cursor::new(png));
    decoder.set_transformations(Transformations::normalize_to_color8() | Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(unread)?;
    let size = reader.output_buffer_size().ok_or("a picture larger than memory")?;
    let mut pixels = vec![0; size];
    let info = reader.next_frame(&mut pixels).map_err(unread)?;
    pixels.truncate(info.buffer_size());
    if info.color_type == ColorType::GrayscaleAlpha {
        pixels = pixels.chunks_exact(2).flat_map(|p| [p[0], p[0], p[0], p[1]]).collect();
    }
    let side = |pixels| u16::try_from(pixels).map_err(|_| format!("{pixels} pixels wide or high"));
    Ok((side(info.width)?, side(info.height)?, pixels))
}

/// A movie by ffmpeg, which is `program`.
fn encoded(
    program: &Path,
    pictures: &[(f64, Vec<u8>)],
    rate: f64,
    (path, kind): (&Path, &str),
) -> Result<Vec<u8>> {
    let failed = |error: std::io::Error| refused(program, &error.to_string());
    let folder = tempfile::tempdir().map_err(failed)?;
    let out = folder.path().join("movie").with_extension(kind);
    let codec: &[&str] = match kind {
        "mp4" => &["libx264", "-crf", "18", "-movflags", "+faststart"],
        _ => &["libvpx-vp9", "-crf", "24", "-b:v", "0"],
    };
    let mut child = Command::new(program)
        .args([
            "-loglevel",
            "error",
            "-f",
            "image2pipe",
            "-c:v",
            "png",
            "-framerate",
            &rate.to_string(),
        ])
        .args(["-i", "-", "-pix_fmt", "yuv420p", "-c:v"])
        .args(codec)
        .arg(&out)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    if let Some(mut pipe) = child.stdin.take() {
        // A program that ends early says why.
        let _ = pictures.iter().try_for_each(|(_, png)| pipe.write_all(png));
    }
    let output = child.wait_with_output().map_err(failed)?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(refused(path, &format!("ffmpeg failed ({}): {}", output.status, said.trim())));
    }
    fs::read(&out).map_err(failed)
}
