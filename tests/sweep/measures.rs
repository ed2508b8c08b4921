//! Spots, their separation and their centres on patterns with known answers.

use std::fs;
use std::process::Command;

use rumple::Vec3;
use rumple::study::{Measures, measure};

use super::{folder, number, rows, rumple, text};
use crate::common::{path, prepare};
use crate::run::SMALL;
use crate::run::program::{passes, passes_with};

/// Discs of c = 1 with a smooth edge, around `centres`, on a rectangle of 40 × 20 with 6000 vertices.
fn measured(location: &str, centres: &[(f64, f64)], radius: f64, level: Option<f64>) -> Measures {
    let value = |x: &Vec3| {
        let distance = |c: &(f64, f64)| (x.x - c.0).hypot(x.y - c.1);
        let nearest = centres.iter().map(distance).fold(f64::INFINITY, f64::min);
        1.0 / (1.0 + (4.0 * (nearest - radius)).exp())
    };
    measured_of(location, value, level)
}

fn width(location: &str, value: impl Fn(&Vec3) -> f64) -> Option<f64> {
    measured_of(location, value, None).width
}

fn measured_of(location: &str, value: impl Fn(&Vec3) -> f64, level: Option<f64>) -> Measures {
    let scene = format!(
        r#"
        sheet = {{ shape = "rectangle", width = 40.0, height = 20.0, vertices = 6000 }}
        effect = []
        time = {{ until = 1.0 }}
        kinetics = {{ rates = {{ c = "-2*c" }}, location = "{location}" }}
        "#
    );
    let (_, mut simulation) = prepare(&scene, &[]);
    let sheet = simulation.sheet().clone();
    let places: Vec<Vec3> = match location {
        "vertex" => sheet.rest().to_vec(),
        _ => {
            let centre = |t: &[u32; 3]| t.iter().map(|v| sheet.rest()[*v as usize]).sum::<Vec3>();
            sheet.triangles().iter().map(|t| centre(t) / 3.0).collect()
        }
    };
    simulation.state_mut().species[0] = places.iter().map(value).collect();
    measure(&mut simulation.evaluate(), level).unwrap()
}

#[test]
fn spots_of_known_size_and_place_are_found() {
    let centres = [(-12.0, 2.0), (0.0, -3.0), (13.0, 4.0)];
    // Nearest others: 13, 13, √218.
    let apart = (13.0 + 13.0 + 218f64.sqrt()) / 3.0;
    let share = 3.0 * std::f64::consts::PI * 9.0 / 800.0;
    let d = 2.0 * ((800.0 / (3.0 * std::f64::consts::PI)).sqrt() - 3.0);
    for location in ["vertex", "face"] {
        let found = measured(location, &centres, 3.0, None);
        assert_eq!(found.spots, 3, "{location}");
        assert!((found.nearest.unwrap() / apart - 1.0).abs() < 2e-3, "{location}: {found:?}");
        assert!((found.share / share - 1.0).abs() < 0.02, "{location}: {found:?}");
        assert!((found.separation.unwrap() / d - 1.0).abs() < 0.01, "{location}: {found:?}");
        assert_eq!((found.amplitude, found.energy), (0.0, 0.0));
        assert!((found.rate - 2.0).abs() < 0.01, "{found:?}");
    }
}

/// Spots of a pattern narrower than the mesh were counted without a word.
#[test]
fn the_width_of_a_pattern_is_half_a_wave_in_edges() {
    for location in ["vertex", "face"] {
        for waves in [1.0, 2.0, 4.0, 8.0] {
            let found =
                width(location, |x| 1.0 + 0.3 * (0.05 * std::f64::consts::PI * waves * x.x).cos());
            // A triangle of 800/12000 has an edge of 0.39.
            let edge = (4.0 / 3f64.sqrt() * 800.0 / 11800.0).sqrt();
            let expected = 20.0 / waves / edge;
            let error = found.unwrap() / expected - 1.0;
            assert!(error.abs() < 0.08, "{location}, {waves} waves: {found:?}, {expected}");
        }
        assert_eq!(width(location, |_| 0.3), None);
        assert_eq!(width(location, |x| 0.3 + 1e-9 * x.y), None);
    }
    assert_eq!(rumple::run::pattern::resolution_words(Some(5.9), Some(5.9)).count(), 2);
    assert_eq!(rumple::run::pattern::resolution_words(Some(6.1), None).count(), 0);
}

