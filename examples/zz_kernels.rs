#![allow(missing_docs, clippy::all)]
use rumple::Vec3;
use rumple::effects::*;
use rumple::geometry::AreaRule;
use rumple::sheet::{Shape, generate};
use rumple::solve::linear::*;
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
fn time(name: &str, n: usize, mut f: impl FnMut()) {
    f();
    let mut best = f64::MAX;
    for _ in 0..5 {
        let t = cpu();
        for _ in 0..n {
            f();
        }
        best = best.min((cpu() - t) / n as f64);
    }
    println!("{name:40} {:9.3} ms", best * 1e3);
}
fn main() {
    let sheet = Arc::new(generate(&Shape::Disc { radius: 100.0 }, 20_000, 1).unwrap());
    let x: Vec<Vec3> = sheet
        .rest()
        .iter()
        .map(|x| Vec3::new(x.x, x.y, 0.3 * (0.2 * x.x).sin() * (0.17 * x.y).cos()))
        .collect();
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for (name, sw, bw, ar) in [
            (
                "default",
                StretchingWeight::OptimalArea,
                BendingWeight::Area,
                AreaRule::FrozenVoronoi,
            ),
            ("paper", StretchingWeight::Paper, BendingWeight::Paper, AreaRule::Barycentric),
        ] {
            let bond = || Box::new(BondStretching::new(&material, sw)) as Box<dyn Energy>;
            let meyer =
                || Box::new(MeyerBending::new(&sheet, &material, bw, ar)) as Box<dyn Energy>;
            let pins: Vec<_> = sheet.rim().iter().map(|rim| [false, false, *rim]).collect();
            let mut g = vec![Vec3::zeros(); x.len()];
            let mut h = BlockMatrix::zeros(Arc::new(BlockPattern::two_rings(&sheet)));
            for (what, e) in
                [("bond", vec![bond()]), ("meyer", vec![meyer()]), ("both", vec![bond(), meyer()])]
            {
                let mut m = Mechanics::new(Arc::clone(&sheet), e, pins.clone()).unwrap();
                time(&format!("{name} {what} energy+gradient"), 20, || {
                    m.energy_gradient(&x, &mut g);
                });
                time(&format!("{name} {what} Hessian full"), 3, || {
                    m.hessian(&x, HessianPart::Full, &mut h)
                });
                time(&format!("{name} {what} Hessian positive"), 3, || {
                    m.hessian(&x, HessianPart::Positive, &mut h)
                });
            }
            if std::env::args().len() > 1 {
                continue;
            }
            h.add_diagonal(1e-6 * h.mean_diagonal());
            let mut c = BlockCholesky::new(Arc::clone(h.pattern())).unwrap();
            time("factorise", 1, || {
                c.factorise(&h).unwrap();
            });
            let mut r = x.clone();
            time("solve", 3, || {
                c.solve(&mut r);
            });
        }
    });
}
