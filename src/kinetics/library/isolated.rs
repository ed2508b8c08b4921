//! Isolated plugins: each in a child process, which it may end, block or alter; the parent reports that.
//!
//! A library is loaded and called by a child: this very program, or another that begins with
//! [`serve_if_asked`]. Calls are batches as they are in one process. Their columns are copied to
//! memory that both processes share, and results back; the child calls the law as it would be called
//! here, with the same checks and to the same bits. For every thread that computes there is one in
//! the child, so that what is parallel stays so.
//!
//! What a plugin does to its process ends there: its folder, its files, its memory, its signals. A
//! child that ends, or does not answer in time, is named with its call; it takes with it whatever it
//! has started, and ends when its parent does.

mod child;
mod column_layout;
mod grown;
mod law;
mod memory;
mod reply;
mod serve;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::descriptor::Descriptor;
use crate::error::KineticsError;
use crate::parameters;
use crate::search::no_file;
use child::Process;
pub use law::IsolatedKinetics;

/// First argument of a program that is to serve a plugin.
const SERVE_ARGUMENT: &str = "isolated-plugin";

/// Whether this program serves plugins when it is asked to.
static SERVES_PLUGINS: AtomicBool = AtomicBool::new(false);

/// How plugins are put into processes of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Isolation {
    program: PathBuf,
    limit: Duration,
}

impl Isolation {
    /// By this program, whose `main` begins with [`serve_if_asked`]; one call may take so long.
    ///
    /// # Errors
    /// [`KineticsError::Isolated`] if it does not.
    pub fn here(limit: Duration) -> Result<Self, KineticsError> {
        if SERVES_PLUGINS.load(Ordering::Relaxed) {
            return Ok(Self::by("/proc/self/exe".into(), limit));
        }
        Err(KineticsError::Isolated(
            "plugins cannot be isolated: this program does not serve them; let its `main` begin with \
             `rumple::kinetics::serve_if_asked()`"
                .to_owned(),
        ))
    }

    /// By another program that begins so.
    #[must_use]
    pub fn by(program: PathBuf, limit: Duration) -> Self {
        Self { program, limit }
    }
}

/// Serves a plugin, and never returns, if the arguments of the program ask for it. To be called
/// before anything else by programs that isolate plugins.
pub fn serve_if_asked() {
    SERVES_PLUGINS.store(true, Ordering::Relaxed);
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|word| word == SERVE_ARGUMENT) {
        let lanes = arguments.next().and_then(|n| n.to_str()?.parse().ok());
        serve::serve(lanes.unwrap_or(1));
    }
}

/// A plugin in a process of its own.
#[derive(Debug)]
pub struct IsolatedLibrary {
    process: Process,
    descriptor: Descriptor,
}

impl IsolatedLibrary {
    /// Loads the plugin at a path in a process of its own and checks its table and descriptor there.
    ///
    /// # Errors
    /// As for [`Library::load`](super::Library::load), in words; a plugin that ends its process or
    /// does not come back; a process that cannot be started.
    pub fn load(path: &Path, isolation: &Isolation) -> Result<Arc<Self>, KineticsError> {
        let path = path.canonicalize().map_err(|_| no_file(path.to_owned()))?;
        if !path.is_file() {
            return Err(no_file(path));
        }
        let process = Process::start(&path, isolation).map_err(|error| {
            let (path, program) = (path.display(), isolation.program.display());
            let text = format!("no process can be started for {path} by {program}: {error}");
            KineticsError::Isolated(text)
        })?;
        let told = process.exchange_text("loading", 0, &path.to_string_lossy(), None)?;
        let descriptor: Descriptor =
            serde_json::from_str(&told).map_err(|_| process.invalid_answer("loading"))?;
        process.set_name(&descriptor.name);
        Ok(Arc::new(Self { process, descriptor }))
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
    ) -> Result<IsolatedKinetics, KineticsError> {
        let parameters = parameters::resolve(self.descriptor(), given)?;
        IsolatedKinetics::new(self, parameters, self.descriptor().capabilities.parameter_fields)
    }
}
