//! Distances, derivatives and free steps of contact against ipctk and against exact arithmetic
//! (`tests/scripts/contact.py`).

use std::io::Write;
use std::process::{Command, Stdio};
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{BlockMatrix, Contacts, EnergyTerm, HessianPart};
use rumple::geometry::proximity::{Corners, Nearest, PairKind, edge_edge, point_triangle};
use rumple::model::{Mechanics, Potential};
use rumple::sheet::Sheet;

use crate::common::{Noise, path};

const KINDS: [PairKind; 2] = [PairKind::PointTriangle, PairKind::EdgeEdge];

fn nearest(kind: PairKind, x: &Corners) -> Nearest {
    match kind {
        PairKind::PointTriangle => point_triangle(x).0,
        PairKind::EdgeEdge => edge_edge(x),
    }
}

/// What the script answers to `records` in a mode.
fn answers(mode: &str, records: &[Vec<f64>]) -> Vec<f64> {
    let python = std::env::var("RUMPLE_PYTHON").expect("RUMPLE_PYTHON names the interpreter");
    let script = path("tests/scripts/contact.py");
    let mut child = Command::new(python)
        .args([&script, mode])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let bytes: Vec<u8> = records.concat().iter().flat_map(|v| v.to_ne_bytes()).collect();
    let writer = std::thread::spawn(move || input.write_all(&bytes));
    let out = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(out.status.success());
    out.stdout.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect()
}

fn coordinates(x: &[Vec3]) -> Vec<f64> {
    x.iter().flat_map(|x| [x.x, x.y, x.z]).collect()
}

/// How near to degenerate a pair is; every eighth is arbitrary.
const CASES: usize = 8;

/// A pair of the case `case`, of size about 1.
fn pair(kind: PairKind, case: usize, noise: &mut Noise) -> Corners {
    let mut x: Corners = std::array::from_fn(|_| noise.vector());
    let power = |noise: &mut Noise, most: f64| 10f64.powf(-0.5 * most * (1.0 + noise.number()));
    let size = power(noise, 6.0);
    let share = |noise: &mut Noise| 0.5 * (1.0 + noise.number());
    match (case, kind) {
        // Parallel edges; a needle.
        (1, PairKind::EdgeEdge) => {
            x[3] = x[2] + share(noise) * (x[1] - x[0]) + size * noise.vector()
        }
        (1, PairKind::PointTriangle) => {
            x[3] = x[1] + share(noise) * (x[2] - x[1]) + size * noise.vector();
        }
        // Close to one another, inside.
        (2, PairKind::EdgeEdge) => {
            let (s, t) = (share(noise), share(noise));
            let to = x[0] + s * (x[1] - x[0]) + size * noise.vector() - x[2] - t * (x[3] - x[2]);
            (x[2], x[3]) = (x[2] + to, x[3] + to);
        }
        (2, PairKind::PointTriangle) => {
            let (s, t) = (share(noise), 0.5 * share(noise));
            x[0] = x[1] + 0.5 * s * (x[2] - x[1]) + t * (x[3] - x[1]) + size * noise.vector();
        }
        // A feature that is much smaller than the other.
        (3, PairKind::EdgeEdge) => x[3] = x[2] + size * noise.vector(),
        (3, PairKind::PointTriangle) => {
            (x[2], x[3]) = (x[1] + size * noise.vector(), x[1] + size * noise.vector());
        }
        // Close to where an end or an edge becomes the nearest feature.
        (4, PairKind::EdgeEdge) => {
            x[2] = x[0] + share(noise) * (x[1] - x[0]).cross(&x[2]) + size * noise.vector();
        }
        (4, PairKind::PointTriangle) => {
            let normal = (x[2] - x[1]).cross(&(x[3] - x[1]));
            x[0] = x[1] + share(noise) * (x[2] - x[1]) + normal + size * noise.vector();
        }
        // Close to a plane.
        (5, _) => x.iter_mut().for_each(|x| x.z *= size),
        // Close to a line.
        (6, _) => x.iter_mut().for_each(|x| (x.y, x.z) = (size * x.y, size * x.z)),
        // Far from the origin.
        (7, _) => x.iter_mut().for_each(|x| *x += Vec3::new(20.0, -30.0, 40.0)),
        _ => {}
    }
    x
}

fn pairs(count: usize) -> Vec<(usize, PairKind, Corners)> {
    let mut noise = Noise::new(11);
    let one = |k: usize| {
        let (case, kind) = (k / 2 % CASES, KINDS[k % 2]);
        (case, kind, pair(kind, case, &mut noise))
    };
    (0..count).map(one).collect()
}

fn norm(of: &[f64]) -> f64 {
    of.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm(&difference)
}

