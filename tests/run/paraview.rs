//! The macro for ParaView: its numbers are those of all frames, and Python takes it.

use std::fs;
use std::process::Command;

use rumple::sheet::read;

use super::SMALL;
use super::program::{folder, rumple, text};

#[test]
fn a_macro_has_the_range_and_the_box_of_all_frames() {
    let folder = folder(
        &SMALL.replace("until = 0.5", "until = 0.2").replace("every = 0.25", "every = 0.05"),
    );
    let at = folder.path();
    let run = |args: &[&str]| {
        let out = rumple(at, args);
        (out.status.code(), text(&out.stdout), text(&out.stderr))
    };
    assert_eq!(run(&["run", "scene.toml", "--out", "run", "--quiet"]).0, Some(0));
    let (code, told, wrong) = run(&["paraview", "run", "--array", "mean_curvature"]);
    assert_eq!(code, Some(0), "{wrong}");
    assert!(told.contains("paraview --script=run/open-in-paraview.py"), "{told}");
    let text = fs::read_to_string(at.join("run/open-in-paraview.py")).unwrap();
    let value = |name: &str| -> Vec<f64> {
        let line = text.lines().find(|line| line.starts_with(&format!("{name} = "))).unwrap();
        serde_json::from_str(line.split_once(" = ").unwrap().1).unwrap()
    };
    let (mut low, mut high, mut top) = (f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY);
    for k in 0..5 {
        let frame = read::surface(at.join(format!("run/frames/frame_{k:06}.vtu"))).unwrap();
        let array =
            frame.point_arrays.iter().find(|a| a.name.starts_with("mean_curvature")).unwrap();
        low = array.values.iter().copied().fold(low, f64::min);
        high = array.values.iter().copied().fold(high, f64::max);
        top = frame.points.iter().map(|p| p.z).fold(top, f64::max);
    }
    let range = value("RANGE");
    let symmetric = low.abs().max(high.abs());
    assert!(range == [low, high] || range == [-symmetric, symmetric], "{range:?}: {low} to {high}");
    assert_eq!(value("HIGH_CORNER")[2], top);
    assert!(
        text.contains("ARRAY = \"mean_curvature [1/length]\"")
            && text.contains("SERIES = \"sheet.pvd\"")
    );
    assert!(!text.contains('@'), "a place was not filled in");
    // What Python says of it, where there is one.
    if let Ok(out) = Command::new("python3")
        .args(["-m", "py_compile", "run/open-in-paraview.py"])
        .current_dir(at)
        .output()
    {
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    let refused = |args: &[&str], words: &[&str]| {
        let (code, _, message) = run(args);
        assert_eq!(code, Some(2), "{message}");
        for word in words {
            assert!(message.contains(word), "\"{word}\" is not in: {message}");
        }
    };
    refused(&["paraview", "run"], &["open-in-paraview.py", "--force"]);
    refused(&["paraview", "run", "--force", "--array", "d"], &["no array \"d\"", "mean_curvature"]);
    refused(&["paraview", "run", "--force", "--range", "2,1"], &["--range", "smaller first"]);
    fs::create_dir(at.join("empty")).unwrap();
    refused(&["paraview", "empty"], &["empty", "no frames"]);
    let (code, ..) = run(&["paraview", "run", "--force", "--range", "-1,2"]);
    assert_eq!(code, Some(0));
    assert!(
        fs::read_to_string(at.join("run/open-in-paraview.py"))
            .unwrap()
            .contains("RANGE = [-1.0,2.0]")
    );
}
