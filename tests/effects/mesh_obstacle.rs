//! A mesh as an obstacle: derivatives, the pressure under it, its way through a sheet, and what is refused.

use std::path::Path;

use rumple::effects::{BlockMatrix, HessianPart};
use rumple::geometry::Crossings;
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate, write};
use rumple::{Simulation, Vec3};

use super::running::at_end;
use crate::common::{Noise, prepare};
use crate::run::program::{folder, passes_with, rumple, text};
use crate::run::resumed::{assert_same, checkpoints, stopped};

/// Writes `shape` of about so many vertices, moved by `shift`, as `mesh.obj`.
fn write_mesh(folder: &Path, shape: &SheetShape, vertices: usize, shift: Vec3) -> Sheet {
    let made = generate(shape, vertices, 3).unwrap();
    let rest = made.rest().iter().map(|x| x + shift).collect();
    let moved = Sheet::new(rest, made.triangles().to_vec()).unwrap();
    let mut bytes = Vec::new();
    write::obj(&moved, &mut bytes).unwrap();
    std::fs::write(folder.join("mesh.obj"), bytes).unwrap();
    moved
}

const SPHERE: SheetShape = SheetShape::Sphere { radius: 1.5, irregular: true };

/// A clamped plate with effects.
fn plate(size: f64, vertices: usize, until: f64, effects: &str) -> String {
    format!(
        "sheet = {{ shape = 'rectangle', width = {size}, height = {size}, vertices = {vertices} }}
        material = {{ young = 1e3, poisson = 0.3, thickness = 0.2 }}
        time = {{ until = {until} }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'bending' }},
            {effects}
        ]"
    )
}

fn obstacle(folder: &Path, rest: &str) -> String {
    format!("{{ kind = 'obstacle', shape = {{ mesh = '{}/mesh.obj' }}{rest} }}", folder.display())
}

fn norm(a: &[Vec3]) -> f64 {
    a.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>().sqrt()
}

#[test]
fn derivatives_are_those_of_the_energy() {
    let here = folder("");
    write_mesh(here.path(), &SPHERE, 150, Vec3::new(0.1, 0.2, -1.62));
    let effects = obstacle(
        here.path(),
        ", distance = 0.6, displacement = [0, 0, 0.1], ramp = { formula = 't' }",
    );
    let simulation = prepare(&plate(4.0, 120, 1.0, &effects), &[]).1;
    let sheet = simulation.sheet().clone();
    let mut potential = Potential::new(simulation.model().mechanics());
    potential.set_conditions(None, 0.7);
    let mut noise = Noise::new(4);
    let x: Vec<Vec3> = sheet.rest().iter().map(|x| x + 0.01 * noise.vector()).collect();
    let d: Vec<Vec3> = x.iter().map(|_| noise.vector()).collect();
    let which = potential.mechanics().contacts().next().unwrap();
    assert!(norm(&potential.force_of(which, &x)) > 0.1, "no contact");
    let at = |h: f64| -> Vec<Vec3> { x.iter().zip(&d).map(|(x, d)| x + h * d).collect() };
    let mut gradient = |h: f64| {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let energy = potential.energy_gradient(&at(h), &mut gradient);
        (energy, gradient)
    };
    let h = 1e-6;
    let ((up, above), (down, below), (_, middle)) = (gradient(h), gradient(-h), gradient(0.0));
    let slope: f64 = middle.iter().zip(&d).map(|(g, d)| g.dot(d)).sum();
    assert!(((up - down) / (2.0 * h) / slope - 1.0).abs() < 1e-6, "{slope}");
    let mut hessian = BlockMatrix::zeros(potential.pattern(&x));
    potential.hessian(&x, HessianPart::Full, &mut hessian).unwrap();
    let exact = hessian.quadratic(&d);
    let change = above.iter().zip(&below).zip(&d).map(|((a, b), d)| (a - b).dot(d));
    let by = change.sum::<f64>() / (2.0 * h);
    assert!((by / exact - 1.0).abs() < 1e-5, "{by} {exact}");
}

