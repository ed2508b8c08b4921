//! PLY, STL and Gmsh meshes; quadrilaterals and mixed cells of all formats; damaged files.

use rumple::sheet::{MeshReport, Surface, read};

use super::read::{data, parsed, refused};

/// Every file of the ellipse: name, and notes.
const FILES: [(&str, usize); 12] = [
    ("gmsh-22-ascii.msh", 1),
    ("gmsh-22-binary.msh", 1),
    ("gmsh-40-ascii.msh", 1),
    ("gmsh-41-ascii.msh", 1),
    ("gmsh-41-binary.msh", 1),
    ("gmsh-22-quads.msh", 2),
    ("gmsh-41-quads.msh", 2),
    ("gmsh-ascii.stl", 0),
    ("gmsh-binary.stl", 0),
    ("quads-ascii.ply", 1),
    ("quads-little.ply", 1),
    ("quads-big.ply", 1),
];

fn read_data(name: &str) -> Surface {
    read::surface(data(name)).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn files_of_gmsh_and_vtk_are_read() {
    for (name, notes) in FILES {
        let surface = read_data(name);
        assert_eq!(surface.notes.len(), notes, "{name}: {:?}", surface.notes);
        let text = surface.triangle_lines.len();
        assert!(text == 0 || text == surface.triangles.len(), "{name}");
        let (sheet, findings) = surface.into_sheet().unwrap_or_else(|e| panic!("{e}"));
        assert!(findings.is_empty(), "{name}: {findings:?}");
        let report = MeshReport::new(&sheet);
        assert_eq!((report.vertices, report.triangles, report.euler_characteristic), (27, 39, 1));
        // STL and PLY hold single precision.
        assert!((report.area - 9.052_001).abs() < 1e-5, "{name}: {}", report.area);
        assert!(sheet.rest().iter().all(|p| p.z == 0.0));
    }
}

#[test]
fn text_and_binary_files_of_one_mesh_are_the_same_sheet() {
    let of = |name: &str| read_data(name).into_sheet().unwrap().0;
    let text = of("gmsh-22-ascii.msh");
    for name in
        ["gmsh-22-binary.msh", "gmsh-40-ascii.msh", "gmsh-41-ascii.msh", "gmsh-41-binary.msh"]
    {
        let other = of(name);
        assert_eq!(other.triangles(), text.triangles(), "{name}");
        let distance = other.rest().iter().zip(text.rest()).map(|(p, q)| (p - q).norm());
        assert!(distance.fold(0.0, f64::max) < 1e-14, "{name}");
    }
    assert_eq!(of("quads-little.ply"), of("quads-big.ply"));
}

/// Valid files of other programs: they were refused, or read as no mesh.
#[test]
fn other_spellings_of_a_mesh_are_the_same_mesh() {
    let of = |name: &str| std::fs::read(data(name)).unwrap();
    let text = |name: &str| String::from_utf8(of(name)).unwrap();
    let marked = |text: &str| ["\u{feff}", text].concat();
    let returns = |text: &str| text.replace('\n', "\r");
    let stl = text("gmsh-ascii.stl");
    let mut binary = of("gmsh-binary.stl");
    binary[..80].copy_from_slice(&[b"solid ".as_slice(), &[0; 74]].concat());
    binary.extend_from_slice(b"of another program");
    let msh = text("gmsh-22-ascii.msh");
    let entity = |line: &str| {
        if line.split(' ').count() == 4 { format!("{line} 2 1 0.5 0.5") } else { line.into() }
    };
    let (head, rest) = msh.split_once("$Elements").unwrap();
    let head: Vec<String> = head.lines().map(entity).collect();
    let parametric =
        format!("{}\n$Elements{rest}", head.join("\n")).replace("Nodes", "ParametricNodes");
    let ply = text("quads-ascii.ply");
    let returned_head = |name: &str| {
        let bytes = of(name);
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
        [returns(&head).as_bytes(), &bytes[end..]].concat()
    };
    for (name, changed) in [
        ("quads-little.ply", returned_head("quads-little.ply")),
        ("quads-big.ply", returned_head("quads-big.ply")),
        ("quads-ascii.ply", returned_head("quads-ascii.ply")),
        ("gmsh-ascii.stl", stl.to_uppercase().into_bytes()),
        ("gmsh-ascii.stl", marked(&stl).into_bytes()),
        ("gmsh-ascii.stl", returns(&stl).into_bytes()),
        ("gmsh-binary.stl", binary),
        ("gmsh-22-ascii.msh", parametric.into_bytes()),
        ("gmsh-22-ascii.msh", marked(&msh).into_bytes()),
        ("gmsh-22-ascii.msh", returns(&msh).into_bytes()),
        ("quads-ascii.ply", marked(&ply).into_bytes()),
        ("quads-ascii.ply", returns(&ply).into_bytes()),
        ("legacy-51-ascii.vtk", returns(&text("legacy-51-ascii.vtk")).into_bytes()),
    ] {
        let ending = name.rsplit('.').next().unwrap();
        let other = parsed(&changed, ending).unwrap_or_else(|e| panic!("{name}: {e}"));
        let expected = read_data(name);
        let points = other.points.iter().zip(&expected.points);
        assert!(points.clone().all(|(p, q)| (p - q).norm() < 1e-6), "{name}");
        assert_eq!(
            (points.count(), &other.triangles),
            (expected.points.len(), &expected.triangles),
            "{name}"
        );
    }
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    let broken = "v 0 \\\n0 0\nv 1 0 0\nv \\\r\n1 1 \\ \n0\nv 0 1 0\nf 1 2 3\nf 1 \\\n3 \\\n4\n";
    for changed in [broken.to_owned(), marked(obj), returns(obj)] {
        let (other, expected) = (parsed(changed.as_bytes(), "obj"), parsed(obj.as_bytes(), "obj"));
        let (other, expected) = (other.unwrap(), expected.unwrap());
        assert_eq!((other.points, other.triangles), (expected.points, expected.triangles));
    }
}

#[test]
fn polygons_are_cut_into_their_best_triangles() {
    // The short diagonal of a quadrilateral, whichever corner comes first.
    let corners = "v 0 0 0\nv 3 -1 0\nv 4 0 0\nv 3 1 0\n";
    for face in ["f 1 2 3 4", "f 2 3 4 1", "f 3 4 1 2"] {
        let surface = parsed(format!("{corners}{face}\n").as_bytes(), "obj").unwrap();
        let mut cut: Vec<[u32; 3]> = surface.triangles.clone();
        cut.iter_mut().for_each(|t| t.sort_unstable());
        cut.sort_unstable();
        assert_eq!(cut, [[0, 1, 3], [1, 2, 3]], "{face}");
        assert_eq!(surface.triangle_lines, [5, 5]);
        let (sheet, findings) = surface.into_sheet().unwrap();
        assert!(findings.is_empty() && MeshReport::new(&sheet).area == 4.0);
    }
    // An arrow: not convex, so that one of its diagonals lies outside.
    let arrow = parsed(b"v 0 0 0\nv 2 -2 0\nv 1 0 0\nv 2 2 0\nf 1 2 3 4\n", "obj").unwrap();
    assert!(
        arrow.triangles.iter().all(|t| t.contains(&0) && t.contains(&2)),
        "{:?}",
        arrow.triangles
    );
    // A star of ten corners has the area that it has.
    let corner = |k: u32| {
        let (r, angle) = (
            if k.is_multiple_of(2) { 2.0 } else { 0.8 },
            f64::from(k) * std::f64::consts::PI / 5.0,
        );
        format!("v {} {} 0\n", r * angle.cos(), r * angle.sin())
    };
    let star = (0..10).map(corner).collect::<String>() + "f 1 2 3 4 5 6 7 8 9 10\n";
    let (star, findings) = parsed(star.as_bytes(), "obj").unwrap().into_sheet().unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    let exact = 10.0 * 0.5 * 2.0 * 0.8 * (std::f64::consts::PI / 5.0).sin();
    assert!((MeshReport::new(&star).area - exact).abs() < 1e-12);
}

#[test]
fn quads_of_vtk_are_cut_with_their_arrays() {
    for name in ["with-a-quad.vtu", "legacy-with-a-quad.vtk"] {
        let surface = read_data(name);
        assert_eq!(surface.triangles.len(), 8, "{name}");
        assert!(surface.notes.iter().any(|note| note.contains("cut into triangles")), "{name}");
        for array in &surface.cell_arrays {
            let values = array.values.as_slice();
            assert_eq!(values.len(), 8 * array.components, "{name}");
            assert_eq!(
                values[6 * array.components..7 * array.components],
                values[7 * array.components..]
            );
        }
    }
    // Pixels, strips, lines and vertices.
    let text = "# vtk DataFile Version 4.2\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 double\n\
        0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0\nCELLS 4 16\n1 0\n2 0 1\n4 0 1 3 4\n5 1 4 2 5 2\nCELL_TYPES 4\n1\n3\n8\n6\n\
        CELL_DATA 4\nSCALARS m double 1\nLOOKUP_TABLE default\n7 8 9 10\n";
    let surface = parsed(text.as_bytes(), "vtk").unwrap();
    assert_eq!(surface.triangles.len(), 2 + 3);
    assert_eq!(surface.cell_arrays[0].values, [9.0, 9.0, 10.0, 10.0, 10.0]);
    assert!(surface.notes.iter().any(|note| note.contains("2 cells that are vertices or lines")));
}

#[test]
fn faults_are_reported_with_their_place() {
    let ply = std::fs::read_to_string(data("quads-ascii.ply")).unwrap();
    let changed = |text: &str, ending: &str, from: &str, to: &str, words: &[&str]| {
        assert!(text.contains(from), "{from}");
        refused(text.replacen(from, to, 1).as_bytes(), ending, words);
    };
    let in_ply = |from: &str, to: &str, words: &[&str]| changed(&ply, "ply", from, to, words);
    in_ply("ply", "plie", &["mesh.ply", "line 1", "not a PLY file"]);
    in_ply("ascii", "utf8", &["line 2", "\"utf8\"", "binary_little_endian"]);
    in_ply("property float x", "property real x", &["line 6", "\"real\"", "double"]);
    in_ply("property float x", "property float a", &["no property \"x\""]);
    in_ply("vertex_indices", "corners", &["no list \"vertex_indices\""]);
    in_ply("list uchar int", "list uchar float", &["real numbers"]);
    in_ply("element vertex 27", "element vertex many", &["line 5", "\"many\""]);
    in_ply("element vertex 27", "element vertex 99999999", &["line ", "cut short"]);
    in_ply("end_header\n2 0 0", "end_header\n2 zero 0", &["line 12", "y of vertex 0", "\"zero\""]);
    in_ply("end_header", "", &["line 12", "instead of format"]);
    let msh = std::fs::read_to_string(data("gmsh-22-ascii.msh")).unwrap();
    let in_msh = |from: &str, to: &str, words: &[&str]| changed(&msh, "msh", from, to, words);
    in_msh("$MeshFormat", "$NOD", &["mesh.msh", "line 1", "version 1"]);
    in_msh("2.2 0 8", "3 0 8", &["line 2", "version 3", "4.1"]);
    in_msh("2.2 0 8", "2.2 0 4", &["line 2", "4 bytes"]);
    in_msh("$EndNodes", "$EndNods", &["$Nodes has no end"]);
    in_msh("$Elements", "$Element", &["expected a section", "\"s\""]);
    in_msh("1 2 0 0\n", "1 2 zero 0\n", &["line 6", "node 0", "\"zero\""]);
    let stl = std::fs::read_to_string(data("gmsh-ascii.stl")).unwrap();
    let in_stl = |from: &str, to: &str, words: &[&str]| changed(&stl, "stl", from, to, words);
    in_stl("facet", "face", &["mesh.stl", "line 2", "\"face\"", "facet"]);
    in_stl("vertex", "vertex x", &["line 4", "\"x\"", "number as x"]);
    in_stl("endsolid Created by Gmsh", "", &["cut short"]);
    refused(b"", "stl", &["has 0 bytes"]);
    let empty = parsed(&[0; 200], "stl").unwrap().into_sheet().unwrap_err().to_string();
    assert!(empty.contains("no triangles"), "{empty}");
    refused(&[7; 200], "stl", &["byte 80", "cut short"]);
}

/// Every file cut at many places, and with a bit of many bytes turned over, is read or refused with its name.
#[test]
fn damaged_files_are_refused_or_read_but_never_break() {
    let (mut refusals, mut accepted) = (0, 0);
    for (name, _) in FILES {
        let whole = std::fs::read(data(name)).unwrap();
        let ending = name.rsplit('.').next().unwrap();
        let step = (whole.len() / 150).max(1);
        for at in (0..whole.len()).step_by(step) {
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << (at % 8);
            for bytes in [&whole[..at], &flipped] {
                match parsed(bytes, ending).and_then(|s| s.into_sheet().map_err(|e| e.to_string()))
                {
                    Ok(_) => accepted += 1,
                    Err(message) => {
                        refusals += 1;
                        assert!(message.contains("mesh."), "{name} at {at}: {message}");
                    }
                }
            }
        }
    }
    assert!(refusals > 1000 && accepted > 100, "{refusals} refused, {accepted} accepted");
}
