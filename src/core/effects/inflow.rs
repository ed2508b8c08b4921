//! Inflow of a species through a part of the sheet or of its boundary, at a rate that is linear in its density.
//!
//! ```text
//! d(A_p ρ_p)/dt = … + m_p (q_p - k_p ρ_p)        q and k may depend on time
//! ```
//!
//! ρ_p the density (amount per current area), A_p the area of the point, m_p its share of the chosen triangles (a third of
//! each at a vertex) or boundary edges (half of each) of the current shape: linear elements with lumped integrals, of
//! second order. Of amounts per rest area the value is `C = ρ A/A⁰`.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::timed_field::TimedField;
use super::{EffectContext, EffectError, Measure, Region, Transport, WrongCoefficient};
use crate::Vec3;
use crate::kinetics::Location;
use crate::parallel;
use crate::sheet::Sheet;

/// What a flux is counted per.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FluxPer {
    /// Area of the triangles whose corners all lie in the region.
    Area,
    /// Length of the boundary edges whose ends both lie in the region.
    Length,
}

/// A triangle or an edge through which it flows.
#[derive(Debug, Clone, Copy)]
enum Facet {
    Triangle([usize; 3]),
    Edge([usize; 2]),
}

impl Facet {
    fn vertices(&self) -> &[usize] {
        match self {
            Self::Triangle(v) => v,
            Self::Edge(v) => v,
        }
    }

    /// Area or length.
    fn size(&self, x: &[Vec3]) -> f64 {
        match *self {
            Self::Triangle([a, b, c]) => 0.5 * (x[b] - x[a]).cross(&(x[c] - x[a])).norm(),
            Self::Edge([a, b]) => (x[b] - x[a]).norm(),
        }
    }

    /// Its derivatives by the vertices.
    fn size_derivatives(&self, x: &[Vec3], emit: &mut dyn FnMut(usize, Vec3)) {
        match *self {
            Self::Triangle(v) => {
                let [a, b, c] = v.map(|v| x[v]);
                let normal = (b - a).cross(&(c - a)).normalize();
                for (v, opposite) in v.into_iter().zip([c - b, a - c, b - a]) {
                    emit(v, 0.5 * normal.cross(&opposite));
                }
            }
            Self::Edge([a, b]) => {
                let along = (x[b] - x[a]).normalize();
                emit(a, -along);
                emit(b, along);
            }
        }
    }
}

/// A point that the species flows into.
#[derive(Debug)]
struct Inlet {
    point: usize,
    /// The facets, and the shares of them that are this point's.
    facets: Vec<(Facet, f64)>,
    /// The triangles that its area is of, with the share.
    area: (Vec<Facet>, f64),
    /// Its area at rest; for amounts.
    rest_area: f64,
}

impl Inlet {
    /// `m` and `A` on the shape `x`.
    fn m_and_area(&self, x: &[Vec3]) -> [f64; 2] {
        let size = self.facets.iter().map(|(facet, share)| share * facet.size(x)).sum();
        let (around, share) = &self.area;
        [size, around.iter().map(|facet| share * facet.size(x)).sum()]
    }
}

/// Inflow of one species.
#[derive(Debug)]
pub struct Inflow {
    name: &'static str,
    key: &'static str,
    species: usize,
    location: Location,
    measure: Measure,
    inlets: Vec<Inlet>,
    density: InflowDensity,
    /// q and k at the inlets, where they are the same at all times.
    constant: Option<Vec<[f64; 2]>>,
}

/// What flows in, by values at the vertices.
#[derive(Debug)]
pub(super) enum InflowDensity {
    /// A flux: q, and k = 0.
    Flux(TimedField),
    /// An exchange: k and c_ref, and q = k c_ref.
    Exchange(TimedField, TimedField),
}

