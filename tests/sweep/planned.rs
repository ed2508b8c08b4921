//! Sweeps that are planned, and whose members are run by themselves.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use super::{GROWING, folder, rows, rumple, statuses, text};
use crate::run::program;

#[test]
fn a_planned_sweep_is_run_member_by_member() {
    let folder = folder(GROWING);
    let root = folder.path().join("it's 100% o\"ut");
    let sweep = |more: &[&str]| {
        let all = ["sweep", "scene.toml", "--out", root.to_str().unwrap(), "--seeds", "5"];
        let out = rumple(folder.path(), &[&all[..], more].concat());
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stdout)
    };
    assert!(sweep(&["--plan"]).contains("members 0 to 4: rumple sweep member"));
    assert!(!root.join("members").exists(), "nothing runs");
    let member =
        |number: &str| rumple("/".as_ref(), &["sweep", "member", root.to_str().unwrap(), number]);
    for number in ["1", "3", "3"] {
        let out = member(number);
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
    assert_eq!(member("5").status.code(), Some(2));
    // The rest here.
    sweep(&["--quiet"]);
    assert_eq!(statuses(&rows(&root.join("sweep.csv"))), ["complete"; 5]);
}

#[test]
fn one_member_is_in_the_singular() {
    let folder = folder(GROWING);
    let sweep = ["sweep", "scene.toml", "--out", "out", "--over", "material.thickness=0.5"];
    let plan = rumple(folder.path(), &[&sweep[..], &["--plan"]].concat());
    assert!(text(&plan.stdout).starts_with("member 0: rumple"), "{}", text(&plan.stdout));
    let out = rumple(folder.path(), &sweep);
    let said = text(&out.stdout) + &text(&out.stderr);
    assert!(said.contains("running 1 member,") && !said.contains("1 members"), "{said}");
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("1 member; ") && !page.contains("1 members"));
}

/// The blocks of a shell in the section `title` of a page of the book, with `folder` in place of `/shared`.
fn blocks(page: &str, title: &str, folder: &Path) -> Vec<String> {
    let section = page.split(&format!("\n## {title}\n")).nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let blocks = section.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    blocks.map(|block| block.replace("/shared", folder.to_str().unwrap())).collect()
}

/// What a shell prints of `lines` in `folder`, in whose `bin` programs are looked up first.
fn shell(folder: &Path, lines: &str) -> String {
    let path = format!("{}:/usr/bin:/bin", folder.join("bin").display());
    let mut shell = Command::new("sh");
    let out = shell.current_dir(folder).env("PATH", path).args(["-ec", lines]).output().unwrap();
    assert!(out.status.success(), "{lines}: {}{}", text(&out.stdout), text(&out.stderr));
    text(&out.stdout)
}

fn script(folder: &Path, name: &str, lines: &str) {
    fs::create_dir_all(folder.join("bin")).unwrap();
    let path = folder.join("bin").join(name);
    fs::write(&path, format!("#!/bin/sh\n{lines}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn the_job_array_of_the_manual_runs_all_members() {
    let folder = folder(GROWING);
    let folder = folder.path();
    // In place of Slurm: the tasks one after another.
    let range = r"sed -n 's/^#SBATCH --array=\([0-9]*\)-\([0-9]*\).*/\1 \2/p'";
    let tasks = "SLURM_ARRAY_TASK_ID=$task sh \"$1\" || exit 1";
    let lines = format!("for task in $(seq $({range} \"$1\")); do {tasks}; done");
    script(folder, "sbatch", &lines);
    symlink(program(), folder.join("bin/rumple")).unwrap();
    let page = include_str!("../../docs/book/manual/sweeps.md");
    let blocks = blocks(page, "On a cluster", folder);
    let [plan, array, collect] = &blocks[..] else { panic!("{blocks:?}") };
    fs::write(folder.join("map.sbatch"), array).unwrap();
    let said = shell(folder, &plan.replace("models/model-i/spots.toml", "scene.toml"));
    assert!(said.contains("members 0 to 19: "), "{said}");
    let said = shell(folder, collect);
    assert!(said.contains("20 members: 20 complete"), "{said}");
    assert_eq!(statuses(&rows(&folder.join("map/sweep.csv"))), ["complete"; 20]);
}

#[test]
fn the_job_script_of_the_manual_for_ranks_runs_or_resumes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    script(folder, "mpirun", "echo $OMPI_MCA_odls_base_sigkill_timeout \"$@\"");
    let page = include_str!("../../docs/book/manual/ranks.md");
    let script = &blocks(page, "As a job of Slurm", folder)[0];
    let results = folder.join("results");
    let run = format!("25 rumple run scene.toml --out {}\n", results.display());
    assert_eq!(shell(folder, script), run);
    fs::create_dir(&results).unwrap();
    fs::write(results.join("resolved.toml"), "").unwrap();
    assert_eq!(shell(folder, script), format!("25 rumple resume {}\n", results.display()));
}
