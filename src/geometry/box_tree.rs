//! A tree of boxes along the axes: which items of a shape may be near one another.
//!
//! The items stand in the Morton order of their rest places, four to a leaf; every node has the box of the nodes
//! below. The order is made once, the boxes follow the shape: O(n) to refit, O(log n) an inquiry on a sheet that is not
//! crumpled beyond recognition.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::parallel;

/// A box along the axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    least: Vec3,
    largest: Vec3,
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self {
        least: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        largest: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The box of some points.
    #[inline]
    pub(crate) fn enclosing(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, x| b.with(&Self { least: x, largest: x }))
    }

    #[inline]
    pub(crate) fn with(&self, other: &Self) -> Self {
        Self { least: self.least.inf(&other.least), largest: self.largest.sup(&other.largest) }
    }

    /// The lengths along the axes.
    #[inline]
    pub(crate) fn size(&self) -> Vec3 {
        self.largest - self.least
    }

    fn centre(&self) -> Vec3 {
        0.5 * (self.least + self.largest)
    }

    /// The least distance of a point of the one from a point of the other.
    #[inline]
    pub(crate) fn gap(&self, other: &Self) -> f64 {
        let between = (self.least - other.largest).sup(&(other.least - self.largest));
        between.sup(&Vec3::zeros()).norm()
    }

    /// The largest distance of a point of the one from a point of the other.
    #[inline]
    pub(crate) fn span(&self, other: &Self) -> f64 {
        (self.largest - other.least).sup(&(other.largest - self.least)).norm()
    }

    /// Whether the two have a point in common.
    #[inline]
    pub(crate) fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|a| self.least[a] <= other.largest[a] && other.least[a] <= self.largest[a])
    }
}

/// Items of a leaf.
const LEAF_SIZE: usize = 4;

/// The tree.
#[derive(Debug, Clone)]
pub(crate) struct BoxTree {
    /// The items in the order of the leaves.
    order: Vec<u32>,
    /// A power of two.
    leaves: usize,
    /// Boxes of the nodes: those below node k are 2k + 1 and 2k + 2.
    boxes: Vec<Bounds>,
}

impl BoxTree {
    /// Of items with these boxes at rest.
    pub(crate) fn new(items: &[Bounds]) -> Self {
        let centres: Vec<Vec3> = items.iter().map(Bounds::centre).collect();
        let all = Bounds::enclosing(centres.iter().copied());
        let size = all.size().max();
        let key = |x: &Vec3| {
            let scaled = (x - all.least) / size;
            (0..3).fold(0, |key, a| key | spread(scaled[a]) << a)
        };
        let mut order: Vec<u32> = (0..centres.len()).map(index).collect();
        order.sort_by_cached_key(|t| (key(&centres[*t as usize]), *t));
        let leaves = centres.len().div_ceil(LEAF_SIZE).next_power_of_two();
        let boxes = vec![Bounds::EMPTY; 2 * leaves - 1];
        let mut tree = Self { order, leaves, boxes };
        tree.refit(|item| items[item as usize]);
        tree
    }

    /// The items in the order of the leaves.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Lets the boxes follow the shape: `of` is the box of an item.
    pub(crate) fn refit(&mut self, of: impl Fn(u32) -> Bounds + Sync) {
        let (inner, last) = self.boxes.split_at_mut(self.leaves - 1);
        let order = &self.order;
        parallel::fill(last, |leaf| {
            let items = order.iter().skip(leaf * LEAF_SIZE).take(LEAF_SIZE);
            items.fold(Bounds::EMPTY, |all, item| all.with(&of(*item)))
        });
        for k in (0..inner.len()).rev() {
            let below = |k: usize| if k < inner.len() { inner[k] } else { last[k - inner.len()] };
            inner[k] = below(2 * k + 1).with(&below(2 * k + 2));
        }
    }

    /// Hands the items at places from `first` on to `visit`, but for those below nodes that `enter` refuses.
    pub(crate) fn visit(
        &self,
        enter: impl Fn(&Bounds) -> bool,
        first: usize,
        mut visit: impl FnMut(u32),
    ) {
        // Nodes to open as (node, its first leaf, how many leaves): a tree of 2³² leaves needs 33.
        let mut open = [(0, 0, 0); 64];
        open[0] = (0, 0, self.leaves);
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (node, leaf, leaves) = open[count];
            let passed = (leaf + leaves) * LEAF_SIZE <= first;
            if passed || !enter(&self.boxes[node]) {
                continue;
            }
            if leaves > 1 {
                let half = leaves / 2;
                open[count] = (2 * node + 1, leaf, half);
                open[count + 1] = (2 * node + 2, leaf + half, half);
                count += 2;
                continue;
            }
            let places =
                (leaf * LEAF_SIZE).max(first)..((leaf + 1) * LEAF_SIZE).min(self.order.len());
            self.order.get(places).into_iter().flatten().for_each(|item| visit(*item));
        }
    }
}

/// 21 bits of a number from 0 to 1, two zeros between each of them.
fn spread(share: f64) -> u64 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let bits = (share.clamp(0.0, 1.0) * 2_097_151.0) as u64;
    (0..21).fold(0, |all, k| all | (bits >> k & 1) << (3 * k))
}
