//! No text whatever makes the reader panic, hang or run out of stack.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::time::{Duration, Instant};

use rumple::kinetics::formula::FormulaKinetics;
use rumple::scene::Scene;

use super::SCENE;

/// Reads a text and, if it is refused, writes the refusal out.
fn survive(text: &str, overrides: &[String]) -> bool {
    match Scene::parse(text, "s.toml", overrides) {
        Ok(scene) => scene.resolved().is_ok(),
        Err(error) => {
            assert!(!error.rendered(false).is_empty());
            false
        }
    }
}

/// Every number has a range of sizes: what is made of others overflows, or does not end.
#[test]
fn numbers_beyond_all_sizes_are_refused_at_their_keys() {
    for key in [
        "sheet.radius",
        "sheet.imperfection.amplitude",
        "sheet.bump.amplitude",
        "sheet.bump.width",
        "material.young",
        "material.poisson",
        "material.thickness",
        "material.drag",
        "kinetics.initial.m",
        "kinetics.initial.c.gaussian.width",
        "kinetics.initial.c.gaussian.amplitude",
        "time.until",
        "time.stop_when_steady",
        "time.stabilisation",
        "time.integrator.rtol",
        "output.every",
        "checkpoint.every",
        "checkpoint.wall",
        "stability.perturb",
        "effect[0].stiffness",
    ] {
        for value in ["1e300", "-1e300", "1e-300", "5e-324", "inf", "nan"] {
            let error = super::refused(super::SCENE, &[&format!("{key}={value}")]);
            let last = key.rsplit('.').next().unwrap();
            assert!(error.to_string().contains(last), "{key} = {value}: {error}");
        }
    }
}

#[test]
fn every_truncation() {
    for end in (0..SCENE.len()).filter(|end| SCENE.is_char_boundary(*end)) {
        survive(&SCENE[..end], &[]);
    }
}

#[test]
fn random_changes() {
    const PIECES: [&str; 34] = [
        "=",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        "\"",
        "'",
        "\"\"\"",
        ",",
        ".",
        "\n",
        "\r",
        "\r\n",
        "\t",
        "\0",
        "#",
        "-",
        "+",
        "nan",
        "-inf",
        "1e309",
        "0x",
        "9223372036854775808",
        "true",
        "1979-05-27T07:32:00Z",
        "é",
        "\u{202e}",
        "🦀",
        "a.b",
        "kind",
        "\\u",
        " ",
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(20_260_101);
    let mut accepted = 0;
    for _ in 0..6_000 {
        let mut text: Vec<char> = SCENE.chars().collect();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..text.len());
            let end = (at + rng.random_range(0..12)).min(text.len());
            let piece = PIECES[rng.random_range(0..PIECES.len())];
            match rng.random_range(0..4) {
                0 => drop(text.splice(at..end, piece.chars())),
                1 => drop(text.splice(at..at, piece.chars())),
                2 => drop(text.drain(at..end)),
                _ => {
                    let copy = text[at..end].to_vec();
                    let to = rng.random_range(0..text.len());
                    drop(text.splice(to..to, copy));
                }
            }
        }
        accepted += usize::from(survive(&text.iter().collect::<String>(), &[]));
    }
    // Changes inside comments, names of fields and digits leave a right scene.
    assert!((50..3_000).contains(&accepted), "{accepted} of 6000 accepted");
}

#[test]
fn random_overrides() {
    const PIECES: [&str; 20] = [
        "time",
        "until",
        "effect",
        ".",
        "[0]",
        "[1]",
        "[",
        "]",
        "=",
        "=",
        "\"",
        "{",
        "}",
        "é",
        "1",
        "sheet",
        " ",
        "test-spring",
        "'",
        "nan",
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..6_000 {
        let count = rng.random_range(0..8);
        let change: String = (0..count).map(|_| PIECES[rng.random_range(0..20)]).collect();
        survive(SCENE, &[change]);
    }
}

#[test]
fn deep_nesting() {
    let deep = 100_000;
    survive(&format!("x = {}", "[".repeat(deep)), &[]);
    survive(&format!("x = {}{}", "[".repeat(deep), "]".repeat(deep)), &[]);
    survive(&format!("x = {}", "{a=".repeat(deep)), &[]);
    survive(&format!("{}a = 1", "a.".repeat(deep)), &[]);
    survive(&format!("[{}a]", "a.".repeat(deep)), &[]);
    // As deep as the TOML crate lets through: dotted keys inside inline tables under a header.
    let key = vec!["a"; 79].join(".");
    let inline = format!("{}1{}", format!("{{ {key} = ").repeat(79), " }".repeat(79));
    survive(&format!("[{key}]\n{key} = {inline}"), &[]);
    survive(SCENE, &[format!("{}a=1", "a.".repeat(deep))]);
    survive(SCENE, &[format!("{}=1", "effect[0]".repeat(deep))]);
    survive(SCENE, &[format!("a={inline}")]);
    let text = format!("x = {}1{}", "[".repeat(30), "]".repeat(30));
    let error = super::refused(&text, &[]);
    assert_eq!(error.message(), "nested more than 24 levels deep");
}

/// What is said of a scene in a file of these bytes.
fn refusal(bytes: &[u8]) -> rumple::scene::SceneError {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    fs::write(&path, bytes).unwrap();
    Scene::load(&path, &[]).unwrap_err()
}

#[test]
fn a_scene_that_is_no_file_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let error = Scene::load(folder.path(), &[]).unwrap_err();
    assert!(error.to_string().contains("directory"), "{error}");
    #[cfg(unix)]
    {
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for path in [pipe.as_path(), "/dev/zero".as_ref()] {
            let error = Scene::load(path, &[]).unwrap_err();
            assert!(error.to_string().contains("device or a pipe"), "{error}");
        }
    }
}

