//! Active tension: what a sheet pulls with of itself, in all directions or along a fibre.
//!
//! ```text
//! without a fibre   U = Σ_T γ_T A_T                  tension γ of the current sheet in all its directions
//! along a fibre a   U = Σ_T τ_T A⁰_T (λ_T - 1)       λ = |F a|, F maps the sheet at rest to the current one
//! ```
//!
//! γ and τ are forces per length, positive where the sheet contracts; τ is the force along the fibres per width of the sheet
//! at rest, whatever they are stretched to (first Piola-Kirchhoff stress `τ (F a)/λ ⊗ a`). They add to the elastic stress,
//! unlike active strain, which changes what that refers to.
//! With constant `F a = Σ_k g_k x_k` in a triangle,
//!
//! ```text
//! ∂U/∂x_k = τ A⁰ g_k n,   ∂²U/∂x_k∂x_m = τ A⁰ g_k g_m (1 - n⊗n)/λ,   n = F a/λ
//! ∂(γ A)/∂x_k = γ/2 N × e_k,    N the unit normal, e_k the edge opposite corner k
//! ```
//!
//! The positive part has the first where τ > 0, and of γ A, where γ > 0, what acts along N: `γ/(4A) (e_k·e_m) N⊗N`.
//! No energy of its own resists: a sheet without stretching collapses.
//!
//! `value` is a field at the vertices, whose mean a triangle has, and a ramp its factor in time. Its formula may read the time, and species c,
//! which are constant in a relaxation; the forces then change with them by
//!
//! ```text
//! ∂²U/∂x_k∂c_v = ⅓ τ'(c_v) A⁰ g_k n,   ⅓ γ'(c_v) ½ N × e_k       v a corner of the triangle
//! ```
//!
//! Reference: e.g. Ambrosi & Pezzuto, *Active stress vs. active strain in mechanobiology*, J. Elasticity 107 (2012) 199,
//! doi:10.1007/s10659-011-9351-4. Not covered: tension that depends on the stretch of fibres.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::fibre::shape_slopes;
use super::field::named;
use super::ramp::RampFactor;
use super::timed_field;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Element, Elements, Fibre, Field, FieldValues,
    HessianPart, Ramp, VertexField,
};
use crate::Vec3;
use crate::geometry::Conditions;
use crate::kinetics::breakpoints::TimeDependence;
use crate::linear::Block;
use crate::sheet::Sheet;

/// Parameters of active tension in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActiveTension {
    /// γ or τ, force per length; positive contracts. A formula may read species and the time.
    pub value: Field,
    /// The direction of τ; without it the tension is γ, in all directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibre: Option<Fibre>,
    /// Its factor in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

#[typetag::serialize(name = "active-tension")]
impl EffectSpec for ActiveTension {
    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        let mut found = timed_field::time_dependence([&self.value], sheet, until);
        found.add(RampFactor::time_dependence_of(self.ramp.as_ref(), until));
        found
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let fibre = self.fibre.as_ref().and_then(Fibre::file);
        named([("value.file", self.value.file()), ("fibre.file", fibre)])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.value.resolve_path_against(folder);
        if let Some(fibre) = &mut self.fibre {
            fibre.resolve_path_against(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let fibres = self.fibre.as_ref().map(|fibre| fibre.in_triangles(context)).transpose()?;
        let unit_tensions = unit_tensions(context.sheet, fibres.as_deref());
        let field = context.vertex_field(&self.value, "value")?;
        let changes = factor.changes() || field.depends_on_time();
        let elements = match field {
            VertexField::Given(values) => given(context.sheet, unit_tensions, &values, factor),
            field @ VertexField::Formula(_) => {
                by_formula(context.sheet, unit_tensions, field, factor)
            }
        }?;
        Ok(Effect::energy(if changes { elements.depending_on_time() } else { elements }))
    }
}

crate::register_kind!(dyn EffectSpec, "active-tension", ActiveTension);

/// Tensions that neither species nor a formula of the time change, of triangles with these `unit_tensions`.
fn given(
    sheet: &Sheet,
    unit_tensions: Vec<Pull>,
    values: &FieldValues,
    factor: RampFactor,
) -> Result<Elements<3, Pull>, EffectError> {
    let mut pulls = unit_tensions;
    for (pull, corners) in pulls.iter_mut().zip(sheet.triangles()) {
        *pull = pull.times(mean(corners, |v| values.at(v)));
    }
    let applied = factor.largest() * largest_force(sheet, &pulls);
    let make = move |conditions: &Conditions<'_>, t: usize| {
        pulls[t].times(factor.factor_at(conditions.time))
    };
    let elements = Elements::new("active-tension", sheet, sheet.triangles().to_vec(), make)?;
    Ok(elements.with_applied_force(applied))
}

