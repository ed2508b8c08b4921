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

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec, Region};
use crate::Vec3;
use crate::kinetics::breakpoints::sampled;
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
    fn breakpoints(&self, sheet: &Sheet, until: f64) -> Vec<f64> {
        let read = FieldFormula::new(&self.factor, true);
        read.map_or_else(|_| Vec::new(), |formula| breakpoints(&formula, sheet, until))
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let inside = self.region.choose(context.sheet, "growth")?;
        let refuse = |message, help| EffectError { key: "factor", message, help };
        let formula =
            FieldFormula::new(&self.factor, true).map_err(|e| refuse(e.message, e.help))?;
        let growth = LengthFactor::new(formula, inside, context.sheet);
        let at_start = growth.at(context.sheet, 0.0);
        let wrong =
            at_start.iter().copied().enumerate().find(|(_, f)| !(*f > 0.0 && f.is_finite()));
        match wrong {
            None => Ok(Effect { growth: vec![growth], ..Effect::default() }),
            Some((e, value)) => {
                let [a, b] = context.sheet.edges()[e].vertices;
                let message =
                    format!("the length factor is {value} between vertices {a} and {b} at time 0");
                Err(refuse(message, Some("it must be a number > 0 everywhere".into())))
            }
        }
    }
}

crate::register_kind!(dyn EffectSpec, "growth", Growth);

/// A length factor of position and time.
#[derive(Debug, Clone)]
pub struct LengthFactor(Kind);

#[derive(Debug, Clone)]
enum Kind {
    /// At every edge, once and for all: the formula does not mention the time.
    Constant(Vec<f64>),
    Varying {
        formula: FieldFormula,
        inside: Vec<bool>,
    },
}

impl LengthFactor {
    /// Of a formula, 1 at vertices that are not `inside`.
    fn new(formula: FieldFormula, inside: Vec<bool>, sheet: &Sheet) -> Self {
        Self(if formula.depends_on_time() {
            Kind::Varying { formula, inside }
        } else {
            Kind::Constant(at_edges(&formula, &inside, sheet, 0.0))
        })
    }

    /// Its value at every edge.
    #[must_use]
    pub fn at(&self, sheet: &Sheet, time: f64) -> Cow<'_, [f64]> {
        match &self.0 {
            Kind::Constant(factor) => factor.into(),
            Kind::Varying { formula, inside } => at_edges(formula, inside, sheet, time).into(),
        }
    }
}

fn at_edges(formula: &FieldFormula, inside: &[bool], sheet: &Sheet, time: f64) -> Vec<f64> {
    let mut g = formula.at(sheet.rest(), time);
    for (g, inside) in g.iter_mut().zip(inside) {
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

/// Vertices at which a factor of position and time is sampled.
const SAMPLED: usize = 16;

fn breakpoints(formula: &FieldFormula, sheet: &Sheet, until: f64) -> Vec<f64> {
    let mut times = Vec::new();
    if !formula.depends_on_time() {
        return times;
    }
    let vertices = if formula.depends_on_position() { sheet.rest() } else { &sheet.rest()[..1] };
    formula.breakpoints(vertices, until, &mut times);
    let some: Vec<Vec3> =
        vertices.iter().step_by(vertices.len().div_ceil(SAMPLED)).copied().collect();
    let values = |times: &[f64]| {
        let mut columns = vec![Vec::with_capacity(times.len()); some.len()];
        for time in times {
            let values = formula.at(&some, *time);
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
        columns.iter().flatten().all(|value| value.is_finite()).then_some(columns)
    };
    times.extend(sampled(until, values).unwrap_or_default());
    times
}
