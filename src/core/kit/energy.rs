//! Energies and constraints against differences.

use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};

use super::contact;
use super::report::{
    DERIVATIVE_TOLERANCE, DIFFERENCE_STEP, INSPECTION_TIMES, ROUND_OFF, Report,
    UNDECLARED_Z_ACTION, crumpled, dot, exceeds, finite, largest, moved, norm, on_threads,
    random_vectors,
};
use crate::Vec3;
use crate::effects::{
    EnergyTerm, HessianPart, Interaction, ParameterField, RankOneTerm, SPONTANEOUS_CURVATURE,
};
use crate::linear::BlockMatrix;
use crate::model::{Mechanics, ModelError, Potential};
use crate::num::real;
use crate::sheet::Sheet;

/// Everything about one energy, or about what must be zero.
pub(super) fn of_energy(
    report: &mut Report,
    term: EnergyTerm,
    sheet: &Arc<Sheet>,
    (leaves_plane, constraint): (bool, bool),
) -> Result<(), ModelError> {
    let name = term.name().to_owned();
    let is_contact = term.interaction() != Interaction::default();
    let pins = vec![[false; 3]; sheet.vertex_count()];
    let mechanics = Mechanics::new(Arc::clone(sheet), vec![term], pins)?;
    let mut potential = Potential::new(&mechanics);
    let edge = mechanics.reference().mean_edge();
    let at_rest = sheet.rest().to_vec();
    let (x, mut random) = crumpled(sheet, edge);
    let n = sheet.vertex_count();
    let directions = [random_vectors(&mut random, n), random_vectors(&mut random, n)];
    let uneven: Vec<f64> =
        (0..sheet.edges().len()).map(|e| if e % 2 == 0 { 1.03 } else { 0.98 }).collect();
    for &s in mechanics.species() {
        potential.set_species(s, species_at(n, s, 0.0));
    }
    potential.set_conditions(None, 0.0);
    let scale = invariances(report, &mut potential, (&at_rest, &x), (edge, constraint), &name);
    let mut fault = |what: String| report.faults.push(format!("{name}: {what}"));
    let plane = at_rest.first().map_or(0.0, |x| x.z);
    let flat = at_rest.iter().all(|x| x.z == plane);
    for time in INSPECTION_TIMES {
        potential.set_conditions(Some(&uneven), time);
        if flat && !leaves_plane {
            stays_in_plane(&mut potential, (&x, plane, time), &mut fault);
        }
        let gradient = finite_gradient(&mut potential, (&x, time), &mut fault);
        let mut matrix = BlockMatrix::zeros(potential.pattern(&x));
        if let Err(error) = potential.hessian(&x, HessianPart::Full, &mut matrix) {
            fault(error.to_string());
            continue;
        }
        let low_rank = potential.low_rank(&x, HessianPart::Full);
        if !low_rank.iter().all(|term| term.stiffness.is_finite() && finite(&term.direction)) {
            fault(format!("a term of low rank is not finite (time {time})"));
        }
        let at = Derivatives { x: &x, time, edge, scale, gradient, matrix, low_rank };
        for d in &directions {
            at.against_differences(&mut potential, d, &mut fault);
        }
        positive_part(&mut potential, &x, &directions, &mut fault);
        by_fields(&mut potential, (&x, time), &uneven, &mut fault);
        if is_contact {
            contact::examine(&mut potential, (&x, time, edge), &directions, &mut fault);
        }
        if bits(&mut potential, &x, 1) != bits(&mut potential, &x, 3) {
            fault("energy or forces depend on the number of threads".into());
        }
    }
    Ok(())
}

/// Whether the energy is finite and at its minimum at rest, and what rigid motions of `x` do to it: its size at `x`.
fn invariances(
    report: &mut Report,
    potential: &mut Potential,
    (at_rest, x): (&[Vec3], &[Vec3]),
    (edge, constraint): (f64, bool),
    name: &str,
) -> f64 {
    let (energy, force) = energy_and_gradient(potential, at_rest);
    let (there, there_force) = energy_and_gradient(potential, x);
    if !(energy.is_finite() && finite(&force)) {
        let what = "the energy or the gradient is not finite at rest";
        report.faults.push(format!("{name}: {what}"));
    }
    let scale = there.abs().max(largest(&there_force) * edge).max(f64::MIN_POSITIVE);
    report.zero_at_rest &= energy.abs() <= ROUND_OFF * scale
        && (constraint || largest(&force) * edge <= ROUND_OFF * scale);
    let same = |other: f64| (other - there).abs() <= ROUND_OFF * scale;
    let [shifted, turned] = rigid_motions(x, edge);
    report.translation_invariant &= same(potential.energy(&shifted));
    report.rotation_invariant &= same(potential.energy(&turned));
    there.abs()
}

