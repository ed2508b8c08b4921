//! What L-BFGS does where a triangle has lost its area.

use super::super::Relaxation;
use super::super::stop::collapsed_at;
use super::{Collapse, Lbfgs};
use crate::Vec3;
use crate::model::Potential;
use crate::sheet::quality::triangle_quality;
use crate::solve::SolveError;
use crate::solve::diagnosis::COLLAPSED;

impl Lbfgs {
    /// Deals with the collapsed triangles at the vertex where the force is largest: holds them, or
    /// is an error; `false` if there are none.
    pub(super) fn handle_collapsed(
        &mut self,
        potential: &Potential,
        x: &[Vec3],
        gradient: &[Vec3],
        done: &mut Relaxation,
    ) -> Result<bool, SolveError> {
        let size = |i: &usize| gradient[*i].norm_squared();
        let Some(worst) = (0..x.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else {
            return Ok(false);
        };
        let sheet = potential.sheet();
        // Bending reaches one ring further than the triangle itself.
        let around = sheet.vertex_edges().entries(worst).iter().map(|&(_, j)| j as usize);
        let mut collapsed: Vec<usize> = std::iter::once(worst)
            .chain(around)
            .flat_map(|i| sheet.vertex_triangles().entries(i).iter().map(|&(t, _)| t as usize))
            .filter(|&t| triangle_quality(sheet.triangles()[t].map(|v| x[v as usize])) < COLLAPSED)
            .filter(|&t| !sheet.triangles()[t].iter().all(|v| self.fixed.contains(&(*v as usize))))
            .collect();
        collapsed.sort_unstable();
        collapsed.dedup();
        let Some(&first) = collapsed.first() else { return Ok(false) };
        let usual = if potential.anchor().is_some() { Collapse::Hold } else { Collapse::Stop };
        if self.options.collapse.unwrap_or(usual) == Collapse::Stop {
            return Err(collapsed_at(potential, first, done.iterations, done.residual));
        }
        for &t in &collapsed {
            for v in sheet.triangles()[t] {
                let around =
                    sheet.vertex_edges().entries(v as usize).iter().map(|&(_, j)| j as usize);
                self.fixed.extend(std::iter::once(v as usize).chain(around));
            }
        }
        self.fixed.sort_unstable();
        self.fixed.dedup();
        done.collapsed += collapsed.len();
        self.history.clear();
        // What is fixed now takes up forces and hinders every motion.
        self.gauge.release();
        Ok(true)
    }
}
