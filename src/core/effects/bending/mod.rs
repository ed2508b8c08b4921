//! Bending: parameters of the effect, and its discrete models.

mod dihedral;
mod hinge;
mod meyer;
mod remodelling;
mod rest;

pub use hinge::HingeBending;
pub use meyer::{BendingWeight, MeyerBending};
pub use rest::{BendingRest, RestShape, SPONTANEOUS_CURVATURE};

use remodelling::AngleRemodelling;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::{Field, named};
use super::flow_rule::FlowRule;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Needs, SceneSummary, misplaced, timed_field,
};
use crate::geometry::AreaRule;
use crate::kinetics::breakpoints::TimeDependence;
use crate::sheet::Sheet;

/// Angles of triangles below this, rad, are those of a plane in numbers of 32 bits.
const ROUND_OFF_ANGLE: f64 = 1e-3;

/// Parameters of bending in a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Given", into = "Given")]
pub struct Bending {
    /// The discrete model.
    pub model: BendingModel,
    /// Whether the sum over vertices carries their areas; only `model = "meyer"` has it.
    pub weight: BendingWeight,
    /// The area of a vertex, here and in the signals; only `model = "meyer"` has it.
    pub area: AreaRule,
    /// The shape in which it is at rest.
    pub rest: BendingRest,
    /// The spontaneous curvature C₀, 1/length; formulas may read the time `t`.
    pub curvature: Option<Field>,
    /// Flow of its rest angles towards the actual ones; only `model = "hinge"` has it.
    pub remodelling: Option<FlowRule>,
    #[serde(skip)]
    misplaced: Option<&'static str>,
}

/// The keys as they are written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    #[serde(default)]
    model: BendingModel,
    #[serde(skip_serializing_if = "Option::is_none")]
    weight: Option<BendingWeight>,
    #[serde(skip_serializing_if = "Option::is_none")]
    area: Option<AreaRule>,
    #[serde(default, skip_serializing_if = "is_flat")]
    rest: BendingRest,
    #[serde(skip_serializing_if = "Option::is_none")]
    curvature: Option<Field>,
    #[serde(skip_serializing_if = "Option::is_none")]
    remodelling: Option<FlowRule>,
}

fn is_flat(rest: &BendingRest) -> bool {
    *rest == BendingRest::Flat
}

impl From<Given> for Bending {
    fn from(given: Given) -> Self {
        let misplaced = match given.model {
            BendingModel::Meyer => given.remodelling.as_ref().map(|_| "remodelling"),
            BendingModel::Hinge => {
                given.weight.map(|_| "weight").or_else(|| given.area.map(|_| "area"))
            }
        };
        Self {
            model: given.model,
            weight: given.weight.unwrap_or_default(),
            area: given.area.unwrap_or_default(),
            rest: given.rest,
            curvature: given.curvature,
            remodelling: given.remodelling,
            misplaced,
        }
    }
}

impl From<Bending> for Given {
    fn from(it: Bending) -> Self {
        let meyer = it.model == BendingModel::Meyer;
        Self {
            model: it.model,
            weight: meyer.then_some(it.weight),
            area: meyer.then_some(it.area),
            rest: it.rest,
            curvature: it.curvature,
            remodelling: it.remodelling,
        }
    }
}

