//! Contact in hard cases: starts that touch, needles, parallel edges, sheets thicker than their edges, planes, threads,
//! resumed runs, and every shape at rest.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{Contacts, EnergyTerm};
use rumple::geometry::Crossings;
use rumple::model::{Mechanics, Potential};
use rumple::sheet::Sheet;

use super::running::at_end;
use crate::common::{Noise, prepare};
use crate::run::program::{folder, passes_with, rumple, text};
use crate::run::resumed::{assert_same, checkpoints, stopped};

fn potential(sheet: &Sheet, distance: f64) -> Potential {
    let term = EnergyTerm::contact(Contacts::new(sheet, distance, 2.0));
    Potential::new(&Mechanics::new(Arc::new(sheet.clone()), vec![term], Vec::new()).unwrap())
}

fn gradient(potential: &mut Potential, x: &[Vec3]) -> (f64, Vec<Vec3>) {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    (potential.energy_gradient(x, &mut gradient), gradient)
}

fn norm(a: &[Vec3]) -> f64 {
    a.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>().sqrt()
}

/// Force and torque are zero, and the gradient is that of the energy. Edges as short as `narrowest` turn far on a short
/// way.
fn is_sound(potential: &mut Potential, x: &[Vec3], narrowest: f64) {
    let (energy, force) = gradient(potential, x);
    assert!(energy > 0.0 && energy.is_finite(), "{energy}");
    let size = norm(&force);
    assert!(force.iter().sum::<Vec3>().norm() < 1e-11 * size);
    let torque: Vec3 = x.iter().zip(&force).map(|(x, f)| x.cross(f)).sum();
    let reach = x.iter().map(nalgebra::Vector3::norm).fold(0.0, f64::max);
    assert!(torque.norm() < 1e-11 * size * reach, "{torque}");
    let mut noise = Noise::new(3);
    let direction: Vec<Vec3> = x.iter().map(|_| noise.vector()).collect();
    let mut energy = |h: f64| {
        let moved: Vec<Vec3> = x.iter().zip(&direction).map(|(x, d)| x + h * d).collect();
        potential.energy(&moved)
    };
    let h = 1e-7 * narrowest;
    let rise = (energy(h) - energy(-h)) / (2.0 * h);
    let slope: f64 = force.iter().zip(&direction).map(|(f, d)| f.dot(d)).sum();
    assert!((rise - slope).abs() < 1e-5 * size * norm(&direction), "{rise} {slope}");
}

/// Two strips, one above the other by `gap`, the upper one turned by `angle` and moved by `shift`; columns of the
/// given widths.
fn strips(columns: &[f64], gap: f64, angle: f64, shift: Vec3) -> (Sheet, Vec<Vec3>) {
    let mut rest = vec![Vec3::zeros(), Vec3::new(0.0, 1.0, 0.0)];
    let mut at = 0.0;
    for width in columns {
        at += width;
        rest.extend([Vec3::new(at, 0.0, 0.0), Vec3::new(at, 1.0, 0.0)]);
    }
    let n = u32::try_from(rest.len()).unwrap();
    let cells = (0..n / 2 - 1).map(|k| 2 * k);
    let mut triangles: Vec<[u32; 3]> =
        cells.flat_map(|k| [[k, k + 2, k + 1], [k + 2, k + 3, k + 1]]).collect();
    let turn = nalgebra::Rotation3::from_axis_angle(&Vec3::z_axis(), angle);
    let mut x = rest.clone();
    x.extend(rest.iter().map(|x| turn * x + shift + Vec3::new(0.0, 0.0, gap)));
    rest.extend(rest.clone().iter().map(|x| x + Vec3::new(0.0, 0.0, 100.0)));
    triangles.extend(triangles.clone().iter().map(|t| t.map(|v| v + n)));
    (Sheet::new(rest, triangles).unwrap(), x)
}

#[test]
fn parallel_edges_and_needles_between_two_sheets_are_sound() {
    let even = [1.0; 4];
    // One column in two is a thousandth as wide.
    let needles = [1.0, 1e-3, 1.0, 1e-3, 1.0];
    for (columns, narrowest) in [(&even[..], 1.0), (&needles[..], 1e-3)] {
        // All edges parallel, first above one another, then beside; nearly parallel; across.
        for (angle, shift) in [
            (0.0, Vec3::zeros()),
            (0.0, Vec3::new(0.3, 0.2, 0.0)),
            (1e-9, Vec3::new(0.3, 0.2, 0.0)),
            (1e-4, Vec3::new(0.1, -0.3, 0.0)),
            (1.2, Vec3::new(1.0, 0.0, 0.0)),
        ] {
            for gap in [0.3, 0.1, 0.01] {
                let (sheet, x) = strips(columns, gap, angle, shift);
                let mut potential = potential(&sheet, 0.4);
                assert_eq!(potential.refusal(&x), None);
                is_sound(&mut potential, &x, narrowest);
            }
        }
    }
}

