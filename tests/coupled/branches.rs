//! Branches of steady states: the same under every policy, with the disturbances that grow counted.

use std::fs;
use std::sync::Arc;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::model::{Coupled, Model, State};
use rumple::scene::Scene;
use rumple::solve::Control;
use rumple::solve::continuation::{Block, Continuation, Event, Point, Settings, System, Unknowns};

/// The mesh of a scene in a file, which is read faster than made.
struct Mesh(tempfile::TempDir);

impl Mesh {
    fn of(z: &str) -> Self {
        let sheet = format!(
            "sheet = {{ shape = \"graph\", width = 10.0, height = 4.0, z = \"{z}\", vertices = 70 }}\n"
        );
        let scene = Scene::parse(&(sheet + &arch("", 1.0)(0.0)), "mesh", &[]).unwrap();
        let search = PluginSearch::in_directories(Vec::new());
        let simulation = Simulation::new(&scene, &search).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut file = fs::File::create(folder.path().join("mesh.obj")).unwrap();
        rumple::sheet::write::obj(simulation.sheet(), &mut file).unwrap();
        Self(folder)
    }

    /// Its line in a scene.
    fn line(&self) -> String {
        format!("sheet = {{ file = {:?} }}\n", self.0.path().join("mesh.obj"))
    }
}

/// A scene over a number in its text.
struct Scenes<'a> {
    text: &'a dyn Fn(f64) -> String,
    policy: &'a str,
}

impl Scenes<'_> {
    fn simulation(&self, parameter: f64) -> Simulation {
        let policy = format!("time.policy=\"{}\"", self.policy);
        let scene = Scene::parse(&(self.text)(parameter), "branches", &[policy]).unwrap();
        Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())).unwrap()
    }

    fn model(&self, parameter: f64) -> rumple::Result<(Arc<Model>, f64)> {
        Ok((Arc::clone(self.simulation(parameter).model()), 0.0))
    }
}

/// All points of the branch from 0 to `to`.
fn points(scenes: Scenes<'_>, to: f64, longest_step: f64) -> Vec<Point> {
    let mut simulation = scenes.simulation(0.0);
    simulation.relax().unwrap();
    let state = simulation.state();
    let start = Unknowns { x: state.x.to_vec(), species: state.species.clone() };
    let settings = Settings::over(to.min(0.0)..=to.max(0.0), simulation.model().mechanics());
    let settings = Settings { longest_step, tolerance: 1e-9, ..settings };
    let (start, control) = ((start, 0.0), Control::default());
    let mut branch =
        Continuation::of_species(|p| scenes.model(p), start, to > 0.0, settings, &control).unwrap();
    let mut all = vec![branch.point().clone()];
    while !branch.has_ended() && all.len() < 200 {
        all.extend(branch.advance().unwrap());
    }
    assert!(branch.has_ended());
    assert!(branch.system().tally().work().factorisations > 0);
    all
}

/// The parameters of folds and bifurcations.
fn steady(points: &[Point]) -> Vec<f64> {
    let is = |event: &Event| match event {
        Event::Fold => true,
        Event::Bifurcation(modes) => modes.iter().all(|mode| mode.frequency == 0.0),
        _ => false,
    };
    points.iter().filter(|point| is(&point.event)).map(|point| point.parameter).collect()
}

/// Real parts above 0 among the eigenvalues of M⁻¹ J at `point`, where the shape has the storage `drag`.
fn growing(model: &Arc<Model>, point: &Point, drag: f64) -> usize {
    let mut coupled = Coupled::at_rest(model);
    let state = State {
        x: point.at.x.clone().into(),
        species: point.at.species.clone(),
        ..State::default()
    };
    coupled.start(&state);
    let y = coupled.pack(&state);
    let shape = coupled.layout().mechanical();
    let jacobian = coupled.jacobian(0.0, &y).unwrap();
    let mut entries = Vec::new();
    for i in 0..y.len() {
        let mass = if i < shape { drag } else { 1.0 };
        jacobian.row(i).for_each(|(j, value)| entries.push((i, j, value / mass)));
    }
    rumple_tests_dense::real_parts(y.len(), &entries).iter().filter(|re| **re > 0.0).count()
}

/// An arch under a load, whose species grow with its area, or shrink.
fn arch(sheet: &str, gain: f64) -> impl Fn(f64) -> String + use<> {
    let sheet = sheet.to_owned();
    move |load| {
        format!(
            "{sheet}material = {{ young = 1e4, poisson = 0.3, thickness = 0.1 }}\ntime = {{ until = 1.0 }}\n\
             equilibrium = {{ tolerance = 1e-9 }}\n[kinetics]\nrates.c = \"k*(J - 1) - c\"\n\
             length_factor = \"1 + 0.2*c\"\nparameters = {{ k = {gain:?} }}\ninitial.c = 0.0\n\
             [[effect]]\nkind = \"stretching\"\nmodel = \"stvk\"\nmodulus = \"plate\"\n\
             [[effect]]\nkind = \"bending\"\nmodel = \"hinge\"\nrest = \"mesh\"\n\
             [[effect]]\nkind = \"pin\"\naxes = \"xyz\"\n\
             where = {{ half-space = {{ point = [-4.999, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }} }}\n\
             [[effect]]\nkind = \"pin\"\naxes = \"xz\"\n\
             where = {{ half-space = {{ point = [4.999, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }} }}\n\
             [[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = {{ per-area = [0.0, 0.0, {load:?}] }}\n\
             [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 1.0\n"
        )
    }
}

