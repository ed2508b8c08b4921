//! The extension `rumple.observables/1`: quantities of a law that are worth a picture.
//!
//! ```text
//! o_k(c, x)    a flux, a bound fraction, an activity: any number of species and signals
//! ```
//!
//! They change nothing in a run and are evaluated only for frames that ask for them.

use crate::call::Evaluate;
use crate::descriptor::Str;

/// The id to give to [`GetExtension`](crate::GetExtension); it answers with an [`Observables`].
pub const OBSERVABLES: &str = "rumple.observables/1";

/// An observable.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Observable {
    /// Name in scenes and results; same rule as for species.
    pub name: Str,
    /// Unit, in words; `1` for none.
    pub unit: Str,
    /// Description in one sentence.
    pub doc: Str,
}

impl Observable {
    /// A quantity of this name and unit.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { name: Str::new(name), unit: Str::new(unit), doc: Str::new(doc) }
    }
}

/// What a plugin answers to [`OBSERVABLES`].
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Observables {
    /// Bytes of this structure.
    pub size: usize,
    /// First observable.
    pub observables: *const Observable,
    /// How many.
    pub observable_count: usize,
    /// Bytes from one to the next.
    pub observable_stride: usize,
    /// Writes one column an observable, from the same inputs as the rates. Required.
    pub observe: Evaluate,
}
