//! Every fault of a mesh is found, with its place.

use proptest::prelude::*;
use rumple::sheet::check::{Fault, examine};
use rumple::sheet::{SheetError, Surface};

type V = rumple::Vec3;

/// A hexagon around vertex 0.
fn hexagon() -> Surface {
    let mut points = vec![V::zeros()];
    for k in 0..6 {
        let angle = std::f64::consts::TAU * f64::from(k) / 6.0;
        points.push(V::new(angle.cos(), angle.sin(), 0.0));
    }
    let triangles = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
    Surface { points, triangles, ..Surface::default() }
}

/// The hexagon with one fault, which must be found alone, in these words.
fn planted(fault: Fault, words: &[&str], plant: impl FnOnce(&mut Surface)) {
    let mut surface = hexagon();
    plant(&mut surface);
    let (findings, _) = examine(&surface);
    let found =
        findings.iter().find(|f| f.fault == fault).unwrap_or_else(|| panic!("{findings:?}"));
    let message = found.to_string();
    for word in words {
        assert!(message.contains(word), "\"{word}\" is not in: {message}");
    }
    assert!(found.fatal, "{message}");
    match surface.into_sheet() {
        Err(SheetError::Unusable(_)) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_good_mesh_has_no_findings_and_keeps_its_order() {
    let surface = hexagon();
    let (sheet, findings) = surface.clone().into_sheet().unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(sheet.rest(), &surface.points[..]);
    assert_eq!(sheet.triangles(), &surface.triangles[..]);
}

#[test]
fn planted_faults_are_found_with_their_place() {
    planted(Fault::Empty, &["no points or no triangles"], |s| s.triangles.clear());
    planted(Fault::NonFinite, &["not a finite", "vertex 3"], |s| s.points[3].y = f64::NAN);
    planted(Fault::IndexOutOfRange, &["last one, 6", "triangle 2"], |s| s.triangles[2][1] = 7);
    planted(Fault::RepeatedVertex, &["twice", "triangle 4"], |s| s.triangles[4][1] = 0);
    planted(Fault::DuplicateTriangle, &["triangle 1 and triangle 6"], |s| {
        s.triangles.push([3, 0, 2])
    });
    planted(Fault::CoincidentVertices, &["vertex 2 and vertex 5"], |s| s.points[5] = s.points[2]);
    planted(Fault::UnreferencedVertex, &["no triangle", "vertex 7"], |s| {
        s.points.push(V::x() * 9.0)
    });
    planted(Fault::ZeroArea, &["no area", "triangle 0"], |s| s.points[2] = s.points[1] * 2.0);
    planted(
        Fault::NonManifoldEdge,
        &["more than two", "between vertex 0 and vertex 1 in triangle 0, triangle 5, triangle 6"],
        |s| {
            s.points.push(V::new(0.5, 0.0, 1.0));
            s.triangles.push([0, 1, 7]);
        },
    );
    planted(Fault::NonManifoldVertex, &["bow tie", "vertex 1"], |s| {
        s.points.extend([V::new(2.0, 1.0, 0.0), V::new(2.0, -1.0, 0.0)]);
        s.triangles.push([1, 8, 7]);
    });
    planted(Fault::SeveralComponents, &["2 disconnected parts", "triangle 0; triangle 6"], |s| {
        s.points.extend([V::x() * 5.0, V::x() * 6.0, V::new(5.0, 1.0, 0.0)]);
        s.triangles.push([7, 8, 9]);
    });
}

#[test]
fn two_closed_fans_in_one_vertex_are_a_bow_tie() {
    // Two tetrahedra that share their tip: no boundary edge gives the tip away.
    let mut points = vec![V::zeros()];
    let mut triangles = Vec::new();
    for (side, first) in [(1.0, 1u32), (-1.0, 4)] {
        points.extend([V::new(1.0, 0.0, side), V::new(-1.0, 1.0, side), V::new(-1.0, -1.0, side)]);
        let [a, b, c] = [first, first + 1, first + 2];
        triangles.extend([[0, a, b], [0, b, c], [0, c, a], [c, b, a]]);
    }
    let surface = Surface { points, triangles, ..Surface::default() };
    let (findings, _) = examine(&surface);
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_eq!(findings[0].fault, Fault::NonManifoldVertex);
    assert!(findings[0].to_string().ends_with(": vertex 0"), "{}", findings[0]);
}

#[test]
fn a_moebius_strip_is_refused() {
    let n = 12u32;
    let mut points = Vec::new();
    for k in 0..n {
        let turn = std::f64::consts::TAU * f64::from(k) / f64::from(n);
        for side in [-0.3, 0.3] {
            let r = 1.0 + side * (0.5 * turn).cos();
            points.push(V::new(r * turn.cos(), r * turn.sin(), side * (0.5 * turn).sin()));
        }
    }
    let mut triangles = Vec::new();
    for k in 0..n {
        let (a, b) = (2 * k, 2 * k + 1);
        let (c, d) = if k + 1 == n { (1, 0) } else { (a + 2, b + 2) };
        triangles.extend([[a, c, b], [b, c, d]]);
    }
    let (findings, _) = examine(&Surface { points, triangles, ..Surface::default() });
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_eq!(findings[0].fault, Fault::NotOrientable);
}

#[test]
fn turned_triangles_are_turned_back_and_reported() {
    let mut surface = hexagon();
    surface.triangles[1].swap(0, 1);
    surface.triangles[4].swap(1, 2);
    let (sheet, findings) = surface.into_sheet().unwrap();
    assert_eq!(findings.len(), 1);
    assert_eq!(findings[0].fault, Fault::Orientation);
    assert_eq!(findings[0].places, ["triangle 1", "triangle 4"]);
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
        assert!((b - a).cross(&(c - a)).z > 0.0);
    }
}

/// H was -1/r, so that a law with `pos(H)` was silent and a pressure pushed the other way.
#[test]
fn a_closed_mesh_that_faces_inwards_is_turned_over_with_a_note() {
    let sphere = crate::common::icosphere(1, 3.0);
    let shift = V::new(50.0, -20.0, 7.0);
    let points: Vec<V> = sphere.rest().iter().map(|x| x + shift).collect();
    let outwards = Surface { points, triangles: sphere.triangles().to_vec(), ..Surface::default() };
    let (same, findings) = outwards.clone().into_sheet().unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(same.triangles(), &outwards.triangles[..]);

    let mut inwards = outwards.clone();
    inwards.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let (sheet, findings) = inwards.clone().into_sheet().unwrap();
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((finding.fault, finding.fatal), (Fault::FacesInwards, false));
    assert!(finding.to_string().contains("normals inwards"), "{finding}");
    assert_eq!(finding.count, outwards.triangles.len());
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
        assert!((b - a).cross(&(c - a)).dot(&(a - shift)) > 0.0);
    }

    // With a hole the inside is undefined, and the file decides.
    inwards.triangles.pop();
    let (open, findings) = inwards.clone().into_sheet().unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(open.triangles(), &inwards.triangles[..]);
}

proptest! {
    #![proptest_config(super::fixed(500))]

    #[test]
    fn any_soup_is_a_sheet_or_an_error(
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 0..8),
        triangles in prop::collection::vec(prop::array::uniform3(0u32..8), 0..12),
    ) {
        let points = points.into_iter().map(V::from).collect();
        let surface = Surface { points, triangles, ..Surface::default() };
        let fatal = examine(&surface).0.iter().any(|f| f.fatal);
        prop_assert_eq!(surface.into_sheet().is_err(), fatal);
    }
}

#[test]
fn needles_are_told_with_their_quality_and_are_usable() {
    let mut surface = hexagon();
    surface.points[1] = surface.points[2] * 1.0001 + V::new(0.0, 0.0, 1e-4);
    surface.triangle_lines = (11..17).collect();
    let (findings, _) = examine(&surface);
    let [needle] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!((needle.fault, needle.fatal), (Fault::Needle, false));
    let message = needle.to_string();
    assert!(message.contains("triangle 0 (line 11), quality 1."), "{message}");
    assert!(message.contains("e-4"), "{message}");
    let (_, notes) = surface.into_sheet().unwrap();
    assert_eq!(notes.len(), 1);
}
