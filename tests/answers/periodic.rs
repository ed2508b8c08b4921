//! P1 to P3: periodic sheets: counts and areas, decay of modes, wrinkles of a film on a foundation.

use std::f64::consts::TAU;
use std::sync::Arc;

use rumple::effects::HessianPart;
use rumple::model::Potential;
use rumple::sheet::{Sheet, generate};
use rumple::{Simulation, Vec3};
use rumple_numerics::linear::{BlockMatrix, LinearSolver, MixedPrecisionCholesky, PeriodicSolver};

use super::converges;
use super::known_answers::Sample;
use crate::common::{Noise, prepare, shipped};
use crate::run::program::{folder, passes, rumple, text};

const FILM: &str = "models/plates/film.toml";

fn sheets() -> Vec<Arc<Sheet>> {
    let shape =
        |both| rumple::sheet::SheetShape::PeriodicRectangle { width: 12.0, height: 7.0, both };
    [false, true].map(|both| Arc::new(generate(&shape(both), 300, 3).unwrap())).into()
}

/// Vertices of the cell.
fn owned(sheet: &Sheet) -> usize {
    sheet.reduction().owned(sheet.vertex_count())
}

#[test]
fn every_element_counts_once_and_every_vertex_has_its_neighbours() {
    for sheet in sheets() {
        let triangles = sheet.reduction().owned(sheet.triangle_count());
        let edges = sheet.edges().iter().filter(|e| sheet.counts(&e.vertices)).count();
        assert_eq!(owned(&sheet) + triangles, edges, "χ is 0");
        assert_eq!([owned(&sheet), triangles], sheet.counts_of_whole());
        let counted = sheet.triangles().iter().filter(|t| sheet.counts(*t)).count();
        assert_eq!(counted, triangles);
        let corners = |t: &[u32; 3]| t.map(|v| sheet.rest()[v as usize]);
        let area = sheet.triangles()[..triangles].iter().map(corners);
        let area: f64 = area.map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).z).sum();
        assert!((area - 84.0).abs() < 1e-9, "{area}");
        for i in 0..owned(&sheet) {
            let (edges, around) =
                (sheet.vertex_edges().entries(i), sheet.vertex_triangles().entries(i));
            let fan = edges.len() - usize::from(sheet.boundary()[i]);
            assert_eq!(fan, around.len(), "vertex {i}");
        }
    }
}

#[test]
fn frames_give_initial_values_and_fields_of_the_same_sheet() {
    let law = "[kinetics]\nrates.c = \"-c\"\n";
    let scene = |sheet: &str, thickness: &str, initial: &str| {
        format!(
            "time = {{ until = 0.1, integrator = {{ kind = \"staggered\", method = \"heun\", step = 0.05 }} }}\n\
             effect = [{{ kind = \"stretching\" }}, {{ kind = \"bending\" }}]\n\
             material = {{ young = 1.0, poisson = 0.3333333333333333, thickness = {thickness} }}\n\
             sheet = {{ shape = \"rectangle\", width = 12.0, height = 7.0, vertices = 300{sheet} }}\n\
             {law}{initial}"
        )
    };
    for periodic in [", periodic = \"x\"", ", periodic = \"xy\""] {
        let formula = "initial.c = { formula = \"2 + x*y/100\" }\n";
        let folder = folder(&scene(periodic, "0.5", formula));
        passes(folder.path(), "run scene.toml --out out --quiet");
        let frame = folder.path().join("out/frames/frame_000000.vtu");
        let file = format!("{{ file = {frame:?}, array = \"c\" }}");
        let from = format!("initial.c = {file}\n");
        let c = |simulation: &Simulation| simulation.state().species[0].clone();
        let made = prepare(&scene(periodic, "0.5", formula), &[]).1;
        let read = prepare(&scene(periodic, &file, &from), &[]).1;
        assert!(c(&made) == c(&read), "{periodic}");
        // Of another mesh.
        let other = scene(&format!("{periodic}, seed = 5"), "0.5", &from);
        std::fs::write(folder.path().join("scene.toml"), other).unwrap();
        let said = text(&rumple(folder.path(), &["check", "scene.toml"]).stderr);
        assert!(
            said.contains("it is a state of another mesh") || said.contains("are needed"),
            "{said}"
        );
    }
}

/// Every effect with an energy, at a shape with large strains and angles: images move as their owners do.
fn film(sheet: &str, more: &str) -> Simulation {
    let text = shipped(FILM);
    let (_, rest) = text.split_once("[material]").unwrap();
    prepare(&format!("{sheet}\n[material]{rest}\n{more}"), &[]).1
}

