//! The boundary between the engine and a kinetics plugin, as C types.
//!
//! A plugin is a shared library that exports one object, [`PluginTable`], under the name
//! [`ENTRY_SYMBOL`]. The table is data, not code: the engine reads magic, version and size before
//! it calls anything. [`ABI_MAJOR`] and [`ABI_MINOR`] must agree exactly; whole new abilities are
//! asked for by name with `get_extension`.
//!
//! What both sides promise:
//!
//! * The table and everything that it points to live and stay unchanged for as long as the
//!   process; a plugin is never unloaded.
//! * An instance may be used from several threads at once. A call depends on nothing but the
//!   parameters of the instance and the batch, and changes neither.
//! * No exception or panic crosses the boundary. A failure is a [`Status`] with a text in the
//!   [`Report`] of the caller.
//! * Text is UTF-8, given by start and length, without a terminating zero.
//! * Each side frees its own memory only.
#![no_std]

mod call;
mod descriptor;
mod feedback;
mod observables;

pub use call::{
    Batch, Column, ColumnMut, Create, Destroy, Evaluate, EvaluatePartials, GetExtension, NO_POINT,
    PluginTable, Report, Status,
};
pub use descriptor::{Capabilities, Descriptor, Location, Parameter, Signal, Species, Str};
pub use feedback::{FEEDBACK, Feedback};
pub use observables::{OBSERVABLES, Observable, Observables};

/// The same types as a header of C.
pub const C_HEADER: &str = include_str!("../include/rumple_plugin.h");

/// The name of the one exported symbol, a [`PluginTable`].
pub const ENTRY_SYMBOL: &str = "rumple_plugin_entry";

/// The first eight bytes of every table.
pub const MAGIC: [u8; 8] = *b"RUMPLE\x1a\n";

/// The version, which must agree exactly with that of the engine.
pub const ABI_MAJOR: u32 = 1;

/// The second part of the version, which must agree as well.
pub const ABI_MINOR: u32 = 1;
