//! `--json`: one document on standard output, of what the text says; `--color` and `--version`.

use std::path::Path;

use serde_json::Value;

use super::SMALL;
use super::program::{folder, passes, rumple, text};

/// The document that a command prints, and its exit code.
fn document(folder: &Path, words: &str) -> (Value, i32) {
    let out = rumple(folder, &words.split_whitespace().collect::<Vec<_>>());
    let json = text(&out.stdout);
    let read = serde_json::from_str(&json);
    let value = read.unwrap_or_else(|e| panic!("{words}: {e}: {json}{}", text(&out.stderr)));
    (value, out.status.code().unwrap())
}

#[test]
fn a_check_is_what_its_text_says() {
    let folder = folder(SMALL);
    let said = text(&passes(folder.path(), "check scene.toml").stdout);
    let (json, code) = document(folder.path(), "check scene.toml --json");
    assert_eq!((code, &json["scene"]), (0, &"scene.toml".into()));
    assert_eq!(json["effect"][0], "stretching");
    assert!(json["sheet"]["vertices"].as_u64().unwrap() >= 390, "{json}");
    assert!(json["unknowns"][0]["positions"].as_u64().unwrap() > 1000, "{json}");
    let boundary = "curvatures that laws read are 0 at the boundary";
    assert_eq!(json["boundary"][0], boundary);
    for part in [boundary, json["policy"].as_str().unwrap(), "species    c on vertices"] {
        assert!(said.contains(part), "no {part} in {said}");
    }
    assert!(
        said.contains("curvatures of frames are extrapolated to the boundary from within"),
        "{said}"
    );
    let refused = rumple(folder.path(), &["check", "scene.toml", "--json", "--set", "sheet.x=1"]);
    assert_eq!((refused.status.code(), refused.stdout.len()), (Some(2), 0));
}

#[test]
fn studies_and_branches_print_how_they_ended() {
    let folder = folder(
        "sheet = { shape = \"sphere\", radius = 2.0, vertices = 60 }\ntime = { until = 1.0 }\n\
         output = { report = false }\n[kinetics]\nrates.c = \"k - c\"\nparameters.k = 1.0\n",
    );
    let sweep = "sweep scene.toml --over kinetics.parameters.k=1,2 --out s --json";
    let (json, code) = document(folder.path(), sweep);
    assert_eq!((code, &json["status"]), (0, &"complete".into()), "{json}");
    assert!(json["directory"].as_str().unwrap().ends_with("/s"), "{json}");
    let members = json["members"].as_array().unwrap();
    let names: Vec<_> = members.iter().map(|member| member["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["k = 1", "k = 2"]);
    assert!(members.iter().all(|member| member["status"] == "complete"), "{json}");
    let compare = "compare scene.toml --policies quasi-static,simultaneous --out c --json";
    assert_eq!(document(folder.path(), compare).0["members"].as_array().unwrap().len(), 2);

    let beam = folder.path().join("beam.toml");
    std::fs::write(
        &beam,
        "sheet = { shape = \"rectangle\", width = 4.0, height = 1.0, vertices = 150 }\n\
         material = { young = 1e3, poisson = 0.3, thickness = 0.5 }\ntime = { until = 1.0 }\n\
         effect = [{ kind = \"stretching\" }, { kind = \"bending\" }, \
         { kind = \"pin\", where = \"rim\", axes = \"xyz\" }, { kind = \"pressure\", value = 1.0 }]\n\
         output = { report = false }\n",
    )
    .unwrap();
    let follow =
        "follow beam.toml --along effect.pressure.value --from 0 --to 1 --steps 3 --out f --json";
    let (json, code) = document(folder.path(), follow);
    assert_eq!((code, &json["status"]), (0, &"complete".into()), "{json}");
    assert!(json["events"].is_array(), "{json}");
}

#[test]
fn plugins_are_listed_described_and_validated() {
    let folder = folder(SMALL);
    let (json, _) = document(folder.path(), "plugin list --json");
    let plugins = json["plugins"].as_array().unwrap();
    let known = plugins.iter().find(|plugin| plugin["name"] == "curvature-feedback").unwrap();
    assert!(Path::new(known["file"].as_str().unwrap()).is_file(), "{json}");
    assert!(json["directories"].as_array().is_some_and(|all| !all.is_empty()), "{json}");
    let (json, _) = document(folder.path(), "plugin describe curvature-feedback --json");
    assert_eq!(json["species"][0]["name"], "c");
    let reads = json["reads"].as_array().unwrap();
    assert!(reads.iter().any(|read| read["name"] == "mean_curvature"), "{json}");
    let (json, _) = document(folder.path(), "plugin describe scene.toml --json");
    let parameters = json["parameter"].as_array().unwrap();
    let b = parameters.iter().find(|parameter| parameter["name"] == "b").unwrap();
    assert_eq!(b["value"], "20");
    let (json, code) = document(folder.path(), "plugin validate scene.toml --json");
    assert_eq!((code, &json["faults"], &json["seed"]), (0, &0.into(), &1.into()), "{json}");
    let checks = json["checks"].as_array().unwrap();
    assert!(checks.len() > 5 && checks.iter().all(|check| check["verdict"] != "FAULT"), "{json}");
}

#[test]
fn colours_are_chosen_and_the_version_is_stated() {
    let folder = folder(SMALL);
    for (choice, coloured) in [("always", true), ("never", false), ("auto", false)] {
        // A mistake in a scene, another, one of the command line, and a retired option.
        for line in ["check scene.toml --set sheet.x=1", "view none", "check", "run a --slurm"] {
            let mut args: Vec<&str> = line.split(' ').collect();
            args.extend(["--color", choice]);
            let said = text(&rumple(folder.path(), &args).stderr);
            assert_eq!(said.contains('\u{1b}'), coloured, "{line} {choice}: {said}");
        }
    }
    let said = text(&passes(folder.path(), "--version").stdout);
    let version = format!("rumple {}", env!("CARGO_PKG_VERSION"));
    let rest = said.trim_end().strip_prefix(&version).unwrap_or_else(|| panic!("{said}"));
    assert!(rest.is_empty() || rest.starts_with(" (") && rest.ends_with(')'), "{said}");
}
