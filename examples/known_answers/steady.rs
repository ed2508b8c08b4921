//! Branches of steady states of chemistry, alone and with the shape at rest.
//!
//! * Y1: a bistable law on a sheet that it makes grow. The rate is cubic and reads the area ratio J, which without forces
//!   is that of the length factor:
//!
//! ```text
//! dc/dt = a + 3c - c³ + k (J - 1),    J = Φ(c)²,  Φ = 1 + b c        0 = a + f(c),  folds at f'(c) = 0
//! ```
//!
//! * Y2: Turing's threshold on a disc of radius 1 whose boundary nothing passes, for the law of Schnakenberg,
//!
//! ```text
//! du/dt = D_u Δu + γ (α - u + u²v),    dv/dt = D_v Δv + γ (β - u² v)
//! ```
//!
//!   At rest it is homogeneous, u = α + β, v = β/u², for every γ. The mode J_m(k r) cos mφ with J_m'(k) = 0 has the
//!   eigenvalues of `γ A - k² D`, whose determinant is 0 at
//!
//! ```text
//! γ² det A - γ k² (D_v A_uu + D_u A_vv) + k⁴ D_u D_v = 0
//! ```
//!
//!   of which the smaller γ is the threshold of the mode: m = 1 (k = 1.8412) first, then m = 2 (k = 3.0542), each
//!   for cos and sin.
//!
//! Turing, Phil. Trans. R. Soc. B 237 (1952) 37, doi:10.1098/rstb.1952.0012; Schnakenberg, J. Theor. Biol. 81 (1979) 389,
//! doi:10.1016/0022-5193(79)90042-0; Murray, Mathematical Biology II (2003), sections 2.3 and 2.4.

use std::sync::Arc;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::model::Model;
use rumple::scene::Scene;
use rumple::solve::Control;
use rumple::solve::continuation::{Continuation, Event, Point, Settings, Unknowns};

use super::{Outcome, Sample};

/// A scene over a number in its text.
pub(super) struct Scenes<T: Fn(f64) -> String>(pub(super) T);

impl<T: Fn(f64) -> String> Scenes<T> {
    pub(super) fn simulation(&self, parameter: f64) -> Outcome<Simulation> {
        let scene = Scene::parse(&self.0(parameter), "known_answers", &[])?;
        Ok(Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?)
    }

    fn model(&self, parameter: f64) -> Outcome<(Arc<Model>, f64)> {
        Ok((Arc::clone(self.simulation(parameter)?.model()), 0.0))
    }
}

/// All points of the branch that begins where the scene of `ends[0]` does with its shape at rest, near a steady state.
pub(super) fn points<T: Fn(f64) -> String>(
    scenes: Scenes<T>,
    ends: [f64; 2],
) -> Outcome<Vec<Point>> {
    let mut simulation = scenes.simulation(ends[0])?;
    simulation.relax()?;
    let state = simulation.state();
    let start = Unknowns { x: state.x.to_vec(), species: state.species.clone() };
    let settings = Settings::over(ends[0]..=ends[1], simulation.model().mechanics());
    let settings = Settings { longest_step: 0.2, tolerance: 1e-9, ..settings };
    let control = Control::default();
    let start = (start, ends[0]);
    let family = |parameter| scenes.model(parameter);
    let mut branch = Continuation::of_species(family, start, true, settings, &control)?;
    let mut all = vec![branch.point().clone()];
    while !branch.has_ended() && all.len() < MAX_POINTS {
        all.extend(branch.advance()?);
    }
    Ok(all)
}

/// Most points of a branch.
const MAX_POINTS: usize = 300;

/// k of Y1.
const BY_AREA: f64 = 0.5;
/// b of Y1.
const GROWTH_COEFFICIENT: f64 = 0.1;

/// f of Y1, its slope and the slope of that.
fn cubic(c: f64) -> [f64; 3] {
    let factor = 1.0 + GROWTH_COEFFICIENT * c;
    [
        3.0 * c - c.powi(3) + BY_AREA * (factor * factor - 1.0),
        3.0 - 3.0 * c * c + 2.0 * BY_AREA * GROWTH_COEFFICIENT * factor,
        -6.0 * c + 2.0 * BY_AREA * GROWTH_COEFFICIENT * GROWTH_COEFFICIENT,
    ]
}

/// The zero of a function near `x` by Newton's method; `evaluate` gives value and slope.
fn newton(mut x: f64, evaluate: impl Fn(f64) -> (f64, f64)) -> f64 {
    for _ in 0..50 {
        let (value, slope) = evaluate(x);
        x -= value / slope;
    }
    x
}

/// What Y1 finds.
pub struct Bistable {
    /// The parameters of the folds, up and back.
    pub folds: [Sample; 2],
    /// Unstable eigenvalues before, between and beyond the folds.
    pub unstable: [usize; 3],
}

