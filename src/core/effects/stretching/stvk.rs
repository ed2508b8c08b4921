//! Stretching of constant-strain triangles of a Saint Venant-Kirchhoff material.
//!
//! ```text
//! U_s = Σ_T Ā_T Y₂/(2(1-ν²)) [ (1-ν) tr E² + ν (tr E)² ]        E = ½ (FᵀF - I), plane stress
//! ```
//!
//! F maps the optimal triangle (sides l̄, area Ā) to the current one, so E is the Green strain
//! with respect to the rest metric; `C₁₁ = Y₂/(1-ν²)`, `C₁₂ = ν C₁₁`, shear modulus
//! `Y₂/(2(1+ν))`, all force per length.
//!
//! **Which modulus.** `Y₂` is the two-dimensional Young's modulus, the tension per strain of a
//! strip with free sides. The paper writes `U_s` of the bonds with `Y = E h/(1-ν²)`, and a lattice
//! of bonds has that as its two-dimensional Young's modulus, with ν = 1/3. So `modulus = "paper"`
//! (default) takes `Y₂ = Y`, and at ν = 1/3 all stretching models have the same second derivatives
//! in the flat rest state of an equilateral lattice, boundary included. A plate cut from a block has
//! `Y₂ = E h` instead (at ν = 1/3 smaller by 8/9): `modulus = "plate"`, for comparison with
//! plates of the literature. At ν = 0 they are the same.
//!
//! **In lengths.** With edge vectors `ē_k` of the optimal triangle, `t_k` those turned by 90°,
//! `q_k = l_k² - l̄_k²`, the strain is `E = Σ_k a_k t_k t_kᵀ`, `a_k = (Σq - 2q_k)/(16 Ā²)` (because
//! `ē_kᵀ E ē_k = q_k/2`), so
//!
//! ```text
//! U_T = ½ qᵀ M q,  M = Tᵀ K T,  T = (1 1ᵀ - 2)/(16 Ā²),
//! K_kl = Ā Y₂/(1-ν²) [ (1-ν) (ē_k·ē_l)² + ν l̄_k² l̄_l² ]
//! ∂U_T/∂x_k = 2 (s_{k+1} e_{k+1} - s_{k+2} e_{k+2}),  s = M q,  e_k the current edge vectors
//! ```
//!
//! M is positive semi-definite; for an equilateral triangle and ν = 1/3 it is `Y₂ Ā/(4 l̄⁴)` times
//! the identity, three independent bonds. The Hessian is `Σ_jl M_jl ∂l_j² ⊗ ∂l_l²`, which is
//! positive, and the geometric part `Σ_j s_j ∂²l_j²`, of which the positive part keeps `s_j > 0`.
//!
//! **Optimal lengths that make no triangle** (or a very flat one) are replaced by the nearest that
//! do: seen as a tensor C relative to the rest triangle (`e⁰_kᵀ C e⁰_k = l̄_k²`), the smaller
//! principal value is raised to [`MIN_RATIO`] times the larger. So nothing is refused or
//! divided by zero where Φ jumps, and U stays continuous in Φ; such a triangle is never free of
//! stress, which is true of three lengths that do not fit.
//!
//! **By the optimal lengths.** `∂s/∂b = (∂M/∂b) q - M` with `b = l̄²` and `M = κ P Q P/(256 Ā³)`,
//! `κ = Y₂/(1-ν²)`, `P = 1 1ᵀ - 2`, `Q_kl = (1-ν) (ē_k·ē_l)² + ν b_k b_l`, which is a polynomial.
//!
//! Source: e.g. Ciarlet, *Mathematical Elasticity I* (1988), section 3.9; the quadratic form in
//! squared lengths is derived here. Not covered: StVK softens under strong compression (at
//! `l/l̄ < 1/√3` in one direction), so nothing but the solver keeps a triangle from turning over.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::effects::element::{self, Element, Mesh};
use crate::effects::{
    Coupling, Energy, FieldValues, ForceScales, HessianPart, MaterialField, ParameterField,
};
use crate::geometry::{Conditions, Shape};
use crate::linear::{Block, BlockMatrix, LazyStencils};
use crate::{Vec3, parallel};

