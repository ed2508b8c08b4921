//! What is written of branches: a table, frames and a diagram.
//!
//! Table and diagram are rewritten as a whole at every step: a command that is killed leaves files that open.

use super::diagram;
use super::family::SceneFamily;
use super::measures::Measure;
use crate::model::Memory;
use crate::output::{Compression, OutputError, ResultDirectory, Series, atomic, vtu};
use crate::run::stability::add_modes;
use crate::run::{Fields, Result};
use crate::scene::OutputSpec;
use crate::solve::continuation::{Event, Point};

/// Words of the column of events.
pub(super) const FOLD: &str = "fold";
pub(super) const BIFURCATION: &str = "bifurcation";

/// A point in the table.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) branch: usize,
    pub(super) parameter: f64,
    pub(super) energy: f64,
    pub(super) negative: usize,
    /// The one that the diagram shows.
    pub(super) measure: f64,
    pub(super) event: &'static str,
    text: String,
}

impl Row {
    /// Whether an eigenvalue is 0 there.
    pub(super) fn is_special(&self) -> bool {
        [FOLD, BIFURCATION].contains(&self.event)
    }
}

/// The word of an event.
fn word(event: &Event) -> &'static str {
    match event {
        Event::None => "",
        Event::Start => "start",
        Event::Fold => FOLD,
        Event::Bifurcation(_) => BIFURCATION,
        Event::End => "end",
    }
}

/// Writes what is found of branches into a directory.
pub(super) struct Record<'a> {
    directory: &'a ResultDirectory,
    fields: Fields,
    series: Series,
    compression: Compression,
    key: String,
    shown: Measure,
    measures: Vec<Measure>,
    pub(super) rows: Vec<Row>,
}

impl<'a> Record<'a> {
    /// In `directory`, with the `fields` of a scene in frames; the diagram shows the measure `shown` over `key`.
    pub(super) fn new(
        directory: &'a ResultDirectory,
        (fields, output): (Fields, &OutputSpec),
        key: &str,
        (shown, closed): (Measure, bool),
    ) -> Self {
        let series = Series::create(directory, output.compression).in_format(output.format);
        let measures = Measure::ALL.into_iter().filter(|m| closed || *m != Measure::Volume);
        let (measures, rows) = (measures.collect(), Vec::new());
        let (compression, key) = (output.compression, key.to_owned());
        Self { directory, fields, series, compression, key, shown, measures, rows }
    }

    /// Adds `points` of the branch number `branch`.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn add(
        &mut self,
        family: &mut SceneFamily,
        branch: usize,
        points: &[Point],
    ) -> Result<()> {
        for point in points {
            self.add_row(family, branch, point);
            self.add_frame(family, point)?;
        }
        self.write_table()
    }

    fn add_row(&mut self, family: &SceneFamily, branch: usize, point: &Point) {
        let sheet = &family.sheet;
        let event = word(&point.event);
        let mut text = format!("{},{branch}", self.rows.len());
        let numbers = [point.arc, point.parameter, point.energy];
        numbers.iter().for_each(|value| text += &format!(",{value:e}"));
        text += &format!(",{}", point.negative);
        let measures = self.measures.iter().map(|measure| measure.of(sheet, &point.x));
        measures.for_each(|value| text += &format!(",{value:e}"));
        text += &format!(",{},{:e},{event}\n", point.iterations, point.residual);
        let measure = self.shown.of(sheet, &point.x);
        let Point { parameter, energy, negative, .. } = *point;
        self.rows.push(Row { branch, parameter, energy, negative, measure, event, text });
    }

    /// The frame of the last row; its time is the number of that. Modes go to a file of their own: all frames have the
    /// same fields.
    fn add_frame(&mut self, family: &SceneFamily, point: &Point) -> Result<()> {
        let (model, mut state) = family.model(point.parameter)?;
        state.x = point.x.clone().into();
        let mut memory = Memory::default();
        let mut frame = self.fields.frame(&mut model.at(&state, &mut memory))?;
        let number = self.rows.len().saturating_sub(1);
        frame.time = crate::num::real(number);
        frame.step = number as u64;
        frame.field_data.push((self.key.clone(), point.parameter));
        frame.field_data.push(("arc length".to_owned(), point.arc));
        let negative = crate::num::real(point.negative);
        frame.field_data.push(("negative eigenvalues".to_owned(), negative));
        self.series.push(&frame)?;
        if let Event::Bifurcation(modes) = &point.event
            && !modes.is_empty()
        {
            let folder = self.directory.modes();
            std::fs::create_dir_all(&folder).map_err(OutputError::write(&folder))?;
            add_modes(&mut frame, modes);
            vtu::write(&self.directory.mode(number), &frame, self.compression)?;
        }
        Ok(())
    }

    fn write_table(&self) -> Result<()> {
        let measures: String = self.measures.iter().map(|m| format!(",{}", m.title())).collect();
        let key = &self.key;
        let head = format!(
            "point,branch,arc length,{key},energy [energy],negative eigenvalues{measures},iterations,\
             force residual,event\n"
        );
        let path = self.directory.branch();
        atomic::replace(&path, |writer| {
            writer.write_all(head.as_bytes())?;
            self.rows.iter().try_for_each(|row| writer.write_all(row.text.as_bytes()))
        })?;
        Ok(())
    }

    /// Writes the diagram.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn write_diagram(&self) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let figure = diagram::figure(&self.rows, &self.key, self.shown.title());
        let [svg, png] = self.directory.diagrams();
        let text = figure.svg()?;
        atomic::replace(&svg, |writer| writer.write_all(text.as_bytes()))?;
        let picture = figure.picture()?.png()?;
        atomic::replace(&png, |writer| writer.write_all(&picture))?;
        Ok(())
    }
}
