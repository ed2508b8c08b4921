//! What rates read of the shape: the signals of the law, then those that transports read besides.

use super::{Chemistry, SignalColumns, Surface};
use crate::effects::SignalValues;
use crate::kinetics::{KineticsError, field};
use crate::sheet::Sheet;

impl Chemistry {
    /// How many inputs the rates have: species, and columns of signals.
    #[must_use]
    pub fn inputs(&self) -> usize {
        let columns = |s: &crate::kinetics::Signal| s.columns().len();
        let signals: usize = self.signals.wanted().iter().map(columns).sum();
        self.descriptor().species.len() + signals
    }

    /// The columns of the law among those of all signals.
    pub(super) fn of_law<'a>(&self, signals: &'a SignalColumns) -> &'a [Vec<f64>] {
        let count = self.descriptor().inputs() - self.descriptor().species.len();
        &signals[..count.min(signals.len())]
    }

    /// The signals with their columns, as transports read them.
    #[must_use]
    pub fn signal_values<'a>(&'a self, columns: &'a SignalColumns) -> SignalValues<'a> {
        SignalValues::new(self.signals.wanted(), columns)
    }

    /// Partial derivatives at every point, column `s · inputs + j` for rate s by input j ([`Chemistry::inputs`]): of reactions by
    /// species and signals, of transports by signals alone.
    ///
    /// # Errors
    /// As for [`Chemistry::reaction_partials`].
    pub fn partials(
        &self,
        on: (&Sheet, f64),
        surface: &Surface,
        species: &[&[f64]],
        signals: &SignalColumns,
    ) -> Result<field::Columns, KineticsError> {
        let of_law = self.reaction_partials(species, signals)?;
        let (n, law, all) = (species.len(), self.descriptor().inputs(), self.inputs());
        if self.transports.iter().all(|term| term.read_signals().next().is_none()) {
            return Ok(of_law);
        }
        let mut partials = field::Columns::new(n * all, species.first().map_or(0, |c| c.len()));
        let mut columns = partials.slices_mut();
        for (k, column) in columns.iter_mut().enumerate().filter(|(k, _)| k % all < law) {
            column.copy_from_slice(of_law.column(k / all * law + k % all));
        }
        let inputs = (species, self.signal_values(signals));
        for (term, operator) in self.transports.iter().zip(surface.operators()) {
            let first = term.species() * all + n;
            term.derivatives_by_signals(on, operator, inputs, |point, column, value| {
                columns[first + column][point] += value;
            });
        }
        drop(columns);
        Ok(partials)
    }
}
