//! Sweeps as array jobs: the script anywhere, the jobs on a real Slurm.

use std::fs;
use std::path::Path;
use std::process::Command;

use rumple::study::run::RankJob;

use super::resumed::{slow, status_of, wait_until};
use super::{GROWING, folder, rows, rumple, statuses, text};
use crate::run::program::passes;

#[test]
fn the_job_script_has_a_task_for_every_member_that_is_left() {
    let folder = folder(GROWING);
    let sweep = |args: &[&str]| {
        let all = ["sweep", "scene.toml", "--out", "it's 100% o\"ut", "--seeds", "5"];
        rumple(folder.path(), &[&all[..], args].concat())
    };
    let slurm = ["--slurm", "--no-submit"];
    let more = [
        "--jobs",
        "2",
        "--threads",
        "3",
        "--slurm-option=--time=1:00:00",
        "--slurm-option",
        "-A x",
    ];
    let out = sweep(&[&slurm[..], &more].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("it's 100% o\"ut");
    let script = || fs::read_to_string(root.join("sweep.sbatch")).unwrap();
    let lines = [
        "#SBATCH --array=0-4%2",
        "#SBATCH --cpus-per-task=3",
        "#SBATCH --time=1:00:00",
        "#SBATCH -A x",
        "#SBATCH --job-name=\"scene\"",
    ];
    for line in lines {
        assert!(script().lines().any(|l| l == line), "{line} in {}", script());
    }
    assert!(script().contains("/it's 100%% o\\\"ut/slurm/%A_%a.log"), "{}", script());
    assert!(!root.join("members").exists(), "nothing runs");
    // A shell runs a task from it.
    let run = |task: &str| {
        let mut shell = Command::new("sh");
        shell.arg(root.join("sweep.sbatch")).env("SLURM_ARRAY_TASK_ID", task);
        shell.current_dir("/").output().unwrap()
    };
    for task in ["1", "3", "3"] {
        let out = run(task);
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
    assert_eq!(run("5").status.code(), Some(2));
    let out = sweep(&slurm);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(script().lines().any(|l| l == "#SBATCH --array=0,2,4"), "{}", script());
    // The rest here.
    let out = sweep(&["--quiet"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert_eq!(statuses(&rows(&root.join("sweep.csv"))), ["complete"; 5]);
    let out = sweep(&["--slurm-option=time", "--slurm", "--force"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("--slurm-option"), "{}", text(&out.stderr));
}

#[test]
fn the_job_script_of_a_run_over_ranks_runs_or_resumes() {
    let folder = folder(GROWING);
    let root = folder.path().join("it's 100% o\"ut");
    // In place of a launcher and of the program: they print their words.
    let job = RankJob {
        root: &root,
        program: "program".into(),
        scene: folder.path().join("scene.toml"),
        run: vec!["--set".into(), "a=\"it's\"".into()],
        resume: vec!["--quiet".into()],
        ranks: 3,
        threads: 2,
        launcher: "echo",
        options: &["--time=1:00:00".into()],
    };
    let path = job.write().unwrap();
    assert_eq!(path, folder.path().join("it's 100% o\"ut.sbatch"));
    let script = fs::read_to_string(&path).unwrap();
    for line in ["--ntasks=3", "--cpus-per-task=2", "--time=1:00:00", "--signal=B:TERM@60"] {
        assert!(script.lines().any(|l| l == format!("#SBATCH {line}")), "{line} in {script}");
    }
    assert!(script.contains("/it's 100%% o\\\"ut.log\""), "{script}");
    let said = || text(&Command::new("sh").arg(&path).output().unwrap().stdout);
    let scene = job.scene.display();
    let run = format!("program run {scene} --out {} --set a=\"it's\"\n", root.display());
    assert_eq!(said(), run);
    fs::create_dir(&root).unwrap();
    fs::write(root.join("resolved.toml"), "").unwrap();
    let resumed = format!("program resume {} --quiet\n", root.display());
    assert_eq!(said(), resumed);
    let wrong = RankJob { options: &["time".into()], ..job };
    assert!(wrong.script().unwrap_err().to_string().contains("--slurm-option"));
}

#[cfg(not(feature = "mpi"))]
#[test]
fn a_program_without_mpi_submits_no_ranks() {
    let folder = folder(GROWING);
    let all = ["run", "scene.toml", "--out", "out", "--slurm", "--ranks", "2", "--no-submit"];
    let out = rumple(folder.path(), &all);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("--features mpi"), "{}", text(&out.stderr));
    let out = rumple(folder.path(), &["run", "scene.toml", "--slurm", "--ranks", "2"]);
    assert!(text(&out.stderr).contains("--out"), "{}", text(&out.stderr));
}

fn slurm(program: &str, args: &[&str]) -> String {
    let out = Command::new(program).args(args).output().unwrap();
    assert!(out.status.success(), "{program}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// A sweep with a member that fails goes through an array job, is cancelled in the middle, continues as
/// another job, and gathers the same numbers as here.
#[test]
#[ignore = "needs Slurm: run under tests/scripts/slurm.sh; tests/run.sh does"]
fn real_slurm_runs_a_sweep_that_is_cancelled_and_goes_on() {
    let folder = folder(&slow());
    let root = folder.path().join("out");
    let member = |a: &str| root.join("members").join(format!("a={a}"));
    let over =
        ["sweep", "scene.toml", "--out", "out", "--over", "kinetics.parameters.a=1,2,-1,4,5"];
    let submit = || rumple(folder.path(), &[&over[..], &["--slurm", "--jobs", "1"]].concat());
    let out = submit();
    assert!(out.status.success(), "{}", text(&out.stderr));
    let job = fs::read_to_string(root.join("slurm/job")).unwrap().trim().to_owned();
    assert!(text(&out.stdout).contains(&format!("job {job}: 5 tasks")), "{}", text(&out.stdout));
    wait_until("the second task", || {
        status_of(&member("1")) == "complete" && has_rows(&member("2"), 2)
    });
    // While it is queued no other sweep begins.
    let again = submit();
    assert_eq!(again.status.code(), Some(2), "{}", text(&again.stderr));
    assert!(text(&again.stderr).contains(&format!("job {job}")), "{}", text(&again.stderr));
    // What there is so far.
    passes(folder.path(), "sweep collect out");
    let table = root.join("sweep.csv");
    assert_eq!(
        statuses(&rows(&table)),
        ["complete", "running", "not begun", "not begun", "not begun"]
    );
    let done = fs::read(member("1").join("status.json")).unwrap();
    slurm("scancel", &[&job]);
    wait_until("the job is gone", || slurm("squeue", &["-h"]).trim().is_empty());
    assert_eq!(status_of(&member("2")), "interrupted");
    // The rest as another job.
    let out = submit();
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains("4 tasks"), "{}", text(&out.stdout));
    wait_until("the second job", || slurm("squeue", &["-h"]).trim().is_empty());
    let out = rumple(folder.path(), &["sweep", "collect", "out"]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    let found = rows(&table);
    assert_eq!(statuses(&found), ["complete", "complete", "failed", "complete", "complete"]);
    assert_eq!(fs::read(member("1").join("status.json")).unwrap(), done, "it was run again");
    // The same here.
    let mut here = over;
    here[3] = "here";
    assert_eq!(rumple(folder.path(), &here).status.code(), Some(1));
    let table = rows(&folder.path().join("here/sweep.csv"));
    for (a, b) in found.iter().zip(&table) {
        for column in ["time", "spots", "share", "amplitude [length]", "energy [energy]", "steps"] {
            assert_eq!(a[column], b[column], "{column}");
        }
    }
}

fn has_rows(member: &Path, count: usize) -> bool {
    let text = fs::read_to_string(member.join("measures.csv")).unwrap_or_default();
    text.lines().count() > count
}
