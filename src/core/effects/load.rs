//! Dead loads: forces that keep their size and direction however the sheet moves.
//!
//! ```text
//! U = -Σ_i f_i·(x_i - X_i),     ∂U/∂x_i = -f_i,     ∂²U = 0
//! ```
//!
//! with the forces f_i fixed by the rest state. `force` says what is given:
//!
//! * `{ total = F }`: F, shared equally among the chosen vertices;
//! * `{ per-vertex = f }`: `f_i = f` at each of them;
//! * `{ per-length = f }`, force/length: a boundary edge whose two ends are chosen gives `f l⁰/2` to each;
//! * `{ per-area = f }`, force/length²: a triangle whose three corners are chosen gives `f A⁰/3` to
//!   each;
//! * `{ along-normal = p }`, force/length²: the same with `f = p n⁰`, n⁰ the normal of the rest
//!   triangle. For a pressure that follows the sheet see the effect `pressure`.
//!
//! F is three numbers; components of f and p are fields (`field.rs`): at the vertices for `per-vertex` and `per-length`, on
//! the triangles for the others. Their formulas may read the time t: a load that travels.
//!
//! U counts from the rest positions, so a large sheet far from the origin loses no digits.
//! `ramp` multiplies the forces by a factor of time (see the file `ramp.rs`); without it they are constant.
//! Not covered: dead moments.

use std::borrow::Cow;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::ramp::RampFactor;
use super::timed_field::{self, TimedField};
use super::{
    Coupling, Effect, EffectContext, EffectError, EffectSpec, Energy, Field, FieldValues,
    ForceScales, HessianPart, Measure, Needs, Ramp, Reads, Region,
};
use crate::geometry::{Conditions, Shape};
use crate::kinetics::Location;
use crate::kinetics::breakpoints::TimeDependence;
use crate::linear::BlockMatrix;
use crate::num::checked::Finite;
use crate::sheet::{Edge, Sheet};
use crate::{Vec3, parallel};

/// Parameters of a dead load in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Which vertices.
    #[serde(rename = "where")]
    pub region: Region,
    /// The force.
    pub force: LoadForce,
    /// Its factor in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

/// The force of a load: total, per vertex, per length or per area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadForce {
    /// Force on all chosen vertices together.
    Total([Finite; 3]),
    /// Force on each chosen vertex.
    PerVertex([Field; 3]),
    /// Force per rest length of the boundary between chosen vertices.
    PerLength([Field; 3]),
    /// Force per rest area of the triangles between chosen vertices.
    PerArea([Field; 3]),
    /// Force per rest area along the normal of the rest triangle.
    AlongNormal(Field),
}

#[typetag::serialize(name = "load")]
impl EffectSpec for Load {
    fn needs(&self) -> Needs {
        let along_z = match &self.force {
            LoadForce::Total(f) => f[2].get() != 0.0,
            LoadForce::PerVertex(f) | LoadForce::PerLength(f) | LoadForce::PerArea(f) => {
                f[2].number() != Some(0.0)
            }
            LoadForce::AlongNormal(_) => true,
        };
        Needs { out_of_plane: along_z.then_some("force"), ..Needs::default() }
    }

    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        let mut found = timed_field::time_dependence(self.force.fields(), sheet, until);
        found.add(RampFactor::time_dependence_of(self.ramp.as_ref(), until));
        found
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let components = self.force.fields().iter();
        components.filter_map(|field| Some(("force", field.file()?))).collect()
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        for field in self.force.fields_mut() {
            field.resolve_path_against(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let chosen = self.region.choose(context.sheet, "load")?;
        let factor = RampFactor::new(self.ramp.as_ref())?;
        let load = DeadLoad::read(context, &chosen, &self.force)?;
        Ok(Effect::energy(DeadLoad { factor, ..load }))
    }
}

crate::register_kind!(dyn EffectSpec, "load", Load);

impl LoadForce {
    /// What it has of fields.
    fn fields(&self) -> &[Field] {
        match self {
            Self::Total(_) => &[],
            Self::PerVertex(f) | Self::PerLength(f) | Self::PerArea(f) => f,
            Self::AlongNormal(p) => std::slice::from_ref(p),
        }
    }

    fn fields_mut(&mut self) -> &mut [Field] {
        match self {
            Self::Total(_) => &mut [],
            Self::PerVertex(f) | Self::PerLength(f) | Self::PerArea(f) => f,
            Self::AlongNormal(p) => std::slice::from_mut(p),
        }
    }

