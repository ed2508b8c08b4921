//! Contact in runs: with itself, with obstacles, and where nothing is near.

use rumple::Vec3;
use rumple::geometry::Crossings;
use rumple::sheet::Sheet;

use super::running::{at_end, volume};
use crate::common::prepare;
use crate::run::program::{folder, rumple, text};

fn crossings(sheet: &Sheet, x: &[Vec3]) -> usize {
    Crossings::new(sheet).find(sheet, x).pairs
}

/// What touches at the end, by the effect of contact number `which`.
fn gap(simulation: &mut rumple::Simulation, which: usize) -> (usize, f64) {
    let x = simulation.state().x.clone();
    let mut at = simulation.evaluate();
    let potential = at.potential().unwrap();
    let place = potential.mechanics().contacts().nth(which).unwrap();
    let touching = potential.touching(place, &x).unwrap();
    (touching.pairs, touching.gap)
}

const CRUSHED: &str = "
sheet = { shape = 'sphere', radius = 10.0, vertices = 250,
          imperfection = { amplitude = 1e-2, seed = 1, direction = 'normal' } }
material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.4 }
";
const CRUSHING: &str = "
            { kind = 'stretching', model = 'stvk' },
            { kind = 'bending' },
            { kind = 'pressure', value = -5.9 },";

#[test]
fn a_crushed_shell_comes_to_rest_against_itself() {
    for policy in
        ["policy = 'quasi-static'", "policy = 'simultaneous', integrator = { kind = 'staggered' }"]
    {
        let drag = if policy.contains("sim") {
            CRUSHED.replace("0.4 }", "0.4, drag = 1.0 }")
        } else {
            CRUSHED.into()
        };
        let text = format!(
            "{drag}\ntime = {{ until = 0.2, start = 'equilibrium', {policy} }}\neffect = [{CRUSHING} {{ kind = 'contact' }}]"
        );
        let mut simulation = at_end(&text);
        let (sheet, x) = (simulation.sheet().clone(), simulation.state().x.clone());
        assert_eq!(crossings(&sheet, &x), 0, "{policy}");
        let left = volume(&sheet, &x) / volume(&sheet, sheet.rest());
        assert!((0.0..0.6).contains(&left), "{policy}: {left} of the volume");
        let (pairs, gap) = gap(&mut simulation, 0);
        assert!(pairs > 20 && gap > 1e-3, "{policy}: {pairs} {gap}");
    }
}

/// The same shell without contact goes through itself, so that the test above tests something.
#[test]
fn without_contact_the_crushed_shell_turns_inside_out() {
    let text = format!("{CRUSHED}\ntime = {{ until = 0.2 }}\neffect = [{CRUSHING}]");
    let (_, mut simulation) = prepare(&text, &[]);
    let error = simulation.prepare().unwrap_err();
    assert!(error.to_string().contains("inside out"), "{error}");
    // `inspect --relax` judges as a run does, and leaves the shape as it was.
    let (_, mut simulation) = prepare(&text, &[]);
    let before = simulation.state().x.clone();
    let error = simulation.relax().unwrap_err();
    assert!(error.to_string().contains("inside out"), "{error}");
    assert_eq!(simulation.state().x, before);
}

#[test]
fn contact_changes_no_bit_where_nothing_is_near() {
    let scene = |contact: &str| {
        format!(
            "sheet = {{ shape = 'disc', radius = 8.0, vertices = 300, bump = {{ amplitude = 0.5, width = 3.0 }} }}
            material = {{ young = 1e3, poisson = 0.3, thickness = 0.3 }}
            time = {{ until = 1.0 }}
            effect = [
                {{ kind = 'stretching', model = 'stvk' }},
                {{ kind = 'bending' }},
                {{ kind = 'growth', factor = '1 + 0.1*t*exp(-(x^2 + y^2)/9)' }},
                {{ kind = 'pin', where = 'rim', axes = 'z' }},
                {contact}
            ]"
        )
    };
    let with = at_end(&scene("{ kind = 'contact' }"));
    let without = at_end(&scene(""));
    assert_eq!(with.state().x, without.state().x);
    let highest = with.state().x.iter().map(|x| x.z).fold(0.0, f64::max);
    assert!(highest > 0.7, "{highest}: the sheet has not been lifted");
}

/// A sheet that is pressed on a plane floats where the barrier carries the load: p = κ [(1 - u)²/u - 2 (1 - u) ln u].
#[test]
fn a_plane_carries_a_sheet_at_the_distance_of_its_barrier() {
    let load = 0.02;
    let mut simulation = at_end(&format!(
        "sheet = {{ shape = 'rectangle', width = 6.0, height = 4.0, vertices = 200 }}
        material = {{ young = 1e2, poisson = 0.3, thickness = 0.4 }}
        equilibrium = {{ tolerance = 1e-9 }}
        time = {{ until = 1.0 }}
        effect = [
            {{ kind = 'stretching' }},
            {{ kind = 'bending' }},
            {{ kind = 'obstacle', shape = {{ plane = {{ point = [0, 0, -0.15], normal = [0, 0, 3] }} }} }},
            {{ kind = 'load', where = 'all', force = {{ per-area = [0, 0, -{load}] }} }},
        ]"
    ));
    let pressure = |u: f64| 10.0 * ((1.0 - u) * (1.0 - u) / u - 2.0 * (1.0 - u) * u.ln());
    let (pairs, least) = gap(&mut simulation, 0);
    assert_eq!(pairs, simulation.sheet().vertex_count());
    for x in &simulation.state().x {
        let found = pressure((x.z + 0.15) / 0.2);
        assert!((found / load - 1.0).abs() < 1e-4, "{found} at {}", x.z);
        assert!(x.z + 0.15 > least - 1e-12);
    }
}