/// A shape translated, and rotated about the origin.
fn rigid_motions(x: &[Vec3], edge: f64) -> [Vec<Vec3>; 2] {
    let turn = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7));
    let shift = edge * Vec3::new(0.3, -0.2, 0.5);
    [x.iter().map(|x| x + shift).collect(), x.iter().map(|x| turn * x).collect()]
}

/// The gradient; energy, with it and without, and gradient must be finite.
fn finite_gradient(
    potential: &mut Potential,
    (x, time): (&[Vec3], f64),
    fault: &mut impl FnMut(String),
) -> Vec<Vec3> {
    let (energy, gradient) = energy_and_gradient(potential, x);
    let alone = potential.energy(x);
    if !(energy.is_finite() && alone.is_finite()) {
        fault(format!(
            "the energy is not finite: {energy}, without the gradient {alone} (time {time})"
        ));
    }
    if !finite(&gradient) {
        fault(format!("the gradient is not finite (time {time})"));
    }
    gradient
}

/// Whether an energy that declares no force out of the plane has none.
fn stays_in_plane(
    potential: &mut Potential,
    (x, plane, time): (&[Vec3], f64, f64),
    fault: &mut impl FnMut(String),
) {
    let in_plane: Vec<Vec3> = x.iter().map(|x| Vec3::new(x.x, x.y, plane)).collect();
    let (_, gradient) = energy_and_gradient(potential, &in_plane);
    let limit = ROUND_OFF * largest(&gradient);
    if !finite(&gradient) {
        fault(format!("the gradient is not finite in a plane (time {time})"));
    } else if gradient.iter().any(|g| g.z.abs() > limit) {
        fault(UNDECLARED_Z_ACTION.into());
    }
}

/// First and second derivatives at a shape.
struct Derivatives<'a> {
    x: &'a [Vec3],
    time: f64,
    /// Mean edge.
    edge: f64,
    /// Size of the energy.
    scale: f64,
    gradient: Vec<Vec3>,
    matrix: BlockMatrix,
    low_rank: Vec<RankOneTerm>,
}

impl Derivatives<'_> {
    /// Compares them with differences along `d`.
    fn against_differences(
        &self,
        potential: &mut Potential,
        d: &[Vec3],
        fault: &mut impl FnMut(String),
    ) {
        let Self { x, time, edge, scale, gradient, matrix, low_rank } = self;
        let h = DIFFERENCE_STEP * edge;
        let (up, down) = (moved(x, d, h), moved(x, d, -h));
        let exact = dot(gradient, d);
        let rise = (potential.energy(&up) - potential.energy(&down)) / (2.0 * h);
        let size = exact.abs().max(rise.abs()).max(1e-6 * norm(gradient) * norm(d));
        // The energy itself has a round-off that a small slope may not exceed.
        let noise = 1e-13 * scale / h;
        if exceeds((rise - exact).abs(), DERIVATIVE_TOLERANCE * size + noise) {
            fault(format!("the gradient gives {exact:e}, differences {rise:e} (time {time})"));
        }
        let mut product = multiply(matrix, d);
        if !finite(&product) {
            fault(format!("the second derivatives are not finite (time {time})"));
            return;
        }
        for term in low_rank {
            let share = term.stiffness * dot(&term.direction, d);
            product.iter_mut().zip(&term.direction).for_each(|(p, v)| *p += share * v);
        }
        let (_, above) = energy_and_gradient(potential, &up);
        let (_, below) = energy_and_gradient(potential, &down);
        let slope: Vec<Vec3> = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let error = norm(&moved(&slope, &product, -1.0));
        let size = norm(&slope).max(norm(&product)).max(1e-9 * norm(gradient) / edge);
        if exceeds(error, DERIVATIVE_TOLERANCE * size) {
            let relative = error / size;
            fault(format!(
                "the second derivatives differ from differences of the gradient by {relative:.1e} \
                 (relative; time {time})"
            ));
        }
    }
}

/// Whether the positive part of the second derivatives is that.
fn positive_part(
    potential: &mut Potential,
    x: &[Vec3],
    directions: &[Vec<Vec3>],
    fault: &mut impl FnMut(String),
) {
    let mut matrix = BlockMatrix::zeros(potential.pattern(x));
    if let Err(error) = potential.hessian(x, HessianPart::Positive, &mut matrix) {
        return fault(error.to_string());
    }
    let low_rank = potential.low_rank(x, HessianPart::Positive);
    if !low_rank.iter().all(|term| term.stiffness.is_finite() && finite(&term.direction)) {
        fault("a term of low rank of the positive part is not finite".into());
    }
    let negative = low_rank.iter().any(|term| term.stiffness < 0.0);
    for d in directions {
        let value = dot(&multiply(&matrix, d), d);
        if !value.is_finite() {
            fault("the positive part of the second derivatives is not finite".into());
        } else if negative || value < -ROUND_OFF * matrix.mean_diagonal().abs() * dot(d, d) {
            fault(format!(
                "the positive part of the second derivatives is not positive: {value:e}"
            ));
        }
    }
}

