//! The viewer of results: its data against the frames, its size, what is refused.

mod picture;
mod refused;
mod studies;
mod watch;

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use rumple::sheet::{Surface, read};
use serde_json::Value;

use crate::run::SMALL;
use crate::run::program::{folder, passes, rumple, text};

/// The small scene with six frames, whose fields are scalars and vectors, on vertices and triangles.
pub fn scene() -> String {
    SMALL.replace("until = 0.5", "until = 0.05").replace(
        "every = 0.25",
        "every = 0.01\nfields = [\"c\", \"mean_curvature\", \"rest_position\", \"quality\"]",
    )
}

pub fn done(folder: &Path, args: &[&str]) -> String {
    let out = rumple(folder, args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// A page with what it holds.
pub struct Read {
    pub html: String,
    pub about: Value,
}

impl Read {
    pub fn new(path: &Path) -> Self {
        let html = fs::read_to_string(path).unwrap();
        let about = between(&html, "id=\"about\">", "</script>");
        let about = serde_json::from_str(about).unwrap();
        Self { html, about }
    }

    pub fn block(&self, number: &Value) -> Vec<u8> {
        let start = format!("id=\"block-{}\">", number.as_u64().unwrap());
        BASE64.decode(between(&self.html, &start, "</script>")).unwrap()
    }

    pub fn sheet(&self) -> &Value {
        &self.about["members"][0]["sheet"]
    }

    /// Numbers of the frames that are shown.
    pub fn numbers(&self) -> Vec<u64> {
        let frames = self.sheet()["frames"].as_array().unwrap();
        frames.iter().map(|frame| frame["number"].as_u64().unwrap()).collect()
    }
}

fn between<'a>(html: &'a str, start: &str, end: &str) -> &'a str {
    let rest = &html[html.find(start).unwrap_or_else(|| panic!("no {start}")) + start.len()..];
    &rest[..rest.find(end).unwrap()]
}

fn range(value: &Value) -> [f64; 2] {
    [value[0].as_f64().unwrap(), value[1].as_f64().unwrap()]
}

/// The number that a level stands for.
fn number(level: u16, [least, largest]: [f64; 2]) -> f64 {
    least + (largest - least) / 65534.0 * f64::from(level)
}

/// Half a level, and round-off.
fn tolerance([least, largest]: [f64; 2]) -> f64 {
    (largest - least) / 65534.0 * 0.5001 + 1e-14 * least.abs().max(largest.abs())
}

/// Checks the numbers of one frame against its file.
fn check_frame(page: &Read, frame: &Value, surface: &Surface) {
    let bytes = page.block(&frame["block"]);
    let mut levels = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b));
    let bounds = [0, 1, 2].map(|c| {
        let side = |name: &str| page.sheet()["box"][name][c].as_f64().unwrap();
        [side("least"), side("largest")]
    });
    for x in &surface.points {
        for (x, bounds) in x.iter().zip(bounds) {
            let level = levels.next().unwrap().wrapping_add(32767);
            assert!((number(level, bounds) - x).abs() <= tolerance(bounds));
        }
    }
    let mut ranges = frame["ranges"].as_array().unwrap().iter().map(range);
    for field in page.sheet()["fields"].as_array().unwrap() {
        let name = field["name"].as_str().unwrap();
        let array = match field["at"].as_str().unwrap() {
            "vertex" => surface.point_array(name),
            _ => surface.cell_array(name),
        };
        let array = array.unwrap_or_else(|| panic!("{name}"));
        for c in 0..array.components {
            let range = ranges.next().unwrap();
            for value in array.values.iter().skip(c).step_by(array.components) {
                let found = number(levels.next().unwrap(), range);
                assert!((found - value).abs() <= tolerance(range), "{name}: {found} {value}");
            }
        }
    }
    assert_eq!((levels.next(), ranges.next()), (None, None));
}

