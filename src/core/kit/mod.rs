//! Tests for any effect: derivatives against differences, threads, and what it changes under.
//!
//! As `rumple plugin validate` does for laws. [`examine`] inspects the energies, constraints, transports and internal
//! variables of an effect on a sheet of yours, crumpled and unevenly grown; the report lists faults in words, and what
//! the effect is invariant under or conserves, for you to compare with what it should. An effect that
//! needs species is given some by [`examine_with_species`]:
//!
//! ```
//! # use rumple_core as rumple;
//! # use std::sync::Arc;
//! use rumple::effects::Diffusion;
//! use rumple::kinetics::Location;
//! use rumple::kit::{examine_with_species, synthetic_law};
//! # use rumple::sheet::{SheetShape, generate};
//! # let sheet = Arc::new(generate(&SheetShape::Disc { radius: 3.0 }, 60, 1)?);
//!
//! let diffusion = Diffusion::new("c", None);
//! let kinetics = synthetic_law(&["c"]);
//! let report = examine_with_species(&diffusion, &sheet, None, Some((&kinetics, Location::Vertex)))?;
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
//! # use rumple::sheet::{SheetShape, generate};
//!
//! let sheet = Arc::new(generate(&SheetShape::Disc { radius: 3.0 }, 60, 1)?);
//! let material = Material { young: 10.0, poisson: 0.3, thickness: 0.1 };
//! let report = examine(&Stretching::default(), &sheet, Some(&material))?;
//! assert_eq!(report.faults, Vec::<String>::new());
//! assert!(report.translation_invariant && report.rotation_invariant && report.zero_at_rest);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod contact;
mod energy;
mod internal_variables;
mod report;
mod transport;

pub use report::Report;

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::effects::{
    EffectContext, EffectError, EffectParts, EffectSpec, Material, MaterialField, Measure,
};
use crate::kinetics::{Descriptor, Location, Species};
use crate::kit::report::UNDECLARED_Z_ACTION;
use crate::model::ModelError;
use crate::sheet::Sheet;

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
    examine_with_species(effect, sheet, material, None)
}

/// As [`examine`], with the species of a law ([`synthetic_law`] makes one) and where they live.
///
/// Values are taken as amounts per current area, and also as amounts per rest area where the effect can be
/// built for them.
///
/// # Errors
/// If the effect cannot be built there.
pub fn examine_with_species(
    effect: &dyn EffectSpec,
    sheet: &Arc<Sheet>,
    material: Option<&Material>,
    kinetics: Option<(&Descriptor, Location)>,
) -> Result<Report, KitError> {
    examine_on(effect, sheet, material.map(MaterialField::from).as_ref(), kinetics)
}

/// As [`examine_with_species`], with a material that may differ from triangle to triangle.
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
