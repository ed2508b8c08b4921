//! Transports against their matrix and differences.

use rand::RngExt;

use super::report::{
    DERIVATIVE_TOLERANCE, DIFFERENCE_STEP, ROUND_OFF, Report, crumpled, exceeds, finite, moved,
    on_threads, random_vectors,
};
use crate::Vec3;
use crate::effects::{EffectContext, Measure, Operator, TransportTerm};
use crate::geometry::{face_areas, sum_at_corners};
use crate::kinetics::Location;
use crate::sheet::Sheet;

/// Steps of the power iteration before growth is measured, and while it is.
const POWER_ITERATIONS: [usize; 2] = [200, 100];
/// What the estimate of the largest eigenvalue may be wrong by, relative: it converges from below for
/// matrices that are symmetric by areas, from either side for others.
const POWER_TOLERANCE: f64 = 1e-3;

/// A transport on one shape.
struct There<'a> {
    term: &'a TransportTerm,
    sheet: &'a Sheet,
    operator: Operator,
    points: usize,
}

impl<'a> There<'a> {
    fn new(term: &'a TransportTerm, sheet: &'a Sheet, x: &[Vec3], points: usize) -> Self {
        Self { term, sheet, operator: term.operator_on(sheet, x), points }
    }

    fn rate(&self, c: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.points];
        self.term.add_rate((self.sheet, 0.0), &self.operator, c, &mut out);
        out
    }

    fn entries(&self) -> Vec<(usize, usize, f64)> {
        let mut all = Vec::new();
        self.term.entries((self.sheet, 0.0), &self.operator, &mut |i, j, v| all.push((i, j, v)));
        all
    }

    fn bound(&self) -> f64 {
        self.term.spectral_bound((self.sheet, 0.0), &self.operator)
    }

    /// Everything that it gives.
    fn bits(&self, c: &[f64]) -> Vec<(usize, usize, u64)> {
        let rate = self.rate(c).into_iter().chain([self.bound()]);
        let rate = rate.enumerate().map(|(i, v)| (i, i, v));
        rate.chain(self.entries()).map(|(i, j, v)| (i, j, v.to_bits())).collect()
    }
}

/// Everything about one transport.
pub(super) fn of_transport(
    report: &mut Report,
    term: &TransportTerm,
    sheet: &Sheet,
    context: &EffectContext<'_>,
) {
    let location = context.kinetics.map_or(Location::Vertex, |(_, location)| location);
    let amount = context.measure == Measure::Amount;
    let as_amount = if amount { " (of amounts)" } else { "" };
    let mut faults = Vec::new();
    let mut fault = |what: String| faults.push(format!("{}: {what}{as_amount}", term.name()));
    species_exist(term, context, &mut fault);
    let edge = mean_edge(sheet);
    let (x, mut random) = crumpled(sheet, edge);
    let area = areas(sheet, &x, location);
    let n = area.len();
    let mut values = || -> Vec<f64> { (0..n).map(|_| random.random_range(-1.0..=1.0)).collect() };
    let [c, other, start] = [values(), values(), values()];
    let directions = [random_vectors(&mut random, x.len()), random_vectors(&mut random, x.len())];

    let there = There::new(term, sheet, &x, n);
    let (entries, rate) = (there.entries(), there.rate(&c));
    if let Some((i, j, _)) = entries.iter().find(|(i, j, _)| *i >= n || *j >= n) {
        fault(format!("the entry ({i}, {j}) is none of a matrix of {n} points"));
        report.faults.append(&mut faults);
        return;
    }
    if !there.bound().is_finite() {
        fault(format!("the spectral bound is not finite: {}", there.bound()));
    }
    let mut numbers = rate.iter().chain(entries.iter().map(|(_, _, v)| v));
    if numbers.all(|v| v.is_finite()) {
        by_matrix(&there, &entries, &area, [&c, &other, &start], &mut fault);
    } else {
        fault("the rate or an entry is not finite".into());
    }
    same_bits(&there, &x, &c, &mut fault);
    by_positions(&there, (&x, edge), &c, &directions, &mut fault);

    let rest_area = areas(sheet, sheet.rest(), location);
    let weight = if amount { &rest_area } else { &area };
    let total: f64 = rate.iter().zip(weight).map(|(r, w)| r * w).sum();
    let size: f64 = rate.iter().zip(weight).map(|(r, w)| (r * w).abs()).sum();
    report.conserves_totals &= !exceeds(total.abs(), ROUND_OFF * size);
    let uniform: Vec<f64> =
        area.iter().zip(&rest_area).map(|(a, rest)| if amount { a / rest } else { 1.0 }).collect();
    let (_, size) = multiply(&entries, &uniform);
    report.keeps_constants &= !exceeds(length(&there.rate(&uniform)), ROUND_OFF * size);
    report.faults.append(&mut faults);
}

