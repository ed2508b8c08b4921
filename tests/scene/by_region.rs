//! Parameters of laws and initial values by region.

use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

use crate::common::prepare;

const DISC: &str = r#"
sheet = { shape = "disc", radius = 5.0, vertices = 200 }
time = { until = 1.0 }
[kinetics]
rates.c = "k - c"
parameters.k = { default = 1.0, regions = [
    { where = { half-space = { normal = [1, 0, 0] } }, value = 2.0 },
    { where = "rim", value = 3.0 },
] }
initial.c = { default = 0.5, regions = [{ where = { ball = { centre = [0, 0, 0], radius = 2.0 } }, value = 4.0 }] }
"#;

#[test]
fn a_later_region_overrides_an_earlier_one() {
    for location in ["vertex", "face"] {
        let (scene, simulation) = prepare(DISC, &[&format!("kinetics.location={location}")]);
        let sheet = simulation.sheet();
        let (points, rim): (Vec<_>, Vec<bool>) = match location {
            "vertex" => (sheet.rest().to_vec(), sheet.boundary().to_vec()),
            _ => sheet
                .triangles()
                .iter()
                .map(|corners| {
                    let at = corners.map(|v| sheet.rest()[v as usize]);
                    let rim = corners.iter().all(|v| sheet.boundary()[*v as usize]);
                    (at.iter().sum::<rumple::Vec3>() / 3.0, rim)
                })
                .unzip(),
        };
        let chemistry = simulation.model().chemistry().unwrap();
        let [k] = &chemistry.parameters().at_points[..] else { panic!() };
        let c = &simulation.state().species[0];
        assert_eq!([k.len(), c.len()], [points.len(); 2]);
        for (i, x) in points.iter().enumerate() {
            let expected = if rim[i] {
                3.0
            } else if x.x >= 0.0 {
                2.0
            } else {
                1.0
            };
            // Of triangles the region decides by its own rule, which fields of effects share.
            let sure = location == "vertex" || (x.x.abs() > 1.0 && x.norm() < 3.5);
            assert!(!sure || k[i] == expected, "{location} {i}: {} {expected}", k[i]);
            let sure = location == "vertex" || (x.norm() - 2.0).abs() > 1.0;
            assert!(!sure || c[i] == if x.norm() <= 2.0 { 4.0 } else { 0.5 }, "{i}: {}", c[i]);
        }
        // Written out and read again, it is the same.
        let again = Scene::parse(&scene.resolved().unwrap(), "again.toml", &[]).unwrap();
        assert_eq!(scene.kinetics, again.kinetics);
    }
}

#[test]
fn mistakes_have_their_place() {
    let refused = |key: &str| {
        let search = PluginSearch::in_directories(Vec::new());
        let scene = Scene::parse(DISC, "scene.toml", &[key.to_owned()]);
        match scene.map(|scene| rumple::Simulation::new(&scene, &search).map(drop)) {
            Err(error) => error.rendered(false),
            Ok(made) => made.unwrap_err().to_string(),
        }
    };
    for (key, said) in [
        ("kinetics.parameters.k={ default = 1.0 }", "both keys `default` and `regions`"),
        ("kinetics.initial.c={ regions = [] }", "both keys `default` and `regions`"),
        ("kinetics.parameters.k.regions[0].where.half-space.point=[9, 0, 0]", "regions[0].where"),
        ("kinetics.initial.c.regions[0].value=-1e400", "kinetics.initial.c.regions[0].value"),
        ("kinetics.initial.c={ regoins = [] }", "regions"),
    ] {
        let message = refused(key);
        assert!(message.contains(said), "{key}: {message}");
    }
}
