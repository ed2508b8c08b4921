//! Optimal lengths and rest angles that flow: viscoelastic and plastic strips (V1 to V4).
//!
//! ```text
//! V1  strip held at the strain ε      σ(t) = σ(0) exp(-t/τ)
//! V2  strip under the load F          u(t) = F L/(Y w) (1 + t/τ)
//! V3  strip held at the curvature κ, then released: the curvature κ (1 - exp(-t/τ)) is left; with a yield curvature κ_y
//!     the curvature (κ - κ_y) (1 - exp(-t/τ))
//! V4  the first below its yield strain: nothing flows
//! ```
//!
//! exactly in the limit of small strains and angles: Maxwell's and Bingham's materials, e.g. Findley, Lai & Onaran, Creep and
//! Relaxation of Nonlinear Viscoelastic Materials (1976), chapter 5. Strips are 6 long, 2 wide and 0.1 thick, E = 1e3; τ = 2.

use std::sync::Arc;

use rumple::effects::Material;
use rumple::kinetics::PluginSearch;
use rumple::num::checked::Positive;
use rumple::num::real;
use rumple::problem::Problem;
use rumple::scene::Scene;
use rumple::sheet::Sheet;
use rumple::solve::equilibrium::{ForceTolerance, LbfgsSpec};
use rumple::solve::staggered::StaggeredSpec;
use rumple::{Simulation, Stepper, Vec3};

use super::meshes::Strip;
use super::{Outcome, Sample, at_point};

const LENGTH: f64 = 6.0;
const WIDTH: f64 = 2.0;
const MATERIAL: Material = Material { young: 1e3, poisson: 1.0 / 3.0, thickness: 0.1 };
const TIME: f64 = 2.0;

/// An integrator of small errors in time.
pub const FINE: &str = "{ kind = \"staggered\", rtol = 1e-4, atol = 1e-4 }";

/// The ends, fixed along x; one of them is moved.
fn ends(strain: f64) -> String {
    let half = 0.5 * LENGTH - 1e-6;
    let pin = |side: f64, more: &str| {
        let at = side * half;
        format!(
            "[[effect]]\nkind = \"pin\"\naxes = \"x\"\n{more}\
             where = {{ half-space = {{ point = [{at:?}, 0, 0], normal = [{side:?}, 0, 0] }} }}\n"
        )
    };
    let moved = format!("displacement = [{:?}, 0, 0]\n", strain * LENGTH);
    pin(-1.0, "displacement = [0, 0, 0]\n") + &pin(1.0, &moved)
}

/// A strip with these effects.
fn scene(vertices: usize, time: &str, effects: &str) -> Outcome<Scene> {
    let Material { young, poisson, thickness } = MATERIAL;
    let text = format!(
        "sheet = {{ shape = \"rectangle\", width = {LENGTH:?}, height = {WIDTH:?}, vertices = {vertices}, seed = 1 }}\n\
         material = {{ young = {young:?}, poisson = {poisson:?}, thickness = {thickness:?}, drag = 1e-3 }}\n\
         equilibrium = {{ method = \"lbfgs\", tolerance = 1e-10 }}\ntime = {time}\n{effects}"
    );
    Ok(Scene::parse(&text, "known_answers", &[])?)
}

/// The same, at rest at time 0.
fn strip(vertices: usize, time: &str, effects: &str) -> Outcome<Simulation> {
    let scene = scene(vertices, time, effects)?;
    Ok(Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?)
}

/// Effects of `scene` on another sheet, with the same tolerances.
fn on(sheet: &Arc<Sheet>, scene: &Scene) -> Outcome<Stepper> {
    let tolerance = |x: f64| Positive::new(x).ok_or("no tolerance");
    let fine = tolerance(1e-4)?;
    let problem = Problem::on(Arc::clone(sheet))
        .material(MATERIAL)
        .effects(&scene.effects)
        .integrator(StaggeredSpec { rtol: fine, atol: fine, ..StaggeredSpec::default() })
        .equilibrium(LbfgsSpec {
            tolerance: ForceTolerance::Given(tolerance(1e-10)?),
            ..LbfgsSpec::default()
        });
    Ok(problem.stepper()?)
}

fn run(simulation: &mut Simulation, until: f64) -> Outcome<()> {
    while simulation.state().time < until {
        simulation.step(until)?;
    }
    Ok(())
}

/// The force with which the first effect, stretching, pulls at the end at x = L/2.
fn reaction(simulation: &mut Simulation) -> Outcome<f64> {
    let sheet = simulation.sheet().clone();
    let x = simulation.state().x.to_vec();
    let force = simulation.evaluate().potential()?.force_of(0, &x);
    let end = sheet.rest().iter().zip(&force).filter(|(x, _)| x.x > 0.5 * LENGTH - 1e-6);
    Ok(-end.map(|(_, force)| force.x).sum::<f64>())
}

/// V1: the tension left after τ at the strain `strain`, as a share of that at the start, under `policy`.
pub fn relaxed(
    vertices: usize,
    stretching: &str,
    strain: f64,
    (policy, integrator): (&str, &str),
) -> Outcome<Sample> {
    let effects = format!(
        "[[effect]]\n{stretching}\n[[effect]]\nkind = \"pin\"\naxes = \"z\"\nwhere = \"all\"\n{}\
         [[effect]]\nkind = \"remodelling\"\ntime = {TIME:?}\n",
        ends(strain)
    );
    let time = format!("{{ until = {TIME:?}, policy = \"{policy}\", integrator = {integrator} }}");
    let mut simulation = strip(vertices, &time, &effects)?;
    simulation.prepare()?;
    let start = reaction(&mut simulation)?;
    run(&mut simulation, TIME)?;
    let left = reaction(&mut simulation)? / start;
    Ok(Sample::new(simulation.sheet(), left, (-1.0f64).exp()))
}

