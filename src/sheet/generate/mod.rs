//! Sheets made by formula: irregular meshes of simple shapes, and the icosphere.
//!
//! Irregular meshes start from blue noise (random points that keep their distance), so defects of
//! the lattice lie anywhere and no direction is preferred, and are then relaxed until the edges
//! push equally from all sides (`relax`). Boundaries carry evenly spaced vertices at the edge length of
//! the interior. Vertices are numbered along a Hilbert curve and triangles follow them, so
//! neighbours are near one another in memory.

mod capped;
mod cell;
mod curved;
mod cylinder;
mod density;
mod domain;
mod flip;
mod graph;
mod irregular;
pub(super) mod lattice;
mod noise;
mod order;
pub(crate) mod outline;
mod planar;
mod polygon;
mod relax;
mod sphere;

use super::periodic::with_images;
use super::{Sheet, SheetError};
use cell::Cell;
use cylinder::Strip;
use irregular::{check, irregular};

pub use graph::Height;
pub use lattice::Lattice;

/// A shape to be meshed; all sizes are in units of length and must be positive.
#[derive(Debug, Clone, PartialEq)]
pub enum SheetShape {
    /// A flat disc around the origin in the plane z = 0, normal +z.
    Disc {
        /// Radius of the boundary; boundary vertices lie on the circle.
        radius: f64,
    },
    /// A flat rectangle around the origin in the plane z = 0, normal +z.
    Rectangle {
        /// Extent along x.
        width: f64,
        /// Extent along y.
        height: f64,
    },
    /// The same rectangle as one period of a sheet that repeats itself.
    PeriodicRectangle {
        /// Period along x.
        width: f64,
        /// Extent along y.
        height: f64,
        /// Whether it repeats itself along y too.
        both: bool,
    },
    /// A flat rectangle around the origin in the plane z = 0, normal +z, of rows of nearly equilateral triangles: the
    /// number of vertices that is nearest, without a seed. A part of it is made without the rest ([`Lattice`]).
    Lattice {
        /// Extent along x.
        width: f64,
        /// Extent along y.
        height: f64,
    },
    /// A flat ring around the origin in the plane z = 0, normal +z.
    Annulus {
        /// Radius of the hole.
        inner: f64,
        /// Radius of the outer boundary.
        outer: f64,
    },
    /// A flat polygon with holes in the plane z = 0, normal +z.
    Polygon {
        /// Corners of the outline in order, in either direction.
        points: Vec<[f64; 2]>,
        /// Corners of each hole.
        holes: Vec<Vec<[f64; 2]>>,
    },
    /// A closed sphere around the origin, normals outward.
    Sphere {
        /// Distance of every vertex from the origin.
        radius: f64,
        /// Random and relaxed, with exactly the asked number of vertices; otherwise an icosphere,
        /// which has the number 10n² + 2 that is nearest and does not depend on the seed.
        irregular: bool,
    },
    /// A cylinder around the z axis, from -height/2 to height/2, normals outward.
    Cylinder {
        /// Distance of its vertices from the axis.
        radius: f64,
        /// Extent along z.
        height: f64,
        /// Closed by flat discs at both ends; open otherwise.
        caps: bool,
    },
    /// A part of a sphere around the z axis, its boundary in z = 0 and its apex at z = height, normals outward.
    Cap {
        /// Radius of the sphere.
        radius: f64,
        /// Height of the apex over the boundary, smaller than the diameter.
        height: f64,
    },
    /// A torus around the z axis, normals outward.
    Torus {
        /// Distance of the middle of the tube from the axis.
        major: f64,
        /// Radius of the tube, smaller than `major`.
        minor: f64,
    },
    /// A closed ellipsoid around the origin, normals outward.
    Ellipsoid {
        /// Semi-axes along x, y and z.
        semi_axes: [f64; 3],
    },
    /// A strip z = amplitude · sin(2πx/wavelength) around the origin, normal upward.
    WavyStrip {
        /// Extent along x.
        width: f64,
        /// Extent along y.
        height: f64,
        /// Largest |z|.
        amplitude: f64,
        /// Period along x.
        wavelength: f64,
    },
}

