//! `rumple new`.

use std::fs;

use crate::run::program::{passes, rumple, text};

/// Templates with a shorter end and a coarser mesh.
const TEMPLATES: [(&str, &[&str]); 5] = [
    ("model-i", &["sheet.vertices=300", "time.until=0.02", "output.every=0.02"]),
    ("turing", &["sheet.vertices=200", "time.until=0.5", "output.every=0.5"]),
    ("plate", &["sheet.vertices=200", "time.until=0.2"]),
    ("shell", &["sheet.vertices=300", "time.until=0.1"]),
    ("own-law", &["sheet.vertices=200", "time.until=0.2", "output.every=0.2"]),
];

#[test]
fn every_template_is_checked_without_a_note_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    for (template, shorter) in TEMPLATES {
        let out = rumple(folder.path(), &["new", template, "--from", template]);
        assert!(out.status.success(), "{template}: {}", text(&out.stderr));
        let file = format!("{template}.toml");
        let out = rumple(folder.path(), &["check", &file]);
        assert!(out.status.success(), "{template}: {}", text(&out.stderr));
        let notes = text(&out.stdout) + &text(&out.stderr);
        let noted =
            notes.lines().any(|line| line.starts_with("note") || line.starts_with("warning"));
        assert!(!noted, "{template}: {notes}");
        let mut args =
            vec!["run", &file, "--out", template, "--quiet", "--set", "output.report=false"];
        args.extend(shorter.iter().flat_map(|change| ["--set", *change]));
        let out = rumple(folder.path(), &args);
        assert!(out.status.success(), "{template}: {}", text(&out.stderr));
        assert!(folder.path().join(template).join("sheet.pvd").is_file(), "{template}");
    }
}

#[test]
fn every_value_of_a_template_has_a_comment() {
    let folder = tempfile::tempdir().unwrap();
    // Names of a kind and of a species stand for themselves.
    let plain = ["kind = \"", "species = \"", "species.", "initial.", "rates.", "modulus"];
    for (template, _) in TEMPLATES {
        rumple(folder.path(), &["new", template, "--from", template]);
        let scene = fs::read_to_string(folder.path().join(format!("{template}.toml"))).unwrap();
        let bare = |line: &&str| line.contains(" = ") && !line.contains('#');
        let bare: Vec<&str> = scene
            .lines()
            .filter(bare)
            .filter(|line| !plain.iter().any(|known| line.starts_with(known)))
            .collect();
        assert!(bare.is_empty(), "{template}: {bare:?}");
    }
}

#[test]
fn nothing_is_overwritten_and_wrong_names_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let new = |args: &[&str]| rumple(folder.path(), &[&["new"], args].concat());
    assert!(new(&["mine.toml"]).status.success());
    let file = folder.path().join("mine.toml");
    fs::write(&file, "edited").unwrap();
    let out = new(&["mine"]);
    assert_eq!(out.status.code(), Some(2));
    let message = text(&out.stderr);
    assert!(message.contains("mine.toml") && message.contains("--force"), "{message}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "edited");
    assert!(new(&["mine", "--force", "--from", "plate"]).status.success());
    assert!(fs::read_to_string(&file).unwrap().starts_with("# A round plate"));
    let out = new(&["other", "--from", "turin"]);
    assert_eq!(out.status.code(), Some(2));
    let message = text(&out.stderr);
    assert!(message.contains("'turing'") && message.contains("own-law"), "{message}");
    assert!(!folder.path().join("other.toml").exists());
    for wrong in ["..", "missing/scene"] {
        let out = new(&[wrong]);
        assert_eq!(out.status.code(), Some(2), "{wrong}: {}", text(&out.stderr));
    }
}

#[test]
fn a_schema_is_written_beside_and_named_first() {
    let folder = tempfile::tempdir().unwrap();
    passes(folder.path(), "new mine --from own-law --schema");
    let scene = fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert!(scene.starts_with("#:schema ./rumple.schema.json\n# A law of your own"), "{scene}");
    let schema = fs::read_to_string(folder.path().join("rumple.schema.json")).unwrap();
    assert!(serde_json::from_str::<serde_json::Value>(&schema).is_ok());
    assert!(rumple(folder.path(), &["check", "mine.toml"]).status.success());
}
