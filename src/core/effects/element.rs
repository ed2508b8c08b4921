//! Energies that are sums over small elements: triangles, hinges.
//!
//! ```text
//! U = Σ_e u_e(x_{e,0}, …, x_{e,K-1})
//! ```
//!
//! An element is pure: from the positions of its K corners it returns its energy and derivatives.
//! The loops over the elements of a sheet are here, once for all of them.

use super::{Coupling, EffectError, Energy, ForceScales, HessianPart, ParameterField, Reads};
use crate::geometry::{Conditions, Shape};
use crate::linear::{Block, BlockMatrix, LazyStencils};
use crate::num::index;
use crate::sheet::{Incidence, Sheet};
use crate::{Vec3, parallel};

/// A term of an energy that depends on K vertices.
pub trait Element<const K: usize>: Send + Sync {
    /// The energy, and its derivative by every corner.
    fn gradient(&self, x: &[Vec3; K]) -> (f64, [Vec3; K]);

    /// Second derivatives: block `[k][m]` is `∂²u/∂x_k∂x_m`; the positive part may leave out what
    /// makes them indefinite.
    fn hessian(&self, x: &[Vec3; K], part: HessianPart) -> [[Block; K]; K];
}

/// Which vertices are the corners of which element.
pub(super) struct Mesh<'a, const K: usize> {
    /// Vertices of every element.
    pub(super) corners: &'a [[u32; K]],
    /// `(element, corner)` pairs of every vertex.
    pub(super) incident: &'a Incidence,
    /// Says which elements are counted here.
    pub(super) sheet: &'a Sheet,
}

impl<'a> Mesh<'a, 3> {
    /// The triangles of `sheet`.
    pub(super) fn triangles(sheet: &'a Sheet) -> Self {
        Self { corners: sheet.triangles(), incident: sheet.vertex_triangles(), sheet }
    }
}

impl<const K: usize> Mesh<'_, K> {
    fn positions(&self, e: usize, x: &[Vec3]) -> [Vec3; K] {
        self.corners[e].map(|v| x[v as usize])
    }
}

/// The energy of all elements at `x`; with `gradient` given, its derivatives are added there.
/// `pull` is memory for the derivatives by corner.
pub(super) fn evaluate<'e, const K: usize, E: Element<K> + 'e>(
    mesh: &Mesh<'_, K>,
    element: impl Fn(usize) -> &'e E + Sync,
    x: &[Vec3],
    pull: &mut Vec<[Vec3; K]>,
    gradient: Option<&mut [Vec3]>,
) -> f64 {
    pull.resize(mesh.corners.len(), [Vec3::zeros(); K]);
    let energy = parallel::fill_and_sum(pull, |e| {
        let (energy, pull) = element(e).gradient(&mesh.positions(e, x));
        (pull, if mesh.sheet.counts(&mesh.corners[e]) { energy } else { 0.0 })
    });
    if let Some(gradient) = gradient {
        parallel::update(gradient, |i, g| {
            for &(e, k) in mesh.incident.entries(i) {
                *g += pull[e as usize][k as usize];
            }
        });
    }
    energy
}

/// Adds the second derivatives of all elements at `x`; `places` belong to the mesh.
pub(super) fn add_hessian<'e, const K: usize, E: Element<K> + 'e>(
    mesh: &Mesh<'_, K>,
    element: impl Fn(usize) -> &'e E + Sync,
    x: &[Vec3],
    part: HessianPart,
    places: &mut LazyStencils,
    into: &mut BlockMatrix,
) {
    let blocks = |e| element(e).hessian(&mesh.positions(e, x), part);
    add_blocks(mesh.corners, blocks, places, into);
}

/// Adds the symmetric `blocks` of every element between its corners; `places` belong to these.
pub(super) fn add_blocks<const K: usize>(
    corners: &[[u32; K]],
    blocks: impl Fn(usize) -> [[Block; K]; K] + Sync,
    places: &mut LazyStencils,
    into: &mut BlockMatrix,
) {
    let sorted = |corners: &[u32; K]| {
        let mut corners = *corners;
        corners.sort_unstable();
        corners
    };
    let stencils = places.for_pattern(into.pattern(), || corners.iter().map(sorted));
    stencils.assemble(into, |e, sink| {
        let corners = &corners[e];
        // Position of every corner in the ascending order of the sink.
        let rank = corners.map(|v| corners.iter().filter(|other| **other < v).count());
        for (row, &p) in blocks(e).iter().zip(&rank) {
            for (block, &q) in row.iter().zip(&rank) {
                if p <= q {
                    sink.add(p, q, block);
                }
            }
        }
    });
}

