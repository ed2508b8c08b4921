//! Terms of the field: homely phrases stay out of sources, messages and the book.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::root;

/// Phrases, in lower case, with what the field writes for them.
const TABLE: [(&[&str], &str); 17] = [
    (
        &["is told", "are told", "was told", "were told", "be told", "told of"],
        "is warned of, logged, printed, reported",
    ),
    (
        &[
            "tells whether",
            "tells what",
            "tells how",
            "tells when",
            "tell whether",
            "tell how",
            "tell when",
            "says so",
        ],
        "shows, reports, decides, detects",
    ),
    (&["goes on", "go on"], "continues, is resumed, is in progress"),
    (
        &[
            "comes to its end",
            "comes to an end",
            "comes to no end",
            "comes to no result",
            "come to its end",
            "came to no result",
        ],
        "completes, converges, is rejected",
    ),
    (&["made ready", "making ready"], "set up"),
    (&["look at", "looks at", "looked at", "a good look"], "check, inspect, evaluate, view"),
    (&["nobody", "somebody", "whoever"], "no caller, the user, the caller, or the passive"),
    (&["gets nowhere", "getting anywhere"], "stagnates"),
    (&["runs away", "run away"], "blows up in finite time, diverges"),
    (
        &["as it is", "what it is", "as it stands"],
        "unchanged, verbatim, current; its kind, its definition",
    ),
    (&["worth paying for", "means anything"], "below the seed-to-seed spread, the noise floor"),
    (&["is apart", "are apart"], "distance, error norm, isolated"),
    (&["anew", "made again"], "again, from scratch, is repeated, is recomputed"),
    (&["one's own", "ones own"], "user-defined"),
    (&["held against"], "compared with"),
    (
        &["directions down", "directions that lower the energy"],
        "descent directions, negative-curvature modes",
    ),
    (&["hardly", "however small it is", "however large it is"], "the number, barely, nearly"),
];

/// Folders that are held to the table.
const FOLDERS: [&str; 5] = ["src", "plugins", "python", "examples", "docs/book"];

const ENDINGS: [&str; 10] = ["rs", "md", "py", "toml", "h", "c", "js", "html", "css", "sh"];

fn files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !["target", "__pycache__", "out", "results"].contains(&name.as_str())
                && !name.starts_with('.')
            {
                files(&path, found);
            }
        } else if path.extension().is_some_and(|e| ENDINGS.iter().any(|known| e == *known)) {
            found.push(path);
        }
    }
}

/// `text` in lower case on one line, without the signs of comments and line continuations, and where in it each of
/// its lines begins.
fn flat(text: &str) -> (String, Vec<usize>) {
    let (mut flat, mut begins) = (String::new(), Vec::new());
    for line in text.lines() {
        begins.push(flat.len());
        let line =
            line.trim().trim_start_matches(['/', '!', '#', '*']).trim_end_matches('\\').trim();
        flat.push_str(&line.to_lowercase());
        flat.push(' ');
    }
    (flat, begins)
}

/// Every phrase of `text` that is in the table: its line, itself, and what to write for it.
fn homely(text: &str) -> Vec<(usize, &'static str, &'static str)> {
    let (flat, begins) = flat(text);
    let mut found = Vec::new();
    for (phrases, better) in TABLE {
        for phrase in phrases {
            for (at, _) in flat.match_indices(phrase) {
                let word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
                let (before, after) =
                    (flat[..at].chars().next_back(), flat[at + phrase.len()..].chars().next());
                if !word(before) && !word(after) {
                    found.push((begins.partition_point(|begin| *begin <= at), *phrase, better));
                }
            }
        }
    }
    found
}

#[test]
fn the_words_are_those_of_the_field() {
    let root = &root();
    let mut paths = Vec::new();
    for folder in FOLDERS {
        files(&root.join(folder), &mut paths);
    }
    assert!(paths.len() > 500, "{} files", paths.len());
    let mut wrong = String::new();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap();
        for (line, phrase, better) in homely(&text) {
            let name = path.strip_prefix(root).unwrap().display();
            wrong += &format!("\n{name}:{line}: \"{phrase}\"; the field writes: {better}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn a_homely_phrase_is_found_across_lines() {
    let text = "//! A step that\n//! is told\n//! of.\nlet retold = 1;\n\"goes \\\n on\"";
    let found: Vec<_> = homely(text).into_iter().map(|(line, phrase, _)| (line, phrase)).collect();
    assert_eq!(found, [(2, "is told"), (2, "told of"), (5, "goes on")]);
}