/// Least ratio of the principal values of the rest metric relative to the rest triangle: an optimal
/// triangle is at most four times flatter than it. Jumps of Φ up to 1.5 within one triangle need
/// about 1/5; a smaller bound buys nothing and makes the stiffness of such a triangle explode, as
/// it grows with the inverse square.
pub const MIN_RATIO: f64 = 1.0 / 16.0;

/// One constant-strain triangle: its optimal lengths and its quadratic form.
#[derive(Debug, Clone, Copy)]
struct Membrane {
    /// `l̄_k²` of the edge opposite corner k.
    square: Vector3<f64>,
    /// M, energy per length⁴.
    form: Matrix3<f64>,
}

impl Membrane {
    /// From the optimal and the rest lengths, `Y₂` and ν.
    fn new(optimal: [f64; 3], rest: [f64; 3], modulus: f64, poisson: f64) -> Self {
        let square = possible(Vector3::from(optimal.map(|l| l * l)), rest.map(|l| l * l));
        let gram = gram(&square);
        let area_squared = sixteen_area_squared(&square) / 16.0;
        let stiffness = area_squared.sqrt() * modulus / (1.0 - poisson * poisson);
        let form = Matrix3::from_fn(|k, l| {
            let mixed = gram[(k, l)] * gram[(k, l)];
            stiffness * ((1.0 - poisson) * mixed + poisson * square[k] * square[l])
        });
        let to_strain = (Matrix3::repeat(1.0) - 2.0 * Matrix3::identity()) / (16.0 * area_squared);
        Self { square, form: to_strain * form * to_strain }
    }

    /// Edge vectors and `s = M q`, with `q`.
    fn state(&self, x: &[Vec3; 3]) -> ([Vec3; 3], Vector3<f64>, Vector3<f64>) {
        let e = [x[2] - x[1], x[0] - x[2], x[1] - x[0]];
        let q = Vector3::from(e.map(|e| e.norm_squared())) - self.square;
        (e, self.form * q, q)
    }
}

/// Derivatives of [`Membrane::state`]'s s by the squares of the optimal lengths, as columns.
fn slopes(
    square: &Vector3<f64>,
    form: &Matrix3<f64>,
    q: &Vector3<f64>,
    (modulus, poisson): (f64, f64),
) -> Matrix3<f64> {
    let sum = square.sum();
    let gram = gram(square);
    let area_squared = sixteen_area_squared(square) / 16.0;
    let turn = Matrix3::repeat(1.0) - 2.0 * Matrix3::identity();
    let stiffness =
        modulus / (1.0 - poisson * poisson) / (256.0 * area_squared * area_squared.sqrt());
    let mut by = -form;
    for f in 0..3 {
        let is = |k: usize| if k == f { 1.0 } else { 0.0 };
        let rise = Matrix3::from_fn(|k, l| {
            let by_gram = if k == l { is(k) } else { 0.5 - is(k) - is(l) };
            2.0 * (1.0 - poisson) * gram[(k, l)] * by_gram
                + poisson * (is(k) * square[l] + square[k] * is(l))
        });
        let by_area = (sum - 2.0 * square[f]) / 8.0;
        let change = stiffness * (turn * rise * turn) - (1.5 * by_area / area_squared) * form;
        let column = change * q;
        by.set_column(f, &(by.column(f) + column));
    }
    by
}

/// `ē_k·ē_l`, from ē_0 + ē_1 + ē_2 = 0.
fn gram(square: &Vector3<f64>) -> Matrix3<f64> {
    let sum = square.sum();
    Matrix3::from_fn(
        |k, l| {
            if k == l { square[k] } else { 0.5 * (sum - 2.0 * (square[k] + square[l])) }
        },
    )
}

impl Element<3> for Membrane {
    fn gradient(&self, x: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
        let (e, s, q) = self.state(x);
        let pull = std::array::from_fn(|k| {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            2.0 * (s[next] * e[next] - s[last] * e[last])
        });
        (0.5 * q.dot(&s), pull)
    }