/// A plate pressed onto a mesh in a plane lies as far from it as one on the plane itself.
#[test]
fn a_plate_rests_on_a_flat_mesh_as_on_a_plane() {
    let here = folder("");
    let flat = SheetShape::Rectangle { width: 4.4, height: 4.4 };
    write_mesh(here.path(), &flat, 230, Vec3::new(0.0, 0.0, -0.08));
    let press = "{ kind = 'pin', where = 'all', axes = 'xy' }, { kind = 'load', where = 'all', force = { per-area = [0, 0, -5.0] } },";
    let height = |obstacle: &str| {
        let mut simulation = prepare(&plate(3.0, 120, 1.0, &format!("{press} {obstacle}")), &[]).1;
        simulation.prepare().unwrap();
        let x = &simulation.state().x;
        let count = f64::from(u32::try_from(x.len()).unwrap());
        0.08 + x.iter().map(|x| x.z).sum::<f64>() / count
    };
    let on_plane = height(
        "{ kind = 'obstacle', shape = { plane = { point = [0, 0, -0.08], normal = [0, 0, 1] } } }",
    );
    let on_mesh = height(&obstacle(here.path(), ""));
    assert!((on_mesh / on_plane - 1.0).abs() < 0.02, "{on_mesh} {on_plane}");
}

/// The force of the contact of a simulation along z.
fn force(simulation: &mut Simulation) -> f64 {
    let x = simulation.state().x.clone();
    let mut at = simulation.evaluate();
    let potential = at.potential().unwrap();
    let which = potential.mechanics().contacts().next().unwrap();
    potential.force_of(which, &x).iter().map(|f| f.z).sum()
}

#[test]
fn a_ball_that_is_moved_pushes_a_sheet_ahead() {
    let here = folder("");
    let ball = write_mesh(here.path(), &SPHERE, 600, Vec3::new(0.0, 0.0, 1.65));
    let rim = "{ kind = 'pin', where = 'rim', axes = 'xyz' },";
    let moved = "displacement = [0, 0, -2.5], ramp = { formula = 't' }";
    let smooth = "shape = { sphere = { centre = [0, 0, 1.65], radius = 1.5 } }";
    let of_mesh = format!("{rim} {}", obstacle(here.path(), &format!(", {moved}")));
    let of_sphere = format!("{rim} {{ kind = 'obstacle', {smooth}, {moved} }}");
    let mut forces = Vec::new();
    for effects in [of_mesh, of_sphere] {
        // A whole step is further than the ball is wide.
        let mut simulation = prepare(&plate(6.0, 400, 1.0, &effects), &[]).1;
        simulation.prepare().unwrap();
        while simulation.state().time < 1.0 {
            simulation.step(1.0).unwrap_or_else(|e| panic!("{e}"));
        }
        let (sheet, x) = (simulation.sheet().clone(), simulation.state().x.clone());
        let lowest = x.iter().map(|x| x.z).fold(0.0, f64::min);
        assert!(lowest < -2.3, "the ball is at -2.35: {lowest}");
        let both = Sheet::new(
            x.iter()
                .copied()
                .chain(ball.rest().iter().map(|x| x - Vec3::new(0.0, 0.0, 2.5)))
                .collect(),
            sheet
                .triangles()
                .iter()
                .copied()
                .chain(
                    ball.triangles().iter().map(|t| t.map(|v| v + u32::try_from(x.len()).unwrap())),
                )
                .collect(),
        )
        .unwrap();
        if forces.is_empty() {
            let all = both.rest().to_vec();
            let found = Crossings::between(&both, sheet.triangle_count()).find(&both, &all);
            assert_eq!(found.pairs, 0);
        }
        forces.push(force(&mut simulation));
    }
    assert!((forces[0] / forces[1] - 1.0).abs() < 0.1 && forces[0] < 0.0, "{forces:?}");
}

