//! Narrow ranges with bad numbers: along every input, at edges, and where a law has a kink.
//!
//! Random points miss what is narrow. Here one input at a time runs over its whole range, in steps so
//! short that a range of a 30 000th of it is met, the others at random. The sharpest kinks of
//! that line are then inspected ever more closely, by factors of 64: there a law changes its formula,
//! and may have a gap; and so are its ends.

use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rumple_numerics::num::real;

use super::sample::DECADES;
use super::validate::{Check, Verdict};
use super::{Samples, rates, values};
use crate::descriptor::Location;
use crate::field::Columns;
use crate::{Batch, Column, Descriptor, Feedback, Kinetics, KineticsError, Quantity, Signal};

/// Points on a line.
const POINTS_PER_LINE: usize = 1 << 15;
/// Lines along each input, with others half a step apart.
const LINES_PER_INPUT: usize = 2;
/// Kinks of a line that are inspected.
const MAX_KINKS: usize = 8;
/// How often each is inspected more closely, and by how many points.
const ZOOM_LEVELS: usize = 7;
const ZOOM_POINTS: usize = 128;
/// Sampled points, the last of which give the other inputs: the first lie at bounds.
const SAMPLED_POINTS: usize = 1024;
/// A law for which a line would take longer is inspected near edges only.
const MAX_LINE_DURATION: Duration = Duration::from_secs(2);

/// What one input may be.
struct Axis {
    lower: f64,
    upper: f64,
    typical: f64,
}

/// Looks along every input; normals, which are of length 1 together, are left as they are.
pub(super) fn check(kinetics: &dyn Kinetics, fields: &[Vec<f64>], seed: u64) -> Check {
    let descriptor = kinetics.descriptor();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut lines = 0;
    for (input, axis) in axes(descriptor).into_iter().enumerate() {
        let Some(axis) = axis else { continue };
        for line in 0..LINES_PER_INPUT {
            let others = Samples::new(descriptor, SAMPLED_POINTS, random.random())
                .with_parameters(fields, seed);
            let shift = real(line) / real(LINES_PER_INPUT);
            let whole = others.with(true, |batch| {
                along(kinetics, batch, SAMPLED_POINTS - 1 - line, (input, &axis), shift)
            })?;
            lines += usize::from(whole);
        }
    }
    let points = lines * POINTS_PER_LINE;
    Ok(match lines {
        0 => Verdict::Skipped("no input to vary, or a law that takes too long for it".into()),
        _ => {
            Verdict::Good(format!("{points} points along single inputs, closer at edges and kinks"))
        }
    })
}

fn axes(descriptor: &Descriptor) -> Vec<Option<Axis>> {
    let species = descriptor.species.iter().map(|species| {
        let (lower, upper, typical) = (species.lower, species.upper, species.magnitude());
        Some(Axis { lower, upper, typical })
    });
    let signals = descriptor.signals.iter().flat_map(|read| {
        let (lower, upper) = match read.signal {
            Signal::AreaRatio => (0.1, 10.0),
            Signal::AreaStrain => (-0.9, f64::INFINITY),
            signal => (signal.lower(), f64::INFINITY),
        };
        let axis = move || Axis { lower, upper, typical: read.typical };
        read.signal.columns().iter().map(move |_| (read.signal != Signal::Normal).then(axis))
    });
    species.chain(signals).collect()
}

impl Axis {
    /// The whole range in equal steps or, where it has no end, in equal ratios; then its edges.
    fn points(&self, shift: f64) -> Vec<f64> {
        let share = |k: usize, n: usize| (real(k) + shift) / real(n);
        let size = |share: f64| {
            let decades = DECADES.start + (DECADES.end - DECADES.start) * share;
            self.typical * 10_f64.powf(decades)
        };
        let (lower, upper) = (self.lower, self.upper);
        let mut points: Vec<f64> = match (lower.is_finite(), upper.is_finite()) {
            (true, true) => (0..POINTS_PER_LINE)
                .map(|k| lower + (upper - lower) * share(k, POINTS_PER_LINE))
                .collect(),
            (true, false) => {
                (0..POINTS_PER_LINE).map(|k| lower + size(share(k, POINTS_PER_LINE))).collect()
            }
            (false, true) => (0..POINTS_PER_LINE)
                .rev()
                .map(|k| upper - size(share(k, POINTS_PER_LINE)))
                .collect(),
            (false, false) => {
                let half = POINTS_PER_LINE / 2;
                let negative = (0..half).rev().map(|k| -size(share(k, half)));
                negative.chain((0..half).map(|k| size(share(k, half)))).collect()
            }
        };
        points.retain(|x| (lower..=upper).contains(x));
        points
    }

