//! Starts that touch or cross themselves slightly, with `separate = true`.

use rumple::geometry::Crossings;
use rumple::model::Potential;
use rumple::{Simulation, Vec3};

use crate::common::prepare;

/// A strip, at rest in a plane.
fn strip(separate: &str) -> Simulation {
    let text = format!(
        "sheet = {{ shape = 'rectangle', width = 12.0, height = 1.5, vertices = 400 }}
        material = {{ young = 1e3, poisson = 0.3, thickness = 0.2, drag = 1.0 }}
        time = {{ until = 0.01, policy = 'simultaneous', integrator = {{ kind = 'staggered' }} }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'bending' }},
            {{ kind = 'contact'{separate} }},
        ]"
    );
    prepare(&text, &[]).1
}

/// Bends the strip round by 380 degrees, one end lying on the other but for its tip, which dips through it by `depth`.
fn bend(simulation: &mut Simulation, depth: f64) {
    let (most, apart) = (190f64.to_radians(), 0.12);
    let radius = 6.0 / most;
    let state = simulation.state_mut();
    let bent = |x: &Vec3| {
        let turn = x.x / radius;
        let tip = ((turn / most - 0.92) / 0.08).max(0.0);
        let r = radius + 0.5 * apart * turn / std::f64::consts::PI - (apart + depth) * tip;
        Vec3::new(r * turn.sin(), x.y, -r * turn.cos())
    };
    let all: Vec<Vec3> = state.x.iter().map(bent).collect();
    state.x = all.into();
}

fn crossings(simulation: &Simulation, x: &[Vec3]) -> usize {
    Crossings::new(simulation.sheet()).find(simulation.sheet(), x).pairs
}

#[test]
fn a_start_that_crosses_slightly_is_moved_apart() {
    let mut simulation = strip(", separate = true");
    bend(&mut simulation, 0.06);
    let start = simulation.state().x.to_vec();
    let crossing = crossings(&simulation, &start);
    assert!(crossing > 4, "{crossing}");
    let mut potential = Potential::new(simulation.model().mechanics());
    let made = potential.separate(&start).unwrap();
    assert_eq!(crossings(&simulation, &made.x), 0);
    let moved = made.x.iter().zip(&start).map(|(x, from)| (x - from).norm()).fold(0.0, f64::max);
    assert!(
        made.pairs >= crossing && moved <= 0.2 && moved == made.moved,
        "{} {moved}",
        made.pairs
    );
    let which = potential.mechanics().contacts().next().unwrap();
    // A quarter of the reach, which of edges is half of that of vertices.
    let gap = potential.touching(which, &made.x).unwrap().gap;
    assert!(gap >= 0.024, "{gap}");
    assert_eq!(potential.refusal(&made.x), None);
    let done = simulation.prepare().unwrap_or_else(|e| panic!("{e}")).separated;
    assert_eq!(done, (made.pairs, made.moved));
}

#[test]
fn a_start_that_is_apart_stays_as_it_is() {
    let mut simulation = strip(", separate = true");
    bend(&mut simulation, -0.12);
    let x = simulation.state().x.to_vec();
    assert_eq!(Potential::new(simulation.model().mechanics()).separate(&x), None);
    assert_eq!(simulation.prepare().unwrap_or_else(|e| panic!("{e}")).separated, (0, 0.0));
}

#[test]
fn what_crosses_by_more_is_refused() {
    for (separate, depth, word) in [
        (", separate = true", 0.7, "they cross by more"),
        ("", 0.06, "`separate = true` moves apart"),
    ] {
        let mut simulation = strip(separate);
        bend(&mut simulation, depth);
        let start = simulation.state().x.to_vec();
        let message = simulation.prepare().unwrap_err().to_string();
        assert!(message.contains("triangles cross") && message.contains(word), "{message}");
        assert_eq!(simulation.state().x.to_vec(), start, "the state was moved");
    }
}
