//! What the directories of sweeps and studies of accuracy hold.

use std::fs;
use std::path::{Path, PathBuf};

use rumple::kinetics::PluginSearch;
use rumple::num::checked::Positive;
use rumple::output::{Interrupt, Mode, Progress, ResultDirectory};
use rumple::run;
use rumple::study::accuracy::{Study, StudyOptions};
use rumple::study::gather::gather;
use rumple::study::gather::states::{self, StateFile};
use rumple::study::plan::{Axis, Plan};
use rumple::study::sweep::{self, csv, markdown};

use super::{Bound, Reader, bound, file, room, root};

const SWEEPS: Bound = bound(16, 1024);

pub const STATES: Reader = Reader {
    name: "states",
    bound: bound(1, 64),
    seeds: || vec![member_file("point", ResultDirectory::STATES)],
    read: |bytes| {
        let path = file("states.bin", bytes);
        let states = states::read(&path);
        StateFile::reopen(&path, &[0.5]).is_ok() && !states.is_empty()
    },
    repair: None,
};

pub const SWEEP: Reader = Reader {
    name: "sweep",
    bound: SWEEPS,
    seeds: || vec![bytes(&made("small").join(Plan::FILE))],
    read: |bytes| {
        let root = made("small");
        let _replaced = Replaced::by(bytes, root.join(Plan::FILE));
        let Ok(Some(plan)) = Plan::read(&root) else { return false };
        shown(&plan, &root)
    },
    repair: None,
};

pub const MEASURES: Reader = Reader {
    name: "measures",
    bound: SWEEPS,
    seeds: || vec![member_file("small", ResultDirectory::MEASURES)],
    read: |bytes| in_member("small", ResultDirectory::MEASURES, bytes),
    repair: None,
};

pub const ACCURACY: Reader = Reader {
    name: "accuracy",
    bound: SWEEPS,
    seeds: || vec![bytes(&made("point").join(Study::FILE))],
    read: gathered,
    repair: None,
};

fn bytes(path: &Path) -> Vec<u8> {
    fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The sweep or study of a scene in a folder of this thread, made where it is not there.
fn made(name: &str) -> PathBuf {
    let folder = room().join(format!("study-{name}"));
    if !folder.is_dir() {
        let scene = root().join(format!("tests/fuzz/scenes/{name}.toml"));
        let made = if name == "point" { study(&scene, &folder) } else { plan(&scene, &folder) };
        made.unwrap_or_else(|error| panic!("{error}"));
    }
    folder
}

fn plan(scene: &Path, folder: &Path) -> run::Result<()> {
    let axis = Axis::parse("kinetics.parameters.a=0.5,1").map_err(run::Error::Refused)?;
    members(Plan::new(scene, &[], vec![axis])?, folder)
}

fn study(scene: &Path, folder: &Path) -> run::Result<()> {
    let tolerances = [1e-3, 1e-5].into_iter().filter_map(Positive::new).collect();
    let options = StudyOptions {
        integrators: ["bdf", "tr-bdf2"]
            .map(|method| format!("{{ kind = \"monolithic\", method = \"{method}\" }}"))
            .to_vec(),
        tolerances,
        references: Vec::new(),
        seeds: 0,
        limit: 10,
        wanted: 0.01,
        of: None,
    };
    let search = PluginSearch::in_directories(Vec::new());
    let (study, mut plan) = Study::plan(scene, &[], &search, &options)?;
    plan.states = true;
    members(plan, folder)?;
    study.write(folder)?;
    Ok(())
}

/// Runs all members.
fn members(mut plan: Plan, folder: &Path) -> run::Result<()> {
    plan.seal()?;
    fs::create_dir_all(folder.join(Plan::MEMBERS)).unwrap_or_default();
    plan.write(folder)?;
    for number in 0..plan.members.len() {
        let mut progress = Progress::new(Mode::Silent, 1.0);
        let interrupt = Interrupt::install()?;
        rumple::study::run::run(&plan, folder, number, &mut progress, interrupt)?;
    }
    Ok(())
}

/// A file of a study in whose place the input is, until it has been read.
struct Replaced {
    path: PathBuf,
    before: Vec<u8>,
}

impl Replaced {
    fn by(input: &[u8], path: PathBuf) -> Self {
        let before = bytes(&path);
        fs::write(&path, input).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Self { path, before }
    }
}

impl Drop for Replaced {
    fn drop(&mut self) {
        // The next input of this thread would be read in its place.
        let _ = fs::write(&self.path, &self.before);
    }
}

fn first_member(root: &Path) -> PathBuf {
    match Plan::read(root) {
        Ok(Some(plan)) => plan.directory(root, 0),
        _ => panic!("{} holds no sweep", root.display()),
    }
}

fn member_file(name: &str, file: &str) -> Vec<u8> {
    bytes(&first_member(&made(name)).join(file))
}

fn in_member(name: &str, file: &str, bytes: &[u8]) -> bool {
    let root = made(name);
    let _replaced = Replaced::by(bytes, first_member(&root).join(file));
    let Ok(Some(plan)) = Plan::read(&root) else { return false };
    shown(&plan, &root)
}

/// Whether anything is known of the members; their tables and plots are made.
fn shown(plan: &Plan, root: &Path) -> bool {
    let found = gather(plan, root);
    assert!(!csv(plan, &found).is_empty() && !markdown(plan, &found).is_empty());
    for key in sweep::drawn_keys(plan) {
        let _ = sweep::figure(plan, &found, key);
    }
    found.first().is_some_and(|member| !member.measures.is_empty())
}

fn gathered(bytes: &[u8]) -> bool {
    let root = made("point");
    let _replaced = Replaced::by(bytes, root.join(Study::FILE));
    let (Ok(Some(study)), Ok(Some(plan))) = (Study::read(&root), Plan::read(&root)) else {
        return false;
    };
    let page = study.page(&plan, &root);
    page.said.len() < 1 << 20 && page.files.iter().all(|(_, text)| !text.is_empty())
}