impl SheetShape {
    /// The sizes by name, as they are called in a scene.
    fn sizes(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Disc { radius } | Self::Sphere { radius, .. } => vec![("radius", radius)],
            Self::Rectangle { width, height }
            | Self::PeriodicRectangle { width, height, .. }
            | Self::Lattice { width, height } => {
                vec![("width", width), ("height", height)]
            }
            Self::Polygon { .. } => Vec::new(),
            Self::Annulus { inner, outer } => vec![("inner", inner), ("outer", outer)],
            Self::Cylinder { radius, height, .. } | Self::Cap { radius, height } => {
                vec![("radius", radius), ("height", height)]
            }
            Self::Torus { major, minor } => vec![("major", major), ("minor", minor)],
            Self::Ellipsoid { semi_axes } => semi_axes.map(|axis| ("semi_axes", axis)).to_vec(),
            Self::WavyStrip { width, height, amplitude, wavelength } => vec![
                ("width", width),
                ("height", height),
                ("amplitude", amplitude),
                ("wavelength", wavelength),
            ],
        }
    }
}

/// Makes a sheet of about equal edge lengths with `vertices` vertices.
///
/// The number of vertices is met exactly by every shape but the icosphere and the lattice, which take
/// a near one. The same `seed` gives the same bits on the same machine; different seeds give
/// different meshes (but for these two).
///
/// # Errors
/// Sizes that are not positive and finite, an annulus whose hole is not smaller than the disc, a polygon that crosses
/// itself or has a hole outside, and numbers of vertices too small for the shape or too large for 32-bit indices.
pub fn generate(shape: &SheetShape, vertices: usize, seed: u64) -> Result<Sheet, SheetError> {
    check(&shape.sizes(), vertices)?;
    match *shape {
        SheetShape::Disc { radius } => irregular(&planar::disc(radius, vertices)?, vertices, seed),
        SheetShape::Rectangle { width, height } => {
            irregular(&planar::rectangle(width, height, vertices)?, vertices, seed)
        }
        SheetShape::PeriodicRectangle { width, height, both: false } => {
            let cell = irregular(&Strip::flat(width, height, vertices)?, vertices, seed)?;
            with_images(&cell, [width, f64::INFINITY])
        }
        SheetShape::PeriodicRectangle { width, height, both: true } => {
            let cell = irregular(&Cell::new([width, height], vertices)?, vertices, seed)?;
            with_images(&cell, [width, height])
        }
        SheetShape::Lattice { width, height } => Lattice::new([width, height], vertices)?.sheet(),
        SheetShape::Annulus { inner, outer } => {
            irregular(&planar::annulus(inner, outer, vertices)?, vertices, seed)
        }
        SheetShape::Polygon { ref points, ref holes } => {
            irregular(&polygon::Polygon::new(points, holes, vertices)?, vertices, seed)
        }
        SheetShape::Sphere { radius, irregular: true } => {
            irregular(&sphere::Ball::new(radius, vertices)?, vertices, seed)
        }
        SheetShape::Sphere { radius, irregular: false } => {
            let (points, triangles) = sphere::icosphere(radius, vertices)?;
            let (points, triangles) = order::numbered(&points, &points, &triangles);
            Sheet::new(points, triangles)
        }
        SheetShape::Cylinder { radius, height, caps: true } => {
            capped::capped(radius, height, vertices, seed)
        }
        SheetShape::Cylinder { radius, height, caps: false } => {
            irregular(&Strip::new(radius, height, vertices)?, vertices, seed)
        }
        SheetShape::Cap { radius, height } => {
            irregular(&curved::Cap::new(radius, height, vertices)?, vertices, seed)
        }
        SheetShape::Torus { major, minor } => {
            irregular(&curved::Torus::new(major, minor, vertices)?, vertices, seed)
        }
        SheetShape::Ellipsoid { semi_axes } => {
            irregular(&curved::Ellipsoid::new(semi_axes, vertices)?, vertices, seed)
        }
        SheetShape::WavyStrip { width, height, amplitude, wavelength } => {
            let wave = [amplitude, wavelength];
            irregular(&graph::WavyStrip::new([width, height], wave, vertices)?, vertices, seed)
        }
    }
}

/// Makes the sheet z = `height`(x, y) over a rectangle around the origin, `size` along x and y, normal upward.
///
/// As for [`generate`]; edges are about equally long on the surface.
///
/// # Errors
/// As for [`generate`]; heights that are not finite, and slopes above 20.
pub fn generate_graph(
    size: [f64; 2],
    height: Height<'_>,
    vertices: usize,
    seed: u64,
) -> Result<Sheet, SheetError> {
    check(&[("width", size[0]), ("height", size[1])], vertices)?;
    irregular(&graph::Graph::new(size, height, vertices)?, vertices, seed)
}
