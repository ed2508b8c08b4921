//! Rumple with one effect more: a smooth ball of radius R that is pressed into the sheet.
//!
//! ```text
//! U = Σ_i A⁰_i k/(8 R²) max(R² - |x_i - p(t)|², 0)²,    p(t) = centre + s(t) · displacement
//! ```
//!
//! s is the ramp, A⁰_i the rest area of vertex i. Where the sheet is inside the ball by δ ≪ R, it is
//! pushed out along the radius with the pressure k δ: k is force/length³. Frictionless.

use rumple::effects::prelude::*;
use serde::{Deserialize, Serialize};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Indenter {
    radius: Positive,
    stiffness: Positive,
    centre: [Finite; 3],
    displacement: [Finite; 3],
    ramp: Option<Ramp>,
}

#[typetag::serialize(name = "indenter")]
impl EffectSpec for Indenter {
    fn needs(&self) -> Needs {
        Needs { out_of_plane: Some("centre"), ..Needs::default() }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let [centre, displacement] =
            [self.centre, self.displacement].map(|v| Vec3::from(v.map(Finite::get)));
        let (radius, stiffness) = (self.radius.get(), self.stiffness.get());
        let (ramp, area) = (RampFactor::new(self.ramp.as_ref())?, lumped_areas(context.sheet));
        let vertices = (0..).take(area.len()).map(|i| [i]).collect();
        let ball = Elements::new("indenter", context.sheet, vertices, move |now, i| Ball {
            centre: centre + ramp.factor_at(now.time) * displacement,
            radius,
            weight: stiffness * area[i] / (2.0 * radius * radius),
        })?;
        Ok(Effect::energy(ball.depending_on_time()))
    }
}

rumple::register_kind!(dyn EffectSpec, "indenter", Indenter);

/// The ball as one vertex feels it: u = weight/4 · max(R² - |x - p|², 0)².
struct Ball {
    centre: Vec3,
    radius: f64,
    weight: f64,
}

impl Element<1> for Ball {
    fn gradient(&self, [x]: &[Vec3; 1]) -> (f64, [Vec3; 1]) {
        let d = x - self.centre;
        let inside = (self.radius * self.radius - d.norm_squared()).max(0.0);
        (0.25 * self.weight * inside * inside, [-self.weight * inside * d])
    }

    fn hessian(&self, [x]: &[Vec3; 1], part: HessianPart) -> [[Block; 1]; 1] {
        let d = x - self.centre;
        let inside = (self.radius * self.radius - d.norm_squared()).max(0.0);
        let along = if inside > 0.0 { 2.0 } else { 0.0 };
        let across = if part == HessianPart::Full { inside } else { 0.0 };
        [[self.weight * (along * d * d.transpose() - across * Block::identity())]]
    }
}

pub fn main() -> std::process::ExitCode {
    rumple::cli::main()
}

#[test]
fn derivatives_are_right() {
    let scene = rumple::scene::Scene::parse(include_str!("../plate.toml"), "plate", &[]).unwrap();
    let sheet = rumple::sheet::generate(&rumple::sheet::SheetShape::Disc { radius: 9.0 }, 200, 1);
    let report = rumple::kit::examine(scene.effects[3].as_ref(), &sheet.unwrap().into(), None);
    assert_eq!(report.unwrap().faults, Vec::<String>::new());
}