/// The step of a needle through the other sheet ends before it.
#[test]
fn needles_do_not_step_through_a_sheet() {
    let (sheet, x) = strips(&[1.0, 1e-3, 1.0, 1e-4, 1.0], 0.2, 0.4, Vec3::new(0.2, 0.1, 0.0));
    let mut potential = potential(&sheet, 0.4);
    let mut noise = Noise::new(4);
    for size in [0.1, 1.0, 10.0] {
        let direction: Vec<Vec3> = x.iter().map(|_| size * noise.vector()).collect();
        let share = potential.largest_step(&x, &direction);
        assert!(share > 0.0, "{size}");
        for part in [0.5, 1.0] {
            let next: Vec<Vec3> =
                x.iter().zip(&direction).map(|(x, d)| x + part * share * d).collect();
            assert_eq!(Crossings::new(&sheet).find(&sheet, &next).pairs, 0, "{size}");
        }
    }
}

#[test]
fn no_generated_shape_is_in_contact_at_rest() {
    for shape in [
        "shape = 'disc', radius = 5.0",
        "shape = 'rectangle', width = 8.0, height = 3.0",
        "shape = 'annulus', inner = 2.0, outer = 5.0",
        "shape = 'sphere', radius = 3.0",
        "shape = 'sphere', radius = 3.0, irregular = true",
        "shape = 'cylinder', radius = 1.0, height = 6.0",
        "shape = 'cylinder', radius = 1.0, height = 6.0, caps = true",
        "shape = 'cap', radius = 4.0, height = 6.0",
        "shape = 'torus', major = 4.0, minor = 1.0",
        "shape = 'ellipsoid', semi_axes = [3.0, 2.5, 2.0]",
        "shape = 'wavy-strip', width = 9.0, height = 2.0, amplitude = 1.0, wavelength = 3.0",
        "shape = 'graph', width = 6.0, height = 4.0, z = '0.8*sin(x)*cos(y)'",
    ] {
        let scene = format!(
            "sheet = {{ {shape}, vertices = 400 }}\ntime = {{ until = 1.0 }}\n\
             material = {{ young = 1.0, poisson = 0.3, thickness = 1.0 }}\n\
             effect = [{{ kind = 'stretching' }}, {{ kind = 'bending' }}]"
        );
        let (_, simulation) = prepare(&scene, &[]);
        let sheet = simulation.sheet();
        // Thin, several edges, and thicker than the shape is wide.
        for distance in [0.05, 1.0, 5.0] {
            let mut potential = potential(sheet, distance);
            let (energy, force) = gradient(&mut potential, sheet.rest());
            assert_eq!((energy, norm(&force)), (0.0, 0.0), "{shape}, {distance}");
            assert_eq!(potential.refusal(sheet.rest()), None, "{shape}, {distance}");
        }
    }
}

/// Vertices and triangles as a Wavefront file.
fn write_obj(path: &Path, points: &[[f64; 3]], triangles: &[[usize; 3]]) {
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    let one = |t: &[usize; 3]| t.map(|v| v + 1);
    triangles.iter().map(one).for_each(|[a, b, c]| writeln!(text, "f {a} {b} {c}").unwrap());
    std::fs::write(path, text).unwrap();
}

const OF_A_FILE: &str = "sheet = { file = 'mesh.obj' }
    material = { young = 1e3, poisson = 0.3, thickness = 0.1 }
    time = { until = 1.0 }
    effect = [{ kind = 'stretching' }, { kind = 'bending' }, { kind = 'contact' }]";

#[test]
fn a_start_that_touches_itself_is_refused_with_its_place() {
    let folder = folder(OF_A_FILE);
    // A strip that comes back to where its last corner lies on its first triangle.
    let points = [
        [0.0, 0.0, 0.0],
        [0.0, 3.0, 0.0],
        [3.0, 0.0, 0.0],
        [3.0, 3.0, 0.0],
        [3.0, 0.0, 2.0],
        [3.0, 3.0, 2.0],
        [1.0, 1.0, 0.0],
    ];
    let triangles = [[0, 2, 1], [2, 3, 1], [2, 4, 3], [4, 5, 3], [4, 6, 5]];
    write_obj(&folder.path().join("mesh.obj"), &points, &triangles);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("the effect contact cannot begin with this shape"), "{message}");
    let place = "vertex 6 lies on the triangle with the vertices 0, 2 and 1";
    assert!(message.contains(place), "{message}");
}

#[test]
fn a_file_of_two_sheets_is_refused() {
    let folder = folder(OF_A_FILE);
    let points = [0.0, 1.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]).concat();
    write_obj(&folder.path().join("mesh.obj"), &points, &[[0, 1, 2], [3, 4, 5]]);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("the mesh has 2 disconnected parts"), "{message}");
}

