//! What the directory of one run holds: checkpoints, ledger, events, status, provenance, costs.

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::output::{
    Interrupt, Ledger, Mode, Progress, Provenance, ResultDirectory, Standing, events::Events,
};
use rumple::run::{self, Costs};
use rumple::scene::Scene;
use sha2::{Digest, Sha256};

use super::{Reader, bound, file, room, root};

/// A checkpoint in the directory of a run that is to go on.
pub const CHECKPOINT: Reader = Reader {
    name: "checkpoint",
    bound: bound(8, 64),
    seeds: || vec![whole().checkpoint.clone()],
    read: checkpoint,
    repair: Some(seal),
};

pub const LEDGER: Reader = Reader {
    name: "ledger",
    bound: bound(1, 64),
    seeds: || vec![LEDGER_TEXT.into(), LEDGER_TEXT.replace('2', "nan").into()],
    read: |bytes| {
        let columns = ["step", "time", "a, b"].map(str::to_owned);
        Ledger::reopen(&file("ledger.csv", bytes), &columns, 2)
            .and_then(|mut ledger| ledger.append(&[3.0, 1.0, f64::NAN]))
            .is_ok()
    },
    repair: None,
};

const LEDGER_TEXT: &str = "step,time,\"a, b\"\n0,0,1\n1,0.5,2\n2,1,2e-3\n3,1.5,2.25\n";

pub const EVENTS: Reader = Reader {
    name: "events",
    bound: bound(1, 64),
    seeds: || {
        let text = "time,step,kind,smallest eigenvalue [force/length^3],negative directions,energy released \
                    [energy],modes\n\
                    1.25,37,loss of stability,-3.1e-5,1,,modes/mode_000000.vtu\n\
                    1.5,38,snap,,,0.32,\n";
        vec![text.into()]
    },
    read: |bytes| Events::reopen(file("events.csv", bytes), 2).is_ok(),
    repair: None,
};

pub const STATUS: Reader = Reader {
    name: "status",
    bound: bound(1, 128),
    seeds: || vec![whole().status.clone()],
    read: |bytes| {
        file("status.json", bytes);
        Standing::read(&room()).is_some()
    },
    repair: None,
};

pub const PROVENANCE: Reader = Reader {
    name: "provenance",
    bound: bound(1, 256),
    seeds: || {
        vec![
            b"{\"version\": \"rumple 0.1.0\", \"threads\": 2, \"resumed\": [{\"time\": 1.0}]}"
                .into(),
        ]
    },
    read: |bytes| {
        let directory = ResultDirectory::prepare(&room().join("run"), true);
        let directory = directory.unwrap_or_else(|error| panic!("{error}"));
        write(directory.provenance(), bytes);
        let done = Provenance::resumed(&directory, 1.0, 3);
        // Whether what was there is still there: an unreadable record is replaced.
        let now = fs::read_to_string(directory.provenance()).unwrap_or_default();
        done.is_ok() && now.contains("version")
    },
    repair: None,
};

pub const COSTS: Reader = Reader {
    name: "costs",
    bound: bound(1, 128),
    seeds: || vec![whole().costs.clone()],
    read: |bytes| {
        file("costs.json", bytes);
        Costs::read(&room()).is_ok_and(|costs| !costs.to_string().is_empty())
    },
    repair: None,
};

fn write(path: PathBuf, bytes: &[u8]) {
    fs::write(&path, bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// Files of a run of the small scene.
struct Whole {
    checkpoint: Vec<u8>,
    status: Vec<u8>,
    costs: Vec<u8>,
}

fn whole() -> &'static Whole {
    static WHOLE: OnceLock<Whole> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let directory = run_made();
        let bytes = |path: PathBuf| fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let last = directory.checkpoints_found().unwrap_or_default().pop();
        let (_, checkpoint) = last.unwrap_or_else(|| panic!("the small run has no checkpoint"));
        let status = "{\"status\": \"running\", \"reason\": \"\", \"time\": 0.02, \"cpu_seconds\": 1.5, \
                      \"work\": {\"steps\": 3}, \"start\": {\"work\": {\"steps\": 1}}}";
        Whole { checkpoint: bytes(checkpoint), status: status.into(), costs: bytes(directory.costs()) }
    })
}

/// Runs the small scene into a folder of this thread.
fn run_made() -> ResultDirectory {
    let scene = root().join("tests/fuzz/scenes/small.toml");
    let run = || -> run::Result<ResultDirectory> {
        let scene = Scene::load(&scene, &[])?;
        let mut simulation = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
        let directory = ResultDirectory::prepare(&room().join("whole"), true)?;
        fs::write(directory.resolved(), scene.resolved()?).unwrap_or_default();
        let mut progress = Progress::new(Mode::Silent, 1.0);
        run::run::run(&scene, &mut simulation, &directory, &mut progress, Interrupt::install()?)?;
        Costs::new(&scene, &simulation).write(&directory)?;
        Ok(directory)
    };
    run().unwrap_or_else(|error| panic!("{error}"))
}

thread_local! {
    /// A run whose only checkpoint is the input.
    static RUN: (ResultDirectory, PathBuf) = {
        let directory = run_made();
        let mut all = directory.checkpoints_found().unwrap_or_default();
        let last = all.pop().map(|(_, path)| path).unwrap_or_default();
        all.iter().for_each(|(_, path)| fs::remove_file(path).unwrap_or_default());
        (directory, last)
    };
}

fn checkpoint(bytes: &[u8]) -> bool {
    RUN.with(|(directory, path)| {
        write(path.clone(), bytes);
        let (until, search) =
            (["time.until=1".to_owned()], PluginSearch::in_directories(Vec::new()));
        match run::resume::resume(directory, &until, &search) {
            Ok(resumed) => resumed.checkpoint.time() <= 1.0,
            Err(error) => error.to_string().is_empty(),
        }
    })
}

/// Makes length and checksum of a checkpoint right.
fn seal(bytes: &mut [u8]) {
    const HEADER: usize = 64;
    const HASH: usize = 32;
    let Some(length) = bytes.len().checked_sub(HEADER + 8 + HASH) else { return };
    bytes[HEADER..HEADER + 8].copy_from_slice(&(length as u64).to_le_bytes());
    let end = bytes.len() - HASH;
    let hash = Sha256::digest(&bytes[..end]);
    bytes[end..].copy_from_slice(&hash);
}
