//! Growth without a law: optimal lengths that follow a formula of position and time.
//!
//! ```text
//! l̄_ij = Φ_ij l⁰_ij,     Φ_ij = ½ (g(X_i, t) + g(X_j, t))
//! ```
//!
//! with `g` the formula, a length factor: 1.1 is growth by a tenth in every direction of the sheet, and
//! `g` is 1 outside the region. Several such effects, and the length factors of laws, multiply. Like those
//! of laws it is no force: stretching and the strains that laws read see the lengths, the rest positions
//! stay. With `measure = "amount"` growth dilutes species and conserves their totals.
//!
//! Reference: multiplicative growth, e.g. Rodriguez, Hoger & McCulloch, J. Biomech. 27 (1994) 455,
//! doi:10.1016/0021-9290(94)90021-3. Not covered: growth with a direction.

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec, Region};
use crate::kinetics::formula::FieldFormula;
use crate::parallel;
use crate::sheet::Sheet;

/// Parameters of growth in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Growth {
    /// The length factor, a formula of `x`, `y`, `z` (rest position) and `t`.
    pub factor: String,
    /// Where it grows.
    #[serde(rename = "where", default = "everywhere")]
    pub region: Region,
}

fn everywhere() -> Region {
    Region::All
}

#[typetag::serialize(name = "growth")]
impl EffectSpec for Growth {
    fn name(&self) -> String {
        "growth".into()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let inside = self.region.choose(context.sheet, "growth")?;
        let refuse = |message, help| EffectError { key: "factor", message, help };
        let formula =
            FieldFormula::new(&self.factor, true).map_err(|e| refuse(e.message, e.help))?;
        let growth = LengthFactor { formula, inside };
        let at_start = growth.at(context.sheet, 0.0);
        match at_start.iter().position(|f| !(*f > 0.0 && f.is_finite())) {
            None => Ok(Effect { growth: vec![growth], ..Effect::default() }),
            Some(e) => {
                let [a, b] = context.sheet.edges()[e].vertices;
                let message = format!(
                    "the length factor is {} between vertices {a} and {b} at time 0",
                    at_start[e]
                );
                Err(refuse(message, Some("it must be a number > 0 everywhere".into())))
            }
        }
    }
}

crate::register_kind!(dyn EffectSpec, "growth", Growth);

/// A length factor of position and time.
#[derive(Debug, Clone)]
pub struct LengthFactor {
    formula: FieldFormula,
    inside: Vec<bool>,
}

impl LengthFactor {
    /// Its value at every edge.
    #[must_use]
    pub fn at(&self, sheet: &Sheet, time: f64) -> Vec<f64> {
        let mut g = self.formula.at(sheet.rest(), time);
        for (g, inside) in g.iter_mut().zip(&self.inside) {
            if !inside {
                *g = 1.0;
            }
        }
        let edges = sheet.edges();
        let mut factor = vec![1.0; edges.len()];
        parallel::fill(&mut factor, |e| {
            let [a, b] = edges[e].vertices.map(|v| g[v as usize]);
            0.5 * (a + b)
        });
        factor
    }
}
