//! Plugins in processes of their own, where it is not known how that is done.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::PluginKinetics;
use crate::error::KineticsError;

/// How plugins are put into processes of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Isolation;

fn unknown() -> KineticsError {
    KineticsError::Isolated("plugins can be isolated on Linux only".to_owned())
}

impl Isolation {
    /// Never.
    ///
    /// # Errors
    /// Always.
    pub fn here(_: Duration) -> Result<Self, KineticsError> {
        Err(unknown())
    }

    /// By another program.
    #[must_use]
    pub fn by(_: PathBuf, _: Duration) -> Self {
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
    pub fn load(_: &Path, _: &Isolation) -> Result<Arc<Self>, KineticsError> {
        Err(unknown())
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
        _: &BTreeMap<String, f64>,
    ) -> Result<IsolatedKinetics, KineticsError> {
        Err(unknown())
    }
}
