//! A loaded law with its parameters, and the calls to it.
//!
//! The first calls, and later some, are watched: they get copies of their inputs, and what a plugin
//! writes to these is found; and they are made twice, which finds a plugin that gives something else
//! now and then. The others borrow the caller's own columns, which costs nothing.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::ptr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use smallvec::SmallVec;

use super::Library;
use super::call::Call;
use super::inputs::Inputs;
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
    calls: AtomicUsize,
    /// Whether parameters that differ from point to point are handed over as columns.
    pub(super) takes_parameter_columns: bool,
}

/// This many calls of an instance are watched for changed inputs, and after that every so many.
const WATCHED_CALLS: usize = 64;
const WATCH_INTERVAL: usize = 64;

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
        let calls = AtomicUsize::new(0);
        let takes_parameter_columns = library.descriptor.capabilities.parameter_fields;
        Ok(Self {
            library: Arc::clone(library),
            parameters,
            typical: OnceLock::new(),
            instance,
            calls,
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

    /// Calls the plugin with columns that were checked; twice, if the call is watched.
    fn call(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let calls = self.calls.fetch_add(1, Ordering::Relaxed);
        if calls >= WATCHED_CALLS && !calls.is_multiple_of(WATCH_INTERVAL) {
            return self.call_once(quantity, batch, values, partials, false);
        }
        let copies = |columns: &[&mut [f64]]| -> Vec<Vec<f64>> {
            columns.iter().map(|column| column[..batch.count].to_vec()).collect()
        };
        let (mut values_again, mut partials_again) = (copies(values), copies(partials));
        let warning = self.call_once(quantity, batch, values, partials, true)?;
        {
            let mut values: Vec<_> = values_again.iter_mut().map(|c| &mut c[..]).collect();
            let mut partials: Vec<_> = partials_again.iter_mut().map(|c| &mut c[..]).collect();
            self.call_once(quantity, batch, &mut values, &mut partials, true)?;
        }
        let first = values.iter().chain(partials.iter());
        for (output, (first, second)) in
            first.zip(values_again.iter().chain(&partials_again)).enumerate()
        {
            let differs = |(a, b): (&f64, &f64)| a.to_bits() != b.to_bits();
            if let Some(point) = first.iter().zip(second).position(differs) {
                let descriptor = &self.library.descriptor;
                let of_rates = quantity == Quantity::Rates && output < values.len();
                return Err(KineticsError::Unsteady {
                    plugin: descriptor.name.clone(),
                    call: quantity.call(!partials.is_empty()),
                    quantity: match of_rates {
                        true => quantity.describe(descriptor, false, output).into(),
                        false => format!("output {}", output + 1).into(),
                    },
                    location: batch.location.noun(),
                    point: batch.first + point,
                    first: first[point],
                    second: second[point],
                    how: "one call after the other",
                });
            }
        }
        Ok(warning)
    }

    /// One call, with copies of the inputs or with the caller's own.
    fn call_once(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
        watched: bool,
    ) -> Outcome {
        let inputs = if watched { Inputs::new(batch) } else { Inputs::borrowed(batch) };
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
            let (batch, values) = (inputs.raw(), values.as_ptr());
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
        if watched {
            inputs.check(&self.library.descriptor, name, batch)?;
        }
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

    fn with_parameters_as_instances(&self) -> Result<Option<Box<dyn Kinetics>>, KineticsError> {
        if !self.takes_parameter_columns {
            return Ok(None);
        }
        let mut twin = Self::new(&self.library, self.parameters.clone())?;
        twin.takes_parameter_columns = false;
        Ok(Some(Box::new(twin)))
    }
}