/// Whether the species that it moves and reads exist.
fn species_exist(
    term: &TransportTerm,
    context: &EffectContext<'_>,
    fault: &mut impl FnMut(String),
) {
    let Some((descriptor, _)) = context.kinetics else { return };
    let count = descriptor.species.len();
    for (does, species) in [("moves", term.species()), ("reads", term.read_species())] {
        if species >= count {
            fault(format!("it {does} species number {species}, and there are {count} from 0"));
        }
    }
}

/// The rate against the matrix, the matrix against the spectral bound.
fn by_matrix(
    there: &There<'_>,
    entries: &[(usize, usize, f64)],
    area: &[f64],
    [c, other, start]: [&[f64]; 3],
    fault: &mut impl FnMut(String),
) {
    let (term, rate, bound) = (there.term, there.rate(c), there.bound());
    // What does not depend on the species; only declared sources are taken for granted.
    let none = vec![0.0; there.points];
    let sources = if term.has_sources() { there.rate(&none) } else { none };
    let linear =
        |rate: &[f64]| -> Vec<f64> { rate.iter().zip(&sources).map(|(r, s)| r - s).collect() };
    let combine = |a: &[f64], b: &[f64]| -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| 0.7 * a - 1.3 * b).collect()
    };
    let of_other = there.rate(other);
    let expected = combine(&linear(&rate), &linear(&of_other));
    let size = length(&rate) + length(&of_other);
    if exceeds(apart(&linear(&there.rate(&combine(c, other))), &expected), ROUND_OFF * size) {
        fault("the rate is not linear in the species".into());
    }
    let mut added = start.to_vec();
    term.add_rate((there.sheet, 0.0), &there.operator, c, &mut added);
    let expected: Vec<f64> = start.iter().zip(&rate).map(|(a, b)| a + b).collect();
    if exceeds(apart(&added, &expected), ROUND_OFF * (length(&rate) + length(start))) {
        fault("the rate is not added to what is there".into());
    }
    let (product, size) = multiply(entries, c);
    let error = apart(&product, &linear(&rate));
    if exceeds(error, ROUND_OFF * size.max(length(&rate))) {
        let relative = error / length(&product).max(length(&rate));
        fault(format!("the entries give another rate: it differs by {relative:.1e} (relative)"));
    }
    let largest = largest_eigenvalue(entries, area, c);
    if exceeds(largest, bound * (1.0 + POWER_TOLERANCE)) {
        fault(format!("the spectral bound is {bound:e}, an eigenvalue about {largest:e} in size"));
    }
}

/// Whether the operator on the shape `x` has the same bits on several threads, and after another shape.
fn same_bits(there: &There<'_>, x: &[Vec3], c: &[f64], fault: &mut impl FnMut(String)) {
    let There { term, sheet, points, .. } = *there;
    let one = on_threads(1, || There::new(term, sheet, x, points).bits(c));
    if one != on_threads(3, || There::new(term, sheet, x, points).bits(c)) {
        fault("rates, entries or bound depend on the number of threads".into());
    }
    let mut again = There::new(term, sheet, sheet.rest(), points);
    term.assemble(sheet, x, &mut again.operator);
    if again.bits(c) != there.bits(c) {
        fault("the operator depends on the shape that it was of before".into());
    }
}