/// Y1 on a disc of so many vertices.
pub fn bistable(vertices: usize) -> Outcome<Bistable> {
    let [from, to] = [-4.0, 4.0];
    let root = newton(-2.2, |c| (from + cubic(c)[0], cubic(c)[1]));
    let text = move |a: f64| {
        format!(
            "sheet = {{ shape = \"disc\", radius = 1.0, vertices = {vertices}, seed = 3 }}\n\
             material = {{ young = 1.0, poisson = 0.3, thickness = 0.05 }}\ntime = {{ until = 1.0 }}\n\
             [kinetics]\nrates.c = \"a + 3*c - c*c*c + k*(J - 1)\"\nlength_factor = \"1 + b*c\"\n\
             parameters = {{ a = {a:?}, b = {GROWTH_COEFFICIENT:?}, k = {BY_AREA:?} }}\ninitial.c = {root:?}\n\
             [[effect]]\nkind = \"stretching\"\nmodel = \"stvk\"\n[[effect]]\nkind = \"bending\"\nmodel = \"hinge\"\n\
             [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 10.0\n"
        )
    };
    let scenes = Scenes(text);
    let sheet = Arc::clone(scenes.simulation(from)?.sheet());
    let all = points(scenes, [from, to])?;
    let folds: Vec<usize> = (0..all.len()).filter(|&k| all[k].event == Event::Fold).collect();
    let [up, back] = folds[..] else { return Err(format!("{} folds", folds.len()).into()) };
    let exact = [-1.0, 1.0].map(|near| -cubic(newton(near, |c| (cubic(c)[1], cubic(c)[2])))[0]);
    let sample = |k: usize, exact: f64| Sample::new(&sheet, all[k].parameter, exact);
    Ok(Bistable {
        folds: [sample(up, exact[0]), sample(back, exact[1])],
        unstable: [all[up - 1].negative, all[up + 1].negative, all[back + 1].negative],
    })
}

/// D_u, D_v, α and β of Y2.
const TURING: [f64; 4] = [1.0, 20.0, 0.1, 0.9];
/// Zeros of J_1' and J_2': Abramowitz & Stegun, table 9.5.
const WAVES: [f64; 2] = [1.841_183_781_34, 3.054_236_928_23];

/// γ at which a mode of wave number `k` begins to grow.
fn threshold(k: f64) -> f64 {
    let [d_u, d_v, alpha, beta] = TURING;
    let u = alpha + beta;
    let (a_uu, a_uv, a_vu, a_vv) = (2.0 * beta / u - 1.0, u * u, -2.0 * beta / u, -u * u);
    let determinant = a_uu * a_vv - a_uv * a_vu;
    let linear = k * k * (d_v * a_uu + d_u * a_vv);
    let constant = k.powi(4) * d_u * d_v;
    (linear - (linear * linear - 4.0 * determinant * constant).sqrt()) / (2.0 * determinant)
}

/// What Y2 finds.
pub struct Turing {
    /// γ of the bifurcations with m = 1 and m = 2: means of the two that the mesh tells apart.
    pub thresholds: [Sample; 2],
    /// Modes that grow at the end.
    pub unstable: usize,
}

/// Y2 on a disc of so many vertices.
pub fn turing(vertices: usize) -> Outcome<Turing> {
    let [d_u, d_v, alpha, beta] = TURING;
    let (u, v) = (alpha + beta, beta / (alpha + beta).powi(2));
    let text = move |gamma: f64| {
        format!(
            "sheet = {{ shape = \"disc\", radius = 1.0, vertices = {vertices}, seed = 3 }}\ntime = {{ until = 1.0 }}\n\
             [kinetics]\nrates.u = \"g*(a - u + u*u*v)\"\nrates.v = \"g*(b - u*u*v)\"\n\
             parameters = {{ a = {alpha:?}, b = {beta:?}, g = {gamma:?} }}\ninitial.u = {u:?}\ninitial.v = {v:?}\n\
             [[effect]]\nkind = \"diffusion\"\nspecies = \"u\"\ncoefficient = {d_u:?}\n\
             [[effect]]\nkind = \"diffusion\"\nspecies = \"v\"\ncoefficient = {d_v:?}\n"
        )
    };
    let scenes = Scenes(text);
    let [first, second] = WAVES.map(threshold);
    let sheet = Arc::clone(scenes.simulation(first)?.sheet());
    let all = points(scenes, [0.5 * first, 1.15 * second])?;
    let found = all.iter().flat_map(|point| match &point.event {
        Event::Bifurcation(modes) => vec![point.parameter; modes.len()],
        _ => Vec::new(),
    });
    let found: Vec<f64> = found.collect();
    let [a, b, c, d] = found[..] else { return Err(format!("bifurcations at {found:?}").into()) };
    let last = all.last().ok_or("no points")?;
    Ok(Turing {
        thresholds: [
            Sample::new(&sheet, 0.5 * (a + b), first),
            Sample::new(&sheet, 0.5 * (c + d), second),
        ],
        unstable: last.negative,
    })
}
