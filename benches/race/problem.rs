//! The sheet and the energy of the race, on our side.
//!
//! ```text
//! U = Y/2 Σ_bonds ((l - l̄)/l̄)² + B/2 Σ_{interior i} (4H_i² - 2(1-ν)K_i)     as printed
//! ```
//!
//! with barycentric areas, E = 10⁶, ν = 1/3, h = 1/2, on a disc of radius 100 whose boundary is fixed
//! vertically. Meshes and positions come in the files of the baselines: text `N T`, then `x y boundary`,
//! then triangles; positions as raw 64-bit numbers, or the same behind a NumPy header.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    BendingWeight, BondStretching, EnergyTerm, Material, MeyerBending, StretchingWeight,
};
use rumple::geometry::AreaRule;
use rumple::model::{Mechanics, Potential};
use rumple::sheet::quality::triangle_angles;
use rumple::sheet::{Sheet, Surface};

use crate::common::Result;

/// Young's modulus, Poisson's ratio and thickness.
pub const MATERIAL: Material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 0.5 };

/// Radius of the part that grows in the hard relaxation.
const GROWN_RADIUS: f64 = 20.0;

/// Its growth: Λ_max/Λ_min of the paper.
const GROWTH: f64 = 1.0 / 0.65;

/// Reads a mesh file and checks its boundary flags against the topology.
pub fn read_sheet(path: &Path) -> Result<Arc<Sheet>> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, numbers(line)));
    let mut next = |count: usize| -> Result<Vec<f64>> {
        match lines.next() {
            Some((_, Some(values))) if values.len() == count => Ok(values),
            Some((line, _)) => {
                Err(format!("{} line {line}: expected {count} numbers", path.display()).into())
            }
            None => Err(format!("{}: cut short", path.display()).into()),
        }
    };
    let head = next(2)?;
    let (mut surface, mut boundary) = (Surface::default(), Vec::new());
    for _ in 0..rumple::num::whole(head[0]) {
        let row = next(3)?;
        surface.points.push(Vec3::new(row[0], row[1], 0.0));
        boundary.push(row[2] > 0.0);
    }
    for _ in 0..rumple::num::whole(head[1]) {
        let row = next(3)?;
        let vertex = |k: usize| rumple::num::index(rumple::num::whole(row[k]));
        surface.triangles.push([vertex(0), vertex(1), vertex(2)]);
    }
    surface.path = Some(path.to_owned());
    let (sheet, _) = surface.into_sheet()?;
    if sheet.boundary() != boundary {
        return Err(format!("{}: its boundary flags are not its boundary", path.display()).into());
    }
    Ok(Arc::new(sheet))
}

fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split_ascii_whitespace().map(|word| word.parse().ok()).collect()
}

/// Reads the positions of `vertices` vertices: raw, or from a `.npy` file of that size.
pub fn read_positions(path: &Path, vertices: usize) -> Result<Vec<Vec3>> {
    let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let size = 24 * vertices;
    let header = bytes.len().checked_sub(size).filter(|h| *h == 0 || bytes.starts_with(b"\x93NUM"));
    let Some(header) = header else {
        let found = bytes.len();
        return Err(format!("{}: {found} bytes, expected {size}", path.display()).into());
    };
    let coordinate = |chunk: &[u8]| -> Result<f64> { Ok(f64::from_le_bytes(chunk.try_into()?)) };
    bytes[header..]
        .chunks_exact(24)
        .map(|p| Ok(Vec3::new(coordinate(&p[..8])?, coordinate(&p[8..16])?, coordinate(&p[16..])?)))
        .collect()
}

/// Writes raw positions.
pub fn write_positions(path: &Path, x: &[Vec3]) -> Result<()> {
    let bytes: Vec<u8> = x.iter().flat_map(|x| x.iter().flat_map(|c| c.to_le_bytes())).collect();
    fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()).into())
}

/// The printed energy on `sheet`, not grown.
pub fn mechanics(sheet: &Arc<Sheet>) -> Result<Potential> {
    let bending = MeyerBending::new(sheet, &MATERIAL, BendingWeight::Paper, AreaRule::Barycentric);
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&MATERIAL, StretchingWeight::Paper)),
        EnergyTerm::new(bending),
    ];
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    Ok(Potential::new(&Mechanics::new(Arc::clone(sheet), energies, pins)?))
}

/// Lets the inner part grow: the length factor of a bond is the mean of its ends'.
pub fn grow(mechanics: &mut Potential) {
    let sheet = Arc::clone(mechanics.sheet());
    let at = |v: u32| {
        let x = sheet.rest()[v as usize];
        if x.x.hypot(x.y) < GROWN_RADIUS { GROWTH } else { 1.0 }
    };
    let factor: Vec<f64> =
        sheet.edges().iter().map(|e| 0.5 * (at(e.vertices[0]) + at(e.vertices[1]))).collect();
    mechanics.set_length_factor(&factor);
}

/// Energy and Euclidean norm of its gradient over the free directions.
pub fn energy_and_norm(mechanics: &mut Potential, x: &[Vec3]) -> (f64, f64) {
    let mut gradient = vec![Vec3::zeros(); x.len()];
    let energy = mechanics.energy_gradient(x, &mut gradient);
    (energy, gradient.iter().map(Vec3::norm_squared).sum::<f64>().sqrt())
}

/// Smallest angle of all triangles, degrees.
pub fn smallest_angle(sheet: &Sheet, x: &[Vec3]) -> f64 {
    let angles = sheet.triangles().iter().flat_map(|t| triangle_angles(t.map(|v| x[v as usize])));
    angles.fold(f64::INFINITY, f64::min).to_degrees()
}