/// The derivatives by positions, if they are given.
fn by_positions(
    there: &There<'_>,
    (x, edge): (&[Vec3], f64),
    c: &[f64],
    directions: &[Vec<Vec3>],
    fault: &mut impl FnMut(String),
) {
    let There { term, sheet, operator, points } = there;
    let mut given = Vec::new();
    term.shape_derivatives((*sheet, 0.0), operator, x, c, &mut |i, v, by| given.push((i, v, by)));
    if given.is_empty() {
        return;
    }
    if given.iter().any(|(i, v, _)| i >= points || *v >= x.len()) {
        return fault("a derivative by positions is of no point or by no vertex".into());
    }
    if !given.iter().all(|(_, _, by)| finite(&[*by])) {
        return fault("the derivatives by positions are not finite".into());
    }
    for d in directions {
        let mut exact = vec![0.0; *points];
        given.iter().for_each(|(i, v, by)| exact[*i] += by.dot(&d[*v]));
        let h = DIFFERENCE_STEP * edge;
        let at = |h: f64| There::new(term, sheet, &moved(x, d, h), *points).rate(c);
        let (above, below) = (at(h), at(-h));
        let slope: Vec<f64> = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let (error, size) = (apart(&slope, &exact), length(&slope).max(length(&exact)));
        if exceeds(error, DERIVATIVE_TOLERANCE * size + 1e-9 * length(&above) / edge) {
            let relative = error / size;
            fault(format!(
                "the derivatives by positions differ from differences by {relative:.1e} (relative)"
            ));
        }
    }
}

/// The product, and its length if nothing in it cancelled.
fn multiply(entries: &[(usize, usize, f64)], c: &[f64]) -> (Vec<f64>, f64) {
    let (mut out, mut size) = (vec![0.0; c.len()], vec![0.0; c.len()]);
    for (i, j, value) in entries {
        out[*i] += value * c[*j];
        size[*i] += (value * c[*j]).abs();
    }
    (out, length(&size))
}

/// The largest |eigenvalue| by power iteration: mean growth in the norm with areas, in which diffusion
/// is symmetric.
fn largest_eigenvalue(entries: &[(usize, usize, f64)], area: &[f64], from: &[f64]) -> f64 {
    let norm = |v: &[f64]| v.iter().zip(area).map(|(v, a)| a * v * v).sum::<f64>().sqrt();
    let (mut v, mut growth) = (from.to_vec(), 0.0);
    for k in 0..POWER_ITERATIONS[0] + POWER_ITERATIONS[1] {
        let before = norm(&v);
        if before == 0.0 {
            return 0.0;
        }
        v.iter_mut().for_each(|v| *v /= before);
        v = multiply(entries, &v).0;
        if k >= POWER_ITERATIONS[0] {
            growth += norm(&v).ln();
        }
    }
    (growth / crate::num::real(POWER_ITERATIONS[1])).exp()
}

fn mean_edge(sheet: &Sheet) -> f64 {
    let x = sheet.rest();
    let lengths = sheet.edges().iter().map(|edge| {
        let [a, b] = edge.vertices.map(|v| x[v as usize]);
        (b - a).norm()
    });
    lengths.sum::<f64>() / crate::num::real(sheet.edges().len().max(1))
}

/// Areas of the points at `x`: of faces, or thirds of them at vertices.
fn areas(sheet: &Sheet, x: &[Vec3], location: Location) -> Vec<f64> {
    let face = face_areas(sheet, x);
    if location == Location::Face {
        return face;
    }
    let mut all = vec![0.0; x.len()];
    sum_at_corners(sheet, |t| face[t] / 3.0, &mut all);
    all
}

fn length(a: &[f64]) -> f64 {
    a.iter().map(|a| a * a).sum::<f64>().sqrt()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
