//! Parameters of a scene from data: nonlinear least squares.
//!
//! ```text
//! χ²(p) = Σ_i r_i²,    r_i = (f_i(p) - y_i)/σ_i
//! ```
//!
//! f are measures of `rumple gradient`, or fields at places, of the state at rest, or of a run at the times of the data. In time they are those of
//! the replay (`solve/replay`), whose steps are held fixed, so that χ² is smooth. Minimised by the method of Levenberg
//! and Marquardt (Moré 1978, doi:10.1007/BFb0067700, as in MINPACK) from the values of the scene, and from others within the bounds.
//!
//! ∂r/∂p is by central differences: a column costs two evaluations, whatever the number of data; parameters are few.
//!
//! Where the data do not determine p, the point nearest to the scene's values is found: χ² has the further term
//! (1e-7 |f/σ|)² Σ_j ((p_j - p⁰_j)/|p⁰_j|)², which is not reported and does not change what they do determine.

mod data;
mod parameter;
mod problem;
mod record;
mod uncertainty;

use std::path::Path;
use std::sync::Arc;

use levenberg_marquardt::{LevenbergMarquardt, TerminationReason};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

pub use self::data::Data;
pub use self::parameter::Bounded;
pub use self::uncertainty::{Direction, Uncertainty};

use self::data::Bound;
use self::parameter::Coordinate;
use self::problem::{Beside, Descent};
use self::record::Record;
use crate::kinetics::PluginSearch;
use crate::num::real;
use crate::run::{Error, Result, Simulation};
use crate::solve::Control;
use crate::study::gradient::{Objective, Place, Request, SceneSource};

/// Relative change of χ², or of the parameters, at which the method ends.
const TOLERANCE: f64 = 1e-8;
/// First step, in sizes of the parameters: far away runs fail.
const FIRST_STEP: f64 = 1.0;
/// Evaluations a parameter.
const PATIENCE: usize = 30;
/// Change of residuals from the replay to the run, in standard errors (root mean square), that is said.
const NOTABLE: f64 = 0.3;

/// What is fitted to what.
#[derive(Debug)]
pub struct FitRequest {
    /// The scene.
    pub scene: SceneSource,
    /// Its overrides.
    pub set: Vec<String>,
    /// Parameters.
    pub parameters: Vec<Bounded>,
    /// The data.
    pub data: Data,
    /// Whether data without times are those of the first equilibrium rather than of the end.
    pub at_start: bool,
    /// Number of starts.
    pub starts: u16,
}

/// Parameters that were found.
#[derive(Debug, Serialize)]
pub struct Fitted {
    /// Their keys.
    pub keys: Vec<String>,
    /// Their values in the scene.
    pub start: Vec<f64>,
    /// Those of the least χ².
    pub values: Vec<f64>,
    /// Which of them lie at a bound.
    pub at_bound: Vec<bool>,
    /// χ².
    pub chi_squared: f64,
    /// χ² at the end of every start; none where its run fails.
    pub starts: Vec<Option<f64>>,
    /// Number of data.
    pub data: usize,
    /// Whether their standard errors were given.
    pub has_errors: bool,
    /// How well they are determined.
    pub uncertainty: Uncertainty,
    /// Number of evaluations.
    pub evaluations: usize,
    /// χ² of the run itself, where the data are in time.
    pub chi_squared_of_run: Option<f64>,
    /// What makes the result doubtful.
    pub doubts: Vec<String>,
    /// The data with the values of the model.
    #[serde(skip)]
    pub table: Vec<FittedRow>,
}

/// A value beside that of the model.
#[derive(Debug, Clone)]
pub struct FittedRow {
    /// Its line in the file.
    pub line: u64,
    /// Its column.
    pub column: String,
    /// The value.
    pub value: f64,
    /// Its standard error, or the spread of its column.
    pub sigma: f64,
    /// That of the model.
    pub model: f64,
}

/// A fit that is set up.
pub struct Fit {
    objective: Objective,
    bound: Bound,
    parameters: Vec<Bounded>,
    coordinates: Vec<Coordinate>,
    start: Vec<f64>,
    starts: u16,
}

