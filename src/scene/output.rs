//! `[output]`: what is written, how often, in which form.

use serde::{Deserialize, Serialize};

use crate::model::AtBoundary;
use crate::num::checked::Positive;
use crate::num::{Short, real};
use crate::output::Compression;

use super::time::Span;
use crate::document::{DocumentError, Node, Value, read};

/// Most frames of a run: more are a slip of the pen, and would fill a disc with files.
const MAX_FRAMES: f64 = 1e6;

/// The table `[output]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// Time between two frames; without it only the first and the last state are written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<Positive>,
    /// Fields to write beside the positions; which there are depends on effects and kinetics.
    #[serde(default)]
    pub fields: Vec<String>,
    /// The fields of curvature at the boundary.
    #[serde(default = "one_sided")]
    pub boundary: AtBoundary,
    /// Compression of the frames.
    #[serde(default)]
    pub compression: Compression,
    /// Whether a run ends with a viewer of its results, `report.html`.
    #[serde(default = "yes")]
    pub report: bool,
}

fn one_sided() -> AtBoundary {
    AtBoundary::OneSided
}

fn yes() -> bool {
    true
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            every: None,
            fields: Vec::new(),
            boundary: AtBoundary::OneSided,
            compression: Compression::default(),
            report: true,
        }
    }
}

impl OutputSpec {
    /// Refuses more frames than a run can have.
    pub(crate) fn check_frames(&self, span: &Span) -> Result<(), DocumentError> {
        let (Some(every), until) = (self.every, span.until.get()) else { return Ok(()) };
        let asked = until / every.get();
        let frames = span.max_steps.map_or(asked, |most| asked.min(real(most.get())));
        if frames > MAX_FRAMES {
            let message = format!(
                "every = {} to time.until = {} asks for {frames:.1e} frames; at most \
                 {MAX_FRAMES:e} are allowed",
                Short(every.get()),
                Short(until)
            );
            let least = Short(until / MAX_FRAMES);
            return Err(DocumentError::plain(message).help(format!("every = {least} or longer")));
        }
        span.check_multiples(every)
    }
}

/// Reads the table `[output]`. Its key `format` is gone; `"vtu"`, which resolved scenes gave it, is what frames are.
pub(super) fn read_output(mut node: Node) -> Result<OutputSpec, DocumentError> {
    match node.take("format") {
        Some((key, Node { value, .. })) if !matches!(&value, Value::String(name) if name == "vtu") =>
        {
            let problem = DocumentError::located(key.place, "`format` is gone: frames are `.vtu`");
            let help = "leave it out; `rumple view DIR` puts all frames into one file, `meshio convert` makes others";
            Err(problem.help(help))
        }
        _ => read(node),
    }
}
