//! A problem put together in Rust, without a scene.

use std::sync::Arc;

use rumple::effects::{
    Axes, Bending, Load, LoadForce, Material, Pin, Pressure, Region, Stretching,
};
use rumple::num::checked::{Finite, Positive};
use rumple::problem::{ProblemError, ProblemPart};
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::SolveError;
use rumple::solve::equilibrium::{ForceTolerance, LbfgsSpec};
use rumple::{Problem, Simulation};

use crate::common::prepare;

const STEEL: Material = Material { young: 1e6, poisson: 0.25, thickness: 0.5 };

fn disc() -> Arc<Sheet> {
    generate(&SheetShape::Disc { radius: 10.0 }, 300, 1).unwrap().into()
}

fn plate(sheet: Arc<Sheet>) -> Problem<'static> {
    Problem::on(sheet)
        .material(STEEL)
        .effect(Stretching::default())
        .effect(Bending::default())
        .effect(Pin {
            region: Region::Boundary,
            axes: Axes([true; 3]),
            displacement: None,
            ramp: None,
        })
        .effect(Load {
            region: Region::All,
            force: LoadForce::AlongNormal(Finite::ONE.into()),
            ramp: None,
        })
        .equilibrium(LbfgsSpec {
            tolerance: ForceTolerance::Given(Positive::constant(1e-9)),
            ..LbfgsSpec::default()
        })
}

/// The same bits as the scene that says the same.
#[test]
fn a_problem_has_the_bits_of_its_scene() {
    let text = r#"
sheet = { shape = "disc", radius = 10.0, vertices = 300, seed = 1 }
material = { young = 1e6, poisson = 0.25, thickness = 0.5 }
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "xyz" },
    { kind = "load", where = "all", force = { along-normal = 1.0 } },
]
equilibrium = { method = "lbfgs", tolerance = 1e-9 }
time = { until = 1.0 }
"#;
    let (_, mut simulation): (_, Simulation) = prepare(text, &[]);
    simulation.prepare().unwrap();
    let mut stepper = plate(disc()).stepper().unwrap();
    stepper.prepare().unwrap();
    assert!(stepper.state.x.iter().any(|x| x.z.abs() > 1e-4));
    assert_eq!(stepper.state.x[..], simulation.state().x[..]);
    while stepper.state.time < 1.0 {
        simulation.step(1.0).unwrap();
        stepper.step(1.0).unwrap();
        assert_eq!(stepper.state, *simulation.state());
    }
    for until in [1.0, 0.5, f64::NAN] {
        let error = stepper.step(until).unwrap_err();
        assert!(matches!(error, SolveError::NoStep { .. }), "{error}");
        assert_eq!(stepper.state.time, 1.0);
    }
}

#[test]
fn mistakes_name_their_part() {
    let refused = |problem: Problem<'_>| match problem.stepper() {
        Err(ProblemError { part, message, .. }) => (part, message),
        Ok(_) => panic!("it is accepted"),
    };
    let (part, message) = refused(plate(disc()).material(None));
    assert_eq!(part, ProblemPart::Material);
    assert!(message.contains("stretching needs young"), "{message}");
    for (material, word) in [
        (Material { young: -1.0, ..STEEL }, "young is -1"),
        (Material { thickness: f64::NAN, ..STEEL }, "thickness is NaN"),
        (Material { poisson: 0.7, ..STEEL }, "poisson is 0.7"),
    ] {
        let (part, message) = refused(plate(disc()).material(material));
        assert_eq!(part, ProblemPart::Material);
        assert!(message.contains(word), "{message}");
    }
    let sphere = generate(&SheetShape::Sphere { radius: 1.0, irregular: false }, 100, 1).unwrap();
    let (part, _) = refused(Problem::on(sphere).planar(true));
    assert_eq!(part, ProblemPart::Planar);
    let pressure = Pressure { value: Finite::ONE, ramp: None };
    let planar = Problem::on(disc()).planar(true).material(STEEL).effect(Stretching::default());
    let (part, message) = refused(planar.effect(pressure));
    assert!(matches!(part, ProblemPart::Effect(1, _)), "{part:?}");
    assert!(message.contains("pressure"), "{message}");
    let (part, _) = refused(Problem::on(disc()).material(STEEL).effect(Bending::default()));
    assert_eq!(part, ProblemPart::Effects);
}

/// A state is anybody's to set: one of another sheet, or with values that are missing, is refused.
#[test]
fn a_state_of_other_lengths_is_refused() {
    let mut stepper = plate(disc()).stepper().unwrap();
    let count = stepper.state.x.len();
    let refused = |stepper: &mut rumple::Stepper| {
        let all = [stepper.prepare().err(), stepper.step(1.0).err(), stepper.energies().err()];
        all.map(|error| error.expect("it is accepted").to_string())
    };
    stepper.state.species = vec![vec![0.0; 300]];
    for message in refused(&mut stepper) {
        assert_eq!(message, "the state has 1 species, expected 0");
    }
    stepper.state.species.clear();
    stepper.state.x = stepper.state.x[1..].to_vec().into();
    for message in refused(&mut stepper) {
        assert_eq!(message, format!("the state has {} positions, expected {count}", count - 1));
    }
}