/// Tensions by a formula of species or of the time.
fn by_formula(
    sheet: &Sheet,
    unit_tensions: Vec<Pull>,
    field: VertexField,
    factor: RampFactor,
) -> Result<Elements<3, Pull>, EffectError> {
    let read = field.species().to_vec();
    let shared = Arc::new((unit_tensions, field, factor));
    let of = Arc::clone(&shared);
    let make = move |conditions: &Conditions<'_>, into: &mut Vec<Pull>| {
        let (unit_tensions, field, factor) = &*of;
        let (factor, values) = (factor.factor_at(conditions.time), field.evaluate(conditions));
        let all = unit_tensions.iter().zip(conditions.sheet.triangles());
        into.extend(
            all.map(|(unit, corners)| unit.times(factor * mean(corners, |v| values.at(v)))),
        );
    };
    let corners = sheet.triangles().to_vec();
    let elements = Elements::with_shared_evaluation("active-tension", sheet, corners, make)?;
    Ok(read.into_iter().enumerate().fold(elements, |elements, (k, species)| {
        let of = Arc::clone(&shared);
        elements.reading(species, move |conditions| {
            let (unit_tensions, field, factor) = &*of;
            let (third, slopes) =
                (factor.factor_at(conditions.time) / 3.0, field.slopes(conditions));
            let all = unit_tensions.iter().zip(conditions.sheet.triangles());
            all.map(|(unit, corners)| corners.map(|v| unit.times(third * slopes[k][v as usize])))
                .collect()
        })
    }))
}

/// The mean of the values at the corners.
fn mean(corners: &[u32; 3], at: impl Fn(usize) -> f64) -> f64 {
    corners.iter().map(|v| at(*v as usize)).sum::<f64>() / 3.0
}

/// The tension of one triangle.
#[derive(Debug, Clone, Copy)]
enum Pull {
    /// γ.
    Area(f64),
    /// τ A⁰, and g.
    Fibre(f64, [f64; 3]),
}

impl Pull {
    fn times(self, factor: f64) -> Self {
        match self {
            Self::Area(tension) => Self::Area(factor * tension),
            Self::Fibre(tension, g) => Self::Fibre(factor * tension, g),
        }
    }
}

/// A tension of 1 in all triangles, along fibres where there are any.
fn unit_tensions(sheet: &Sheet, fibres: Option<&[Vec3]>) -> Vec<Pull> {
    let of = |(t, corners): (usize, &[u32; 3])| {
        let Some(fibres) = fibres else { return Pull::Area(1.0) };
        let x = corners.map(|v| sheet.rest()[v as usize]);
        let twice_area = (x[1] - x[0]).cross(&(x[2] - x[0])).norm();
        Pull::Fibre(0.5 * twice_area, shape_slopes(sheet, t, &fibres[t]))
    };
    sheet.triangles().iter().enumerate().map(of).collect()
}