#[test]
fn a_run_ends_with_a_viewer_that_has_its_frames() {
    let folder = folder(&scene());
    done(folder.path(), &["run", "scene.toml", "--out", "out", "--quiet"]);
    let root = folder.path().join("out");
    let page = Read::new(&root.join("report.html"));
    assert_eq!(page.numbers(), [0, 1, 2, 3, 4, 5]);
    assert!(page.html.contains("<p id=\"summary\">6 of 6 frames, 400 vertices"));
    let titles: Vec<&Value> =
        page.sheet()["fields"].as_array().unwrap().iter().map(|field| &field["name"]).collect();
    assert_eq!(titles.len(), 4, "{titles:?}");
    for (k, frame) in page.sheet()["frames"].as_array().unwrap().iter().enumerate() {
        let surface = read::surface(root.join(format!("frames/frame_{k:06}.vtu"))).unwrap();
        assert_eq!(frame["time"].as_f64(), surface.time);
        check_frame(&page, frame, &surface);
        let triangles: Vec<u8> =
            surface.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(page.block(&page.sheet()["triangles"]), triangles);
    }
    // What the directory says otherwise.
    let member = &page.about["members"][0];
    let resolved = fs::read_to_string(root.join("resolved.toml")).unwrap();
    assert_eq!(member["scene"], resolved);
    assert_eq!(member["status"], "complete");
    assert!(member["costs"]["parts"].is_array() && member["provenance"]["version"].is_string());
    let ledger = fs::read_to_string(root.join("ledger.csv")).unwrap();
    let columns: Vec<&str> = ledger.lines().next().unwrap().split(',').collect();
    assert_eq!(member["ledger"]["columns"], serde_json::json!(columns));
    let rows = ledger.lines().count() - 1;
    let block = page.block(&member["ledger"]["block"]);
    let values: Vec<f32> =
        block.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    for (r, row) in ledger.lines().skip(1).enumerate() {
        for (c, cell) in row.split(',').enumerate() {
            let (found, expected) = (values[c * rows + r], cell.parse::<f32>().unwrap());
            assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{}: {row}", columns[c]);
        }
    }
}

/// Nothing is loaded from anywhere, and no text of a scene can end a script.
#[test]
fn a_page_is_self_contained() {
    let folder = folder(&(scene() + "\n# </script><script>alert(1)</script>\n"));
    let set = "--set=sheet.file=\"</script><b>\"";
    assert_eq!(rumple(folder.path(), &["check", "scene.toml", set]).status.code(), Some(2));
    done(folder.path(), &["run", "scene.toml", "--out", "out & <b>", "--quiet"]);
    let page = Read::new(&folder.path().join("out & <b>/report.html"));
    for absent in ["<b>", "alert(1)<", "src=", "@import", "<link", "fetch("] {
        assert!(!page.html.contains(absent), "{absent}");
    }
    assert!(page.html.contains("default-src 'none'"));
    assert!(page.html.contains("<title>out &amp; &lt;b&gt;</title>"));
    let addresses = page.html.match_indices("http").map(|(at, _)| &page.html[at..at + 30]);
    let named: Vec<&str> = addresses.filter(|text| text.contains("://")).collect();
    assert!(named.iter().all(|text| text.starts_with("http://www.w3.org/2000/svg")), "{named:?}");
}

#[test]
fn frames_and_size_are_bounded_and_both_ends_are_kept() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let said = done(folder, &["view", "out", "-o", "three.html", "--frames", "3"]);
    assert!(said.contains("3 of 6 frames"), "{said}");
    let three = Read::new(&folder.join("three.html"));
    assert_eq!(three.numbers(), [0, 3, 5]);
    assert!(three.html.contains("3 of 6 frames"));
    let whole = fs::metadata(folder.join("out/report.html")).unwrap().len();
    let mut lengths = Vec::new();
    for percent in [95, 87, 79] {
        let bytes = whole * percent / 100;
        let limit = format!("{:.6}", bytes as f64 / 1e6);
        let args = ["view", "out", "-o", "bounded.html", "--size-limit", &limit, "--force"];
        done(folder, &args);
        let page = Read::new(&folder.join("bounded.html"));
        assert!(page.html.len() as u64 <= bytes, "{} > {bytes}", page.html.len());
        let numbers = page.numbers();
        assert_eq!((numbers.first(), numbers.last()), (Some(&0), Some(&5)));
        lengths.push(numbers.len());
    }
    assert!(lengths.is_sorted_by(|a, b| a >= b) && lengths[2] < 6, "{lengths:?}");
    let out = rumple(folder, &["view", "out", "-o", "none.html", "--size-limit", "0.05"]);
    assert_eq!(out.status.code(), Some(2));
    let message = text(&out.stderr);
    assert!(message.contains("--size-limit") && message.contains("out"), "{message}");
    assert!(!folder.join("none.html").exists());
}

#[test]
fn the_report_is_left_out_on_request_and_never_fails_a_run() {
    let folder = folder(&(scene() + "\n[checkpoint]\nevery = 0.02\n"));
    let folder = folder.path();
    let set = "output.report=false";
    done(folder, &["run", "scene.toml", "--out", "without", "--quiet", "--set", set]);
    assert!(!folder.join("without/report.html").exists());
    let resolved = fs::read_to_string(folder.join("without/resolved.toml")).unwrap();
    assert!(resolved.contains("report = false"), "{resolved}");
    // Nothing can be written where the page is to be built.
    done(folder, &["run", "scene.toml", "--out", "blocked", "--quiet"]);
    fs::create_dir(folder.join("blocked/.report.html.part")).unwrap();
    let out = passes(folder, "resume blocked --until 0.06 --quiet");
    assert!(text(&out.stderr).contains("warning: no report.html"), "{}", text(&out.stderr));
    let status = fs::read_to_string(folder.join("blocked/status.json")).unwrap();
    assert!(status.contains("\"complete\""), "{status}");
}
