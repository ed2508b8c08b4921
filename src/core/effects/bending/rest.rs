//! Rest shapes of bending: where a sheet is unbent, if that is not the plane.
//!
//! ```text
//! rest = "flat"                  unbent in the plane (default)
//! rest = "mesh"                  in the rest positions of the sheet
//! rest = { state = "FILE" }      in the positions of another file of the same mesh
//! curvature = C₀                 and spontaneously curved from there on, 1/length: a field (`timed_field.rs`)
//! ```
//!
//! C₀ is that of Helfrich's `(B/2) (2H - C₀)²`, with H > 0 on a bump towards the normals (triangles are
//! counter-clockwise seen from there). A free strip without Gaussian curvature rolls to the radius 1/C₀; where the
//! curvature across is free too, the sheet becomes a piece of a sphere of the radius (1+ν)/C₀. A sheet whose
//! curvatures are c in both directions if it is cut into small pieces has `C₀ = (1+ν) c`.
//!
//! A law may give a C₀ of its own, `curvature` of `[kinetics]`, a function of the species at the vertices: it is added.
//!
//! Rest angles may flow ([`Remodelling`](super::remodelling)): what they have flowed by is added to them.
//!
//! Lengths are at rest as the mesh has them, whatever the rest shape of bending is.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::dihedral;
use crate::Vec3;
use crate::effects::timed_field::TimedField;
use crate::effects::{EffectContext, EffectError, Field, FieldValues, Reads};
use crate::geometry::Conditions;
use crate::kinetics::Location;
use crate::sheet::Sheet;

/// The shape in which bending is at rest, as a scene gives it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendingRest {
    /// The plane.
    #[default]
    Flat,
    /// The rest positions of the sheet.
    Mesh,
    /// The positions of a file of the same mesh.
    State(PathBuf),
}

/// A rest shape that is not flat, on a sheet.
#[derive(Debug, Clone, Default)]
pub struct RestShape {
    /// Positions of all vertices; none for the plane.
    pub(super) positions: Option<Vec<Vec3>>,
    /// C₀ of all vertices, 1/length; none for 0.
    pub(super) spontaneous_curvature: Option<Vec<f64>>,
    /// The C₀ that is added and changes in a run.
    pub(super) variable_curvature: VariableCurvature,
    /// Whether its angles flow.
    pub(super) flows: bool,
}

/// A spontaneous curvature that changes in a run: of the law, and by a formula of the time.
#[derive(Debug, Clone, Default)]
pub struct VariableCurvature {
    pub(super) law: bool,
    pub(super) timed: Option<TimedField>,
}

impl VariableCurvature {
    /// Whether there is any.
    pub(super) fn is_present(&self) -> bool {
        self.law || self.timed.is_some()
    }

    /// What an energy with it depends on.
    pub(super) fn reads(&self) -> Reads<'static> {
        Reads { time: self.timed.is_some(), curvature: self.law, ..Reads::default() }
    }

    /// Its values at the vertices; `None` if there is none.
    pub(super) fn values_at<'a>(&self, conditions: &Conditions<'a>) -> Option<Cow<'a, [f64]>> {
        let law = conditions.internal(SPONTANEOUS_CURVATURE).filter(|_| self.law);
        let Some(timed) = &self.timed else { return law.map(Cow::Borrowed) };
        let own = timed.evaluate(conditions.sheet, conditions.time);
        let of = |v: usize| own.at(v) + law.map_or(0.0, |law| law[v]);
        Some((0..conditions.sheet.vertex_count()).map(of).collect())
    }
}

/// What the C₀ that a law gives all vertices is called among the
/// [conditions](crate::geometry::Conditions::internal) of an energy.
pub const SPONTANEOUS_CURVATURE: &str = "spontaneous_curvature";

/// Name of the internal variable β, what rest angles have flowed by.
pub(super) const REMODELLING_NAME: &str = "angle_remodelling";

impl RestShape {
    /// The same, to which the spontaneous curvature that the law gives is added.
    #[must_use]
    pub fn with_law_curvature(self) -> Self {
        Self {
            variable_curvature: VariableCurvature { law: true, ..self.variable_curvature },
            ..self
        }
    }

    /// Whether there is a law that gives a spontaneous curvature.
    pub(super) fn law_gives_curvature(context: &EffectContext<'_>) -> bool {
        context.kinetics.is_some_and(|(law, _)| law.capabilities.curvature)
    }

    /// Unbent at these positions of the vertices.
    #[must_use]
    pub fn from_positions(positions: &[Vec3]) -> Self {
        Self { positions: Some(positions.to_vec()), ..Self::default() }
    }

