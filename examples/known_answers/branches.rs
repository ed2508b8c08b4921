//! Branches of equilibria: a column beyond Euler's load, and a shallow arch through its two limit loads.
//!
//! * Q1: a strip with pinned ends under an end load, between Euler's load and the elastica:
//!
//! ```text
//! P_E = π² D'/L²,     P/P_E = (2 K(k)/π)²,     A/L = k/K(k)         = 1 + (π²/8) (A/L)² + …
//! ```
//!
//! * Q2: an arch `a sin(πx/L)` at rest, pinned, under a load q per length: Fung & Kaplan, NACA Technical Note 2840
//!   (1952). With the thrust N the shape is a sum of sines, and its shortening gives q:
//!
//! ```text
//! b_n = (D' k_n⁴ a_n - 4q/(nπ)) / (D' k_n⁴ - N k_n²),   N = (E h/4) Σ k_n² (a_n² - b_n²),   k_n = nπ/L,  n odd
//! ```
//!
//!   which is a quadratic equation of q for every N. The limit loads are the largest and the smallest q of
//!   N between Euler's load and four times that.
//!
//! The strips have free sides, and are narrow: D' = B(1-ν_b²), which with hinges and ν = 1/3 is E h³/12.

use std::f64::consts::PI;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{Material, Pins};
use rumple::model::Potential;
use rumple::num::real;
use rumple::sheet::Sheet;
use rumple::solve::Control;
use rumple::solve::continuation::{Continuation, Event, Point, Settings, System};

use super::meshes::Strip;
use super::shells::SHELL_HINGE;
use super::{Models, Outcome, Sample, mechanics};

const LENGTH: f64 = 20.0;
const WIDTH: f64 = 1.0;
const MATERIAL: Material = Material { young: 1e4, poisson: 1.0 / 3.0, thickness: 0.2 };
/// Rise of the arch at rest in units of twice the radius of gyration h/√12: below 1 it does not snap, beyond 2 it
/// leaves the symmetric branch.
const RISE: f64 = 1.5;
/// Shells of hinges: at rest as the mesh has them.
const MODELS: Models = SHELL_HINGE;

/// A strip under a load that is multiplied by the parameter.
pub struct Loaded {
    sheet: Arc<Sheet>,
    pins: Pins,
    /// The effect at a value of the parameter, as a scene lists it.
    load: fn(f64) -> String,
}

impl Loaded {
    fn potential(&self, parameter: f64) -> Outcome<Potential> {
        let load = (self.load)(parameter);
        mechanics(
            &self.sheet,
            &MATERIAL,
            &[MODELS.stretching, MODELS.bending, &load],
            self.pins.clone(),
        )
    }
}

/// Bending rigidity of a narrow strip, per width.
fn rigidity() -> f64 {
    let poisson = MODELS_POISSON;
    MATERIAL.bending_rigidity() * (1.0 - poisson * poisson)
}

/// Poisson's ratio of hinges.
const MODELS_POISSON: f64 = -1.0 / 3.0;

/// A strip of so many rows of triangles with the heights z(x); the second end is free to slide along x, or not.
fn strip(rows: usize, slides: bool, z: impl Fn(f64) -> f64) -> Outcome<(Arc<Sheet>, Pins)> {
    let flat = Strip { length: LENGTH, width: WIDTH, rows, extra: 0.0 }.mesh()?;
    let lift = |x: &Vec3| Vec3::new(x.x, x.y, z(x.x));
    let sheet = Sheet::new(flat.rest().iter().map(lift).collect(), flat.triangles().to_vec())?;
    let ends = |x: &Vec3| (x.x < 1e-9, x.x > LENGTH - 1e-9);
    let fixed = |x: &Vec3| {
        let (first, second) = ends(x);
        [first || second && !slides, false, first || second]
    };
    let mut pins: Pins = flat.rest().iter().map(fixed).collect();
    pins[rows / 2][1] = true;
    Ok((Arc::new(sheet), pins))
}

/// Euler's load per width.
fn euler() -> f64 {
    PI * PI * rigidity() / (LENGTH * LENGTH)
}

/// What Q1 finds.
pub struct Column {
    /// The load at which the straight branch is left, in units of Euler's.
    pub critical: Sample,
    /// `P/P_c - 1` at an amplitude of some L/5, against the elastica.
    pub beyond: Sample,
    /// Negative eigenvalues: of the straight column below the load and above it, and of the bent one.
    pub negative: [usize; 3],
}

/// Q1 on a strip of so many rows of triangles.
pub fn column(rows: usize) -> Outcome<Column> {
    let (sheet, pins) = strip(rows, true, |_| 0.0)?;
    let load = |share: f64| {
        let force = -share * euler();
        let end = LENGTH - 1e-9;
        format!(
            "kind = 'load'\nwhere = {{ half-space = {{ point = [{end}, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }} }}\n\
             force = {{ per-length = [{force:e}, 0.0, 0.0] }}"
        )
    };
    let family = Loaded { sheet: Arc::clone(&sheet), pins, load };
    let rest = sheet.rest().to_vec();
    let potential = family.potential(0.0)?;
    let settings = Settings::over(0.0..=1.2, potential.mechanics());
    let settings = Settings { longest_step: 0.5, tolerance: 1e-9, ..settings };
    let control = Control::default();
    let mut branch =
        Continuation::new(move |p| family.potential(p), (rest, 0.0), true, settings, &control)?;
    let straight = points(&mut branch, |_| false)?;
    let at = straight.iter().position(|p| matches!(p.event, Event::Bifurcation(_)));
    let at = at.ok_or("the straight branch has no bifurcation")?;
    let critical = &straight[at];
    let high = |point: &Point| point.at.x.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
    let mut bent = branch.switch(critical, 0, false)?;
    bent.extend(points(&mut branch, |point| high(point) > LENGTH / 5.0)?);
    let last = bent.last().ok_or("the column does not bend")?;
    let above = straight.get(at + 1).ok_or("the straight branch ends at its bifurcation")?;
    let computed = last.parameter / critical.parameter - 1.0;
    Ok(Column {
        critical: Sample::new(&sheet, critical.parameter, 1.0),
        beyond: Sample::new(&sheet, computed, elastica(high(last) / LENGTH) - 1.0),
        negative: [straight[at - 1].negative, above.negative, last.negative],
    })
}