    fn hessian(&self, x: &[Vec3; 3], part: HessianPart) -> [[Block; 3]; 3] {
        let (e, s, _) = self.state(x);
        let s = match part {
            HessianPart::Positive => s.map(|s| s.max(0.0)),
            HessianPart::Full => s,
        };
        // Corner k is the head of edge k+1 and the tail of edge k+2.
        let ends = |k: usize| [((k + 1) % 3, 1.0), ((k + 2) % 3, -1.0)];
        std::array::from_fn(|k| {
            std::array::from_fn(|m| {
                let mut block = Block::zeros();
                for (i, head) in ends(k) {
                    let mut along = Vec3::zeros();
                    for (j, other) in ends(m) {
                        along += (4.0 * head * other * self.form[(i, j)]) * e[j];
                        if i == j {
                            block += Block::from_diagonal_element(2.0 * head * other * s[i]);
                        }
                    }
                    block += e[i] * along.transpose();
                }
                block
            })
        })
    }
}

/// `16 A²` of the triangle whose sides have the given squares; not positive if there is none.
fn sixteen_area_squared(square: &Vector3<f64>) -> f64 {
    let [a, b, c] = [square[0], square[1], square[2]];
    2.0 * (a * b + b * c + c * a) - (a * a + b * b + c * c)
}

/// Squared lengths that make a triangle at most [`MIN_RATIO`] flatter than the rest one, nearest
/// to `square`.
fn possible(square: Vector3<f64>, rest: [f64; 3]) -> Vector3<f64> {
    let rest = Vector3::from(rest);
    let Principal { large, small, .. } = Principal::new(&square, &rest);
    let least = MIN_RATIO * large;
    if small >= least {
        return square;
    }
    // C + (least - small) u uᵀ with u uᵀ = (C - large)/(small - large).
    let share = (least - small) / (small - large);
    (1.0 + share) * square - (share * large) * rest
}

/// Derivatives of [`possible`] by `square`.
fn possible_slopes(square: &Vector3<f64>, rest: [f64; 3]) -> Matrix3<f64> {
    let rest = Vector3::from(rest);
    let Principal { large, small, by_large, by_small } = Principal::new(square, &rest);
    if small >= MIN_RATIO * large {
        return Matrix3::identity();
    }
    let (rise, gap) = (MIN_RATIO * large - small, small - large);
    let share = rise / gap;
    let by_rise = MIN_RATIO * by_large - by_small;
    let by_share = by_rise / gap - (share / gap) * (by_small - by_large);
    (1.0 + share) * Matrix3::identity() + square * by_share.transpose()
        - rest * (large * by_share + share * by_large).transpose()
}

/// Principal values of the tensor C with `e⁰ᵀ C e⁰ = l̄²`, and their derivatives by the squares.
struct Principal {
    large: f64,
    small: f64,
    by_large: Vector3<f64>,
    by_small: Vector3<f64>,
}

impl Principal {
    fn new(square: &Vector3<f64>, rest: &Vector3<f64>) -> Self {
        let rest_area = sixteen_area_squared(rest);
        let by_trace = Vector3::from_fn(|k, _| (rest.sum() - 2.0 * rest[k]) / rest_area);
        let half_trace = by_trace.dot(square);
        let determinant = sixteen_area_squared(square) / rest_area;
        let by_determinant =
            Vector3::from_fn(|k, _| 2.0 * (square.sum() - 2.0 * square[k]) / rest_area);
        let spread = (half_trace * half_trace - determinant).max(0.0).sqrt();
        // Where both values are the same they are not differentiable; nor are they then raised.
        let by_spread = if spread > 0.0 {
            (half_trace * by_trace - 0.5 * by_determinant) / spread
        } else {
            Vector3::zeros()
        };
        Self {
            large: half_trace + spread,
            small: half_trace - spread,
            by_large: by_trace + by_spread,
            by_small: by_trace - by_spread,
        }
    }
}