const EFFECTS: &str = "[[effect]]\nkind = \"active-tension\"\nvalue = \"3 + sin(x) + y\"\n";

fn crumpled(sheet: &Sheet, seed: u64) -> Vec<Vec3> {
    let mut noise = Noise::new(seed);
    let mut d: Vec<Vec3> = (0..sheet.vertex_count()).map(|_| 0.1 * noise.vector()).collect();
    sheet.reduction().update_ghosts(&mut d);
    d
}

#[test]
fn gradients_and_hessians_are_those_of_the_energy() {
    for periodic in ["x", "xy"] {
        for (stretching, bending) in [("bond", "meyer"), ("stvk", "hinge")] {
            let sheet = format!(
                "[sheet]\nshape = \"rectangle\"\nperiodic = \"{periodic}\"\nwidth = 12.0\nheight = 7.0\nvertices = 200"
            );
            let text = shipped(FILM);
            let (_, rest) = text.split_once("[material]").unwrap();
            let rest = rest
                .replace("\"stretching\"", &format!("\"stretching\"\nmodel = \"{stretching}\""))
                .replace("\"bending\"", &format!("\"bending\"\nmodel = \"{bending}\""));
            let simulation = prepare(&format!("{sheet}\n[material]{rest}\n{EFFECTS}"), &[]).1;
            let model = simulation.model();
            let sheet = model.sheet();
            let mut potential = Potential::new(model.mechanics());
            potential.set_conditions(None, 0.7);
            let by = |x: &[Vec3], d: &[Vec3], h: f64| -> Vec<Vec3> {
                x.iter().zip(d).map(|(x, d)| x + h * d).collect()
            };
            let x = by(sheet.rest(), &crumpled(sheet, 1), 1.0);
            let gradient_at = |potential: &mut Potential, x: &[Vec3]| {
                let mut g = vec![Vec3::zeros(); x.len()];
                potential.energy_gradient(x, &mut g);
                g
            };
            let g = gradient_at(&mut potential, &x);
            let d = crumpled(sheet, 2);
            let exact = sheet.reduction().dot(&g, &d);
            let h = 1e-5;
            let rise = potential.energy(&by(&x, &d, h)) - potential.energy(&by(&x, &d, -h));
            let error = (rise / (2.0 * h) - exact).abs() / exact.abs();
            assert!(error < 1e-6, "{periodic} {stretching} {bending}: {error:e}");
            // A u = H u by differences, solved by the folded matrix: u is found.
            let mut matrix = BlockMatrix::zeros(Arc::clone(model.mechanics().pattern()));
            potential.hessian(&x, HessianPart::Full, &mut matrix).unwrap();
            let shift = 10.0 * matrix.mean_diagonal();
            matrix.add_diagonal(shift);
            let (up, down) = (by(&x, &d, h), by(&x, &d, -h));
            let (up, down) = (gradient_at(&mut potential, &up), gradient_at(&mut potential, &down));
            let product =
                up.iter().zip(&down).zip(&d).map(|((u, l), d)| (u - l) / (2.0 * h) + shift * d);
            let mut rhs: Vec<Vec3> = product.collect();
            let mut solver = PeriodicSolver::new(matrix.pattern(), |folded| {
                Ok(Box::new(MixedPrecisionCholesky::in_double_precision(Arc::clone(folded))?))
            })
            .unwrap();
            solver.factorise(&matrix, &[], false).unwrap();
            solver.solve(&mut rhs);
            let n = owned(sheet);
            let error = (0..n).map(|i| (rhs[i] - d[i]).norm()).fold(0.0, f64::max);
            assert!(error < 1e-6, "{periodic} {stretching} {bending}: {error:e}");
        }
    }
}

#[test]
fn no_place_is_different_where_the_period_ends() {
    // The flat torus is at rest, a translation costs nothing, and two are free of rigid motions but for z.
    let simulation = film(
        "[sheet]\nshape = \"rectangle\"\nperiodic = \"xy\"\nwidth = 12.0\nheight = 7.0\nvertices = 200",
        "",
    );
    let model = simulation.model();
    let mut g = vec![Vec3::zeros(); model.sheet().vertex_count()];
    let mut potential = Potential::new(model.mechanics());
    potential.set_conditions(None, 0.0);
    potential.energy_gradient(model.sheet().rest(), &mut g);
    assert!(g.iter().take(owned(model.sheet())).all(|g| g.norm() < 1e-9));
    assert_eq!(model.mechanics().free_motions(), 3);
    let strip = film(
        "[sheet]\nshape = \"rectangle\"\nperiodic = \"x\"\nwidth = 12.0\nheight = 7.0\nvertices = 200",
        "",
    );
    assert_eq!(strip.model().mechanics().free_motions(), 4, "it turns about x too");
}

