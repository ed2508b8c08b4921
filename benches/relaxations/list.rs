//! The scenes of `list.toml`.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use rumple::scene::Scene;
use serde::Deserialize;

use crate::common::Result;

/// One relaxation, or several in turn.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    pub name: String,
    /// A scene file that `set` and `scene` add to.
    base: Option<PathBuf>,
    /// Overrides.
    #[serde(default)]
    set: Vec<String>,
    /// Tables of a scene; with their usual values `material.young`, `material.poisson` and `time`.
    #[serde(default)]
    scene: toml::Table,
    /// A mesh of rows and columns, in place of `sheet.shape`.
    grid: Option<Grid>,
    /// Times at which it relaxes.
    #[serde(default = "at_0")]
    pub at: Vec<f64>,
    /// In place of `at`: relaxes at the start and then makes steps to this time.
    pub steps_until: Option<f64>,
    #[serde(skip)]
    folder: PathBuf,
}

fn at_0() -> Vec<f64> {
    vec![0.0]
}

/// A rectangle of quadrilaterals, each cut in two.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Grid {
    columns: u32,
    rows: u32,
    width: f64,
    height: f64,
    /// All diagonals in one direction, or in turn.
    #[serde(default)]
    crossed: bool,
    /// Columns get wider from left to right, by this ratio altogether.
    #[serde(default = "even")]
    grade: f64,
    /// Interior vertices are moved by up to this share of an edge.
    #[serde(default)]
    jitter: f64,
}

fn even() -> f64 {
    1.0
}

#[derive(Deserialize)]
struct List {
    relaxation: Vec<Entry>,
}

/// All entries; meshes are written to `folder`.
pub fn read(folder: &Path) -> Result<Vec<Entry>> {
    let list: List = toml::from_str(include_str!("list.toml"))?;
    let mut all = list.relaxation;
    all.iter_mut().for_each(|entry| entry.folder = folder.to_owned());
    Ok(all)
}

impl Entry {
    /// The scene with the overrides `keys`, which come last.
    pub fn scene(&self, keys: &[String]) -> Result<Scene> {
        let mut text = match &self.base {
            Some(base) => fs::read_to_string(base)?,
            None => String::new(),
        };
        let mut set = self.set.clone();
        if let Some(grid) = self.grid {
            let file = self.folder.join(format!("{}.obj", self.name.replace([' ', ','], "-")));
            fs::write(&file, grid.obj())?;
            let file = fs::canonicalize(file)?;
            set.push(format!("sheet.file={:?}", file.display().to_string()));
        }
        if self.base.is_none() {
            let mut scene = self.scene.clone();
            let table = |scene: &mut toml::Table, name: &str| -> toml::Table {
                let given = scene.remove(name);
                given.and_then(|v| v.as_table().cloned()).unwrap_or_default()
            };
            let mut material = table(&mut scene, "material");
            material.entry("young").or_insert(1e6.into());
            material.entry("poisson").or_insert((1.0 / 3.0).into());
            let mut time = table(&mut scene, "time");
            time.entry("until").or_insert(1.0.into());
            let sheet = table(&mut scene, "sheet");
            scene.insert("sheet".into(), sheet.into());
            scene.insert("material".into(), material.into());
            scene.insert("time".into(), time.into());
            text = toml::to_string(&scene)?;
        }
        set.extend_from_slice(keys);
        let place = self.base.clone().unwrap_or_else(|| "list.toml".into());
        let place = place.display().to_string();
        Ok(Scene::parse(&text, &place, &set).map_err(|e| e.rendered(false))?)
    }
}

impl Grid {
    fn obj(self) -> String {
        let Self { columns, rows, width, height, crossed, grade, jitter } = self;
        let mut text = String::new();
        let ratio = grade.powf(1.0 / f64::from(columns.max(2) - 1));
        let widths: Vec<f64> = (0..columns)
            .scan(1.0, |w, _| {
                *w *= ratio;
                Some(*w)
            })
            .collect();
        let total: f64 = widths.iter().sum();
        let mut noise = 1u64;
        let mut random = || {
            noise = noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            f64::from(u32::try_from(noise >> 33).unwrap_or(0)) / f64::from(1u32 << 30) - 1.0
        };
        for j in 0..=rows {
            let mut x = 0.0;
            for i in 0..=columns {
                let inside = i > 0 && i < columns && j > 0 && j < rows;
                let by = if inside { jitter } else { 0.0 };
                let dx = by * random() * widths[i.min(columns - 1) as usize] * width / total;
                let dy = by * random() * height / f64::from(rows);
                let y = height * f64::from(j) / f64::from(rows);
                let _ = writeln!(text, "v {:.17} {:.17} 0", x * width / total + dx, y + dy);
                x += widths.get(i as usize).copied().unwrap_or(0.0);
            }
        }
        let at = |i: u32, j: u32| j * (columns + 1) + i + 1;
        for j in 0..rows {
            for i in 0..columns {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
                if crossed && (i + j) % 2 == 1 {
                    let _ = writeln!(text, "f {a} {b} {d}\nf {a} {d} {c}");
                } else {
                    let _ = writeln!(text, "f {a} {b} {c}\nf {b} {d} {c}");
                }
            }
        }
        text
    }
}