impl Fit {
    /// Reads the scene and what the data are of; runs nothing.
    ///
    /// # Errors
    /// Keys, bounds or data that do not fit the scene; a scene that is not covered.
    pub fn new(request: FitRequest, search: PluginSearch, control: Control) -> Result<Self> {
        let FitRequest { scene: source, set, parameters, data, at_start, starts } = request;
        let scene = source.scene(&set, &[], "--with")?;
        let model = Arc::clone(Simulation::new(&scene, &search)?.model());
        let bound = data.bind(&model, scene.time.span.until.get())?;
        let (count, m) = (bound.data.len(), parameters.len());
        if count < m {
            return Err(Error::Refused(format!("{count} values determine no {m} parameters")));
        }
        if bound.times.is_empty() && !model.moves() {
            let message = "the data have no column t, and without it they are those of a shape at rest: the scene moves no shape";
            return Err(Error::Refused(message.to_owned()));
        }
        let place = match (bound.times.is_empty(), at_start) {
            (false, true) => {
                return Err(Error::Refused(
                    "--at-start: the data have times: leave one of the two out".to_owned(),
                ));
            }
            (false, false) => Place::InTime(bound.times.clone()),
            (true, true) => Place::Start,
            (true, false) => Place::End,
        };
        let numbers: Vec<String> = parameters.iter().map(|p| p.key.clone()).collect();
        let request = Request {
            scene: source,
            set,
            measures: Vec::new(),
            numbers,
            fields: Vec::new(),
            place,
        };
        let objective = Objective::new(request, search, control)?;
        let start: Vec<f64> = objective.values().concat();
        let coordinates =
            parameters.iter().zip(&start).map(|(p, start)| Coordinate::new(p, *start));
        let coordinates = coordinates.collect::<Result<Vec<_>>>()?;
        if starts > 1 && coordinates.iter().any(|c| c.at_share(0.5).is_none()) {
            return Err(Error::Refused(
                "--starts: others than that of the scene need two bounds of every parameter, as --with KEY=LOW:HIGH"
                    .to_owned(),
            ));
        }
        Ok(Self { objective, bound, parameters, coordinates, start, starts })
    }

    /// Fits, with a record of all evaluations in the file `record`, which a fit that was interrupted continues from; `told` hears of every step.
    ///
    /// # Errors
    /// The scene's own values with which its run fails; an interrupt; a record that cannot be written.
    pub fn run(self, record: &Path, told: Box<dyn Fn(&str)>) -> Result<Fitted> {
        let Self { objective, bound, parameters, coordinates, start, starts } = self;
        let record = Record::open(record)?;
        let beside = Beside { objective, bound, record, count: 0, told };
        let mut search = Search { beside, coordinates, start, doubts: Vec::new() };
        let (ends, best) = search.descend(starts)?;
        search.result(parameters, ends, best)
    }
}

/// A fit in progress.
struct Search {
    beside: Beside,
    coordinates: Vec<Coordinate>,
    /// p in the scene.
    start: Vec<f64>,
    doubts: Vec<String>,
}

impl Search {
    /// Descends from the scene's values and from others within the bounds; χ² at every end, and the best p.
    fn descend(&mut self, starts: u16) -> Result<(Vec<Option<f64>>, Vec<f64>)> {
        let mut noise = ChaCha8Rng::seed_from_u64(1);
        let mut ends = Vec::new();
        let mut best: Option<(f64, Vec<f64>)> = None;
        for number in 0..starts.max(1) {
            let from: Vec<f64> = match number {
                0 => {
                    let all = self.coordinates.iter().zip(&self.start);
                    all.map(|(coordinate, p)| coordinate.inverse(*p)).collect()
                }
                // sin u = 2 share - 1, the share at random.
                _ => {
                    self.start.iter().map(|_| noise.random_range(-0.96..0.96_f64).asin()).collect()
                }
            };
            match self.descend_once(from) {
                Ok((chi, values)) => {
                    ends.push(Some(chi));
                    if best.as_ref().is_none_or(|(least, _)| chi < *least) {
                        best = Some((chi, values));
                    }
                }
                // The values of the scene are to run; others may not.
                Err(error) if number == 0 || is_interrupt(&error) => return Err(error),
                Err(_) => ends.push(None),
            }
        }
        let values = best.map(|(_, values)| values).unwrap_or_default();
        Ok((ends, values))
    }

