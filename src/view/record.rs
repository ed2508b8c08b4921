//! What a result directory says of its run beside frames and ledger.

use std::path::Path;

use serde::Serialize;

use crate::output::{OutputError, ResultDirectory, RunStatus, SelfIntersection, Standing};
use crate::run::{Costs, Error, Result, stays_at_saddle};
use serde_json::Value;

/// Most bytes of a text; what is longer is cut off.
const MAX_TEXT: usize = 200_000;

/// What is known of a run.
#[derive(Debug, Default, Serialize)]
pub(super) struct Record {
    /// `complete`, or how it stands.
    status: Option<String>,
    /// What a reader should know.
    pub(super) warnings: Vec<String>,
    /// The scene with every default.
    scene: Option<String>,
    events: Option<String>,
    /// The report of a run that failed.
    failure: Option<String>,
    provenance: Option<Value>,
    costs: Option<Costs>,
    /// How to make the run again.
    reproduce: Vec<Paragraph>,
}

/// A paragraph of text, or commands.
#[derive(Debug, Serialize)]
struct Paragraph {
    command: bool,
    text: String,
}

impl Record {
    /// Reads that of the run in `root`. A record that is not there, as the costs of a run in progress, is left out.
    ///
    /// # Errors
    /// A file that is there and cannot be read.
    pub(super) fn read(root: &Path) -> Result<Self> {
        let standing = Standing::read(root);
        let text = |path: &Path| Ok::<_, crate::Error>(text_of(path)?.map(cut));
        let provenance = text_of(&root.join(ResultDirectory::PROVENANCE))?;
        let provenance: Option<Value> =
            provenance.and_then(|text| serde_json::from_str(&text).ok());
        let costs =
            ResultDirectory::costs_in(root).is_file().then(|| Costs::read(root)).transpose()?;
        let events = text(&root.join(ResultDirectory::EVENTS))?;
        let failure = text(&root.join(ResultDirectory::FAILURE).join("report.md"))?;
        let scene = text_of(&ResultDirectory::resolved_in(root))?;
        let mut warnings = warnings(standing.as_ref(), events.as_deref());
        if scene.as_ref().is_some_and(|scene| scene.parse::<toml::Table>().is_err()) {
            warnings.push("resolved.toml is not valid TOML: it is cut or changed".to_owned());
        }
        Ok(Self {
            status: standing.as_ref().map(status),
            warnings,
            scene: scene.map(cut),
            events,
            failure,
            reproduce: reproduce(provenance.as_ref()),
            provenance,
            costs,
        })
    }
}

impl Record {
    /// Vertices of the sheet, as its provenance has them.
    pub(super) fn vertices(&self) -> Option<u64> {
        self.provenance.as_ref()?.get("mesh")?.get("vertices")?.as_u64()
    }

    /// That of a run whose record cannot be read.
    pub(super) fn unreadable(error: &Error) -> Self {
        Self { warnings: vec![error.to_string()], ..Self::default() }
    }
}

/// How a run stands.
fn status(standing: &Standing) -> String {
    match standing.status {
        RunStatus::Running if !standing.in_use => "killed".to_owned(),
        other => other.to_string(),
    }
}

/// What a reader of results should know first.
fn warnings(standing: Option<&Standing>, events: Option<&str>) -> Vec<String> {
    let Some(standing) = standing else {
        return vec![
            "status.json is missing or damaged: it is not known how the run ended".to_owned(),
        ];
    };
    let mut all = Vec::new();
    if standing.status != RunStatus::Complete {
        let reason = Some(standing.reason.as_str()).filter(|reason| !reason.is_empty());
        let reason = reason.map(|reason| format!(": {reason}")).unwrap_or_default();
        all.push(format!("the run is {}{reason}", status(standing)));
    }
    if let Some(text) = standing.intersection.and_then(SelfIntersection::words) {
        all.push(text);
    }
    all.extend(standing.notes.iter().cloned());
    let count = events.map_or(0, notable);
    if count > 0 {
        all.push(format!("events, as snaps and losses of stability: {count}, listed below"));
    }
    all
}

/// Number of events of steps, and of a start that stays at a saddle. How the start has come to rest is not one.
fn notable(events: &str) -> usize {
    let cells = |row: &str| {
        let mut cells = row.split(',').map(str::to_owned);
        Some((cells.nth(1)?, cells.next()?))
    };
    let (start, steps): (Vec<_>, Vec<_>) =
        events.lines().skip(1).filter_map(cells).partition(|(step, _)| step == "0");
    let saddle = start.last().is_some_and(|(_, kind)| stays_at_saddle(kind));
    steps.len() + usize::from(saddle)
}

/// The command of the run, and what makes it again from this page alone.
fn reproduce(provenance: Option<&Value>) -> Vec<Paragraph> {
    let say = |text: String| Paragraph { command: false, text };
    let command = |text: String| Paragraph { command: true, text };
    let mut all = Vec::new();
    let Some(about) = provenance else { return all };
    let word = |value: &Value| value.as_str().map(quoted).unwrap_or_default();
    let words = about["command"].as_array().into_iter().flatten().map(word);
    let typed = words.collect::<Vec<_>>().join(" ");
    let version = about["version"].as_str().unwrap_or("rumple");
    let started = about["started"].as_str().unwrap_or("an unknown time");
    if !typed.is_empty() {
        all.push(say(format!("Made by {version}, started at {started} with")));
        all.push(command(typed));
    }
    all.push(say(
        "Save the scene below as scene.toml, with the files and plugins that it names; the same version gives the \
         same bits on any number of threads:"
            .into(),
    ));
    all.push(command("rumple run scene.toml --out again".into()));
    let hash = |value: &Value| value["sha256"].as_str().map(str::to_owned);
    if let Some(mesh) = hash(&about["mesh"]) {
        all.push(say(format!("SHA-256 of the mesh: {mesh}")));
    }
    for plugin in about["plugins"].as_array().into_iter().flatten() {
        if let (Some(path), Some(hash)) = (plugin["path"].as_str(), hash(plugin)) {
            all.push(say(format!("SHA-256 of the plugin {path}: {hash}")));
        }
    }
    all
}

/// A word of a command as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// At most so much of a text, with a word where it is cut off.
fn cut(mut text: String) -> String {
    if text.len() > MAX_TEXT {
        let end = (0..=MAX_TEXT).rev().find(|end| text.is_char_boundary(*end));
        text.truncate(end.unwrap_or(0));
        text.push_str("\n… cut off here");
    }
    text
}

/// Reads the text file `path`; none if it does not exist.
pub(super) fn text_of(path: &Path) -> Result<Option<String>> {
    match std::fs::read_to_string(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        text => Ok(Some(text.map_err(OutputError::read(path))?)),
    }
}
