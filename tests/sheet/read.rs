//! Readers: files of other programs, faults with their line, and hostile files.

use std::path::PathBuf;

use proptest::prelude::*;
use rumple::sheet::{SheetShape, Surface, generate, read, write};

use crate::common::root;

pub fn data(name: &str) -> PathBuf {
    root().join("tests/data").join(name)
}

/// Reads these bytes as a file with this ending.
pub fn parsed(bytes: &[u8], ending: &str) -> Result<Surface, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("mesh.{ending}"));
    std::fs::write(&path, bytes).unwrap();
    read::surface(&path).map_err(|e| e.to_string())
}

pub fn refused(bytes: &[u8], ending: &str, words: &[&str]) {
    let message = parsed(bytes, ending).unwrap_err();
    for word in words {
        assert!(message.contains(word), "\"{word}\" is not in: {message}");
    }
}

#[test]
fn files_of_vtk_are_read_in_every_encoding() {
    for name in [
        "ascii.vtu",
        "inline-zlib.vtu",
        "inline-lz4-int32.vtu",
        "inline-plain-header64.vtu",
        "appended-base64-zlib.vtu",
        "appended-raw-zlib.vtu",
        "appended-raw-plain.vtu",
        "appended-raw-lzma.vtu",
        "big-endian.vtu",
        "ascii.vtp",
        "appended-base64-zlib.vtp",
    ] {
        let surface = read::surface(data(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(surface.points.len(), 7, "{name}");
        assert_eq!(surface.points[0].z, 0.125, "{name}");
        assert_eq!(surface.points[4].x, -1.0, "{name}");
        let expected: Vec<[u32; 3]> = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect();
        assert_eq!(surface.triangles, expected, "{name}");
        let c = surface.point_array("c").unwrap();
        let tenths: Vec<f64> = (0..7).map(|k| 0.1 * f64::from(k)).collect();
        assert_eq!((c.components, &c.values), (1, &tenths), "{name}");
        let u = surface.point_array("u").unwrap();
        assert_eq!((u.components, &u.values[3..6]), (3, &[1.0, 0.5, -1.0][..]), "{name}");
        let m = surface.cell_array("m").unwrap();
        assert_eq!(m.values, [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0], "{name}");
        assert_eq!((surface.point_arrays.len(), surface.cell_arrays.len()), (2, 1), "{name}");
        let (sheet, findings) = surface.into_sheet().unwrap();
        assert!(findings.is_empty() && sheet.euler_characteristic() == 1, "{name}");
    }
}

#[test]
fn files_of_vtkio_are_read() {
    use vtkio::model::{
        Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer,
        UnstructuredGridPiece, Version, VertexNumbers,
    };
    use vtkio::xml::Compressor;
    for compressor in [Compressor::None, Compressor::ZLib, Compressor::LZ4] {
        let mut point = Attributes::new();
        point.point.push(Attribute::DataArray(
            DataArray::scalars("c", 1).with_vec(vec![0.25f64, 0.5, 0.75, 1.0]),
        ));
        let vtk = vtkio::Vtk {
            version: Version::Auto,
            title: String::new(),
            byte_order: ByteOrder::LittleEndian,
            file_path: None,
            data: DataSet::inline(UnstructuredGridPiece {
                points: IOBuffer::F64(vec![
                    0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.5,
                ]),
                cells: Cells {
                    cell_verts: VertexNumbers::XML {
                        connectivity: vec![0, 1, 2, 0, 2, 3],
                        offsets: vec![3, 6],
                    },
                    types: vec![CellType::Triangle; 2],
                },
                data: point,
            }),
        };
        let mut bytes = Vec::new();
        vtk.try_into_xml_format(compressor, 5).unwrap().write(&mut bytes).unwrap();
        let surface = parsed(&bytes, "vtu").unwrap_or_else(|e| panic!("{compressor:?}: {e}"));
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(surface.points[3].z, 0.5);
        assert_eq!(surface.point_array("c").unwrap().values, [0.25, 0.5, 0.75, 1.0]);
    }
}

#[test]
fn a_sheet_written_as_obj_reads_back_with_the_same_bits() {
    let sheet = generate(&SheetShape::Sphere { radius: 0.1, irregular: true }, 300, 2).unwrap();
    let mut bytes = Vec::new();
    write::obj(&sheet, &mut bytes).unwrap();
    let (back, findings) = parsed(&bytes, "obj").unwrap().into_sheet().unwrap();
    assert!(findings.is_empty());
    assert_eq!(back, sheet);
}

#[test]
fn an_obj_file_may_hold_looks_and_relative_numbers() {
    let text =
        b"# a comment\r\no thing\r\nv 0 0 0 1 1 1\r\nv 1 0 0\r\nvn 0 0 1\r\nv 0 1e0 0 # end\r\n\
        f 1/1/1 2//1 -1\r\n";
    let surface = parsed(text, "obj").unwrap();
    assert_eq!(surface.triangles, [[0, 1, 2]]);
    assert_eq!((surface.point_lines, surface.triangle_lines), (vec![3, 4, 6], vec![7]));
    assert_eq!(surface.notes.len(), 2, "{:?}", surface.notes);
}

#[test]
fn faults_of_obj_files_are_reported_with_the_line() {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let face =
        |line: &str, words: &[&str]| refused(format!("{corners}{line}\n").as_bytes(), "obj", words);
    face("f 1 2 4 1", &["mesh.obj", "line 5", "vertex 0 twice"]);
    face("f 1 2 4 9", &["mesh.obj", "line 5", "vertex 8", "4 vertices"]);
    face("f 1 2", &["line 5", "2 vertices"]);
    face("f 0 1 2", &["line 5", "counts from 1"]);
    face("f -5 1 2", &["line 5", "-5 does not exist"]);
    face("f 1 2 x", &["line 5", "\"x\""]);
    face("f 1 2 99999999999", &["line 5", "99999999999"]);
    face("v 1 2", &["line 5", "z is missing"]);
    face("v 1 2 three", &["line 5", "\"three\"", "z"]);
    face("curv 1 2", &["line 5", "\"curv\""]);
    let late = |text: String, words: &[&str]| {
        let message = parsed(text.as_bytes(), "obj").unwrap().into_sheet().unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "\"{word}\" is not in: {message}");
        }
    };
    late(format!("{corners}f 1 2 3\nf 2 9 3\n"), &["mesh.obj", "triangle 1 (line 6)"]);
    late(format!("{corners}f 1 2 3\nf 1 1 4\n"), &["twice", "triangle 1 (line 6)"]);
    late(format!("{corners}f 1 2 3\n"), &["vertex 3 (line 4)"]);
    late(format!("{corners}v nan 0 0\nf 1 2 5\nf 2 3 4\n"), &["not a finite", "vertex 4 (line 5)"]);
}

