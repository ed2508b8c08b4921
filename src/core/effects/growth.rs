//! Growth without a law: optimal lengths that follow a field (`field.rs`), whose formula may read the time.
//!
//! ```text
//! l̄_ij = Φ_ij l⁰_ij,     Φ_ij = ½ (g(X_i, t) + g(X_j, t))
//! ```
//!
//! with `g` the field, a length factor: 1.1 is growth by a tenth in every direction of the sheet, and
//! `g` is 1 outside the region. With a direction, `along` a fibre a and `across` it,
//!
//! ```text
//! Φ_ij² = g_∥² cos² θ + g_⊥² sin² θ,     θ the angle between the edge and a at rest
//! ```
//!
//! which are the lengths of the metric `g_∥² a⊗a + g_⊥² (1 - a⊗a)`: triangles read it exactly, bonds as far as
//! their lengths tell. Several such effects, and the length factors of laws, multiply. Like those
//! of laws it exerts no force: stretching and the strains that laws read see the lengths, the rest positions
//! stay. With `measure = "amount"` growth dilutes species and conserves their totals.
//!
//! Reference: multiplicative growth, e.g. Rodriguez, Hoger & McCulloch, J. Biomech. 27 (1994) 455,
//! doi:10.1016/0021-9290(94)90021-3. Not covered: growth with shear.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{Effect, EffectContext, EffectError, EffectSpec, Fibre, Field, Region, Values};
use crate::Vec3;
use crate::kinetics::Location;
use crate::kinetics::breakpoints::sampled;
use crate::kinetics::formula::FieldFormula;
use crate::parallel;
use crate::sheet::Sheet;

/// Parameters of growth in a scene: `factor`, or `fibre` with `along` and `across`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Growth {
    /// The length factor in every direction; formulas may read the time `t`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<Field>,
    /// The length factor along the fibre; 1 without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Field>,
    /// The length factor across the fibre; 1 without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Field>,
    /// The direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fibre: Option<Fibre>,
    /// Where it grows.
    #[serde(rename = "where", default = "everywhere")]
    pub region: Region,
}

impl Growth {
    /// By a formula in every direction.
    #[must_use]
    pub fn isotropic(factor: impl Into<String>, region: Region) -> Self {
        Self {
            factor: Some(Field::Formula(factor.into())),
            along: None,
            across: None,
            fibre: None,
            region,
        }
    }

    /// Whether it has the keys of one way to grow.
    fn check(&self) -> Result<(), EffectError> {
        let directed = self.along.is_some() || self.across.is_some();
        let wrong = |key, message: &str, help: &str| {
            Err(EffectError { key, message: message.into(), help: Some(help.into()) })
        };
        match (&self.factor, directed, &self.fibre) {
            (Some(_), true, _) | (Some(_), _, Some(_)) => wrong(
                "factor",
                "growth has a factor in every direction, or one along and one across a fibre",
                "either factor, or fibre with along and across",
            ),
            (None, false, None) => {
                wrong("factor", "growth needs a length factor", "as in factor = \"1 + 0.1*t\"")
            }
            (None, true, None) => wrong(
                if self.along.is_some() { "along" } else { "across" },
                "growth with a direction needs the fibre that it refers to",
                "as in fibre = [1, 0, 0]",
            ),
            (None, false, Some(_)) => wrong(
                "fibre",
                "growth with a fibre needs a length factor along or across it",
                "as in along = \"1 + 0.1*t\"",
            ),
            _ => Ok(()),
        }
    }
}

fn everywhere() -> Region {
    Region::All
}

#[typetag::serialize(name = "growth")]
impl EffectSpec for Growth {
    fn breakpoints(&self, sheet: &Sheet, until: f64) -> Vec<f64> {
        let fields = [&self.factor, &self.along, &self.across].into_iter().flatten();
        let read = fields.filter_map(|field| match field {
            Field::Formula(text) => FieldFormula::new(text, true).ok(),
            _ => None,
        });
        read.flat_map(|formula| breakpoints(&formula, sheet, until)).collect()
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let [factor, along, across] = [&self.factor, &self.along, &self.across]
            .map(|field| field.as_ref().and_then(Field::file));
        named([
            ("factor.file", factor),
            ("along.file", along),
            ("across.file", across),
            ("fibre.file", self.fibre.as_ref().and_then(Fibre::file)),
        ])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        for field in [&mut self.factor, &mut self.along, &mut self.across].into_iter().flatten() {
            field.resolve_path_against(folder);
        }
        if let Some(fibre) = &mut self.fibre {
            fibre.resolve_path_against(folder);
        }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        self.check()?;
        let sheet = context.sheet;
        let inside = self.region.choose(sheet, "growth")?;
        let read = |key: &'static str, field: &Option<Field>| {
            field.as_ref().map(|field| factor(key, field, context, &inside)).transpose()
        };
        let factors = match &self.fibre {
            None => read("factor", &self.factor)?.map(Factors::Isotropic),
            Some(fibre) => {
                let (along, across) = (read("along", &self.along)?, read("across", &self.across)?);
                let square = fibre.along_edges(context)?;
                Some(Factors::Directed(Box::new(Directed { along, across, square })))
            }
        };
        let growth = factors.map(|factors| LengthFactor::new(factors, inside, sheet));
        Ok(Effect { growth: growth.into_iter().collect(), ..Effect::default() })
    }
}

