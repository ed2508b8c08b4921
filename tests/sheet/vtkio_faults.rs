//! What vtkio 0.7.0-rc2 does wrong, and what is written by hand for that reason.
//!
//! A test here that fails says that vtkio has got better: the code that it names may then go.

use std::io::Write;
use std::panic::catch_unwind;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use rumple::sheet::read;
use vtkio::model::{DataSet, Piece, UnstructuredGridPiece};
use vtkio::{Error, Vtk};

use super::read::{data, parsed};

fn grid(vtk: Vtk) -> UnstructuredGridPiece {
    match vtk.data {
        DataSet::UnstructuredGrid { pieces, .. } => match pieces.into_iter().next() {
            Some(Piece::Inline(piece)) => *piece,
            _ => panic!("no inline piece"),
        },
        _ => panic!("no unstructured grid"),
    }
}

fn xml(text: &str) -> Result<Vtk, Error> {
    Vtk::parse_xml(text.as_bytes())
}

fn legacy(text: &str) -> Result<Vtk, Error> {
    Vtk::parse_legacy_be(text.as_bytes())
}

// The XML formats: sheet/read/{xml,vtk,decode}.rs.

#[test]
fn it_cannot_read_raw_or_lzma_data() {
    for name in ["appended-raw-plain.vtu", "appended-raw-zlib.vtu", "appended-raw-lzma.vtu"] {
        assert!(catch_unwind(|| Vtk::import(data(name))).is_ok_and(|r| r.is_err()), "{name}");
        read::surface(data(name)).unwrap();
    }
}

#[test]
fn it_drops_arrays_that_it_cannot_decode() {
    let good = std::fs::read_to_string(data("ascii.vtu")).unwrap();
    for (from, to) in [("0.30000000000000004", "0.3x"), ("0.30000000000000004", "")] {
        let bad = good.replacen(from, to, 1);
        let names: Vec<String> =
            grid(xml(&bad).unwrap()).data.point.iter().map(|a| a.name().to_owned()).collect();
        assert_eq!(names, ["u"]);
        assert!(parsed(bad.as_bytes(), "vtu").unwrap_err().contains("\"c\""));
    }
}

/// A file whose three points are one compressed block under this header.
fn one_block(header: [u64; 4], packed: &[u8]) -> String {
    let bytes: Vec<u8> = header.iter().flat_map(|n| n.to_le_bytes()).collect();
    let points = BASE64.encode(bytes) + &BASE64.encode(packed);
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"3\" NumberOfCells=\"1\"><Points>\
         <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"binary\">\
         {points}</DataArray></Points><Cells>\
         <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
         <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray>\
         </Cells></Piece></UnstructuredGrid></VTKFile>"
    )
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// VTK gives the size of a last block that is full as 0.
#[test]
fn it_loses_the_last_block_where_that_is_full() {
    let coordinates = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5f64];
    let packed = zlib(&coordinates.map(f64::to_le_bytes).concat());
    let size = u64::try_from(packed.len()).unwrap();
    for (last, lost) in [(72, false), (0, true)] {
        let file = one_block([1, 72, last, size], &packed);
        assert_eq!(xml(&file).is_err(), lost);
        assert_eq!(parsed(file.as_bytes(), "vtu").unwrap().points[2].z, 0.5);
    }
}

#[test]
fn it_panics_where_sizes_are_wrong() {
    let packed = zlib(&[0; 72]);
    let size = u64::try_from(packed.len()).unwrap();
    for header in [[1, 72, 72, size + 100], [1 << 40, 72, 72, size], [1, 72, u64::MAX, size]] {
        let file = one_block(header, &packed);
        assert!(catch_unwind(|| xml(&file)).is_err(), "{header:?}");
        assert!(parsed(file.as_bytes(), "vtu").is_err());
    }
    let good = std::fs::read_to_string(data("appended-base64-zlib.vtu")).unwrap();
    let end = good.find("<AppendedData").unwrap();
    let cut =
        format!("{}_AA\n</AppendedData></VTKFile>", &good[..good[end..].find('_').unwrap() + end]);
    assert!(catch_unwind(|| xml(&cut)).is_err());
    assert!(parsed(cut.as_bytes(), "vtu").is_err());
}

// VTK's legacy format: sheet/read/legacy.rs.

fn whole(parts: &str) -> String {
    format!(
        "# vtk DataFile Version 4.2\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n\
         0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n{parts}"
    )
}

#[test]
fn it_stops_at_words_it_does_not_know_without_saying_so() {
    let text = whole(
        "POINT_DATA 3\nGLOBAL_IDS ids int\n0 1 2\nSCALARS c double 1\nLOOKUP_TABLE default\n1 2 3\n",
    );
    assert!(grid(legacy(&text).unwrap()).data.point.is_empty());
    assert!(parsed(text.as_bytes(), "vtk").unwrap_err().contains("no further"));
}

#[test]
fn it_leaves_names_escaped() {
    let text = whole("POINT_DATA 3\nSCALARS a%20b double 1\nLOOKUP_TABLE default\n1 2 3\n");
    assert_eq!(grid(legacy(&text).unwrap()).data.point[0].name(), "a%20b");
    assert_eq!(parsed(text.as_bytes(), "vtk").unwrap().point_arrays[0].name, "a b");
}

/// Offsets of version 5 begin with 0, those of its model do not.
#[test]
fn it_counts_a_cell_too_many_in_version_5() {
    let file = std::fs::read_to_string(data("legacy-51-ascii.vtk")).unwrap();
    let DataSet::PolyData { pieces, .. } = legacy(&file).unwrap().data else {
        panic!("no polygons")
    };
    let Some(Piece::Inline(piece)) = pieces.into_iter().next() else { panic!("no piece") };
    assert_eq!(piece.num_polys(), 7);
    assert_eq!(parsed(file.as_bytes(), "vtk").unwrap().triangles.len(), 6);
}

// Writing: output/vtu.rs.

/// So the time of a frame would be lost: output/vtu.rs puts it in.
#[test]
fn it_has_no_field_data_of_the_whole() {
    let file = std::fs::read_to_string(data("ascii.vtu")).unwrap();
    assert!(file.contains("TimeValue"));
    let mut bytes = Vec::new();
    xml(&file).unwrap().write_xml(&mut bytes).unwrap();
    assert!(!String::from_utf8_lossy(&bytes).contains("TimeValue"));
}