impl InflowDensity {
    fn depends_on_time(&self) -> bool {
        match self {
            Self::Flux(flux) => flux.depends_on_time(),
            Self::Exchange(rate, reference) => {
                rate.depends_on_time() || reference.depends_on_time()
            }
        }
    }

    /// q and k at every vertex.
    fn evaluate(&self, sheet: &Sheet, time: f64) -> Vec<[f64; 2]> {
        let each = 0..sheet.vertex_count();
        match self {
            Self::Flux(flux) => {
                let flux = flux.evaluate(sheet, time);
                each.map(|v| [flux.at(v), 0.0]).collect()
            }
            Self::Exchange(rate, reference) => {
                let (rate, reference) =
                    (rate.evaluate(sheet, time), reference.evaluate(sheet, time));
                each.map(|v| [rate.at(v) * reference.at(v), rate.at(v)]).collect()
            }
        }
    }
}

/// What the species flows through.
pub(super) struct FluxSource<'a> {
    pub(super) region: &'a Region,
    pub(super) per: Option<FluxPer>,
    pub(super) density: InflowDensity,
}

impl Inflow {
    /// Into `species`, which lives at `location`; `name` is the kind of the effect, `key` that of its rate.
    pub(super) fn new(
        (name, key): (&'static str, &'static str),
        context: &EffectContext<'_>,
        (species, location): (usize, Location),
        through: FluxSource<'_>,
    ) -> Result<Self, EffectError> {
        let (sheet, measure) = (context.sheet, context.measure);
        let facets = facets(sheet, &through, name)?;
        let points = match location {
            Location::Vertex => sheet.vertex_count(),
            Location::Face | Location::Edge => sheet.triangle_count(),
        };
        let mut of: Vec<Vec<(Facet, f64)>> = vec![Vec::new(); points];
        for (facet, triangle) in facets {
            match location {
                Location::Vertex => {
                    let vertices = facet.vertices();
                    let share = 1.0 / crate::num::real(vertices.len());
                    vertices.iter().for_each(|v| of[*v].push((facet, share)));
                }
                Location::Face | Location::Edge => of[triangle].push((facet, 1.0)),
            }
        }
        let corners = |t: usize| Facet::Triangle(sheet.triangles()[t].map(|v| v as usize));
        let inlets = of.into_iter().enumerate().filter(|(_, facets)| !facets.is_empty());
        let inlets = inlets.map(|(point, facets)| {
            let area = match location {
                Location::Vertex => {
                    let around = sheet.vertex_triangles().entries(point).iter();
                    (around.map(|&(t, _)| corners(t as usize)).collect(), 1.0 / 3.0)
                }
                Location::Face | Location::Edge => (vec![corners(point)], 1.0),
            };
            let mut inlet = Inlet { point, facets, area, rest_area: 0.0 };
            inlet.rest_area = inlet.m_and_area(sheet.rest())[1];
            inlet
        });
        let (inlets, density) = (inlets.collect(), through.density);
        let changes = density.depends_on_time();
        let mut inflow =
            Self { name, key, species, location, measure, inlets, density, constant: None };
        inflow.constant = (!changes).then(|| inflow.densities(sheet, 0.0).into_owned());
        Ok(inflow)
    }

    /// q and k at the inlets: at a face the means over the vertices that it flows in at.
    fn densities(&self, sheet: &Sheet, time: f64) -> Cow<'_, [[f64; 2]]> {
        if let Some(constant) = &self.constant {
            return Cow::Borrowed(constant);
        }
        let values = self.density.evaluate(sheet, time);
        let mean = |inlet: &Inlet| match self.location {
            Location::Vertex => values[inlet.point],
            Location::Face | Location::Edge => {
                let all = inlet.facets.iter().flat_map(|(facet, _)| facet.vertices());
                let count = crate::num::real(all.clone().count());
                [0, 1].map(|k| all.clone().map(|v| values[*v][k]).sum::<f64>() / count)
            }
        };
        Cow::Owned(self.inlets.iter().map(mean).collect())
    }

    /// `m/a` and `ρ/value`, with `a` the area that the value is counted per.
    fn transport_factors(&self, inlet: &Inlet, [size, area]: [f64; 2]) -> [f64; 2] {
        match self.measure {
            Measure::Concentration => [size / area, 1.0],
            Measure::Amount => [size / inlet.rest_area, inlet.rest_area / area],
        }
    }
}