/// A length factor, which has to be positive at the beginning.
fn factor(
    key: &'static str,
    field: &Field,
    context: &EffectContext<'_>,
    inside: &[bool],
) -> Result<Given, EffectError> {
    let sheet = context.sheet;
    let given = match field {
        Field::Formula(text) => {
            let formula = FieldFormula::new(text, true);
            Given::Formula(formula.map_err(|e| EffectError {
                key,
                message: e.message,
                help: e.help,
            })?)
        }
        _ => Given::Values(context.values(field, Location::Vertex, key)?),
    };
    let factor = given.at_edges(inside, sheet, 0.0);
    let Some(e) = factor.iter().position(|f| !(*f > 0.0 && f.is_finite())) else {
        return Ok(given);
    };
    let ([a, b], value) = (sheet.edges()[e].vertices, factor[e]);
    let message = format!("the length factor is {value} between vertices {a} and {b} at time 0");
    Err(EffectError { key, message, help: Some("it must be a number > 0 everywhere".into()) })
}

crate::register_kind!(dyn EffectSpec, "growth", Growth);

/// A length factor of position and time, one per edge.
#[derive(Debug, Clone)]
pub struct LengthFactor(Kind);

#[derive(Debug, Clone)]
enum Kind {
    /// Once and for all.
    Constant(Vec<f64>),
    Varying(Box<Varying>),
    Own(Function),
}

/// Formulas, 1 at vertices that are not `inside`.
#[derive(Debug, Clone)]
struct Varying {
    factors: Factors,
    inside: Vec<bool>,
}

/// The factor of every edge at a time.
type OfTime = dyn Fn(&Sheet, f64) -> Vec<f64> + Send + Sync;

#[derive(Clone)]
struct Function(Arc<OfTime>);

impl std::fmt::Debug for Function {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Function")
    }
}

/// A length factor at the vertices.
#[derive(Debug, Clone)]
enum Given {
    /// Of position and time.
    Formula(FieldFormula),
    /// At all times.
    Values(Values),
}

impl Given {
    fn depends_on_time(&self) -> bool {
        matches!(self, Self::Formula(formula) if formula.depends_on_time())
    }

    /// Means of the ends of every edge, 1 at vertices that are not `inside`.
    fn at_edges(&self, inside: &[bool], sheet: &Sheet, time: f64) -> Vec<f64> {
        let mut g = match self {
            Self::Formula(formula) => formula.at(sheet.rest(), time),
            Self::Values(Values::Same(value)) => vec![*value; sheet.vertex_count()],
            Self::Values(Values::Each(all)) => all.clone(),
        };
        for (g, _) in g.iter_mut().zip(inside).filter(|(_, inside)| !**inside) {
            *g = 1.0;
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

/// The length factors of growth.
#[derive(Debug, Clone)]
enum Factors {
    Isotropic(Given),
    Directed(Box<Directed>),
}

#[derive(Debug, Clone)]
struct Directed {
    along: Option<Given>,
    across: Option<Given>,
    /// cos² θ of every edge.
    square: Vec<f64>,
}

impl Factors {
    fn depends_on_time(&self) -> bool {
        match self {
            Self::Isotropic(factor) => factor.depends_on_time(),
            Self::Directed(of) => {
                [&of.along, &of.across].into_iter().flatten().any(Given::depends_on_time)
            }
        }
    }

    fn at(&self, sheet: &Sheet, inside: &[bool], time: f64) -> Vec<f64> {
        let of = |factor: &Given| factor.at_edges(inside, sheet, time);
        match self {
            Self::Isotropic(factor) => of(factor),
            Self::Directed(directed) => {
                let Directed { along, across, square } = &**directed;
                let [along, across] = [along, across].map(|factor| factor.as_ref().map(of));
                let mut factor = vec![1.0; square.len()];
                parallel::fill(&mut factor, |e| {
                    let [g, h] = [&along, &across].map(|g| g.as_ref().map_or(1.0, |g| g[e]));
                    (g * g * square[e] + h * h * (1.0 - square[e])).sqrt()
                });
                factor
            }
        }
    }
}

impl LengthFactor {
    /// Of formulas, 1 at vertices that are not `inside`.
    fn new(factors: Factors, inside: Vec<bool>, sheet: &Sheet) -> Self {
        Self(if factors.depends_on_time() {
            Kind::Varying(Box::new(Varying { factors, inside }))
        } else {
            Kind::Constant(factors.at(sheet, &inside, 0.0))
        })
    }

    /// The same at all times: `factor`, a positive number per edge.
    #[must_use]
    pub fn constant(factor: Vec<f64>) -> Self {
        Self(Kind::Constant(factor))
    }

    /// `of(sheet, t)`, a positive number per edge.
    #[must_use]
    pub fn function(of: impl Fn(&Sheet, f64) -> Vec<f64> + Send + Sync + 'static) -> Self {
        Self(Kind::Own(Function(Arc::new(of))))
    }

    /// Its value at every edge.
    #[must_use]
    pub fn at(&self, sheet: &Sheet, time: f64) -> Cow<'_, [f64]> {
        match &self.0 {
            Kind::Constant(factor) if factor.len() == sheet.edges().len() => factor.into(),
            Kind::Constant(factor) => fitted(factor.clone(), sheet).into(),
            Kind::Varying(of) => of.factors.at(sheet, &of.inside, time).into(),
            Kind::Own(Function(of)) => fitted(of(sheet, time), sheet).into(),
        }
    }
}

/// As many as there are edges: those that are missing are no number, which the model refuses.
fn fitted(mut factor: Vec<f64>, sheet: &Sheet) -> Vec<f64> {
    factor.resize(sheet.edges().len(), f64::NAN);
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