/// The energy `Σ_e u_e` of elements of one kind, ready to be an effect: the easy way to write one.
///
/// ```
/// # use rumple_core as rumple;
/// use rumple::effects::{Block, Element, Elements, HessianPart};
/// # use rumple::{Vec3, sheet::{SheetShape, generate}};
///
/// /// A spring of length 0: `u = k/2 |x_1 - x_0|²`.
/// struct Spring {
///     stiffness: f64,
/// }
///
/// impl Element<2> for Spring {
///     fn gradient(&self, [a, b]: &[Vec3; 2]) -> (f64, [Vec3; 2]) {
///         let pull = self.stiffness * (b - a);
///         (0.5 * pull.dot(&(b - a)), [-pull, pull])
///     }
///
///     fn hessian(&self, _: &[Vec3; 2], _: HessianPart) -> [[Block; 2]; 2] {
///         let k = Block::from_diagonal_element(self.stiffness);
///         [[k, -k], [-k, k]]
///     }
/// }
///
/// # let sheet = generate(&SheetShape::Disc { radius: 1.0 }, 100, 1)?;
/// let edges = sheet.edges().iter().map(|edge| edge.vertices).collect();
/// let springs = Elements::new("springs", &sheet, edges, |_, _| Spring { stiffness: 2.0 })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Elements<const K: usize, E> {
    name: String,
    corners: Vec<[u32; K]>,
    incident: Incidence,
    make: Box<Make<E>>,
    species: Vec<usize>,
    /// One for each of the species.
    slopes: Vec<Box<Slopes<K, E>>>,
    timed: bool,
    coupling: Coupling,
    forces: ForceScales,
}

