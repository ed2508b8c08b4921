//! Sweeps from beginning to end: members are runs, failures keep their place.

use std::fs;

use super::{GROWING, folder, number, rows, rumple, statuses, text};
use crate::common::plots;
use crate::run::program::passes;

#[test]
fn every_member_is_the_run_with_its_overrides() {
    let folder = folder(GROWING);
    passes(
        folder.path(),
        "sweep scene.toml --out out --over material.thickness=0.4,0.8 --over \
         kinetics.parameters.a=1,4 --set time.until=0.1",
    );
    let root = folder.path().join("out");
    let table = rows(&root.join("sweep.csv"));
    assert_eq!(statuses(&table), ["complete"; 4]);
    let keys: Vec<(&str, &str)> = table
        .iter()
        .map(|row| (&*row["material.thickness"], &*row["kinetics.parameters.a"]))
        .collect();
    assert_eq!(keys, [("0.4", "1"), ("0.4", "4"), ("0.8", "1"), ("0.8", "4")]);
    for row in &table {
        for column in ["CPU [s]", "memory [MB]", "steps", "amplitude [length]"] {
            assert!(number(row, column) > 0.0, "{column}: {row:?}");
        }
        assert_eq!(number(row, "time"), 0.1);
        assert_eq!(row["time to steady"], "", "it was still changing");
    }
    // The last member, run by itself: the same bytes.
    let set = ["--set", "material.thickness=0.8", "--set", "kinetics.parameters.a=4"];
    let run = ["run", "scene.toml", "--out", "alone", "--set", "time.until=0.1", "--quiet"];
    let out = rumple(folder.path(), &[&run[..], &set].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let frame = |path: &str| fs::read(folder.path().join(path).join("frames/frame_000001.vtu"));
    let member = format!("out/members/{}", table[3]["member"]);
    assert_eq!(frame("alone").unwrap(), frame(&member).unwrap());
    // Its energy is that of the ledger.
    let ledger = rows(&folder.path().join("alone/ledger.csv"));
    let energy = number(ledger.last().unwrap(), "total energy [energy]");
    assert!((number(&table[3], "energy [energy]") / energy - 1.0).abs() < 1e-12);
    // The page for people has a row for each, and what is printed is that page.
    let page = fs::read_to_string(root.join("sweep.md")).unwrap();
    assert_eq!(page.lines().filter(|line| line.starts_with("| 0.")).count(), 4, "{page}");
    let printed = rumple(folder.path(), &["sweep", "collect", "out"]);
    assert!(text(&printed.stdout).contains(page.trim_end()), "{page}");
    assert_eq!(plots(&root).into_keys().collect::<Vec<_>>(), ["a", "thickness"]);
}

#[test]
fn failed_members_keep_their_place_and_the_exit_code_says_so() {
    let folder = folder(GROWING);
    let sweep = |more: &[&str]| {
        let args =
            ["sweep", "scene.toml", "--out", "out", "--over", "kinetics.parameters.a=1,-1,4"];
        rumple(folder.path(), &[&args[..], more].concat())
    };
    let out = sweep(&[]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{message}");
    assert!(message.contains("1 of 3 members") && message.contains("a = -1: failed"), "{message}");
    let root = folder.path().join("out");
    let table = rows(&root.join("sweep.csv"));
    assert_eq!(statuses(&table), ["complete", "failed", "complete"]);
    assert!(!table[1]["reason"].is_empty() && table[0]["reason"].is_empty(), "{table:?}");
    let page = fs::read_to_string(root.join("sweep.md")).unwrap();
    assert!(page.contains("| -1") && page.contains("* a = -1: failed: "), "{page}");
    let across = &plots(&root)["a"]["panels"][0]["across"];
    assert!(across.as_str().unwrap().contains("× failed"), "the axis explains the crosses");
    // It is not run again unless asked for; the others never.
    let started = |number: usize| {
        let path = root.join("members").join(&table[number]["member"]).join("status.json");
        fs::read_to_string(path).unwrap()
    };
    let before = [0, 1, 2].map(started);
    assert_eq!(sweep(&[]).status.code(), Some(1));
    assert_eq!([0, 1, 2].map(started), before);
    assert_eq!(sweep(&["--retry-failed"]).status.code(), Some(1));
    let after = [0, 1, 2].map(started);
    assert_eq!((&after[0], &after[2]), (&before[0], &before[2]));
    assert_ne!(after[1], before[1]);
    assert_eq!(rumple(folder.path(), &["sweep", "collect", "out"]).status.code(), Some(1));
}

/// Both columns were called `coefficient`.
#[test]
fn two_coefficients_in_a_table_say_of_which_species() {
    let scene = GROWING
        .replace("coefficient = 0.5 },", "coefficient = 0.5 },\n    DIFFUSION")
        .replace("DIFFUSION", "{ kind = \"diffusion\", species = \"b\", coefficient = 0.5 },")
        .replace("rates.c =", "rates.b = \"-b\"\nrates.c =");
    let folder = folder(&scene);
    let over = ["--over", "effect[3].coefficient=0.5,1", "--over", "effect[4].coefficient=2"];
    let out =
        rumple(folder.path(), &[&["sweep", "scene.toml", "--out", "out"][..], &over].concat());
    let (said, told) = (text(&out.stdout), text(&out.stderr));
    assert!(out.status.success(), "{told}");
    let head = said.lines().next().unwrap();
    for title in ["coefficient of diffusion of c", "coefficient of diffusion of b"] {
        assert_eq!(head.matches(title).count(), 1, "{head}");
    }
    assert!(
        told.contains("coefficient of diffusion of c = 0.5, coefficient of diffusion of b = 2")
    );
    assert!(told.contains("running 2 members, at most "), "{told}");
    assert!(said.contains("2 members: 2 complete; tables and plots are in "), "{said}");
    let table = rows(&folder.path().join("out/sweep.csv"));
    assert_eq!(table[1]["effect[3].coefficient"], "1");
}

#[test]
fn the_time_to_steady_is_that_of_a_run_that_ended_for_it() {
    let scene = GROWING.replace("until = 0.2,", "until = 50.0, stop_when_steady = 0.01,");
    let folder = folder(&scene);
    let out = passes(folder.path(), "sweep scene.toml --out out --over time.until=0.5,50 --quiet");
    assert!(out.stdout.is_empty() && out.stderr.is_empty(), "{}", text(&out.stderr));
    let table = rows(&folder.path().join("out/sweep.csv"));
    assert_eq!(table[0]["time to steady"], "");
    let steady = number(&table[1], "time to steady");
    assert!(steady > 0.5 && steady < 20.0 && steady == number(&table[1], "time"), "{steady}");
}

#[test]
fn seeds_change_everything_random_and_nothing_else() {
    let scene = GROWING.replace("bump = {", "imperfection = { amplitude = 1e-3 }, bump = {");
    let folder = folder(&scene);
    passes(folder.path(), "sweep scene.toml --out out --seeds 3");
    let root = folder.path().join("out");
    let table = rows(&root.join("sweep.csv"));
    let seeds: Vec<&str> = table.iter().map(|row| row["seed"].as_str()).collect();
    assert_eq!(seeds, ["1", "2", "3"]);
    let resolved = |row: usize| {
        let path = root.join("members").join(&table[row]["member"]).join("resolved.toml");
        fs::read_to_string(path).unwrap()
    };
    let (one, three) = (resolved(0), resolved(2));
    let differ = one.lines().zip(three.lines()).filter(|(a, b)| a != b);
    let differ: Vec<(&str, &str)> = differ.collect();
    assert_eq!(differ, [("seed = 1", "seed = 3"); 2]);
    let energies: Vec<f64> = table.iter().map(|row| number(row, "energy [energy]")).collect();
    assert!(energies[0] != energies[1] && energies[1] != energies[2], "{energies:?}");
    // Seeds are the only key here, and so it is drawn.
    assert!(plots(&root).contains_key("seed"));
}
