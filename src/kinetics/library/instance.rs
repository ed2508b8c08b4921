//! A loaded law with its parameters, and the calls to it, which borrow the caller's own columns.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::ptr;
use std::sync::{Arc, OnceLock};

use smallvec::SmallVec;

use super::Library;
use super::call::Call;
use crate::batch::{Batch, Column, UNWRITTEN_BITS};
use crate::descriptor::Descriptor;
use crate::error::KineticsError;
use crate::{Kinetics, Outcome, Quantity, Site, differences, parameters};
use rumple_plugin_abi as abi;

/// The law of a loaded plugin with its parameters.
#[derive(Debug)]
pub struct PluginKinetics {
    library: Arc<Library>,
    parameters: Vec<f64>,
    typical: OnceLock<Vec<f64>>,
    instance: *mut c_void,
    /// Whether parameters that differ from point to point are handed over as columns.
    pub(super) takes_parameter_columns: bool,
}

// SAFETY: the boundary demands that instances may be used from any number of threads at once.
unsafe impl Send for PluginKinetics {}
// SAFETY: as above.
unsafe impl Sync for PluginKinetics {}

impl Drop for PluginKinetics {
    fn drop(&mut self) {
        if let Some(destroy) = self.library.destroy {
            // SAFETY: made by `create` of the same library, and never used again.
            unsafe { destroy(self.instance) }
        }
    }
}

impl Library {
    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// An unknown parameter, one out of bounds, or a failure that the plugin reports.
    pub fn instantiate(
        self: &Arc<Self>,
        given: &BTreeMap<String, f64>,
    ) -> Result<PluginKinetics, KineticsError> {
        PluginKinetics::new(self, parameters::resolve(&self.descriptor, given)?)
    }
}

impl PluginKinetics {
    /// An instance with all its parameters, in the order of the descriptor.
    pub(super) fn new(library: &Arc<Library>, parameters: Vec<f64>) -> Result<Self, KineticsError> {
        let mut instance = ptr::null_mut();
        Call::without_points(&library.descriptor.name, "create").run(|report| {
            // SAFETY: as many parameters as the descriptor has; `instance` is ours to be written.
            library.create.map_or(abi::Status::FATAL, |create| unsafe {
                create(parameters.as_ptr(), parameters.len(), &raw mut instance, report)
            })
        })?;
        let takes_parameter_columns = library.descriptor.capabilities.parameter_fields;
        Ok(Self {
            library: Arc::clone(library),
            parameters,
            typical: OnceLock::new(),
            instance,
            takes_parameter_columns,
        })
    }

    /// The library that the law comes from.
    #[must_use]
    pub fn library(&self) -> &Arc<Library> {
        &self.library
    }

    /// One instance for every stretch of points with the same parameters.
    fn by_stretches(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let mut warning = None;
        let mut from = 0;
        while from < batch.count {
            let until = |end: usize, column: &Column<'_>| column.same_until(from, end);
            let to = batch.parameters.iter().fold(batch.count, until);
            let parameters = batch.parameters.iter().map(|column| column.at(from)).collect();
            let instance = Self::new(&self.library, parameters)?;
            let mut values: Vec<_> = values.iter_mut().map(|c| &mut c[from..to]).collect();
            let mut partials: Vec<_> = partials.iter_mut().map(|c| &mut c[from..to]).collect();
            let outcome = batch.with_part(from, to - from, |part| {
                let part = Batch { parameters: &[], ..*part };
                instance.call(quantity, &part, &mut values, &mut partials)
            })?;
            warning = warning.or(outcome);
            from = to;
        }
        Ok(warning)
    }

    /// Calls the plugin with columns that were checked.
    fn call(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let borrow = |column: &Column<'_>| {
            let (data, stride) = column.parts();
            abi::Column { data: data.as_ptr(), stride }
        };
        let inputs: SmallVec<[abi::Column; 8]> =
            batch.inputs().chain(batch.parameters).map(borrow).collect();
        // What it leaves unwritten must not pass for a result: numbers of an earlier call would.
        let clear =
            |column: &mut &mut [f64]| column[..batch.count].fill(f64::from_bits(UNWRITTEN_BITS));
        values.iter_mut().for_each(clear);
        partials.iter_mut().for_each(clear);
        let raw = |columns: &mut [&mut [f64]]| -> SmallVec<[abi::ColumnMut; 8]> {
            let raw = |c: &mut &mut [f64]| abi::ColumnMut { data: c.as_mut_ptr(), stride: 1 };
            columns.iter_mut().map(raw).collect()
        };
        let name = quantity.call(!partials.is_empty());
        let (values, partials) = (raw(values), raw(partials));
        let call = Call {
            plugin: &self.library.descriptor.name,
            name,
            location: batch.location,
            first: batch.first,
        };
        let outcome = call.run(|report| {
            let (batch, values) = (raw_batch(batch, &inputs), values.as_ptr());
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe {
                match self.library.functions(quantity) {
                    (Some(function), _) if partials.is_empty() => {
                        function(self.instance, &batch, values, report)
                    }
                    (_, Some(function)) if !partials.is_empty() => {
                        function(self.instance, &batch, values, partials.as_ptr(), report)
                    }
                    _ => abi::Status::FATAL,
                }
            }
        });
        outcome.map_err(|mut error| {
            if let Some(site) = error.site_mut() {
                let point = site.point.saturating_sub(batch.first);
                let descriptor = &self.library.descriptor;
                *site = Site::new(batch, descriptor, &descriptor.signals, point);
            }
            error
        })
    }
}

/// `batch` as the boundary takes it, with its columns: species, signals, parameters.
fn raw_batch(batch: &Batch<'_>, columns: &[abi::Column]) -> abi::Batch {
    let (species, signals) = (batch.species.len(), batch.signals.len());
    let none = batch.parameters.is_empty();
    abi::Batch {
        size: size_of::<abi::Batch>(),
        count: batch.count,
        species: columns.as_ptr(),
        species_count: species,
        signals: columns[species..].as_ptr(),
        signal_count: signals,
        parameters: if none { ptr::null() } else { columns[species + signals..].as_ptr() },
        parameter_count: batch.parameters.len(),
    }
}

impl Kinetics for PluginKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.library.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let library = &self.library;
        if !quantity.is_given(&library.descriptor) {
            quantity.write_neutral(values, partials);
            return Ok(None);
        }
        if !partials.is_empty() && library.functions(quantity).1.is_none() {
            return differences::partials(self, quantity, batch, values, partials);
        }
        // Pointers to the columns are given away.
        quantity.check_shapes(&library.descriptor, batch, values, partials)?;
        if batch.parameters.is_empty() || self.takes_parameter_columns {
            self.call(quantity, batch, values, partials)
        } else {
            self.by_stretches(quantity, batch, values, partials)
        }
    }

    fn set_typical(&self, typical: &[f64]) {
        self.typical.get_or_init(|| typical.to_vec());
    }

    fn typical(&self) -> Option<&[f64]> {
        self.typical.get().map(Vec::as_slice)
    }
}
