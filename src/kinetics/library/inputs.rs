//! The inputs of a call as the boundary takes them: copies that are watched, or borrowed columns.

use std::cell::Cell;
use std::ptr;

use rumple_plugin_abi as abi;
use smallvec::SmallVec;

use crate::KineticsError;
use crate::batch::{Batch, Column};
use crate::descriptor::Descriptor;

/// Copies of input columns: species, signals, parameters; contiguous, or one value for all points.
pub(super) struct Inputs {
    count: usize,
    data: Vec<f64>,
    columns: SmallVec<[abi::Column; 8]>,
    species: usize,
    signals: usize,
    parameters: usize,
}

thread_local! {
    /// Room for the copies of one call, used again for the next: it stays in the cache.
    static SCRATCH: Cell<Vec<f64>> = const { Cell::new(Vec::new()) };
}

impl Drop for Inputs {
    fn drop(&mut self) {
        if self.data.capacity() > 0 {
            SCRATCH.set(std::mem::take(&mut self.data));
        }
    }
}

impl Inputs {
    pub(super) fn new(batch: &Batch<'_>) -> Self {
        let all = || batch.inputs().chain(batch.parameters);
        let length = |column: &Column<'_>| if column.parts().1 == 0 { 1 } else { batch.count };
        let mut data = SCRATCH.take();
        data.clear();
        data.reserve(all().map(length).sum());
        let mut starts: SmallVec<[_; 8]> = SmallVec::new();
        for column in all() {
            let (values, stride) = column.parts();
            starts.push((data.len(), stride.min(1)));
            match stride {
                0 => data.extend(values.first()),
                1 => data.extend_from_slice(&values[..batch.count]),
                _ => data.extend((0..batch.count).map(|point| column.at(point))),
            }
        }
        // Pointers that may be written through, for plugins that do what they must not.
        let base = data.as_mut_ptr();
        let column = |(start, stride)| {
            // SAFETY: within the vector, or one past its end where there are no points.
            abi::Column { data: unsafe { base.add(start) }.cast_const(), stride }
        };
        let columns = starts.into_iter().map(column).collect();
        Self {
            count: batch.count,
            data,
            columns,
            species: batch.species.len(),
            signals: batch.signals.len(),
            parameters: batch.parameters.len(),
        }
    }

    /// The caller's own columns, for a call that is not watched.
    pub(super) fn borrowed(batch: &Batch<'_>) -> Self {
        let borrow = |column: &Column<'_>| {
            let (data, stride) = column.parts();
            abi::Column { data: data.as_ptr(), stride }
        };
        Self {
            count: batch.count,
            data: Vec::new(),
            columns: batch.inputs().chain(batch.parameters).map(borrow).collect(),
            species: batch.species.len(),
            signals: batch.signals.len(),
            parameters: batch.parameters.len(),
        }
    }

    pub(super) fn raw(&self) -> abi::Batch {
        let (signals, parameters) = (self.species, self.species + self.signals);
        abi::Batch {
            size: size_of::<abi::Batch>(),
            count: self.count,
            species: self.columns.as_ptr(),
            species_count: self.species,
            signals: self.columns[signals..].as_ptr(),
            signal_count: self.signals,
            parameters: if self.parameters == 0 {
                ptr::null()
            } else {
                self.columns[parameters..].as_ptr()
            },
            parameter_count: self.parameters,
        }
    }

    /// Whether the copies are still what they were.
    pub(super) fn check(
        &self,
        descriptor: &Descriptor,
        call: &'static str,
        batch: &Batch<'_>,
    ) -> Result<(), KineticsError> {
        let mut start = 0;
        for (number, column) in batch.inputs().chain(batch.parameters).enumerate() {
            let stride = column.parts().1;
            let length = if stride == 0 { self.count.min(1) } else { self.count };
            let copy = &self.data[start..start + length];
            start += length;
            let changed = match stride {
                1 => {
                    let pairs = copy.iter().zip(column.parts().0);
                    pairs.fold(0, |all, (a, b)| all | (a.to_bits() ^ b.to_bits())) != 0
                }
                _ => copy.iter().enumerate().any(|(k, a)| a.to_bits() != column.at(k).to_bits()),
            };
            if !changed {
                continue;
            }
            let differs = |k: &usize| copy[*k].to_bits() != column.at(*k).to_bits();
            let point = (0..length).find(differs).unwrap_or(0);
            let parameters = descriptor.parameters.iter().map(|p| p.name.as_str());
            let names = descriptor.input_names().take(self.species + self.signals);
            return Err(KineticsError::ChangedInput {
                plugin: descriptor.name.clone(),
                call,
                input: names.chain(parameters).nth(number).unwrap_or("?").to_owned(),
                location: batch.location.noun(),
                point: batch.first + point,
                before: column.at(point),
                after: copy[point],
            });
        }
        Ok(())
    }
}
