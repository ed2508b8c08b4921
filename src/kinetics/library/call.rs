//! The status and report of a call as an outcome.

use rumple_plugin_abi as abi;

use crate::descriptor::Location;
use crate::{KineticsError, Outcome, Site, Unreliable};

/// Bytes that a plugin has for a message.
const MESSAGE_CAPACITY: usize = 1024;

/// One call into a plugin: what to say if it fails.
pub(super) struct Call<'a> {
    pub(super) plugin: &'a str,
    pub(super) name: &'static str,
    pub(super) location: Location,
    /// Number of the first point of the batch.
    pub(super) first: usize,
}

impl<'a> Call<'a> {
    /// A call that has no points.
    pub(super) fn without_points(plugin: &'a str, name: &'static str) -> Self {
        Self { plugin, name, location: Location::Vertex, first: 0 }
    }

    /// Gives the function a report to write to and turns its status into an outcome.
    pub(super) fn run(&self, function: impl FnOnce(*mut abi::Report) -> abi::Status) -> Outcome {
        // Without an answer to a retry, halve the step: what adaptive integrators do as well.
        const DEFAULT_FACTOR: f64 = 0.5;
        let mut buffer = [0_u8; MESSAGE_CAPACITY];
        let mut report = abi::Report {
            size: size_of::<abi::Report>(),
            message: buffer.as_mut_ptr(),
            capacity: buffer.len(),
            length: 0,
            point: abi::NO_POINT,
            factor: DEFAULT_FACTOR,
        };
        let status = function(&raw mut report);
        let (length, point, factor) = (report.length, report.point, report.factor);
        if status == abi::Status::OK {
            return Ok(None);
        }

        let text = String::from_utf8_lossy(&buffer[..length.min(buffer.len())]).trim().to_owned();
        let message = if text.is_empty() { "no reason is given".to_owned() } else { text };
        let number = (point != abi::NO_POINT).then(|| self.first.saturating_add(point));
        let plugin = self.plugin.to_owned();
        let point = number.map(|point| {
            let location = self.location.noun();
            Box::new(Site { location, point, inputs: Vec::new(), position: None })
        });
        let call = self.name;
        match status {
            abi::Status::UNRELIABLE => Ok(Some(Unreliable { message, point: number })),
            abi::Status::RETRY => {
                let usable = factor > 0.0 && factor < 1.0;
                let factor = if usable { factor } else { DEFAULT_FACTOR };
                Err(KineticsError::Retry { plugin, call, point, factor, message })
            }
            abi::Status::FATAL => Err(KineticsError::Failed { plugin, call, point, message }),
            abi::Status(other) => {
                let message = format!("it returned the unknown status {other} ({message})");
                Err(KineticsError::Failed { plugin, call, point, message })
            }
        }
    }
}