/// Bits and text, which no scene asks for.
#[test]
fn arrays_that_are_not_of_numbers_are_noted() {
    let good = std::fs::read_to_string(data("ascii.vtu")).unwrap();
    for (element, kind) in [("DataArray", "Bit"), ("Array", "String")] {
        let array = format!(
            "<{element} type=\"{kind}\" Name=\"flags\" format=\"ascii\">1 0 1 0 1 0 1</{element}>"
        );
        for place in ["<PointData", "<CellData"] {
            let start = good.find(place).unwrap();
            let at = start + good[start..].find('>').unwrap() + 1;
            let text = [&good[..at], &array, &good[at..]].concat();
            let surface = parsed(text.as_bytes(), "vtu").unwrap();
            assert_eq!(surface.point_arrays.len() + surface.cell_arrays.len(), 3);
            assert_eq!(surface.notes, [format!("the array \"flags\" of type {kind} was ignored")]);
        }
    }
}

#[test]
fn faults_of_vtu_files_are_reported_with_their_place() {
    let good = std::fs::read_to_string(data("ascii.vtu")).unwrap();
    let changed = |from: &str, to: &str, words: &[&str]| {
        assert!(good.contains(from), "{from}");
        refused(good.replacen(from, to, 1).as_bytes(), "vtu", words);
    };
    changed(
        "NumberOfPoints=\"7\"",
        "NumberOfPoints=\"8\"",
        &["line ", "Points", "21 numbers instead of 24"],
    );
    changed("NumberOfPoints=\"7\"", "NumberOfPoints=\"-7\"", &["line 9", "-7"]);
    changed("NumberOfPoints=\"7\"", "NumberOfPoints=\"99999999999999999\"", &["instead of"]);
    changed("Name=\"connectivity\"", "Name=\"c\"", &["no array connectivity in <Cells>"]);
    changed("Name=\"c\" format=\"ascii\"", "Name=\"c\" format=\"binary\"", &["line 11", "\"c\""]);
    changed("type=\"Float64\" Name=\"c\"", "type=\"Real\" Name=\"c\"", &["\"c\"", "type \"Real\""]);
    changed("0.30000000000000004", "0.3x", &["\"c\"", "0.3x"]);
    changed("type=\"UnstructuredGrid\"", "type=\"ImageData\"", &["line 2", "ImageData"]);
    changed("vtkZLibDataCompressor", "zip", &["compressor", "zip"]);
    refused(b"", "vtu", &["empty"]);
    refused(b"solid thing", "vtu", &["empty"]);
    refused(b"<html></html>", "vtu", &["<html> instead of <VTKFile>"]);
    refused(&good.as_bytes()[..900], "vtu", &["ends in"]);
    let end = good.find("</Cells>").unwrap();
    refused(&good.as_bytes()[..end], "vtu", &["line ", "inside", "<Cells>", "cut short"]);
}

