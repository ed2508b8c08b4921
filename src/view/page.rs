//! The HTML file: a template with style and script, data and everything else.

use std::path::Path;

use serde::Serialize;

use super::blocks::Blocks;
use super::ledger::{self, Columns};
use super::record::{Record, text_of};
use super::runs::{self, FoundRuns};
use super::sheet::{self, Sheet};
use crate::num::plural;
use crate::output::ResultDirectory;
use crate::run::{Error, Result};
use serde_json::Value;

const TEMPLATE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");
/// In the order in which they are run.
const SCRIPT: [&str; 12] = [
    include_str!("page/data.js"),
    include_str!("page/colour.js"),
    include_str!("page/camera.js"),
    include_str!("page/state.js"),
    include_str!("page/draw.js"),
    include_str!("page/viewer.js"),
    include_str!("page/probe.js"),
    include_str!("page/curves.js"),
    include_str!("page/record.js"),
    include_str!("page/figures.js"),
    include_str!("page/picture.js"),
    include_str!("page/main.js"),
];
/// After the others, in a page that is served.
const WATCH: &str = include_str!("page/watch.js");
const GENERATOR: &str = concat!("rumple ", env!("CARGO_PKG_VERSION"));

/// The data that the script reads, as JSON.
#[derive(Debug, Serialize)]
struct PageData<'a> {
    title: &'a str,
    /// What a study shows, as it wrote it.
    study: Option<Value>,
    /// Pictures that are wanted in place of the page, or the state of results that are watched.
    #[serde(flatten)]
    wanted: Option<Value>,
    members: Vec<RunData>,
}

/// The data of one run.
#[derive(Debug, Serialize)]
struct RunData {
    name: String,
    #[serde(flatten)]
    record: Record,
    sheet: Option<Sheet>,
    ledger: Option<Columns>,
}

/// Makes the page of the runs `found` in `root`. What cannot be read of a member of a study is a warning, unless no
/// member has a sheet.
pub(super) fn render(
    root: &Path,
    found: &FoundRuns,
    options: Options,
    wanted: Option<Value>,
) -> Result<Page> {
    let mut blocks = Blocks::default();
    let runs = &found.runs;
    let members = runs.iter().map(|(name, directory)| member(name, directory, found, &mut blocks));
    let members = members.collect::<Result<Vec<_>>>()?;
    let title = runs::name_of(root);
    let plots = root.join(ResultDirectory::PLOTS);
    let wrong =
        |error| Error::Refused(format!("{}: is not what a study writes: {error}", plots.display()));
    let study =
        text_of(&plots)?.map(|text| serde_json::from_str(&text)).transpose().map_err(wrong)?;
    let mut data = PageData { title: &title, study, wanted, members };
    // Sheets get what the rest leaves.
    let rest = document(&data, "", blocks.html()).len();
    let left = options.bytes.saturating_sub(rest) / runs.len().max(1);
    let mut first = None;
    for (member, (_, directory)) in data.members.iter_mut().zip(runs) {
        match sheet::read(directory, options.frames, left, &mut blocks) {
            Ok(sheet) => member.sheet = sheet,
            Err(error) if found.study => {
                member.record.warnings.push(error.to_string());
                first.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    let sheets: Vec<&Sheet> = data.members.iter().filter_map(|m| m.sheet.as_ref()).collect();
    if let Some(error) = first.filter(|_| sheets.is_empty()) {
        return Err(error);
    }
    let shown = sheets.iter().map(|sheet| sheet.frames.len()).sum();
    let (runs, total_frames) = (sheets.len(), sheets.iter().map(|sheet| sheet.of).sum());
    let vertices = data.members.iter().find_map(|member| member.record.vertices());
    let summary = summary(found, (&sheets, vertices), (shown, total_frames));
    let html = document(&data, &summary, blocks.html());
    let warnings = data.members.into_iter().flat_map(|member| member.record.warnings).collect();
    Ok(Page { html, runs, shown, total_frames, warnings })
}

/// Everything of a run but its sheet.
fn member(name: &str, directory: &Path, found: &FoundRuns, blocks: &mut Blocks) -> Result<RunData> {
    let mut read = || {
        let (mut record, mut warnings) = (Record::read(directory)?, Vec::new());
        let ledger = ledger::read(directory, blocks, &mut warnings)?;
        // Members of most studies have none.
        record.warnings.extend(warnings.into_iter().filter(|_| !found.study));
        Ok((record, ledger))
    };
    let (record, ledger) = match read() {
        Err(error) if found.study => (Record::unreadable(&error), None),
        read => read?,
    };
    Ok(RunData { name: name.to_owned(), record, sheet: None, ledger })
}

/// What is shown of how much; `vertices` are those of the record of the mesh, where frames may have images too.
fn summary(
    found: &FoundRuns,
    (sheets, vertices): (&[&Sheet], Option<u64>),
    (shown, of): (usize, usize),
) -> String {
    let frames = match sheets {
        [] => "no frames".to_owned(),
        [sheet] => format!(
            "{shown} of {}, {} vertices, {} triangles",
            plural(of, "frame", "frames"),
            vertices.map_or_else(|| sheet.vertices.to_string(), |count| count.to_string()),
            sheet.faces
        ),
        _ => format!("{shown} of {of} frames of {} runs", sheets.len()),
    };
    match found.study {
        true => format!("{}; {frames}", plural(found.runs.len(), "member", "members")),
        false => frames,
    }
}

/// The HTML.
fn document(data: &PageData<'_>, summary: &str, blocks: &str) -> String {
    // A `<` could end the script element.
    let watched = data.wanted.as_ref().is_some_and(|wanted| wanted.get("watch").is_some());
    let json = serde_json::to_string(data).unwrap_or_default().replace('<', "\\u003c");
    let (title, summary) = (escaped(data.title), escaped(summary));
    fill(&[
        ("title", &title),
        ("generator", GENERATOR),
        // A page that is served asks its server for news; others ask for nothing.
        ("connect", if watched { "; connect-src 'self'" } else { "" }),
        ("summary", &summary),
        ("style", STYLE),
        ("blocks", blocks),
        ("about", &json),
        ("script", &(SCRIPT.concat() + if watched { WATCH } else { "" })),
    ])
}

/// The template with `{{name}}` replaced by the text of that name.
fn fill(texts: &[(&str, &str)]) -> String {
    let size = texts.iter().map(|(_, text)| text.len()).sum::<usize>();
    let mut html = String::with_capacity(TEMPLATE.len() + size + 1000);
    let mut pieces = TEMPLATE.split("{{");
    html.push_str(pieces.next().unwrap_or_default());
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        html.push_str(texts.iter().find(|text| text.0 == name).map_or("", |text| text.1));
        html.push_str(rest);
    }
    html
}

/// Text between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Bounds of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Most frames of a run, at least 2: the first and the last are always among them.
    pub frames: usize,
    /// Most bytes of the file.
    pub bytes: usize,
}

impl Default for Options {
    /// A page that a browser on a telephone opens within seconds, and that goes through a mail server.
    fn default() -> Self {
        Self { frames: 60, bytes: 20_000_000 }
    }
}

/// A page, ready to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// The HTML.
    pub html: String,
    /// Runs with frames.
    pub runs: usize,
    /// Frames that are shown, of all runs.
    pub shown: usize,
    /// Frames that the runs have.
    pub total_frames: usize,
    /// What a reader of the runs should know first.
    pub warnings: Vec<String>,
}
