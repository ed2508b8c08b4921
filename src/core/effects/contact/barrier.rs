//! The barrier between two points of surfaces that are d apart.
//!
//! ```text
//! b(d) = -κ d̂ (1 - u)² ln u,   u = d/d̂ < 1;   0 beyond
//! p(d) = -b'(d) = κ [(1 - u)²/u - 2 (1 - u) ln u]
//! ```
//!
//! b is energy per area, p pressure, κ stress; b is C² at d̂ and infinite at 0. Li, Ferguson, Schneider, Langlois, Zorin,
//! Panozzo, Jiang & Kaufman, *Incremental potential contact*, ACM Trans. Graph. 39 (2020),
//! doi:10.1145/3386569.3392425, in distances in place of their squares, and scaled to a pressure.

/// The barrier.
#[derive(Debug, Clone, Copy)]
pub(super) struct Barrier {
    /// κ.
    pub(super) stiffness: f64,
    /// d̂.
    pub(super) reach: f64,
}

impl Barrier {
    /// b.
    pub(super) fn energy(&self, d: f64) -> f64 {
        let u = d / self.reach;
        if u < 1.0 { -self.stiffness * self.reach * (1.0 - u) * (1.0 - u) * u.ln() } else { 0.0 }
    }

    /// b'.
    pub(super) fn slope(&self, d: f64) -> f64 {
        let u = d / self.reach;
        if u < 1.0 { self.stiffness * (1.0 - u) * (2.0 * u.ln() - (1.0 - u) / u) } else { 0.0 }
    }

    /// b''.
    pub(super) fn curvature(&self, d: f64) -> f64 {
        let u = d / self.reach;
        if u < 1.0 {
            let v = (1.0 - u) / u;
            self.stiffness / self.reach * (-2.0 * u.ln() + 4.0 * v + v * v)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_energy() {
        let b = Barrier { stiffness: 3.0, reach: 0.7 };
        for d in [0.01, 0.1, 0.35, 0.6, 0.69] {
            let h = 1e-5 * d;
            let slope = (b.energy(d + h) - b.energy(d - h)) / (2.0 * h);
            let curvature = (b.slope(d + h) - b.slope(d - h)) / (2.0 * h);
            assert!((slope / b.slope(d) - 1.0).abs() < 1e-6, "{d}");
            assert!((curvature / b.curvature(d) - 1.0).abs() < 1e-6, "{d}");
        }
        assert_eq!([b.energy(0.7), b.slope(0.7), b.curvature(0.7)], [0.0; 3]);
        assert!(b.curvature(0.7 - 1e-9) < 1e-6, "not C²");
    }
}