/// The largest force on a vertex at rest.
fn largest_force(sheet: &Sheet, pulls: &[Pull]) -> f64 {
    let mut force = vec![Vec3::zeros(); sheet.vertex_count()];
    for (corners, pull) in sheet.triangles().iter().zip(pulls) {
        let (_, of) = pull.gradient(&corners.map(|v| sheet.rest()[v as usize]));
        corners.iter().zip(of).for_each(|(v, f)| force[*v as usize] += f);
    }
    force.iter().map(|f| f.norm()).fold(0.0, f64::max)
}

impl Element<3> for Pull {
    fn gradient(&self, x: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
        match self {
            Self::Area(tension) => {
                let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
                let twice_area = normal.norm();
                let unit = normal / twice_area.max(f64::MIN_POSITIVE);
                let edge = |k: usize| x[(k + 2) % 3] - x[(k + 1) % 3];
                let of = |k: usize| 0.5 * tension * unit.cross(&edge(k));
                (0.5 * tension * twice_area, [0, 1, 2].map(of))
            }
            Self::Fibre(tension, g) => {
                let stretched = g[0] * x[0] + g[1] * x[1] + g[2] * x[2];
                let stretch = stretched.norm();
                let along = stretched / stretch.max(f64::MIN_POSITIVE);
                (tension * (stretch - 1.0), g.map(|g| tension * g * along))
            }
        }
    }

    fn hessian(&self, x: &[Vec3; 3], part: HessianPart) -> [[Block; 3]; 3] {
        let zero = [[Block::zeros(); 3]; 3];
        let positive = part == HessianPart::Positive;
        match self {
            Self::Area(tension) if positive && *tension < 0.0 => zero,
            Self::Area(tension) => area_hessian(x, *tension, positive),
            Self::Fibre(tension, _) if positive && *tension < 0.0 => zero,
            Self::Fibre(tension, g) => {
                let stretched = g[0] * x[0] + g[1] * x[1] + g[2] * x[2];
                let stretch = stretched.norm().max(f64::MIN_POSITIVE);
                let along = stretched / stretch;
                let across = (Block::identity() - along * along.transpose()) * (tension / stretch);
                g.map(|p| g.map(|q| p * q * across))
            }
        }
    }
}

/// Second derivatives of γ A.
fn area_hessian(x: &[Vec3; 3], tension: f64, positive: bool) -> [[Block; 3]; 3] {
    let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
    let twice_area = normal.norm().max(f64::MIN_POSITIVE);
    let unit = normal / twice_area;
    let edge = [0, 1, 2].map(|k| x[(k + 2) % 3] - x[(k + 1) % 3]);
    let normal_projector = unit * unit.transpose();
    let block =
        |k: usize, m: usize| area_block((k, m), &edge, (&unit, &normal_projector), positive);
    [0, 1, 2].map(|k| [0, 1, 2].map(|m| block(k, m) * (0.5 * tension / twice_area)))
}

/// `4A ∂²A/∂x_k∂x_m`. The normal 2A N changes by `e_k × d` where corner k moves by d, so that the block is
///
/// ```text
/// (e_k·e_m) 1 - e_m⊗e_k - (N × e_k)⊗(N × e_m)  ± 2A [N]×
/// ```
///
/// the last, for k ≠ m, minus where m follows k. Along N only `(e_k·e_m) N⊗N` acts: the positive part.
fn area_block(
    (k, m): (usize, usize),
    edge: &[Vec3; 3],
    (unit, normal_projector): (&Vec3, &Block),
    positive: bool,
) -> Block {
    let (e, f) = (edge[k], edge[m]);
    if positive {
        return e.dot(&f) * normal_projector;
    }
    let (c, d) = (unit.cross(&e), unit.cross(&f));
    let first = e.dot(&f) * Block::identity() - f * e.transpose() - c * d.transpose();
    if k == m {
        return first;
    }
    // The corner after k is m, or the other way round.
    let sign = if (k + 1) % 3 == m { -1.0 } else { 1.0 };
    let twice_area = edge[0].cross(&edge[1]).norm();
    first + sign * twice_area * unit.cross_matrix()
}