#[test]
#[ignore = "needs Python with the ipctk package in RUMPLE_PYTHON; tests/run.sh runs it"]
fn real_ipctk_has_the_same_distances_and_derivatives() {
    let pairs = pairs(20_000);
    let record = |(_, kind, x): &(usize, PairKind, Corners)| {
        let mut record = vec![f64::from(u8::from(*kind == PairKind::EdgeEdge))];
        record.extend(coordinates(x));
        record
    };
    let answers = answers("pairs", &pairs.iter().map(record).collect::<Vec<_>>());
    for ((case, kind, x), expected) in pairs.iter().zip(answers.chunks_exact(158)) {
        let nearest = nearest(*kind, x);
        let (d, hessian) = (nearest.distance(), nearest.squared_hessian(x));
        let gradient = nearest.weights().map(|w| 2.0 * w * nearest.connection());
        let entry = |k: usize| hessian[k / 36][k % 12 / 3][(k / 12 % 3, k % 3)];
        let second: Vec<f64> = (0..144).map(entry).collect();
        let size = x.iter().map(nalgebra::Vector3::amax).fold(1.0, f64::max);
        let off = (d - expected[0].sqrt()).abs();
        assert!(off < 1e-13 * size, "{case} {kind:?} {x:?}: distance off by {off:e}");
        // Of features that are small and far apart the reference loses digits.
        let off = apart(&coordinates(&gradient), &expected[2..14]);
        let bound = 1e-12 * size + 1e-9 * d;
        assert!(off < bound, "{case} {kind:?} {x:?}: gradient off by {off:e}");
        // So it does where all corners lie close to a line.
        let bound = if *case == 6 { 1e-3 } else { 1e-10 } * norm(&second);
        let off = apart(&second, &expected[14..]);
        assert!(off < bound, "{case} {kind:?} {x:?}: second derivatives off by {off:e}");
    }
}

/// Two triangles near one another, of the case `case`.
fn triangles(case: usize, noise: &mut Noise) -> [Vec3; 6] {
    let kind = KINDS[case % 2];
    let [a, b, c, d] = pair(kind, case / 2, noise);
    match kind {
        PairKind::PointTriangle => [a, a + noise.vector(), a + noise.vector(), b, c, d],
        PairKind::EdgeEdge => [a, b, a + noise.vector(), c, d, c + noise.vector()],
    }
}

/// Energy, derivatives and second derivatives of the contact of two triangles.
fn energy(sheet: &Arc<Sheet>, x: &[Vec3], reach: f64, stiffness: f64) -> Vec<f64> {
    let term = EnergyTerm::contact(Contacts::new(sheet, reach, stiffness));
    let mechanics = Mechanics::new(Arc::clone(sheet), vec![term], Vec::new()).unwrap();
    let mut potential = Potential::new(&mechanics);
    let mut gradient = vec![Vec3::zeros(); 6];
    let mut all = vec![potential.energy_gradient(x, &mut gradient)];
    all.extend(coordinates(&gradient));
    let mut hessian = BlockMatrix::zeros(potential.pattern(x));
    potential.hessian(x, HessianPart::Full, &mut hessian).unwrap();
    let mut dense = vec![0.0; 324];
    for i in 0..6 {
        for (&j, block) in hessian.pattern().row(i).iter().zip(hessian.row(i)) {
            let j = j as usize;
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                dense[18 * (3 * i + a) + 3 * j + b] = block[(a, b)];
                dense[18 * (3 * j + b) + 3 * i + a] = block[(a, b)];
            }
        }
    }
    all.extend(dense);
    all
}

#[test]
#[ignore = "needs Python with the ipctk package in RUMPLE_PYTHON; tests/run.sh runs it"]
fn real_ipctk_has_the_same_energy_of_contact() {
    let mut noise = Noise::new(12);
    let (mut records, mut found) = (Vec::new(), Vec::new());
    for k in 0..2000 {
        let x = triangles(k % (2 * CASES), &mut noise);
        // Far apart at rest, so that no reach is shortened.
        let far = |k: usize| if k < 3 { Vec3::zeros() } else { Vec3::new(100.0, 0.0, 0.0) };
        let rest: Vec<Vec3> = (0..6).map(|k| noise.vector() + far(k)).collect();
        let (reach, stiffness) = (0.6 + 0.4 * noise.number(), 2.0 + noise.number());
        let mut record = coordinates(&x);
        record.extend(coordinates(&rest));
        record.extend([reach, stiffness]);
        records.push(record);
        let sheet = Arc::new(Sheet::new(rest, vec![[0, 1, 2], [3, 4, 5]]).unwrap());
        found.push(energy(&sheet, &x, reach, stiffness));
    }
    let answers = answers("energies", &records);
    let mut touching = 0;
    for (k, (found, expected)) in found.iter().zip(answers.chunks_exact(343)).enumerate() {
        touching += usize::from(expected[0] > 0.0);
        for (range, bound) in [(0..1, 1e-8), (1..19, 1e-6), (19..343, 1e-5)] {
            let (found, expected) = (&found[range.clone()], &expected[range]);
            let off = apart(found, expected);
            assert!(off <= bound * norm(expected), "{k}: off by {off:e} of {:e}", norm(expected));
        }
    }
    assert!(touching > 1000, "{touching}");
}

