//! Planar scenes and their twins in space end in the same state: under every policy, by every integrator
//! and every method of equilibrium.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{EnergyTerm, Material, StretchingModulus, StvkStretching};
use rumple::model::{Mechanics, MechanicsParts, Potential};
use rumple::sheet::{SheetShape, generate};
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec};
use rumple::solve::stability::Stability;

use super::{STRIP, distance, run, stays_in_plane, strip, with};

/// Runs both and compares shape, species and energies.
fn compare(overrides: &[&str], (shape, species): (f64, f64)) {
    let (mut plane, mut space) = (strip(true, overrides), strip(false, overrides));
    run(&mut plane, 1.0);
    run(&mut space, 1.0);
    let far = distance(plane.state(), space.state());
    assert!(far.0 <= shape && far.1 <= species, "{overrides:?}: {far:?}");
    assert!(stays_in_plane(&plane), "{overrides:?}");
    let moved = plane.state().x.iter().zip(plane.sheet().rest());
    let moved = moved.map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max);
    assert!(moved > 0.1, "{overrides:?}: nothing moved");
    let energies = plane.energies().unwrap().into_iter().zip(space.energies().unwrap());
    for ((name, a), (other, b)) in energies {
        assert_eq!(name, other);
        assert!((a - b).abs() <= 1e3 * shape * b.abs().max(1.0), "{overrides:?} {name}: {a} {b}");
    }
}

#[test]
fn integrators_agree_under_every_policy() {
    let tight = "rtol=1e-7,atol=1e-7";
    let staggered = "time.integrator={kind=\"staggered\",rtol=1e-4,atol=1e-4}".to_owned();
    let euler = "time.integrator={kind=\"staggered\",method=\"euler\",step=0.1}".to_owned();
    let implicit = |method: &str, linear: &str| {
        format!(
            "time.integrator={{kind=\"monolithic\",method=\"{method}\",linear=\"{linear}\",{tight}}}"
        )
    };
    for policy in ["quasi-static", "simultaneous", "chemistry-fast"] {
        let mut all = vec![
            staggered.clone(),
            implicit("bdf", "lu"),
            implicit("bdf", "blocks"),
            implicit("tr-bdf2", "auto"),
            implicit("esdirk34", "auto"),
        ];
        if policy == "quasi-static" {
            all.push(euler.clone());
        }
        if policy == "simultaneous" {
            all.push(format!("time.integrator={{kind=\"explicit\",method=\"tsit45\",{tight}}}"));
            all.push("time.integrator={kind=\"explicit\",step=1e-3}".to_owned());
        }
        let policy = format!("time.policy=\"{policy}\"");
        for integrator in all {
            compare(&[&policy, &integrator], (1e-6, 1e-6));
        }
    }
}

#[test]
fn equilibrium_methods_agree() {
    let step = "time.integrator={kind=\"staggered\",method=\"euler\",step=0.1}";
    for (method, tolerance) in [
        ("method=\"lbfgs\",preconditioner=\"factor\",precision=\"double\"", 1e-11),
        ("method=\"lbfgs\",preconditioner=\"factor\",precision=\"single\"", 1e-11),
        ("method=\"lbfgs\",preconditioner=\"multigrid\"", 1e-11),
        ("method=\"newton\"", 1e-11),
        ("method=\"descent\"", 1e-9),
    ] {
        let method = format!("equilibrium={{{method},tolerance={tolerance:e}}}");
        compare(&[step, &method], (1e4 * tolerance, 1e4 * tolerance));
    }
}