/// Wrinkles of a plate, a cylinder and a plate whose unevenness is far below its edges.
#[test]
fn the_width_of_wrinkles_is_half_a_wave_in_edges() {
    let scene = "sheet = { shape = 'rectangle', width = 40.0, height = 20.0, vertices = 6000 }\n\
                 effect = [{ kind = 'stretching' }]\nmaterial = { young = 1.0, poisson = 0.3, thickness = 1.0 }\ntime = { until = 1.0 }\n";
    let (_, mut simulation) = prepare(scene, &[]);
    let rest = simulation.sheet().rest().to_vec();
    let edge = (4.0 / 3f64.sqrt() * 800.0 / 11800.0).sqrt();
    let mut width = |height: &dyn Fn(&Vec3) -> Vec3| {
        simulation.state_mut().x = rest.iter().map(height).collect();
        measure(&mut simulation.evaluate(), None).unwrap().wrinkle_width
    };
    for waves in [2.0, 4.0, 8.0] {
        let k = 0.05 * std::f64::consts::PI * waves;
        let found = width(&|x| Vec3::new(x.x, x.y, 0.3 / k * (k * x.x).cos()));
        let expected = 20.0 / waves / edge;
        // Curvature is sharper at crests than a cosine, by the square of the slope.
        let error = found.unwrap() / expected - 1.0;
        assert!(error.abs() < 0.15, "{waves} waves: {found:?}, {expected}");
    }
    let roll = |x: &Vec3| Vec3::new(8.0 * (x.x / 8.0).sin(), x.y, 8.0 * (x.x / 8.0).cos());
    assert_eq!(width(&roll), None);
    assert_eq!(width(&|x| x + Vec3::z() * 1e-3 * (91.7 * x.x).sin() * (53.1 * x.y).sin()), None);
}