/// A motion, and a share of it at which the features touch, as is known without round-off.
struct Query {
    kind: PairKind,
    x: Corners,
    d: Corners,
    touch: f64,
}

/// A whole number up to `most`.
fn whole(noise: &mut Noise, most: f64) -> f64 {
    (most * noise.number()).round()
}

/// From 0 to 8.
fn eighths(noise: &mut Noise) -> f64 {
    (4.0 + whole(noise, 5.0)).clamp(0.0, 8.0)
}

/// A motion in whole numbers, on which features touch at a multiple of 1/64.
fn planted(kind: PairKind, case: usize, noise: &mut Noise) -> Query {
    let sizes = [100.0, 3.0, 1e4];
    let mut vectors = |size: f64| -> Corners {
        std::array::from_fn(|_| 8.0 * Vec3::from_fn(|_, _| whole(noise, size)))
    };
    let (mut at, mut d) = (vectors(sizes[case % 3]), vectors(sizes[case / 3 % 3]));
    match case / 9 % 4 {
        // In a plane; on a line; parallel, or a needle.
        1 => at.iter_mut().chain(&mut d).for_each(|v| v.z = 0.0),
        2 => at.iter_mut().chain(&mut d).for_each(|v| (v.y, v.z) = (0.0, 0.0)),
        3 => at[3] = at[2] + 2.0 * (at[1] - at[if kind == PairKind::EdgeEdge { 0 } else { 2 }]),
        _ => {}
    }
    if case / 36 % 2 == 1 {
        // Nearly all of the motion is common.
        let (own, common) = (d, 1000.0 * d[0]);
        d = own.map(|own| own + common);
    }
    match kind {
        PairKind::PointTriangle => {
            let first = eighths(noise);
            let second = eighths(noise).min(8.0 - first);
            at[0] = at[1] + (first * (at[2] - at[1]) + second * (at[3] - at[1])) / 8.0;
        }
        PairKind::EdgeEdge => {
            let (s, t) = (eighths(noise), eighths(noise));
            let to = at[0] - at[2] + (s * (at[1] - at[0]) - t * (at[3] - at[2])) / 8.0;
            (at[2], at[3]) = (at[2] + to, at[3] + to);
        }
    }
    let sixty_fourths = (33.0 + whole(noise, 31.0)).clamp(1.0, 64.0);
    let x = std::array::from_fn(|k| at[k] - sixty_fourths * d[k]);
    Query { kind, x, d: d.map(|d| 64.0 * d), touch: sixty_fourths / 64.0 }
}

/// A share of the distance at the start at which a motion ends; steps ask for a tenth.
fn free_share(query: &Query, share: f64) -> f64 {
    let Query { kind, x, d, .. } = query;
    kind.free_share(x, d, share * kind.distance(x))
}

#[test]
fn no_planted_collision_is_missed() {
    let mut noise = Noise::new(13);
    let mut apart = 0;
    for k in 0..100_000 {
        let query = planted(KINDS[k % 2], k / 2 % 72, &mut noise);
        let Query { kind, x, d, touch } = &query;
        let start = kind.distance(x);
        let size = x.iter().map(nalgebra::Vector3::amax).fold(0.0, f64::max);
        if start <= 1e-14 * size {
            // They touch from the beginning, and may move on together.
            continue;
        }
        apart += 1;
        for nearness in [0.1, 1e-4] {
            let share = free_share(&query, nearness);
            assert!(share < *touch, "{k}: {share} beyond {touch}: {kind:?} {x:?} {d:?}");
            let left = kind.distance(&std::array::from_fn(|k| x[k] + share * d[k]));
            assert!(left > 0.09 * nearness * start, "{k}: {left} of {start}");
        }
    }
    assert!(apart > 60_000, "{apart}");
}

#[test]
#[ignore = "needs Python in RUMPLE_PYTHON; tests/run.sh runs it"]
fn real_arithmetic_finds_no_collision_on_free_steps() {
    let mut noise = Noise::new(14);
    let count = std::env::var("RUMPLE_QUERIES").map_or(10_000, |count| count.parse().unwrap());
    let (mut records, mut shortened) = (Vec::new(), 0);
    for k in 0..count {
        let (kind, case) = (KINDS[k % 2], k / 2 % CASES);
        let (x, to) = (pair(kind, case, &mut noise), pair(kind, (k / 16) % CASES, &mut noise));
        let d = std::array::from_fn(|k| to[k] - x[k]);
        let query = Query { kind, x, d, touch: f64::INFINITY };
        let share = free_share(&query, 0.1);
        shortened += usize::from(share < 1.0);
        let mut record = vec![f64::from(u8::from(kind == PairKind::EdgeEdge))];
        record.extend(coordinates(&x));
        record.extend(coordinates(&d));
        record.push(share);
        records.push(record);
    }
    assert!(shortened > count / 5, "{shortened}");
    let answers = answers("shares", &records);
    assert_eq!(answers.len(), count);
    let missed: Vec<usize> = (0..count).filter(|k| answers[*k] != 0.0).collect();
    assert!(missed.is_empty(), "{missed:?}");
}
