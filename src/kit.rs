//! Tests for any effect: derivatives against differences, threads, and what it changes under.
//!
//! As `rumple plugin validate` does for laws. [`examine`] looks at the energies and constraints of an effect on a sheet of
//! yours, crumpled and unevenly grown; the report lists faults in words, and what the effect is
//! invariant under, for you to compare with what it should be.
//!
//! ```
//! use std::sync::Arc;
//! use rumple::effects::Stretching;
//! use rumple::effects::Material;
//! use rumple::kit::examine;
//! # use rumple::sheet::{Shape, generate};
//!
//! let sheet = Arc::new(generate(&Shape::Disc { radius: 3.0 }, 60, 1)?);
//! let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
//! let report = examine(&Stretching::default(), &sheet, Some(&material))?;
//! assert_eq!(report.faults, Vec::<String>::new());
//! assert!(report.translation_invariant && report.rotation_invariant && report.zero_at_rest);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Vec3;
use crate::effects::{
    EffectContext, EffectError, EffectSpec, EnergyTerm, HessianPart, Material, Measure,
};
use crate::linear::BlockMatrix;
use crate::model::{Mechanics, ModelError, Potential};
use crate::sheet::Sheet;

/// Displacements of the crumpled shape, in mean edge lengths.
const CRUMPLED: f64 = 0.1;
/// Steps of differences, in mean edge lengths; the errors of central ones are of second order.
const STEP: f64 = 1e-5;
/// Relative error of a derivative beyond which it counts as wrong.
const WRONG: f64 = 1e-5;
/// Relative size below which a change counts as round-off.
const ROUND_OFF: f64 = 1e-9;
/// The times at which an effect is looked at.
const TIMES: [f64; 2] = [0.0, 0.7];

/// What [`examine`] found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// What is wrong, in words; nothing for a correct effect.
    pub faults: Vec<String>,
    /// Whether moving the sheet as a whole changes no energy.
    pub translation_invariant: bool,
    /// Whether turning it changes none.
    pub rotation_invariant: bool,
    /// Whether the sheet at rest has neither energy nor forces, and meets the constraints.
    pub zero_at_rest: bool,
}

