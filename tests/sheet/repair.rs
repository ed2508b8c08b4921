//! Repair of meshes: what is mended, what is refused and how it is named.

use rumple::sheet::check::Fault;
use rumple::sheet::repair::{RepairOptions, Repaired, repair};
use rumple::sheet::{MeshReport, SheetShape, Surface, generate};

use super::read::parsed;

fn obj(text: &str) -> Surface {
    parsed(text.as_bytes(), "obj").unwrap()
}

fn repaired(surface: Surface) -> Repaired {
    repair(surface, RepairOptions::default()).unwrap()
}

fn steps(repaired: &Repaired) -> String {
    let steps = repaired.steps.iter().map(|s| format!("{}: {}", s.done, s.places.join("; ")));
    steps.collect::<Vec<_>>().join("\n")
}

/// A sheet as a soup: every triangle with corners of its own.
fn soup(shape: &SheetShape, shift: impl Fn(usize) -> f64) -> Surface {
    let sheet = generate(shape, 400, 1).unwrap();
    let mut surface = Surface::default();
    for t in sheet.triangles() {
        let start = u32::try_from(surface.points.len()).unwrap();
        for &v in t {
            let mut p = sheet.rest()[v as usize];
            p.x += shift(surface.points.len());
            surface.points.push(p);
        }
        surface.triangles.push([start, start + 1, start + 2]);
    }
    surface
}

#[test]
fn a_soup_becomes_the_sheet_that_it_came_from() {
    let shape = SheetShape::Sphere { radius: 1.0, irregular: true };
    let exact = repaired(soup(&shape, |_| 0.0));
    let report = MeshReport::new(exact.result.as_ref().unwrap());
    assert_eq!((report.vertices, report.euler_characteristic), (400, 2));
    assert!(steps(&exact).contains("merged"), "{}", steps(&exact));
    // Rounded differently in every triangle: a distance joins them.
    let rounded = |k: usize| 1e-7 * f64::from(u8::try_from(k % 7).unwrap());
    let apart = repair(soup(&shape, rounded), RepairOptions::default()).unwrap();
    assert!(apart.result.is_err());
    let near = RepairOptions { merge_distance: 1e-5, ..RepairOptions::default() };
    let joined = repair(soup(&shape, rounded), near).unwrap();
    assert_eq!(joined.result.unwrap().vertex_count(), 400);
}

#[test]
fn everything_that_needs_no_guess_is_mended() {
    // Two triangles; the second against the first, one twice, one collapsed, a crumb far away, a loose vertex.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 9 9 9\nv 5 5 5\nv 5.01 5 5\nv 5 5.01 5\n\
        f 1 2 3\nf 2 3 4\nf 3 1 2\nf 1 1 2\nf 6 7 8\n";
    let mended = repaired(obj(text));
    let told = steps(&mended);
    for words in [
        "removed 1 triangles with a vertex twice: triangle 3 (line 12)",
        "removed 1 triangles with the vertices of another one: triangle 2 (line 11)",
        "removed 1 parts of less than 0.01 of the area: 1 triangles",
        "left out 4 vertices without a triangle: vertex 4 (line 5)",
    ] {
        assert!(told.contains(words), "\"{words}\" is not in:\n{told}");
    }
    assert!(mended.notes.iter().any(|f| f.fault == Fault::Orientation), "{:?}", mended.notes);
    let sheet = mended.result.unwrap();
    assert_eq!((sheet.vertex_count(), sheet.triangle_count()), (4, 2));
}

#[test]
fn a_triangle_without_area_is_flipped_away() {
    // Vertex 4 lies on the edge between 1 and 2, whose other side knows nothing of it.
    let text = "v 0 0 0\nv 2 0 0\nv 1 1 0\nv 1 0 0\nv 1 -1 0\nf 1 4 3\nf 4 2 3\nf 1 2 4\nf 2 1 5\n";
    let mended = repaired(obj(text));
    assert!(steps(&mended).contains("flipped the longest edge of 1"), "{}", steps(&mended));
    let sheet = mended.result.unwrap();
    let report = MeshReport::new(&sheet);
    assert_eq!((report.triangles, report.euler_characteristic, report.area), (4, 1, 2.0));
}

#[test]
fn a_sound_mesh_is_left_as_it_is() {
    let sheet = generate(&SheetShape::Disc { radius: 1.0 }, 200, 1).unwrap();
    let surface = Surface {
        points: sheet.rest().to_vec(),
        triangles: sheet.triangles().to_vec(),
        ..Surface::default()
    };
    let mended = repaired(surface);
    assert!(mended.steps.is_empty() && mended.notes.is_empty());
    assert_eq!(mended.result.unwrap(), sheet);
}

#[test]
fn what_cannot_be_repaired_is_refused_with_numbers_of_the_file() {
    let refused = |text: &str, fault: Fault, words: &[&str]| {
        let left = repaired(obj(text)).result.unwrap_err();
        let found = left.iter().find(|f| f.fault == fault);
        let found = found.unwrap_or_else(|| panic!("{fault:?} is not in {left:?}"));
        for word in words {
            assert!(found.to_string().contains(word), "\"{word}\" is not in: {found}");
        }
        assert!(fault.advice().is_some(), "{fault:?}");
    };
    let fan = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\n";
    // A triangle twice before: numbers are still those of the file.
    refused(
        &format!("{fan}f 1 2 3\nf 1 2 3\nf 2 1 4\nf 1 2 5\n"),
        Fault::NonManifoldEdge,
        &[
            "vertex 0 (line 1) and vertex 1 (line 2)",
            "triangle 0 (line 6)",
            "triangle 2 (line 8)",
            "triangle 3 (line 9)",
        ],
    );
    refused(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv -1 0 0\nv -1 -1 0\nf 1 2 3\nf 1 4 5\n",
        Fault::NonManifoldVertex,
        &["vertex 0 (line 1)"],
    );
    refused(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 5 0 0\nv 6 0 0\nv 6 1 0\nf 1 2 3\nf 4 5 6\n",
        Fault::SeveralComponents,
        &["2 disconnected parts", "triangle 1 (line 8)"],
    );
    refused("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", Fault::NonFinite, &["vertex 2 (line 3)"]);
    refused(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 7\n",
        Fault::IndexOutOfRange,
        &["triangle 0 (line 4)"],
    );
    // A Möbius strip of five quadrilaterals.
    let mut strip = String::new();
    for k in 0..5u32 {
        let (angle, half) =
            (f64::from(k) * std::f64::consts::TAU / 5.0, f64::from(k) * std::f64::consts::PI / 5.0);
        for side in [-0.4, 0.4] {
            let r = 2.0 + side * half.cos();
            strip += &format!("v {} {} {}\n", r * angle.cos(), r * angle.sin(), side * half.sin());
        }
    }
    for k in 0..5 {
        let (a, b) = (2 * k + 1, 2 * k + 2);
        let (c, d) = if k == 4 { (2, 1) } else { (a + 2, b + 2) };
        strip += &format!("f {a} {c} {b}\nf {b} {c} {d}\n");
    }
    refused(&strip, Fault::NotOrientable, &["Möbius", "triangle"]);
    let message = repair(obj(fan), RepairOptions { merge_distance: -1.0, small: 0.0 }).unwrap_err();
    assert!(message.to_string().contains("merge distance -1"), "{message}");
}
