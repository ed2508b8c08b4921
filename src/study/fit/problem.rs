//! Residuals as the method of Levenberg and Marquardt takes them.

use std::cell::RefCell;

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra_lm::storage::Owned;
use nalgebra_lm::{DMatrix, DVector, Dyn};

use super::data::Bound;
use super::parameter::Coordinate;
use super::record::{Entry, Record};
use crate::run::{Error, Result};
use crate::solve::SolveError;
use crate::study::gradient::Objective;

/// Step of a difference, relative to the size of its parameter.
const STEP: f64 = 1e-4;
/// Changes of the model by those of parameters, relative to both, below which they are errors of differences.
pub(super) const ROUND_OFF: f64 = 1e-7;
/// Residuals of a run that fails, in those of the best one.
const FAILED: f64 = 10.0;

/// A scene beside its data.
pub(super) struct Beside {
    pub(super) objective: Objective,
    pub(super) bound: Bound,
    pub(super) record: Record,
    /// Number of evaluations.
    pub(super) count: usize,
    /// Hears of every evaluation.
    pub(super) told: Box<dyn Fn(&str)>,
}

impl Beside {
    /// What the model has beside the data at p; none where the run fails.
    ///
    /// # Errors
    /// An interrupt; a record that cannot be written.
    fn model(&mut self, p: &[f64]) -> Result<std::result::Result<Vec<f64>, Error>> {
        self.count += 1;
        let before = self.objective.schedule().cloned();
        if let Some(known) = self.record.find(p) {
            if let Some(schedule) = &known.schedule {
                self.objective.keep_schedule(schedule.clone());
            }
            let failed = || Error::Refused("the run failed when this was recorded".to_owned());
            return Ok(known.model.clone().ok_or_else(failed));
        }
        let values: Vec<Vec<f64>> = p.iter().map(|value| vec![*value]).collect();
        let found = self.objective.states(&values);
        let found = found.and_then(|(model, states)| self.bound.evaluate(&model, &states));
        let found = found.and_then(|values| match values.iter().all(|value| value.is_finite()) {
            true => Ok(values),
            false => Err(Error::Solve(SolveError::NotFinite)),
        });
        if let Err(Error::Solve(SolveError::Interrupted)) = found {
            return found.map(Ok);
        }
        let schedule = self.objective.schedule().filter(|now| Some(*now) != before.as_ref());
        self.record.add(Entry {
            values: p.to_vec(),
            model: found.as_ref().ok().cloned(),
            schedule: schedule.cloned(),
        })?;
        Ok(found)
    }

    /// (f(p) - y)/σ; none where the run fails.
    pub(super) fn residuals(
        &mut self,
        p: &[f64],
    ) -> Result<std::result::Result<DVector<f64>, Error>> {
        let found = self.model(p)?;
        Ok(found.map(|model| {
            let data = self.bound.data.iter().zip(&model);
            let rows = data.map(|(datum, model)| (model - datum.value) / datum.sigma);
            DVector::from_iterator(model.len(), rows)
        }))
    }

    fn tell(&self, chi: f64, p: &[f64]) {
        let values: Vec<String> = p.iter().map(|p| format!("{p:.6e}")).collect();
        (self.told)(&format!(
            "evaluation {}: chi^2 = {chi:.6e} at {}",
            self.count,
            values.join(", ")
        ));
    }

    /// ∂r/∂p by central differences, with the steps of the replay held fixed.
    pub(super) fn jacobian(
        &mut self,
        (p, here): (&[f64], &DVector<f64>),
        coordinates: &[Coordinate],
    ) -> Result<DMatrix<f64>> {
        let size = self.size(here);
        let mut jacobian = DMatrix::zeros(here.len(), p.len());
        for (j, coordinate) in coordinates.iter().enumerate() {
            let step = STEP * coordinate.scale(p[j]);
            let mut at = |value: f64| {
                let mut moved = p.to_vec();
                moved[j] = value;
                self.residuals(&moved)
            };
            let (above, below) = (coordinate.moved(p[j], step), coordinate.moved(p[j], -step));
            // One-sided where the scene has no value on the other side.
            let column = match (at(above)?, at(below)?) {
                (Ok(plus), Ok(minus)) => (plus - minus) / (above - below),
                (Ok(plus), Err(_)) => (plus - here) / (above - p[j]),
                (Err(_), Ok(minus)) => (here - minus) / (p[j] - below),
                (Err(error), Err(_)) => return Err(error),
            };
            // By round-off alone a parameter would go anywhere.
            if coordinate.scale(p[j]) * column.norm() > ROUND_OFF * size {
                jacobian.set_column(j, &column);
            }
        }
        Ok(jacobian)
    }

