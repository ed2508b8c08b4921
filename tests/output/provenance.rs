use std::fs;

use rumple::Vec3;
use rumple::output::provenance::{FileRecord, MeshRecord};
use rumple::output::{OutputError, Provenance, ResultDirectory};

#[test]
fn hashes_and_versions_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let plugin = folder.path().join("plugin.so");
    fs::write(&plugin, "abc").unwrap();
    let directory = ResultDirectory::prepare(&folder.path().join("run"), false).unwrap();
    let mesh = MeshRecord::new([Vec3::new(0.0, 1.0, -2.5)].into_iter(), [[0, 1, 2]].into_iter());
    // Of the 24 + 12 little-endian bytes, by Python's hashlib.
    let hash = "f63d3bcf4cdb1d854a5d31099ef1793f37e2b4a65ce9da64e61832cedcaa09af";
    assert_eq!(mesh.sha256, hash);
    let mut provenance = Provenance::new(mesh);
    provenance.plugins.push(FileRecord::new(&plugin).unwrap());
    provenance.write(&directory, "[sheet]\n").unwrap();

    assert_eq!(fs::read_to_string(directory.resolved()).unwrap(), "[sheet]\n");
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(directory.provenance()).unwrap()).unwrap();
    // The example of FIPS 180-2 for the message `abc`.
    assert_eq!(
        json["plugins"][0]["sha256"],
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    );
    assert_eq!(json["mesh"]["sha256"], hash);
    assert_eq!(json["version"], concat!("rumple ", env!("CARGO_PKG_VERSION")));
    assert!(json["threads"].as_u64().unwrap() > 0);
    assert!(!json["host"].as_str().unwrap().is_empty());
    assert!(!json["command"].as_array().unwrap().is_empty());
    assert_eq!(json["started"].as_str().unwrap().len(), "2026-11-21T12:34:56Z".len());
}

#[test]
fn a_missing_plugin_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = FileRecord::new(&folder.path().join("none.so")).unwrap_err();
    assert!(matches!(error, OutputError::Read { .. }));
    assert!(error.to_string().contains("none.so: No such file"), "{error}");
}
