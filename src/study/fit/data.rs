//! Data that parameters are fitted to: a table of measures, or of fields at places, at rest or at times.
//!
//! ```text
//! t, mean(u), sigma mean(u)          measures of `rumple gradient` in their columns
//! t, x, y, z, u, ux                  with x and y: formulas at places of the sheet at rest, between its vertices
//! ```
//!
//! Without a column `t` the data are those of the state at rest. Empty cells are left out.

use std::path::{Path, PathBuf};

use crate::Vec3;
use crate::kinetics::Location;
use crate::model::{Model, State};
use crate::num::real;
use crate::output::OutputError;
use crate::run::{Error, Result};
use crate::sheet::Sheet;
use crate::study::gradient::Measure;

/// Begins the title of the column of standard errors of another one.
const SIGMA: &str = "sigma ";
/// Distance of a place from the sheet, in lengths of the triangle there, up to which it is taken to be on it.
const OFF_SHEET: f64 = 0.5;

/// A table of numbers.
#[derive(Debug, Clone)]
pub struct Data {
    path: PathBuf,
    titles: Vec<String>,
    rows: Vec<Row>,
}

#[derive(Debug, Clone)]
struct Row {
    line: u64,
    cells: Vec<Option<f64>>,
}

/// A column that a model has values for.
#[derive(Debug)]
struct Quantity {
    column: usize,
    measure: Measure,
    sigma: Option<usize>,
}

/// A value with its standard error.
#[derive(Debug, Clone)]
pub(super) struct Datum {
    pub(super) line: u64,
    pub(super) title: String,
    pub(super) value: f64,
    pub(super) sigma: f64,
    /// Which of the times.
    moment: usize,
    quantity: usize,
    /// Points of the law, or vertices, with the weights of their values.
    place: Option<Vec<(usize, f64)>>,
}

/// Data of one scene.
#[derive(Debug)]
pub(super) struct Bound {
    quantities: Vec<Quantity>,
    pub(super) data: Vec<Datum>,
    /// Ascending; none where the data are those of a state at rest.
    pub(super) times: Vec<f64>,
    /// Whether their standard errors are given.
    pub(super) has_errors: bool,
}