    /// Where its fields are read.
    fn location(&self) -> Location {
        match self {
            Self::PerArea(_) | Self::AlongNormal(_) => Location::Face,
            _ => Location::Vertex,
        }
    }
}

/// Force on every vertex of a load on the `chosen` ones, and the number of vertices, edges or triangles that carry it;
/// `fields` are the values of those of `force`.
fn spread(
    sheet: &Sheet,
    chosen: &[bool],
    force: &LoadForce,
    fields: &[Cow<'_, FieldValues>],
) -> (Vec<Vec3>, usize) {
    let inside = |v: &u32| chosen[*v as usize];
    let vector = |i: usize| Vec3::from_fn(|axis, _| fields[axis].at(i));
    let mut on = vec![Vec3::zeros(); sheet.vertex_count()];
    let mut carriers = 0;
    match force {
        LoadForce::Total(_) | LoadForce::PerVertex(_) => {
            carriers = chosen.iter().filter(|c| **c).count();
            let all = sheet.reduction();
            let count = all.sum(chosen.len(), |i| if chosen[i] { 1.0 } else { 0.0 });
            let of = on.iter_mut().enumerate().zip(chosen).filter(|(_, chosen)| **chosen);
            of.for_each(|((i, on), _)| {
                *on = match force {
                    LoadForce::Total(f) => Vec3::from(f.map(Finite::get)) / count.max(1.0),
                    _ => vector(i),
                };
            });
        }
        LoadForce::PerLength(_) => {
            let boundary = sheet.edges().iter().filter(|edge| edge.is_boundary());
            for Edge { vertices, .. } in boundary.filter(|edge| edge.vertices.iter().all(inside)) {
                let [a, b] = vertices.map(|v| v as usize);
                let half = 0.5 * (sheet.rest()[b] - sheet.rest()[a]).norm();
                on[a] += half * vector(a);
                on[b] += half * vector(b);
                carriers += 1;
            }
        }
        LoadForce::PerArea(_) | LoadForce::AlongNormal(_) => {
            let all = sheet.triangles().iter().enumerate();
            for (t, triangle) in all.filter(|(_, corners)| corners.iter().all(inside)) {
                let [a, b, c] = triangle.map(|v| sheet.rest()[v as usize]);
                // N = 2 A n.
                let cross = (b - a).cross(&(c - a));
                let sixth = match force {
                    LoadForce::AlongNormal(_) => fields[0].at(t) * cross,
                    _ => cross.norm() * vector(t),
                };
                for v in triangle {
                    on[*v as usize] += sixth / 6.0;
                }
                carriers += 1;
            }
        }
    }
    (on, carriers)
}

/// Forces on the vertices of one sheet that no motion changes.
#[derive(Debug)]
pub struct DeadLoad {
    /// At time 0.
    force: Vec<Vec3>,
    factor: RampFactor,
    timed: Option<Box<TimedForce>>,
}

/// Forces by formulas of the time.
#[derive(Debug)]
struct TimedForce {
    chosen: Vec<bool>,
    force: LoadForce,
    fields: Vec<TimedField>,
}

impl TimedForce {
    fn evaluate(&self, sheet: &Sheet, time: f64) -> Vec<Vec3> {
        let fields: Vec<_> = self.fields.iter().map(|field| field.evaluate(sheet, time)).collect();
        spread(sheet, &self.chosen, &self.force, &fields).0
    }
}

impl DeadLoad {
    /// Spreads `force`, which reads no files, over the vertices of `sheet` that are `chosen`.
    ///
    /// # Errors
    /// A force per length where no boundary edge, or per area where no triangle, lies between chosen
    /// vertices; a field that cannot be read.
    pub fn new(sheet: &Sheet, chosen: &[bool], force: LoadForce) -> Result<Self, EffectError> {
        let (material, varying, kinetics, read) = (None, None, None, None);
        let measure = Measure::default();
        let context = EffectContext { sheet, material, varying, kinetics, measure, read };
        Self::read(&context, chosen, &force)
    }

    fn read(
        context: &EffectContext<'_>,
        chosen: &[bool],
        force: &LoadForce,
    ) -> Result<Self, EffectError> {
        let of = |field| context.timed_field(field, force.location(), "force");
        let fields: Vec<TimedField> = force.fields().iter().map(of).collect::<Result<_, _>>()?;
        let start: Vec<_> = fields.iter().map(|field| field.evaluate(context.sheet, 0.0)).collect();
        let (on, carriers) = spread(context.sheet, chosen, force, &start);
        drop(start);
        if context.sheet.reduction().any(carriers > 0) {
            let depends_on_time = fields.iter().any(TimedField::depends_on_time);
            let timed = || TimedForce { chosen: chosen.to_vec(), force: force.clone(), fields };
            let timed = depends_on_time.then(timed).map(Box::new);
            return Ok(Self { force: on, factor: RampFactor::default(), timed });
        }
        let (part, help) = match force {
            LoadForce::PerLength(_) => (
                "boundary edge has both ends",
                "a force per length acts on the boundary; for a force on single vertices use total or \
                 per-vertex",
            ),
            LoadForce::PerArea(_) | LoadForce::AlongNormal(_) => (
                "triangle has all corners",
                "a force per area acts on triangles; for all of them write where = \"all\"",
            ),
            _ => ("vertex is", "choose at least one"),
        };
        let message = format!("no {part} in the region of this load");
        Err(EffectError { key: "where", message, help: Some(help.into()) })
    }

    /// The force on every vertex at time 0, without the ramp.
    #[must_use]
    pub fn force(&self) -> &[Vec3] {
        &self.force
    }
}

impl Energy for DeadLoad {
    /// Forces by formulas of the time, at the time in force.
    type Work = Vec<Vec3>;

    fn name(&self) -> &'static str {
        "load"
    }

    fn coupling(&self) -> Coupling {
        Coupling::NONE
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(self.factor.changes() || self.timed.is_some())
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Vec<Vec3>) {
        if let Some(timed) = &self.timed {
            *work = timed.evaluate(conditions.sheet, conditions.time);
        }
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Vec<Vec3>,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let force: &[Vec3] = if self.timed.is_some() { work } else { &self.force };
        let (x, rest) = (shape.x, shape.sheet.rest());
        let factor = self.factor.factor_at(shape.time);
        if let Some(gradient) = gradient {
            parallel::update(gradient, |i, g| *g -= factor * force[i]);
        }
        let owned = shape.sheet.reduction().owned(x.len());
        -parallel::sum(owned, |i| factor * force[i].dot(&(x[i] - rest[i])))
    }

    fn add_hessian(&self, _: &Shape<'_>, _: &mut Vec<Vec3>, _: HessianPart, _: &mut BlockMatrix) {}

    fn force_scales(&self, _: f64) -> ForceScales {
        let applied =
            self.factor.largest() * self.force.iter().map(|f| f.norm()).fold(0.0, f64::max);
        ForceScales { applied, ..ForceScales::default() }
    }
}
