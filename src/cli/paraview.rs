//! `rumple paraview DIR`: a Python macro that opens the results of a run in ParaView.
//!
//! The range of colours and the box of the camera are those of all frames, which are read here once: ParaView would read
//! them one after another whenever the macro is opened.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::output::{Inputs, ResultDirectory, ResultFile};
use crate::run::{Error, Result};
use crate::sheet::{Array, Surface, read};
use crate::view;

/// Height over the largest horizontal extent, up to which a sheet is viewed from above.
const FLAT_ASPECT: f64 = 0.02;

/// Arguments of `paraview`.
#[derive(Debug, Args)]
pub(super) struct ParaviewArgs {
    /// The directory of a run.
    directory: PathBuf,
    /// The array that colours the sheet, with or without its unit; by default the first one of the frames.
    #[arg(long, value_name = "NAME")]
    array: Option<String>,
    /// Range of colours; by default that of all frames.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true)]
    range: Option<Vec<f64>>,
    /// Replace an existing macro.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &ParaviewArgs) -> Result<()> {
    let root = &args.directory;
    let refuse = |what: String| Error::Refused(format!("{}: {what}", root.display()));
    let range = match args.range.as_deref() {
        None => None,
        Some(&[low, high]) if low < high && low.is_finite() && high.is_finite() => {
            Some([low, high])
        }
        Some(_) => return Err(refuse("--range is two finite numbers, the smaller first".into())),
    };
    let frames = view::frames(root)?;
    if frames.is_empty() {
        return Err(refuse(
            "has no frames; expected the directory of a run (of a sweep, the directory of one member)".into(),
        ));
    }
    let file = ResultFile::new(&root.join(ResultDirectory::MACRO), args.force, &Inputs::default())?;
    let mut seen = Seen::default();
    for (_, path) in &frames {
        seen.add(&read::surface(path)?, args.array.as_deref()).map_err(refuse)?;
    }
    let text = seen.text(&series(root), range);
    file.write(|writer| writer.write_all(text.as_bytes()))?;
    let path = root.join(ResultDirectory::MACRO);
    say!("paraview --script={}", path.display());
    say!("pvbatch {} PICTURE.png", path.display());
    Ok(())
}

/// The file that ParaView opens.
fn series(root: &Path) -> String {
    let known = [ResultDirectory::VTKHDF, ResultDirectory::PVD, ResultDirectory::SERIES];
    let found = known.into_iter().find(|name| root.join(name).is_file());
    found.unwrap_or(ResultDirectory::PVD).to_owned()
}

/// What all frames have together.
struct Seen {
    array: Option<(String, &'static str)>,
    range: [f64; 2],
    bounds: [[f64; 3]; 2],
}

impl Default for Seen {
    fn default() -> Self {
        let wide = [f64::INFINITY, f64::NEG_INFINITY];
        Self { array: None, range: wide, bounds: wide.map(|x| [x; 3]) }
    }
}

impl Seen {
    /// Adds a frame; the array is found in the first one.
    fn add(&mut self, frame: &Surface, wanted: Option<&str>) -> std::result::Result<(), String> {
        if self.array.is_none() {
            self.array = Some(choose(frame, wanted)?);
        }
        let array = self.array.as_ref().and_then(|(name, place)| match *place {
            "POINTS" => frame.point_array(name),
            _ => frame.cell_array(name),
        });
        let array = array.ok_or("a frame lacks an array of the first one")?;
        for tuple in array.values.chunks_exact(array.components.max(1)) {
            let value = match tuple {
                [value] => *value,
                vector => vector.iter().map(|x| x * x).sum::<f64>().sqrt(),
            };
            if value.is_finite() {
                self.range = [self.range[0].min(value), self.range[1].max(value)];
            }
        }
        for point in frame.points.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
            for k in 0..3 {
                self.bounds[0][k] = self.bounds[0][k].min(point[k]);
                self.bounds[1][k] = self.bounds[1][k].max(point[k]);
            }
        }
        Ok(())
    }

    /// The macro.
    fn text(&self, series: &str, range: Option<[f64; 2]>) -> String {
        let (array, place) = self.array.clone().unwrap_or_default();
        // Names in a VTKHDF file have no slash.
        let array =
            if series == ResultDirectory::VTKHDF { array.replace('/', " per ") } else { array };
        let [low, high] = self.bounds;
        let extent = [0, 1, 2].map(|k| high[k] - low[k]);
        let flat = extent[2] <= FLAT_ASPECT * extent[0].max(extent[1]);
        let (direction, up) = match flat {
            true => (json!([0.0, 0.0, 1.0]), json!([0.0, 1.0, 0.0])),
            false => (json!([0.0, -0.8, 0.6]), json!([0.0, 0.0, 1.0])),
        };
        include_str!("paraview/macro.py")
            .replace("@NAME@", ResultDirectory::MACRO)
            .replace("@SERIES@", &json!(series).to_string())
            .replace("@ARRAY@", &json!(array).to_string())
            .replace("@ASSOCIATION@", &json!(place).to_string())
            .replace("@RANGE@", &json!(range.unwrap_or_else(|| spread(self.range))).to_string())
            .replace("@LOW@", &json!(low).to_string())
            .replace("@HIGH@", &json!(high).to_string())
            .replace("@DIRECTION@", &direction.to_string())
            .replace("@UP@", &up.to_string())
    }
}

/// A range that colours can show: symmetric where both signs are about as large, never empty.
fn spread([low, high]: [f64; 2]) -> [f64; 2] {
    if low > high {
        return [0.0, 1.0];
    }
    let largest = low.abs().max(high.abs());
    if low < 0.0 && high > 0.0 && largest < 4.0 * low.abs().min(high.abs()) {
        return [-largest, largest];
    }
    // Constant fields have digits, too.
    if high - low <= 1e-12 * largest || high == low {
        let half = 0.5 * largest.max(1e-12);
        return [low - half, high + half];
    }
    [low, high]
}

/// The array of this name, or the first one that is not a displacement.
fn choose(
    frame: &Surface,
    wanted: Option<&str>,
) -> std::result::Result<(String, &'static str), String> {
    let points = frame.point_arrays.iter().map(|array| (array, "POINTS"));
    let cells = frame.cell_arrays.iter().map(|array| (array, "CELLS"));
    let all: Vec<(&Array, &'static str)> = points.chain(cells).collect();
    let bare = |array: &Array| array.name.split(" [").next().unwrap_or_default().to_owned();
    let found = match wanted {
        None => all.iter().find(|(array, _)| bare(array) != "displacement").or(all.first()),
        Some(name) => all
            .iter()
            .find(|(array, _)| array.name == name)
            .or_else(|| all.iter().find(|(array, _)| bare(array) == name)),
    };
    let (array, place) = found.ok_or_else(|| {
        let names: Vec<String> = all.iter().map(|(array, _)| bare(array)).collect();
        format!("no array \"{}\"; its frames have {}", wanted.unwrap_or_default(), names.join(", "))
    })?;
    Ok((array.name.clone(), place))
}
