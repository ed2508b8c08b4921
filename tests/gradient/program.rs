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
fn a_run_in_time() {
    let rests = "sheet = { shape = \"disc\", radius = 3.0, vertices = 60 }\ntime = { until = 2.0 }\n\
                 [kinetics]\nrates.u = \"-k*u\"\nparameters.k = 0.5\ninitial.u = 2.0\n";
    let folder = folder(rests);
    let run = |rest: &str| {
        let words =
            format!("gradient scene.toml --measure mean(u) --with kinetics.parameters.k {rest}");
        let said = text(&passes(folder.path(), &words).stdout);
        serde_json::from_str::<serde_json::Value>(&said).unwrap()
    };
    // d/dk of 2 exp(-k t).
    for (rest, times) in
        [("--in-time --json", &[2.0][..]), ("--at-times 0.5,2 --json", &[0.5, 2.0])]
    {
        let said = run(rest);
        let exact = |f: fn(f64) -> f64| times.iter().map(|t| f(*t)).sum::<f64>();
        let (value, slope) =
            (exact(|t| 2.0 * (-0.5 * t).exp()), exact(|t| -2.0 * t * (-0.5 * t).exp()));
        let near = |found: &serde_json::Value, exact: f64| {
            assert!((found.as_f64().unwrap() / exact - 1.0).abs() < 3e-3, "{said} {exact}");
        };
        near(&said["value"], value);
        near(&said["replay"]["value_of_run"], value);
        near(&said["parameters"][0]["derivative"], slope);
    }
    for (rest, expected) in [
        ("--at-times 1,3", "from 0 to time.until = 2"),
        ("--at-times 1,0.5", "ascending"),
        ("--in-time --at-start", "cannot be used with"),
    ] {
        let words =
            format!("gradient scene.toml --measure mean(u) --with kinetics.parameters.k {rest}");
        let words: Vec<&str> = words.split(' ').collect();
        let done = rumple(folder.path(), &words);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    }
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
        ("--measure mean(uz) --with time.until", "it says how the scene is solved"),
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

/// A point has no area to integrate over.
#[test]
fn a_point_has_no_gradient() {
    let point = "sheet.shape = \"point\"\n[kinetics]\nrates.c = \"-k*c\"\nparameters.k = 1.0\ninitial.c = 1.0\n\
                 [time]\nuntil = 1.0\n";
    let folder = folder(point);
    let words =
        ["gradient", "scene.toml", "--measure", "mean(c)", "--with", "kinetics.parameters.k"];
    for more in [&[][..], &["--in-time"]] {
        let done = rumple(folder.path(), &[&words[..], more].concat());
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains("a point has no area") && said.contains("disc"), "{said}");
    }
}
