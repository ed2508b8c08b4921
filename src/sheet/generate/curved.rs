//! Curved surfaces that are relaxed in space: spherical cap, torus and ellipsoid.
//!
//! Vertices move in space and are put back onto the surface. Their triangles are found in a chart,
//!
//! ```text
//! cap          stereographic from the pole opposite the apex     (conformal)
//! torus        u = φ,  v = ∫ r dθ/(R + r cos θ)                  (conformal, periodic in both)
//! ellipsoid    x_k/a_k on the unit sphere                        (not conformal: edges are flipped in space)
//! ```
//!
//! A conformal chart maps small circles to circles, so that the Delaunay triangles of the plane are those of the surface.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;
use rumple_numerics::num::{real, whole};

use super::density::edge_length;
use super::domain::{Domain, Frame, delaunay, periodic};
use super::flip::delaunay_in_space;
use super::irregular::too_narrow;
use super::sphere::on_sphere;
use crate::SheetError;

/// Least distance of free vertices from the boundary in edge lengths, as for flat outlines.
const BOUNDARY_MARGIN: f64 = 0.5;

/// Fewest edges across, and around a boundary or a tube.
const FEWEST_ACROSS: usize = 4;
const FEWEST_AROUND: usize = 8;

/// Points along each angle in the quadrature of an area; the midpoint rule converges fast on periodic functions.
const QUADRATURE_POINTS: usize = 400;

/// A part of a sphere above a plane.
pub(super) struct Cap {
    radius: f64,
    height: f64,
    frame: Frame,
}

impl Cap {
    pub(super) fn new(radius: f64, height: f64, vertices: usize) -> Result<Self, SheetError> {
        if height >= 2.0 * radius {
            return Err(SheetError::Unusable(format!(
                "height = {height} of the cap must be smaller than the diameter {} of its sphere",
                2.0 * radius
            )));
        }
        let rim = (height * (2.0 * radius - height)).sqrt();
        let edge = edge_length(TAU * radius * height, TAU * rim, 2.0, vertices);
        let across = 2.0 * radius * Self::half_opening(radius, height);
        if across < real(FEWEST_ACROSS) * edge {
            return Err(too_narrow("the arc over the cap", across / edge, FEWEST_ACROSS, vertices));
        }
        let count = whole(TAU * rim / edge);
        if count < FEWEST_AROUND {
            return Err(too_narrow("the boundary", TAU * rim / edge, FEWEST_AROUND, vertices));
        }
        let fixed = (0..count).map(|i| {
            let angle = TAU * real(i) / real(count);
            Vec3::new(rim * angle.cos(), rim * angle.sin(), radius - height)
        });
        let bounds = [Vec3::new(-radius, -radius, radius - height), Vec3::repeat(radius)];
        Ok(Self { radius, height, frame: Frame::new(fixed.collect(), edge, 1, bounds) })
    }

    /// Angle at the centre of the sphere between the apex and the boundary.
    fn half_opening(radius: f64, height: f64) -> f64 {
        ((radius - height) / radius).acos()
    }
}

impl Domain for Cap {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        // Archimedes: z and the longitude are uniform.
        let z = self.radius - self.height * rng.random::<f64>();
        let longitude = TAU * rng.random::<f64>();
        let r = (self.radius * self.radius - z * z).max(0.0).sqrt();
        Some(self.constrain(Vec3::new(r * longitude.cos(), r * longitude.sin(), z)))
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let axial = point.x.hypot(point.y);
        let most = Self::half_opening(self.radius, self.height)
            - BOUNDARY_MARGIN * self.frame.edge / self.radius;
        let angle = axial.atan2(point.z).min(most);
        let r = self.radius * angle.sin() / axial.max(f64::MIN_POSITIVE);
        Vec3::new(r * point.x, r * point.y, self.radius * angle.cos())
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        let chart = |p: &Vec3| {
            let below = (self.radius + p.z).max(f64::MIN_POSITIVE);
            Vec3::new(p.x / below, p.y / below, 0.0)
        };
        delaunay(&points.iter().map(chart).collect::<Vec<_>>())
    }

    /// With the boundary in z = 0.
    fn place(&self, point: Vec3) -> Vec3 {
        point - Vec3::z() * (self.radius - self.height)
    }
}

/// A torus around the z axis.
pub(super) struct Torus {
    major: f64,
    minor: f64,
    frame: Frame,
}