    fn descend_once(&mut self, u: Vec<f64>) -> Result<(f64, Vec<f64>)> {
        let descent = Descent::new(&mut self.beside, (&self.coordinates, &self.start), u)?;
        let method = LevenbergMarquardt::new()
            .with_ftol(TOLERANCE)
            .with_xtol(TOLERANCE)
            .with_gtol(TOLERANCE)
            .with_stepbound(FIRST_STEP)
            .with_patience(PATIENCE);
        let (descent, report) = method.minimize(descent);
        if let Some(error) = descent.error.take() {
            return Err(error);
        }
        let (chi, values) = (descent.chi_squared(), descent.values());
        match report.termination {
            TerminationReason::LostPatience => self.doubts.push(format!(
                "a start did not converge within {} evaluations",
                report.number_of_evaluations
            )),
            TerminationReason::Numerical(what) => {
                self.doubts.push(format!("a start ended early: {what} is not a number"));
            }
            _ => {}
        }
        Ok((chi, values))
    }

    /// What the best p says.
    fn result(
        mut self,
        parameters: Vec<Bounded>,
        starts: Vec<Option<f64>>,
        values: Vec<f64>,
    ) -> Result<Fitted> {
        let here = self.beside.residuals(&values)??;
        let jacobian = self.beside.jacobian((&values, &here), &self.coordinates)?;
        let chi_squared = here.norm_squared();
        let (count, m) = (here.len(), values.len());
        let has_errors = self.beside.bound.has_errors;
        let variance = if has_errors { 1.0 } else { chi_squared / real((count - m).max(1)) };
        let scaled = self.coordinates.iter().zip(&values).map(|(c, p)| c.scale(*p));
        let scales: Vec<f64> = scaled.collect();
        let jacobian = nalgebra::DMatrix::from_column_slice(count, m, jacobian.as_slice());
        let uncertainty = Uncertainty::new(&jacobian, &scales, variance);
        let chi_squared_of_run = self.of_run(&values, &here)?;
        let Self { beside, coordinates, start, doubts } = self;
        let at_bound = coordinates.iter().zip(&values).map(|(c, p)| c.at_bound(*p)).collect();
        let row = |(datum, residual): (&data::Datum, &f64)| FittedRow {
            line: datum.line,
            column: datum.title.clone(),
            value: datum.value,
            sigma: datum.sigma,
            model: datum.value + residual * datum.sigma,
        };
        Ok(Fitted {
            keys: parameters.into_iter().map(|p| p.key).collect(),
            start,
            at_bound,
            chi_squared,
            starts,
            data: count,
            has_errors,
            uncertainty,
            evaluations: beside.count,
            chi_squared_of_run,
            doubts,
            table: beside.bound.data.iter().zip(here.iter()).map(row).collect(),
            values,
        })
    }

    /// χ² of the run itself; a difference that matters is a doubt.
    fn of_run(&mut self, values: &[f64], here: &nalgebra_lm::DVector<f64>) -> Result<Option<f64>> {
        let Beside { objective, bound, .. } = &mut self.beside;
        if bound.times.is_empty() {
            return Ok(None);
        }
        let lists: Vec<Vec<f64>> = values.iter().map(|value| vec![*value]).collect();
        let (model, states) = objective.run(&lists, &bound.times)?;
        let model = bound.evaluate(&model, &states)?;
        let of_run = bound.data.iter().zip(model).map(|(d, model)| (model - d.value) / d.sigma);
        let of_run: Vec<f64> = of_run.collect();
        let gap: f64 = of_run.iter().zip(here.iter()).map(|(a, b)| (a - b).powi(2)).sum();
        let gap = (gap / real(of_run.len().max(1))).sqrt();
        if gap > NOTABLE {
            self.doubts.push(format!(
                "the run differs from its replay by {gap:.2} standard errors: a snap, or a tolerance that is too loose"
            ));
        }
        Ok(Some(of_run.iter().map(|r| r * r).sum()))
    }
}

fn is_interrupt(error: &Error) -> bool {
    matches!(error, Error::Solve(crate::solve::SolveError::Interrupted))
}
