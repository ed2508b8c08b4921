//! Sums over contacts: forces and second derivatives of the vertices that move, which come first.

use super::touching::ContactPair;
use crate::effects::{HessianPart, Touching};
use crate::geometry::proximity::corner_positions;
use crate::linear::{BlockMatrix, Stencils};
use crate::num::index;
use crate::{Vec3, parallel};

/// The energy of `contacts`; their gradient is added to that of the vertices that move.
pub(super) fn evaluate(contacts: &[ContactPair], gradient: Option<&mut [Vec3]>) -> f64 {
    if let Some(gradient) = gradient {
        for contact in contacts {
            let by = contact.gradient();
            for k in contact.carriers() {
                if let Some(sum) = gradient.get_mut(contact.corners[k] as usize) {
                    *sum += by[k];
                }
            }
        }
    }
    parallel::sum(contacts.len(), |k| contacts[k].energy())
}

/// Adds the second derivatives of `contacts` at `x`.
pub(super) fn add_hessian(
    contacts: &[ContactPair],
    x: &[Vec3],
    part: HessianPart,
    into: &mut BlockMatrix,
) {
    if contacts.is_empty() {
        return;
    }
    let moving = index(into.pattern().rows());
    // Places of the corners that move, in the ascending order of their vertices.
    let order = |contact: &ContactPair| {
        let moves = |k: &usize| contact.corners[*k] < moving;
        let mut places: Vec<usize> = contact.carriers().filter(moves).collect();
        places.sort_unstable_by_key(|k| contact.corners[*k]);
        places
    };
    let vertices = |contact: &ContactPair| -> Vec<u32> {
        order(contact).iter().map(|k| contact.corners[*k]).collect()
    };
    let stencils = Stencils::new(into.pattern(), contacts.iter().map(vertices));
    stencils.assemble(into, |e, sink| {
        let contact = &contacts[e];
        let (order, blocks) =
            (order(contact), contact.hessian(&corner_positions(x, &contact.corners), part));
        for (p, k) in order.iter().enumerate() {
            for (q, m) in order.iter().enumerate().skip(p) {
                sink.add(p, q, &blocks[*k][*m]);
            }
        }
    });
}

/// How many they are, and their smallest distance.
pub(super) fn touching(contacts: &[ContactPair]) -> Touching {
    let gap = contacts.iter().map(ContactPair::distance).fold(f64::INFINITY, f64::min);
    Touching { pairs: contacts.len(), gap }
}
