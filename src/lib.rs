//! Thin elastic sheets whose shape and chemistry drive one another.
//!
//! A sheet is a triangle mesh with rest positions `X_i` and current positions `x_i`; chemistry is
//! a set of species carried on its material points. One coupled system is solved,
//!
//! ```text
//! drag · dx/dt = -∂U/∂x (x; c) + other forces          (mechanics)
//!        dc/dt = D Δ_x c + R(c, signals(x, c), t)      (chemistry)
//! ```
//!
//! where the energy `U` is the sum of the effects that a scene lists and the kinetics `R` come from a law, as
//! text or as a plugin. The command line is `rumple` ([`cli`]); below is the same from Rust. Files, keys
//! and commands are described in `docs/book`.
//!
//! # Step a scene
//!
//! A [`Simulation`] is a [`Scene`](scene::Scene) that is set up, to be stepped and asked. The law here is two
//! formulas: stretch makes c, and c makes the sheet grow.
//!
//! ```
//! use rumple::{Simulation, kinetics::PluginSearch, scene::Scene};
//!
//! let text = r#"
//!     sheet = { shape = "disc", radius = 10.0, vertices = 300 }
//!     material = { young = 1e3, poisson = 0.3333333333333333, thickness = 0.5 }
//!     effect = [
//!         { kind = "stretching" },
//!         { kind = "bending" },
//!         { kind = "pin", where = "rim", axes = "xyz" },
//!         { kind = "pressure", value = 1.0 },
//!         { kind = "diffusion", species = "c", coefficient = 0.5 },
//!     ]
//!     time = { until = 1.0 }
//!     [kinetics]
//!     rates.c = "area_strain - c"
//!     length_factor = "1 + 0.1*c"
//! "#;
//! let scene = Scene::parse(text, "dome.toml", &[])?;      // of a file: Scene::load
//! let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[]))?;
//! simulation.prepare()?;                                  // the first equilibrium
//! while simulation.state().time < 1.0 {
//!     let report = simulation.step(1.0)?;                 // not beyond time 1
//!     println!("Δt = {}, {} iterations", report.length, report.relaxation.iterations);
//! }
//! let state = simulation.state();
//! let height = state.x.iter().map(|x| x.z).fold(0.0, f64::max);
//! let largest = state.species[0].iter().copied().fold(0.0, f64::max);
//! assert!(height > 1.0 && largest > 0.0);
//! for (effect, energy) in simulation.energies()? {
//!     println!("{effect}: {energy}");
//! }
//! # Ok::<(), rumple::Error>(())
//! ```
//!
//! [`Simulation::evaluate`] gives what else is known at a state: forces, curvatures, signals, rates
//! ([`model::Evaluation`]). A mistake in a scene is an [`Error::Scene`] with its line.
//!
//! # Run it into a directory, and read a frame
//!
//! [`run::run::run`] does what `rumple run` does; own [`run::Observer`]s see every accepted state.
//!
//! ```
//! use rumple::output::{Interrupt, Mode, Progress, ResultDirectory};
//! # use rumple::{Simulation, kinetics::PluginSearch, scene::Scene};
//! # let text = r#"
//! #     sheet = { shape = "sphere", radius = 2.0, vertices = 100 }
//! #     effect = [{ kind = "diffusion", species = "c", coefficient = 0.5 }]
//! #     time = { until = 1.0 }
//! #     output = { fields = ["c"] }
//! #     kinetics = { rates = { c = "1 - c" } }
//! # "#;
//! # let scene = Scene::parse(text, "dome.toml", &[])?;
//! # let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[]))?;
//! # let folder = std::env::temp_dir().join(format!("rumple-front-{}", std::process::id()));
//!
//! let directory = ResultDirectory::prepare(&folder, false)?;
//! let mut progress = Progress::new(Mode::Silent, 1.0);
//! let interrupt = Interrupt::install()?;
//! rumple::run::run::run(&scene, &mut simulation, &directory, &mut progress, interrupt)?;
//!
//! let frame = rumple::sheet::read::surface(folder.join("frames/frame_000001.vtu"))?;
//! let c = frame.point_array("c"); // as the scene has output.fields = ["c"]
//! assert!(c.is_some_and(|c| c.values.iter().all(|c| (c - 0.632).abs() < 0.01)));
//! # std::fs::remove_dir_all(&folder).ok();
//! # Ok::<(), rumple::Error>(())
//! ```
//!
//! # An effect of your own
//!
//! A struct that a scene can list, and an energy: here a weight. The guide is `docs/book/manual/effects.md`, a
//! crate with a program `examples/indenter`; [`kit::examine`] tests derivatives and invariances. (Rates of species are
//! no effects but [`kinetics`]: formulas as above, or a plugin.)
//!
//! ```
//! use rumple::effects::prelude::*;
//!
//! #[derive(Debug, serde::Serialize, serde::Deserialize)]
//! struct Gravity {
//!     weight: Finite, // force/area
//! }
//!
//! #[typetag::serialize(name = "gravity")]
//! impl EffectSpec for Gravity {
//!     fn needs(&self) -> Needs {
//!         Needs { out_of_plane: Some("weight"), ..Needs::default() }
//!     }
//!
//!     fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
//!         let (area, weight) = (lumped_areas(context.sheet), self.weight.get());
//!         let vertices = (0..).take(area.len()).map(|i| [i]).collect();
//!         let make = move |_: &Conditions<'_>, i| Weight(weight * area[i]);
//!         Ok(Effect::energy(Elements::new("gravity", context.sheet, vertices, make)?))
//!     }
//! }
//!
//! rumple::register_kind!(dyn EffectSpec, "gravity", Gravity);     // now scenes know it
//!
//! /// u = w z.
//! struct Weight(f64);
//!
//! impl Element<1> for Weight {
//!     fn gradient(&self, [x]: &[Vec3; 1]) -> (f64, [Vec3; 1]) {
//!         (self.0 * x.z, [self.0 * Vec3::z()])
//!     }
//!
//!     fn hessian(&self, _: &[Vec3; 1], _: HessianPart) -> [[Block; 1]; 1] {
//!         [[Block::zeros()]]
//!     }
//! }
//!
//! # use rumple::sheet::{SheetShape, generate};
//! let sheet = generate(&SheetShape::Disc { radius: 3.0 }, 60, 1)?.into();
//! let gravity = Gravity { weight: Finite::ONE };
//! let report = rumple::kit::examine(&gravity, &sheet, None)?;
//! assert_eq!(report.faults, Vec::<String>::new());
//! assert!(!report.translation_invariant);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where things are
//!
//! Data flows one way: [`scene`] → [`model`] → [`solve`] → trial state → evaluation → [`effects`] and
//! [`kinetics`] → accepted state → [`output`]. Meshes are in [`sheet`], curvatures and metrics in
//! [`geometry`], comparisons of policies in [`study`].

