//! Kinetics from a shared library: the only file that knows dynamic loading; with its parts, the
//! only unsafe code of the engine.
//!
//! Everything that a library says is checked before it is believed, as far as it can be: a table
//! or pointer that lies about its own length cannot be distinguished from an honest one. A library is never
//! unloaded. A plugin is trusted like any shared library: neither signal handlers nor exit hooks are installed, nor is
//! global state checked.
#![allow(unsafe_code)]

mod call;
mod instance;
mod read;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rumple_plugin_abi as abi;

use super::descriptor::Descriptor;
use super::error::KineticsError;
use super::search::no_file;
use super::{Feedback, Quantity};
pub use instance::PluginKinetics;

/// A loaded plugin: its description and its functions.
#[derive(Debug)]
pub struct Library {
    path: PathBuf,
    descriptor: Descriptor,
    create: abi::Create,
    destroy: abi::Destroy,
    rates: abi::Evaluate,
    rate_partials: abi::EvaluatePartials,
    length_factor: abi::Evaluate,
    length_factor_partials: abi::EvaluatePartials,
    observe: abi::Evaluate,
    feedback: abi::Feedback,
}

/// Compares the functions of a table with the capabilities declared.
fn functions_match(
    table: &abi::PluginTable,
    given: crate::Capabilities,
) -> Result<(), (String, String)> {
    let functions = [
        ("create", true, table.create.is_some()),
        ("destroy", true, table.destroy.is_some()),
        ("rates", true, table.rates.is_some()),
        ("rate_partials", given.rate_partials, table.rate_partials.is_some()),
        ("length_factor", given.length_factor, table.length_factor.is_some()),
        (
            "length_factor_partials",
            given.length_factor_partials,
            table.length_factor_partials.is_some(),
        ),
    ];
    if let Some((name, ..)) = functions.iter().find(|(_, needed, there)| *needed && !there) {
        return Err((format!("function `{name}`"), "is null".to_owned()));
    }
    if let Some((name, ..)) = functions.iter().find(|(_, needed, there)| !needed && *there) {
        let problem = format!(
            "is there, but the capabilities lack RUMPLE_{}: it would never be called",
            name.to_uppercase()
        );
        return Err((format!("function `{name}`"), problem));
    }
    Ok(())
}

impl Library {
    /// Loads the plugin at a path and checks its table and descriptor.
    ///
    /// # Errors
    /// [`KineticsError`]: no such file, no library, no plugin, wrong magic or version,
    /// truncated table, or a descriptor that makes no sense.
    pub fn load(path: &Path) -> Result<Arc<Self>, KineticsError> {
        // A full path keeps the system from looking anywhere else for a file of this name.
        let path = path.canonicalize().map_err(|_| no_file(path.to_owned()))?;
        if !path.is_file() {
            return Err(no_file(path));
        }
        // SAFETY: runs the initialisers of the library: the user chose to trust it.
        let library = unsafe { libloading::Library::new(&path) }.map_err(|error| {
            let source = std::error::Error::source(&error).map(ToString::to_string);
            let reason = source.unwrap_or_else(|| error.to_string());
            KineticsError::NotALibrary { path: path.clone(), reason }
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
        let mut descriptor = unsafe { read::descriptor(&table) }.map_err(bad)?;
        // SAFETY: as above.
        let observe = unsafe { read::observables(&table, &mut descriptor) }.map_err(bad)?;
        // SAFETY: as above.
        let feedback = unsafe { read::feedback(&table, descriptor.capabilities) }.map_err(bad)?;
        functions_match(&table, descriptor.capabilities).map_err(bad)?;
        Ok(Arc::new(Self {
            create: table.create,
            destroy: table.destroy,
            rates: table.rates,
            rate_partials: table.rate_partials,
            length_factor: table.length_factor,
            length_factor_partials: table.length_factor_partials,
            observe,
            feedback,
            path,
            descriptor,
        }))
    }

    /// The functions of a quantity: of its values, and of these with partial derivatives.
    fn functions(&self, quantity: Quantity) -> (abi::Evaluate, abi::EvaluatePartials) {
        let more = &self.feedback;
        match quantity {
            Quantity::Rates => (self.rates, self.rate_partials),
            Quantity::Feedback(Feedback::LengthFactor) => {
                (self.length_factor, self.length_factor_partials)
            }
            Quantity::Feedback(Feedback::Curvature) => (more.curvature, more.curvature_partials),
            Quantity::Feedback(Feedback::FactorAcross) => {
                (more.length_factor_across, more.length_factor_across_partials)
            }
            Quantity::Observables => (self.observe, None),
        }
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
}
