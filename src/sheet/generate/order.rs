//! Numbering for locality: vertices along a Hilbert curve, triangles after their vertices.
//!
//! J. Skilling, "Programming the Hilbert curve", AIP Conf. Proc. 707 (2004) 381,
//! doi:10.1063/1.1751381 (the transpose form).

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, whole};

/// Bits per coordinate: 2^20 cells a side resolve a mesh of 10^9 vertices.
const BITS: u32 = 20;

/// Renumbers a mesh along the Hilbert curve through `keys` (one per vertex; the curve is planar if
/// they are), and turns every triangle so that its smallest vertex comes first.
pub(super) fn numbered(
    keys: &[Vec3],
    points: &[Vec3],
    triangles: &[[u32; 3]],
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let first = keys.first().copied().unwrap_or_default();
    let (low, high) = keys.iter().fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
    let scale = f64::from((1u32 << BITS) - 1) / (high - low).max().max(f64::MIN_POSITIVE);
    let cell = |p: &Vec3, k: usize| index(whole((p[k] - low[k]) * scale));
    let flat = (high - low).z == 0.0;
    let mut order: Vec<(u64, u32)> = keys
        .iter()
        .enumerate()
        .map(|(v, p)| {
            let place = if flat {
                hilbert([cell(p, 0), cell(p, 1)])
            } else {
                hilbert([cell(p, 0), cell(p, 1), cell(p, 2)])
            };
            (place, index(v))
        })
        .collect();
    order.sort_unstable();
    let mut new = vec![0; keys.len()];
    for (number, &(_, v)) in order.iter().enumerate() {
        new[v as usize] = index(number);
    }
    let points = order.iter().map(|&(_, v)| points[v as usize]).collect();
    let mut triangles: Vec<[u32; 3]> =
        triangles.iter().map(|t| lowest_first(t.map(|v| new[v as usize]))).collect();
    triangles.sort_unstable();
    (points, triangles)
}

/// The same oriented triangle, started at its smallest vertex.
fn lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Place along the Hilbert curve through the grid of 2^BITS cells a side.
fn hilbert<const D: usize>(mut x: [u32; D]) -> u64 {
    let top = 1u32 << (BITS - 1);
    let mut q = top;
    while q > 1 {
        let p = q - 1;
        for i in 0..D {
            if x[i] & q != 0 {
                x[0] ^= p;
            } else {
                let t = (x[0] ^ x[i]) & p;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    for i in 1..D {
        x[i] ^= x[i - 1];
    }
    let mut t = 0;
    q = top;
    while q > 1 {
        if x[D - 1] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let mut place = 0;
    for bit in (0..BITS).rev() {
        for value in x {
            place = (place << 1) | u64::from(((value ^ t) >> bit) & 1);
        }
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_neighbours_one_after_the_other() {
        // On the corner block of 16 x 16 cells the curve is a path: sorted by place, every step
        // goes to a cell that shares a side.
        let mut cells: Vec<_> =
            (0..256u32).map(|i| (hilbert([i % 16, i / 16]), i % 16, i / 16)).collect();
        cells.sort_unstable();
        for pair in cells.windows(2) {
            let far = pair[0].1.abs_diff(pair[1].1) + pair[0].2.abs_diff(pair[1].2);
            assert_eq!(far, 1, "{pair:?}");
        }
    }
}
