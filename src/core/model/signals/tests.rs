//! Derivatives of one-sided curvatures on a periodic strip against central differences.

use super::*;
use crate::geometry::{AreaRule, RestMetric};
use crate::sheet::{SheetShape, generate};

/// Sums derivatives times a displacement.
struct Along<'a> {
    displacement: &'a [Vec3],
    sums: Vec<Vec<f64>>,
}

impl Derivatives for Along<'_> {
    fn by_position(&mut self, column: usize, point: usize, vertex: usize, value: Vec3) {
        self.sums[column][point] += value.dot(&self.displacement[vertex]);
    }

    fn by_length(&mut self, _: usize, _: usize, _: usize, _: f64) {}
}

#[test]
fn one_sided_curvatures_of_a_periodic_strip_have_their_derivatives() {
    let shape = SheetShape::PeriodicRectangle { width: 12.0, height: 7.0, both: false };
    let sheet = Arc::new(generate(&shape, 200, 3).unwrap());
    let metric = RestMetric::new(&sheet).unwrap();
    let wave = |k: f64| {
        let at = sheet
            .places()
            .iter()
            .map(|p| Vec3::new((k * p.y).sin(), (k + p.x).cos(), (k * p.x.sin() + p.y).sin()));
        let mut all: Vec<Vec3> = at.collect();
        sheet.reduction().update_ghosts(&mut all);
        all
    };
    let (bent, displacement) = (wave(1.3), wave(0.7));
    let by = |h: f64| -> Vec<Vec3> {
        let moved = bent.iter().zip(&displacement).map(|(b, d)| 0.2 * b + h * d);
        sheet.rest().iter().zip(moved).map(|(x, by)| x + by).collect()
    };
    for location in [Location::Vertex, Location::Face] {
        let wanted = vec![Signal::MeanCurvature, Signal::GaussianCurvature];
        let area = VertexArea::new(&sheet, AreaRule::default());
        let signals = Signals::new(wanted, location, area, None, TensionReading::Trace, Vec::new())
            .with_boundary(AtBoundary::OneSided, &sheet);
        let values = |x: &[Vec3]| -> [Vec<f64>; 2] {
            let shape = Shape { sheet: &sheet, metric: &metric, time: 0.0, x };
            let curvature = signals.curvature(&shape, "values").unwrap();
            [curvature.mean, curvature.gaussian].map(|of| signals.carry_vertices(&shape, &of))
        };
        let x = by(0.0);
        let shape = Shape { sheet: &sheet, metric: &metric, time: 0.0, x: &x };
        let points = signals.points(&shape);
        let mut along = Along { displacement: &displacement, sums: vec![vec![0.0; points]; 2] };
        signals.derivatives(&shape, &mut along);
        let h = 1e-5;
        let (up, down) = (values(&by(h)), values(&by(-h)));
        for column in 0..2 {
            let largest = along.sums[column].iter().fold(0.0, |most: f64, d| most.max(d.abs()));
            for point in 0..sheet.reduction().owned(points) {
                let difference = (up[column][point] - down[column][point]) / (2.0 * h);
                let error = (along.sums[column][point] - difference).abs();
                assert!(error < 1e-6 * largest, "{location:?} {column} {point}: {error:e}");
            }
        }
    }
}
