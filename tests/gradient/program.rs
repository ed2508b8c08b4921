//! `rumple gradient` from the outside.

use super::PLATE;
use crate::run::program::{folder, passes, rumple, text};

#[test]
fn a_table_a_document_and_a_map() {
    let folder = folder(PLATE);
    let run = |rest: &str| {
        let words = format!("gradient scene.toml --measure mean(uz) {rest}");
        text(&passes(folder.path(), &words).stdout)
    };
    let said = run("--with material.thickness");
    assert!(said.contains("J = mean(uz) = 2.69"), "{said}");
    assert!(said.contains("material.thickness"), "{said}");
    let said = run("--with material.thickness --map material.young --vtu map.vtu --json");
    let about: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(about["parameters"][0]["key"], "material.thickness");
    let map = rumple::sheet::read::surface(folder.path().join("map.vtu")).unwrap();
    let slopes = map.point_array("dJ/d(material.young)").unwrap();
    // Every modulus raised by one per cent softens the plate less and less.
    assert!(slopes.values.iter().sum::<f64>() < 0.0);
    // One thread and two find the same bits.
    let again = run("--map material.young --vtu other.vtu --threads 1");
    assert!(again.contains("(map)"), "{again}");
    let other = rumple::sheet::read::surface(folder.path().join("other.vtu")).unwrap();
    assert!(other.point_array("dJ/d(material.young)").unwrap() == slopes);
}

#[test]
fn what_has_no_gradient_is_refused_with_its_place() {
    let folder = folder(PLATE);
    for (words, expected) in [
        ("--measure mean(uz) --with sheet.width", "sheet.width: it makes another mesh"),
        ("--measure mean(uz) --with material.thicknes", "did you mean thickness?"),
        ("--measure mean(w) --with material.young", "unknown name `w`"),
        ("--measure volume --with material.young", "encloses no volume"),
        ("--measure most(uz) --with material.young", "expected energy, volume"),
        ("--measure energy --map material.young --vtu m.vtu", "maps are of other measures"),
        ("--measure mean(uz) --with material", "not a number"),
        (
            "--measure mean(uz) --with material.young --map material.young --vtu m.vtu",
            "are one parameter",
        ),
        ("--measure mean(uz) --map time.until --vtu scene.toml", "scene.toml"),
    ] {
        let words: Vec<&str> =
            ["gradient", "scene.toml"].into_iter().chain(words.split(' ')).collect();
        let done = rumple(folder.path(), &words);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{words:?}: {said}");
        assert!(said.contains(expected), "{words:?}: {said}");
    }
}
