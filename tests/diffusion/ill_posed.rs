//! Coefficients of diffusion and cross-diffusion with which short waves grow without bound.

use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;
use rumple::{Error, Simulation};

use crate::run::program::{folder, rumple, text};

/// Diffusion of u and v with these coefficients, and cross-diffusion both ways; the notes.
fn prepared(own: [&str; 2], cross: [&str; 2]) -> Result<Vec<String>, Error> {
    let mut text =
        "sheet = { shape = 'disc', radius = 2.0, vertices = 100 }\ntime = { until = 1.0 }\n\
                    kinetics = { rates = { u = '0', v = '0' } }\n"
            .to_owned();
    for ((species, by), (own, cross)) in
        [("u", "v"), ("v", "u")].into_iter().zip(own.into_iter().zip(cross))
    {
        text += &format!(
            "[[effect]]\nkind = 'diffusion'\nspecies = '{species}'\ncoefficient = {own}\n\
             [[effect]]\nkind = 'cross-diffusion'\nspecies = '{species}'\nby = '{by}'\ncoefficient = {cross}\n"
        );
    }
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let made = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
    Ok(made.notes().to_vec())
}

/// Two species ran to 1e209 without a word.
#[test]
fn a_negative_eigenvalue_is_refused_with_the_matrix() {
    let error = prepared(["1.0", "1.0"], ["2.0", "2.0"]).unwrap_err();
    let Error::Scene(error) = error else { panic!("{error}") };
    let said = error.rendered(false);
    for part in ["effect[1].coefficient", "of u, v, [[1, 2], [2, 1]]", "real part -1.0000e0"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // A pair of conjugate ones: 0.5 ± sqrt(0.25 - 4.5), and with the sum of the coefficients negative.
    assert_eq!(prepared(["1.0", "0.0"], ["-3.0", "1.5"]).unwrap(), Vec::<String>::new());
    // One that is 0, to round-off: 0.1·0.4 = 0.2².
    assert_eq!(prepared(["0.1", "0.4"], ["0.2", "0.2"]).unwrap(), Vec::<String>::new());
    assert!(prepared(["0.1", "0.4"], ["0.2", "0.2001"]).is_err());
    // Cross-diffusion of one of them is harmless with any coefficient.
    assert_eq!(prepared(["0.1", "0.4"], ["50.0", "0.0"]).unwrap(), Vec::<String>::new());
}

/// Well-posed ones were refused, the coefficient that reads a species counted as 0.
#[test]
fn of_coefficients_that_read_species_nothing_is_said() {
    assert_eq!(prepared(["'4 + u'", "1.0"], ["2.0", "1.0"]).unwrap(), Vec::<String>::new());
    assert_eq!(prepared(["'1 + 0.1*x'", "1.0"], ["'0.5*u'", "1.0"]).unwrap(), Vec::<String>::new());
}

/// Of u and v, with `2 u` and `2 v` as coefficients of cross-diffusion: ill-posed where 4 u v > 1.
const BY_SPECIES: &str = "sheet = { shape = 'disc', radius = 2.0, vertices = 100 }
time = { until = 1.0 }
effect = [
    { kind = 'diffusion', species = 'u', coefficient = 1.0 },
    { kind = 'diffusion', species = 'v', coefficient = 1.0 },
    { kind = 'cross-diffusion', species = 'u', by = 'v', coefficient = '2*u' },
    { kind = 'cross-diffusion', species = 'v', by = 'u', coefficient = '2*v' },
]
[kinetics]
rates = { u = '1', v = '1' }
initial = { u = { formula = '0.3 + 0.1*sin(9*x)*cos(8*y)' }, v = { formula = '0.3 + 0.1*cos(9*x)*sin(8*y)' } }
";

/// The law was blamed, whose rates are numbers.
#[test]
fn a_blow_up_by_coefficients_that_read_species_names_their_keys() {
    let folder = folder(BY_SPECIES);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "a", "--quiet"]);
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    for part in [
        "the cause is the chemistry: effect[2].coefficient, effect[3].coefficient: the matrix of the coefficients of u, v",
        "short waves grow without bound",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!said.contains("a law whose rate levels off"), "{said}");
}

#[test]
fn coefficients_that_are_ill_posed_at_the_species_of_the_start_are_told() {
    let notes = |text: &str| {
        let scene = Scene::parse(text, "scene.toml", &[]).unwrap();
        let made = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())).unwrap();
        made.notes().to_vec()
    };
    assert_eq!(notes(BY_SPECIES), Vec::<String>::new());
    let notes = notes(&BY_SPECIES.replace("'0.3 + 0.1*sin", "'3 + 0.1*sin"));
    let [note] = &notes[..] else { panic!("{notes:?}") };
    let words = "warning: effect[2].coefficient, effect[3].coefficient: the matrix of the coefficients of u, v, [[1, ";
    assert!(note.starts_with(words), "{note}");
}

/// It was said that the law, a number, has a pole or a switch.
#[test]
fn a_coefficient_that_becomes_negative_is_named_by_its_key() {
    let scene = "sheet = { shape = 'disc', radius = 2.0, vertices = 100 }
        time = { until = 1.0 }
        kinetics = { rates = { u = '1' }, initial = { u = { formula = '0.8 + 0.1*sin(9*x)*cos(8*y)' } } }
        effect = [{ kind = 'diffusion', species = 'u', coefficient = '1 - u' }]";
    let folder = folder(scene);
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "a", "--quiet"]);
    let said = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    let words = "error: effect[0].coefficient: the coefficient of diffusion of `u` becomes -";
    assert!(said.contains(words) && !said.contains("its law"), "{said}");
}

#[test]
fn coefficients_that_are_ill_posed_in_a_part_are_told() {
    // 1·(1 + x) - 0.5 is negative left of x = -0.5.
    let notes = prepared(["1.0", "'max(1 + x, 0)'"], ["1.0", "0.5"]).unwrap();
    let [note] = &notes[..] else { panic!("{notes:?}") };
    // Least where D_v is 0: ½ - sqrt(¼ + ½).
    for part in ["warning: ", "at triangle ", "real part -3.6603e-1"] {
        assert!(note.contains(part), "{part}: {note}");
    }
    let notes = prepared(["1.0", "'3 + x'"], ["1.0", "0.5"]).unwrap();
    assert_eq!(notes, Vec::<String>::new());
}
