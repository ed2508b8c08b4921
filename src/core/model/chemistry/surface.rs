//! What of the chemistry depends on the shape alone, each transport's operator on it once.

use std::sync::Arc;

use super::super::counters::transport::SHAPE;
use super::Chemistry;
use crate::Vec3;
use crate::effects::{Operator, TransportTerm};
use crate::geometry::FaceVertexAverage;
use crate::sheet::Sheet;

/// What of the chemistry depends on the shape alone.
#[derive(Default)]
pub struct Surface {
    /// How values on faces are carried to vertices, if species live there.
    pub average: Option<FaceVertexAverage>,
    /// The operators of the transports, each once.
    operators: Vec<Operator>,
    /// Which of them belongs to each of [`Chemistry::transports`].
    which: Arc<[usize]>,
}

impl Surface {
    /// The operators in the order of [`Chemistry::transports`].
    pub fn operators(&self) -> impl Iterator<Item = &Operator> {
        self.which.iter().map(|k| &self.operators[*k])
    }
}

impl Chemistry {
    /// Evaluates the transports on the shape `x`.
    pub fn transport(&self, sheet: &Sheet, x: &[Vec3], surface: &mut Surface) {
        surface.operators.truncate(self.transports.len());
        let mut made = 0;
        for (k, term) in self.transports.iter().enumerate() {
            // That of an earlier one.
            if self.which[k] < made {
                continue;
            }
            let _scope = self.transport_scope(k, SHAPE);
            match surface.operators.get_mut(made) {
                Some(operator) => term.assemble(sheet, x, operator),
                None => surface.operators.push(term.at(sheet, x)),
            }
            made += 1;
        }
        surface.which = Arc::clone(&self.which);
    }
}

/// Numbers of the operators that transports have: one that serves several is made once.
pub(super) fn distinct_operators(transports: &[TransportTerm]) -> Arc<[usize]> {
    let (mut which, mut count) = (Vec::new(), 0);
    for (k, term) in transports.iter().enumerate() {
        let same = transports[..k].iter().position(|earlier| term.has_operator_of(&**earlier));
        which.push(same.map_or(count, |earlier| which[earlier]));
        count += usize::from(same.is_none());
    }
    which.into()
}
