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
//! which are the lengths of the metric `g_∥² a⊗a + g_⊥² b⊗b`, b across: a turned by 90 degrees counter-clockwise, seen from where the
//! normals point to. `shear` adds `s (a⊗b + b⊗a)`, which makes it general: three numbers, `FᵀF` of any deformation F,
//!
//! ```text
//! Φ_ij² = g_∥² cos² θ + g_⊥² sin² θ + 2 s sin θ cos θ,     |s| < g_∥ g_⊥
//! ```
//!
//! A metric that is the same everywhere is that of every triangle exactly; one that differs from place to place is taken at the middles of the
//! edges. Bonds have the lengths as exactly as triangles, so that both are without stress where the metric is that of a shape;
//! where it is not, the modulus of bonds is isotropic for equilateral optimal triangles only. Several such effects, and the length factors of laws, multiply. Like those
//! of laws it exerts no force: stretching and the strains that laws read see the lengths, the rest positions
//! stay. With `measure = "amount"` growth dilutes species and conserves their totals.
//!
//! Reference: multiplicative growth, e.g. Rodriguez, Hoger & McCulloch, J. Biomech. 27 (1994) 455,
//! doi:10.1016/0021-9290(94)90021-3.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::timed_field::{self, TimedField};
use super::{Effect, EffectContext, EffectError, EffectSpec, Fibre, Field, LengthFactor, Region};
use crate::kinetics::Location;
use crate::kinetics::breakpoints::TimeDependence;
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
    /// The component s of the metric between the fibre and the direction across; 0 without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear: Option<Field>,
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
            shear: None,
            fibre: None,
            region,
        }
    }

    /// Whether it has the keys of one way to grow.
    fn check(&self) -> Result<(), EffectError> {
        let directed = [&self.along, &self.across, &self.shear];
        let keys = directed.into_iter().zip(["along", "across", "shear"]);
        let key = keys.into_iter().find_map(|(field, key)| field.as_ref().map(|_| key));
        let directed = key.is_some();
        let wrong = |key, message: &str, help: &str| {
            Err(EffectError { key, message: message.into(), help: Some(help.into()) })
        };
        match (&self.factor, directed, &self.fibre) {
            (Some(_), true, _) | (Some(_), _, Some(_)) => wrong(
                "factor",
                "growth has a factor in every direction, or one along and one across a fibre",
                "either factor, or fibre with along, across and shear",
            ),
            (None, false, None) => {
                wrong("factor", "growth needs a length factor", "as in factor = \"1 + 0.1*t\"")
            }
            (None, true, None) => wrong(
                key.unwrap_or("fibre"),
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
    fn time_dependence(&self, sheet: &Sheet, until: f64) -> TimeDependence {
        let fields = [&self.factor, &self.along, &self.across, &self.shear].into_iter().flatten();
        timed_field::time_dependence(fields, sheet, until)
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        let [factor, along, across, shear] = [&self.factor, &self.along, &self.across, &self.shear]
            .map(|field| field.as_ref().and_then(Field::file));
        named([
            ("factor.file", factor),
            ("along.file", along),
            ("across.file", across),
            ("shear.file", shear),
            ("fibre.file", self.fibre.as_ref().and_then(Fibre::file)),
        ])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        let fields = [&mut self.factor, &mut self.along, &mut self.across, &mut self.shear];
        for field in fields.into_iter().flatten() {
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
            field.as_ref().map(|field| read_factor(key, field, context, &inside)).transpose()
        };
        let factors = match &self.fibre {
            None => read("factor", &self.factor)?.map(Factors::Isotropic),
            Some(fibre) => {
                let (along, across) = (read("along", &self.along)?, read("across", &self.across)?);
                let of = |field| read_field("shear", field, context);
                let shear = self.shear.as_ref().map(of).transpose()?;
                let angles = fibre.cos_sin_of_edges(context)?;
                let anisotropic = Anisotropic { along, across, shear, angles };
                anisotropic.check(sheet, &inside)?;
                Some(Factors::Anisotropic(Box::new(anisotropic)))
            }
        };
        let growth = factors.map(|factors| match factors.depends_on_time() {
            true => LengthFactor::function(move |sheet, t| factors.factors_at(sheet, &inside, t)),
            false => LengthFactor::constant(factors.factors_at(sheet, &inside, 0.0)),
        });
        Ok(Effect { growth: growth.into_iter().collect(), ..Effect::default() })
    }
}

/// A field, of whose formula only the values inside count.
fn read_field(
    key: &'static str,
    field: &Field,
    context: &EffectContext<'_>,
) -> Result<TimedField, EffectError> {
    match field {
        Field::Formula(text) => TimedField::formula(context.sheet, text, Location::Vertex, key),
        _ => context.timed_field(field, Location::Vertex, key),
    }
}

/// A length factor, which has to be positive at the beginning.
fn read_factor(
    key: &'static str,
    field: &Field,
    context: &EffectContext<'_>,
    inside: &[bool],
) -> Result<TimedField, EffectError> {
    let sheet = context.sheet;
    let given = read_field(key, field, context)?;
    let factor = at_edges(&given, (inside, 1.0), sheet, 0.0);
    let Some(e) = factor.iter().position(|f| !(*f > 0.0 && f.is_finite())) else {
        return Ok(given);
    };
    let ([a, b], value) = (sheet.edges()[e].vertices, factor[e]);
    let message = format!("the length factor is {value} between vertices {a} and {b} at time 0");
    Err(EffectError { key, message, help: Some("it must be a number > 0 everywhere".into()) })
}

crate::register_kind!(dyn EffectSpec, "growth", Growth);

/// Means of the ends of every edge, `outside` at vertices that are not `inside`.
fn at_edges(
    field: &TimedField,
    (inside, outside): (&[bool], f64),
    sheet: &Sheet,
    time: f64,
) -> Vec<f64> {
    let values = field.evaluate(sheet, time);
    let at = |v: u32| if inside[v as usize] { values.at(v as usize) } else { outside };
    let edges = sheet.edges();
    let mut factor = vec![1.0; edges.len()];
    parallel::fill(&mut factor, |e| {
        let [a, b] = edges[e].vertices.map(at);
        0.5 * (a + b)
    });
    factor
}

/// The length factors of growth.
#[derive(Debug, Clone)]
enum Factors {
    Isotropic(TimedField),
    Anisotropic(Box<Anisotropic>),
}

#[derive(Debug, Clone)]
struct Anisotropic {
    along: Option<TimedField>,
    across: Option<TimedField>,
    shear: Option<TimedField>,
    /// cos² θ and sin θ cos θ of every edge.
    angles: Vec<[f64; 2]>,
}

impl Anisotropic {
    /// g_∥, g_⊥ and s of every edge.
    fn edge_factors(
        &self,
        sheet: &Sheet,
        inside: &[bool],
        time: f64,
    ) -> impl Fn(usize) -> [f64; 3] + Sync {
        let of = |field: Option<&TimedField>, outside| {
            field.map(|field| at_edges(field, (inside, outside), sheet, time))
        };
        let (along, across) = (of(self.along.as_ref(), 1.0), of(self.across.as_ref(), 1.0));
        let shear = of(self.shear.as_ref(), 0.0);
        move |e| {
            let [g, h] = [&along, &across].map(|g| g.as_ref().map_or(1.0, |g| g[e]));
            [g, h, shear.as_ref().map_or(0.0, |s| s[e])]
        }
    }

    /// Refuses a metric that has not only positive lengths at time 0.
    fn check(&self, sheet: &Sheet, inside: &[bool]) -> Result<(), EffectError> {
        let at = self.edge_factors(sheet, inside, 0.0);
        let wrong = |e: &usize| {
            let [g, h, s] = at(*e);
            !(s.abs() < g * h)
        };
        let Some(e) = (0..self.angles.len()).find(wrong) else { return Ok(()) };
        let ([a, b], [g, h, s]) = (sheet.edges()[e].vertices, at(e));
        let message = format!(
            "the shear is {s} between vertices {a} and {b} at time 0, where the length factors are {g} along and {h} across"
        );
        let help =
            "its size must be below the product of the two, or some lengths are not positive";
        Err(EffectError { key: "shear", message, help: Some(help.into()) })
    }
}

/// The least length factor of a metric in any direction, if it is not positive; none of a metric that has only lengths.
fn nonpositive_length_factor([g, h, s]: [f64; 3]) -> Option<f64> {
    let least = g.min(h);
    if !(least > 0.0) {
        return Some(least);
    }
    let half = 0.5 * (g * g - h * h);
    let eigenvalue = 0.5 * (g * g + h * h) - half.hypot(s);
    (!(s.abs() < g * h)).then(|| -eigenvalue.abs().sqrt())
}

impl Factors {
    fn depends_on_time(&self) -> bool {
        match self {
            Self::Isotropic(factor) => factor.depends_on_time(),
            Self::Anisotropic(of) => [&of.along, &of.across, &of.shear]
                .into_iter()
                .flatten()
                .any(TimedField::depends_on_time),
        }
    }

    fn factors_at(&self, sheet: &Sheet, inside: &[bool], time: f64) -> Vec<f64> {
        match self {
            Self::Isotropic(factor) => at_edges(factor, (inside, 1.0), sheet, time),
            Self::Anisotropic(of) => {
                let (at, angles) = (of.edge_factors(sheet, inside, time), &of.angles);
                let mut factor = vec![1.0; angles.len()];
                parallel::fill(&mut factor, |e| {
                    let ([g, h, s], [square, product]) = (at(e), angles[e]);
                    let along = g * g * square + h * h * (1.0 - square) + 2.0 * s * product;
                    nonpositive_length_factor([g, h, s]).unwrap_or_else(|| along.sqrt())
                });
                factor
            }
        }
    }
}