#[test]
fn a_scene_of_more_than_16_mib_is_refused() {
    let mut bytes = SCENE.as_bytes().to_vec();
    bytes.resize((1 << 24) + 1, b'\n');
    let error = refusal(&bytes);
    assert!(error.to_string().contains("16777216"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    fs::write(&path, &bytes[..1 << 24]).unwrap();
    Scene::load(&path, &[]).unwrap();
}

#[test]
fn a_scene_that_is_not_utf_8_is_refused_with_the_place() {
    let at = SCENE.find("young").unwrap();
    let (before, after) = SCENE.as_bytes().split_at(at);
    let error = refusal(&[before, b"\xe9", after].concat());
    let line = 1 + before.iter().filter(|b| **b == b'\n').count();
    assert_eq!(error.position(), Some((line, 1)), "{error}");
    assert!(error.to_string().contains("0xe9"), "{error}");
    let utf_16: Vec<u8> = SCENE.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = refusal(&[b"\xff\xfe", utf_16.as_slice()].concat());
    assert_eq!(error.position(), Some((1, 1)), "{error}");
}

/// Time that even a busy machine has; before it was a minute or hours.
const PATIENCE: Duration = Duration::from_secs(10);

#[test]
fn hundreds_of_thousands_of_unknown_keys_do_not_hang() {
    let mut text = String::new();
    for k in 0..300_000 {
        text += &format!("sheeet{k} = {k}\n");
    }
    let began = Instant::now();
    let error = Scene::parse(&(text + SCENE), "s.toml", &[]).unwrap_err();
    let reported = error.rendered(false);
    assert!(began.elapsed() < PATIENCE, "{:?}", began.elapsed());
    assert!(error.to_string().contains("sheeet0"), "{error}");
    assert!(reported.contains("299980 more"), "{reported}");

    let long = "x".repeat(1 << 20);
    let began = Instant::now();
    let error = Scene::parse(&format!("{long} = 1\n{SCENE}"), "s.toml", &[]).unwrap_err();
    assert!(!error.rendered(false).is_empty());
    assert!(began.elapsed() < PATIENCE, "{:?}", began.elapsed());
}

/// Every part needs the next in the order of names, the order that took longest.
#[test]
fn thousands_of_chained_lets_do_not_hang() {
    let mut text = String::from("[kinetics]\nrates.c = \"a00000\"\n");
    let count = 20_000;
    for k in 0..count {
        text += &format!("let.a{k:05} = \"a{:05}*0.5 + tanh(a{:05}*c) + H\"\n", k + 1, k + 1);
    }
    text += &format!("let.a{count:05} = \"c\"\n");
    let text = format!(
        "[sheet]\nshape = \"disc\"\nradius = 1.0\nvertices = 100\n[time]\nuntil = 1.0\n{text}"
    );
    let began = Instant::now();
    let scene = Scene::parse(&text, "s.toml", &[]).unwrap();
    let law = FormulaKinetics::new(&scene.kinetics[0].law().unwrap()).unwrap();
    assert!(began.elapsed() < PATIENCE, "{:?}", began.elapsed());
    // A few operations a part, its derivatives by c and H included.
    assert!(law.operations().1 < 40 * count, "{:?}", law.operations());

    let circle = text.replace(&format!("let.a{count:05} = \"c\""), "let.a20000 = \"a00007\"");
    let scene = Scene::parse(&circle, "s.toml", &[]).unwrap();
    let error = FormulaKinetics::new(&scene.kinetics[0].law().unwrap()).unwrap_err();
    assert!(error.error.message.contains("depends on itself"), "{error:?}");
}