#[test]
fn other_files_are_refused_by_name() {
    for (name, word) in [
        ("nothing-here.obj", "cannot be read"),
        ("make_fixtures.py", "unknown extension \"py\""),
        ("nothing-here.vtk", "cannot be read"),
        ("", "unknown extension"),
    ] {
        let message = read::surface(data(name)).unwrap_err().to_string();
        assert!(message.contains(word) && message.contains("tests/data"), "{message}");
    }
    assert!(read::surface("/").is_err());
}

/// Fixtures of all encodings, to be damaged.
const VICTIMS: [&str; 13] = [
    "ascii.vtu",
    "inline-zlib.vtu",
    "inline-lz4-int32.vtu",
    "inline-plain-header64.vtu",
    "appended-raw-zlib.vtu",
    "appended-raw-plain.vtu",
    "appended-raw-lzma.vtu",
    "appended-base64-zlib.vtp",
    "legacy-42-ascii.vtk",
    "legacy-42-binary.vtk",
    "legacy-51-binary.vtk",
    "legacy-attributes-ascii.vtk",
    "legacy-attributes-binary.vtk",
];

/// Cuts and flips; whatever comes out may be read or refused.
fn damage(
    mut bytes: Vec<u8>,
    cut: Option<prop::sample::Index>,
    flips: &[(prop::sample::Index, u8)],
) -> Vec<u8> {
    if let Some(cut) = cut {
        bytes.truncate(cut.index(bytes.len()));
    }
    for (at, with) in flips {
        if !bytes.is_empty() {
            let at = at.index(bytes.len());
            bytes[at] ^= with;
        }
    }
    bytes
}

proptest! {
    #![proptest_config(super::fixed(600))]

    #[test]
    fn damaged_vtk_files_never_panic(
        victim in prop::sample::select(&VICTIMS[..]),
        cut in prop::option::of(any::<prop::sample::Index>()),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1u8..), 0..6),
    ) {
        let bytes = damage(std::fs::read(data(victim)).unwrap(), cut, &flips);
        if let Ok(surface) = parsed(&bytes, victim.rsplit('.').next().unwrap()) {
            let _ = surface.into_sheet();
        }
    }

    #[test]
    fn damaged_obj_files_never_panic(
        cut in prop::option::of(any::<prop::sample::Index>()),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1u8..), 0..6),
    ) {
        let text = b"# hexagon\nv 0 0 0\nv 1 0 0\nv .5 .8 0\nv -.5 .8 0\nvn 0 0 1\nf 1 2 3\nf -4/1/1 3 4\n";
        if let Ok(surface) = parsed(&damage(text.to_vec(), cut, &flips), "obj") {
            let _ = surface.into_sheet();
        }
    }
}

/// It took 10 s to read 3 GB of nothing.
#[test]
fn a_huge_file_of_zeros_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["zeros.obj", "zeros.vtu", "zeros.vtp", "zeros.vtk", "cut.obj", "cut.vtu"] {
        let path = folder.path().join(name);
        let head = if name.starts_with("cut") { "<VTKFile>\n" } else { "" };
        std::fs::write(&path, head).unwrap();
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(3 << 30).unwrap();
        let began = std::time::Instant::now();
        let message = read::surface(&path).unwrap_err().to_string();
        assert!(message.contains("with zero bytes"), "{name}: {message}");
        assert!(began.elapsed().as_secs_f64() < 1.0, "{name}: {:?}", began.elapsed());
    }
}
