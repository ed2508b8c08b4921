use std::fs;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use rumple::output::{Compression, Ledger, OutputError, ResultDirectory, Series, clock};

use super::Patch;

#[test]
fn the_default_name_is_the_stem_and_the_time() {
    let now = UNIX_EPOCH + Duration::from_secs(1_795_264_496);
    assert_eq!(
        ResultDirectory::default_path(Path::new("models/model-i/spots.toml"), now),
        Path::new("spots-20261121-123456")
    );
    // 29 February of a leap year, the last second of a year, a century that is none.
    for (seconds, text) in [
        (0, "1970-01-01T00:00:00Z"),
        (951_782_400, "2000-02-29T00:00:00Z"),
        (1_735_689_599, "2024-12-31T23:59:59Z"),
        (4_107_542_400, "2100-03-01T00:00:00Z"),
    ] {
        assert_eq!(clock::iso(UNIX_EPOCH + Duration::from_secs(seconds)), text);
    }
}

#[test]
fn force_removes_an_earlier_run_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("deep").join("run");
    let directory = ResultDirectory::prepare(&root, false).unwrap();
    let mut series = Series::create(&directory, Compression::Zlib);
    series.push(&Patch::new(3).frame(0.0, 0)).unwrap();
    series.push(&Patch::new(3).frame(1.0, 1)).unwrap();
    Ledger::create(&directory.ledger(), &["step".to_owned()]).unwrap();
    fs::write(directory.resolved(), "").unwrap();
    fs::write(directory.provenance(), "").unwrap();
    fs::create_dir(directory.modes()).unwrap();
    fs::write(directory.mode(0), "").unwrap();
    fs::write(directory.events(), "").unwrap();
    fs::write(directory.frames().join(".frame_000002.vtu.part"), "").unwrap();
    fs::write(root.join(".sheet.pvd.part"), "").unwrap();
    let foreign = [
        root.join("thesis.tex"),
        root.join("sheet.pvd.png"),
        directory.modes().join("mode_000000.png"),
        directory.frames().join("frame_1.vtu"),
        directory.frames().join("frame_000001.vtu.png"),
        directory.frames().join("frame_00000x.vtu"),
    ];
    for path in &foreign {
        fs::write(path, "mine").unwrap();
    }

    let error = ResultDirectory::prepare(&root, false).unwrap_err();
    assert!(matches!(error, OutputError::Directory { .. }), "{error}");
    assert!(error.to_string().contains("--force"), "{error}");
    assert!(directory.frame(1).is_file(), "nothing is removed without force");

    let error = ResultDirectory::prepare(&root, true).unwrap_err();
    assert!(error.to_string().contains("another run"), "{error}");
    drop(series);
    let (frames, modes) = (directory.frames(), directory.modes());
    drop(directory);

    let directory = ResultDirectory::prepare(&root, true).unwrap();
    for path in &foreign {
        assert_eq!(fs::read(path).unwrap(), b"mine", "{}", path.display());
    }
    let left = |p: &Path| fs::read_dir(p).unwrap().count();
    // With the lock and the status.
    assert_eq!((left(&root), left(&frames), left(&modes)), (6, 3, 1));
    drop(directory);
}

#[test]
fn a_file_in_the_way_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    fs::write(&path, "mine").unwrap();
    for force in [false, true] {
        let error = ResultDirectory::prepare(&path, force).unwrap_err();
        assert!(error.to_string().contains("is a file"), "{error}");
    }
    assert_eq!(fs::read(&path).unwrap(), b"mine");

    let root = folder.path().join("other");
    fs::create_dir(&root).unwrap();
    fs::write(root.join("frames"), "mine").unwrap();
    let error = ResultDirectory::prepare(&root, true).unwrap_err();
    assert!(error.to_string().contains("`frames`"), "{error}");
    let error = ResultDirectory::prepare(&path.join("below"), true).unwrap_err();
    assert!(matches!(error, OutputError::Write { .. }), "{error}");
}