/// V4: the same share where the yield strain is `ratio` times what the strip is stretched by.
pub fn below_yield(vertices: usize, stretching: &str, ratio: f64) -> Outcome<Sample> {
    let strain = 1e-3;
    let effects = format!(
        "[[effect]]\n{stretching}\n[[effect]]\nkind = \"pin\"\naxes = \"z\"\nwhere = \"all\"\n{}\
         [[effect]]\nkind = \"remodelling\"\ntime = {TIME:?}\nyield = {:?}\n",
        ends(strain),
        ratio * strain
    );
    let time = format!("{{ until = {TIME:?}, integrator = {FINE} }}");
    let mut simulation = strip(vertices, &time, &effects)?;
    simulation.prepare()?;
    let start = reaction(&mut simulation)?;
    run(&mut simulation, TIME)?;
    let left = reaction(&mut simulation)? / start;
    Ok(Sample::new(simulation.sheet(), left, 1.0))
}

/// V2: the speed at which the middle half of the strip grows longer under a load that strains it by `strain` at once, in
/// units of its length, beside ε/τ; over the time τ.
pub fn creep(vertices: usize, stretching: &str, strain: f64) -> Outcome<Sample> {
    let half = 0.5 * LENGTH - 1e-6;
    // By the two-dimensional modulus of both models.
    let line = MATERIAL.stretching_modulus() * strain;
    let pull = |side: f64| {
        let (at, force) = (side * half, side * line);
        format!(
            "[[effect]]\nkind = \"load\"\nforce = {{ per-length = [{force:?}, 0, 0] }}\n\
             where = {{ half-space = {{ point = [{at:?}, 0, 0], normal = [{side:?}, 0, 0] }} }}\n"
        )
    };
    let effects = format!(
        "[[effect]]\n{stretching}\n[[effect]]\nkind = \"pin\"\naxes = \"z\"\nwhere = \"all\"\n{}{}\
         [[effect]]\nkind = \"remodelling\"\ntime = {TIME:?}\n",
        pull(-1.0),
        pull(1.0)
    );
    let time = format!("{{ until = {TIME:?}, integrator = {FINE} }}");
    let mut simulation = strip(vertices, &time, &effects)?;
    simulation.prepare()?;
    let length = |simulation: &Simulation| -> Outcome<f64> {
        let at = |x: f64| at_point(simulation.sheet(), &simulation.state().x, x, 0.0);
        Ok((at(0.25 * LENGTH)? - at(-0.25 * LENGTH)?).norm())
    };
    let before = length(&simulation)?;
    run(&mut simulation, TIME)?;
    let speed = (length(&simulation)? - before) / (0.5 * LENGTH * TIME);
    Ok(Sample::new(simulation.sheet(), speed, strain / TIME))
}

/// V3: the curvature of a strip that was held at the curvature 0.1 for the time τ, after its release; with the yield
/// curvature `threshold`. The lattice has edges across the strip, which are the only ones that bend.
pub fn bent(rows: usize, threshold: Option<f64>) -> Outcome<Sample> {
    let curvature = 0.1;
    let limit = threshold.map_or(String::new(), |y| format!(", yield = {y:?}"));
    let effects = format!(
        "[[effect]]\nkind = \"stretching\"\nmodel = \"stvk\"\n\
         [[effect]]\nkind = \"bending\"\nmodel = \"hinge\"\nremodelling = {{ time = {TIME:?}{limit} }}\n"
    );
    let held = format!("{effects}[[effect]]\nkind = \"pin\"\naxes = \"xyz\"\nwhere = \"all\"\n");
    let time = format!("{{ until = {TIME:?}, integrator = {FINE} }}");
    let strip = Strip { length: LENGTH, width: WIDTH, rows, extra: 0.0 };
    let sheet = Arc::new(strip.mesh()?);
    let mut stepper = on(&sheet, &scene(150, &time, &held)?)?;
    let rolled = |x: &Vec3| {
        let angle = curvature * (x.x - 0.5 * LENGTH);
        Vec3::new(angle.sin() / curvature, x.y, (angle.cos() - 1.0) / curvature)
    };
    stepper.state.x = sheet.rest().iter().map(rolled).collect();
    stepper.prepare()?;
    while stepper.state.time < TIME {
        stepper.step(TIME)?;
    }
    let mut released = on(&sheet, &scene(150, &time, &effects)?)?;
    released.state.x = stepper.state.x.clone();
    released.state.internal = stepper.state.internal.clone();
    released.relax()?;
    // On columns of vertices, between which the sheet is flat.
    let (middle, quarter) = (strip.columns() / 2, strip.columns() / 4);
    let at = |column: usize| {
        at_point(&sheet, &released.state.x, strip.spacing() * real(column), 0.5 * WIDTH)
    };
    let (a, b, c) = (at(middle - quarter)?, at(middle)?, at(middle + quarter)?);
    let left =
        2.0 * (b - a).cross(&(c - b)).norm() / ((b - a).norm() * (c - b).norm() * (c - a).norm());
    let flowed = 1.0 - (-1.0f64).exp();
    let exact = (curvature - threshold.unwrap_or(0.0)).max(0.0) * flowed;
    Ok(Sample::new(&sheet, left, exact))
}