    /// |f/σ|, or |y/σ| if that is larger.
    fn size(&self, residuals: &DVector<f64>) -> f64 {
        let data = || self.bound.data.iter().map(|datum| datum.value / datum.sigma);
        let model = data().zip(residuals.iter()).map(|(y, r)| y + r);
        let norm = |sum: f64| sum.sqrt();
        norm(data().map(|y| y * y).sum()).max(norm(model.map(|f| f * f).sum()))
    }
}

/// One start of the method.
pub(super) struct Descent<'a> {
    beside: RefCell<&'a mut Beside>,
    coordinates: &'a [Coordinate],
    /// p in the scene.
    start: &'a [f64],
    /// What keeps p near it.
    weight: f64,
    u: DVector<f64>,
    /// Those of the data.
    residuals: Option<DVector<f64>>,
    /// χ² of the best point.
    best: f64,
    pub(super) error: RefCell<Option<Error>>,
}

impl<'a> Descent<'a> {
    /// At u.
    ///
    /// # Errors
    /// A run that fails there.
    pub(super) fn new(
        beside: &'a mut Beside,
        (coordinates, start): (&'a [Coordinate], &'a [f64]),
        u: Vec<f64>,
    ) -> Result<Self> {
        let u = DVector::from_vec(u);
        let p: Vec<f64> = coordinates.iter().zip(u.iter()).map(|(c, u)| c.value(*u)).collect();
        let residuals = beside.residuals(&p)??;
        let best = residuals.norm_squared();
        beside.tell(best, &p);
        let weight = ROUND_OFF * beside.size(&residuals);
        let (beside, error) = (RefCell::new(beside), RefCell::new(None));
        Ok(Self { beside, coordinates, start, weight, u, residuals: Some(residuals), best, error })
    }

    /// p.
    pub(super) fn values(&self) -> Vec<f64> {
        self.coordinates.iter().zip(self.u.iter()).map(|(c, u)| c.value(*u)).collect()
    }

    /// χ².
    pub(super) fn chi_squared(&self) -> f64 {
        self.residuals.as_ref().map_or(f64::INFINITY, DVector::norm_squared)
    }

    fn keep<R>(&self, done: Result<R>) -> Option<R> {
        match done {
            Ok(done) => Some(done),
            Err(error) => {
                *self.error.borrow_mut() = Some(error);
                None
            }
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Descent<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, u: &DVector<f64>) {
        if self.u == *u {
            return;
        }
        self.u.copy_from(u);
        let p = self.values();
        let done = self.beside.borrow_mut().residuals(&p);
        let Some(found) = self.keep(done) else {
            self.residuals = None;
            return;
        };
        let beside = self.beside.borrow();
        let failed = || {
            let count = beside.bound.data.len();
            let size = FAILED * (self.best / crate::num::real(count.max(1))).sqrt();
            DVector::from_element(count, if size > 0.0 { size } else { 1.0 })
        };
        let residuals = found.unwrap_or_else(|_| failed());
        let chi = residuals.norm_squared();
        self.best = self.best.min(chi);
        beside.tell(chi, &p);
        drop(beside);
        self.residuals = Some(residuals);
    }

    fn params(&self) -> DVector<f64> {
        self.u.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let (p, data) = (self.values(), self.residuals.as_ref()?);
        let all = self.coordinates.iter().zip(self.start).zip(p);
        let away = all.map(|((c, start), p)| self.weight * (p - start) / c.scale(*start));
        let rows = data.iter().copied().chain(away);
        Some(DVector::from_iterator(data.len() + self.start.len(), rows))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let (p, here) = (self.values(), self.residuals.as_ref()?);
        let done = self.beside.borrow_mut().jacobian((&p, here), self.coordinates);
        let mut jacobian = self.keep(done)?.insert_rows(here.len(), p.len(), 0.0);
        for (j, coordinate) in self.coordinates.iter().enumerate() {
            jacobian[(here.len() + j, j)] = self.weight / coordinate.scale(self.start[j]);
            jacobian.column_mut(j).scale_mut(coordinate.slope(self.u[j]));
        }
        Some(jacobian)
    }
}
