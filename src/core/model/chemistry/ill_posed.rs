//! Whether diffusion and cross-diffusion together are well-posed.
//!
//! ```text
//! ∂u/∂t = … + D Δu,     u the species, D the matrix of their coefficients, length²/time
//! ```
//!
//! A wave of number k grows at the rates -d k², d the eigenvalues of D. Where one of them has a negative real part short waves
//! grow without bound, faster on every finer mesh, and the equation has no solution.
//!
//! Limits: D of the rest shape; transports that are no multiple of Δ, as advection, are left out, and so are reactions, which bound
//! no rate that grows with k². Coefficients that read species have a matrix at given species, in a triangle by their means over its corners.

use nalgebra::DMatrix;

use super::Chemistry;
use crate::effects::{FieldValues, TransportTerm};
use crate::sheet::Sheet;

/// Eigenvalues above the negative of this share of the largest coefficient are 0 to round-off.
const ROUND_OFF: f64 = 1e-12;

/// Coefficients with which short waves grow without bound.
#[derive(Debug, Clone, PartialEq)]
pub struct IllPosed {
    /// Where: a triangle, or everywhere.
    pub triangle: Option<usize>,
    /// Names of the species that are coupled, in the order of the rows and columns of the matrix.
    pub species: Vec<String>,
    /// The matrix D: rows are the species that move, columns those whose gradients they follow.
    pub matrix: DMatrix<f64>,
    /// The least real part of an eigenvalue of D.
    pub eigenvalue: f64,
    /// Keys of those coefficients that read species, as `effect[2].coefficient`.
    pub read_species: Vec<String>,
}

impl Chemistry {
    /// The coefficients of diffusion and cross-diffusion whose matrix has an eigenvalue with a negative real part: those of the
    /// triangle where it is least, if they differ from place to place. `None` where one of them reads species. Nothing is evaluated
    /// without cross-diffusion.
    #[must_use]
    pub fn ill_posed(&self) -> Option<IllPosed> {
        let involved = self.cross_diffusing();
        match self.reading_species(&involved).next() {
            Some(_) => None,
            None => self.ill_posed_by(&involved, &TransportTerm::diffusivity),
        }
    }

    /// The same at given `species`, with coefficients that read them.
    #[must_use]
    pub fn ill_posed_at(&self, sheet: &Sheet, species: &[Vec<f64>]) -> Option<IllPosed> {
        let species: Vec<&[f64]> = species.iter().map(Vec::as_slice).collect();
        let at = |term: &TransportTerm| term.diffusivity_at(sheet, &species);
        self.ill_posed_by(&self.cross_diffusing(), &at)
    }

    /// Numbers of the species that cross-diffusion moves or follows.
    fn cross_diffusing(&self) -> Vec<usize> {
        let crossing = |t: &&TransportTerm| t.read_species() != t.species();
        let crossed: Vec<_> = self.transports.iter().filter(crossing).collect();
        (0..self.descriptor().species.len())
            .filter(|s| crossed.iter().any(|t| t.read_species() == *s || t.species() == *s))
            .collect()
    }

    /// Transports of the species `involved` whose coefficient reads species.
    fn reading_species(&self, involved: &[usize]) -> impl Iterator<Item = &TransportTerm> {
        let reads = move |t: &&TransportTerm| {
            involved.contains(&t.species()) && !t.read_by_coefficient().is_empty()
        };
        self.transports.iter().filter(reads)
    }

    /// The worst matrix of the species `involved` by the coefficients that `diffusivity` gives.
    fn ill_posed_by(
        &self,
        involved: &[usize],
        diffusivity: &dyn Fn(&TransportTerm) -> Option<FieldValues>,
    ) -> Option<IllPosed> {
        let row = |species: usize| involved.iter().position(|s| *s == species);
        let parts: Vec<(usize, usize, FieldValues)> = self
            .transports
            .iter()
            .filter_map(|t| Some((row(t.species())?, row(t.read_species())?, diffusivity(t)?)))
            .collect();
        let places = parts.iter().find_map(|(_, _, values)| match values {
            FieldValues::Same(_) => None,
            FieldValues::Each(all) => Some(all.len()),
        });
        let at = |place: usize| {
            let mut matrix = DMatrix::zeros(involved.len(), involved.len());
            parts.iter().for_each(|(row, column, d)| matrix[(*row, *column)] += d.at(place));
            let eigenvalue = least_real_part(&matrix)?;
            (eigenvalue < -ROUND_OFF * matrix.amax()).then_some((place, matrix, eigenvalue))
        };
        let found = (0..places.unwrap_or(1)).filter_map(at).min_by(|a, b| a.2.total_cmp(&b.2));
        found.map(|(place, matrix, eigenvalue)| IllPosed {
            triangle: places.map(|_| place),
            species: involved.iter().map(|s| self.descriptor().species[*s].name.clone()).collect(),
            matrix,
            eigenvalue,
            read_species: self
                .reading_species(involved)
                .map(TransportTerm::coefficient_key)
                .collect(),
        })
    }
}

/// The least real part of an eigenvalue; `None` of an empty matrix, and of one that is not finite.
fn least_real_part(matrix: &DMatrix<f64>) -> Option<f64> {
    let has_some = !matrix.is_empty() && matrix.iter().all(|d| d.is_finite());
    let all = has_some.then(|| matrix.complex_eigenvalues())?;
    all.iter().map(|value| value.re).min_by(f64::total_cmp)
}

/// The matrix by rows, with its eigenvalue and where that is, behind the keys of coefficients that read species.
impl std::fmt::Display for IllPosed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let row = |r: nalgebra::RowDVector<f64>| {
            let all: Vec<String> = r.iter().map(|d| format!("{}", crate::num::Short(*d))).collect();
            format!("[{}]", all.join(", "))
        };
        let rows: Vec<String> = self.matrix.row_iter().map(|r| row(r.into_owned())).collect();
        let (rows, species) = (rows.join(", "), self.species.join(", "));
        if !self.read_species.is_empty() {
            write!(f, "{}: ", self.read_species.join(", "))?;
        }
        write!(f, "the matrix of the coefficients of {species}, [{rows}]")?;
        if let Some(triangle) = self.triangle {
            write!(f, " at triangle {triangle}")?;
        }
        write!(f, ", has an eigenvalue of real part {:.4e}", self.eigenvalue)?;
        f.write_str(": short waves grow without bound, faster on every finer mesh")
    }
}
