//! VTK's old format from end to end: a mesh, frames, a state and a field in `.vtk` files.

use rumple::sheet::read;

use super::SMALL;
use super::program::{folder, rumple, text};

#[test]
fn a_run_starts_from_old_files_and_writes_them() {
    let scene = SMALL
        .replacen("shape = \"disc\"\nradius = 14.0\nvertices = 400\n", "file = \"disc.vtk\"\n", 1)
        .replacen("every = 0.25", "every = 0.25\nformat = \"vtk\"", 1);
    let folder = folder(&scene);
    let done = |args: &[&str]| {
        let out = rumple(folder.path(), args);
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
        text(&out.stdout)
    };
    let disc = ["mesh", "generate", "disc", "--radius", "14", "--vertices", "400"];
    done(&[&disc[..], &["--out", "disc.vtk"]].concat());
    done(&["mesh", "check", "disc.vtk"]);
    let said = done(&["run", "scene.toml", "--out", "result"]);
    assert!(said.contains("sheet.vtk.series"), "{said}");
    let result = folder.path().join("result");
    let index = std::fs::read_to_string(result.join("sheet.vtk.series")).unwrap();
    assert!(index.contains("\"frames/frame_000002.vtk\", \"time\": 0.5"), "{index}");
    let frame = "result/frames/frame_000002.vtk";
    done(&["inspect", "scene.toml", "--state", frame, "--json", "o.json"]);
    let last = read::surface(folder.path().join(frame)).unwrap();
    let array = last.point_arrays.iter().find(|a| a.name.starts_with('c')).unwrap();
    let start = format!("initial.c = {{ file = \"{frame}\", array = \"{}\" }}", array.name);
    let gaussian = "initial.c = { gaussian = { width = 4.0, amplitude = 0.08 } }";
    std::fs::write(folder.path().join("on.toml"), scene.replacen(gaussian, &start, 1)).unwrap();
    done(&["run", "on.toml", "--out", "on"]);
    let first = read::surface(folder.path().join("on/frames/frame_000000.vtk")).unwrap();
    assert_eq!(first.point_array(&array.name).unwrap().values, array.values);
    std::fs::write(folder.path().join("disc.vtk"), "# vtk DataFile Version 4.2\n").unwrap();
    let out = rumple(folder.path(), &["check", "scene.toml"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("disc.vtk"), "{}", text(&out.stderr));
}
