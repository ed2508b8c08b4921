//! What of the chemistry depends on the shape alone, each transport's operator on it once.

use std::sync::Arc;

use crate::effects::{Operator, TransportTerm};
use crate::geometry::FaceVertexAverage;

/// What of the chemistry depends on the shape alone.
#[derive(Default)]
pub struct Surface {
    /// How values on faces are carried to vertices, if species live there.
    pub average: Option<FaceVertexAverage>,
    /// The operators of the transports, each once.
    pub(super) operators: Vec<Operator>,
    /// Which of them belongs to each of [`Chemistry::transports`].
    pub(super) which: Arc<[usize]>,
}

impl Surface {
    /// The operators in the order of [`Chemistry::transports`](super::super::Chemistry::transports).
    pub fn operators(&self) -> impl Iterator<Item = &Operator> {
        self.which.iter().map(|k| &self.operators[*k])
    }
}

/// Numbers of the operators that transports have: one that serves several is made once.
pub(super) fn distinct_operators(transports: &[TransportTerm]) -> Arc<[usize]> {
    let (mut which, mut count) = (Vec::new(), 0);
    for (k, term) in transports.iter().enumerate() {
        let same = transports[..k].iter().position(|earlier| term.has_operator_of(earlier));
        which.push(same.map_or(count, |earlier| which[earlier]));
        count += usize::from(same.is_none());
    }
    which.into()
}
