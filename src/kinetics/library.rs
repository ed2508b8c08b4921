//! Kinetics from a shared library: the only file that knows dynamic loading; with its part
//! `read`, the only unsafe code of the engine.
//!
//! Everything that a library says is checked before it is believed, as far as it can be: a table
//! or pointer that lies about its own length cannot be told from an honest one. A library is never
//! unloaded.
#![allow(unsafe_code)]

mod call;
mod read;

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::Arc;

use rumple_plugin_abi as abi;

use super::batch::{Batch, Column};
use super::descriptor::{Descriptor, Location};
use super::error::KineticsError;
use super::{Kinetics, Outcome, differences, parameters};
use call::Call;

/// A loaded plugin: its description and its functions.
#[derive(Debug)]
pub struct Library {
    path: PathBuf,
    descriptor: Descriptor,
    create: abi::Create,
    destroy: abi::Destroy,
    rates: abi::Evaluate,
    rate_partials: Option<abi::EvaluatePartials>,
    length_factor: Option<abi::Evaluate>,
    length_factor_partials: Option<abi::EvaluatePartials>,
}

impl Library {
    /// Loads the plugin at a path and checks its table and descriptor.
    ///
    /// # Errors
    /// [`KineticsError`]: no such file, no library, no plugin, wrong magic or major version,
    /// truncated table, or a descriptor that makes no sense.
    pub fn load(path: &Path) -> Result<Arc<Self>, KineticsError> {
        let missing = || KineticsError::MissingFile { path: path.to_owned() };
        // A full path keeps the system from looking anywhere else for a file of this name.
        let path = path.canonicalize().map_err(|_| missing())?;
        if !path.is_file() {
            return Err(missing());
        }
        // SAFETY: runs the initialisers of the library: the user chose to trust it.
        let library = unsafe { libloading::Library::new(&path) }.map_err(|error| {
            KineticsError::NotALibrary { path: path.clone(), reason: error.to_string() }
        })?;
        // SAFETY: an address is only taken here; what it points to is read below.
        let entry = unsafe { library.get::<*const abi::PluginTable>(abi::ENTRY_SYMBOL) }
            .map(|symbol| *symbol)
            .ok()
            .filter(|table| !table.is_null())
            .ok_or_else(|| KineticsError::NotAPlugin { path: path.clone() })?;
        // Function pointers are kept from here on: the library must stay mapped for good.
        std::mem::forget(library);

        // SAFETY: the object that the library exports as its table, never unloaded.
        let table = unsafe { read::table(entry, &path) }?;
        let bad =
            |(place, problem)| KineticsError::BadDescriptor { path: path.clone(), place, problem };
        // SAFETY: of the table just read.
        let descriptor = unsafe { read::descriptor(&table) }.map_err(bad)?;
        let null = |name: &str| bad((format!("function `{name}`"), "is null".to_owned()));
        let given = descriptor.capabilities;
        Ok(Arc::new(Self {
            create: table.create.ok_or_else(|| null("create"))?,
            destroy: table.destroy.ok_or_else(|| null("destroy"))?,
            rates: table.rates.ok_or_else(|| null("rates"))?,
            rate_partials: given
                .rate_partials
                .then(|| table.rate_partials.ok_or_else(|| null("rate_partials")))
                .transpose()?,
            length_factor: given
                .length_factor
                .then(|| table.length_factor.ok_or_else(|| null("length_factor")))
                .transpose()?,
            length_factor_partials: given
                .length_factor_partials
                .then(|| table.length_factor_partials.ok_or_else(|| null("length_factor_partials")))
                .transpose()?,
            path,
            descriptor,
        }))
    }

    /// The full path of the file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the plugin says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// An unknown parameter, one out of bounds, or a failure that the plugin reports.
    pub fn instantiate(
        self: &Arc<Self>,
        given: &BTreeMap<String, f64>,
    ) -> Result<PluginKinetics, KineticsError> {
        let parameters = parameters::resolve(&self.descriptor, given)?;
        let mut instance = ptr::null_mut();
        let call = Call {
            plugin: &self.descriptor.name,
            name: "create",
            location: Location::Vertex,
            first: 0,
        };
        call.run(|report| {
            // SAFETY: as many parameters as the descriptor has; `instance` is ours to be written.
            unsafe {
                (self.create)(parameters.as_ptr(), parameters.len(), &raw mut instance, report)
            }
        })?;
        Ok(PluginKinetics { library: Arc::clone(self), parameters, instance })
    }
}

/// The law of a loaded plugin with its parameters.
#[derive(Debug)]
pub struct PluginKinetics {
    library: Arc<Library>,
    parameters: Vec<f64>,
    instance: *mut c_void,
}

// SAFETY: the boundary demands that instances may be used from any number of threads at once.
unsafe impl Send for PluginKinetics {}
// SAFETY: as above.
unsafe impl Sync for PluginKinetics {}

