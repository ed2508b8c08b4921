//! No text whatever makes the reader panic, hang or run out of stack.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
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
