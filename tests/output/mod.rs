//! What a run writes is whole, exact and readable by others.

mod comparison;
mod directory;
mod interrupt;
mod ledger;
mod picture;
mod progress;
mod provenance;
mod series;
mod vtk;
mod vtu;

use rumple::Vec3;
use rumple::output::{Field, Frame};

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
        let cells = (0..self.triangles.len()).map(|i| rumple::num::real(i).sqrt()).collect();
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