/// A flat U whose arms, half a unit from one another, are pulled together.
fn u_shape(path: &Path) {
    let (mut points, mut triangles, mut number) =
        (Vec::new(), Vec::new(), std::collections::BTreeMap::new());
    for (i, j) in (0..18).flat_map(|i| (0..7).map(move |j| (i, j))) {
        if i >= 2 && (2..5).contains(&j) {
            continue;
        }
        let mut at = |i: u32, j: u32| {
            *number.entry((i, j)).or_insert_with(|| {
                points.push([0.25 * f64::from(i), 0.25 * f64::from(j), 0.0]);
                points.len() - 1
            })
        };
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend(if (i + j) % 2 == 1 {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        });
    }
    write_obj(path, &points, &triangles);
}

#[test]
fn contact_in_a_plane_is_that_of_its_twin_in_space() {
    let scene = |planar: bool, path: &str| {
        let (key, pin) = match planar {
            true => (", planar = true", ""),
            false => ("", "{ kind = 'pin', where = 'all', axes = 'z' },"),
        };
        let pull = |y: f64, by: f64| {
            format!(
                "{{ kind = 'load', where = {{ half-space = {{ point = [0, {y}, 0], normal = [0, {}, 0] }} }},
                   force = {{ per-area = [0, {by}, 0] }}, ramp = {{ formula = 't' }} }},",
                -by
            )
        };
        format!(
            "sheet = {{ file = '{path}'{key} }}
            material = {{ young = 100.0, poisson = 0.3, thickness = 0.2 }}
            equilibrium = {{ tolerance = 1e-9 }}
            time = {{ until = 0.3 }}
            effect = [
                {{ kind = 'stretching', model = 'stvk' }}, {pin}
                {{ kind = 'contact' }},
                {{ kind = 'pin', where = {{ half-space = {{ point = [0.1, 0, 0], normal = [-1, 0, 0] }} }}, axes = 'xy' }},
                {} {}
            ]",
            pull(0.55, 3.0),
            pull(1.2, -3.0)
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("u.obj");
    u_shape(&path);
    let [plane, space] = [true, false].map(|planar| at_end(&scene(planar, path.to_str().unwrap())));
    for (a, b) in plane.state().x.iter().zip(&space.state().x) {
        assert!((a - b).norm() < 1e-6 && a.z == 0.0, "{a} {b}");
    }
    // They have come closer than their thickness, and the ends stay apart.
    let (rest, x) = (plane.sheet().rest(), &plane.state().x);
    let ends = |y: f64| {
        let end = (0..x.len()).find(|v| (rest[*v] - Vec3::new(4.5, y, 0.0)).norm() < 1e-9);
        x[end.unwrap()].y
    };
    let gap = ends(1.25) - ends(0.5);
    assert!(gap > 0.05 && gap < 0.2, "{gap}");
}

const CRUSHED: &str = "
    sheet = { shape = 'sphere', radius = 10.0, vertices = 160,
              imperfection = { amplitude = 1e-2, seed = 1, direction = 'normal' } }
    material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.4, drag = 1.0 }
    time = { until = 0.2, policy = 'simultaneous', integrator = { kind = 'staggered' } }
    effect = [
        { kind = 'stretching', model = 'stvk' },
        { kind = 'bending' },
        { kind = 'pressure', value = -5.9 },
        { kind = 'contact' },
    ]";

#[test]
fn a_run_in_contact_has_the_same_bits_on_any_number_of_threads() {
    let bits = |threads: usize| -> Vec<[u64; 3]> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let simulation = pool.install(|| at_end(CRUSHED));
        simulation.state().x.iter().map(|x| [x.x, x.y, x.z].map(f64::to_bits)).collect()
    };
    assert_eq!(bits(1), bits(4));
}

#[test]
fn a_resumed_run_in_contact_is_the_uninterrupted_one() {
    let folder = folder(CRUSHED);
    let often = ["--set", "checkpoint.every=1e-9", "--set", "checkpoint.keep=1000000"];
    let run = [&["run", "scene.toml", "--out", "whole"], &often[..]].concat();
    passes_with(folder.path(), &run);
    let whole = folder.path().join("whole");
    let ledger = std::fs::read_to_string(whole.join("ledger.csv")).unwrap();
    let column = ledger.lines().next().unwrap().split(',').position(|c| c == "pairs of contact");
    let pairs = |row: &str| row.split(',').nth(column.unwrap()).unwrap().parse::<u32>().unwrap();
    assert!(ledger.lines().skip(2).any(|row| pairs(row) > 0), "nothing touches: {ledger}");
    let count = checkpoints(&whole).len();
    assert!(count > 3, "{count} checkpoints");
    for kept in [1, count - 2] {
        let other = folder.path().join(format!("from-{kept}"));
        stopped(&whole, &other, kept);
        let out = rumple(folder.path(), &["resume", other.to_str().unwrap(), "--quiet"]);
        assert!(out.status.success(), "{kept}: {}", text(&out.stderr));
        assert_same(&whole, &other, &format!("from checkpoint {kept} of {count}"));
    }
}