/// Makes all elements under given optimal lengths and species and at a given time.
type Make<E> = dyn Fn(&Conditions<'_>, &mut Vec<E>) + Send + Sync;

/// Makes `∂u_e/∂c` of all elements by the values of a species at their corners.
type Slopes<const K: usize, E> = dyn Fn(&Conditions<'_>) -> Vec<[E; K]> + Send + Sync;

impl<const K: usize, E: Element<K>> Elements<K, E> {
    /// Elements between the vertices `corners` of `sheet`, which must be neighbours of one another or
    /// neighbours of neighbours; `make` gives the parameters of each for the optimal lengths in force.
    ///
    /// # Errors
    /// A number that no vertex has; corners that are further apart, which second derivatives and ranks do not couple, or the
    /// same twice.
    pub fn new(
        name: &str,
        sheet: &Sheet,
        corners: Vec<[u32; K]>,
        make: impl Fn(&Conditions<'_>, usize) -> E + Send + Sync + 'static,
    ) -> Result<Self, EffectError> {
        let count = corners.len();
        Self::with_shared_evaluation(name, sheet, corners, move |conditions, into| {
            into.extend((0..count).map(|e| make(conditions, e)));
        })
    }

    /// The same, where `make` adds the parameters of all elements in their order: what they have in common is evaluated once.
    ///
    /// # Errors
    /// As for [`Elements::new`].
    pub fn with_shared_evaluation(
        name: &str,
        sheet: &Sheet,
        corners: Vec<[u32; K]>,
        make: impl Fn(&Conditions<'_>, &mut Vec<E>) + Send + Sync + 'static,
    ) -> Result<Self, EffectError> {
        let coupling = coupling(name, sheet, &corners)?;
        let triples = corners.iter().enumerate().flat_map(|(e, corner)| {
            corner.iter().enumerate().map(move |(k, v)| (*v, index(e), index(k)))
        });
        let incident = Incidence::new(sheet.vertex_count(), triples);
        Ok(Self {
            name: name.to_owned(),
            corners,
            incident,
            make: Box::new(make),
            species: Vec::new(),
            slopes: Vec::new(),
            timed: false,
            coupling,
            forces: ForceScales::default(),
        })
    }

    /// The same, with parameters that depend on the values of species number `species` at the corners. `slopes` gives
    /// `∂u_e/∂c` by the value at each corner of each element, which is an element again: one whose gradient is the mixed
    /// derivative `∂²u_e/∂x∂c`.
    #[must_use]
    pub fn reading(
        mut self,
        species: usize,
        slopes: impl Fn(&Conditions<'_>) -> Vec<[E; K]> + Send + Sync + 'static,
    ) -> Self {
        self.species.push(species);
        self.slopes.push(Box::new(slopes));
        self
    }

    /// The same, with parameters that depend on time.
    #[must_use]
    pub fn depending_on_time(mut self) -> Self {
        self.timed = true;
        self
    }

    /// The same, with a size of the force on a vertex at unit strain ([`ForceScales::unit_strain`]): for
    /// elements that resist stretching, as a scene without the effect `stretching` needs one that does.
    #[must_use]
    pub fn with_force_scale(mut self, force: f64) -> Self {
        self.forces.unit_strain = force;
        self
    }

    /// The same, with the largest force that is applied to a vertex of the sheet at rest
    /// ([`ForceScales::applied`]): for loads, so that a tolerance above it is reported.
    #[must_use]
    pub fn with_applied_force(mut self, force: f64) -> Self {
        self.forces.applied = force;
        self
    }
}

/// Which vertices the elements with these corners couple.
fn coupling<const K: usize>(
    name: &str,
    sheet: &Sheet,
    corners: &[[u32; K]],
) -> Result<Coupling, EffectError> {
    let count = sheet.vertex_count();
    let neighbours = |a: u32| sheet.vertex_edges().entries(a as usize).iter().map(|&(_, j)| j);
    let near = |a: u32, b: u32| neighbours(a).any(|j| j == b);
    let mut coupling = if K < 2 { Coupling::NONE } else { Coupling::ONE_RING };
    for (e, corners) in corners.iter().enumerate() {
        let refuse = |what: String, help: &str| {
            let message = format!("element {e} of `{name}` has the corners {corners:?}: {what}");
            Err(EffectError { key: "kind", message, help: Some(help.to_owned()) })
        };
        if let Some(v) = corners.iter().find(|v| **v as usize >= count) {
            let what = format!("there is no vertex {v}, the sheet has {count}");
            return refuse(what, "vertices are counted from 0");
        }
        for (k, &a) in corners.iter().enumerate() {
            for &b in &corners[..k] {
                if a == b {
                    return refuse(format!("vertex {a} twice"), "corners are different vertices");
                }
                if near(a, b) {
                    continue;
                }
                coupling = Coupling::TWO_RINGS;
                if !neighbours(a).any(|j| near(j, b)) {
                    let what = format!("vertices {b} and {a} are more than two edges apart");
                    let help = "corners are neighbours or neighbours of neighbours; an Energy with terms of low rank, or a \
                                Contact with pairs, couples others";
                    return refuse(what, help);
                }
            }
        }
    }
    Ok(coupling)
}

/// Memory of [`Elements`].
pub struct ElementWork<const K: usize, E> {
    element: Vec<E>,
    pull: Vec<[Vec3; K]>,
    places: LazyStencils,
}

impl<const K: usize, E> Default for ElementWork<K, E> {
    fn default() -> Self {
        Self { element: Vec::new(), pull: Vec::new(), places: LazyStencils::default() }
    }
}

impl<const K: usize, E: Element<K> + 'static> Energy for Elements<K, E> {
    type Work = ElementWork<K, E>;

    fn name(&self) -> &str {
        &self.name
    }

    fn coupling(&self) -> Coupling {
        self.coupling
    }

    fn reads(&self) -> Reads<'_> {
        Reads { species: &self.species, time: self.timed, ..Reads::default() }
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Self::Work) {
        work.element.clear();
        (self.make)(conditions, &mut work.element);
    }

    fn mixed_derivatives(
        &self,
        shape: &Shape<'_>,
        conditions: &Conditions<'_>,
        _: &mut Self::Work,
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let of_species = self.species.iter().map(|s| ParameterField::Species(*s));
        for (_, slopes) in of_species.zip(&self.slopes).filter(|(field, _)| *field == by) {
            for (corners, by) in self.corners.iter().zip(slopes(conditions)) {
                let x = corners.map(|v| shape.x[v as usize]);
                for (v, by) in corners.iter().zip(by) {
                    let (_, pull) = by.gradient(&x);
                    for (i, pull) in corners.iter().zip(pull) {
                        emit(*i as usize, *v as usize, pull);
                    }
                }
            }
        }
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let element = &work.element;
        let mesh = Mesh { corners: &self.corners, incident: &self.incident, sheet: shape.sheet };
        evaluate(&mesh, |e| &element[e], shape.x, &mut work.pull, gradient)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let element = &work.element;
        let mesh = Mesh { corners: &self.corners, incident: &self.incident, sheet: shape.sheet };
        add_hessian(&mesh, |e| &element[e], shape.x, part, &mut work.places, into);
    }

    fn force_scales(&self, _: f64) -> ForceScales {
        self.forces
    }
}