impl Data {
    /// Reads a file of comma-separated values with a head; lines that begin with # are comments.
    ///
    /// # Errors
    /// What cannot be read, with its line.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(OutputError::read(path))?;
        let refuse = |line: u64, message: String| {
            Error::Refused(format!("{}:{line}: {message}", path.display()))
        };
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(bytes.as_slice());
        let wrong = |error: csv::Error| {
            let line = error.position().map_or(1, csv::Position::line);
            refuse(line, error.to_string())
        };
        let titles: Vec<String> =
            reader.headers().map_err(wrong)?.iter().map(str::to_owned).collect();
        if let [only] = &titles[..]
            && only.contains([';', '\t'])
        {
            return Err(refuse(1, format!("{only:?}: columns are separated by commas")));
        }
        if titles.iter().any(|title| title.is_empty() || title.parse::<f64>().is_ok()) {
            let message = "expected a head, the names of the columns, as t,mean(uz)";
            return Err(refuse(1, message.to_owned()));
        }
        if let Some(twice) = titles.iter().enumerate().find(|(k, t)| titles[..*k].contains(t)) {
            return Err(refuse(1, format!("the column {} is there twice", twice.1)));
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(wrong)?;
            let line = record.position().map_or(1, csv::Position::line);
            let cell = |(text, title): (&str, &String)| match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ if text.is_empty() => Ok(None),
                _ => Err(refuse(line, format!("{title}: expected a number, not {text:?}"))),
            };
            let cells = record.iter().zip(&titles).map(cell).collect::<Result<_>>()?;
            rows.push(Row { line, cells });
        }
        Ok(Self { path: path.to_owned(), titles, rows })
    }

    fn column(&self, title: &str) -> Option<usize> {
        self.titles.iter().position(|other| other == title)
    }

    fn refused(&self, line: u64, message: &str) -> Error {
        Error::Refused(format!("{}:{line}: {message}", self.path.display()))
    }

    /// The values that `model` is to have.
    ///
    /// # Errors
    /// Columns that are no measures, places off the sheet, times after `until`, missing times, errors that are not above 0.
    pub(super) fn bind(&self, model: &Model, until: f64) -> Result<Bound> {
        let (t, axes) = (self.column("t"), ["x", "y", "z"].map(|axis| self.column(axis)));
        let at_places = axes[0].is_some() && axes[1].is_some();
        let quantities = self.quantities(model, at_places)?;
        let has_errors = quantities.iter().all(|quantity| quantity.sigma.is_some());
        if !has_errors && quantities.iter().any(|quantity| quantity.sigma.is_some()) {
            let message =
                "some columns have standard errors and others have none: give all or none";
            return Err(self.refused(1, message));
        }
        let mut times = Vec::new();
        for row in t.iter().flat_map(|_| &self.rows) {
            match t.and_then(|t| row.cells[t]) {
                Some(time) if (0.0..=until).contains(&time) => times.push(time),
                Some(time) => {
                    let message =
                        format!("t = {time}: expected a time from 0 to time.until = {until}");
                    return Err(self.refused(row.line, &message));
                }
                None => return Err(self.refused(row.line, "it has no time")),
            }
        }
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        let spreads: Vec<f64> = quantities.iter().map(|q| self.spread(q.column)).collect();
        let mut data = Vec::new();
        for row in &self.rows {
            let time = t.and_then(|t| row.cells[t]);
            let moment = time.map_or(0, |time| times.partition_point(|other| *other < time));
            let place = match at_places {
                true => Some(self.place(row, axes, model)?),
                false => None,
            };
            for (number, quantity) in quantities.iter().enumerate() {
                let Some(value) = row.cells[quantity.column] else { continue };
                let sigma = match quantity.sigma {
                    None => spreads[number],
                    Some(column) => match row.cells[column] {
                        Some(sigma) if sigma > 0.0 => sigma,
                        _ => {
                            let title = &self.titles[column];
                            let message = format!("{title}: expected a number above 0");
                            return Err(self.refused(row.line, &message));
                        }
                    },
                };
                let title = self.titles[quantity.column].clone();
                let place = place.clone();
                let line = row.line;
                data.push(Datum { line, title, value, sigma, moment, quantity: number, place });
            }
        }
        Ok(Bound { quantities, data, times, has_errors })
    }

    fn quantities(&self, model: &Model, at_places: bool) -> Result<Vec<Quantity>> {
        let origin = format!("{}: column", self.path.display());
        let mut quantities = Vec::new();
        for (column, title) in self.titles.iter().enumerate() {
            let of_place = at_places && ["x", "y", "z"].contains(&&**title);
            if let Some(of) = title.strip_prefix(SIGMA) {
                if self.column(of).is_none() {
                    let message = format!("{title}: the column {of} is missing");
                    return Err(self.refused(1, &message));
                }
            } else if title != "t" && !of_place {
                let text = if at_places { format!("integral({title})") } else { title.clone() };
                let measure = Measure::parse(&origin, &text, model)?;
                let sigma = self.column(&format!("{SIGMA}{title}"));
                quantities.push(Quantity { column, measure, sigma });
            }
        }
        match quantities.is_empty() {
            true => Err(self.refused(1, "expected a column of a measure, as mean(uz)")),
            false => Ok(quantities),
        }
    }

    /// Standard deviation of a column, or the size of its values where they are the same.
    fn spread(&self, column: usize) -> f64 {
        let values: Vec<f64> = self.rows.iter().filter_map(|row| row.cells[column]).collect();
        let n = real(values.len().max(1));
        let mean = values.iter().sum::<f64>() / n;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
        let size = values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        match (spread > 1e-9 * size, size > 0.0) {
            (true, _) => spread,
            (false, true) => size,
            (false, false) => 1.0,
        }
    }

    /// The place of a row as a mean over points.
    fn place(
        &self,
        row: &Row,
        axes: [Option<usize>; 3],
        model: &Model,
    ) -> Result<Vec<(usize, f64)>> {
        let mut at = Vec3::zeros();
        for (axis, column) in axes.into_iter().enumerate() {
            match column.map(|column| row.cells[column]) {
                Some(Some(value)) => at[axis] = value,
                None if axis == 2 => {}
                _ => return Err(self.refused(row.line, "it has no place")),
            }
        }
        let sheet = model.sheet();
        let Some((triangle, weights, distance)) = nearest(sheet, at) else {
            return Err(self.refused(row.line, "the sheet has no triangles"));
        };
        let [a, b, c] = sheet.triangles()[triangle].map(|v| sheet.rest()[v as usize]);
        let length = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        if distance > OFF_SHEET * length {
            let message =
                format!("({}, {}, {}) lies {distance:.3} off the sheet at rest", at.x, at.y, at.z);
            return Err(self.refused(row.line, &message));
        }
        let law = model.chemistry().map(|chemistry| chemistry.location());
        Ok(match law.is_some_and(|location| location != Location::Vertex) {
            true => vec![(triangle, 1.0)],
            false => {
                let corners = sheet.triangles()[triangle];
                corners.iter().map(|v| *v as usize).zip(weights).collect()
            }
        })
    }
}

