//! Problems of plate, membrane and shell theory and of transport whose answers are known, solved with the library.
//!
//! Every problem is a function of the mesh and the models that returns a [`Sample`]; the example
//! `03_known_answers` prints tables of them and the tests hold them to their tolerances.

pub mod active;
pub mod annulus;
pub mod bilayer;
pub mod branches;
pub mod caps;
pub mod chemistry;
pub mod contact;
pub mod growth;
pub mod loads;
pub mod membranes;
pub mod meshes;
pub mod plates;
pub mod remodelling;
pub mod ribbons;
pub mod shells;
pub mod squeezed;
pub mod steady;
pub mod strips;
pub mod sze;

use std::error::Error;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    EffectContext, EnergyTerm, HessianPart, Material, MaterialField, Measure, Pins,
};
use rumple::model::{Mechanics, Potential};
use rumple::scene::Scene;
use rumple::sheet::Sheet;
use rumple::solve::equilibrium::{Equilibrium, Goal, Lbfgs, LbfgsSpec, Relaxation};
use rumple_numerics::linear::{BlockMatrix, BlockPattern, MixedPrecisionCholesky};

/// A result, or why there is none.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// The discrete models of a sheet, as a scene would list them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Models {
    /// How tables call the pair.
    pub name: &'static str,
    /// The effect `stretching`.
    pub stretching: &'static str,
    /// The effect `bending`.
    pub bending: &'static str,
}

const BOND: &str = "kind = 'stretching'\nmodel = 'bond'";
const STVK: &str = "kind = 'stretching'\nmodel = 'stvk'";
const MEYER: &str = "kind = 'bending'\nmodel = 'meyer'";
const HINGE: &str = "kind = 'bending'\nmodel = 'hinge'";

/// The models of the paper.
pub const BOND_MEYER: Models = Models { name: "bond + meyer", stretching: BOND, bending: MEYER };
/// Triangles of constant strain with the paper's bending.
pub const STVK_MEYER: Models = Models { name: "stvk + meyer", stretching: STVK, bending: MEYER };
/// The models of Seung & Nelson.
pub const BOND_HINGE: Models = Models { name: "bond + hinge", stretching: BOND, bending: HINGE };
/// Triangles of constant strain with hinges.
pub const STVK_HINGE: Models = Models { name: "stvk + hinge", stretching: STVK, bending: HINGE };

impl Models {
    /// Poisson's ratio that bending sees at free and supported boundaries: hinges have their own.
    pub fn bending_poisson(&self, material: &Material) -> f64 {
        if self.bending == HINGE { -1.0 / 3.0 } else { material.poisson }
    }
}

/// One mesh's answer beside the exact one.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Mean edge length of the mesh.
    pub edge: f64,
    /// What came out.
    pub computed: f64,
    /// What theory says.
    pub exact: f64,
}

impl Sample {
    /// Of a sheet.
    pub fn new(sheet: &Sheet, computed: f64, exact: f64) -> Self {
        Self { vertices: sheet.vertex_count(), edge: mean_edge(sheet), computed, exact }
    }

    /// Relative error, signed.
    pub fn error(&self) -> f64 {
        self.computed / self.exact - 1.0
    }

    /// Order of convergence from `coarser` to this mesh: error ∝ edgeᵒʳᵈᵉʳ.
    pub fn order(&self, coarser: &Self) -> f64 {
        (coarser.error() / self.error()).abs().ln() / (coarser.edge / self.edge).ln()
    }
}

/// Mean rest length of the edges.
pub fn mean_edge(sheet: &Sheet) -> f64 {
    let rest = sheet.rest();
    let lengths = sheet.edges().iter().map(|e| {
        let [a, b] = e.vertices.map(|v| rest[v as usize]);
        (a - b).norm()
    });
    lengths.sum::<f64>() / rumple::num::real(sheet.edges().len())
}

