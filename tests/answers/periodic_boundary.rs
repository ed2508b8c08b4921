//! One-sided curvatures at the free edges of periodic strips.

use std::f64::consts::TAU;

use rumple::run::inspect;
use rumple::{Simulation, Vec3};

use crate::common::prepare;

const RADIUS: f64 = 5.0;

/// Place and mean curvature of a strip that is rolled about x, or corrugated along it.
fn bent(x: &Vec3, rolled: bool) -> (Vec3, f64) {
    if rolled {
        let (sin, cos) = (x.y / RADIUS).sin_cos();
        return (Vec3::new(x.x, RADIUS * sin, RADIUS * cos), 0.5 / RADIUS);
    }
    let k = TAU / 12.0;
    let (sin, cos) = (k * x.x).sin_cos();
    let h = 0.3 * k * k * cos / (1.0 + (0.3 * k * sin).powi(2)).powf(1.5) / 2.0;
    (Vec3::new(x.x, x.y, 0.3 * cos), h)
}

/// Root mean square of the errors of H at the free edges over the largest H: of frames, and of what a law reads; of the strip
/// that is rolled and of the corrugated one.
fn errors(vertices: usize, location: &str) -> [[f64; 2]; 2] {
    let scene = format!(
        r#"
        sheet = {{ shape = "rectangle", width = 12.0, height = 7.0, vertices = {vertices}, periodic = "x" }}
        material = {{ young = 1.0, poisson = 0.3, thickness = 0.5 }}
        effect = [{{ kind = "stretching" }}, {{ kind = "bending" }}]
        kinetics = {{ rates = {{ c = "H - c" }}, location = "{location}", boundary = "one-sided" }}
        time = {{ until = 1.0, integrator = "staggered" }}
        output = {{ fields = ["mean_curvature"] }}
        "#
    );
    let (_, mut simulation) = prepare(&scene, &[]);
    [true, false].map(|rolled| errors_of(&mut simulation, location, rolled))
}

fn errors_of(simulation: &mut Simulation, location: &str, rolled: bool) -> [f64; 2] {
    let sheet = simulation.sheet().clone();
    let all: Vec<(Vec3, f64)> = sheet.rest().iter().map(|x| bent(x, rolled)).collect();
    simulation.state_mut().x = all.iter().map(|(x, _)| *x).collect::<Vec<_>>().into();
    let frame = simulation.frame().unwrap();
    let field = frame.point.iter().find(|field| field.name.starts_with("mean_curvature"));
    let framed = field.unwrap().data.to_vec();
    let read = inspect::inspect(simulation).unwrap()["signals"]["mean_curvature"].clone();
    let read: Vec<f64> = serde_json::from_value(read).unwrap();
    let largest = all.iter().map(|(_, h)| h.abs()).fold(0.0, f64::max);
    let mean = |values: Vec<f64>| {
        assert!(values.len() > 20);
        (values.iter().map(|e| e * e).sum::<f64>() / values.len() as f64).sqrt() / largest
    };
    let owned = sheet.reduction().owned(sheet.vertex_count());
    let edge = |v: usize| sheet.boundary()[v];
    let of_frame = (0..owned).filter(|v| edge(*v)).map(|v| framed[v] - all[v].1).collect();
    let of_law = match location {
        "vertex" => (0..owned).filter(|v| edge(*v)).map(|v| read[v] - all[v].1).collect(),
        _ => {
            let at = |t: &[u32; 3]| t.iter().map(|v| all[*v as usize].1).sum::<f64>() / 3.0;
            let touching = sheet.triangles()[..read.len()].iter().enumerate();
            let touching = touching.filter(|(_, t)| t.iter().any(|v| edge(*v as usize)));
            touching.map(|(t, corners)| read[t] - at(corners)).collect()
        }
    };
    [mean(of_frame), mean(of_law)]
}

#[test]
fn curvatures_at_the_free_edges_of_a_periodic_strip_are_those_of_its_shape() {
    for location in ["vertex", "face"] {
        let [coarse, fine] = [1200, 4800].map(|vertices| errors(vertices, location));
        for (coarse, fine) in coarse.as_flattened().iter().zip(fine.as_flattened()) {
            assert!(*fine < 0.03 && *fine < 1.1 * coarse, "{location}: {coarse:?} {fine:?}");
        }
    }
}
