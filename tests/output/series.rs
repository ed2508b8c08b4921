use std::fs;

use rumple::output::{Compression, OutputError, ResultDirectory, Series, atomic};

use super::Patch;

fn times_of(pvd: &str) -> Vec<f64> {
    pvd.split("timestep=\"")
        .skip(1)
        .map(|s| s.split('"').next().unwrap().parse().unwrap())
        .collect()
}

#[test]
fn times_read_back_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let directory = ResultDirectory::prepare(folder.path(), false).unwrap();
    let mut series = Series::create(&directory, Compression::Zlib);
    let patch = Patch::new(3);
    let times = [-0.0, f64::from_bits(1), 0.1 + 0.2, 1.0 / 3.0, 1e15 + 0.125, 1e22, f64::MAX];
    for (step, &time) in (0..).zip(&times) {
        let path = series.push(&patch.frame(time, step)).unwrap();
        assert!(path.is_file());
        let pvd = fs::read_to_string(series.index()).unwrap();
        let read = times_of(&pvd);
        assert_eq!(read.len(), usize::try_from(step).unwrap() + 1);
        for (a, b) in read.iter().zip(&times) {
            assert_eq!(a.to_bits(), b.to_bits());
        }
        let frame = fs::read_to_string(&path).unwrap();
        let value = frame.split("format=\"ascii\">").nth(1).unwrap().split('<').next().unwrap();
        assert_eq!(value.parse::<f64>().unwrap().to_bits(), time.to_bits());
    }
    let pvd = fs::read_to_string(series.index()).unwrap();
    assert!(pvd.contains("file=\"frames/frame_000006.vtu\""), "{pvd}");
}

#[test]
fn a_failing_writer_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    atomic::replace(&path, |w| w.write_all(b"whole")).unwrap();
    let error = atomic::replace(&path, |w| {
        w.write_all(&[b'x'; 100_000])?;
        Err(std::io::Error::other("the disk is full"))
    })
    .unwrap_err();
    assert_eq!(error.to_string(), format!("cannot write {}: the disk is full", path.display()));
    assert_eq!(fs::read(&path).unwrap(), b"whole");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A device keeps its place: a rename would put a file there, for every program on the machine.
#[cfg(unix)]
#[test]
fn a_device_is_written_to_and_not_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("device");
    std::os::unix::fs::symlink("/dev/null", &path).unwrap();
    atomic::replace(&path, |w| w.write_all(b"text")).unwrap();
    assert!(fs::symlink_metadata(&path).unwrap().is_symlink());
    assert!(fs::metadata(&path).unwrap().file_type().is_char_device());
}

/// A directory in the place of a file refuses the rename for any user, root included.
#[test]
fn a_series_survives_a_frame_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let directory = ResultDirectory::prepare(folder.path(), false).unwrap();
    let mut series = Series::create(&directory, Compression::Zlib);
    let patch = Patch::new(3);
    series.push(&patch.frame(0.0, 0)).unwrap();
    let before = fs::read(series.index()).unwrap();
    let obstacle = directory.frame(1);
    fs::create_dir_all(obstacle.join("inside")).unwrap();
    let error = series.push(&patch.frame(1.0, 1)).unwrap_err();
    assert!(matches!(&error, OutputError::Write { path, .. } if *path == obstacle), "{error}");
    assert_eq!(fs::read(series.index()).unwrap(), before);
    assert_eq!(fs::read_dir(directory.frames()).unwrap().count(), 2);
    fs::remove_dir_all(&obstacle).unwrap();
    series.push(&patch.frame(1.0, 1)).unwrap();
    assert_eq!(series.times(), [0.0, 1.0]);
}

#[test]
fn an_index_that_cannot_be_written_is_an_error_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let directory = ResultDirectory::prepare(folder.path(), false).unwrap();
    let mut series = Series::create(&directory, Compression::Zlib);
    fs::create_dir_all(series.index().join("inside")).unwrap();
    let error = series.push(&Patch::new(3).frame(0.0, 0)).unwrap_err();
    assert!(error.to_string().contains("sheet.pvd: "), "{error}");
    assert!(series.times().is_empty());
}
