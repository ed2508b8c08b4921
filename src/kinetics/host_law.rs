//! Laws of the host program, which embeds the engine: registered by name, looked up like plugins.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::Arc;

use super::{Descriptor, Kinetics, KineticsError, parameters};

/// A law of the host program, of which instances with parameters can be made.
pub trait Template: Send + Sync + Debug {
    /// Species, parameters with their defaults, signals read.
    fn descriptor(&self) -> &Descriptor;

    /// Hash of all that rates depend on: a run is resumed only with the same.
    fn digest(&self) -> &str;

    /// An instance with `values` of the parameters, in the order of the descriptor.
    fn with(&self, values: Vec<f64>) -> Arc<dyn Kinetics>;
}

/// A law that the host program registers by name: a [`Template`] that scenes name as they name a plugin.
#[derive(Debug, Clone)]
pub struct HostLaw(Arc<dyn Template>);

impl HostLaw {
    /// Of `template`, under the name in its descriptor.
    #[must_use]
    pub fn new(template: Arc<dyn Template>) -> Self {
        Self(template)
    }

    /// The name that scenes give as `plugin`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0.descriptor().name
    }

    /// What the law says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        self.0.descriptor()
    }

    /// Hash of all that rates depend on.
    #[must_use]
    pub fn digest(&self) -> &str {
        self.0.digest()
    }

    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// [`KineticsError::UnknownParameter`] or [`KineticsError::ParameterOutOfBounds`].
    pub fn instantiate(
        &self,
        given: &BTreeMap<String, f64>,
    ) -> Result<Arc<dyn Kinetics>, KineticsError> {
        Ok(self.0.with(parameters::resolve(self.0.descriptor(), given)?))
    }
}

impl PartialEq for HostLaw {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.digest() == other.digest()
    }
}

impl Eq for HostLaw {}
