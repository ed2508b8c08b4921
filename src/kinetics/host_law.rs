//! Laws of the host program, which embeds the engine: registered by name, looked up like plugins.

use std::collections::BTreeMap;
use std::fmt::{self, Debug, Formatter};
use std::sync::Arc;

use super::{Descriptor, Kinetics, KineticsError, parameters};

/// Makes an instance with values of the parameters, in the order of the descriptor.
type Instantiate = dyn Fn(Vec<f64>) -> Arc<dyn Kinetics> + Send + Sync;

/// A law that the host program registers by name, and that scenes name as they name a plugin.
#[derive(Clone)]
pub struct HostLaw {
    descriptor: Arc<Descriptor>,
    digest: String,
    instantiate: Arc<Instantiate>,
}

impl Debug for HostLaw {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_tuple("HostLaw").field(&self.name()).finish()
    }
}

impl HostLaw {
    /// Under the name in `descriptor`, which has the species, parameters with their defaults and signals read. `digest` is a
    /// hash of all that rates depend on: a run is resumed only with the same. `instantiate` makes an instance with values of the
    /// parameters, in the order of the descriptor.
    #[must_use]
    pub fn new(
        descriptor: Arc<Descriptor>,
        digest: String,
        instantiate: impl Fn(Vec<f64>) -> Arc<dyn Kinetics> + Send + Sync + 'static,
    ) -> Self {
        Self { descriptor, digest, instantiate: Arc::new(instantiate) }
    }

    /// The name that scenes give as `plugin`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.descriptor.name
    }

    /// What the law says about itself.
    #[must_use]
    pub fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    /// Hash of all that rates depend on.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The law with these parameters; those not given take their defaults.
    ///
    /// # Errors
    /// [`KineticsError::UnknownParameter`] or [`KineticsError::ParameterOutOfBounds`].
    pub fn instantiate(
        &self,
        given: &BTreeMap<String, f64>,
    ) -> Result<Arc<dyn Kinetics>, KineticsError> {
        Ok((self.instantiate)(parameters::resolve(&self.descriptor, given)?))
    }
}

impl PartialEq for HostLaw {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name() && self.digest() == other.digest()
    }
}

impl Eq for HostLaw {}
