//! Every numbered example runs (03 prints tables of what `answers` tests); the effect of the crate
//! `examples/indenter` gives a known answer.

#[cfg(unix)]
mod figures;
#[cfg(unix)]
mod hard;

#[path = "../../examples/01_grown_spot.rs"]
mod grown_spot;
#[path = "../../examples/06_linear_solver.rs"]
#[allow(dead_code)]
mod linear_solver;
#[path = "../../examples/02_scene_from_code.rs"]
mod scene_from_code;

// A crate of its own, whose effect this program knows as well.
#[path = "../../examples/indenter/src/main.rs"]
#[allow(dead_code)]
mod indenter;

use rumple::kinetics::PluginSearch;
use rumple::linear::{BlockMatrix, LinearSolver, NotPositive};
use rumple::scene::Scene;
use rumple::{Simulation, Vec3};

use crate::common::prepare;

const INDENTER: &str = include_str!("../../examples/indenter/src/main.rs");
const PLATE: &str = include_str!("../../examples/indenter/plate.toml");

#[test]
fn grown_spot_buckles() {
    grown_spot::main().unwrap();
}

#[test]
fn scene_from_code_is_checked() {
    scene_from_code::main().unwrap();
}

#[test]
fn a_linear_solver_of_another_crate_relaxes_a_disc() {
    linear_solver::compare(500).unwrap();
}

/// A scene names it, for both methods with a factor; one that no crate has registered is refused with the names there are.
#[test]
fn scenes_name_a_registered_linear_solver() {
    let energy = |keys: &[&str]| {
        let (_, mut simulation) = prepare(PLATE, &[&["sheet.vertices=300"], keys].concat());
        simulation.prepare().unwrap();
        simulation.step(0.1).unwrap();
        simulation.energies().unwrap().iter().map(|(_, energy)| energy).sum::<f64>()
    };
    let expected = energy(&[]);
    for keys in [
        &["equilibrium.preconditioner=\"faer-llt\""][..],
        &["equilibrium={ method = \"newton\", linear_solver = \"faer-llt\" }"],
    ] {
        let other = energy(keys);
        assert!((other / expected - 1.0).abs() < 1e-4, "{keys:?}: {other}, {expected}");
    }
    for (key, names) in [
        ("equilibrium.preconditioner=\"faer-ltt\"", ["faer-llt", "multigrid"]),
        (
            "equilibrium={ method = \"newton\", linear_solver = \"faer-ltt\" }",
            ["faer-llt", "factor"],
        ),
    ] {
        let Err(error) = Scene::parse(PLATE, "plate.toml", &[key.to_owned()]) else {
            panic!("{key}")
        };
        let message = error.rendered(false);
        assert!(names.iter().all(|name| message.contains(name)), "{message}");
        // A `main` that returns errors prints them by `Debug`.
        assert_eq!(format!("{:?}", rumple::Error::from(error)), message);
    }
}

/// A solver of nothing but what is required: the inverse of the diagonal.
struct Diagonal(Vec<Vec3>);

impl LinearSolver for Diagonal {
    fn factorise(&mut self, matrix: &BlockMatrix, _: &[Vec3], _: bool) -> Result<(), NotPositive> {
        let rows = 0..matrix.pattern().rows();
        self.0 = rows.map(|i| matrix.diagonal(i).diagonal().map(|d| 1.0 / d)).collect();
        Ok(())
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        rhs.iter_mut().zip(&self.0).for_each(|(v, inverse)| v.component_mul_assign(inverse));
    }
}

rumple::register_linear_solver!("test-diagonal", |_| Ok(Box::new(Diagonal(Vec::new()))));

#[test]
fn newton_refuses_solvers_that_detect_nothing() {
    let keys =
        ["equilibrium={ method = \"newton\", linear_solver = \"test-diagonal\" }".to_owned()];
    let scene = Scene::parse(PLATE, "plate.toml", &keys).unwrap();
    let Err(error) = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())) else {
        panic!("it is taken")
    };
    assert!(error.to_string().contains("LinearSolver::detects_indefinite"), "{error}");
}

/// The plate follows the ball down: its lowest point is that of the ball, less what a penalty gives way.
#[test]
fn an_effect_of_another_crate_indents_a_plate() {
    let (_, mut simulation) = prepare(PLATE, &["sheet.vertices=800"]);
    simulation.prepare().unwrap();
    while simulation.state().time < 1.0 {
        simulation.step(1.0).unwrap();
    }
    let lowest = simulation.state().x.iter().map(|x| x.z).fold(0.0, f64::min);
    assert!((-3.0..-2.8).contains(&lowest), "{lowest}");
    let energies = simulation.energies().unwrap();
    let of = |name: &str| energies.iter().find(|(other, _)| other == name).unwrap().1;
    assert!(of("indenter") > 0.0 && of("stretching") > 10.0 * of("indenter"), "{energies:?}");
}

#[test]
fn its_parameters_are_checked_where_they_are_written() {
    for (from, to, key, place) in [
        ("radius = 5.0", "radius = -5.0", "effect[3].radius", "-5.0"),
        ("stiffness =", "stifness =", "effect[3]", "stifness"),
        ("points = [[0, 0], [1, 1]]", "formula = 'x'", "effect[3].ramp", "{ formula"),
    ] {
        let text = PLATE.replacen(from, to, 1);
        let error = match Scene::parse(&text, "plate.toml", &[]) {
            Err(error) => error,
            Ok(scene) => {
                let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
                match rumple::Simulation::new(&scene, &search) {
                    Err(rumple::Error::Scene(error)) => error,
                    _ => panic!("accepted: {to}"),
                }
            }
        };
        assert!(error.message().contains(key), "{error}");
        assert_eq!(error.position(), Some(crate::scene::position(&text, place)), "{error}");
    }
}

/// The guide shows the example verbatim, and both state that it is short.
#[test]
fn the_guide_shows_the_example() {
    let guide = include_str!("../../docs/book/manual/effects.md");
    let code = &INDENTER[INDENTER.find("use rumple::effects").unwrap()..];
    let (effect, test) = code.split_at(code.find("#[test]").unwrap());
    assert!(guide.contains(effect.trim_end()) && guide.contains(test.trim_end()));
    let table = &PLATE[PLATE.find("radius = 5.0").unwrap()..];
    for line in table.lines().take(5) {
        let setting = line.split('#').next().unwrap().trim_end();
        assert!(guide.contains(setting), "{setting}");
    }
    let lines = INDENTER.lines().count();
    assert!(lines < 80 && guide.contains(&format!("one file of {lines} lines")), "{lines}");
}
