#![allow(missing_docs, clippy::all)]
use rumple::Vec3;
use rumple::effects::*;
use rumple::geometry::AreaRule;
use rumple::sheet::Sheet;
use rumple::solve::EquilibriumSpec;
use rumple::solve::equilibrium::*;
use rumple::system::Mechanics;
use std::sync::Arc;
fn cpu() -> f64 {
    let mut s = 0.0;
    for t in std::fs::read_dir("/proc/self/task").unwrap() {
        let p = t.unwrap().path().join("schedstat");
        s += std::fs::read_to_string(p).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
    }
    s * 1e-9
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n = &args[1];
    let spec: Box<dyn EquilibriumSpec> = serde_json::from_str(&args[2]).unwrap();
    let text = std::fs::read_to_string(format!("/tmp/bench/mesh/disc_{n}.txt")).unwrap();
    let mut lines = text.lines();
    let head: Vec<usize> =
        lines.next().unwrap().split_whitespace().map(|v| v.parse().unwrap()).collect();
    let x0: Vec<Vec3> = (0..head[0])
        .map(|_| {
            let v: Vec<f64> =
                lines.next().unwrap().split_whitespace().map(|v| v.parse().unwrap()).collect();
            Vec3::new(v[0], v[1], 0.0)
        })
        .collect();
    let tri: Vec<[u32; 3]> = (0..head[1])
        .map(|_| {
            let v: Vec<u32> =
                lines.next().unwrap().split_whitespace().map(|v| v.parse().unwrap()).collect();
            [v[0], v[1], v[2]]
        })
        .collect();
    let start = args.get(3).cloned().unwrap_or(format!("/tmp/bench/A/start_{n}.bin"));
    let b = std::fs::read(start).unwrap();
    let f: Vec<f64> = b.chunks(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
    let mut x: Vec<Vec3> = f.chunks(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect();
    let sheet = Arc::new(Sheet::new(x0.clone(), tri).unwrap());
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let (sw, bw, ar) = if std::env::var("DEFAULT").is_ok() {
        (StretchingWeight::OptimalArea, BendingWeight::Area, AreaRule::FrozenVoronoi)
    } else {
        (StretchingWeight::Paper, BendingWeight::Paper, AreaRule::Barycentric)
    };
    let energies: Vec<Box<dyn Energy>> = vec![
        Box::new(BondStretching::new(&material, sw)),
        Box::new(MeyerBending::new(&sheet, &material, bw, ar)),
    ];
    let pins: Vec<_> = sheet.rim().iter().map(|rim| [false, false, *rim]).collect();
    let mut m = Mechanics::new(Arc::clone(&sheet), energies, pins).unwrap();
    let phi = |v: u32| if x0[v as usize].norm() < 20.0 { 1.0 / 0.65 } else { 1.0 };
    let factor: Vec<f64> =
        sheet.edges().iter().map(|e| 0.5 * (phi(e.vertices[0]) + phi(e.vertices[1]))).collect();
    m.set_length_factor(&factor);
    let mut g = vec![Vec3::zeros(); x.len()];
    let e0 = m.energy_gradient(&x, &mut g);
    let g0: f64 = g.iter().map(|g| g.norm_squared()).sum::<f64>().sqrt();
    println!("E0 {e0:.10e} |g0| {g0:.6e} residual {:.3e}", m.residual(&g));
    let t0 = cpu();
    let mut solver = spec.build(&m).unwrap();
    println!("setup {:.2} s", cpu() - t0);
    let tol = std::env::var("TOL").map_or(spec.tolerance(), |t| t.parse().unwrap());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let done = pool.install(|| {
        solver.relax(
            &mut m,
            &mut x,
            &Goal { tolerance: tol, max_iterations: spec.max_iterations(), interrupted: &|| false },
        )
    });
    m.energy_gradient(&x, &mut g);
    let g1: f64 = g.iter().map(|g| g.norm_squared()).sum::<f64>().sqrt();
    let mut least = f64::MAX;
    for t in sheet.triangles() {
        let p = t.map(|v| x[v as usize]);
        for k in 0..3 {
            let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            least = least.min(u.cross(&v).norm().atan2(u.dot(&v)).to_degrees());
        }
    }
    println!("{done:?}\nrel {:.2e} angle {least:.1} cpu {:.2} s", g1 / g0, cpu() - t0);
}
