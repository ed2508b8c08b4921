//! The signal `contact_pressure`: its value, and who may not read it.

use super::running::at_end;
use crate::common::prepare;
use crate::run::program::{folder, rumple, text};

/// A plate pressed onto a plane by 5, whose species grow by the pressure that they feel.
fn scene(location: &str, touching: &str, integrator: &str) -> String {
    format!(
        "sheet = {{ shape = 'rectangle', width = 4.0, height = 3.0, vertices = 60 }}
        material = {{ young = 1e3, poisson = 0.3, thickness = 0.2 }}
        time = {{ until = 2.0{integrator} }}
        kinetics = {{ species = {{ c = {{}} }}, rates.c = 'contact_pressure', location = '{location}' }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'bending' }},
            {{ kind = 'pin', where = 'all', axes = 'xy' }},
            {{ kind = 'pressure', value = -5.0 }},
            {touching}
        ]"
    )
}

const PLANE: &str =
    "{ kind = 'obstacle', shape = { plane = { point = [0, 0, -0.08], normal = [0, 0, 1] } } }";

#[test]
fn a_law_reads_the_pressure_between_a_plate_and_a_plane() {
    for location in ["vertex", "face"] {
        let simulation = at_end(&scene(location, PLANE, ""));
        for c in &simulation.state().species[0] {
            assert!((c - 10.0).abs() < 1e-3, "{location}: {c}");
        }
    }
}

#[test]
fn frames_have_what_laws_read() {
    let text = scene("vertex", PLANE, "");
    let (_, mut simulation) =
        prepare(&format!("output = {{ fields = ['contact_pressure'] }}\n{text}"), &[]);
    simulation.prepare().unwrap();
    let read = simulation.evaluate().signals().unwrap()[0].clone();
    let frame = simulation.frame().unwrap();
    let shown = frame.point.iter().find(|f| f.name == "contact_pressure [force/length^2]").unwrap();
    assert_eq!(shown.data.as_ref(), read.as_slice());
    assert!(read.iter().all(|p| (p - 5.0).abs() < 1e-3));
}

#[test]
fn who_cannot_have_it_is_refused_by_name() {
    let refused = |scene: &str, word: &str| {
        let here = folder(scene);
        let out = rumple(here.path(), &["check", "scene.toml"]);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(message.contains("contact_pressure") && message.contains(word), "{message}");
    };
    refused(&scene("vertex", "", ""), "kind = \"contact\"");
    let monolithic = ", integrator = { kind = 'monolithic' }";
    refused(&scene("vertex", PLANE, monolithic), "integrator = \"staggered\"");
}
