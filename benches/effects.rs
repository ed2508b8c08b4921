//! What effects cost together against what they cost alone, and what counting costs.
//!
//! Energy, gradient and second derivatives of scenes with one effect, some and all on a sphere of 20 000
//! vertices, one thread; the scenes take turns. Medians over all rounds, and the same of the time that a tenth
//! of the rounds is below, for machines that are busy otherwise. The sum of the effects has the work on the
//! matrix itself (setting it to zero, its mean diagonal, fixed directions) once, as the scene does.
//!
//! `cargo bench --bench effects`; `cargo bench --bench effects -- 2000 200` for other sizes.

#![allow(missing_docs)]

#[allow(dead_code, reason = "the races use the rest")]
mod common;

use std::alloc::System;
use std::sync::Arc;
use std::time::Instant;

use cap::Cap;
use common::{Result, Table, machine};
use rumple::Vec3;
use rumple::effects::{EffectContext, EffectSpec, HessianPart, Material, Measure};
use rumple::model::{Mechanics, Potential};
use rumple::num::real;
use rumple::scene::Scene;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::tally::Tally;
use rumple_numerics::linear::BlockMatrix;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

const EFFECTS: [(&str, &str); 11] = [
    ("stretching", "kind = 'stretching'"),
    ("stvk", "kind = 'stretching'\nmodel = 'stvk'"),
    ("bending", "kind = 'bending'"),
    ("load", "kind = 'load'\nwhere = 'all'\nforce = { per-area = [0.1, 0, 0] }"),
    ("pressure", "kind = 'pressure'\nvalue = 0.1"),
    ("foundation", "kind = 'foundation'\nwhere = 'all'\nstiffness = 3.0"),
    ("volume", "kind = 'volume'\nstiffness = 5.0"),
    ("spontaneous curvature", "kind = 'bending'\ncurvature = '0.1*x'"),
    ("shell", "kind = 'bending'\nrest = 'mesh'"),
    ("hinges", "kind = 'bending'\nmodel = 'hinge'"),
    ("shell of hinges", "kind = 'bending'\nmodel = 'hinge'\nrest = 'mesh'"),
];

const COMBINATIONS: [&[usize]; 7] =
    [&[0, 2], &[1, 2], &[0, 6], &[2, 5], &[0, 3], &[4, 6], &[0, 1, 2, 3, 4, 5, 6]];

/// One scene: what it evaluates, and what that took.
struct Case {
    effects: Vec<usize>,
    potential: Potential,
    matrix: BlockMatrix,
    gradient: Vec<Vec3>,
    /// Bytes for the effects and their memory, and for the matrix.
    bytes: [f64; 2],
    seconds: Vec<f64>,
    of_matrix: Vec<f64>,
}

fn spec(table: &str) -> Result<Box<dyn EffectSpec>> {
    let text = format!(
        "sheet = {{ shape = 'sphere', radius = 1.0, vertices = 50 }}\ntime = {{ until = 1.0 }}\n\
         material = {{ young = 1.0, poisson = 0.3, thickness = 0.1 }}\n[[effect]]\n{table}\n"
    );
    let scene = Scene::parse(&text, "bench", &[]).map_err(|error| error.rendered(false))?;
    scene.effects.into_iter().next().ok_or_else(|| "no effect".into())
}

fn now() -> f64 {
    real(MEMORY.allocated())
}

impl Case {
    fn new(sheet: &Arc<Sheet>, x: &[Vec3], effects: &[usize]) -> Result<Self> {
        let material = Material { young: 1e3, poisson: 0.3, thickness: 0.1 };
        let context = EffectContext {
            sheet,
            material: Some(&material),
            varying: None,
            kinetics: None,
            measure: Measure::Concentration,
            read: None,
        };
        let before = now();
        let mut terms = Vec::new();
        for &effect in effects {
            terms.extend(spec(EFFECTS[effect].1)?.build(&context)?.energies);
        }
        let built = now() - before;
        let pins = vec![[false; 3]; sheet.vertex_count()];
        let mechanics = Mechanics::new(Arc::clone(sheet), terms, pins)?;
        let mut potential = Potential::new(&mechanics);
        let before = now();
        let pattern = Arc::clone(mechanics.pattern());
        let mut matrix = BlockMatrix::zeros(pattern);
        let of_matrix = now() - before;
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let before = now();
        potential.energy_gradient(x, &mut gradient);
        potential.hessian(x, HessianPart::Full, &mut matrix)?;
        let bytes = built + now() - before;
        Ok(Self {
            effects: effects.to_vec(),
            potential,
            matrix,
            gradient,
            bytes: [bytes, of_matrix],
            seconds: Vec::new(),
            of_matrix: Vec::new(),
        })
    }

