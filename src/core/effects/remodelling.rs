//! Remodelling: optimal lengths that flow towards the actual ones, so that stress relaxes.
//!
//! ```text
//! l̄_ij = λ_ij Φ_ij l⁰_ij
//! dλ_ij/dt = λ_ij (ε - y sign ε)/τ  where |ε| > y, 0 elsewhere,     ε = l_ij/l̄_ij - 1
//! ```
//!
//! with λ = 1 at the start, Φ the length factors of growth and laws, τ the relaxation time and y the yield strain, both
//! fields (`field.rs`). At constant Φ and without a yield strain this is `d l̄/dt = (l - l̄)/τ`: a Maxwell material; with
//! one, Bingham's and Perzyna's plasticity. An edge flows if both its ends lie in the region.
//!
//! **What is exact.** At a given shape `l - l̄` of every edge falls as exp(-t/τ). Bonds and the triangles of St. Venant
//! and Kirchhoff read l̄, three lengths a triangle being all of its metric: for small strains the strain tensor
//! of a triangle, and with it the stress, its shear and its trace alike, relaxes with the one time τ. With a yield
//! strain each edge yields by its own strain, so that the yield stress of the sheet depends on the directions of the
//! edges. At large strains, creep continues as long as the load acts, and the optimal lengths of a triangle may come to make
//! none.
//!
//! Reference: Maxwell, Phil. Trans. R. Soc. 157 (1867) 49, doi:10.1098/rstl.1867.0004; rest lengths that flow, e.g. Noll,
//! Mani, Heemskerk, Streichan & Shraiman, Nature Physics 13 (2017) 1221, doi:10.1038/nphys4219. Not covered: flow
//! that keeps areas.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::flow_rule::{Flow, FlowRule, Keys};
use super::{Effect, EffectContext, EffectError, EffectSpec, Field, InternalVariables, Region};
use crate::geometry::Shape;
use crate::kinetics::Location;
use crate::num::checked::{NonNegative, Positive};
use crate::parallel;

/// A strain that matters: absolute tolerances are in units of it.
const TYPICAL_STRAIN: f64 = 1e-3;

/// Parameters of remodelling in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Given", into = "Given")]
pub struct Remodelling {
    /// The relaxation time and the yield strain.
    pub flow: FlowRule,
    /// Where it flows.
    pub region: Region,
}

/// The keys as they are written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    time: Field<Positive>,
    #[serde(rename = "yield", skip_serializing_if = "Option::is_none")]
    threshold: Option<Field<NonNegative>>,
    #[serde(rename = "where", default = "everywhere")]
    region: Region,
}

fn everywhere() -> Region {
    Region::All
}

impl From<Given> for Remodelling {
    fn from(Given { time, threshold, region }: Given) -> Self {
        Self { flow: FlowRule { time, threshold }, region }
    }
}

impl From<Remodelling> for Given {
    fn from(it: Remodelling) -> Self {
        let FlowRule { time, threshold } = it.flow;
        Self { time, threshold, region: it.region }
    }
}

#[typetag::serialize(name = "remodelling")]
impl EffectSpec for Remodelling {
    fn files(&self) -> Vec<(&'static str, &Path)> {
        self.flow.files(["time.file", "yield.file"])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.flow.resolve_paths_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let sheet = context.sheet;
        let flow = self.flow.on_edges(context, &Keys { time: "time", threshold: "yield" })?;
        let chosen = self.region.choose(sheet, "remodelling")?;
        let inside = match self.region {
            Region::All => None,
            _ => {
                let both = |ends: [u32; 2]| ends.iter().all(|v| chosen[*v as usize]);
                Some(sheet.edges().iter().map(|edge| both(edge.vertices)).collect())
            }
        };
        Ok(Effect::internal(LengthRemodelling { flow, inside }))
    }
}

crate::register_kind!(dyn EffectSpec, "remodelling", Remodelling);

/// Factors λ on the optimal lengths of the edges.
#[derive(Debug, Clone)]
pub struct LengthRemodelling {
    flow: Flow,
    /// Which edges flow; none where all do.
    inside: Option<Vec<bool>>,
}

impl InternalVariables for LengthRemodelling {
    fn name(&self) -> &'static str {
        "length_remodelling"
    }

    fn location(&self) -> Location {
        Location::Edge
    }

    fn initial(&self, _: usize) -> f64 {
        1.0
    }

    fn typical(&self) -> f64 {
        TYPICAL_STRAIN
    }

    fn rates(&self, shape: &Shape<'_>, values: &[f64], out: &mut [f64]) {
        let (edges, length) = (shape.sheet.edges(), shape.metric.length());
        parallel::fill(out, |e| {
            if self.inside.as_ref().is_some_and(|inside| !inside[e]) {
                return 0.0;
            }
            let [a, b] = edges[e].vertices.map(|v| shape.x[v as usize]);
            let strain = (b - a).norm() / length[e] - 1.0;
            values[e] * self.flow.rate(e, strain, 1.0)
        });
    }

    /// `|∂f/∂λ| ≤ (1 + y)/τ` at given lengths.
    fn spectral_bound(&self) -> f64 {
        self.flow.fastest() * (1.0 + self.flow.highest())
    }

    fn multiplies_lengths(&self) -> bool {
        true
    }
}
