//! Fields whose formula may read the time.
//!
//! ```text
//! curvature = "0.1*sin(t - x)"       a formula of the rest position x, y, z and of the time t
//! ```
//!
//! A formula without `t`, a number, regions and arrays are read once, as elsewhere (`field.rs`).

use std::borrow::Cow;

use super::field::{formula_on, formula_values, noun, vertex_places};
use super::{EffectContext, EffectError, Field, FieldValues};
use crate::kinetics::Location;
use crate::kinetics::breakpoints::{TimeDependence, sampled};
use crate::kinetics::formula::{self, FieldFormula, Places};
use crate::num::checked::Checked;
use crate::sheet::Sheet;

/// Vertices at which a formula of position and time is sampled for breakpoints.
const SAMPLED_VERTICES: usize = 16;

/// A parameter at the vertices or triangles.
#[derive(Debug, Clone)]
pub(super) enum TimedField {
    /// The same at all times.
    Given(FieldValues),
    /// By a formula of position and, perhaps, time.
    Formula(Box<FieldFormula>, Location),
}

impl TimedField {
    /// 0 and 1 everywhere.
    pub(super) const ZERO: Self = Self::Given(FieldValues::Same(0.0));
    pub(super) const UNIT: Self = Self::Given(FieldValues::Same(1.0));

    /// That of a formula at the vertices or triangles, of any value; `key` is to blame.
    ///
    /// # Errors
    /// If the text is not a formula of position and time.
    pub(super) fn formula(
        sheet: &Sheet,
        text: &str,
        place: Location,
        key: &'static str,
    ) -> Result<Self, EffectError> {
        let formula = formula_on(sheet, text, true);
        let formula = formula.map_err(|e| EffectError { key, message: e.message, help: e.help })?;
        Ok(Self::Formula(Box::new(formula), place))
    }

    /// Whether it changes in time.
    pub(super) fn depends_on_time(&self) -> bool {
        self.timed_formula().is_some()
    }

    /// Its formula, if it changes in time.
    pub(super) fn timed_formula(&self) -> Option<&FieldFormula> {
        match self {
            Self::Formula(formula, _) if formula.depends_on_time() => Some(formula),
            _ => None,
        }
    }

    /// Its values at a time.
    pub(super) fn evaluate(&self, sheet: &Sheet, time: f64) -> Cow<'_, FieldValues> {
        match self {
            Self::Given(values) => Cow::Borrowed(values),
            Self::Formula(formula, place) => {
                Cow::Owned(FieldValues::Each(formula_values(formula, *place, sheet, time)))
            }
        }
    }
}

impl EffectContext<'_> {
    /// The values of a field whose formula may read the time; `key` is to blame. Later than at time 0 ranges of N hold for what
    /// does not.
    ///
    /// # Errors
    /// As for [`Field::on`]; a formula of the time that is out of range at time 0.
    pub(super) fn timed_field<N: Checked>(
        &self,
        field: &Field<N>,
        place: Location,
        key: &'static str,
    ) -> Result<TimedField, EffectError> {
        if let Field::Formula(text) = field {
            let timed = TimedField::formula(self.sheet, text, place, key)?;
            if timed.depends_on_time() {
                let start = timed.evaluate(self.sheet, 0.0);
                if let FieldValues::Each(all) = &*start
                    && let Some(i) = all.iter().position(|value| N::checked(*value).is_none())
                {
                    let noun = noun(place);
                    let message = format!("it is {} at {noun} {i} at time 0", all[i]);
                    let range = N::RANGE;
                    let help =
                        format!("it must be {range} at every {noun}, at all times of the run");
                    return Err(EffectError { key, message, help: Some(help) });
                }
                drop(start);
                return Ok(timed);
            }
        }
        self.values(field, place, key).map(TimedField::Given)
    }
}

/// Where formulas of the time among `fields` have kinks and jumps from time 0 to `until` at the vertices, whatever the species
/// are, and their course between them at some.
pub(super) fn time_dependence<'a, N: Checked + 'a>(
    fields: impl IntoIterator<Item = &'a Field<N>>,
    sheet: &Sheet,
    until: f64,
) -> TimeDependence {
    let mut found = TimeDependence::default();
    for field in fields {
        if let Field::Formula(text) = field {
            match FieldFormula::on_sheet(text, true) {
                Ok(formula) => add(&formula, sheet, until, &mut found),
                // It may read species.
                Err(_) => {
                    let reads = text.contains("distance_to_boundary");
                    formula::time_dependence(text, vertex_places(sheet, reads), until, &mut found);
                }
            }
        }
    }
    found
}

fn add(formula: &FieldFormula, sheet: &Sheet, until: f64, found: &mut TimeDependence) {
    if !formula.depends_on_time() {
        return;
    }
    let places = match formula.depends_on_position() {
        true => vertex_places(sheet, formula.depends_on_distance()),
        false => sheet.rest()[..1].into(),
    };
    formula.time_dependence(places, until, found);
    let (some, distances) = places.some(sheet.vertex_count().div_ceil(SAMPLED_VERTICES));
    let values = |times: &[f64]| {
        let mut columns = vec![Vec::with_capacity(times.len()); some.len()];
        for time in times {
            let values = formula.evaluate(Places::with_distances(&some, &distances), *time);
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
        columns.iter().flatten().all(|value| value.is_finite()).then_some(columns)
    };
    found.breakpoints.extend(sampled(until, values).unwrap_or_default().breakpoints);
}
