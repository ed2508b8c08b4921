//! Commands on a sheet over ranks: what they refuse, and where. Ranks are threads.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use rumple::kinetics::PluginSearch;
use rumple::output::ResultDirectory;
use rumple::reduction::Communicator;
use rumple::run::{ranks, resume};
use rumple::scene::Scene;
use rumple::{Error, Simulation};

use super::program::{folder, passes, rumple, text};
use crate::coupled::ranks::ThreadRank;

const SCENE: &str = "sheet = { shape = 'disc', radius = 2.0, vertices = 60 }
material = { young = 1e3, poisson = 0.3, thickness = 0.1 }
time = { until = 1.0 }
output = { format = 'vtu' }
effect = [
    { kind = 'stretching', model = 'stvk' },
    { kind = 'pin', where = 'rim', axes = 'xyz' },
# more
]
";

/// What each of `size` ranks has of `work`.
fn on_ranks<T: Send>(size: usize, work: impl Fn(Arc<dyn Communicator>) -> T + Sync) -> Vec<T> {
    let work = &work;
    std::thread::scope(|scope| {
        let ranks = ThreadRank::all(size).into_iter();
        let threads: Vec<_> = ranks.map(|rank| scope.spawn(move || work(rank))).collect();
        threads.into_iter().map(|thread| thread.join().expect("a rank has panicked")).collect()
    })
}

/// Why every one of `size` ranks refuses to resume the run in `root`.
fn refusals(root: &Path, size: usize) -> Vec<String> {
    on_ranks(size, |rank| {
        let own = ranks::root(root, &*rank);
        let directory = match own.is_dir() {
            true => ResultDirectory::reopen(&own).unwrap(),
            false => ResultDirectory::prepare(&own, false).unwrap(),
        };
        let search = PluginSearch::in_directories(Vec::new());
        let resumed = resume::resume_on(root, &directory, &[], &search, Some(rank));
        resumed.err().expect("it is resumed").to_string()
    })
}

/// It was said that no step has a checkpoint of each of its 1 ranks.
#[test]
fn a_complete_run_without_checkpoints_is_called_complete_on_other_ranks() {
    let here = folder(SCENE);
    passes(here.path(), "run scene.toml --out done --quiet");
    let root = here.path().join("done");
    let checkpoints = root.join("checkpoints");
    if checkpoints.is_dir() {
        fs::remove_dir_all(&checkpoints).unwrap();
    }
    for size in [1, 2] {
        for said in refusals(&root, size) {
            let words =
                "the run is complete, at time 1, and cannot go further: it has no checkpoint";
            assert!(said.contains(words) && said.contains("`rumple run`"), "{size}: {said}");
            assert!(!said.contains("ranks"), "{size}: {said}");
        }
    }
    // In one process it is called the same.
    let out = rumple(here.path(), &["resume", "done"]);
    assert!(text(&out.stderr).contains("and cannot go further: it has no checkpoint"));
    fs::create_dir(&checkpoints).unwrap();
    fs::write(checkpoints.join("checkpoint_000001.bin"), "cut short").unwrap();
    let words = "none of its checkpoints can be read and fits its results";
    assert!(refusals(&root, 2).iter().all(|said| said.contains(words)));
}

/// All effects of the scene were underlined.
#[test]
fn contact_over_ranks_is_refused_at_its_effect() {
    for (effect, words) in [
        ("{ kind = 'contact' }", "contact does not find the triangles that come near each other"),
        (
            "{ kind = 'adhesion', work = 1.0, distance = 0.1 }",
            "contact does not find the triangles",
        ),
        ("{ kind = 'remodelling', time = 1.0 }", "internal variables are not integrated"),
    ] {
        let scene = SCENE.replace("# more", effect);
        let scene = Scene::parse(&scene, "scene.toml", &[]).unwrap();
        let search = PluginSearch::in_directories(Vec::new());
        let refused = on_ranks(2, |rank| match Simulation::over(&scene, &search, rank) {
            Err(Error::Scene(error)) => error.rendered(false),
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("{effect} is accepted"),
        });
        for said in refused {
            assert!(said.contains("effect[2]"), "{said}");
            assert!(said.contains(words) && said.contains("on more than one rank"), "{said}");
            // The line of the effect, and none of those before it.
            assert!(said.contains("[scene.toml:8:"), "{said}");
        }
    }
}

/// Every rank printed the whole.
#[cfg(not(feature = "mpi"))]
#[test]
fn check_is_refused_where_processes_do_not_know_one_another() {
    let here = folder(SCENE);
    let out = std::process::Command::new(super::program())
        .current_dir(here.path())
        .env("OMPI_COMM_WORLD_SIZE", "2")
        .args(["check", "scene.toml"])
        .output()
        .unwrap();
    assert_eq!(out.status.code(), Some(2));
    assert_eq!(text(&out.stdout), "");
    assert!(text(&out.stderr).contains("built without MPI"), "{}", text(&out.stderr));
}
