//! Scenes, overrides of their keys, and what a sweep varies.

use std::fs;
use std::path::{Path, PathBuf};

use rumple::scene::Scene;
use rumple::study::plan::Axis;

use super::{Reader, bound, file, root};

pub const SCENE: Reader =
    Reader { name: "scene", bound: bound(4, 1024), seeds: scenes, read: scene, repair: None };

pub const OVERRIDE: Reader = Reader {
    name: "override",
    bound: bound(4, 1024),
    seeds: || {
        let texts = [
            "time.until=5",
            "effect[0].kind=\"bending\"",
            "effect.diffusion.coefficient=1e-3",
            "time.integrator={ kind = \"staggered\", step = 0.1 }",
            "kinetics.parameters.\"a\"=[1, 2, { b = nan }]",
            "sheet.shape=sphere",
        ];
        texts.map(|text| text.as_bytes().to_vec()).to_vec()
    },
    read: overridden,
    repair: None,
};

pub const AXIS: Reader = Reader {
    name: "axis",
    bound: bound(4, 1024),
    seeds: || {
        let texts = [
            "material.thickness=0.5,1,1.5",
            "sheet.seed=1..8",
            "kinetics.parameters.k=0.01..10:4:log,20",
            "time.integrator={ kind = \"staggered\", step = 0.1 },[1, 2],'a,b'",
        ];
        texts.map(|text| text.as_bytes().to_vec()).to_vec()
    },
    read: |bytes| match Axis::parse(&String::from_utf8_lossy(bytes)) {
        Ok(axis) => {
            let _ = axis.numbers();
            (0..axis.values.len()).all(|k| axis.overrides(k).count() + axis.label(k).len() > 0)
        }
        Err(_) => false,
    },
    repair: None,
};

/// Those that are shipped, but for long ones.
fn scenes() -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    for folder in ["models", "tests/fuzz/scenes"] {
        collect(&root().join(folder), &mut files);
    }
    files.sort();
    files.iter().filter_map(|path| fs::read(path).ok()).filter(|text| text.len() < 8192).collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            files.push(path);
        }
    }
}

/// What a scene that was read is good for: it is written out and read again; errors point into it.
fn used(scene: &Scene) {
    if let Ok(text) = scene.resolved() {
        let again = Scene::parse(&text, "resolved.toml", &[]);
        let again = again.and_then(|scene| scene.resolved());
        assert!(again.as_ref().is_ok_and(|again| *again == text), "read again: {again:?}");
    }
    // Its formulas are for the reader of laws.
    assert!(scene.kinetics.iter().all(|k| k.law().is_some() != k.rates.is_empty()));
    for (path, _) in scene.files() {
        assert!(!scene.error_at(&path, "wrong", None).rendered(false).is_empty());
    }
}

fn scene(bytes: &[u8]) -> bool {
    match Scene::load(&file("scene.toml", bytes), &[]) {
        Ok(scene) => {
            used(&scene);
            true
        }
        Err(error) => {
            assert!(!error.rendered(false).is_empty());
            false
        }
    }
}

fn overridden(bytes: &[u8]) -> bool {
    const TEXT: &str = include_str!("../scenes/small.toml");
    let text = String::from_utf8_lossy(bytes);
    let overrides: Vec<String> = text.split('\n').map(str::to_owned).collect();
    match Scene::parse(TEXT, "small.toml", &overrides) {
        Ok(scene) => {
            used(&scene);
            true
        }
        Err(error) => {
            assert!(!error.rendered(false).is_empty());
            false
        }
    }
}
