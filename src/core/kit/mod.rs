//! Tests for any effect: derivatives against differences, threads, and what it changes under.
//!
//! As `rumple plugin validate` does for laws. [`examine`] inspects the energies, constraints, transports and internal
//! variables of an effect on a sheet of yours, crumpled and unevenly grown; the report lists faults in words, and what
//! the effect is invariant under or conserves, for you to compare with what it should. An effect that
//! needs species is given some by [`examine_with`]:
//!
//! ```
//! # use rumple_core as rumple;
//! # use std::sync::Arc;
//! use rumple::effects::Diffusion;
//! use rumple::kinetics::Location;
//! use rumple::kit::{examine_with, synthetic_law};
//! # use rumple::sheet::{Shape, generate};
//! # let sheet = Arc::new(generate(&Shape::Disc { radius: 3.0 }, 60, 1)?);
//!
//! let diffusion = Diffusion::of("c", None);
//! let kinetics = synthetic_law(&["c"]);
//! let report = examine_with(&diffusion, &sheet, None, Some((&kinetics, Location::Vertex)))?;
//! assert_eq!(report.faults, Vec::<String>::new());
//! assert!(report.conserves_totals && report.keeps_constants);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! For an effect with an energy:
//!
//! ```
//! # use rumple_core as rumple;
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

mod contact;
mod energy;
mod internal_variables;
mod transport;

use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Vec3;
use crate::effects::{
    EffectContext, EffectError, EffectParts, EffectSpec, Material, MaterialField, Measure,
};
use crate::kinetics::{Descriptor, Location, Species};
use crate::model::ModelError;
use crate::sheet::Sheet;

/// Displacements of the crumpled shape, in mean edge lengths.
const CRUMPLING_DISPLACEMENT: f64 = 0.1;
/// Steps of differences, in mean edge lengths; the errors of central ones are of second order.
const DIFFERENCE_STEP: f64 = 1e-5;
/// Relative error of a derivative beyond which it counts as wrong.
const DERIVATIVE_TOLERANCE: f64 = 1e-5;
/// Relative size below which a change counts as round-off.
const ROUND_OFF: f64 = 1e-9;
/// The times at which an effect is inspected.
const INSPECTION_TIMES: [f64; 2] = [0.0, 0.7];

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
    /// Whether transports change no total: `Σ A_i c_i` with the current areas of vertices (thirds) or faces, and
    /// for amounts per rest area `Σ A⁰_i C_i`.
    pub conserves_totals: bool,
    /// Whether transports leave a constant density alone: c = 1, and for amounts per rest area C = A/A⁰.
    pub keeps_constants: bool,
}

/// Why an effect could not be inspected.
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

/// Inspects the energies, constraints, transports and internal variables of `effect` on `sheet`, without species.
///
/// # Errors
/// If the effect cannot be built there.
pub fn examine(
    effect: &dyn EffectSpec,
    sheet: &Arc<Sheet>,
    material: Option<&Material>,
) -> Result<Report, KitError> {
    examine_with(effect, sheet, material, None)
}

/// As [`examine`], with the species of a law ([`synthetic_law`] makes one) and where they live.
///
/// Values are taken as amounts per current area, and also as amounts per rest area where the effect can be
/// built for them.
///
/// # Errors
/// If the effect cannot be built there.
pub fn examine_with(
    effect: &dyn EffectSpec,
    sheet: &Arc<Sheet>,
    material: Option<&Material>,
    kinetics: Option<(&Descriptor, Location)>,
) -> Result<Report, KitError> {
    examine_on(effect, sheet, material.map(MaterialField::from).as_ref(), kinetics)
}

/// As [`examine_with`], with a material that may differ from triangle to triangle.
///
/// # Errors
/// If the effect cannot be built there.
pub fn examine_on(
    effect: &dyn EffectSpec,
    sheet: &Arc<Sheet>,
    material: Option<&MaterialField>,
    kinetics: Option<(&Descriptor, Location)>,
) -> Result<Report, KitError> {
    let measure = Measure::Concentration;
    let varying = material.filter(|material| !material.is_uniform());
    let largest = material.map(MaterialField::largest);
    let material = largest.as_ref();
    let context = EffectContext { sheet, material, varying, kinetics, measure, read: None };
    let built = effect.build(&context)?;
    let mut report = Report {
        translation_invariant: true,
        rotation_invariant: true,
        zero_at_rest: true,
        conserves_totals: true,
        keeps_constants: true,
        ..Report::default()
    };
    if built.parts() == EffectParts::default() {
        report.faults.push(NO_CONTRIBUTION.into());
    }
    let declared = effect.needs().out_of_plane.is_some();
    if !declared && built.pins.iter().flatten().any(|fixed| fixed[2]) {
        report.faults.push(UNDECLARED_Z_ACTION.into());
    }
    for term in built.energies {
        energy::of_energy(&mut report, term, sheet, (declared, false))?;
    }
    for term in built.constraints {
        energy::of_energy(&mut report, term, sheet, (declared, true))?;
    }
    for term in &built.transports {
        transport::of_transport(&mut report, term, sheet, &context);
    }
    for term in &built.internal {
        internal_variables::of_internal(&mut report, &**term, sheet)?;
    }
    if !built.transports.is_empty() {
        // An effect may refuse amounts.
        let context = EffectContext { measure: Measure::Amount, ..context };
        for term in effect.build(&context).iter().flat_map(|built| &built.transports) {
            transport::of_transport(&mut report, term, sheet, &context);
        }
    }
    // One fault at several times is one.
    let mut seen = BTreeSet::new();
    report.faults.retain(|fault| seen.insert(fault.clone()));
    Ok(report)
}

/// A law of species that do not react, to examine effects with: each has the diffusion coefficient 1.
#[must_use]
pub fn synthetic_law(species: &[&str]) -> Descriptor {
    let species = species.iter().map(|name| Species { diffusion: 1.0, ..Species::named(*name) });
    Descriptor { species: species.collect(), ..Descriptor::named("kit.made-up", "made-up") }
}

/// The fault of an effect without effect.
const NO_CONTRIBUTION: &str = "it brings nothing: no energy, fixed or prescribed positions, constraint, growth, transport, held value or internal \
                       variable";

/// The fault of an effect that does in planar scenes what is never shown.
const UNDECLARED_Z_ACTION: &str = "it acts along z on a sheet that lies in a plane z = const, and does not declare it: see \
     Needs::out_of_plane";

/// A crumpled shape of the sheet, and the generator in its state after it.
fn crumpled(sheet: &Sheet, edge: f64) -> (Vec<Vec3>, ChaCha8Rng) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let crumple = random_vectors(&mut random, sheet.vertex_count());
    (moved(sheet.rest(), &crumple, CRUMPLING_DISPLACEMENT * edge), random)
}

fn random_vectors(random: &mut ChaCha8Rng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..=1.0))).collect()
}

/// What `evaluate` gives on that many threads.
fn on_threads<T: Send>(threads: usize, evaluate: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(evaluate),
        Err(_) => evaluate(),
    }
}

/// Whether an error is beyond its limit; NaN is.
fn exceeds(error: f64, limit: f64) -> bool {
    !matches!(error.partial_cmp(&limit), Some(Ordering::Less | Ordering::Equal))
}

fn finite(a: &[Vec3]) -> bool {
    a.iter().all(|v| v.iter().all(|v| v.is_finite()))
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

/// The largest length; NaN if one is.
fn largest(a: &[Vec3]) -> f64 {
    a.iter().map(|v| v.norm()).fold(0.0, |a: f64, b| if a.is_nan() || a >= b { a } else { b })
}
