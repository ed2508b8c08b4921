//! A simulation that is on its way: stepped to its output times until a rule stops it.

use rumple::kinetics::Location;
use rumple::run::run::Ending;
use rumple::run::schedule::OutputSchedule;
use rumple::run::{Observer, StopRules, inspect};
use rumple::sheet::{Array, Surface};
use rumple::solve::StepReport;
use rumple::solve::equilibrium::Relaxation;

/// A simulation with the schedule of its outputs and its stop rules.
pub(crate) struct Course {
    pub(crate) engine: rumple::Simulation,
    pub(crate) schedule: OutputSchedule,
    pub(crate) rules: StopRules,
    pub(crate) until: f64,
    /// Whether the start satisfies its equations and the shape is at rest.
    pub(crate) prepared: bool,
    /// Report of the last step.
    pub(crate) latest: StepReport,
    /// Whether the state was changed since the last step.
    pub(crate) changed: bool,
}

impl Course {
    pub(crate) fn prepare(&mut self) -> rumple::Result<Relaxation> {
        let done = match (self.prepared, self.changed) {
            (false, _) => self.engine.prepare()?,
            (true, true) => self.engine.reinitialise()?,
            (true, false) => Relaxation::default(),
        };
        if !self.prepared {
            self.engine.try_laws()?;
            self.engine.renew(false);
            self.schedule.pass(self.engine.state().time);
        }
        (self.prepared, self.changed) = (true, false);
        Ok(done)
    }

    pub(crate) fn ending(&mut self) -> rumple::Result<Option<Ending>> {
        self.rules.stop(&mut self.engine.evaluate())
    }

    /// One step, unless the run is at its end or at `until`.
    pub(crate) fn step(&mut self, until: f64) -> rumple::Result<Option<StepReport>> {
        self.prepare()?;
        if self.engine.state().time >= until || self.ending()?.is_some() {
            return Ok(None);
        }
        let report = self.engine.step(self.schedule.target().min(until))?;
        let time = self.engine.state().time;
        self.engine.renew(false);
        self.schedule.pass(time);
        self.latest = report.clone();
        Ok(Some(report))
    }

    pub(crate) fn location(&self) -> Location {
        self.engine.model().chemistry().map_or(Location::Vertex, |c| c.location())
    }

    /// The state as a surface, which [`Course::take`] takes back.
    pub(crate) fn surface(&self) -> Surface {
        let state = self.engine.state();
        let chemistry = self.engine.model().chemistry();
        let species = chemistry.map(|c| c.descriptor().species.as_slice()).unwrap_or_default();
        let array = |(species, values): (&rumple::kinetics::Species, &Vec<f64>)| Array {
            name: species.name.clone(),
            components: 1,
            values: values.clone(),
        };
        let arrays = species.iter().zip(&state.species).map(array).collect();
        let mut surface = Surface { points: state.x.to_vec(), ..Surface::default() };
        match self.location() {
            Location::Vertex => surface.point_arrays = arrays,
            _ => surface.cell_arrays = arrays,
        }
        surface
    }

    /// Takes over positions and species, checked.
    pub(crate) fn take(&mut self, surface: &Surface) -> rumple::Result<()> {
        inspect::take_state(&mut self.engine, surface)?;
        self.changed = true;
        Ok(())
    }

    /// All fields of a frame of the state: on vertices and on triangles.
    pub(crate) fn fields(&mut self) -> rumple::Result<[Vec<OwnedField>; 2]> {
        let frame = self.engine.frame()?;
        let owned = |fields: Vec<rumple::output::Field<'_>>| {
            let own = |f: rumple::output::Field<'_>| (f.name, f.components, f.data.into_owned());
            fields.into_iter().map(own).collect()
        };
        Ok([owned(frame.point), owned(frame.cell)])
    }
}

/// Name, components and values.
pub(crate) type OwnedField = (String, usize, Vec<f64>);
