//! The caller of long work.

use std::sync::Arc;

use crate::reduction::Reduction;
use crate::solve::{Result, SolveError};

/// The caller of long work, which may be interrupted and reports its progress.
#[derive(Clone)]
pub struct Control {
    reduction: Reduction,
    interrupted: Arc<dyn Fn() -> bool + Send + Sync>,
    listener: Arc<Listener>,
}

/// Takes reports; asks for the text only where it shows it.
type Listener = dyn Fn(&dyn Fn() -> String) + Send + Sync;

impl Default for Control {
    /// No caller: never interrupted.
    fn default() -> Self {
        let reduction = Reduction::default();
        Self { reduction, interrupted: Arc::new(|| false), listener: Arc::new(|_| ()) }
    }
}

impl Control {
    /// `interrupted` is asked now and then, and `true` gives up; `listener` is given reports.
    #[must_use]
    pub fn new(
        interrupted: impl Fn() -> bool + Send + Sync + 'static,
        listener: impl Fn(&dyn Fn() -> String) + Send + Sync + 'static,
    ) -> Self {
        let reduction = Reduction::default();
        Self { reduction, interrupted: Arc::new(interrupted), listener: Arc::new(listener) }
    }

    /// Whether the work is to be given up.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        self.reduction.any((self.interrupted)())
    }

    /// The same, with interruptions agreed on by all ranks of a sheet.
    #[must_use]
    pub fn over(self, reduction: &Reduction) -> Self {
        Self { reduction: reduction.clone(), ..self }
    }

    /// Whether to continue.
    ///
    /// # Errors
    /// [`SolveError::Interrupted`].
    pub fn check(&self) -> Result<()> {
        if self.is_interrupted() { Err(SolveError::Interrupted) } else { Ok(()) }
    }

    /// Reports what is being done, and how far it is.
    pub fn report(&self, text: impl Fn() -> String) {
        (self.listener)(&text);
    }
}
