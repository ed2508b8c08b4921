//! Blue noise: random points that keep a distance from one another.
//!
//! Darts are thrown at random and kept if no earlier one is nearer than r. Random sequential
//! addition jams near r = 0.78 l (l: edge length of the finished mesh), where throwing takes for
//! ever; r starts at 0.7 l, and after a long run of misses it shrinks a little, so that exactly
//! the asked number of points is reached.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::domain::Domain;
use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

/// First dart distance in edge lengths: near the jam the spacing is most even, but slow to find.
const START_DISTANCE: f64 = 0.7;

/// Misses in a row after which the distance shrinks by [`DISTANCE_REDUCTION`].
const MAX_MISSES: usize = 200;

/// Factor on the distance when darts keep missing.
const DISTANCE_REDUCTION: f64 = 0.97;

/// End of a list in the buckets.
const END_OF_LIST: u32 = u32::MAX;

/// The fixed points of the domain followed by random ones, `vertices` in all.
pub(super) fn points(domain: &impl Domain, vertices: usize, seed: u64, stream: u64) -> Vec<Vec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    let frame = domain.frame();
    let mut distance = START_DISTANCE * frame.edge;
    let mut buckets = Buckets::new(frame.bounds, distance, vertices);
    let mut points = Vec::with_capacity(vertices);
    for &p in &frame.fixed {
        buckets.insert(&mut points, p);
    }
    let mut misses = 0;
    while points.len() < vertices {
        let Some(p) = domain.sample(&mut rng) else { continue };
        let image = domain.image(p);
        let free = buckets.free(&points, p, distance)
            && image.is_none_or(|i| buckets.free(&points, i, distance));
        if free {
            buckets.insert(&mut points, p);
            misses = 0;
        } else {
            misses += 1;
            if misses > MAX_MISSES {
                distance *= DISTANCE_REDUCTION;
                misses = 0;
            }
        }
    }
    points
}

/// Points by the cube they lie in, as linked lists.
struct Buckets {
    low: Vec3,
    side: f64,
    size: [usize; 3],
    head: Vec<u32>,
    next: Vec<u32>,
}

impl Buckets {
    fn new([low, high]: [Vec3; 2], distance: f64, vertices: usize) -> Self {
        // At most about 64 cubes a vertex, whatever the box.
        let extent = (high - low).add_scalar(distance);
        let side = distance.max((extent.product() / (64.0 * real(vertices))).cbrt());
        let size = [0, 1, 2].map(|k| whole((extent[k] / side).ceil()) + 1);
        let head = vec![END_OF_LIST; size.iter().product()];
        Self { low, side, size, head, next: Vec::with_capacity(vertices) }
    }

    fn cube(&self, p: Vec3) -> [usize; 3] {
        [0, 1, 2].map(|k| whole(((p[k] - self.low[k]) / self.side).floor()).min(self.size[k] - 1))
    }

    fn insert(&mut self, points: &mut Vec<Vec3>, p: Vec3) {
        let [i, j, k] = self.cube(p);
        let head = &mut self.head[(i * self.size[1] + j) * self.size[2] + k];
        self.next.push(*head);
        *head = index(points.len());
        points.push(p);
    }

    /// Whether no point is nearer to `p` than `distance` (at most one cube's side).
    fn free(&self, points: &[Vec3], p: Vec3, distance: f64) -> bool {
        let cube = self.cube(p);
        let range = |k: usize| cube[k].saturating_sub(1)..(cube[k] + 2).min(self.size[k]);
        for i in range(0) {
            for j in range(1) {
                for k in range(2) {
                    let mut at = self.head[(i * self.size[1] + j) * self.size[2] + k];
                    while at != END_OF_LIST {
                        if (points[at as usize] - p).norm_squared() < distance * distance {
                            return false;
                        }
                        at = self.next[at as usize];
                    }
                }
            }
        }
        true
    }
}
