//! What L-BFGS keeps from one relaxation to the next, in a checkpoint.
//!
//! Of the factor the matrix is written that it was made of, and it is made again: the same bits. The
//! memory of steps restarts with every relaxation.

use std::sync::Arc;

use super::super::preconditioner::{Inverse, Learnt, Preconditioner};
use super::Lbfgs;
use crate::Vec3;
use crate::linear::BlockMatrix;
use crate::model::Mechanics;
use crate::record::{Malformed, Reading, Record};

/// How the factor was made, besides its matrix.
#[derive(Debug, Default)]
pub(super) struct Made {
    /// At which shape; empty where only the matrix matters.
    pub(super) x: Vec<Vec3>,
    /// Whether it was to succeed at some expense.
    pub(super) insist: bool,
}

impl Lbfgs {
    pub(super) fn write(&self, record: &mut Record) {
        record.flag(self.kind == Preconditioner::Multigrid);
        record.numbers(&[self.weight, self.shift]);
        record.count(self.refresh as u64);
        self.inverse.store(record);
        record.flag(self.factored);
        if !self.factored {
            return;
        }
        self.gauge.store(record);
        if self.inverse.is_learnt() {
            return;
        }
        let pattern = self.matrix.pattern();
        // Pairs of the moment are a part of it.
        let pairs = (0..pattern.rows()).flat_map(|i| pattern.row(i).iter().map(move |j| (i, *j)));
        record.option(self.of_the_moment.then_some(pairs), |record, pairs| {
            record.count(pattern.start(pattern.rows()) as u64);
            pairs.for_each(|(i, j)| record.count((i as u64) << 32 | u64::from(j)));
        });
        self.matrix.store(record);
        record.points(&self.made.x);
        record.flag(self.made.insist);
        self.inverse.store_terms(record);
    }

    pub(super) fn read(
        &mut self,
        reading: &mut Reading<'_>,
        mechanics: &Mechanics,
    ) -> Result<(), Malformed> {
        let multigrid = reading.flag()?;
        self.kind = match self.options.preconditioner {
            Preconditioner::Auto if multigrid => Preconditioner::Multigrid,
            Preconditioner::Auto => Preconditioner::Factor,
            chosen => chosen,
        };
        let [weight, shift] = reading.numbers()?[..] else { return Err(Malformed) };
        (self.weight, self.shift) = (weight, shift);
        self.refresh = reading.size()?;
        let vertices = mechanics.sheet().vertex_count();
        let learnt = Inverse::read(reading, self.kind, vertices)?;
        self.factored = reading.flag()?;
        let mut pattern = Arc::clone(mechanics.pattern());
        if self.factored {
            self.gauge.restore(reading, vertices)?;
        }
        let matrix = if self.factored && self.kind != Preconditioner::None {
            let pairs = reading.option(|reading| {
                let count = reading.size()?;
                let half = |bits: u64| u32::try_from(bits & u64::from(u32::MAX)).unwrap_or(0);
                let pair = |bits: u64| [half(bits >> 32), half(bits)];
                (0..count).map(|_| reading.count().map(pair)).collect::<Result<Vec<_>, _>>()
            })?;
            self.of_the_moment = pairs.is_some();
            if let Some(pairs) = pairs {
                let inside = |v: &u32| (*v as usize) < vertices;
                if !pairs.iter().flatten().all(inside) {
                    return Err(Malformed);
                }
                pattern = mechanics.pattern_with(&pairs);
            }
            let mut matrix = BlockMatrix::zeros(Arc::clone(&pattern));
            matrix.restore(reading)?;
            Some(matrix)
        } else {
            None
        };
        let precision = self.options.precision;
        self.inverse = Inverse::new(self.kind, precision, &pattern, mechanics.tally())
            .map_err(|_| Malformed)?;
        let later = match learnt {
            Learnt::Solver(_) => self.inverse.take(learnt).map(|()| None)?,
            learnt => Some(learnt),
        };
        if let Some(matrix) = matrix {
            let x = reading.numbers()?;
            let x: Vec<Vec3> = x.as_chunks::<3>().0.iter().map(|x| Vec3::from(*x)).collect();
            let insist = reading.flag()?;
            let terms = Inverse::read_terms(reading, vertices)?;
            if self.inverse.reads_shape() && x.len() != vertices {
                return Err(Malformed);
            }
            self.inverse.factorise(&matrix, terms, &x, insist).map_err(|_| Malformed)?;
            self.made = Made { x, insist };
            self.matrix = matrix;
        }
        later.map_or(Ok(()), |learnt| self.inverse.take(learnt))
    }
}