pub mod cli;
pub mod run;
pub mod scene;
pub mod study;
pub mod view;

#[doc(inline)]
pub use rumple_core::{Problem, effects, kit, model, problem, registry, solve};

#[doc(inline)]
pub use rumple_geometry as geometry;
#[doc(inline)]
pub use rumple_kinetics as kinetics;
#[doc(inline)]
pub use rumple_output as output;
#[doc(inline)]
pub use rumple_sheet as sheet;

pub use rumple_core::{linear, register_kind, register_linear_solver};
pub use rumple_numerics::{Vec3, checked_number, num, record, reduction, tally};
pub use run::{Error, Result, Simulation};

/// The version of this crate, with the commit that it was built from and its features, where they are known.
pub const VERSION: &str = env!("RUMPLE_VERSION");

pub(crate) use rumple_core::document;
pub use rumple_core::{Stepper, stepper};
pub(crate) use rumple_numerics::parallel;

/// Compiles the code of the guide to effects.
#[cfg(doctest)]
#[doc = include_str!("../docs/book/manual/effects.md")]
struct Effects;

/// Compiles the code of the page on what effects are made of.
#[cfg(doctest)]
#[doc = include_str!("../docs/book/manual/effect-contracts.md")]
struct EffectContracts;

/// Compiles the code of the page on observers.
#[cfg(doctest)]
#[doc = include_str!("../docs/book/developers/observer.md")]
struct Observers;
