//! Runs of other programs beside those of a study.
//!
//! ```text
//! DIR/peers/NAME/peer.json     { "integrator": "CVODE, BDF", "tolerance": 1e-6, "seconds": [0.8, 0.9, 0.8],
//!                                "evaluations": 400, "factorisations": 30, "failed": "why, if it failed" }
//!                              with "fixed_steps": true the tolerance is a step, as a share of the whole time
//! DIR/peers/NAME/states.bin    the states that it came to, as `study::states` has them
//! ```
//!
//! Their errors are those of the same reference by the same measure.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::model::State;
use crate::output::ResultDirectory;
use crate::study::gather::{MemberResults, MemberStatus, states};
use crate::study::run::Timing;
use crate::tally::Work;

/// Name of their folder.
pub(super) const FOLDER: &str = "peers";
const FILE: &str = "peer.json";

/// Description of a run of another program, in `peer.json`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PeerRecord {
    /// The name of the program.
    pub(super) integrator: String,
    /// Its tolerance, or its step as a share of the whole time.
    pub(super) tolerance: f64,
    seconds: Vec<f64>,
    #[serde(default)]
    steps: u64,
    #[serde(default)]
    evaluations: u64,
    #[serde(default)]
    factorisations: u64,
    #[serde(default)]
    failed: Option<String>,
    /// Whether the tolerance is a step.
    #[serde(default)]
    pub(super) fixed_steps: bool,
}

/// One run of another program.
pub(super) struct Peer {
    pub(super) record: PeerRecord,
    /// Its results.
    pub(super) found: MemberResults,
    /// States that it came to.
    pub(super) states: Vec<State>,
    /// The file of these.
    file: PathBuf,
}

impl Peer {
    /// Why it cannot be compared with the states of a reference, if it cannot.
    pub(super) fn fault(&self, truth: &[State]) -> Option<String> {
        let expected = truth.first()?;
        let refuse = |what: String| Some(format!("{}: {what}", self.file.display()));
        let Some(first) = self.states.first() else {
            // One that failed may have none.
            let failed = self.found.status != MemberStatus::Complete;
            return if failed { None } else { refuse(self.nothing()) };
        };
        let counts = |state: &State| {
            let points: Vec<usize> = state.species.iter().map(Vec::len).collect();
            format!("{} vertices and species at {points:?} points", state.x.len())
        };
        let expected = counts(expected);
        if let Some(found) = self.states.iter().map(counts).find(|found| *found != expected) {
            return refuse(format!("expected {expected}, found {found}"));
        }
        let near = |s: &&State| truth.iter().any(|t| (t.time - s.time).abs() <= 1e-9 * t.time);
        let later = |states: &[State]| states.last().map_or(0.0, |s| s.time);
        if self.states.iter().filter(|s| s.time > 0.0).any(|s| near(&s)) {
            return None;
        }
        refuse(format!(
            "expected states at output times of the study, up to t = {}, found none of these (t = {} to {})",
            later(truth),
            first.time,
            later(&self.states)
        ))
    }

    /// Describes a file that holds no state.
    fn nothing(&self) -> String {
        let expected = "expected `rumple states 1`, a line end and states";
        match fs::metadata(&self.file) {
            Ok(about) => format!("{expected}, found {} bytes that hold no state", about.len()),
            Err(error) => format!("{expected}, found {error}"),
        }
    }
}

/// Reads those in `root`, by name and from loose to tight; and the errors of those that cannot be read.
pub(super) fn read(root: &Path) -> (Vec<Peer>, Vec<String>) {
    let entries = fs::read_dir(root.join(FOLDER)).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    folders.sort();
    let (mut peers, mut wrong) = (Vec::new(), Vec::new());
    for folder in folders {
        let file = folder.join(FILE);
        let text = fs::read_to_string(&file).map_err(|error| error.to_string());
        match text.and_then(|text| serde_json::from_str(&text).map_err(|error| error.to_string())) {
            Ok(said) => peers.push(peer(said, &folder)),
            Err(error) => wrong.push(format!("{}: {error}", file.display())),
        }
    }
    peers.sort_by(|a: &Peer, b: &Peer| {
        let (a, b) = (&a.record, &b.record);
        a.integrator.cmp(&b.integrator).then(b.tolerance.total_cmp(&a.tolerance))
    });
    (peers, wrong)
}

fn peer(record: PeerRecord, folder: &Path) -> Peer {
    let work = Work {
        steps: record.steps,
        right_hand_sides: record.evaluations,
        factorisations: record.factorisations,
        ..Work::default()
    };
    let failed = record.failed.is_some();
    let found = MemberResults {
        name: record.integrator.clone(),
        status: if failed { MemberStatus::Failed } else { MemberStatus::Complete },
        reason: record.failed.clone().unwrap_or_default(),
        seconds: record.seconds.first().copied(),
        work: Some(work),
        start: Some(Work::default()),
        timing: Some(Timing { start: 0.0, steps: record.seconds.clone() }),
        ..MemberResults::default()
    };
    let file = folder.join(ResultDirectory::STATES);
    Peer { record, found, states: states::read(&file), file }
}