/// exp(-D k² t) of cos(kx + ly) on a torus of `vertices`.
fn decay(vertices: usize) -> Sample {
    let scene = format!(
        "[sheet]\nshape = \"rectangle\"\nperiodic = \"xy\"\nwidth = 4.0\nheight = 3.0\nvertices = {vertices}\n\
         [kinetics]\nspecies.c = {{ }}\nrates.c = \"0\"\n\
         [kinetics.initial]\nc = {{ formula = \"1 + cos(2*pi*x/4 + 2*pi*y/3)\" }}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 0.1\n\
         [time]\nuntil = 1.0\nintegrator = {{ kind = \"staggered\", rtol = 1e-7, atol = 1e-9 }}\n"
    );
    let (_, mut simulation) = prepare(&scene, &[]);
    let sheet = Arc::clone(simulation.sheet());
    let n = owned(&sheet);
    let wave = |i: usize| (TAU * sheet.rest()[i].x / 4.0 + TAU * sheet.rest()[i].y / 3.0).cos();
    let amplitude = |c: &[f64]| {
        let of = |f: &dyn Fn(usize) -> f64| (0..n).map(|i| f(i) * wave(i)).sum::<f64>();
        of(&|i| c[i] - 1.0) / of(&wave)
    };
    run(&mut simulation, 1.0);
    let k2 = (TAU / 4.0).powi(2) + (TAU / 3.0).powi(2);
    let c = &simulation.state().species[0];
    for i in n..c.len() {
        assert_eq!(c[i], c[sheet.number(i) as usize], "an image has what its owner has");
    }
    let edge = (12.0 / n as f64).sqrt();
    Sample { vertices: n, edge, computed: amplitude(c), exact: (-0.1 * k2).exp() }
}

fn run(simulation: &mut Simulation, until: f64) {
    simulation.relax().unwrap();
    while simulation.state().time < until {
        simulation.step(until).unwrap();
        let (sheet, x) = (simulation.sheet(), &simulation.state().x);
        let by = |i: usize| x[i] - sheet.rest()[i];
        let apart = (0..x.len()).map(|i| (by(i) - by(sheet.number(i) as usize)).norm());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-12, "images move as their owners do: {apart:e}");
    }
}

#[test]
fn a_mode_of_a_torus_decays_at_its_rate() {
    let samples: Vec<Sample> = [200, 3200].map(decay).into();
    converges("torus", &samples, 2e-3, 1.8);
}

/// exp(λt) of a mode cos(kx + ly) of Schnakenberg's law, λ the larger eigenvalue of J - k² D (Turing, Phil. Trans. B 237
/// (1952) 37): u' = 0.1 - u + u²v, v' = 0.9 - u²v at u = 1, v = 0.9.
fn turing(vertices: usize) -> Sample {
    let (waves, until, k2) = ([3.0, 1.0], 4.0, (TAU * 3.0 / 4.0).powi(2) + (TAU / 3.0).powi(2));
    let [a, b, c, d] = [0.8 - 0.01 * k2, 1.0, -1.8, -1.0 - 0.4 * k2];
    let rate = 0.5 * (a + d + ((a - d).powi(2) + 4.0 * b * c).sqrt());
    assert!(rate > 0.3, "{rate}");
    let mode = format!("cos(2*pi*({}*x/4 + {}*y/3))", waves[0], waves[1]);
    let scene = format!(
        "[sheet]\nshape = \"rectangle\"\nperiodic = \"xy\"\nwidth = 4.0\nheight = 3.0\nvertices = {vertices}\n\
         [kinetics]\nspecies.u = {{ }}\nspecies.v = {{ }}\nrates = {{ u = \"0.1 - u + u^2*v\", v = \"0.9 - u^2*v\" }}\n\
         [kinetics.initial]\nu = {{ formula = \"1 + 1e-3*{mode}\" }}\nv = {{ formula = \"0.9 + {:e}*{mode}\" }}\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"u\"\ncoefficient = 0.01\n\
         [[effect]]\nkind = \"diffusion\"\nspecies = \"v\"\ncoefficient = 0.4\n\
         [time]\nuntil = {until}\nintegrator = {{ kind = \"staggered\", rtol = 1e-7, atol = 1e-9 }}\n",
        1e-3 * (rate - a) / b
    );
    let (_, mut simulation) = prepare(&scene, &[]);
    run(&mut simulation, until);
    let (sheet, u) = (simulation.sheet(), &simulation.state().species[0]);
    let n = owned(sheet);
    let wave = |i: usize| {
        let x = sheet.rest()[i];
        (TAU * (waves[0] * x.x / 4.0 + waves[1] * x.y / 3.0)).cos()
    };
    let of = |f: &dyn Fn(usize) -> f64| (0..n).map(|i| f(i) * wave(i)).sum::<f64>();
    let computed = 1e3 * of(&|i| u[i] - 1.0) / of(&wave);
    let edge = (12.0 / n as f64).sqrt();
    Sample { vertices: n, edge, computed, exact: (rate * until).exp() }
}

