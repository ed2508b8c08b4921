//! Sheets in files: every format reads back, here and in VTK.

use rumple::sheet::write::{MeshFormat, mesh};
use rumple::sheet::{Sheet, SheetShape, generate};

use super::read::parsed;

use crate::common::path;

const ENDINGS: [&str; 3] = ["obj", "vtu", "vtp"];

fn written(sheet: &Sheet, ending: &str) -> Vec<u8> {
    let format = MeshFormat::from_path(format!("a.{ending}").as_ref()).unwrap();
    let mut bytes = Vec::new();
    mesh(sheet, format, &mut bytes).unwrap();
    bytes
}

/// Sizes around and beyond one block of a compressor as well.
#[test]
fn every_format_reads_back_with_the_same_bits() {
    for vertices in [100, 300, 1366, 5000] {
        let sheet =
            generate(&SheetShape::Sphere { radius: 0.1, irregular: true }, vertices, 2).unwrap();
        for ending in ENDINGS {
            let surface = parsed(&written(&sheet, ending), ending).unwrap();
            let (back, findings) = surface.into_sheet().unwrap();
            assert!(findings.is_empty(), "{ending}");
            assert_eq!(back, sheet, "{ending} of {vertices}");
        }
    }
    assert_eq!(MeshFormat::from_path("a.VTU".as_ref()), Some(MeshFormat::Vtu));
    assert_eq!(MeshFormat::from_path("a.vtk".as_ref()), None);
}

/// VTK prints sums over what it read; so do we.
#[test]
#[ignore = "needs Python with the vtk package in RUMPLE_PYTHON; tests/run.sh runs it"]
fn real_vtk_reads_meshes() {
    let python = std::env::var("RUMPLE_PYTHON").expect("RUMPLE_PYTHON names the interpreter");
    let script = path("tests/scripts/digest_mesh.py");
    let folder = tempfile::tempdir().unwrap();
    let sheet = generate(&SheetShape::Disc { radius: 1.0 }, 20_000, 1).unwrap();
    let mut hasher = <sha2::Sha256 as sha2::Digest>::new();
    for p in sheet.rest() {
        [p.x, p.y, p.z].iter().for_each(|x| sha2::Digest::update(&mut hasher, x.to_le_bytes()));
    }
    for &v in sheet.triangles().iter().flatten() {
        sha2::Digest::update(&mut hasher, u64::from(v).to_le_bytes());
    }
    let hash =
        sha2::Digest::finalize(hasher).iter().map(|b| format!("{b:02x}")).collect::<String>();
    for ending in &ENDINGS[1..] {
        let path = folder.path().join(format!("disc.{ending}"));
        std::fs::write(&path, written(&sheet, ending)).unwrap();
        let output = std::process::Command::new(&python).arg(&script).arg(&path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let complaints = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && complaints.is_empty(), "{ending}: {text}{complaints}");
        assert_eq!(text.trim(), hash, "{ending}");
    }
}