/// Why an effect could not be looked at.
#[derive(Debug, thiserror::Error)]
pub enum KitError {
    /// It cannot be built on that sheet.
    #[error("{}: {error}", error.key)]
    Effect {
        /// Why.
        #[from]
        error: EffectError,
    },
    /// The sheet has no usable rest state.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// Looks at the energies of `effect` on `sheet`.
///
/// # Errors
/// If the effect cannot be built there.
pub fn examine(
    effect: &dyn EffectSpec,
    sheet: &Arc<Sheet>,
    material: Option<&Material>,
) -> Result<Report, KitError> {
    let context =
        EffectContext { sheet, material, kinetics: None, measure: Measure::Concentration };
    let built = effect.build(&context)?;
    let mut report = Report {
        translation_invariant: true,
        rotation_invariant: true,
        zero_at_rest: true,
        ..Report::default()
    };
    let declared = effect.needs().out_of_plane.is_some();
    if !declared && built.pins.iter().flatten().any(|fixed| fixed[2]) {
        report.faults.push(UNDECLARED.into());
    }
    for term in built.energies {
        of_energy(&mut report, term, sheet, (declared, false))?;
    }
    for term in built.constraints {
        of_energy(&mut report, term, sheet, (declared, true))?;
    }
    // One fault at several times is one.
    let mut seen = std::collections::BTreeSet::new();
    report.faults.retain(|fault| seen.insert(fault.clone()));
    Ok(report)
}

/// The fault of an effect that does in planar scenes what nobody sees.
const UNDECLARED: &str = "it acts along z on a sheet that lies in a plane z = const, and does not declare it: see \
     Needs::out_of_plane";

/// Everything about one energy, or about what must be zero.
fn of_energy(
    report: &mut Report,
    term: EnergyTerm,
    sheet: &Arc<Sheet>,
    (leaves_plane, constraint): (bool, bool),
) -> Result<(), ModelError> {
    let name = term.name().to_owned();
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = Mechanics::new(Arc::clone(sheet), vec![term], pins)?;
    let mut potential = Potential::new(&mechanics);
    let edge = mechanics.reference().mean_edge();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut noise = |n: usize| -> Vec<Vec3> {
        (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..=1.0))).collect()
    };
    let n = sheet.vertex_count();
    let at_rest = sheet.rest().to_vec();
    let crumple = noise(n);
    let x = moved(&at_rest, &crumple, CRUMPLED * edge);
    let directions = [noise(n), noise(n)];
    let uneven: Vec<f64> =
        (0..sheet.edges().len()).map(|e| if e % 2 == 0 { 1.03 } else { 0.98 }).collect();
    let mut fault = |what: String| report.faults.push(format!("{name}: {what}"));

    potential.set_conditions(None, 0.0);
    let (energy, force) = energy_and_gradient(&mut potential, &at_rest);
    let (there, there_force) = energy_and_gradient(&mut potential, &x);
    let scale = there.abs().max(largest(&there_force) * edge).max(f64::MIN_POSITIVE);
    report.zero_at_rest &= energy.abs() <= ROUND_OFF * scale
        && (constraint || largest(&force) * edge <= ROUND_OFF * scale);
    let shifted: Vec<Vec3> = x.iter().map(|x| x + edge * Vec3::new(0.3, -0.2, 0.5)).collect();
    let turn = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
    let turned: Vec<Vec3> = x.iter().map(|x| turn * x).collect();
    let same = |other: f64| (other - there).abs() <= ROUND_OFF * scale;
    report.translation_invariant &= same(potential.energy(&shifted));
    report.rotation_invariant &= same(potential.energy(&turned));

    let plane = at_rest.first().map_or(0.0, |x| x.z);
    let flat = at_rest.iter().all(|x| x.z == plane);

    for time in TIMES {
        potential.set_conditions(Some(&uneven), time);
        if flat && !leaves_plane {
            let in_plane: Vec<Vec3> = x.iter().map(|x| Vec3::new(x.x, x.y, plane)).collect();
            let (_, gradient) = energy_and_gradient(&mut potential, &in_plane);
            let limit = ROUND_OFF * largest(&gradient);
            if gradient.iter().any(|g| g.z.abs() > limit) {
                fault(UNDECLARED.into());
            }
        }
        let (_, gradient) = energy_and_gradient(&mut potential, &x);
        let mut matrix = BlockMatrix::zeros(potential.pattern(&x));
        if let Err(error) = potential.hessian(&x, HessianPart::Full, &mut matrix) {
            fault(error.to_string());
            continue;
        }
        let low_rank = potential.low_rank(&x, HessianPart::Full);
        for d in &directions {
            let h = STEP * edge;
            let (up, down) = (moved(&x, d, h), moved(&x, d, -h));
            let exact = dot(&gradient, d);
            let rise = (potential.energy(&up) - potential.energy(&down)) / (2.0 * h);
            let size = exact.abs().max(rise.abs()).max(1e-6 * norm(&gradient) * norm(d));
            // The energy itself has a round-off that a small slope may not exceed.
            let noise = 1e-13 * there.abs() / h;
            if (rise - exact).abs() > WRONG * size + noise {
                fault(format!("the gradient gives {exact:e}, differences {rise:e} (time {time})"));
            }
            let mut product = multiply(&matrix, d);
            for term in &low_rank {
                let share = term.stiffness * dot(&term.direction, d);
                product.iter_mut().zip(&term.direction).for_each(|(p, v)| *p += share * v);
            }
            let (_, above) = energy_and_gradient(&mut potential, &up);
            let (_, below) = energy_and_gradient(&mut potential, &down);
            let slope: Vec<Vec3> =
                above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * h)).collect();
            let error = norm(&moved(&slope, &product, -1.0));
            let size = norm(&slope).max(norm(&product)).max(1e-9 * norm(&gradient) / edge);
            if error > WRONG * size {
                let relative = error / size;
                fault(format!(
                    "the second derivatives differ from differences of the gradient by {relative:.1e} \
                     (relative; time {time})"
                ));
            }
        }
        positive_part(&mut potential, &x, &directions, &mut fault);
        by_lengths(&mut potential, (&x, time), &uneven, &mut fault);
        if bits(&mut potential, &x, 1) != bits(&mut potential, &x, 3) {
            fault("energy or forces depend on the number of threads".into());
        }
    }
    Ok(())
}

