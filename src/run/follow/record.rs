//! What is written of branches: a table, frames and a diagram.
//!
//! Table and diagram are rewritten as a whole at every step: a command that is killed leaves files that open.

use super::family::SceneFamily;
use super::measures::{Directions, Measure};
use super::{Request, diagram};
use crate::Vec3;
use crate::kinetics::Location;
use crate::model::{EvaluationBuffers, Model};
use crate::output::{
    Compression, Field, Frame, OutputError, ResultDirectory, Series, atomic, plot, vtu,
};
use crate::run::fields::titled;
use crate::run::follow::row::{BIFURCATION, FOLD, Row, SINGULARITY};
use crate::run::stability::EIGENVALUE_UNIT;
use crate::run::{Fields, Result};
use crate::scene::OutputSpec;
use crate::solve::continuation::{Block, CriticalMode, Event, Point, Unknowns};

/// Modes of an event.
fn modes_of(event: &Event) -> &[CriticalMode] {
    match event {
        Event::Bifurcation(modes) | Event::Singularity(modes) => modes,
        _ => &[],
    }
}

/// What is singular at an event with modes.
fn kind(event: &Event) -> &'static str {
    match modes_of(event) {
        [] => "",
        [mode, ..] if mode.frequency != 0.0 => "oscillation",
        [mode, ..] if mode.block == Block::Shape => "shape",
        _ => "coupled",
    }
}

/// The word of an event.
fn word(event: &Event) -> &'static str {
    match event {
        Event::None => "",
        Event::Start => "start",
        Event::Fold => FOLD,
        Event::Bifurcation(_) => BIFURCATION,
        Event::Singularity(_) => SINGULARITY,
        Event::Passed(_) => "passed",
        Event::End => "end",
    }
}

/// Writes what is found of branches into a directory.
pub(super) struct BranchRecord<'a> {
    directory: &'a ResultDirectory,
    fields: Fields,
    series: Series,
    compression: Compression,
    key: String,
    /// What the diagram is asked to show.
    shown: Option<Measure>,
    measures: Vec<Measure>,
    directions: Directions,
    family: SceneFamily,
    /// Titles of the species.
    species: Vec<String>,
    /// Whether disturbances of the shape at given species are counted beside others.
    of_shape: bool,
    pub(super) rows: Vec<Row>,
}

impl<'a> BranchRecord<'a> {
    /// In `directory`, with the `fields` of a scene in frames, of the branches of `request` in `family` that begin at `start`,
    /// where the key pushes along `load`.
    pub(super) fn new(
        directory: &'a ResultDirectory,
        (fields, output): (Fields, &OutputSpec),
        request: &Request,
        (family, model, load): (&SceneFamily, (&Model, &Unknowns), Option<Vec<Vec3>>),
    ) -> Self {
        let series = Series::create(directory, output.compression);
        let closed = !family.sheet.boundary().contains(&true);
        let has = |measure: &Measure| match measure {
            Measure::Mode => request.switch > 0,
            Measure::Load => load.is_some(),
            Measure::Volume => closed,
            Measure::Species(_) => false,
            _ => true,
        };
        let (model, start) = model;
        let titles = model.chemistry().map(|chemistry| {
            chemistry.descriptor().species.iter().map(|s| titled(&s.name, &s.unit)).collect()
        });
        let of_shape = titles.is_some() && model.moves() && model.mass_weights().mechanics == 0.0;
        let species = (0..start.species.len()).map(Measure::Species);
        let all = Measure::ALL.into_iter().map(|(measure, ..)| measure);
        let measures = all.filter(has).chain(species).collect();
        let (compression, key) = (output.compression, request.along.clone());
        let (shown, rows, family) = (request.measure, Vec::new(), family.clone());
        let directions = Directions { mode: None, species: start.species.clone(), load };
        Self {
            directory,
            fields,
            series,
            compression,
            key,
            shown,
            measures,
            directions,
            family,
            species: titles.unwrap_or_default(),
            of_shape,
            rows,
        }
    }

