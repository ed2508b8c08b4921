//! The reader of VTK's legacy format: files of VTK, what is refused, hostile files.

use rumple::sheet::read;

use super::read::{data, parsed, refused};

#[test]
fn old_files_of_vtk_are_read() {
    for name in [
        "legacy-42-ascii.vtk",
        "legacy-42-binary.vtk",
        "legacy-51-ascii.vtk",
        "legacy-51-binary.vtk",
        "legacy-attributes-ascii.vtk",
        "legacy-attributes-binary.vtk",
    ] {
        let surface = read::surface(data(name)).unwrap_or_else(|e| panic!("{e}"));
        // VTK writes text with eleven digits.
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-10;
        assert_eq!(surface.points.len(), 7, "{name}");
        assert_eq!((surface.points[0].z, surface.points[4].x), (0.125, -1.0), "{name}");
        assert!(near(surface.points[2].y, 0.75f64.sqrt()), "{name}");
        let expected: Vec<[u32; 3]> = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
        assert_eq!(surface.triangles, expected, "{name}");
        let c = surface.point_array("c").unwrap();
        assert_eq!((c.components, c.values.len()), (1, 7), "{name}");
        assert!((0..7).zip(&c.values).all(|(k, &x)| near(x, 0.1 * f64::from(k))), "{name}");
        let u = surface.point_array("u").unwrap();
        assert_eq!((u.components, &u.values[3..6]), (3, &[1.0, 0.5, -1.0][..]), "{name}");
        let m = surface.cell_array("m").unwrap();
        assert_eq!(m.values, [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0], "{name}");
        let all = |list: &[rumple::sheet::Array]| -> Vec<(String, usize)> {
            list.iter().map(|a| (a.name.clone(), a.components)).collect()
        };
        let mut names: Vec<(String, usize)> = vec![("c".into(), 1), ("u".into(), 3)];
        if name.contains("attributes") {
            for (name, components) in [("N", 3), ("T", 9), ("a b% [µ]", 1), ("named", 2)] {
                names.push((name.into(), components));
            }
            assert_eq!(surface.notes, ["the cell colours \"rgb\" were ignored"], "{name}");
        }
        assert_eq!(all(&surface.point_arrays), names, "{name}");
        assert_eq!(all(&surface.cell_arrays), [("m".into(), 1)], "{name}");
        let (sheet, findings) = surface.into_sheet().unwrap();
        assert!(findings.is_empty() && sheet.euler_characteristic() == 1, "{name}");
    }
}

#[test]
fn what_the_format_leaves_free_is_read() {
    let text = "# vtk DataFile Version 2.0\r\ntitle\r\nASCII\r\n\r\ndataset polydata\r\npoints 3 float\r\n\
                0 0 0  1 0 0\r\n0 1e-1 0.5\r\npolygons 1 4\r\n3 0 1 2\r\nPOINT_DATA 3\r\n\
                SCALARS c unsigned_char\r\nLOOKUP_TABLE default\r\n1 2 255\r\n";
    for text in [text.to_owned(), text.replace("\r\n", "\n")] {
        let surface = parsed(text.as_bytes(), "vtk").unwrap();
        assert_eq!(surface.triangles, [[0, 1, 2]]);
        assert_eq!((surface.points[2].y, surface.points[2].z), (f64::from(0.1f32), 0.5));
        assert_eq!(surface.point_array("c").unwrap().values, [1.0, 2.0, 255.0]);
    }
}

/// Nothing is skipped without a word: a file is read to its end, or refused with the way to convert it.
#[test]
fn what_vtkio_does_not_read_is_refused_with_the_way_to_convert() {
    let good = std::fs::read_to_string(data("legacy-42-ascii.vtk")).unwrap();
    let changed = |from: &str, to: &str, words: &[&str]| {
        assert!(good.contains(from), "{from}");
        refused(good.replacen(from, to, 1).as_bytes(), "vtk", words);
    };
    let convert = ["mesh.vtk: ", ".vtu", "meshio convert", "ParaView"];
    for (from, to) in [
        ("# vtk DataFile", "solid"),
        ("ASCII", "UTF-8"),
        ("POINTS 7", "FIELD FieldData 1\nTimeValue 1 1 double\n3.25\nPOINTS 7"),
        ("POINTS 7", "POINTS 8"),
        ("CELLS 6 24", "CELLS 6 25"),
        ("c 1 7 double", "c 1 6 double"),
        ("c 1 7 double", "c 1 7 unsigned_short"),
        ("c 1 7 double\n0 0.1", "c 1 7 double\nnan 0.1"),
        ("0.3", "0.3x"),
        ("POINT_DATA 7", "POINT_DATA 7\nGLOBAL_IDS ids vtkIdType\n0 1 2 3 4 5 6"),
    ] {
        changed(from, to, &convert);
    }
    changed("UNSTRUCTURED_GRID", "STRUCTURED_POINTS", &["mesh.vtk: "]);
    changed("CELLS 6 24", "CELLS 7 24", &["6 CELL_TYPES for 7 cells"]);
    changed("\n5\n", "\n9\n", &["cell 0 of VTK type 9 has 3 vertices"]);
    changed("\n5\n", "\n10\n", &["cell 0 has VTK type 10, a tetrahedron", "surface"]);
    changed("3 0 1 2", "4 0 1 2", &["cell 0 of VTK type 5 has 4 vertices"]);
    for name in ["legacy-42-ascii.vtk", "legacy-42-binary.vtk", "legacy-51-binary.vtk"] {
        let bytes = std::fs::read(data(name)).unwrap();
        for length in [0, 100, 200, bytes.len() / 2] {
            refused(&bytes[..length], "vtk", &convert);
        }
    }
}

/// Counts of four thousand millions neither allocate nor take time.
#[test]
fn counts_are_not_believed() {
    const HUGE_COUNT: &str = "4294967295";
    for (name, text) in [("legacy-42-ascii.vtk", true), ("legacy-42-binary.vtk", false)] {
        let good = std::fs::read(data(name)).unwrap();
        let cells = if text { "CELLS 6" } else { "POLYGONS 6" };
        for word in ["POINTS 7", cells, "FIELD FieldData 2", "c 1 7", "u 3 7"] {
            let at = good.windows(word.len()).position(|w| w == word.as_bytes()).unwrap();
            let (before, after) = (&good[..at + word.len() - 1], &good[at + word.len()..]);
            let bytes = [before, HUGE_COUNT.as_bytes(), after].concat();
            let message = parsed(&bytes, "vtk").unwrap_err();
            assert!(message.contains("mesh.vtk: "), "{name} {word}: {message}");
        }
    }
}
