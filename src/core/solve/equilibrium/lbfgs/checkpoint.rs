//! What L-BFGS keeps from one relaxation to the next, in a checkpoint.
//!
//! Of the factor its matrix is written, and refactorised when read: the same bits. The
//! memory of steps restarts with every relaxation.

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::super::preconditioner::{HessianInverse, Learnt, Preconditioner};
use super::Lbfgs;
use crate::Vec3;
use crate::effects::RankOneTerm;
use crate::linear::{BlockMatrix, BlockValues};
use crate::model::Mechanics;
use crate::record::{Malformed, Record};
use crate::solve::equilibrium::lbfgs::FactorSettings;

/// All that later relaxations depend on.
#[derive(Serialize, Deserialize)]
pub(super) struct LbfgsState<'a> {
    multigrid: bool,
    weight: f64,
    shift: f64,
    refresh: usize,
    learnt: Learnt,
    /// None before the first.
    factor: Option<Factor<'a>>,
}

#[derive(Serialize, Deserialize)]
struct Factor<'a> {
    /// Rigid motions that are taken out.
    motions: Cow<'a, [Vec<Vec3>]>,
    matrix: Matrix<'a>,
}

#[derive(Serialize, Deserialize)]
struct Matrix<'a> {
    /// Its pattern, where pairs of the moment are a part of it.
    pairs: Option<Vec<[u32; 2]>>,
    values: Cow<'a, BlockValues>,
    made: Cow<'a, FactorSettings>,
    terms: Cow<'a, [RankOneTerm]>,
}

impl Lbfgs {
    /// Its [`LbfgsState`].
    pub(super) fn written(&self) -> Record {
        Record::encode(&LbfgsState {
            multigrid: self.kind == Preconditioner::Multigrid,
            weight: self.factor.weight,
            shift: self.factor.shift,
            refresh: self.factor.refresh,
            learnt: self.inverse.learnt(),
            factor: self.factor.ready.then(|| Factor {
                motions: Cow::Borrowed(self.gauge.motions()),
                matrix: self.matrix_memory(),
            }),
        })
    }

    fn matrix_memory(&self) -> Matrix<'_> {
        let pattern = self.matrix.pattern();
        let pairs = (0..pattern.rows())
            .flat_map(|i| pattern.row(i).iter().map(move |j| [u32::try_from(i).unwrap_or(*j), *j]));
        Matrix {
            pairs: self.of_the_moment.then(|| pairs.collect()),
            values: Cow::Borrowed(self.matrix.values()),
            made: Cow::Borrowed(&self.made),
            terms: Cow::Borrowed(self.inverse.terms()),
        }
    }

    pub(super) fn take_over(
        &mut self,
        memory: LbfgsState<'_>,
        mechanics: &Mechanics,
    ) -> Result<(), Malformed> {
        let LbfgsState { multigrid, weight, shift, refresh, learnt, factor } = memory;
        let reduction = mechanics.sheet().reduction();
        self.kind = match self.options.preconditioner {
            auto @ Preconditioner::Auto if reduction.ranks().is_some() => {
                auto.for_ranks(reduction, mechanics.sheet().vertex_count(), false)
            }
            Preconditioner::Auto if multigrid => Preconditioner::Multigrid,
            Preconditioner::Auto => Preconditioner::Factor,
            chosen => chosen,
        };
        (self.factor.weight, self.factor.shift, self.factor.refresh) = (weight, shift, refresh);
        self.factor.ready = factor.is_some();
        let mut matrix = None;
        if let Some(factor) = factor {
            let vertices = mechanics.sheet().vertex_count();
            self.gauge.restore(factor.motions.into_owned(), (vertices, reduction))?;
            matrix = Some(factor.matrix);
        }
        let pattern = match matrix.as_ref().map(|matrix| &matrix.pairs) {
            Some(Some(pairs)) => {
                let vertices = mechanics.sheet().vertex_count();
                if !pairs.iter().flatten().all(|v| (*v as usize) < vertices) {
                    return Err(Malformed);
                }
                self.of_the_moment = true;
                mechanics.pattern_with(pairs)
            }
            _ => Arc::clone(mechanics.pattern()),
        };
        self.inverse = HessianInverse::new(self.kind, self.options.precision, &pattern, mechanics)
            .map_err(|_| Malformed)?;
        let (before, after) = match learnt {
            Learnt::Solver(_) => (Some(learnt), None),
            learnt => (None, Some(learnt)),
        };
        before.map_or(Ok(()), |learnt| self.inverse.restore(learnt))?;
        if let Some(matrix) = matrix {
            self.factorise_again(matrix, BlockMatrix::zeros(pattern))?;
        }
        after.map_or(Ok(()), |learnt| self.inverse.restore(learnt))
    }

    /// Makes the factor of a matrix that was written.
    fn factorise_again(
        &mut self,
        memory: Matrix<'_>,
        mut matrix: BlockMatrix,
    ) -> Result<(), Malformed> {
        let Matrix { pairs, values, made, terms } = memory;
        let (made, terms) = (made.into_owned(), terms.into_owned());
        matrix.set_values(values.into_owned())?;
        let vertices = matrix.pattern().rows();
        let fits = !self.inverse.reads_shape() || made.x.len() == vertices;
        if !fits || terms.iter().any(|term| term.direction.len() != vertices) {
            return Err(Malformed);
        }
        self.of_the_moment = pairs.is_some();
        self.inverse.factorise(&matrix, terms, &made.x, made.insist).map_err(|_| Malformed)?;
        (self.made, self.matrix) = (made, matrix);
        Ok(())
    }
}