/// The energy of one effect, from the text of its table in a scene.
pub fn energy(
    sheet: &Sheet,
    material: impl Into<MaterialField>,
    table: &str,
) -> Outcome<EnergyTerm> {
    let elasticity = material.into();
    let material = elasticity.largest();
    let text = format!(
        "sheet = {{ shape = 'disc', radius = 1.0, vertices = 50 }}\ntime = {{ until = 1.0 }}\n\
         material = {{ young = 1.0, poisson = 0.3, thickness = 0.1 }}\n[[effect]]\n{table}\n"
    );
    let scene = Scene::parse(&text, "table", &[])?;
    let spec = scene.effects.into_iter().next().ok_or("no effect")?;
    let (kinetics, measure) = (None, Measure::Concentration);
    let context = EffectContext {
        sheet,
        material: Some(&material),
        varying: Some(&elasticity).filter(|material| !material.is_uniform()),
        kinetics,
        measure,
        read: None,
    };
    let term = spec.build(&context)?.energies.into_iter().next();
    term.ok_or_else(|| format!("this effect has no energy: {table}").into())
}

/// The mechanics of a sheet with the listed effects.
pub fn mechanics(
    sheet: &Arc<Sheet>,
    material: impl Into<MaterialField>,
    effects: &[&str],
    pins: Pins,
) -> Outcome<Potential> {
    let material = material.into();
    let energies: Outcome<Vec<_>> =
        effects.iter().map(|table| energy(sheet, material.clone(), table)).collect();
    Ok(Potential::new(&Mechanics::new(Arc::clone(sheet), energies?, pins)?))
}

/// A vertical dead load `value` per rest area on all of the sheet, as a scene lists it.
pub fn area_load(value: f64) -> String {
    format!("kind = 'load'\nwhere = 'all'\nforce = {{ per-area = [0.0, 0.0, {value:e}] }}")
}

/// Brings `x` to rest with the default method.
pub fn relax(mechanics: &mut Potential, x: &mut [Vec3], tolerance: f64) -> Outcome<Relaxation> {
    let goal = Goal { tolerance, max_iterations: 20_000, ..Goal::default() };
    let mut method = Lbfgs::new(mechanics.mechanics(), LbfgsSpec::default())?;
    Ok(method.relax(mechanics, x, &goal)?)
}

/// The equilibrium within the plane z = 0 from the shape `x`, and whatever `pins` hold besides.
pub fn relax_flat(
    sheet: &Arc<Sheet>,
    material: &Material,
    models: &Models,
    (pins, factor): (&Pins, &[f64]),
    x: &mut [Vec3],
) -> Outcome<()> {
    let flat = pins.iter().map(|p| [p[0], p[1], true]).collect();
    let mut mechanics = mechanics(sheet, material, &[models.stretching], flat)?;
    mechanics.set_length_factor(factor);
    relax(&mut mechanics, x, 1e-11)?;
    Ok(())
}

/// Second derivatives of a sheet at a shape, and their Cholesky factor.
pub struct Stiffness {
    matrix: BlockMatrix,
    cholesky: MixedPrecisionCholesky,
}

impl Stiffness {
    /// Prepares the factorisation.
    pub fn new(sheet: &Sheet) -> Outcome<Self> {
        let neighbours = |i: usize, f: &mut dyn FnMut(u32)| {
            sheet.vertex_edges().entries(i).iter().for_each(|&(_, j)| f(j));
        };
        let pattern = Arc::new(BlockPattern::of_rings(sheet.vertex_count(), 2, &neighbours, &[]));
        let matrix = BlockMatrix::zeros(Arc::clone(&pattern));
        Ok(Self { matrix, cholesky: MixedPrecisionCholesky::in_double_precision(pattern)? })
    }

    /// Whether the equilibrium `x` is stable: the Hessian is positive definite.
    pub fn is_positive(&mut self, mechanics: &mut Potential, x: &[Vec3]) -> bool {
        mechanics.hessian(x, HessianPart::Full, &mut self.matrix).is_ok()
            && self.cholesky.factorise(&self.matrix, true).is_ok()
    }

