//! A plugin in this process or in one of its own, as is asked for.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::{Descriptor, IsolatedLibrary, Kinetics, KineticsError, Library, PluginSearch};

/// A loaded plugin.
#[derive(Debug, Clone)]
pub enum Plugin {
    /// In this process.
    Here(Arc<Library>),
    /// In a process of its own.
    IsolatedLibrary(Arc<IsolatedLibrary>),
}

impl Plugin {
    /// Loads the plugin at a path, where `search` says.
    ///
    /// # Errors
    /// As for [`Library::load`] and [`IsolatedLibrary::load`].
    pub fn load(path: &Path, search: &PluginSearch) -> Result<Self, KineticsError> {
        match search.isolation() {
            None => Ok(Self::Here(Library::load(path)?)),
            Some(isolation) => Ok(Self::IsolatedLibrary(IsolatedLibrary::load(path, isolation)?)),
        }
    }

    /// What the plugin says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        match self {
            Self::Here(library) => library.descriptor(),
            Self::IsolatedLibrary(apart) => apart.descriptor(),
        }
    }

    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// As for [`Library::instantiate`].
    pub fn instantiate(
        &self,
        given: &BTreeMap<String, f64>,
    ) -> Result<Arc<dyn Kinetics>, KineticsError> {
        Ok(match self {
            Self::Here(library) => Arc::new(library.instantiate(given)?),
            Self::IsolatedLibrary(apart) => Arc::new(apart.instantiate(given)?),
        })
    }
}