/// Growth without pins: three rigid motions are left, which a relaxation does not follow.
#[test]
fn a_free_sheet_has_three_rigid_motions() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 5.0 }, 200, 1).unwrap());
    let material = Material { young: 10.0, poisson: 0.3, thickness: 0.5 };
    let energy =
        || vec![EnergyTerm::new(StvkStretching::new(&material, StretchingModulus::PlaneStress))];
    let upright = vec![[false, false, true]; sheet.vertex_count()];
    let parts = MechanicsParts { terms: energy(), planar: true, ..MechanicsParts::default() };
    let plane = Mechanics::from_parts(Arc::clone(&sheet), parts).unwrap();
    let space = Mechanics::new(Arc::clone(&sheet), energy(), upright).unwrap();
    assert_eq!(plane.pattern().axes(), 2);
    assert_eq!(plane.free_motions(), 3);
    let relaxed = |mechanics: &Arc<Mechanics>| {
        let mut potential = Potential::new(mechanics);
        let rest = |v: u32| sheet.rest()[v as usize];
        let factor = sheet.edges().iter().map(|e| {
            let [a, b] = e.vertices.map(rest);
            1.0 + 0.2 * (-(0.5 * (a + b) - Vec3::x()).norm_squared() / 4.0).exp()
        });
        potential.set_length_factor(&factor.collect::<Vec<_>>());
        let mut x = sheet.rest().to_vec();
        let goal = Goal { tolerance: 1e-12, max_iterations: 500, ..Goal::default() };
        let mut lbfgs = Lbfgs::new(mechanics, LbfgsSpec::default()).unwrap();
        lbfgs.relax(&mut potential, &mut x, &goal).unwrap();
        let spectrum = Stability::new(mechanics).unwrap().spectrum(&mut potential, &x, 4).unwrap();
        let energy = potential.energy(&x);
        (x, energy, spectrum)
    };
    let (a, b) = (relaxed(&plane), relaxed(&space));
    let apart = a.0.iter().zip(&b.0).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-8, "{apart:e}");
    assert!((a.1 / b.1 - 1.0).abs() < 1e-9, "{} {}", a.1, b.1);
    assert!(a.1 > 0.0 && a.0.iter().all(|x| x.z.to_bits() == 0.0f64.to_bits()));
    let centre = a.0.iter().zip(sheet.rest()).map(|(x, rest)| x - rest).sum::<Vec3>();
    assert!(centre.norm() < 1e-9, "drifts: {centre}");
    assert_eq!((a.2.inertia.rigid, b.2.inertia.rigid), (3, 3));
    assert_eq!((a.2.inertia.negative, b.2.inertia.negative), (0, 0));
    for (a, b) in a.2.modes.iter().zip(&b.2.modes) {
        assert!(
            (a.eigenvalue / b.eigenvalue - 1.0).abs() < 1e-6,
            "{} {}",
            a.eigenvalue,
            b.eigenvalue
        );
        assert!(a.shape.iter().all(|v| v.z == 0.0));
    }
    assert_eq!(a.2.modes.len(), 4);
}

/// Pins that move, and a sheet in another plane than z = 0.
#[test]
fn pins_that_move_do_so_in_another_plane_too() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("raised.obj");
    let sheet = generate(&SheetShape::Rectangle { width: 10.0, height: 6.0 }, 120, 1).unwrap();
    let raised: Vec<Vec3> = sheet.rest().iter().map(|x| x + 0.1 * Vec3::z()).collect();
    let mut text = String::new();
    for x in &raised {
        text += &format!("v {} {} {}\n", x.x, x.y, x.z);
    }
    for [a, b, c] in sheet.triangles() {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    std::fs::write(&file, text).unwrap();
    let path = format!("[sheet]\nfile = '{}'\n", file.display());
    let scene = STRIP.replace(
        "[sheet]\nshape = \"rectangle\"\nwidth = 10.0\nheight = 6.0\nvertices = 120\n",
        &path,
    );
    let scene = scene.replace(
        "axes = \"xy\"\n",
        "axes = \"xy\"\ndisplacement = [-1.0, 0.5, 0.0]\nramp = { points = [[0.0, 0.0], [1.0, 1.0]] }\n",
    );
    for integrator in [
        "time.integrator={kind=\"staggered\",rtol=1e-7,atol=1e-7}",
        "time.integrator={kind=\"monolithic\",rtol=1e-8,atol=1e-8}",
    ] {
        let (mut plane, mut space) =
            (with(&scene, true, &[integrator]), with(&scene, false, &[integrator]));
        run(&mut plane, 1.0);
        run(&mut space, 1.0);
        let far = distance(plane.state(), space.state());
        assert!(far.0 < 1e-7 && far.1 < 1e-7, "{integrator}: {far:?}");
        assert!(stays_in_plane(&plane) && plane.state().x[0].z.to_bits() == 0.1f64.to_bits());
        let left = plane.sheet().rest().iter().zip(&plane.state().x);
        let left = left.min_by(|a, b| a.0.x.total_cmp(&b.0.x)).unwrap();
        assert!((left.1 - left.0 - Vec3::new(-1.0, 0.5, 0.0)).norm() < 1e-12);
    }
}