impl Torus {
    pub(super) fn new(major: f64, minor: f64, vertices: usize) -> Result<Self, SheetError> {
        if minor >= major {
            return Err(SheetError::Unusable(format!(
                "minor = {minor} of the torus must be smaller than major = {major}"
            )));
        }
        let edge = edge_length(TAU * TAU * major * minor, 0.0, 0.0, vertices);
        for (what, length) in [("the tube", TAU * minor), ("the hole", TAU * (major - minor))] {
            if length < real(FEWEST_AROUND) * edge {
                let what = format!("the circumference of {what}");
                return Err(too_narrow(&what, length / edge, FEWEST_AROUND, vertices));
            }
        }
        let high = Vec3::new(major + minor, major + minor, minor);
        Ok(Self { major, minor, frame: Frame::new(Vec::new(), edge, 0, [-high, high]) })
    }

    /// Period of the chart along v.
    fn period(&self) -> f64 {
        TAU * self.minor / (self.major * self.major - self.minor * self.minor).sqrt()
    }

    /// Conformal coordinates of a point of the torus.
    fn chart(&self, p: &Vec3) -> Vec3 {
        let (big, small) = (self.major, self.minor);
        let tube = p.z.atan2(p.x.hypot(p.y) - big);
        let ratio = ((big - small) / (big + small)).sqrt();
        let half = (ratio * (0.5 * tube).sin()).atan2((0.5 * tube).cos());
        Vec3::new(p.y.atan2(p.x), self.period() / PI * half, 0.0)
    }
}

impl Domain for Torus {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let (around, tube) = (TAU * rng.random::<f64>(), TAU * rng.random::<f64>());
        let axial = self.major + self.minor * tube.cos();
        let kept = rng.random::<f64>() * (self.major + self.minor) < axial;
        let z = self.minor * tube.sin();
        kept.then(|| Vec3::new(axial * around.cos(), axial * around.sin(), z))
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let axial = point.x.hypot(point.y).max(f64::MIN_POSITIVE);
        let ring = Vec3::new(point.x, point.y, 0.0) * (self.major / axial);
        let out = point - ring;
        ring + out * (self.minor / out.norm().max(f64::MIN_POSITIVE))
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        let flat: Vec<Vec3> = points.iter().map(|p| self.chart(p)).collect();
        // Edges are longest in the chart where the torus is narrowest.
        let edge = self.frame.edge / (self.major - self.minor);
        periodic(&flat, [TAU, self.period()], edge)
    }
}

/// An ellipsoid around the origin.
pub(super) struct Ellipsoid {
    axes: Vec3,
    frame: Frame,
}

impl Ellipsoid {
    pub(super) fn new(axes: [f64; 3], vertices: usize) -> Result<Self, SheetError> {
        let axes = Vec3::from(axes);
        let edge = edge_length(Self::area(&axes), 0.0, 4.0, vertices);
        // The radius of curvature is least at the end of the longest axis, across the shortest one.
        let (least, largest) = (axes.min(), axes.max());
        let sharpest = TAU * least * least / largest;
        if sharpest < real(FEWEST_AROUND) * edge {
            let what = "a circle with the smallest radius of curvature";
            return Err(too_narrow(what, sharpest / edge, FEWEST_AROUND, vertices));
        }
        Ok(Self { axes, frame: Frame::new(Vec::new(), edge, 2, [-axes, axes]) })
    }

    /// Area over that of the unit sphere at the point of direction `u`.
    fn density(axes: &Vec3, u: &Vec3) -> f64 {
        axes.product() * u.component_div(axes).norm()
    }

    /// Area, by the midpoint rule in z and longitude on the unit sphere.
    fn area(axes: &Vec3) -> f64 {
        let mut sum = 0.0;
        for i in 0..QUADRATURE_POINTS {
            let z = (2.0 * real(i) + 1.0) / real(QUADRATURE_POINTS) - 1.0;
            let r = (1.0 - z * z).sqrt();
            for j in 0..QUADRATURE_POINTS {
                let longitude = TAU * real(j) / real(QUADRATURE_POINTS);
                let u = Vec3::new(r * longitude.cos(), r * longitude.sin(), z);
                sum += Self::density(axes, &u);
            }
        }
        2.0 * TAU * sum / real(QUADRATURE_POINTS * QUADRATURE_POINTS)
    }
}

impl Domain for Ellipsoid {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let z = 2.0 * rng.random::<f64>() - 1.0;
        let longitude = TAU * rng.random::<f64>();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let u = Vec3::new(r * longitude.cos(), r * longitude.sin(), z);
        let most = self.axes.product() / self.axes.min();
        let kept = rng.random::<f64>() * most < Self::density(&self.axes, &u);
        kept.then(|| u.component_mul(&self.axes))
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        point / point.component_div(&self.axes).norm().max(f64::MIN_POSITIVE)
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        let unit: Vec<Vec3> = points.iter().map(|p| p.component_div(&self.axes)).collect();
        delaunay_in_space(points, on_sphere(&unit, 1.0))
    }
}
