//! Rest angles that flow towards the actual ones, so that bending moments relax.
//!
//! ```text
//! dβ/dt = (ψ - ψ⁰ - y u sign(ψ - ψ⁰))/τ  where |ψ - ψ⁰| > y u, 0 elsewhere,     u = (Ā₁+Ā₂)/l̄
//! ```
//!
//! with β the part of ψ⁰ that has flowed, 0 at the start, τ the relaxation time and y the yield curvature, 1/length: ψ/u is the
//! curvature across an edge, `κ_nn - κ_tt/3` on an equilateral lattice, on a mesh of any fineness. Both are fields
//! (`field.rs`). At a given shape `ψ - ψ⁰` of every edge falls as exp(-t/τ) without a yield curvature; with one
//! each edge yields by its own curvature, so that what the sheet as a whole can bear depends on the directions of its edges.
//!
//! Hinges alone have rest angles: Meyer's bending has curvatures at vertices.

use super::dihedral;
use super::rest::{RestAngles, RestShape};
use crate::effects::bending::rest::REMODELLING_NAME;
use crate::effects::flow_rule::{Flow, FlowRule, Keys};
use crate::effects::{EffectContext, EffectError, InternalVariables};
use crate::geometry::Shape;
use crate::kinetics::Location;
use crate::parallel;

/// A change of an angle that matters, radians: absolute tolerances are in units of it.
const TYPICAL_ANGLE_CHANGE: f64 = 1e-2;

/// Flow of the rest angles of all hinges; one number per edge, 0 at the boundary.
#[derive(Debug)]
pub(super) struct AngleRemodelling {
    flow: Flow,
    /// Numbers of the interior edges.
    edge: Vec<u32>,
    corners: Vec<[u32; 4]>,
    rest: RestAngles,
}

impl AngleRemodelling {
    /// Of the hinges of a sheet with the rest shape `rest`.
    pub(super) fn new(
        spec: &FlowRule,
        context: &EffectContext<'_>,
        rest: &RestShape,
    ) -> Result<Self, EffectError> {
        let keys = Keys { time: "remodelling.time", threshold: "remodelling.yield" };
        let flow = spec.on_edges(context, &keys)?;
        let (edge, corners): (Vec<u32>, Vec<[u32; 4]>) = dihedral::hinges(context.sheet).unzip();
        let rest = rest.at_hinges(&corners);
        Ok(Self { flow, edge, corners, rest })
    }
}

impl InternalVariables for AngleRemodelling {
    fn name(&self) -> &'static str {
        REMODELLING_NAME
    }

    fn location(&self) -> Location {
        Location::Edge
    }

    fn initial(&self, _: usize) -> f64 {
        0.0
    }

    fn typical(&self) -> f64 {
        TYPICAL_ANGLE_CHANGE
    }

    fn rates(&self, shape: &Shape<'_>, values: &[f64], out: &mut [f64]) {
        let (length, area) = (shape.metric.length(), shape.metric.weight_area());
        let mut rate = vec![0.0; self.edge.len()];
        parallel::fill(&mut rate, |h| {
            let e = self.edge[h] as usize;
            let [first, second] = shape.sheet.edges()[e].triangles.map(|t| area[t as usize]);
            let areas = first + second;
            let rest = self.rest.angle(h, (length[e], areas), values[e]);
            let psi = dihedral::psi(&self.corners[h].map(|v| shape.x[v as usize]));
            self.flow.rate(e, psi - rest, areas / length[e])
        });
        out.fill(0.0);
        self.edge.iter().zip(rate).for_each(|(e, rate)| out[*e as usize] = rate);
    }

    fn spectral_bound(&self) -> f64 {
        self.flow.fastest()
    }
}