#[typetag::serialize(name = "bending")]
impl EffectSpec for Bending {
    fn needs(&self) -> Needs {
        Needs { material: true, out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        timed_field::time_dependence(&self.curvature, sheet, until)
    }

    fn vertex_area(&self) -> Option<AreaRule> {
        (self.model == BendingModel::Meyer).then_some(self.area)
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let rest = match &self.rest {
            BendingRest::State(file) => Some(file.as_path()),
            BendingRest::Flat | BendingRest::Mesh => None,
        };
        let curvature = self.curvature.as_ref().and_then(Field::file);
        let mut all = named([("rest.state", rest), ("curvature.file", curvature)]);
        if let Some(flow) = &self.remodelling {
            all.extend(flow.files(["remodelling.time.file", "remodelling.yield.file"]));
        }
        all
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        if let BendingRest::State(file) = &mut self.rest {
            *file = folder.join(&*file);
        }
        if let Some(curvature) = &mut self.curvature {
            curvature.resolve_path_against(folder);
        }
        if let Some(flow) = &mut self.remodelling {
            flow.resolve_paths_against(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        self.check(context)?;
        let (sheet, material) = (context.sheet, context.elasticity()?);
        let rest = RestShape::read(&self.rest, self.curvature.as_ref(), context)?;
        if let Some(flow) = &self.remodelling {
            let rest = RestShape { flows: true, ..rest.unwrap_or_default() };
            if rest.variable_curvature.timed.is_some() {
                return Err(EffectError {
                    key: "curvature",
                    message: "rest angles that flow do not read a spontaneous curvature that depends on time".into(),
                    help: Some("leave out remodelling, or t in the formula".into()),
                });
            }
            let flow = AngleRemodelling::new(flow, context, &rest)?;
            let energy = HingeBending::with_rest(sheet, material, &rest);
            return Ok(Effect { internal: vec![Box::new(flow)], ..Effect::energy(energy) });
        }
        Ok(match (self.model, rest) {
            (BendingModel::Meyer, None) => {
                Effect::energy(MeyerBending::new(sheet, material, self.weight, self.area))
            }
            (BendingModel::Meyer, Some(rest)) => {
                Effect::energy(MeyerBending::with_rest(sheet, material, self.area, &rest))
            }
            (BendingModel::Hinge, None) => Effect::energy(HingeBending::new(sheet, material)),
            (BendingModel::Hinge, Some(rest)) => {
                Effect::energy(HingeBending::with_rest(sheet, material, &rest))
            }
        })
    }

    /// A curved sheet of a file that is at rest in the plane: it is under stress from the start.
    fn notes(&self, context: &EffectContext<'_>, scene: &SceneSummary<'_>) -> Vec<String> {
        let given = self.rest != BendingRest::Flat || self.curvature.is_some();
        if given || !scene.sheet_file || RestShape::law_gives_curvature(context) {
            return Vec::new();
        }
        let (x, sheet) = (context.sheet.rest(), context.sheet);
        let psi = dihedral::hinges(sheet).map(|(_, c)| dihedral::psi(&c.map(|v| x[v as usize])));
        let angle = 2.0 * (0.5 * psi.fold(0.0, |most: f64, psi| psi.abs().max(most))).atan();
        let note = format!(
            "warning: the shape of sheet.file is not free of stress: its triangles enclose angles of up to {angle:.2e} rad, \
             and bending is at rest in the plane; without loads the sheet moves. With bending.rest = \"mesh\" it is at rest in that shape"
        );
        if angle > ROUND_OFF_ANGLE { vec![note] } else { Vec::new() }
    }
}

impl Bending {
    /// Refuses keys that do not go together, or with the law.
    fn check(&self, context: &EffectContext<'_>) -> Result<(), EffectError> {
        if let Some(key) = self.misplaced {
            let meyer = self.model == BendingModel::Meyer;
            let reason = "has curvatures at vertices and no rest angles";
            return Err(match meyer {
                true => misplaced(key, "meyer", reason, "hinge"),
                false => misplaced(
                    key,
                    "hinge",
                    "weights its edges by optimal lengths and areas",
                    "meyer",
                ),
            });
        }
        let refuse = |key, message: &str, help: String| {
            Err(EffectError { key, message: message.into(), help: Some(help) })
        };
        let law = RestShape::law_gives_curvature(context);
        if self.weight == BendingWeight::Paper {
            let printed =
                "weight = \"paper\" is the sum as printed, of a sheet that rests in the plane";
            let curved =
                [(self.rest != BendingRest::Flat, "rest"), (self.curvature.is_some(), "curvature")];
            if let Some((_, key)) = curved.into_iter().find(|(given, _)| *given) {
                let help = format!("leave {key} out, or choose weight = \"area\"");
                return refuse(key, printed, help);
            }
            if law {
                let help = "the law gives a spontaneous curvature: choose weight = \"area\"";
                return refuse("weight", printed, help.into());
            }
        }
        if law && self.remodelling.is_some() {
            let message = "rest angles that flow do not read the spontaneous curvature of the law";
            let help = "leave out remodelling, or curvature of [kinetics]";
            return refuse("remodelling", message, help.into());
        }
        Ok(())
    }
}

crate::register_kind!(dyn EffectSpec, "bending", Bending);

/// Discrete models of bending.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendingModel {
    /// Cotangent mean curvature at the vertices (the paper's).
    #[default]
    Meyer,
    /// Angles between neighbouring triangles.
    Hinge,
}