    fn evaluate(&mut self, x: &[Vec3]) -> Result<()> {
        let began = Instant::now();
        self.potential.energy_gradient(x, &mut self.gradient);
        self.potential.hessian(x, HessianPart::Full, &mut self.matrix)?;
        self.seconds.push(began.elapsed().as_secs_f64());
        let began = Instant::now();
        self.gradient.fill(Vec3::zeros());
        self.matrix.clear();
        let scale = self.matrix.mean_diagonal();
        self.matrix.pin(self.potential.pins(), scale);
        self.of_matrix.push(began.elapsed().as_secs_f64());
        Ok(())
    }

    fn name(&self) -> String {
        let names: Vec<&str> = self.effects.iter().map(|e| EFFECTS[*e].0).collect();
        names.join(" + ")
    }
}

/// The value that this share of all is below.
fn quantile(values: &[f64], tenths: usize) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(sorted.len() * tenths / 10).min(sorted.len() - 1)]
}

fn median(values: &[f64]) -> f64 {
    quantile(values, 5)
}

/// Nanoseconds of one scope.
fn scope() -> f64 {
    let meter = Tally::default().meter("bench", "scope");
    let times = 200_000;
    let mut all = Vec::new();
    for _ in 0..9 {
        let began = Instant::now();
        for _ in 0..times {
            drop(meter.scope("times"));
        }
        all.push(1e9 * began.elapsed().as_secs_f64() / real(times));
    }
    median(&all)
}

fn at_size(vertices: usize, scope: f64) -> Result<()> {
    let radius = 0.3 * real(vertices).sqrt();
    let shape = SheetShape::Sphere { radius, irregular: true };
    let sheet = Arc::new(generate(&shape, vertices, 1)?);
    let wave = |x: &Vec3| 1.0 + 0.02 * (5.0 * x.x / radius).sin() * (4.0 * x.y / radius).cos();
    let x: Vec<Vec3> = sheet.rest().iter().map(|x| wave(x) * x).collect();
    let alone = (0..EFFECTS.len()).map(|e| vec![e]);
    let scenes: Vec<Vec<usize>> = alone.chain(COMBINATIONS.map(<[usize]>::to_vec)).collect();
    let mut cases = Vec::new();
    for scene in &scenes {
        // Each on a sheet of its own, which keeps tables that effects ask it for.
        let own = Arc::new(Sheet::new(sheet.rest().to_vec(), sheet.triangles().to_vec())?);
        cases.push(Case::new(&own, &x, scene)?);
    }
    let rounds = (1_000_000 / vertices).clamp(41, 2001);
    for _ in 0..rounds {
        for case in &mut cases {
            case.evaluate(&x)?;
        }
    }
    println!("\n{} vertices, {rounds} rounds, one thread\n", sheet.vertex_count());
    let titles = ["scene", "ms", "sum of its effects, ms", "deviation", "of the fastest tenth"];
    let of_memory = ["memory, kB", "deviation", "counting"];
    let mut table = Table::new(&[&titles[..], &of_memory[..]].concat());
    let own = |case: &Case, q: usize| quantile(&case.seconds, q) - quantile(&case.of_matrix, q);
    for case in &cases {
        let singles = || case.effects.iter().map(|e| &cases[*e]);
        let both = |q: usize| {
            let sum = singles().map(|single| own(single, q)).sum::<f64>();
            (quantile(&case.seconds, q), sum + quantile(&case.of_matrix, q))
        };
        let ((measured, sum), (fastest, of_fastest)) = (both(5), both(1));
        let bytes = singles().map(|single| single.bytes[0]).sum::<f64>();
        let percent = |a: f64, b: f64| format!("{:+.1} %", 100.0 * (a / b - 1.0));
        // Two scopes an effect.
        let counting = 2.0 * real(case.effects.len()) * scope * 1e-9 / measured;
        table.push(vec![
            case.name(),
            format!("{:.4}", 1e3 * measured),
            format!("{:.4}", 1e3 * sum),
            percent(measured, sum),
            percent(fastest, of_fastest),
            format!("{:.1} + matrix {:.1}", 1e-3 * case.bytes[0], 1e-3 * case.bytes[1]),
            percent(case.bytes[0], bytes),
            format!("{:.4} %", 100.0 * counting),
        ]);
    }
    println!("{}", table.markdown());
    Ok(())
}

fn main() -> Result<()> {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![20_000, 2000, 200] } else { sizes };
    println!("{}", machine());
    let scope = scope();
    println!("one scope of a meter: {scope:.0} ns");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for vertices in sizes {
        pool.install(|| at_size(vertices, scope).map_err(|error| error.to_string()))?;
    }
    Ok(())
}