/// Two-dimensional Young's modulus `Y₂` of an StVK membrane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StretchingModulus {
    /// `Y₂ = E h/(1-ν²)`, the paper's Y: agrees with the bonds at ν = 1/3.
    #[default]
    Paper,
    /// `Y₂ = E h`: plane stress, a plate cut from a block of Young's modulus E.
    #[serde(rename = "plate")]
    PlaneStress,
}

/// StVK stretching of one sheet.
#[derive(Debug)]
pub struct StvkStretching {
    /// Y₂ of the triangles.
    modulus: FieldValues,
    /// ν of the triangles.
    poisson: FieldValues,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct StvkWork {
    membrane: Vec<Membrane>,
    pull: Vec<[Vec3; 3]>,
    places: LazyStencils,
}

impl StvkStretching {
    /// For a sheet of the given material; lengths come with the rest metric.
    #[must_use]
    pub fn new(material: impl Into<MaterialField>, modulus: StretchingModulus) -> Self {
        let material = material.into();
        Self {
            modulus: match modulus {
                StretchingModulus::Paper => material.stretching_modulus(),
                StretchingModulus::PlaneStress => material.per_triangle(|m| m.young * m.thickness),
            },
            poisson: material.poisson,
        }
    }
}

impl Energy for StvkStretching {
    type Work = StvkWork;

    fn name(&self) -> &'static str {
        "stretching"
    }

    fn coupling(&self) -> Coupling {
        Coupling::ONE_RING
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Self::Work) {
        let metric = conditions.metric;
        let (optimal, rest) = (metric.length(), metric.reference_length());
        let edges = conditions.sheet.triangle_edges();
        let (modulus, poisson) = (&self.modulus, &self.poisson);
        let empty = Membrane { square: Vector3::zeros(), form: Matrix3::zeros() };
        work.membrane.resize(edges.len(), empty);
        parallel::fill(&mut work.membrane, |t| {
            let of = |length: &[f64]| edges[t].map(|e| length[e as usize]);
            Membrane::new(of(optimal), of(rest), modulus.at(t), poisson.at(t))
        });
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let membrane = &work.membrane;
        let mesh = Mesh::triangles(shape.sheet);
        element::evaluate(&mesh, |t| &membrane[t], shape.x, &mut work.pull, gradient)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let membrane = &work.membrane;
        let mesh = Mesh::triangles(shape.sheet);
        element::add_hessian(&mesh, |t| &membrane[t], shape.x, part, &mut work.places, into);
    }

    fn mixed_derivatives(
        &self,
        shape: &Shape<'_>,
        _: &Conditions<'_>,
        work: &mut Self::Work,
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        if by != ParameterField::OptimalLength {
            return;
        }
        let (optimal, rest) = (shape.metric.length(), shape.metric.reference_length());
        for (t, membrane) in work.membrane.iter().enumerate() {
            let edges = shape.sheet.triangle_edges()[t].map(|e| e as usize);
            let corners = shape.sheet.triangles()[t].map(|v| v as usize);
            let (e, _, q) = membrane.state(&shape.corners(t));
            let given = Vector3::from(edges.map(|e| optimal[e] * optimal[e]));
            let possible = possible_slopes(&given, edges.map(|e| rest[e] * rest[e]));
            let material = (self.modulus.at(t), self.poisson.at(t));
            let slopes = slopes(&membrane.square, &membrane.form, &q, material) * possible;
            for (f, edge) in edges.into_iter().enumerate() {
                let s = (2.0 * optimal[edge]) * slopes.column(f);
                for (k, v) in corners.into_iter().enumerate() {
                    let (next, last) = ((k + 1) % 3, (k + 2) % 3);
                    emit(v, edge, 2.0 * (s[next] * e[next] - s[last] * e[last]));
                }
            }
        }
    }

    fn force_scales(&self, edge: f64) -> ForceScales {
        ForceScales { unit_strain: self.modulus.mean() * edge, ..ForceScales::default() }
    }
}