/// Values of species number `s` at `n` vertices, `step` further along a change of all.
fn species_at(n: usize, s: usize, step: f64) -> Vec<f64> {
    (0..n).map(|v| 0.4 + 0.1 * real(s) - 0.1 * change(v) + step * change(v)).collect()
}

/// How much the field at an edge or vertex changes in a unit of the step.
fn change(place: usize) -> f64 {
    if place.is_multiple_of(3) { 1.0 } else { -0.4 }
}

/// The derivatives of the gradient by a field, which `set` brings a step along its change, times `unit` at a place.
fn by_field(
    potential: &mut Potential,
    (x, time): (&[Vec3], f64),
    (field, name): (ParameterField, &str),
    unit: impl Fn(usize) -> f64,
    set: impl Fn(&mut Potential, f64),
    fault: &mut impl FnMut(String),
) {
    set(potential, 0.0);
    let mut exact = vec![Vec3::zeros(); x.len()];
    potential.mixed_derivatives(x, field, &mut |i, place, by| {
        exact[i] += change(place) * unit(place) * by
    });
    let mut at = |step: f64| {
        set(potential, step);
        energy_and_gradient(potential, x).1
    };
    compare(&exact, &mut at, (name, time), fault);
}

/// The derivatives of the gradient by all that `potential` depends on besides positions, the optimal lengths at `factor`.
fn by_fields(
    potential: &mut Potential,
    (x, time): (&[Vec3], f64),
    factor: &[f64],
    fault: &mut impl FnMut(String),
) {
    let reference = potential.metric().reference_length().to_vec();
    let set = |potential: &mut Potential, step: f64| {
        let factor: Vec<f64> =
            factor.iter().enumerate().map(|(e, f)| f + step * change(e)).collect();
        potential.set_conditions(Some(&factor), time);
    };
    let field = (ParameterField::OptimalLength, "the optimal lengths");
    by_field(potential, (x, time), field, |e| reference[e], set, fault);
    let set = |potential: &mut Potential, step: f64| {
        let values = (0..x.len()).map(|v| 0.3 - 0.1 * change(v) + step * change(v)).collect();
        potential.set_fields(std::iter::once((SPONTANEOUS_CURVATURE, &values)));
        potential.set_conditions(Some(factor), time);
    };
    let field = (ParameterField::SpontaneousCurvature, "the spontaneous curvature of a law");
    by_field(potential, (x, time), field, |_| 1.0, set, fault);
    potential.set_fields(std::iter::empty());
    potential.set_conditions(Some(factor), time);
    let mechanics = Arc::clone(potential.mechanics());
    for &s in mechanics.species() {
        let set = |potential: &mut Potential, step: f64| {
            potential.set_species(s, species_at(x.len(), s, step));
            potential.set_conditions(None, time);
        };
        let name = format!("species number {s}");
        let field = (ParameterField::Species(s), name.as_str());
        by_field(potential, (x, time), field, |_| 1.0, set, fault);
    }
}

/// Compares derivatives of the forces with differences.
fn compare(
    exact: &[Vec3],
    at: &mut impl FnMut(f64) -> Vec<Vec3>,
    (by, time): (&str, f64),
    fault: &mut impl FnMut(String),
) {
    if !finite(exact) {
        fault(format!("the derivatives of the forces by {by} are not finite (time {time})"));
    } else if let Some(relative) = deviation(exact, at) {
        fault(format!(
            "the derivatives of the forces by {by} differ from differences by {relative:.1e} (relative; time {time})"
        ));
    }
}

/// The relative error of `exact` against the central difference of what `at` gives a step further, if it is too large.
fn deviation(exact: &[Vec3], at: &mut impl FnMut(f64) -> Vec<Vec3>) -> Option<f64> {
    let step = 1e-6;
    let (above, below) = (at(step), at(-step));
    at(0.0);
    let slope: Vec<Vec3> = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step)).collect();
    let (error, size) = (norm(&moved(&slope, exact, -1.0)), norm(&slope).max(norm(exact)));
    exceeds(error, DERIVATIVE_TOLERANCE * size + 1e-9 * norm(&above)).then(|| error / size)
}

fn energy_and_gradient(potential: &mut Potential, x: &[Vec3]) -> (f64, Vec<Vec3>) {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let energy = potential.energy_gradient(x, &mut gradient);
    (energy, gradient)
}

/// Energy and gradient on that many threads.
fn bits(potential: &mut Potential, x: &[Vec3], threads: usize) -> Vec<u64> {
    let evaluate = || {
        let (energy, gradient) = energy_and_gradient(potential, x);
        let gradient = gradient.iter().flat_map(|g| g.iter().copied());
        std::iter::once(energy).chain(gradient).map(f64::to_bits).collect()
    };
    on_threads(threads, evaluate)
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
