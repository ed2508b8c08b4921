//! A law in another process.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::IsolatedLibrary;
use super::child::Asked;
use super::column_layout::ColumnLayout;
use super::memory::Lane;
use super::reply::{CallProblem, CreateRequest};
use crate::descriptor::Descriptor;
use crate::library::instance::keep_destroy_error;
use crate::{Batch, Kinetics, KineticsError, Outcome, Quantity};

/// The law of a plugin in a process of its own.
#[derive(Debug)]
pub struct IsolatedKinetics {
    library: Arc<IsolatedLibrary>,
    takes_parameter_columns: bool,
    parameters: Vec<f64>,
    /// Its number in the child.
    number: u64,
}

impl Drop for IsolatedKinetics {
    fn drop(&mut self) {
        let outcome =
            self.library.process.exchange_text("destroy", self.number, "", Some(self.descriptor()));
        if let Err(error) = outcome {
            keep_destroy_error(error);
        }
    }
}

impl IsolatedKinetics {
    /// An instance with all its parameters; with or without parameters as columns.
    pub(super) fn new(
        library: &Arc<IsolatedLibrary>,
        parameters: Vec<f64>,
        takes_parameter_columns: bool,
    ) -> Result<Self, KineticsError> {
        let process = &library.process;
        let bits = parameters.iter().map(|p| p.to_bits()).collect();
        let request = CreateRequest { parameters: bits, takes_parameter_columns };
        let text = serde_json::to_string(&request).map_err(|_| process.invalid_answer("create"))?;
        let answer = process.exchange_text("create", 0, &text, Some(library.descriptor()))?;
        let number = answer.parse().map_err(|_| process.invalid_answer("create"))?;
        Ok(Self { library: Arc::clone(library), takes_parameter_columns, parameters, number })
    }

    /// How the child's call ended, from the text behind the columns, if there is one.
    fn outcome(
        &self,
        lane: &mut Lane,
        columns_end: usize,
        (call, batch): (&'static str, &Batch<'_>),
    ) -> Outcome {
        if lane.head().text.load(Ordering::Relaxed) == 0 {
            return Ok(None);
        }
        let process = &self.library.process;
        let text = lane.read_behind(columns_end).map_err(|error| process.no_room(&error))?;
        let problem: CallProblem =
            serde_json::from_str(&text).map_err(|_| process.invalid_answer(call))?;
        problem.outcome(self.descriptor(), Some(batch))
    }
}

impl Kinetics for IsolatedKinetics {
    fn descriptor(&self) -> &Descriptor {
        self.library.descriptor()
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// A child that is gone is found by the next call.
    fn set_typical(&self, typical: &[f64]) {
        let text = serde_json::to_string(typical).unwrap_or_default();
        let process = &self.library.process;
        let _ = process.exchange_text("typical", self.number, &text, Some(self.descriptor()));
    }

    /// Copies the inputs to the child, has it call the law, and copies the outputs back.
    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        if !quantity.is_given(self.descriptor()) {
            quantity.write_neutral(values, partials);
            return Ok(None);
        }
        quantity.check_shapes(self.descriptor(), batch, values, partials)?;
        let call = quantity.call(!partials.is_empty());
        let parts = [
            batch.species.len(),
            batch.signals.len(),
            batch.parameters.len(),
            values.len(),
            partials.len(),
        ];
        let inputs = || batch.inputs().chain(batch.parameters);
        let vary: Vec<bool> = inputs().map(|column| column.parts().1 > 0).collect();
        let too_many = || self.library.process.no_room(&std::io::ErrorKind::OutOfMemory.into());
        let columns = ColumnLayout::new(vary.iter().copied(), parts[3] + parts[4], batch.count)
            .ok_or_else(too_many)?;
        let mut lane = self.library.process.lane();
        lane.room(columns.bytes).map_err(|error| self.library.process.no_room(&error))?;
        for (k, vary) in vary.iter().enumerate() {
            // SAFETY: within the room just made; it is our turn, and the lane is locked.
            unsafe { lane.data().cast::<u64>().add(k).write(u64::from(*vary)) };
        }
        for (column, place) in inputs().zip(&columns.inputs) {
            // SAFETY: as above.
            let room = unsafe { lane.values_mut(*place) };
            match column.parts() {
                (data, 0) => room[0] = data.first().copied().unwrap_or(0.0),
                _ => column.copy_to(0, room),
            }
        }
        let head = lane.head();
        for (place, count) in head.columns.iter().zip(parts) {
            place.store(count as u64, Ordering::Relaxed);
        }
        head.text.store(0, Ordering::Relaxed);
        let (location, first, count) = (batch.location, batch.first, batch.count);
        let asked = Asked { call, location, first, count, law: self.number };
        self.library.process.ask(&lane, &asked)?;
        let warning = self.outcome(&mut lane, columns.bytes, (call, batch))?;
        let out = values.iter_mut().map(|c| &mut **c).chain(partials.iter_mut().map(|c| &mut **c));
        for (out, place) in out.zip(&columns.outputs) {
            // SAFETY: as above; the child has answered.
            out[..count].copy_from_slice(unsafe { lane.values(*place) });
        }
        Ok(warning)
    }

    fn with_parameters_as_instances(&self) -> Result<Option<Box<dyn Kinetics>>, KineticsError> {
        if !self.takes_parameter_columns {
            return Ok(None);
        }
        let twin = Self::new(&self.library, self.parameters.clone(), false)?;
        Ok(Some(Box::new(twin)))
    }
}
