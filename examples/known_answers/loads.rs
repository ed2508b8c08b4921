//! A moment on the end of a strip, as a user-defined energy: how to add a term from
//! outside the library.

use rumple::Vec3;
use rumple::effects::{Block, BlockMatrix, Coupling, Energy, HessianPart};
use rumple::geometry::Shape;

/// A lever of an [`EndMoment`]: from the mean of `base` to `tip`.
pub struct Lever {
    /// The vertex at the end.
    pub tip: usize,
    /// Its two neighbours in the column before.
    pub base: [usize; 2],
    /// Share of the moment.
    pub share: f64,
}

/// A moment about -y on the end of a strip along x, which follows the end round.
///
/// ```text
/// U = -M Σ_k s_k θ_k,   θ_k = atan2(d_z, d_x),   d_k = x_tip - ½(x_base,1 + x_base,2)
/// ```
///
/// with `Σ s_k = 1`. Its forces on tip and base are equal and opposite and normal to the lever:
/// exactly a couple `M s_k`, and because it has an energy the load is conservative for motion in
/// the plane (x, z).
/// The angle is counted from `from`, so that it has no jump within half a turn of that.
pub struct EndMoment {
    /// M.
    pub moment: f64,
    /// Where it acts.
    pub levers: Vec<Lever>,
    /// The angle about which angles are measured.
    pub from: f64,
}

impl EndMoment {
    fn arm(lever: &Lever, x: &[Vec3]) -> Vec3 {
        x[lever.tip] - 0.5 * (x[lever.base[0]] + x[lever.base[1]])
    }

    /// Mean angle of the end.
    pub fn angle(&self, x: &[Vec3]) -> f64 {
        let (sin, cos) = self.from.sin_cos();
        let turned = |d: Vec3| (cos * d.z - sin * d.x).atan2(cos * d.x + sin * d.z);
        self.from + self.levers.iter().map(|l| l.share * turned(Self::arm(l, x))).sum::<f64>()
    }
}

impl Energy for EndMoment {
    type Work = ();

    fn name(&self) -> &'static str {
        "end moment"
    }

    fn coupling(&self) -> Coupling {
        Coupling::TWO_RINGS
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        if let Some(gradient) = gradient {
            for lever in &self.levers {
                let d = Self::arm(lever, shape.x);
                let square = d.x * d.x + d.z * d.z;
                let by_arm = self.moment * lever.share / square * Vec3::new(d.z, 0.0, -d.x);
                gradient[lever.tip] += by_arm;
                for base in lever.base {
                    gradient[base] -= 0.5 * by_arm;
                }
            }
        }
        -self.moment * self.angle(shape.x)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        (): &mut (),
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        if part == HessianPart::Positive {
            return;
        }
        let x = shape.x;
        into.update_rows(|i, row| {
            for lever in &self.levers {
                let corners = [(lever.tip, 1.0), (lever.base[0], -0.5), (lever.base[1], -0.5)];
                let Some((_, a)) = corners.iter().find(|(v, _)| *v == i) else { continue };
                let d = Self::arm(lever, x);
                let square = d.x * d.x + d.z * d.z;
                let factor = -self.moment * lever.share / (square * square);
                let (twist, difference) = (2.0 * d.x * d.z, d.z * d.z - d.x * d.x);
                let second = factor
                    * Block::new(twist, 0.0, difference, 0.0, 0.0, 0.0, difference, 0.0, -twist);
                for (j, b) in corners.iter().filter(|(j, _)| *j >= i) {
                    row.add(*j, &(a * b * second));
                }
            }
        });
    }
}