#[test]
fn a_turing_mode_of_a_torus_grows_at_its_rate() {
    let samples: Vec<Sample> = [800, 3200].map(turing).into();
    converges("Turing", &samples, 1e-2, 1.8);
}

/// How much of every wave along x is in z, for the numbers of waves in the period from 0 to 12.
fn spectrum(sheet: &Sheet, x: &[Vec3], width: f64) -> Vec<f64> {
    let part = |k: usize| {
        let waves = (0..owned(sheet)).map(|i| {
            let (sin, cos) = (TAU * k as f64 * sheet.rest()[i].x / width).sin_cos();
            [x[i].z * sin, x[i].z * cos]
        });
        let [a, b] = waves.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        a.hypot(b) / owned(sheet) as f64
    };
    (0..13).map(part).collect()
}

/// N = C₁₁ ε = 2 √(B K), λ = 2π (B/K)^(1/4): Biot, J. Appl. Mech. 4 (1937) A1; a flat film below, six waves beyond.
#[test]
fn a_film_on_a_foundation_wrinkles_at_its_critical_strain_and_wavelength() {
    let text = shipped(FILM);
    let height = |growth: f64, policy: &str| {
        let along = format!("effect.3.along=\"1 + {growth}*t\"");
        let policy = format!("time.policy={policy:?}");
        let (_, mut simulation) = prepare(&text, &["sheet.vertices=1200", &along, &policy]);
        run(&mut simulation, 1.0);
        let x = simulation.state().x.to_vec();
        let waves = spectrum(simulation.sheet(), &x, 24.0);
        let largest = x.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
        (largest, waves)
    };
    let (below, _) = height(0.012, "quasi-static");
    assert!(below < 2e-3, "{below}");
    // Under drag the flat film has been at rest for long when it becomes unstable.
    assert!(height(0.03, "simultaneous").0 > 0.1);
    let (beyond, waves) = height(0.03, "quasi-static");
    let most = (0..waves.len()).max_by(|a, b| waves[*a].total_cmp(&waves[*b])).unwrap();
    assert_eq!(most, 6, "{waves:?}");
    // Beyond, N keeps its critical value: k² a²/4 = ε - ε_c.
    let (rigidity, stiffness): (f64, f64) = (7.5, 45.66);
    let critical = 2.0 * (rigidity * stiffness).sqrt() / (2250.0 / (1.0 - 1.0 / 9.0));
    let exact = 2.0 * (0.03 - critical).sqrt() / (TAU / 4.0);
    let found = 2.0 * waves[most];
    assert!((found / exact - 1.0).abs() < 0.03, "{found} {exact}");
    assert!(beyond > 0.9 * exact, "{beyond}");
}

/// From a checkpoint the next steps have the same bits; frames of another mesh are refused.
#[test]
fn a_checkpoint_continues_with_the_same_bits() {
    let (scene, mut one) = prepare(&shipped(FILM), &["sheet.vertices=400"]);
    one.relax().unwrap();
    (0..4).for_each(|_| drop(one.step(1.0).unwrap()));
    let checkpoint = rumple::run::Checkpoint::capture(&scene, &mut one).unwrap();
    let (_, mut other) = prepare(&shipped(FILM), &["sheet.vertices=400"]);
    checkpoint.take_up(&scene, &mut other).unwrap();
    for _ in 0..3 {
        one.step(1.0).unwrap();
        other.step(1.0).unwrap();
        assert_eq!(one.state().time, other.state().time);
        assert!(one.state().x.iter().zip(other.state().x.iter()).all(|(a, b)| a == b));
    }
    let (_, mut another) = prepare(&shipped(FILM), &["sheet.vertices=400", "sheet.seed=5"]);
    let frame = one.frame().unwrap();
    let (points, triangles) = (frame.points.to_vec(), frame.triangles.to_vec());
    let cell = one.sheet().counts_of_whole();
    let surface = rumple::sheet::Surface {
        points,
        triangles: triangles[..cell[1]].to_vec(),
        ..rumple::sheet::Surface::default()
    };
    let refused = rumple::run::inspect::take_state(&mut another, &surface).unwrap_err();
    assert!(refused.to_string().contains("another mesh"), "{refused}");
}
