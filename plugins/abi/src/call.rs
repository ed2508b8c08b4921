//! The table of functions (each may be null in C), and what passes through them.
//!
//! With n_s species c and n_x signal columns x, at every point of a batch:
//!
//! ```text
//! rates                   R_s(c, x)
//! rate partials           ∂R_s/∂c_j, ∂R_s/∂x_k     row s, column j, or n_s + k
//! length factor           Φ(c) > 0
//! length factor partials  ∂Φ/∂c_j
//! ```
//!
//! A batch is a structure of arrays. Values of one quantity at successive points are `stride`
//! numbers apart; stride 0 is one value for all points.

use core::ffi::c_void;

use crate::descriptor::{Descriptor, Str};

/// How a call ended.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status(pub i32);

impl Status {
    /// All outputs are written and good.
    pub const OK: Self = Self(0);
    /// All outputs are written, but the law was used outside the range that it was made for.
    pub const UNRELIABLE: Self = Self(1);
    /// Outputs are not usable; a time step shorter by `Report::factor` may succeed.
    pub const RETRY: Self = Self(2);
    /// Outputs are not usable and no other step will help.
    pub const FATAL: Self = Self(3);
}

/// [`Report::point`] where no point is to blame.
pub const NO_POINT: usize = usize::MAX;

/// Where a callee explains a status that is not [`Status::OK`]. The caller owns it and the buffer,
/// and fills in every field before the call.
#[repr(C)]
#[derive(Debug)]
pub struct Report {
    /// Bytes of this structure.
    pub size: usize,
    /// Buffer for a UTF-8 message.
    pub message: *mut u8,
    /// Bytes of the buffer.
    pub capacity: usize,
    /// Bytes written by the callee; 0 before the call.
    pub length: usize,
    /// Index within the batch of the first point to blame, or [`NO_POINT`] (as before the call).
    pub point: usize,
    /// With [`Status::RETRY`]: by what to multiply the step, in (0, 1); 0.5 before the call.
    pub factor: f64,
}

/// One input at successive points.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Value at the first point.
    pub data: *const f64,
    /// Numbers from one point to the next; 0 for one value for all points.
    pub stride: usize,
}

/// One output at successive points. It overlaps with no other output and with no input.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct ColumnMut {
    /// Value at the first point.
    pub data: *mut f64,
    /// Numbers from one point to the next, at least 1.
    pub stride: usize,
}

/// The inputs of a call at a batch of points.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Batch {
    /// Bytes of this structure.
    pub size: usize,
    /// How many points.
    pub count: usize,
    /// One column for each species of the descriptor.
    pub species: *const Column,
    /// How many species columns: as many as the descriptor has species.
    pub species_count: usize,
    /// One column for each scalar signal of the descriptor and three for each vector, in its order.
    pub signals: *const Column,
    /// How many signal columns; 0 in calls for the length factor, which depends on species alone.
    pub signal_count: usize,
    /// Where parameters differ from point to point: one column for each parameter of the
    /// descriptor, which take the place of the instance's values. Only for plugins with
    /// [`PARAMETER_FIELDS`](crate::Capabilities::PARAMETER_FIELDS); else null.
    pub parameters: *const Column,
    /// How many parameter columns: none, or as many as the descriptor has parameters.
    pub parameter_count: usize,
}

/// Makes an instance from `count` parameter values in the order of the descriptor and writes its
/// handle to `instance`. The handle may be null if the plugin needs none.
pub type Create = Option<
    unsafe extern "C" fn(
        parameters: *const f64,
        count: usize,
        instance: *mut *mut c_void,
        report: *mut Report,
    ) -> Status,
>;

/// Frees an instance.
pub type Destroy = Option<unsafe extern "C" fn(instance: *mut c_void)>;

/// Writes values: for rates one output column a species, for the length factor one in all.
pub type Evaluate = Option<
    unsafe extern "C" fn(
        instance: *const c_void,
        batch: *const Batch,
        values: *const ColumnMut,
        report: *mut Report,
    ) -> Status,
>;

/// Writes the values of [`Evaluate`] and their partial derivatives, row by row: for rates
/// `species_count` rows of `species_count + signal_count` columns, for the length factor one row
/// of `species_count`.
pub type EvaluatePartials = Option<
    unsafe extern "C" fn(
        instance: *const c_void,
        batch: *const Batch,
        values: *const ColumnMut,
        partials: *const ColumnMut,
        report: *mut Report,
    ) -> Status,
>;

/// A pointer to the extension of that name, or null. What it points to is fixed by the extension.
pub type GetExtension = Option<unsafe extern "C" fn(id: Str) -> *const c_void>;

/// What the plugin exports under [`ENTRY_SYMBOL`](crate::ENTRY_SYMBOL).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct PluginTable {
    /// [`MAGIC`](crate::MAGIC).
    pub magic: [u8; 8],
    /// [`ABI_MAJOR`](crate::ABI_MAJOR) of the plugin.
    pub abi_major: u32,
    /// [`ABI_MINOR`](crate::ABI_MINOR) of the plugin.
    pub abi_minor: u32,
    /// Bytes of this table as the plugin knows it.
    pub size: usize,
    /// What the plugin says about itself.
    pub descriptor: *const Descriptor,
    /// Required.
    pub create: Create,
    /// Required.
    pub destroy: Destroy,
    /// Required.
    pub rates: Evaluate,
    /// Required with `RATE_PARTIALS`, else null.
    pub rate_partials: EvaluatePartials,
    /// Required with `LENGTH_FACTOR`, else null.
    pub length_factor: Evaluate,
    /// Required with `LENGTH_FACTOR_PARTIALS`, else null.
    pub length_factor_partials: EvaluatePartials,
    /// May be null: no extensions.
    pub get_extension: GetExtension,
}