/// A note on an inflow through `region` that leaves `per` out, where another mesh may have another one.
pub(super) fn note_on_unit(region: &Region, per: Option<FluxPer>, sheet: &Sheet) -> Option<String> {
    if per.is_some() || region.names_vertices() {
        return None;
    }
    let chosen = region.choose(sheet, "inflow").ok()?;
    let inside = |corners: &&[u32; 3]| corners.iter().all(|v| chosen[*v as usize]);
    let at_rim = |corners: &[u32; 3]| corners.iter().any(|v| sheet.boundary()[*v as usize]);
    let (is, other, of) = match at_boundary(sheet, &chosen) {
        true => ("length", "area", "all vertices of this mesh in its region are"),
        // A strip that a coarser mesh has no triangles in.
        false if sheet.triangles().iter().filter(inside).all(at_rim) => {
            ("area", "length", "not all vertices of this mesh in its region are")
        }
        false => return None,
    };
    Some(format!(
        "it is counted per {is}, since {of} at the boundary; on another mesh it may be per {other}: `per` settles it"
    ))
}

/// Whether all chosen vertices are at the boundary.
fn at_boundary(sheet: &Sheet, chosen: &[bool]) -> bool {
    let rim = chosen.iter().zip(sheet.boundary()).all(|(chosen, rim)| *rim || !chosen);
    sheet.reduction().all(rim)
}

/// The triangles or boundary edges of the region, each with the number of its triangle.
fn facets(
    sheet: &Sheet,
    through: &FluxSource<'_>,
    effect: &str,
) -> Result<Vec<(Facet, usize)>, EffectError> {
    let chosen = through.region.choose(sheet, effect)?;
    let rim = at_boundary(sheet, &chosen);
    let per = through.per.unwrap_or(if rim { FluxPer::Length } else { FluxPer::Area });
    let inside = |v: &u32| chosen[*v as usize];
    let (facets, message, help): (Vec<_>, _, _) = match per {
        FluxPer::Area => {
            let all = sheet.triangles().iter().enumerate();
            let all = all.filter(|(_, corners)| corners.iter().all(inside));
            let facet = |v: [u32; 3]| Facet::Triangle(v.map(|v| v as usize));
            (
                all.map(|(t, corners)| (facet(*corners), t)).collect(),
                format!("no triangle has all corners in the region of this {effect}"),
                "a larger region, or per = \"length\" for the boundary",
            )
        }
        FluxPer::Length => {
            let all = sheet.edges().iter().filter(|edge| edge.is_boundary());
            let all = all.filter(|edge| edge.vertices.iter().all(inside));
            let facet = |v: [u32; 2]| Facet::Edge(v.map(|v| v as usize));
            (
                all.map(|edge| (facet(edge.vertices), edge.triangles[0] as usize)).collect(),
                format!("no boundary edge has both ends in the region of this {effect}"),
                "a region at the boundary, as where = \"rim\", or per = \"area\"",
            )
        }
    };
    if !sheet.reduction().any(!facets.is_empty()) {
        return Err(EffectError { key: "where", message, help: Some(help.into()) });
    }
    Ok(facets)
}

/// Inflow on one shape.
#[derive(Debug, Default)]
pub struct InflowOperator {
    /// [`Inflow::transport_factors`].
    factors: Vec<[f64; 2]>,
}

impl Transport for Inflow {
    type Operator = InflowOperator;

