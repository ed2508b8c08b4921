//! `[sheet]`: which sheet, and how its start differs from the rest state.

mod read;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::num::checked::{AtLeast, Finite, NonNegative, Positive};

pub(crate) use self::read::read_sheet;

/// Seed of random numbers where a scene gives none.
pub(crate) fn default_seed() -> u64 {
    1
}

/// The table `[sheet]`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SheetSpec {
    /// Generated or read from a file.
    #[serde(flatten)]
    pub source: SheetSource,
    /// Whether vertices move in the plane z = const that the sheet rests in, with two unknowns each.
    #[serde(skip_serializing_if = "is_false")]
    pub planar: bool,
    /// Random displacement of the start, which breaks the symmetry of a flat sheet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imperfection: Option<Imperfection>,
    /// Smooth displacement of the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bump: Option<Bump>,
}

/// Where the triangles come from.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum SheetSource {
    /// A mesh file.
    File {
        /// The file; absolute, or relative to the working directory if the scene has no place.
        file: PathBuf,
    },
    /// No sheet: one point without shape or space.
    Point {
        /// Accepts the value.
        shape: Point,
    },
    /// A mesh made by this crate.
    Generated(ShapeSpec),
}

/// The shape of a scene without space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Point {
    /// `shape = "point"`.
    Point,
}

/// A shape that can be generated; lengths in units of length.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "kebab-case")]
pub enum ShapeSpec {
    /// A flat disc around the origin.
    Disc(Disc),
    /// A flat rectangle around the origin.
    Rectangle(Rectangle),
    /// A flat rectangle of equilateral triangles.
    Lattice(Lattice),
    /// A flat ring around the origin.
    Annulus(Annulus),
    /// A flat polygon with holes.
    Polygon(Polygon),
    /// A sphere around the origin.
    Sphere(Sphere),
    /// A cylinder around the z axis.
    Cylinder(Cylinder),
    /// A part of a sphere.
    Cap(Cap),
    /// A torus around the z axis.
    Torus(Torus),
    /// An ellipsoid around the origin.
    Ellipsoid(Ellipsoid),
    /// A strip bent to a sine.
    WavyStrip(WavyStrip),
    /// The graph of a formula over a rectangle.
    Graph(Graph),
}

impl ShapeSpec {
    /// Number of vertices asked for.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.numbers().0
    }

    /// Seed of the random start of the mesh generator.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.numbers().1
    }

    fn numbers(&self) -> (usize, u64) {
        macro_rules! of {
            ($($kind:ident),*) => {
                match self { $(Self::$kind(shape) => (shape.vertices.get(), shape.seed),)* }
            };
        }
        of!(
            Disc, Rectangle, Lattice, Annulus, Polygon, Sphere, Cylinder, Cap, Torus, Ellipsoid,
            WavyStrip, Graph
        )
    }
}

macro_rules! shape {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
            /// About how many vertices.
            pub vertices: AtLeast<4>,
            /// Seed of the random start of the mesh generator.
            #[serde(default = "default_seed")]
            pub seed: u64,
        }
    };
}

shape!(
    /// Sizes of a disc.
    Disc {
        /// Radius.
        radius: Positive,
    }
);
shape!(
    /// Sizes of a rectangle.
    Rectangle {
        /// Extent along x.
        width: Positive,
        /// Extent along y.
        height: Positive,
        /// The directions in which it is one period of a sheet that repeats itself.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        periodic: Option<Periodic>,
    }
);
shape!(
    /// Sizes of a rectangle of equilateral triangles.
    Lattice {
        /// Extent along x.
        width: Positive,
        /// Extent along y.
        height: Positive,
    }
);
shape!(
    /// Sizes of a ring.
    Annulus {
        /// Inner radius, smaller than the outer one.
        inner: Positive,
        /// Outer radius.
        outer: Positive,
    }
);
shape!(
    /// Outlines of a polygon.
    Polygon {
        /// Corners of the outline in order, in units of length; none where a file has them.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        points: Vec<[Finite; 2]>,
        /// A drawing or a list of points, in place of `points` and `holes`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        outline: Option<PathBuf>,
        /// Extent along x to which `outline` is scaled.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        width: Option<Positive>,
        /// Corners of each hole.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        holes: Vec<Vec<[Finite; 2]>>,
    }
);
shape!(
    /// Sizes of a sphere.
    Sphere {
        /// Radius.
        radius: Positive,
        /// A seeded irregular mesh in place of a subdivided icosahedron.
        #[serde(default)]
        irregular: bool,
    }
);
shape!(
    /// Sizes of a cylinder.
    Cylinder {
        /// Radius.
        radius: Positive,
        /// Extent along z.
        height: Positive,
        /// Closed by flat discs.
        #[serde(default)]
        caps: bool,
    }
);
shape!(
    /// Sizes of a spherical cap.
    Cap {
        /// Radius of the sphere.
        radius: Positive,
        /// Height of the apex over the boundary.
        height: Positive,
    }
);
shape!(
    /// Sizes of a torus.
    Torus {
        /// Distance of the middle of the tube from the axis.
        major: Positive,
        /// Radius of the tube.
        minor: Positive,
    }
);
shape!(
    /// Sizes of an ellipsoid.
    Ellipsoid {
        /// Along x, y and z.
        semi_axes: [Positive; 3],
    }
);
shape!(
    /// Sizes of a wavy strip.
    WavyStrip {
        /// Extent along x.
        width: Positive,
        /// Extent along y.
        height: Positive,
        /// Largest |z|.
        amplitude: Positive,
        /// Period along x.
        wavelength: Positive,
    }
);
shape!(
    /// The surface z = f(x, y).
    Graph {
        /// Extent along x.
        width: Positive,
        /// Extent along y.
        height: Positive,
        /// A formula of `x` and `y`.
        z: String,
    }
);

/// Where a rectangle repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Periodic {
    /// Along x: a strip without ends.
    X,
    /// Along x and y: a torus that is flat at rest.
    Xy,
}

/// Every interior vertex is displaced by `amplitude · u`, u uniform in [-1, 1].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imperfection {
    /// Largest displacement, in units of length.
    pub amplitude: NonNegative,
    /// Seed of u.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// Along z or along the vertex normal.
    #[serde(default)]
    pub direction: Direction,
}

/// Gaussian displacement `amplitude · exp(-|X - centre|² / (2 width²))` of the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// Displacement at the centre; its sign says to which side.
    pub amplitude: Finite,
    /// Standard deviation, in units of length.
    pub width: Positive,
    /// Centre in the rest state.
    #[serde(default = "origin")]
    pub centre: [Finite; 3],
    /// Along z or along the vertex normal.
    #[serde(default)]
    pub direction: Direction,
}

/// Direction of a displacement out of the sheet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Along z.
    #[default]
    Z,
    /// Along the vertex normal.
    Normal,
}

/// The origin, where a centre is not given.
pub(crate) fn origin() -> [Finite; 3] {
    [Finite::ZERO; 3]
}

/// Whether a key need not be written.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_false(value: &bool) -> bool {
    !value
}
