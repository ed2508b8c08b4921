//! Prescriptions that meet at a vertex or an edge: those that contradict each other are refused in either order, those that
//! agree are not.

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

const PIN: &str = "kind = 'pin'\naxes = 'xyz'\nwhere";
const LEFT: &str = "{ half-space = { point = [-1, 0, 0], normal = [-1, 0, 0] } }";
const RIGHT: &str = "{ half-space = { point = [1, 0, 0], normal = [1, 0, 0] } }";

/// The error of a scene with these two effects, in this order.
fn error(one: &str, other: &str) -> Option<String> {
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 2.0, vertices = 100 }}\ntime = {{ until = 1.0 }}\n\
         material = {{ young = 1, poisson = 0.3, thickness = 0.1 }}\nkinetics = {{ rates = {{ c = '0' }} }}\n\
         [[effect]]\nkind = 'stretching'\n[[effect]]\n{one}\n[[effect]]\n{other}\n"
    );
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let search = PluginSearch::in_directories(Vec::new());
    Simulation::new(&scene, &search).err().map(|error| error.to_string())
}

#[test]
fn contradictory_prescriptions_are_refused_in_either_order() {
    let moved = |by: &str| format!("{PIN} = {LEFT}\ndisplacement = {by}");
    let pulse = "ramp = { points = [[0, 0], [0.4, 0], [0.45, 1], [0.5, 0]] }";
    let smooth = |base: &str| format!("ramp = {{ formula = '{base}exp(-((t - 0.4441)/1e-4)^2)' }}");
    let hold = "kind = 'hold'\nspecies = 'c'\nvalue = 0\nwhere";
    for (one, other, words) in [
        (format!("{PIN} = 'rim'"), moved("[1, 0, 0]"), "along x"),
        (format!("{PIN} = 'rim'"), moved("[0, 0, 1]"), "along z"),
        (format!("{PIN} = 'rim'"), format!("{}\n{pulse}", moved("[0, 1, 0]")), "along y"),
        (format!("{PIN} = 'rim'\ndisplacement = [0, 0, 0]"), moved("[1, 0, 0]"), "along x"),
        (moved("[1, 0, 0]"), format!("{}\n{pulse}", moved("[1, 0, 0]")), "along x"),
        (format!("{PIN} = 'rim'"), format!("{}\n{}", moved("[1, 0, 0]"), smooth("")), "along x"),
        (moved("[0, 1, 0]"), format!("{}\n{}", moved("[0, 1, 0]"), smooth("1 + ")), "along y"),
        (
            format!("{hold} = 'rim'"),
            "kind = 'hold'\nspecies = 'c'\nvalue = 'x'\nwhere = 'all'".into(),
            "at another value",
        ),
        (
            format!("{hold} = 'rim'"),
            format!(
                "kind = 'flux'\nspecies = 'c'\nvalue = 1\nwhere = {{ all-of = ['rim', {LEFT}] }}"
            ),
            "it prescribes the flux through the boundary at vertices",
        ),
        (
            format!("{hold} = 'all'"),
            "kind = 'exchange'\nspecies = 'c'\nrate = 1\nreference = 1\nwhere = 'rim'".into(),
            "it prescribes the exchange through the boundary at vertices",
        ),
    ] {
        for (one, other) in [(&one, &other), (&other, &one)] {
            let error = error(one, other).unwrap_or_else(|| panic!("accepted:\n{one}\n\n{other}"));
            assert!(error.contains(words), "{one}\n\n{other}\n\n{error}");
            assert!(error.contains("effect[1]") && error.contains("effect[2]"), "{error}");
        }
    }
}

/// Noise in the two rows of a clamp was there at all times.
#[test]
fn an_imperfection_leaves_a_clamp_smooth() {
    let text = "sheet = { shape = 'disc', radius = 2.0, vertices = 300, imperfection = { amplitude = 0.02, direction = 'DIR' }, \
                bump = { amplitude = 0.1, width = 2.0 } }\n\
                time = { until = 1.0 }\nmaterial = { young = 1, poisson = 0.3, thickness = 0.1 }\n\
                [[effect]]\nkind = 'stretching'\n[[effect]]\nkind = 'pin'\naxes = 'AXES'\n\
                where = { ring = { inner = 1.5, outer = 3 } }\n";
    for (direction, axes, smooth) in [("z", "xyz", true), ("normal", "z", true), ("z", "xy", false)]
    {
        let text = text.replace("DIR", direction).replace("AXES", axes);
        let scene = |text: &str| Scene::parse(text, "scene.toml", &[]).unwrap();
        let search = PluginSearch::in_directories(Vec::new());
        let start = |text: &str| Simulation::new(&scene(text), &search).unwrap();
        let rough = start(&text);
        let bump = start(&text.replace("amplitude = 0.02", "amplitude = 0"));
        let rest = rough.sheet().rest();
        for (i, (x, bump)) in rough.state().x.iter().zip(bump.state().x.iter()).enumerate() {
            let clamped = rest[i].xy().norm() >= 1.5;
            if clamped && smooth || rough.sheet().boundary()[i] {
                assert_eq!(x, bump, "vertex {i}");
            } else {
                assert_ne!(x, bump, "vertex {i}");
            }
        }
    }
}

#[test]
fn prescriptions_that_agree_are_accepted() {
    let moved = format!("{PIN} = {LEFT}\ndisplacement = [1, 0, 0]");
    let hold = format!("kind = 'hold'\nspecies = 'c'\nvalue = 0\nwhere = {LEFT}");
    for (one, other) in [
        // Of one region, along other axes.
        ("kind = 'pin'\naxes = 'z'\nwhere = 'rim'".to_owned(), moved.clone()),
        (format!("{PIN} = {RIGHT}"), moved.clone()),
        (format!("{PIN} = 'rim'"), format!("{PIN} = {LEFT}\ndisplacement = [0, 0, 0]")),
        (moved.clone(), format!("{moved}\nramp = {{ formula = '1' }}")),
        // Values next to a flux share a corner; a source within them is not a boundary value.
        (
            hold.clone(),
            format!(
                "kind = 'flux'\nspecies = 'c'\nvalue = 1\nwhere = {{ all-of = ['rim', {RIGHT}] }}"
            ),
        ),
        (hold.clone(), "kind = 'flux'\nspecies = 'c'\nvalue = 1\nwhere = 'all'".into()),
        (
            hold,
            format!(
                "kind = 'flux'\nspecies = 'c'\nwhere = 'rim'\n\
                 value = {{ default = 1, regions = [{{ where = {LEFT}, value = 0 }}] }}"
            ),
        ),
    ] {
        for (one, other) in [(&one, &other), (&other, &one)] {
            assert_eq!(error(one, other), None, "{one}\n\n{other}");
        }
    }
}
