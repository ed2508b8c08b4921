//! Who sees every accepted state of a run: frames, ledger, rules that stop it.

use super::checkpoint::ResultsSoFar;
use super::fields::Fields;
use super::ranks::{self, Piece};
use super::summary::Ending;
use super::{Error, Result, ledger_row};
use crate::model::{Evaluation, Model};
use crate::output::{Ledger, ResultDirectory, Series};
use crate::run::StepInfo;
use crate::scene::{OutputSpec, Scene};

/// Sees every accepted state; all share one evaluation, so that what several ask for is computed once.
pub trait Observer {
    /// Inspects a state.
    ///
    /// # Errors
    /// A result that cannot be written, or a law that fails; the run ends.
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()>;

    /// Whether the run ends with this state, and why; asked before [`Observer::observe`].
    ///
    /// # Errors
    /// A law that fails.
    fn stop(&mut self, _at: &mut Evaluation<'_>) -> Result<Option<Ending>> {
        Ok(None)
    }
}

/// Writes a row for every accepted step.
pub(super) struct LedgerRows {
    /// One for all ranks.
    ledger: Option<Ledger>,
    shape: ledger_row::ShapeSums,
}

impl LedgerRows {
    /// Opens the ledger, after the row of the step `after` if one is given; a rank that is not the `first` leaves it to that
    /// to write rows, and has its share in making them.
    pub(super) fn open(
        directory: &ResultDirectory,
        columns: &[String],
        after: Option<u64>,
        first: bool,
    ) -> Result<Self> {
        let ledger = match after {
            _ if !first => None,
            None => Some(Ledger::create(&directory.ledger(), columns)?),
            Some(step) => Some(Ledger::reopen(&directory.ledger(), columns, step)?),
        };
        Ok(Self { ledger, shape: ledger_row::ShapeSums::default() })
    }
}

impl Observer for LedgerRows {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if info.new {
            let _scope = at.model().tally().meter("output", "ledger").scope("rows");
            let row = ledger_row::row(at, info, &mut self.shape)?;
            if let Some(ledger) = &mut self.ledger {
                ledger.append(&row)?;
            }
        }
        Ok(())
    }
}

/// Writes a frame at every output time.
pub(super) struct Frames {
    fields: Fields,
    series: Series,
}

impl Frames {
    /// Opens the series, after the frames of `results` if there are some, which are searched for by the `first` rank. None
    /// for a well-mixed system: the solution is then the ledger.
    pub(super) fn open(
        (directory, output): (&ResultDirectory, &OutputSpec),
        model: &Model,
        fields: &Fields,
        (results, first): (Option<&ResultsSoFar>, bool),
    ) -> Result<Option<Self>> {
        if model.sheet().triangles().is_empty() {
            return Ok(None);
        }
        let mut series = Series::create(directory, output.compression);
        if let Some(of) = model.sheet().reduction().ranks()
            && of.communicator.rank() == 0
        {
            series = series.in_pieces(ranks::piece_folders(of.communicator.size()));
        }
        if let Some(ResultsSoFar { frame_times, digests, .. }) = results.cloned() {
            series = match first {
                true => series.after(frame_times, digests)?,
                false => series.after_those_of_others(frame_times, digests),
            };
        }
        Ok(Some(Self { fields: fields.clone(), series }))
    }

    /// Digests of their files.
    pub(super) fn digests(&self) -> &[u64] {
        self.series.digests()
    }

    /// Their times.
    pub(super) fn times(&self) -> &[f64] {
        self.series.times()
    }
}

impl Observer for Frames {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if info.frame && self.series.times().last() != Some(&at.state().time) {
            let _scope = at.model().tally().meter("output", "frames").scope("frames");
            let frame = self.fields.frame(at)?;
            let sheet = at.model().sheet();
            match sheet.reduction().distribution() {
                None => self.series.push(&frame)?,
                Some(share) => {
                    let piece = Piece::new(sheet, &frame);
                    let written = self.series.push(&piece.frame(sheet, &frame));
                    ranks::agreed(Some(&*share.communicator), written.map_err(Error::from))?
                }
            };
        }
        Ok(())
    }
}

/// Ends a run at the scene's time or number of steps, or when steady: no species changes any more, and no vertex moves.
pub struct StopRules {
    until: f64,
    steps: Option<u64>,
    /// Largest |dc/dt|, in units of each species' typical magnitude, and |dx/dt| under drag, in mean edges, that counts as none.
    steady: Option<f64>,
}

impl StopRules {
    /// The stop rules of `scene`.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let span = &scene.time.span;
        Self {
            until: span.until.get(),
            steps: span.max_steps.map(|m| m.get() as u64),
            steady: span.stop_when_steady.map(f64::from),
        }
    }
}

impl Observer for StopRules {
    fn observe(&mut self, _: &mut Evaluation<'_>, _: &StepInfo<'_>) -> Result<()> {
        Ok(())
    }

    fn stop(&mut self, at: &mut Evaluation<'_>) -> Result<Option<Ending>> {
        let state = at.state();
        if state.time >= self.until {
            return Ok(Some(Ending::Reached));
        }
        if self.steps.is_some_and(|steps| state.step >= steps) {
            return Ok(Some(Ending::Steps));
        }
        match self.steady {
            Some(rate) if state.step > 0 => {
                let steady = at.fastest_rate()?.max(at.fastest_motion()?) < rate;
                Ok(steady.then_some(Ending::Steady))
            }
            _ => Ok(None),
        }
    }
}