impl Drop for PluginKinetics {
    fn drop(&mut self) {
        // SAFETY: made by `create` of the same library, and never used again.
        unsafe { (self.library.destroy)(self.instance) };
    }
}

impl PluginKinetics {
    /// The library that the law comes from.
    #[must_use]
    pub fn library(&self) -> &Arc<Library> {
        &self.library
    }

    fn call(&self, name: &'static str, batch: &Batch<'_>) -> Call<'_> {
        Call {
            plugin: &self.library.descriptor.name,
            name,
            location: batch.location,
            first: batch.first,
        }
    }

    fn check(
        &self,
        what: &'static str,
        expected: usize,
        found: usize,
    ) -> Result<(), KineticsError> {
        if expected == found {
            return Ok(());
        }
        let plugin = self.library.descriptor.name.clone();
        Err(KineticsError::Shape { plugin, what, expected, found })
    }

    /// Checks that all columns are there and long enough, so that pointers to them may be given
    /// away.
    fn inputs(&self, batch: &Batch<'_>, signals: usize) -> Result<Inputs, KineticsError> {
        self.check("species columns", self.library.descriptor.species.len(), batch.species.len())?;
        self.check("signal columns", signals, batch.signals.len())?;
        for column in batch.inputs() {
            let readable =
                if column.covers(batch.count) { batch.count } else { column.parts().0.len() };
            self.check("values of an input", batch.count, readable)?;
        }
        let columns = |columns: &[Column<'_>]| -> Vec<abi::Column> {
            let raw = |column: &Column<'_>| {
                let (data, stride) = column.parts();
                abi::Column { data: data.as_ptr(), stride }
            };
            columns.iter().map(raw).collect()
        };
        Ok(Inputs {
            count: batch.count,
            species: columns(batch.species),
            signals: columns(batch.signals),
        })
    }

    fn outputs(
        &self,
        count: usize,
        columns: usize,
        outputs: &mut [&mut [f64]],
    ) -> Result<Vec<abi::ColumnMut>, KineticsError> {
        self.check("output columns", columns, outputs.len())?;
        outputs
            .iter_mut()
            .map(|column| {
                self.check("values of an output", count, column.len())?;
                Ok(abi::ColumnMut { data: column.as_mut_ptr(), stride: 1 })
            })
            .collect()
    }
}

impl Kinetics for PluginKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.library.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        let descriptor = self.descriptor();
        let inputs = self.inputs(batch, descriptor.signal_columns())?;
        let values = self.outputs(batch.count, descriptor.species.len(), rates)?;
        self.call("rates", batch).run(|report| {
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { (self.library.rates)(self.instance, &inputs.raw(), values.as_ptr(), report) }
        })
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let Some(function) = self.library.rate_partials else {
            return differences::rate_partials(self, batch, rates, partials);
        };
        let descriptor = self.descriptor();
        let species = descriptor.species.len();
        let inputs = self.inputs(batch, descriptor.signal_columns())?;
        let values = self.outputs(batch.count, species, rates)?;
        let partials = self.outputs(batch.count, species * descriptor.inputs(), partials)?;
        self.call("rate_partials", batch).run(|report| {
            let (values, partials) = (values.as_ptr(), partials.as_ptr());
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values, partials, report) }
        })
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        let inputs = self.inputs(batch, 0)?;
        let Some(function) = self.library.length_factor else {
            factor.fill(1.0);
            return Ok(None);
        };
        let values = self.outputs(batch.count, 1, &mut [factor])?;
        self.call("length_factor", batch).run(|report| {
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values.as_ptr(), report) }
        })
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let Some(function) = self.library.length_factor_partials else {
            return differences::length_factor_partials(self, batch, factor, partials);
        };
        let inputs = self.inputs(batch, 0)?;
        let values = self.outputs(batch.count, 1, &mut [factor])?;
        let species = self.library.descriptor.species.len();
        let partials = self.outputs(batch.count, species, partials)?;
        self.call("length_factor_partials", batch).run(|report| {
            let (values, partials) = (values.as_ptr(), partials.as_ptr());
            // SAFETY: columns as the descriptor asks for, each long enough, live over the call.
            unsafe { function(self.instance, &inputs.raw(), values, partials, report) }
        })
    }
}

/// Input columns as the boundary takes them.
struct Inputs {
    count: usize,
    species: Vec<abi::Column>,
    signals: Vec<abi::Column>,
}

impl Inputs {
    fn raw(&self) -> abi::Batch {
        abi::Batch {
            size: size_of::<abi::Batch>(),
            count: self.count,
            species: self.species.as_ptr(),
            species_count: self.species.len(),
            signals: self.signals.as_ptr(),
            signal_count: self.signals.len(),
        }
    }
}