/// A flat strip between two walls that a species makes grow.
fn strip(sheet: &str, amount: f64) -> String {
    arch(sheet, 0.0)(0.0)
        .replace("k*(J - 1) - c", "k - c")
        .replace("k = 0.0", &format!("k = {amount:?}"))
        .replace("1 + 0.2*c", "1 + 1e-3*c")
        .replace("\"xyz\"", "\"xz\"")
        .replace(
            "[[effect]]\nkind = \"load\"\nwhere = \"all\"\nforce = { per-area = [0.0, 0.0, 0.0] }\n",
            "[[effect]]\nkind = \"pin\"\naxes = \"y\"\n\
             where = { ball = { centre = [-5.0, -2.0, 0.0], radius = 0.01 } }\n",
        )
}

/// The folds are those of the coupled system. Where the species give way to the load the shape at given species is stable
/// beyond the first fold for a while; where they resist, it is unstable before, and so are the species: two grow.
#[test]
fn folds_do_not_depend_on_the_policy_and_what_grows_is_counted_under_each() {
    let mesh = Mesh::of("0.1*cos(pi*x/10)");
    for (gain, largest) in [(1.0, 1), (-1.0, 2)] {
        let text = arch(&mesh.line(), gain);
        let of = |policy: &str| points(Scenes { text: &text, policy }, -2e-3, 0.05);
        let [still, moving] = ["quasi-static", "simultaneous"].map(of);
        let (folds, others) = (steady(&still), steady(&moving));
        assert_eq!((folds.len(), others.len()), (2, 2), "{folds:?} {others:?}");
        for (a, b) in folds.iter().zip(&others) {
            assert!((a / b - 1.0).abs() < 1e-4, "{folds:?} {others:?}");
        }
        let singular: Vec<&Point> =
            still.iter().filter(|p| matches!(p.event, Event::Singularity(_))).collect();
        assert!(!singular.is_empty());
        let first = singular[0].arc < still.iter().find(|p| p.event == Event::Fold).unwrap().arc;
        assert_eq!(first, gain < 0.0);
        let scenes = Scenes { text: &text, policy: "quasi-static" };
        // On both sides of every change, and at every fourth point.
        let plain: Vec<&Point> = still.iter().filter(|p| p.event == Event::None).collect();
        let changes = |k: usize| plain.get(k + 1).is_some_and(|p| p.negative != plain[k].negative);
        let counted =
            (0..plain.len()).filter(|&k| k % 4 == 0 || changes(k) || (k > 0 && changes(k - 1)));
        let counts: Vec<[usize; 2]> = counted
            .map(|k| {
                let point = plain[k];
                let simulation = scenes.simulation(point.parameter);
                [point.negative, growing(simulation.model(), point, 1e-7)]
            })
            .collect();
        assert!(counts.iter().all(|[found, direct]| found == direct), "{counts:?}");
        assert_eq!(counts.iter().map(|count| count[0]).max(), Some(largest));
    }
}

/// No rate reads the shape of the strip: it buckles where it would without species, which the policy does not change.
#[test]
fn a_growing_strip_buckles_at_the_same_growth_under_each_policy() {
    let mesh = Mesh::of("0*x");
    let text = |amount: f64| strip(&mesh.line(), amount);
    let of = |policy: &str| points(Scenes { text: &text, policy }, 0.5, 0.1);
    let [still, moving] = ["quasi-static", "simultaneous"].map(of);
    let (found, others) = (steady(&still), steady(&moving));
    assert!(found.len() >= 2 && found.len() == others.len(), "{found:?} {others:?}");
    for (a, b) in found.iter().zip(&others) {
        assert!((a / b - 1.0).abs() < 1e-4, "{found:?} {others:?}");
    }
    let of_shape = |point: &Point| match &point.event {
        Event::Bifurcation(modes) => modes.iter().all(|mode| mode.block == Block::Shape),
        other => *other != Event::Fold,
    };
    assert!(still.iter().all(of_shape));
    let last = &still[still.len() - 1];
    assert_eq!((last.negative, last.negative_of_shape), (found.len(), found.len()));
    let scenes = Scenes { text: &text, policy: "quasi-static" };
    let model = Arc::clone(scenes.simulation(last.parameter).model());
    assert_eq!(growing(&model, last, 1e-7), found.len());
    // The flat sheet is left for a bent one.
    let bifurcation = still.iter().find(|p| matches!(p.event, Event::Bifurcation(_))).unwrap();
    let settings = Settings::over(0.0..=0.5, model.mechanics());
    let settings = Settings { tolerance: 1e-9, ..settings };
    let start = (still[0].at.clone(), 0.0);
    let mut branch =
        Continuation::of_species(|p| scenes.model(p), start, true, settings, &Control::default())
            .unwrap();
    let mut bent = branch.switch(bifurcation, 0, false).unwrap();
    for _ in 0..3 {
        bent.extend(branch.advance().unwrap());
    }
    let bent = &bent[bent.len() - 1];
    let height = bent.at.x.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
    assert!(height > 0.02 && bent.negative == 0, "{height} {}", bent.negative);
}