/// Whether the positive part of the second derivatives is that.
fn positive_part(
    potential: &mut Potential,
    x: &[Vec3],
    directions: &[Vec<Vec3>],
    fault: &mut impl FnMut(String),
) {
    let mut matrix = BlockMatrix::zeros(potential.pattern(x));
    if potential.hessian(x, HessianPart::Positive, &mut matrix).is_err() {
        return;
    }
    let negative = potential.low_rank(x, HessianPart::Positive).iter().any(|t| t.stiffness < 0.0);
    for d in directions {
        let value = dot(&multiply(&matrix, d), d);
        if negative || value < -ROUND_OFF * matrix.mean_diagonal().abs() * dot(d, d) {
            fault(format!(
                "the positive part of the second derivatives is not positive: {value:e}"
            ));
        }
    }
}

/// The derivatives of the gradient by optimal lengths.
fn by_lengths(
    potential: &mut Potential,
    (x, time): (&[Vec3], f64),
    factor: &[f64],
    fault: &mut impl FnMut(String),
) {
    let reference = potential.metric().reference_length().to_vec();
    // Lengths change in proportion to this.
    let change: Vec<f64> = (0..factor.len()).map(|e| if e % 3 == 0 { 1.0 } else { -0.4 }).collect();
    let mut exact = vec![Vec3::zeros(); x.len()];
    potential.metric_derivatives(x, &mut |i, e, by| exact[i] += change[e] * reference[e] * by);
    let step = 1e-6;
    let mut at = |step: f64| {
        let factor: Vec<f64> = factor.iter().zip(&change).map(|(f, w)| f + step * w).collect();
        potential.set_conditions(Some(&factor), time);
        energy_and_gradient(potential, x).1
    };
    let (above, below) = (at(step), at(-step));
    at(0.0);
    let slope: Vec<Vec3> = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step)).collect();
    let (error, size) = (norm(&moved(&slope, &exact, -1.0)), norm(&slope).max(norm(&exact)));
    if error > WRONG * size + 1e-9 * norm(&above) {
        let relative = error / size;
        fault(format!(
            "the derivatives of the forces by the optimal lengths differ from differences by \
             {relative:.1e} (relative; time {time})"
        ));
    }
}

fn energy_and_gradient(potential: &mut Potential, x: &[Vec3]) -> (f64, Vec<Vec3>) {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let energy = potential.energy_gradient(x, &mut gradient);
    (energy, gradient)
}

/// Energy and gradient on that many threads.
fn bits(potential: &mut Potential, x: &[Vec3], threads: usize) -> Vec<u64> {
    let mut evaluate = || {
        let (energy, gradient) = energy_and_gradient(potential, x);
        let gradient = gradient.iter().flat_map(|g| g.iter().copied());
        std::iter::once(energy).chain(gradient).map(f64::to_bits).collect()
    };
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(evaluate),
        Err(_) => evaluate(),
    }
}

fn multiply(matrix: &BlockMatrix, v: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); v.len()];
    for i in 0..v.len() {
        for (&j, block) in matrix.pattern().row(i).iter().zip(matrix.row(i)) {
            let j = j as usize;
            out[i] += block * v[j];
            if j != i {
                out[j] += block.tr_mul(&v[i]);
            }
        }
    }
    out
}

fn moved(x: &[Vec3], d: &[Vec3], by: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + by * d).collect()
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn norm(a: &[Vec3]) -> f64 {
    dot(a, a).sqrt()
}

fn largest(a: &[Vec3]) -> f64 {
    a.iter().map(|v| v.norm()).fold(0.0, f64::max)
}
