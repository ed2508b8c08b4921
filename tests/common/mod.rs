//! Small sheets and numbers that several tests share.

mod counting;

pub use counting::{allocations, kept, peak_of};

use std::path::{Path, PathBuf};

use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::sheet::Sheet;
use rumple::{Simulation, Vec3};

use crate::plugins::build;

/// The folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// The path of a file of the repository, for arguments.
pub fn path(file: &str) -> String {
    root().join(file).display().to_string()
}

/// The text of a file of the repository.
pub fn shipped(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

/// A scene from its text and overrides, set up with the shipped plugins.
pub fn prepare(text: &str, overrides: &[&str]) -> (Scene, Simulation) {
    let keys: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    let scene = Scene::parse(text, "scene.toml", &keys).unwrap_or_else(|e| panic!("{e}"));
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let simulation = Simulation::new(&scene, &search).unwrap_or_else(|e| panic!("{e}"));
    (scene, simulation)
}

/// Reproducible numbers in (-1, 1), by a linear congruential generator.
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(2).wrapping_add(1))
    }

    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        f64::from(u32::try_from(self.0 >> 33).unwrap()) / f64::from(1u32 << 30) - 1.0
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }
}

/// Rows of equilateral triangles of side 1, `columns` × `rows` vertices.
pub fn lattice(columns: usize, rows: usize) -> Sheet {
    let mut rest = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            let shift = if r % 2 == 1 { 0.5 } else { 0.0 };
            rest.push(Vec3::new(c as f64 + shift, r as f64 * 0.75f64.sqrt(), 0.0));
        }
    }
    let at = |c: usize, r: usize| u32::try_from(r * columns + c).unwrap();
    let mut triangles = Vec::new();
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let (a, b, d, e) = (at(c, r), at(c + 1, r), at(c, r + 1), at(c + 1, r + 1));
            if r % 2 == 0 {
                triangles.extend([[a, b, d], [b, e, d]]);
            } else {
                triangles.extend([[a, b, e], [a, e, d]]);
            }
        }
    }
    Sheet::new(rest, triangles).unwrap()
}

/// A lattice with jittered interior vertices: irregular, some obtuse triangles.
pub fn irregular(columns: usize, rows: usize, jitter: f64) -> Sheet {
    let sheet = lattice(columns, rows);
    let mut noise = Noise::new(5);
    let rest = sheet.rest().iter().zip(sheet.boundary());
    let rest = rest.map(|(x, boundary)| {
        let v = noise.vector();
        if *boundary { *x } else { x + jitter * Vec3::new(v.x, v.y, 0.0) }
    });
    Sheet::new(rest.collect(), sheet.triangles().to_vec()).unwrap()
}

/// Icosahedron subdivided `levels` times, projected on the sphere of `radius`.
pub fn icosphere(levels: usize, radius: f64) -> Sheet {
    let g = (1.0 + 5.0f64.sqrt()) / 2.0;
    let mut x: Vec<Vec3> = [
        [-1., g, 0.],
        [1., g, 0.],
        [-1., -g, 0.],
        [1., -g, 0.],
        [0., -1., g],
        [0., 1., g],
        [0., -1., -g],
        [0., 1., -g],
        [g, 0., -1.],
        [g, 0., 1.],
        [-g, 0., -1.],
        [-g, 0., 1.],
    ]
    .iter()
    .map(|p| Vec3::from(*p).normalize())
    .collect();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut middle = std::collections::HashMap::new();
        let mut next = Vec::new();
        for t in &triangles {
            let m: [u32; 3] = std::array::from_fn(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    x.push((x[a as usize] + x[b as usize]).normalize());
                    u32::try_from(x.len() - 1).unwrap()
                })
            });
            next.extend([[t[0], m[0], m[2]], [t[1], m[1], m[0]], [t[2], m[2], m[1]], m]);
        }
        triangles = next;
    }
    Sheet::new(x.into_iter().map(|p| radius * p).collect(), triangles).unwrap()
}

/// Plots of a study, as its viewer reads them, by their names.
pub fn plots(root: &std::path::Path) -> std::collections::BTreeMap<String, serde_json::Value> {
    let text = std::fs::read_to_string(root.join("plots.json")).unwrap();
    let blocks: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let plots = blocks.into_iter().map(|mut block| block["plot"].take()).filter(|p| p.is_object());
    plots.map(|plot| (plot["name"].as_str().unwrap().to_owned(), plot["figure"].clone())).collect()
}