    fn name(&self) -> &'static str {
        self.name
    }

    fn species(&self) -> usize {
        self.species
    }

    fn has_sources(&self) -> bool {
        true
    }

    fn speed_key(&self) -> &'static str {
        self.key
    }

    fn inadmissible(&self, (sheet, time): (&Sheet, f64)) -> Option<WrongCoefficient> {
        if self.constant.is_some() {
            return None;
        }
        let densities = self.densities(sheet, time);
        let negative = |[_, loss]: &[f64; 2]| !(*loss >= 0.0);
        let k = densities.iter().position(negative)?;
        Some(WrongCoefficient { point: self.inlets[k].point, value: densities[k][1] })
    }

    fn flux_edges(&self) -> Vec<[usize; 2]> {
        let flows = |k: usize| self.constant.as_ref().is_none_or(|all| all[k] != [0.0; 2]);
        let all = self.inlets.iter().enumerate();
        let inlets = all.filter(|(k, _)| flows(*k)).map(|(_, inlet)| inlet);
        let edges = |inlet: &Inlet| {
            let (point, place) = (inlet.point, self.location);
            inlet
                .facets
                .iter()
                .filter_map(move |(facet, _)| match *facet {
                    Facet::Edge(ends) if place == Location::Vertex => Some(ends),
                    Facet::Edge(_) => Some([point; 2]),
                    Facet::Triangle(_) => None,
                })
                .collect::<Vec<_>>()
        };
        inlets.flat_map(edges).collect()
    }

    fn assemble(&self, _: &Sheet, x: &[Vec3], operator: &mut InflowOperator) {
        operator.factors.resize(self.inlets.len(), [0.0; 2]);
        parallel::fill(&mut operator.factors, |k| {
            self.transport_factors(&self.inlets[k], self.inlets[k].m_and_area(x))
        });
    }

    fn add_rate(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &InflowOperator,
        c: &[f64],
        out: &mut [f64],
    ) {
        let densities = self.densities(sheet, time);
        let each = self.inlets.iter().zip(&operator.factors).zip(&*densities);
        for ((inlet, [gain, density_per_value]), [supply, loss]) in each {
            out[inlet.point] += gain * (supply - loss * density_per_value * c[inlet.point]);
        }
    }

    fn spectral_bound(&self, (sheet, time): (&Sheet, f64), operator: &InflowOperator) -> f64 {
        let densities = self.densities(sheet, time);
        let each = operator.factors.iter().zip(&*densities);
        each.map(|([gain, density_per_value], [_, loss])| gain * loss.abs() * density_per_value)
            .fold(0.0, f64::max)
    }

    fn entries(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &InflowOperator,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        let densities = self.densities(sheet, time);
        let each = self.inlets.iter().zip(&operator.factors).zip(&*densities);
        for ((inlet, [gain, density_per_value]), [_, loss]) in each {
            emit(inlet.point, inlet.point, -gain * loss * density_per_value);
        }
    }

    fn shape_derivatives(
        &self,
        (sheet, time): (&Sheet, f64),
        operator: &InflowOperator,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let densities = self.densities(sheet, time);
        let each = self.inlets.iter().zip(&operator.factors).zip(&*densities);
        for ((inlet, [gain, density_per_value]), [supply, loss]) in each {
            let area = inlet.m_and_area(x)[1];
            let density = density_per_value * c[inlet.point];
            let flux = supply - loss * density;
            let (per, by_area) = match self.measure {
                Measure::Concentration => (area, -gain * flux / area),
                Measure::Amount => (inlet.rest_area, gain * loss * density / area),
            };
            for (facet, share) in &inlet.facets {
                let scale = share * flux / per;
                facet.size_derivatives(x, &mut |v, by| emit(inlet.point, v, scale * by));
            }
            let (around, share) = &inlet.area;
            for facet in around {
                let scale = share * by_area;
                facet.size_derivatives(x, &mut |v, by| emit(inlet.point, v, scale * by));
            }
        }
    }
}
