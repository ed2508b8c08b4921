//! A spherical shell pressed between two rigid plates.
//!
//! While the plates approach the equator by δ of the order of the thickness, the shell lies flat on each of them over a disc of
//! radius a of the order of ℓ, ℓ² = R h/√(12(1-ν²)). A flat disc carries no pressure: the plate pushes on its edge.
//! The force F grows a little more than in proportion to δ; at first it is less than `k δ`, k = 4 E h²/(R √(3(1-ν²))), Reissner's
//! stiffness of a point load. The disc is compressed, and turns inwards at δ of about 2.3 h.
//!
//! F/(k δ) is that of Reissner's equations of finite rotations (On axisymmetrical deformations of thin shells of revolution,
//! Proc. Symp. Appl. Math. 3 (1950) 27) with this contact, as `benches/pressed_sphere.py` solves them. The problem is that of
//! Updike & Kalnins, J. Appl. Mech. 37 (1970) 635, doi:10.1115/1.3408592 and 39 (1972) 1110.

use std::sync::Arc;

use rumple::Vec3;
use rumple::model::Potential;
use rumple::sheet::{SheetShape, generate};

use super::contact::plane;
use super::shells::{RADIUS, SHELL_MEYER, SPHERE, nearest, reissner};
use super::{Outcome, Sample, mechanics, newton};

/// δ/h and F/(k δ) of R/h = 50, ν = 0.3.
pub const EXACT: [(f64, f64); 4] = [(0.5, 0.8789), (1.0, 0.9616), (1.5, 1.0706), (2.0, 1.1832)];

/// What the plate `k` pushes with, and the mean height at which it does.
fn pushed(mechanics: &mut Potential, k: usize, x: &[Vec3]) -> [f64; 2] {
    let place = mechanics.mechanics().contacts().nth(k).unwrap_or(usize::MAX);
    let force = mechanics.force_of(place, x);
    let whole: f64 = force.iter().map(|f| f.z).sum();
    let moment: f64 = force.iter().zip(x).map(|(f, x)| f.z * x.z).sum();
    [whole.abs(), moment / whole]
}

/// F/(k δ) at the approaches of `EXACT`, with plates of this reach in units of the thickness.
pub fn squeezed(vertices: usize, reach: f64) -> Outcome<Vec<Sample>> {
    let shape = SheetShape::Sphere { radius: RADIUS, irregular: false };
    let sheet = Arc::new(generate(&shape, vertices, 1)?);
    // They hinder rigid motions only, and carry no force: poles lie on an axis of symmetry.
    let mut pins = vec![[false; 3]; sheet.vertex_count()];
    let (pole, side) = (RADIUS * Vec3::z(), RADIUS * Vec3::x());
    for (place, axes) in
        [(pole, [true, true, false]), (-pole, [true, true, false]), (side, [false, true, false])]
    {
        pins[nearest(&sheet, place)] = axes;
    }
    let reach = reach * SPHERE.thickness;
    let (mut x, mut gap) = (sheet.rest().to_vec(), reach);
    let mut at = |depth: f64| -> Outcome<f64> {
        let level = RADIUS - depth * SPHERE.thickness + gap;
        let plates = [1.0, -1.0].map(|side| plane(side * level, -side, reach));
        let effects = [SHELL_MEYER.stretching, SHELL_MEYER.bending, &plates[0], &plates[1]];
        let mut mechanics = mechanics(&sheet, &SPHERE, &effects, pins.clone())?;
        newton(&mut mechanics, &mut x, 1e-9)?;
        let [[above, top], [below, low]] = [0, 1].map(|k| pushed(&mut mechanics, k, &x));
        let height = 0.5 * (top - low);
        gap = level - height;
        Ok(0.5 * (above + below) / (reissner() * (RADIUS - height)))
    };
    let samples = EXACT.map(|(depth, exact)| {
        // The second time with the distance at which the shell rests from the plates.
        at(depth)?;
        Ok(Sample::new(&sheet, at(depth)?, exact))
    });
    samples.into_iter().collect()
}