    /// Adds `points` of the branch number `branch`.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn add(&mut self, branch: usize, points: &[Point]) -> Result<()> {
        for point in points {
            self.add_row(branch, point);
            // A point has no shape to be seen.
            if !self.family.sheet.triangles().is_empty() {
                self.add_frame(point)?;
            }
        }
        self.write_table()
    }

    fn add_row(&mut self, branch: usize, point: &Point) {
        let sheet = &self.family.sheet;
        if let Event::Bifurcation(modes) = &point.event
            && self.waits_for_mode()
            && let Some(mode) = modes.first()
        {
            self.directions.mode = Some(mode.shape.clone());
            for row in &mut self.rows {
                row.measures[0] = Measure::Mode.value(sheet, &row.at, &self.directions);
                row.at = Unknowns::default();
            }
        }
        let (event, kind) = (word(&point.event), kind(&point.event));
        let mut text = format!("{},{branch}", self.rows.len());
        let numbers = [point.arc, point.parameter, point.energy];
        numbers.iter().for_each(|value| text += &format!(",{value:e}"));
        text += &format!(",{}", point.negative);
        if self.of_shape {
            text += &format!(",{}", point.negative_of_shape);
        }
        let of = |measure: &Measure| measure.value(sheet, &point.at, &self.directions);
        let measures = self.measures.iter().map(of).collect();
        let behind = format!(",{},{:e}", point.iterations, point.residual);
        let at = if self.waits_for_mode() { point.at.clone() } else { Unknowns::default() };
        let Point { parameter, energy, negative, .. } = *point;
        self.rows.push(Row {
            branch,
            parameter,
            energy,
            negative,
            measures,
            event,
            kind,
            text,
            behind,
            at,
        });
    }

    /// Whether displacements are to be taken along a mode that is not known yet. It is the first of the measures.
    fn waits_for_mode(&self) -> bool {
        self.directions.mode.is_none() && self.measures.first() == Some(&Measure::Mode)
    }

    /// The frame of the last row; its time is the number of that. Modes go to a file of their own: all frames have the
    /// same fields.
    fn add_frame(&mut self, point: &Point) -> Result<()> {
        let (model, mut state) = self.family.member(point.parameter)?;
        state.x = point.at.x.clone().into();
        state.species.clone_from(&point.at.species);
        let mut memory = EvaluationBuffers::default();
        let mut at = model.at(&state, &mut memory);
        let mut frame = self.family.tally.uncounted(|| self.fields.frame(&mut at))?;
        let number = self.rows.len().saturating_sub(1);
        frame.time = crate::num::real(number);
        frame.step = number as u64;
        frame.field_data.push((self.key.clone(), point.parameter));
        frame.field_data.push(("arc length".to_owned(), point.arc));
        let negative = crate::num::real(point.negative);
        frame.field_data.push(("negative eigenvalues".to_owned(), negative));
        self.series.push(&frame)?;
        let modes = modes_of(&point.event);
        if !modes.is_empty() {
            let folder = self.directory.modes();
            std::fs::create_dir_all(&folder).map_err(OutputError::write(&folder))?;
            add_modes(&mut frame, &model, modes);
            vtu::write(&self.directory.mode(number), &frame, self.compression)?;
        }
        Ok(())
    }

    /// The title of a measure, with the name and the unit of a species.
    fn title(&self, measure: Measure) -> String {
        match measure {
            Measure::Species(k) => format!("mean {}", self.species[k]),
            other => other.title().to_owned(),
        }
    }

    fn write_table(&self) -> Result<()> {
        let measures: String =
            self.measures.iter().map(|m| format!(",{}", self.title(*m))).collect();
        let key = &self.key;
        let of_shape = if self.of_shape { ",negative eigenvalues of the shape" } else { "" };
        let head = format!(
            "point,branch,arc length,{key},energy [energy],negative eigenvalues{of_shape}{measures},iterations,\
             force residual,event,kind\n"
        );
        let path = self.directory.branch();
        atomic::replace(&path, |writer| {
            writer.write_all(head.as_bytes())?;
            self.rows.iter().try_for_each(|row| {
                let Row { text, measures, behind, event, kind, .. } = row;
                let measures: String = measures.iter().map(|value| format!(",{value:e}")).collect();
                writer.write_all(format!("{text}{measures}{behind},{event},{kind}\n").as_bytes())
            })
        })?;
        Ok(())
    }

    /// The measure of the diagram: that asked for, or the first that has a sign and is known.
    fn shown(&self) -> Measure {
        let usual = match &self.directions {
            Directions { mode: Some(_), .. } => Measure::Mode,
            Directions { load: Some(_), .. } => Measure::Load,
            Directions { species, .. } if !species.is_empty() => Measure::Species(0),
            _ => Measure::Displacement,
        };
        self.shown.filter(|measure| self.measures.contains(measure)).unwrap_or(usual)
    }

    /// Writes the diagram.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn write_diagram(&self) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let shown = self.shown();
        let column = self.measures.iter().position(|measure| *measure == shown);
        let title = self.title(shown);
        let blocks = diagram::blocks(&self.rows, &self.key, (&title, column.unwrap_or_default()));
        plot::write(self.directory.root(), &blocks)?;
        Ok(())
    }
}

/// Adds critical modes to a frame: vectors of the shape where that moves, and changes of the species.
fn add_modes(frame: &mut Frame<'_>, model: &Model, modes: &[CriticalMode]) {
    let chemistry = model.chemistry();
    for (k, mode) in modes.iter().enumerate() {
        let unit = if mode.block == Block::Coupled { "1/time" } else { EIGENVALUE_UNIT };
        let name = format!("mode_{}", k + 1);
        frame.field_data.push((format!("eigenvalue of {name} [{unit}]"), mode.eigenvalue));
        if chemistry.is_some() {
            frame.field_data.push((format!("frequency of {name} [1/time]"), mode.frequency));
        }
        if model.moves() {
            frame.point.push(Field::vector(name.clone(), &mode.shape.x));
        }
        let Some(chemistry) = chemistry else { continue };
        for (species, values) in chemistry.descriptor().species.iter().zip(&mode.shape.species) {
            let field = Field::scalar(format!("{name} of {}", species.name), values.clone());
            match chemistry.location() {
                Location::Face => frame.cell.push(field),
                _ => frame.point.push(field),
            }
        }
    }
}