    /// The one that a scene gives; `None` if it is flat.
    pub(super) fn read(
        rest: &BendingRest,
        curvature: Option<&Field>,
        context: &EffectContext<'_>,
    ) -> Result<Option<Self>, EffectError> {
        let sheet = context.sheet;
        let positions = match rest {
            BendingRest::Flat => None,
            BendingRest::Mesh => Some(sheet.rest().to_vec()),
            BendingRest::State(file) => Some(from_file(file, context)?),
        };
        if let Some(x) = &positions {
            check(sheet, x, rest)?;
        }
        let of = |field| context.timed_field(field, Location::Vertex, "curvature");
        let (spontaneous_curvature, timed) = match curvature.map(of).transpose()? {
            None => (None, None),
            Some(TimedField::Given(FieldValues::Same(value))) => {
                (Some(vec![value; sheet.vertex_count()]), None)
            }
            Some(TimedField::Given(FieldValues::Each(all))) => (Some(all), None),
            timed => (None, timed),
        };
        let variable_curvature =
            VariableCurvature { law: Self::law_gives_curvature(context), timed };
        let made = Self { positions, spontaneous_curvature, variable_curvature, flows: false };
        let flat = made.positions.is_none()
            && made.spontaneous_curvature.is_none()
            && !made.variable_curvature.is_present();
        Ok((!flat).then_some(made))
    }

    /// What the hinges with these corners keep.
    pub(super) fn at_hinges(&self, corners: &[[u32; 4]]) -> RestAngles {
        let angle = |x: &Vec<Vec3>| {
            corners.iter().map(|c| dihedral::psi(&c.map(|v| x[v as usize]))).collect()
        };
        let mean = |c: &Vec<f64>| {
            let of = |[a, b, ..]: &[u32; 4]| 0.5 * (c[*a as usize] + c[*b as usize]);
            corners.iter().map(of).collect()
        };
        RestAngles {
            angle: self.positions.as_ref().map(angle).unwrap_or_default(),
            spontaneous_curvature: self
                .spontaneous_curvature
                .as_ref()
                .map(mean)
                .unwrap_or_default(),
            variable_curvature: self.variable_curvature.clone(),
            flows: self.flows,
        }
    }
}

/// Positions of a file of the same mesh.
fn from_file(file: &Path, context: &EffectContext<'_>) -> Result<Vec<Vec3>, EffectError> {
    let refuse = |message: String, help: &str| EffectError {
        key: "rest",
        message: format!("{}: {message}", file.display()),
        help: Some(help.into()),
    };
    let Some(read) = context.read else {
        return Err(refuse("files are not read here".into(), "give rest = \"mesh\""));
    };
    let unread = |message: String| EffectError { key: "rest", message, help: None };
    let (other, _) = read(file).map_err(unread)?.into_sheet().map_err(|e| unread(e.to_string()))?;
    let sheet = context.sheet;
    let (here, there) = (sheet.vertex_count(), other.vertex_count());
    let help = "a state is a file of the same mesh with other positions, as a frame of a run is";
    if here != there {
        return Err(refuse(format!("it has {there} vertices, and the sheet has {here}"), help));
    }
    if let Some(t) = (0..sheet.triangle_count().max(other.triangle_count()))
        .find(|&t| sheet.triangles().get(t) != other.triangles().get(t))
    {
        let of = |sheet: &Sheet| match sheet.triangles().get(t) {
            Some(corners) => format!("{corners:?}"),
            None => "missing".to_owned(),
        };
        let (here, there) = (of(sheet), of(&other));
        let message =
            format!("triangle {t} is {there} there and {here} in the sheet: another mesh");
        return Err(refuse(message, help));
    }
    Ok(other.rest().to_vec())
}

/// Refuses rest shapes in which a triangle has no area or two lie on one another.
fn check(sheet: &Sheet, x: &[Vec3], rest: &BendingRest) -> Result<(), EffectError> {
    let what = if *rest == BendingRest::Mesh { "the mesh" } else { "that state" };
    let bad = dihedral::hinges(sheet).find(|(_, corners)| {
        !(dihedral::psi(&corners.map(|v| x[v as usize])).abs() < CLOSED_FOLD_PSI)
    });
    let Some((_, [a, b, ..])) = bad else { return Ok(()) };
    let message = format!(
        "{what} cannot be a rest shape: at the edge between vertices {a} and {b} it is folded onto itself, or a \
         triangle there has no area"
    );
    Err(EffectError { key: "rest", message, help: Some("rest = \"flat\" needs no angles".into()) })
}

/// ψ beyond which a fold counts as closed: 179.4 degrees. Its stiffness grows with ψ⁴.
const CLOSED_FOLD_PSI: f64 = 400.0;

/// Rest angles of the hinges of a sheet; a list may be empty, which means zeros.
#[derive(Debug, Clone, Default)]
pub struct RestAngles {
    /// ψ in the rest shape.
    angle: Vec<f64>,
    /// C₀, 1/length.
    spontaneous_curvature: Vec<f64>,
    pub(super) variable_curvature: VariableCurvature,
    /// Whether they flow.
    pub(super) flows: bool,
}

impl RestAngles {
    /// ψ⁰ of hinge `h` under the optimal length of its edge and the sum of the optimal areas of its triangles; `shift` is
    /// added: what it has flowed by, or what a variable curvature gives.
    pub(super) fn angle(&self, h: usize, (length, areas): (f64, f64), shift: f64) -> f64 {
        let angle = self.angle.get(h).copied().unwrap_or(0.0);
        angle + self.spontaneous_curvature(h) * areas / length + shift
    }

    /// C₀ at hinge `h`, 1/length.
    pub(super) fn spontaneous_curvature(&self, h: usize) -> f64 {
        self.spontaneous_curvature.get(h).copied().unwrap_or(0.0)
    }
}
