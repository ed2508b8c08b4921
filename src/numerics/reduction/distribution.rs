//! Points that are spread over ranks: what a rank owns, and copies of what its neighbours own.
//!
//! ```text
//! points of a rank:   owned | ghosts        ghosts: copies of points that other ranks own
//! update              owner → ghosts        every copy becomes what its owner has
//! ```
//!
//! A rank evaluates all elements that touch what it owns ("owner computes"), so that gradients and rows of matrices at
//! owned points are complete without a sum over ranks; ghosts of two rings of neighbours make that possible.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::Vec3;

/// Communication between ranks. All ranks call the same methods in the same order.
pub trait Communicator: Send + Sync {
    /// The number of this rank, from 0.
    fn rank(&self) -> usize;

    /// How many ranks there are.
    fn size(&self) -> usize;

    /// Replaces every number by its sum over the ranks; the same bits on each.
    fn sum(&self, values: &mut [f64]);

    /// Replaces every number by the largest of all ranks; NaN wins over every number.
    fn max(&self, values: &mut [f64]);

    /// Sends to every rank of `send` its numbers, and receives from every rank of `receive` as many as there is room for.
    fn exchange(&self, send: &[(usize, Vec<f64>)], receive: &mut [(usize, Vec<f64>)]);

    /// What every rank has, by rank.
    fn all_gather(&self, bytes: &[u8]) -> Vec<Vec<u8>>;
}

/// Who owns the points of one kind, vertices or faces, on this rank, and who has copies of them: owned ones first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct HaloMap {
    /// How many are owned.
    pub owned: usize,
    /// All, with the ghosts.
    pub count: usize,
    /// For every rank that has ghosts of owned points, these.
    pub send: Vec<(usize, Vec<u32>)>,
    /// For every rank that owns ghosts, these, in the order in which it sends them.
    pub receive: Vec<(usize, Vec<u32>)>,
}

/// How often a rank has communicated with others.
#[derive(Debug, Default)]
pub struct CommunicationCounts {
    reductions: AtomicU64,
    updates: AtomicU64,
    messages: AtomicU64,
    bytes: AtomicU64,
}

impl CommunicationCounts {
    /// Reductions over all ranks; updates of ghosts, with the messages and the bytes sent by them.
    #[must_use]
    pub fn counts(&self) -> [(&'static str, u64); 4] {
        [
            ("reductions", &self.reductions),
            ("halo updates", &self.updates),
            ("halo messages", &self.messages),
            ("halo bytes", &self.bytes),
        ]
        .map(|(name, count)| (name, count.load(Ordering::Relaxed)))
    }

    fn add(count: &AtomicU64, more: usize) {
        count.fetch_add(u64::try_from(more).unwrap_or(u64::MAX), Ordering::Relaxed);
    }
}

/// One process: ghosts are images of its own points, as on a sheet that repeats itself.
#[derive(Debug, Clone, Copy)]
pub struct OneProcess;

impl Communicator for OneProcess {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn sum(&self, _: &mut [f64]) {}

    fn max(&self, _: &mut [f64]) {}

    fn exchange(&self, send: &[(usize, Vec<f64>)], receive: &mut [(usize, Vec<f64>)]) {
        for ((_, from), (_, to)) in send.iter().zip(receive) {
            to.copy_from_slice(from);
        }
    }

    fn all_gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        vec![bytes.to_vec()]
    }
}

/// A rank's share of a sheet, with its halo.
pub struct Distribution {
    /// The ranks.
    pub communicator: Arc<dyn Communicator>,
    /// Its vertices.
    pub vertices: HaloMap,
    /// Its triangles.
    pub faces: HaloMap,
    /// The translations by which a periodic sheet repeats itself, in units of length; none of other sheets.
    pub periods: Vec<Vec3>,
    /// What was communicated by the methods of [`Reduction`](super::Reduction).
    pub traffic: CommunicationCounts,
}

impl Distribution {
    /// Sums over the ranks.
    pub(super) fn sum(&self, values: &mut [f64]) {
        CommunicationCounts::add(&self.traffic.reductions, 1);
        self.communicator.sum(values);
    }

    /// The largest of the ranks.
    pub(super) fn max(&self, values: &mut [f64]) {
        CommunicationCounts::add(&self.traffic.reductions, 1);
        self.communicator.max(values);
    }

    fn exchange(&self, send: &[(usize, Vec<f64>)], receive: &mut [(usize, Vec<f64>)]) {
        CommunicationCounts::add(&self.traffic.updates, 1);
        CommunicationCounts::add(&self.traffic.messages, send.len());
        let numbers: usize = send.iter().map(|(_, values)| values.len()).sum();
        CommunicationCounts::add(&self.traffic.bytes, size_of::<f64>() * numbers);
        self.communicator.exchange(send, receive);
    }

    /// The points of which there are `count` here.
    fn points(&self, count: usize) -> &HaloMap {
        if count == self.vertices.count { &self.vertices } else { &self.faces }
    }

    /// How many of `count` points here are owned.
    pub(super) fn owned(&self, count: usize) -> usize {
        debug_assert!(count == self.vertices.count || count == self.faces.count);
        self.points(count).owned
    }

    /// Adds what the ghosts of a vector have to their owners, one message a neighbour.
    pub(super) fn add_ghosts_to_owners(&self, vector: &mut [Vec3]) {
        let points = self.points(vector.len());
        let packed = |list: &[u32]| -> Vec<f64> {
            list.iter().flat_map(|&i| <[f64; 3]>::from(vector[i as usize])).collect()
        };
        let send: Vec<_> =
            points.receive.iter().map(|(rank, list)| (*rank, packed(list))).collect();
        let mut receive: Vec<_> =
            points.send.iter().map(|(rank, list)| (*rank, vec![0.0; 3 * list.len()])).collect();
        self.exchange(&send, &mut receive);
        for ((_, list), (_, values)) in points.send.iter().zip(&receive) {
            for (&i, values) in list.iter().zip(values.as_chunks::<3>().0) {
                vector[i as usize] += Vec3::from(*values);
            }
        }
    }

    /// Brings the ghosts of `columns` to what their owners have, one message a neighbour; `pack` gives the numbers of a
    /// point, and `unpack` makes it of them.
    pub(super) fn update_ghosts<T, const W: usize>(
        &self,
        columns: &mut [&mut [T]],
        pack: impl Fn(&T) -> [f64; W],
        unpack: impl Fn([f64; W]) -> T,
    ) {
        let Some(first) = columns.first() else { return };
        let points = self.points(first.len());
        let packed = |list: &[u32]| -> Vec<f64> {
            let all = columns.iter().flat_map(|c| list.iter().map(|&i| pack(&c[i as usize])));
            all.flatten().collect()
        };
        let send: Vec<_> = points.send.iter().map(|(rank, list)| (*rank, packed(list))).collect();
        let room = |list: &[u32]| vec![0.0; list.len() * W * columns.len()];
        let mut receive: Vec<_> =
            points.receive.iter().map(|(rank, list)| (*rank, room(list))).collect();
        self.exchange(&send, &mut receive);
        for ((_, list), (_, values)) in points.receive.iter().zip(&receive) {
            let mut rows = values.as_chunks::<W>().0.iter();
            for column in &mut *columns {
                for (&i, values) in list.iter().zip(&mut rows) {
                    column[i as usize] = unpack(*values);
                }
            }
        }
    }
}