/// A measure that converges, one that stays, and a pattern that the mesh makes; a mesh file and a point are refused.
#[test]
fn ever_finer_meshes_say_what_converges() {
    let folder = folder(
        "sheet = { shape = 'rectangle', width = 40.0, height = 20.0, vertices = 300 }\ntime = { until = 0.1 }\n\
         kinetics = { rates = { c = '0*c' }, initial = { c = { formula = 'exp(-0.02*(x^2 + y^2))' } } }\n",
    );
    passes(
        folder.path(),
        "sweep scene.toml --refine --set sheet.vertices=500 --seeds 3 --out sweep",
    );
    let table = fs::read_to_string(folder.path().join("sweep/refinement.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("measure,500,1000,2000,order,limit"));
    let spots = lines.find(|line| line.starts_with("regions")).unwrap();
    assert_eq!(spots, "regions above the level,1,1,1,unchanged,1");
    let total = table.lines().find(|line| line.starts_with("total c")).unwrap();
    let limit: f64 = total.rsplit(',').next().unwrap().parse().unwrap();
    // ∫ exp(-r²/50) dA = 50 π erf(20/√50) erf(10/√50).
    assert!((limit / 149.9230 - 1.0).abs() < 1e-4, "{total}");
    let point = folder.path().join("point.toml");
    fs::write(
        &point,
        "sheet = { shape = 'point' }\ntime = { until = 1 }\nkinetics = { rates = { c = '-c' } }\n",
    )
    .unwrap();
    let ran = rumple(folder.path(), &["sweep", "point.toml", "--refine"]);
    assert_eq!(ran.status.code(), Some(2), "{}", text(&ran.stderr));
    assert!(text(&ran.stderr).contains("it has no mesh"), "{}", text(&ran.stderr));
}

/// A run and a sweep say so.
#[test]
fn a_pattern_that_the_mesh_does_not_resolve_is_named() {
    let folder = folder(
        "sheet = { shape = 'rectangle', width = 40.0, height = 20.0, vertices = 500 }\ntime = { until = 0.1 }\n\
         kinetics = { rates = { c = '0*c' }, initial = { c = { formula = '1 + cos(1.5*x)' } } }\n",
    );
    let ran = rumple(folder.path(), &["run", "scene.toml", "--out", "out"]);
    assert!(text(&ran.stderr).contains("edges wide: below 6"), "{}", text(&ran.stderr));
    // So is one of a species other than the first.
    let second =
        ["--set", "kinetics.rates.b=0*b", "--set", "kinetics.initial.b.formula=1 + cos(1.5*x)"];
    let args = ["run", "scene.toml", "--out", "b", "--set", "kinetics.initial.c=1"];
    let ran = rumple(folder.path(), &[&args[..], &second[..]].concat());
    assert!(text(&ran.stderr).contains("edges wide: below 6"), "{}", text(&ran.stderr));
    let args = ["sweep", "scene.toml", "--seeds", "2", "--level", "nan"];
    assert_eq!(rumple(folder.path(), &args).status.code(), Some(2));
    let over = "sheet.vertices=500,8000";
    passes_with(folder.path(), &["sweep", "scene.toml", "--over", over, "--out", "sweep"]);
    let page = fs::read_to_string(folder.path().join("sweep/sweep.md")).unwrap();
    let named: Vec<&str> = page.lines().filter(|line| line.contains("edges wide")).collect();
    assert!(named.len() == 1 && named[0].contains("500"), "{page}");
    assert!(page.contains("pattern width [edges]"), "{page}");
}

#[test]
fn the_level_decides_what_a_spot_is() {
    // Two discs whose edges touch: one region at a low level, two at a high one.
    let centres = [(-3.0, 0.0), (3.0, 0.0)];
    let at = |level| measured("vertex", &centres, 2.6, level);
    let (low, high) = (at(Some(0.1)), at(Some(0.5)));
    assert_eq!((low.spots, high.spots), (1, 2));
    assert!(low.share > high.share && low.nearest.is_none() && high.nearest.is_some());
    // Nothing is above, or all is.
    let none = at(Some(2.0));
    assert_eq!((none.spots, none.separation, none.share), (0, None, 0.0));
    let all = at(Some(-1.0));
    assert_eq!(all.spots, 1);
    assert!((all.share - 1.0).abs() < 1e-12 && all.separation.unwrap().abs() < 1e-9, "{all:?}");
}

/// The numbers of the table are those of `measure.py`, which finds regions by other means.
#[test]
#[ignore = "needs Python with the vtk package in RUMPLE_PYTHON; tests/run.sh runs it"]
fn measures_are_those_of_a_script_with_real_vtk() {
    let python = std::env::var("RUMPLE_PYTHON").expect("RUMPLE_PYTHON names the interpreter");
    let script = path("tests/scripts/measure.py");
    let folder = folder(&SMALL.replace("[output]", "[output]\nfields = [\"c\"]"));
    let args = ["sweep", "scene.toml", "--out", "out", "--level", "0.05"];
    let over = ["--over", "kinetics.location=vertex,face"];
    let out = rumple(folder.path(), &[&args[..], &over].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("out");
    for (row, cells) in rows(&root.join("sweep.csv")).iter().zip([&[][..], &["--cells"]]) {
        let frame = root.join("members").join(&row["member"]).join("frames/frame_000002.vtu");
        let args = ["--array", "c", "--threshold", "0.05"];
        let out =
            Command::new(&python).arg(&script).arg(frame).args(args).args(cells).output().unwrap();
        assert!(out.status.success(), "{}", text(&out.stderr));
        let found: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!(number(row, "spots"), found["regions"].as_f64().unwrap());
        assert!(number(row, "spots") >= 1.0);
        for (column, key) in [("separation d [length]", "d"), ("share", "share above")] {
            let expected = found[key].as_f64().unwrap();
            assert!(
                (number(row, column) / expected - 1.0).abs() < 1e-9,
                "{column}: {row:?} {found}"
            );
        }
    }
}

/// A disc with its rim in a plane, of which a load is a part of the energy.
const SLIDING: &str = r#"
sheet = { shape = "disc", radius = 6.0, vertices = 120, bump = { amplitude = 0.3, width = 2.0 } }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pressure", value = 0.5 },
    { kind = "pin", where = "rim", axes = "z" },
]
time = { until = 1.0 }
"#;

#[test]
fn what_a_sheet_measures_does_not_depend_on_where_it_lies() {
    let (_, mut simulation) = prepare(SLIDING, &[]);
    let before = measure(&mut simulation.evaluate(), None).unwrap();
    assert!(before.deflection > 0.0 && before.amplitude >= before.deflection, "{before:?}");
    // It slips and turns in the plane of its rim, as nothing hinders.
    let turn = nalgebra::Rotation3::new(Vec3::new(0.0, 0.0, 0.4));
    for x in &mut simulation.state_mut().x {
        *x = turn * *x + Vec3::new(2.0, -1.0, 0.0);
    }
    let after = measure(&mut simulation.evaluate(), None).unwrap();
    for (a, b) in [(after.amplitude, before.amplitude), (after.deflection, before.deflection)] {
        assert!((a / b - 1.0).abs() < 1e-9, "{before:?} {after:?}");
    }
    // The energy is what the sheet stores, not what the load has lost.
    let mut at = simulation.evaluate();
    let (all, elastic) = (at.energies().unwrap(), after.energy);
    assert!(all[2] < 0.0 && (elastic - all[0] - all[1]).abs() < 1e-12 * elastic, "{all:?}");
}

#[test]
fn displacements_in_the_plane_are_no_deflection() {
    let scene = SLIDING.replace(", bump = { amplitude = 0.3, width = 2.0 }", "");
    let scene = scene.replace("    { kind = \"pressure\", value = 0.5 },\n", "");
    let (_, mut simulation) = prepare(&scene, &[]);
    simulation.state_mut().x.iter_mut().for_each(|x| *x *= 1.1);
    let found = measure(&mut simulation.evaluate(), None).unwrap();
    assert!((found.amplitude / 0.6 - 1.0).abs() < 0.01, "{found:?}");
    assert_eq!(found.deflection, 0.0);
}
