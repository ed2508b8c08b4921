//! The flanks of a fold pressed together, step after step: the independent check finds no crossing.

use rumple::Simulation;
use rumple::geometry::Crossings;

use crate::common::prepare;

/// A strip whose clamped ends come together until its fold closes at the neck, in so many steps. About half of
/// them are in contact.
fn closing(steps: u32) -> Simulation {
    let end = |side: f64| {
        format!(
            "{{ kind = 'pin', axes = 'xyz',
                where = {{ half-space = {{ point = [{}, 0, 0], normal = [{side}, 0, 0] }} }},
                displacement = [{}, 0, 0], ramp = {{ points = [[0, 0], [0.5, 0.9], [1, 1]] }} }},",
            5.5 * side,
            -5.3 * side
        )
    };
    let text = format!(
        "sheet = {{ shape = 'rectangle', width = 12.0, height = 1.5, vertices = 300,
                   imperfection = {{ amplitude = 1e-2, seed = 1 }} }}
        material = {{ young = 1e3, poisson = 0.3, thickness = 0.2 }}
        time = {{ until = 1.0,
                 integrator = {{ kind = 'staggered', method = 'euler', step = {} }} }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'bending' }},
            {{ kind = 'contact' }},
            {} {}
        ]",
        1.0 / f64::from(steps),
        end(1.0),
        end(-1.0)
    );
    prepare(&text, &[]).1
}

/// The steps taken, those in contact, the largest number of pairs and the smallest distance.
fn pressed(steps: u32) -> (u32, u32, usize, f64) {
    let mut simulation = closing(steps);
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    let sheet = simulation.sheet().clone();
    let mut crossings = Crossings::new(&sheet);
    let (mut all, mut touching, mut most, mut least) = (0, 0, 0, f64::INFINITY);
    while simulation.state().time < 1.0 {
        simulation.step(1.0).unwrap_or_else(|e| panic!("step {all}: {e}"));
        let x = simulation.state().x.clone();
        all += 1;
        assert_eq!(crossings.find(&sheet, &x).pairs, 0, "step {all}");
        let mut at = simulation.evaluate();
        let potential = at.potential().unwrap();
        let place = potential.mechanics().contacts().next().unwrap();
        let now = potential.touching(place, &x).unwrap();
        touching += u32::from(now.pairs > 0);
        (most, least) = (most.max(now.pairs), now.gap.min(least));
    }
    (all, touching, most, least)
}

#[test]
fn a_thousand_steps_of_a_fold_do_not_cross() {
    let (all, touching, most, least) = pressed(1000);
    println!("{touching} of {all} steps in contact, {most} pairs, smallest distance {least}");
    assert!(all >= 1000 && touching > 400, "{touching} of {all} steps");
    assert!(most > 20 && least > 0.02 && least < 0.2, "{most} pairs, {least}");
}
