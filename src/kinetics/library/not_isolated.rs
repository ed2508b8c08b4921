//! Stands in for isolation on systems where it is not supported: all but Linux.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::PluginKinetics;
use crate::error::KineticsError;

/// How plugins are put into processes of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Isolation;

fn unsupported() -> KineticsError {
    KineticsError::Isolated("plugins can be isolated on Linux only".to_owned())
}

impl Isolation {
    /// Never.
    ///
    /// # Errors
    /// Always.
    pub fn here(_limit: Duration) -> Result<Self, KineticsError> {
        Err(unsupported())
    }

    /// By another program.
    #[must_use]
    pub fn by(_program: PathBuf, _limit: Duration) -> Self {
        Self
    }
}

/// Does nothing.
pub fn serve_if_asked() {}

/// A plugin in a process of its own.
#[derive(Debug)]
pub enum IsolatedLibrary {}

/// The law of a plugin in a process of its own.
pub type IsolatedKinetics = PluginKinetics;

impl IsolatedLibrary {
    /// Never.
    ///
    /// # Errors
    /// Always.
    pub fn load(_path: &Path, _isolation: &Isolation) -> Result<Arc<Self>, KineticsError> {
        Err(unsupported())
    }

    /// Never: isolation is not available here.
    #[must_use]
    pub fn descriptor(&self) -> &crate::Descriptor {
        match *self {}
    }

    /// Never.
    ///
    /// # Errors
    /// Always.
    pub fn instantiate(
        self: &Arc<Self>,
        _given: &BTreeMap<String, f64>,
    ) -> Result<IsolatedKinetics, KineticsError> {
        Err(unsupported())
    }
}