impl Bound {
    /// What `model` has in place of every value, in its `states` at the times.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(super) fn evaluate(&self, model: &Model, states: &[State]) -> Result<Vec<f64>> {
        let mut known: Vec<Vec<Option<Vec<f64>>>> =
            states.iter().map(|_| vec![None; self.quantities.len()]).collect();
        let value = |datum: &Datum| -> Result<f64> {
            let (quantity, state) = (&self.quantities[datum.quantity], &states[datum.moment]);
            let known = &mut known[datum.moment][datum.quantity];
            let values = match known {
                Some(values) => values,
                None => {
                    let field = match datum.place {
                        Some(_) => quantity.measure.field(model, state),
                        None => Some(vec![quantity.measure.value(model, state)?]),
                    };
                    known.insert(field.unwrap_or_default())
                }
            };
            let first = [(0, 1.0)];
            let place = datum.place.as_deref().unwrap_or(&first);
            Ok(place.iter().map(|(point, weight)| weight * values[*point]).sum())
        };
        self.data.iter().map(value).collect()
    }
}

/// The triangle nearest to a place at rest, the weights of its corners there, and the distance.
fn nearest(sheet: &Sheet, at: Vec3) -> Option<(usize, [f64; 3], f64)> {
    let rest = sheet.rest();
    let all = sheet.triangles().iter().enumerate().map(|(triangle, corners)| {
        let corners = corners.map(|v| rest[v as usize]);
        let weights = weights(corners, at);
        let near: Vec3 = corners.iter().zip(weights).map(|(corner, w)| corner * w).sum();
        (triangle, weights, (at - near).norm())
    });
    all.min_by(|a, b| a.2.total_cmp(&b.2))
}

/// Barycentric coordinates of the point of a triangle that is nearest to `at`.
fn weights([a, b, c]: [Vec3; 3], at: Vec3) -> [f64; 3] {
    let (u, v, w) = (b - a, c - a, at - a);
    let (uu, uv, vv, wu, wv) = (u.dot(&u), u.dot(&v), v.dot(&v), w.dot(&u), w.dot(&v));
    let area = uu * vv - uv * uv;
    let (s, t) = ((vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return [1.0 - s - t, s, t];
    }
    // Outside: on the nearest of the three sides.
    let on_side = |from: Vec3, to: Vec3| {
        let side = to - from;
        let share = ((at - from).dot(&side) / side.dot(&side)).clamp(0.0, 1.0);
        (share, (at - from - share * side).norm())
    };
    let sides = [(0, 1, on_side(a, b)), (1, 2, on_side(b, c)), (2, 0, on_side(c, a))];
    let mut best = sides[0];
    sides.iter().for_each(|side| {
        if side.2.1 < best.2.1 {
            best = *side;
        }
    });
    let mut weights = [0.0; 3];
    (weights[best.0], weights[best.1]) = (1.0 - best.2.0, best.2.0);
    weights
}