/// The points of a branch from here to its end, or to the first that is `enough`.
pub fn points<S: System>(
    branch: &mut Continuation<S>,
    enough: impl Fn(&Point) -> bool,
) -> Result<Vec<Point>, S::Error> {
    let mut all = Vec::new();
    while !branch.has_ended() && !all.last().is_some_and(&enough) && all.len() < MAX_POINTS {
        all.extend(branch.advance()?);
    }
    Ok(all)
}

/// Most points of a branch.
const MAX_POINTS: usize = 200;

/// P/P_E of the elastica whose amplitude is `share` of its length.
fn elastica(share: f64) -> f64 {
    // K(k) by the arithmetic-geometric mean.
    let complete = |k: f64| {
        let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
        for _ in 0..40 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        0.5 * PI / a
    };
    let (mut low, mut high) = (0.0, 0.8);
    for _ in 0..100 {
        let k = 0.5 * (low + high);
        if k / complete(k) < share { low = k } else { high = k }
    }
    (2.0 * complete(low) / PI).powi(2)
}

/// What Q2 finds.
pub struct Arch {
    /// The loads at which it snaps, down and back.
    pub limits: [Sample; 2],
    /// Negative eigenvalues on the three parts of the branch.
    pub negative: [usize; 3],
}

/// The load per area in units of which the arch is loaded: that of one sine, `π k⁴ D' r/2`.
fn unit() -> f64 {
    let k = PI / LENGTH;
    0.5 * PI * k.powi(4) * rigidity() * gyration()
}

/// h/√12.
fn gyration() -> f64 {
    MATERIAL.thickness / 12.0f64.sqrt()
}

/// Q2 on a strip of so many rows of triangles.
pub fn arch(rows: usize) -> Outcome<Arch> {
    let rise = 2.0 * RISE * gyration();
    let (sheet, pins) = strip(rows, false, |x| rise * (PI * x / LENGTH).sin())?;
    let load = |load: f64| super::area_load(-load * unit());
    let family = Loaded { sheet: Arc::clone(&sheet), pins, load };
    let potential = family.potential(0.0)?;
    let settings = Settings { tolerance: 1e-9, ..Settings::over(0.0..=3.0, potential.mechanics()) };
    let control = Control::default();
    let rest = sheet.rest().to_vec();
    let mut branch =
        Continuation::new(move |p| family.potential(p), (rest, 0.0), true, settings, &control)?;
    let all = points(&mut branch, |_| false)?;
    let folds: Vec<usize> = (0..all.len()).filter(|&k| all[k].event == Event::Fold).collect();
    let [down, back] = folds[..] else { return Err(format!("{} folds", folds.len()).into()) };
    let exact = limit_loads(rise);
    let sample = |k: usize, exact: f64| Sample::new(&sheet, all[k].parameter, exact);
    Ok(Arch {
        limits: [sample(down, exact[0]), sample(back, exact[1])],
        negative: [all[down - 1].negative, all[down + 1].negative, all[back + 1].negative],
    })
}

/// The two limit loads of an arch of this rise, in units of [`unit`].
fn limit_loads(rise: f64) -> [f64; 2] {
    const STEPS: u32 = 20_000;
    let stretching = MATERIAL.young * MATERIAL.thickness;
    // The roots q of the quadratic equation at the thrust N.
    let loads = |thrust: f64| {
        let (mut square, mut linear, mut constant) = (0.0, 0.0, -thrust);
        for n in (1..40).step_by(2).map(real) {
            let k = n * PI / LENGTH;
            let stiffness = rigidity() * k.powi(4);
            let at_rest = if n == 1.0 { rise } else { 0.0 };
            let (free, load) = (stiffness * at_rest, 4.0 / (n * PI));
            let resists = stiffness - thrust * k * k;
            let (amplitude, change) = (free / resists, load / resists);
            let share = 0.25 * stretching * k * k;
            square -= share * change * change;
            linear += 2.0 * share * amplitude * change;
            constant += share * (at_rest * at_rest - amplitude * amplitude);
        }
        let root = (linear * linear - 4.0 * square * constant).sqrt();
        [root, -root].map(|root| (root - linear) / (2.0 * square) / unit())
    };
    let (mut largest, mut smallest) = (0.0f64, f64::INFINITY);
    for step in 1..STEPS {
        let found = loads(euler() * (1.0 + 3.0 * f64::from(step) / f64::from(STEPS)));
        for load in found.into_iter().filter(|load| load.is_finite()) {
            (largest, smallest) = (largest.max(load), smallest.min(load));
        }
    }
    [largest, smallest]
}
