//! Length factors of growth: given at every edge, or that of a law with a direction.

use std::borrow::Cow;
use std::sync::Arc;

use crate::sheet::Sheet;

/// A length factor of position and time, one per edge.
#[derive(Clone)]
pub struct LengthFactor(Kind);

#[derive(Clone)]
enum Kind {
    /// Once and for all.
    Constant(Vec<f64>),
    Function(Arc<OfTime>),
}

/// The factor of every edge at a time.
type OfTime = dyn Fn(&Sheet, f64) -> Vec<f64> + Send + Sync;

impl std::fmt::Debug for LengthFactor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("LengthFactor")
    }
}

impl LengthFactor {
    /// The same at all times: `factor`, a positive number per edge.
    #[must_use]
    pub fn constant(factor: Vec<f64>) -> Self {
        Self(Kind::Constant(factor))
    }

    /// `of(sheet, t)`, a positive number per edge.
    #[must_use]
    pub fn function(of: impl Fn(&Sheet, f64) -> Vec<f64> + Send + Sync + 'static) -> Self {
        Self(Kind::Function(Arc::new(of)))
    }

    /// Its value at every edge; where there are too few, no number, which the model refuses.
    #[must_use]
    pub fn at_edges(&self, sheet: &Sheet, time: f64) -> Cow<'_, [f64]> {
        let count = sheet.edges().len();
        let mut factor = match &self.0 {
            Kind::Constant(factor) if factor.len() == count => return factor.into(),
            Kind::Constant(factor) => factor.clone(),
            Kind::Function(of) => of(sheet, time),
        };
        factor.resize(count, f64::NAN);
        factor.into()
    }
}

/// How the length factor of a law acts at every edge.
#[derive(Debug, Clone)]
pub struct DirectedLengthFactor {
    /// cos² θ.
    pub(super) cos_squared: Vec<f64>,
    /// p.
    pub(super) across: f64,
}

impl DirectedLengthFactor {
    /// Φ_ij of an edge with these factors along the fibre and across it, and its derivatives by both.
    #[must_use]
    #[inline]
    pub fn edge_factor(&self, edge: usize, along: f64, across: f64) -> (f64, [f64; 2]) {
        let cos_squared = self.cos_squared[edge];
        let all = (along * along * cos_squared + across * across * (1.0 - cos_squared)).sqrt();
        (all, [along * cos_squared / all, across * (1.0 - cos_squared) / all])
    }

    /// `Φ_⊥ = Φ^p` of a law with one length factor, and its derivative by that.
    #[must_use]
    #[inline]
    pub fn factor_across(&self, factor: f64) -> (f64, f64) {
        let across = factor.powf(self.across);
        (across, self.across * across / factor)
    }
}