/// A shell between two plates that close: the forces on them balance, and the shell stays between.
#[test]
fn plates_that_close_flatten_a_shell() {
    let plate = |z: f64| {
        format!(
            "{{ kind = 'obstacle', shape = {{ plane = {{ point = [0, 0, {}], normal = [0, 0, {}] }} }},
               displacement = [0, 0, {}], ramp = {{ formula = 't' }} }},",
            -5.2 * z,
            z,
            1.0 * z
        )
    };
    let mut simulation = at_end(&format!(
        "sheet = {{ shape = 'sphere', radius = 5.0, vertices = 400 }}
        material = {{ young = 1e3, poisson = 0.3, thickness = 0.3 }}
        time = {{ until = 1.0 }}
        effect = [
            {{ kind = 'stretching', model = 'stvk' }},
            {{ kind = 'bending' }},
            {} {}
        ]",
        plate(1.0),
        plate(-1.0)
    ));
    for x in &simulation.state().x {
        assert!(x.z.abs() < 4.2, "{x:?} lies in a plate");
    }
    let x = simulation.state().x.clone();
    let mut at = simulation.evaluate();
    let potential = at.potential().unwrap();
    let places: Vec<usize> = potential.mechanics().contacts().collect();
    let [below, above] =
        [0, 1].map(|k| potential.force_of(places[k], &x).iter().map(|f| f.z).sum::<f64>());
    assert!(below > 0.1, "{below}");
    assert!((below + above).abs() < 1e-4 * below, "{below} {above}");
    let pressure = potential.contact_pressure(&x);
    assert!(pressure.iter().all(|p| *p >= 0.0) && pressure.iter().any(|p| *p > 0.0));
}

#[test]
fn a_start_that_crosses_itself_is_refused_with_its_place() {
    let scene = "sheet = { file = 'crossed.obj' }
        material = { young = 1e3, poisson = 0.3, thickness = 0.1 }
        time = { until = 1.0 }
        effect = [{ kind = 'stretching' }, { kind = 'bending' }, { kind = 'contact' }]";
    let folder = folder(scene);
    // A strip that is folded up and back down through itself.
    std::fs::write(
        folder.path().join("crossed.obj"),
        "v 0 0 0\nv 0 2 0\nv 1 0 0\nv 1 2 0\nv 1 0 1\nv 1 2 1\nv 0.5 0.5 -1\nv 0.5 1.5 -1\n\
         f 1 3 2\nf 3 4 2\nf 3 5 4\nf 5 6 4\nf 5 7 6\nf 7 8 6\n",
    )
    .unwrap();
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("the effect contact cannot begin with this shape"), "{message}");
    assert!(message.contains("pairs of its triangles cross, first triangles 0"), "{message}");
    assert!(!folder.path().join("result/failure").exists(), "a report of what the message says");
}

#[test]
fn integrators_that_would_step_through_surfaces_are_refused() {
    for integrator in [
        "{ kind = 'explicit', method = 'euler' }",
        "{ kind = 'explicit', method = 'tsit45' }",
        "{ kind = 'monolithic' }",
    ] {
        let text = format!(
            "sheet = {{ shape = 'disc', radius = 2.0, vertices = 60 }}
            material = {{ young = 1e3, poisson = 0.3, thickness = 0.1, drag = 1.0 }}
            time = {{ until = 1.0, policy = 'simultaneous', integrator = {integrator} }}
            kinetics = {{ rates = {{ c = '-c' }} }}
            effect = [{{ kind = 'stretching' }}, {{ kind = 'bending' }}, {{ kind = 'contact' }}]"
        );
        let scene = rumple::scene::Scene::parse(&text, "through.toml", &[]).unwrap();
        let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
        let error = rumple::Simulation::new(&scene, &search).err().unwrap().to_string();
        assert!(error.contains("integrator") && error.contains("contact"), "{integrator}: {error}");
    }
}

#[test]
fn a_reach_beyond_the_thickness_is_refused_at_its_key() {
    let text = "sheet = { shape = 'disc', radius = 1.0, vertices = 50 }
        material = { young = 1e3, poisson = 0.3, thickness = 0.1 }
        time = { until = 1.0 }
        effect = [{ kind = 'stretching' }, { kind = 'contact', distance = 0.2 }]";
    let scene = rumple::scene::Scene::parse(text, "thick.toml", &[]).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    let error = rumple::Simulation::new(&scene, &search).err().unwrap().to_string();
    assert!(error.contains("distance") && error.contains("0.1 thick"), "{error}");
}
