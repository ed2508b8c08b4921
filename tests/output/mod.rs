//! What a run writes is whole, exact and readable by others.

mod comparison;
mod directory;
mod interrupt;
mod ledger;
mod progress;
mod provenance;
mod series;
mod vtu;

use std::path::Path;
use std::process::Command;

use rumple::Vec3;
use rumple::output::{Field, Frame};
use sha2::{Digest, Sha256};

use crate::common::path;

/// A wavy strip of `n × n` points with awkward numbers in its fields.
pub struct Patch {
    pub points: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub numbers: Vec<f64>,
}

impl Patch {
    pub fn new(n: u32) -> Self {
        let points = (0..n * n)
            .map(|i| {
                let (x, y) = (f64::from(i % n), f64::from(i / n));
                Vec3::new(x / 3.0, y / 7.0, (x * 0.3).sin() * (y * 0.2).cos())
            })
            .collect::<Vec<_>>();
        let triangles = (0..(n - 1) * (n - 1))
            .flat_map(|i| {
                let a = i / (n - 1) * n + i % (n - 1);
                [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
            })
            .collect();
        let special = [
            0.0,
            -0.0,
            0.1 + 0.2,
            f64::MIN_POSITIVE,
            f64::from_bits(1),
            f64::MAX,
            -1.0 / 3.0,
            std::f64::consts::PI,
        ];
        // Bit patterns of a Weyl sequence, exponents held to those of finite numbers.
        let numbers = (0..u64::from(n * n))
            .map(|i| {
                let bits = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                usize::try_from(i)
                    .ok()
                    .and_then(|i| special.get(i).copied())
                    .unwrap_or(f64::from_bits(bits & !(1 << 62)))
            })
            .collect();
        Self { points, triangles, numbers }
    }

    pub fn frame(&self, time: f64, step: u64) -> Frame<'_> {
        let cells: Vec<f64> =
            (0..self.triangles.len()).map(|i| rumple::num::real(i).sqrt()).collect();
        Frame {
            time,
            step,
            points: &self.points,
            triangles: &self.triangles,
            point: vec![
                Field::scalar("awkward [1]", self.numbers.clone()),
                Field::scalar("a < b & \"c\" [µ/length²]", self.numbers.clone()),
                Field::vector("displacement [length]", &self.points),
            ],
            cell: vec![Field::scalar("root [1]", cells)],
            field_data: vec![("energy bending [energy]".to_owned(), 1.0 / 3.0)],
        }
    }
}

/// The real VTK reads the frames in `folder` to the last bit: it hashes every array of `patch`, and so
/// does this.
pub fn assert_digests(folder: &Path, patch: &Patch, times: &[f64]) {
    let python = std::env::var("RUMPLE_PYTHON").expect("RUMPLE_PYTHON names the interpreter");
    let script = path("tests/scripts/check_vtk.py");
    let output = Command::new(&python)
        .args([&script, "--digest"])
        .arg(folder)
        .output()
        .expect("the interpreter runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    let frame = patch.frame(0.0, 0);
    let points = Field::vector("points", frame.points);
    let point = frame.point.iter().map(|f| ("point", f));
    let cell = frame.cell.iter().map(|f| ("cell", f));
    for (kind, field) in point.chain(cell).chain([("points", &points)]) {
        let mut hasher = Sha256::new();
        field.data.iter().for_each(|x| hasher.update(x.to_le_bytes()));
        let hash = hasher.finalize().iter().map(|b| format!("{b:02x}")).collect::<String>();
        let line = format!("digest\t{kind}\t{}\t{hash}", field.name);
        let seen = text.lines().filter(|l| l.trim_end() == line).count();
        assert_eq!(seen, times.len(), "{line}\nnot in every frame of\n{text}");
    }
    for time in times {
        let line = format!("time\t{:016x}", time.to_bits());
        assert!(text.lines().any(|l| l == line), "{line}\nnot in\n{text}");
    }
}