    /// Points at the ends of the range and around 0, ever nearer to them.
    fn edges(&self) -> Vec<f64> {
        let span = if self.upper - self.lower < f64::INFINITY {
            self.upper - self.lower
        } else {
            self.typical
        };
        let near = (1..18).map(|k| span * 0.1_f64.powi(k)).chain([0.0]);
        let at = [self.lower, 0.0, self.upper].into_iter().filter(|x| x.is_finite());
        let all = near.flat_map(|h| at.clone().flat_map(move |x| [x - h, x + h]));
        let next = at.clone().flat_map(|x| [x.next_up(), x.next_down()]);
        all.chain(next).filter(|x| (self.lower..=self.upper).contains(x)).collect()
    }
}

/// One input along its range, with the others as at `point` of the batch; whether there was time for
/// more than the edges.
fn along(
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    point: usize,
    (input, axis): (usize, &Axis),
    shift: f64,
) -> Result<bool, KineticsError> {
    let line = Line { kinetics, batch, point, input };
    let (edges, begin) = (axis.edges(), Instant::now());
    line.values(&edges)?;
    let points = axis.points(shift);
    if begin.elapsed().as_secs_f64() / real(edges.len().max(1)) * real(POINTS_PER_LINE)
        > MAX_LINE_DURATION.as_secs_f64()
    {
        return Ok(false);
    }
    let values = line.values(&points)?;
    for kink in kinks(&points, &values, MAX_KINKS) {
        let (mut from, mut to) = (points[kink - 1], points[kink + 1]);
        for _ in 0..ZOOM_LEVELS {
            let step = (to - from) / real(ZOOM_POINTS);
            let closer: Vec<f64> = (0..=ZOOM_POINTS).map(|k| from + step * real(k)).collect();
            let values = line.values(&closer)?;
            let Some(kink) = kinks(&closer, &values, 1).first().copied() else { break };
            (from, to) = (closer[kink - 1], closer[kink + 1]);
        }
    }
    Ok(true)
}

/// A line through the inputs.
struct Line<'a> {
    kinetics: &'a dyn Kinetics,
    batch: &'a Batch<'a>,
    point: usize,
    input: usize,
}

impl Line<'_> {
    /// The rates, and the length factor if this is of it, where the input is one of `points`.
    fn values(&self, points: &[f64]) -> Result<Columns, KineticsError> {
        let here: Vec<f64> = self.batch.inputs().map(|column| column.at(self.point)).collect();
        let parameters: Vec<f64> =
            self.batch.parameters.iter().map(|column| column.at(self.point)).collect();
        let mut columns: Vec<Column<'_>> = here.iter().map(Column::uniform).collect();
        columns[self.input] = points.into();
        let parameters: Vec<Column<'_>> = parameters.iter().map(Column::uniform).collect();
        let law = self.kinetics.descriptor();
        let count = law.species.len();
        let (species, signals) = columns.split_at(count);
        let (location, first, parameters) = (Location::Vertex, 0, &parameters[..]);
        let batch = Batch { location, first, count: points.len(), species, signals, parameters };
        let rates = rates(self.kinetics, &batch)?;
        let factor = Quantity::Feedback(Feedback::LengthFactor);
        if self.input < count && factor.is_given(law) {
            values(self.kinetics, factor, &batch.of(factor))?;
        }
        Ok(rates)
    }
}

/// Where slopes change most, the sharpest first: numbers of points inside the line.
fn kinks(points: &[f64], values: &Columns, most: usize) -> Vec<usize> {
    let mut found: Vec<(f64, usize)> = Vec::new();
    for s in 0..values.width() {
        let f = values.column(s);
        let bend = |k: usize| {
            let (left, right) = (points[k] - points[k - 1], points[k + 1] - points[k]);
            ((f[k + 1] - f[k]) / right - (f[k] - f[k - 1]) / left).abs()
        };
        let bends: Vec<f64> = (1..points.len().saturating_sub(1)).map(bend).collect();
        // Where it is greater than on either side: not every point of a strong curve.
        let peak = |k: &usize| {
            let here = bends[*k];
            let side = |other: Option<&f64>| other.is_none_or(|other| here >= *other);
            here > 0.0
                && side(k.checked_sub(1).and_then(|k| bends.get(k)))
                && side(bends.get(k + 1))
        };
        found.extend((0..bends.len()).filter(peak).map(|k| (bends[k], k + 1)));
    }
    found.retain(|(bend, _)| bend.is_finite());
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(most).map(|(_, k)| k).collect()
}
