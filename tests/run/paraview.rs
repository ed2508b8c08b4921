//! The macro for ParaView: its array is one of the frames, and Python takes it.

use std::fs;
use std::process::Command;

use super::SMALL;
use super::program::{folder, rumple, text};

#[test]
fn a_macro_has_an_array_of_the_frames() {
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
    assert!(text.contains("ARRAY = \"mean_curvature [1/length]\"\nASSOCIATION = \"POINTS\"\n"));
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
    fs::create_dir(at.join("empty")).unwrap();
    refused(&["paraview", "empty"], &["empty", "no frames"]);
    // Frames that earlier versions wrote in one file.
    fs::write(at.join("empty/sheet.vtkhdf"), "").unwrap();
    refused(&["paraview", "empty"], &["empty/sheet.vtkhdf", ".vtu", "ParaView"]);
}
