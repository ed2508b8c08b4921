//! `[output]`: what is written, how often, in which form.

use serde::{Deserialize, Serialize};

use crate::num::checked::Positive;
use crate::output::Compression;

/// The table `[output]`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// Time between two frames; without it only the first and the last state are written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<Positive>,
    /// Fields to write beside the positions; which there are depends on effects and kinetics.
    #[serde(default)]
    pub fields: Vec<String>,
    /// File format of the frames.
    #[serde(default)]
    pub format: Format,
    /// Compression of the frames.
    #[serde(default)]
    pub compression: Compression,
}

/// File format of the frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// VTK XML unstructured grid.
    #[default]
    Vtu,
}