#[test]
fn a_start_in_the_mesh_is_refused_with_its_place() {
    for (height, words) in [
        (
            1.2,
            "of triangles of the sheet and of the mesh cross, first the triangle with the vertices",
        ),
        (0.0, "touches the mesh"),
    ] {
        let here = folder("");
        let flat = SheetShape::Rectangle { width: 3.0, height: 3.0 };
        match height {
            0.0 => write_mesh(here.path(), &flat, 50, Vec3::new(0.3, 0.1, 0.0)),
            _ => write_mesh(here.path(), &SPHERE, 150, Vec3::new(0.0, 0.0, height)),
        };
        let scene = plate(4.0, 120, 1.0, "{ kind = 'obstacle', shape = { mesh = 'mesh.obj' } }");
        std::fs::write(here.path().join("scene.toml"), scene).unwrap();
        let out = rumple(here.path(), &["run", "scene.toml", "--out", "result"]);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(message.contains("the effect obstacle cannot begin with this shape"), "{message}");
        assert!(message.contains(words) || height == 0.0, "{message}");
    }
    let here =
        folder(&plate(4.0, 120, 1.0, "{ kind = 'obstacle', shape = { mesh = 'none.obj' } }"));
    let out = rumple(here.path(), &["check", "scene.toml"]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("none.obj"), "{message}");
}

/// A slower ramp was advised.
#[test]
fn a_mesh_that_reaches_pinned_vertices_names_the_pin() {
    let here = folder("");
    let flat = SheetShape::Rectangle { width: 3.0, height: 3.0 };
    write_mesh(here.path(), &flat, 50, Vec3::new(1.0, 0.0, 0.4));
    let moved = ", displacement = [0, 0, -2], ramp = { formula = 't' }";
    let effects = format!(
        "{{ kind = 'pin', where = 'rim', axes = 'xyz' }}, {}",
        obstacle(here.path(), moved)
    );
    let (_, mut simulation) = prepare(&plate(3.0, 100, 1.0, &effects), &[]);
    simulation.prepare().unwrap();
    let error = loop {
        match simulation.step(1.0) {
            Ok(_) => assert!(simulation.state().time < 0.5, "it passed through the rim"),
            Err(error) => break error.to_string(),
        }
    };
    let vertex = error.split("an obstacle reaches vertex ").nth(1).expect(&error);
    let vertex: usize = vertex.split(',').next().unwrap().parse().unwrap();
    assert!(simulation.sheet().boundary()[vertex], "{error}");
    assert!(error.contains("which a pin holds in its way"), "{error}");
    assert!(!error.contains("slower"), "{error}");
}

/// A ball that moves into a plate under drag.
fn under_drag(folder: &Path) -> String {
    write_mesh(folder, &SPHERE, 150, Vec3::new(0.0, 0.0, 1.65));
    let moved = ", displacement = [0, 0, -1], ramp = { formula = 't' }";
    let pin = "{ kind = 'pin', where = 'rim', axes = 'xyz' },";
    plate(4.0, 120, 0.5, &format!("{pin} {}", obstacle(folder, moved)))
        .replace("thickness = 0.2", "thickness = 0.2, drag = 1.0")
        .replace(
            "until = 0.5",
            "until = 0.5, policy = 'simultaneous', integrator = { kind = 'staggered' }",
        )
}

#[test]
fn a_moving_mesh_gives_the_same_bits_on_any_number_of_threads_and_when_resumed() {
    let here = folder("");
    let scene = under_drag(here.path());
    let bits = |threads: usize| -> Vec<[u64; 3]> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut simulation = pool.install(|| at_end(&scene));
        assert!(force(&mut simulation) < -1e-2, "nothing is pushed");
        simulation.state().x.iter().map(|x| [x.x, x.y, x.z].map(f64::to_bits)).collect()
    };
    assert_eq!(bits(1), bits(2));
    std::fs::write(here.path().join("scene.toml"), scene).unwrap();
    let often = ["--set", "checkpoint.every=1e-9", "--set", "checkpoint.keep=1000000"];
    let run = [&["run", "scene.toml", "--out", "whole"], &often[..]].concat();
    passes_with(here.path(), &run);
    let (whole, other) = (here.path().join("whole"), here.path().join("other"));
    let count = checkpoints(&whole).len();
    assert!(count > 2, "{count} checkpoints");
    stopped(&whole, &other, count / 2);
    passes_with(here.path(), &["resume", other.to_str().unwrap(), "--quiet"]);
    assert_same(&whole, &other, "a moving mesh");
}