    /// The small displacements from the stable equilibrium `x` under small forces.
    pub fn response(
        &mut self,
        mechanics: &mut Potential,
        x: &[Vec3],
        mut forces: Vec<Vec3>,
    ) -> Outcome<Vec<Vec3>> {
        if !self.is_positive(mechanics, x) {
            return Err("the shape is not a stable equilibrium".into());
        }
        for (force, fixed) in forces.iter_mut().zip(mechanics.pins()) {
            for a in 0..3 {
                if fixed[a] {
                    force[a] = 0.0;
                }
            }
        }
        self.cholesky.solve(&mut forces);
        Ok(forces)
    }
}

/// Brings `x` to rest by Newton's method with the exact Hessian, shifted by a multiple of the
/// identity until it is positive definite, with a backtracking line search.
///
/// Strips with free sides need it: there the positive part of the cotangent bending energy, on
/// which the default method rests, has no stiffness against shapes of zero mean curvature.
pub fn newton(mechanics: &mut Potential, x: &mut [Vec3], tolerance: f64) -> Outcome<usize> {
    let mut stiffness = Stiffness::new(mechanics.sheet())?;
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let mut shift = 0.0;
    for iteration in 0..500 {
        let energy = mechanics.energy_gradient(x, &mut gradient);
        let residual = mechanics.residual(&gradient);
        if residual <= tolerance {
            return Ok(iteration);
        }
        mechanics.hessian(x, HessianPart::Full, &mut stiffness.matrix)?;
        let scale = stiffness.matrix.mean_diagonal();
        let mut shifted = stiffness.matrix.clone();
        shifted.add_diagonal(shift * scale);
        while stiffness.cholesky.factorise(&shifted, true).is_err() {
            shift = f64::max(4.0 * shift, 1e-9);
            shifted = stiffness.matrix.clone();
            shifted.add_diagonal(shift * scale);
        }
        let mut step: Vec<Vec3> = gradient.iter().map(|g| -g).collect();
        stiffness.cholesky.solve(&mut step);
        let slope: f64 = gradient.iter().zip(&step).map(|(g, d)| g.dot(d)).sum();
        let longest = step.iter().map(|d| d.norm()).fold(0.0, f64::max);
        let mut length = (0.5 * mechanics.metric().mean_edge() / longest).min(1.0);
        shift = if length < 1.0 { shift } else { 0.1 * shift };
        shift = if shift < 1e-10 { 0.0 } else { shift };
        loop {
            let trial: Vec<Vec3> = x.iter().zip(&step).map(|(x, d)| x + length * d).collect();
            // Near rest the energy is round-off, and the whole step is right.
            let slight = slope.abs() < 1e-10 * energy.abs();
            if slight || mechanics.energy(&trial) <= energy + 1e-4 * length * slope {
                x.copy_from_slice(&trial);
                break;
            }
            length *= 0.5;
            if length < 1e-10 {
                return Err(format!("no step lowers the energy (residual {residual:.1e})").into());
            }
        }
    }
    Err("Newton's method does not come to rest".into())
}

/// Where `stable` turns from true to false between `low` and `high`, to a relative 1e-5.
pub fn critical(
    mut low: f64,
    mut high: f64,
    mut stable: impl FnMut(f64) -> Outcome<bool>,
) -> Outcome<f64> {
    if !stable(low)? || stable(high)? {
        return Err(format!("stability is not lost between {low} and {high}").into());
    }
    while high - low > 1e-5 * high {
        let middle = 0.5 * (low + high);
        if stable(middle)? { low = middle } else { high = middle }
    }
    Ok(0.5 * (low + high))
}

/// A component of `values` at the point (x, y) of a flat sheet, linear within triangles.
pub fn at_point(sheet: &Sheet, values: &[Vec3], x: f64, y: f64) -> Outcome<Vec3> {
    let p = Vec3::new(x, y, 0.0);
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
        let area = (b - a).cross(&(c - a)).z;
        let share = [(c - b, p - b), (a - c, p - c), (b - a, p - a)]
            .map(|(edge, to)| edge.cross(&to).z / area);
        if share.iter().all(|s| *s >= -1e-12) {
            return Ok(t.iter().zip(share).map(|(v, s)| s * values[*v as usize]).sum());
        }
    }
    Err(format!("({x}, {y}) lies outside the sheet").into())
}
