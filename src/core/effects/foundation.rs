//! An elastic foundation: springs that pull every point of a region back to where it rested, or to a
//! plane.
//!
//! ```text
//! U = Σ_i ½ k A⁰_i |x_i - X_i|²              to = "rest"
//! U = Σ_i ½ k A⁰_i ((x_i - p)·n)²            to = { plane = { point = p, normal = n } }
//! ```
//!
//! k is the foundation modulus (Winkler's), force/length³, a field at the vertices (`field.rs`); `A⁰_i` a third of the rest area of the
//! triangles around vertex i of which all corners are in the region. The force on a vertex is
//! `-k A⁰_i (x_i - X_i)`: **it pulls towards the foundation on both sides**. A sheet of rigidity B on
//! it wrinkles with the wavenumber `(k/B)^¼`.
//!
//! Reference: Winkler, *Die Lehre von der Elasticität und Festigkeit* (1867); e.g. Timoshenko &
//! Woinowsky-Krieger, *Theory of Plates and Shells* (1959), chapter 8. Not covered: foundations that only
//! push, or that resist shear.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{
    Block, Effect, EffectContext, EffectError, EffectSpec, Element, Elements, Field, HessianPart,
    Needs, Region,
};
use crate::Vec3;
use crate::kinetics::Location;
use crate::num::checked::{Finite, Positive};
use crate::num::index;

/// Parameters of a foundation in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foundation {
    /// Which vertices.
    #[serde(rename = "where")]
    pub region: Region,
    /// The modulus k, force per length³.
    pub stiffness: Field<Positive>,
    /// Where to.
    #[serde(default)]
    pub to: FoundationTarget,
}

/// Where a foundation pulls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum FoundationTarget {
    /// To the rest position of every vertex.
    #[default]
    Rest,
    /// To a plane, along which nothing is resisted.
    Plane {
        /// A point of it.
        #[serde(default)]
        point: [Finite; 3],
        /// Its normal; the length does not matter.
        normal: [Finite; 3],
    },
}

#[typetag::serialize(name = "foundation")]
impl EffectSpec for Foundation {
    fn needs(&self) -> Needs {
        let along_z = match self.to {
            FoundationTarget::Rest => false,
            FoundationTarget::Plane { normal, .. } => normal[2].get() != 0.0,
        };
        Needs { out_of_plane: along_z.then_some("to"), ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("stiffness.file", self.stiffness.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.stiffness.resolve_path_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let sheet = context.sheet;
        let chosen = self.region.choose(sheet, "foundation")?;
        let mut area = vec![0.0; sheet.vertex_count()];
        for corners in sheet.triangles().iter().filter(|t| t.iter().all(|v| chosen[*v as usize])) {
            let [a, b, c] = corners.map(|v| sheet.rest()[v as usize]);
            let sixth = (b - a).cross(&(c - a)).norm() / 6.0;
            corners.iter().for_each(|v| area[*v as usize] += sixth);
        }
        let on: Vec<usize> = (0..area.len()).filter(|&i| area[i] > 0.0).collect();
        if !sheet.reduction().any(!on.is_empty()) {
            let message = "the region of this foundation contains no triangle".to_owned();
            let help = Some("a foundation acts on areas: choose whole triangles".to_owned());
            return Err(EffectError { key: "where", message, help });
        }
        let vector = |v: [Finite; 3]| Vec3::from(v.map(Finite::get));
        let (plane, resists) = match self.to {
            FoundationTarget::Rest => (None, Block::identity()),
            FoundationTarget::Plane { point, normal } => {
                let Some(n) = vector(normal).try_normalize(0.0) else {
                    let message = "the normal must be a nonzero vector".to_owned();
                    return Err(EffectError { key: "to", message, help: None });
                };
                (Some(vector(point)), n * n.transpose())
            }
        };
        let stiffness = context.values(&self.stiffness, Location::Vertex, "stiffness")?;
        let springs: Vec<Spring> = on
            .iter()
            .map(|&i| Spring {
                foot: plane.unwrap_or(sheet.rest()[i]),
                stiffness: stiffness.at(i) * area[i] * resists,
            })
            .collect();
        let corners = on.iter().map(|&i| [index(i)]).collect();
        let made = Elements::new("foundation", sheet, corners, move |_, e| springs[e])?;
        Ok(Effect::energy(made))
    }
}

crate::register_kind!(dyn EffectSpec, "foundation", Foundation);

/// A spring at one vertex.
#[derive(Debug, Clone, Copy)]
struct Spring {
    foot: Vec3,
    /// Force per displacement.
    stiffness: Block,
}

impl Element<1> for Spring {
    fn gradient(&self, [x]: &[Vec3; 1]) -> (f64, [Vec3; 1]) {
        let force = self.stiffness * (x - self.foot);
        (0.5 * force.dot(&(x - self.foot)), [force])
    }

    fn hessian(&self, _: &[Vec3; 1], _: HessianPart) -> [[Block; 1]; 1] {
        [[self.stiffness]]
    }
}
