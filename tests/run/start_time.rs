//! Runs that start from a state at its time.

use std::fs;

use super::program::{folder, passes, rumple, text};

/// The clock of a state continues: a law and a ramp that read t, output times, ledger, checkpoints.
#[test]
fn a_state_continues_at_its_time() {
    let folder = folder(
        r#"
        sheet = { shape = "disc", radius = 5.0, vertices = 150 }
        material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
        effect = [
            { kind = "stretching" },
            { kind = "bending" },
            { kind = "pin", where = "rim", axes = "xyz" },
            { kind = "pressure", value = 4.0, ramp = { points = [[0, 0], [1, 0.1], [2, 1]] } },
        ]
        kinetics = { rates = { c = "t" } }
        checkpoint = { every = 0.1 }
        [time]
        until = 2.0
        [output]
        every = 0.5
        fields = ["c"]
        report = false
    "#,
    );
    let run = |words: &str| passes(folder.path(), words);
    let rows = |out: &str| -> Vec<Vec<f64>> {
        let ledger = fs::read_to_string(folder.path().join(out).join("ledger.csv")).unwrap();
        let cells = |row: &str| row.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
        ledger.lines().skip(1).map(cells).collect()
    };
    run("run scene.toml --out whole");
    let later = "run scene.toml --from whole/frames/frame_000002.vtu --start-time 1 --out";
    run(&format!("{later} second"));
    let (whole, second) = (rows("whole"), rows("second"));
    assert_eq!((second[0][0], second[0][1]), (0.0, 1.0));
    let column = {
        let text = fs::read_to_string(folder.path().join("whole/ledger.csv")).unwrap();
        let titles: Vec<String> = text.lines().next().unwrap().split(',').map(Into::into).collect();
        move |title: &str| titles.iter().position(|t| t.starts_with(title)).unwrap()
    };
    for (title, tolerance) in [("total c", 1e-6), ("energy of stretching", 1e-2)] {
        let [a, b] = [&whole, &second].map(|rows| rows.last().unwrap()[column(title)]);
        assert!(a > 0.0 && (b / a - 1.0).abs() < tolerance, "{title}: {a} {b}");
    }
    let pvd = fs::read_to_string(folder.path().join("second/sheet.pvd")).unwrap();
    let times: Vec<&str> = pvd.split("timestep=\"").skip(1).map(|t| &t[..3]).collect();
    assert_eq!(times, ["1\" ", "1.5", "2\" "], "{pvd}");
    let json = fs::read_to_string(folder.path().join("second/provenance.json")).unwrap();
    assert!(json.contains("\"start_time\": 1.0"), "{json}");
    // Interrupted and resumed, it has the same bytes.
    run(&format!("{later} third --set time.max_steps=3"));
    run("resume third --set time.max_steps=100000");
    let last = |out: &str| {
        let frames = fs::read_dir(folder.path().join(out).join("frames")).unwrap();
        fs::read(frames.map(|frame| frame.unwrap().path()).max().unwrap()).unwrap()
    };
    assert!(last("second") == last("third"));

    let fresh = rumple(folder.path(), &["run", "scene.toml", "--start-time", "1", "--out", "no"]);
    assert!(text(&fresh.stderr).contains("--from"), "{}", text(&fresh.stderr));
    let late = [&later.split(' ').collect::<Vec<_>>()[..4], &["--start-time", "2"]].concat();
    let late = rumple(folder.path(), &[&late[..], &["--out", "no"]].concat());
    assert!(text(&late.stderr).contains("less than time.until, 2"), "{}", text(&late.stderr));
    assert_eq!([fresh.status.code(), late.status.code()], [Some(2); 2]);
    assert!(!folder.path().join("no").exists());
    let said = text(&run(&later.replace("--start-time 1 --out", "--out fourth")).stderr);
    assert!(said.contains("--start-time 1 continues them"), "{said}");
}

/// A shape under drag continues from the positions given: no relaxation precedes it.
#[test]
fn a_moving_shape_continues_from_where_it_was() {
    let folder = folder(
        r#"
        sheet = { shape = "disc", radius = 5.0, vertices = 150, bump = { amplitude = 1.0, width = 3.0 } }
        material = { young = 1e3, poisson = 0.3, thickness = 0.5, drag = { per-area = 200.0 } }
        effect = [{ kind = "stretching" }, { kind = "bending" }, { kind = "pin", where = "rim", axes = "xyz" }]
        time = { policy = "simultaneous", start = "given", until = 1.0 }
        output = { every = 0.5, report = false }
    "#,
    );
    passes(folder.path(), "run scene.toml --out whole");
    let again = "run scene.toml --from whole/frames/frame_000001.vtu --start-time 0.5 --out again --set time.start=\"equilibrium\"";
    let again: Vec<&str> = again.split(' ').collect();
    let output = rumple(folder.path(), &again);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let points =
        |frame: &str| rumple::sheet::read::surface(folder.path().join(frame)).unwrap().points;
    let apart = |a: &[rumple::Vec3], b: &[rumple::Vec3]| {
        a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let [first, last] =
        ["whole/frames/frame_000001.vtu", "whole/frames/frame_000002.vtu"].map(points);
    assert!(apart(&first, &last) > 0.02);
    assert!(apart(&points("again/frames/frame_000000.vtu"), &first) < 1e-6);
    assert!(apart(&points("again/frames/frame_000001.vtu"), &last) < 0.005);
}
