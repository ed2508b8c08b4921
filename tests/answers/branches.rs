//! Q1, Q2, Q5: branches of equilibria through bifurcations and folds; a sheet that nothing holds.

use std::sync::Arc;

use rumple::effects::Material;
use rumple::model::Potential;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::Control;
use rumple::solve::continuation::{Continuation, Event, Settings};

use super::known_answers::bilayer::bilayer;
use super::known_answers::branches::{arch, column};
use super::known_answers::shells::SHELL_MEYER;
use super::known_answers::{Outcome, mechanics};

#[test]
fn a_column_buckles_at_eulers_load_and_bends_as_the_elastica() {
    let found = column(4).unwrap();
    assert!(found.critical.error().abs() < 0.02, "{:?}", found.critical);
    assert!(found.beyond.error().abs() < 0.02, "{:?}", found.beyond);
    // The pitchfork is supercritical: the straight column loses its stability to the bent one.
    assert_eq!(found.negative, [0, 1, 0]);
}

#[test]
fn an_arch_snaps_down_and_back_at_its_limit_loads() {
    let found = arch(4).unwrap();
    for limit in found.limits {
        assert!(limit.error().abs() < 0.03, "{limit:?}");
    }
    assert_eq!(found.negative, [0, 1, 0]);
}

#[test]
fn a_disc_that_bends_itself_becomes_a_trough() {
    let found = bilayer(600).unwrap();
    println!("{:?} {:?}", found.critical, found.slope);
    assert!(found.critical.error().abs() < 0.03, "{:?}", found.critical);
    assert!(found.slope.error().abs() < 0.12, "{:?}", found.slope);
}

const MATERIAL: Material = Material { young: 1e4, poisson: 0.3, thickness: 0.8 };
/// Bulk modulus of what the sphere encloses.
const BULK: f64 = 1e3;

/// A sphere without pins around a compressible content, under the pressure of the parameter.
struct Filled(Arc<Sheet>);

impl Filled {
    fn potential(&self, parameter: f64) -> Outcome<Potential> {
        let pressure = format!("kind = 'pressure'\nvalue = {:e}", -parameter);
        let volume = format!("kind = 'volume'\nstiffness = {BULK:e}");
        let effects = [SHELL_MEYER.stretching, SHELL_MEYER.bending, &pressure, &volume];
        mechanics(&self.0, &MATERIAL, &effects, vec![[false; 3]; self.0.vertex_count()])
    }
}

/// Six rigid motions and a second derivative of rank one: w = p c/(1 + 3 κ c/R), c = R²(1-ν)/(2 E h).
#[test]
fn a_free_sphere_around_a_content_shrinks_by_lames_formula() {
    let radius = 10.0;
    let sphere = generate(&SheetShape::Sphere { radius, irregular: false }, 300, 1).unwrap();
    let sheet = Arc::new(sphere);
    let family = Filled(Arc::clone(&sheet));
    let settings = Settings::over(0.0..=10.0, family.potential(0.0).unwrap().mechanics());
    let settings = Settings { longest_step: 0.5, ..settings };
    let start = (sheet.rest().to_vec(), 0.0);
    let mut branch =
        Continuation::new(move |p| family.potential(p), start, true, settings, &Control::default())
            .unwrap();
    let mut last = branch.point().clone();
    while !branch.has_ended() {
        let mut points = branch.advance().unwrap();
        last = points.pop().unwrap();
        assert!(points.is_empty() && last.negative == 0, "{:?}", last.event);
    }
    assert_eq!((last.event.clone(), last.parameter), (Event::End, 10.0));
    let Material { young, poisson, thickness } = MATERIAL;
    let c = radius * radius * (1.0 - poisson) / (2.0 * young * thickness);
    let exact = 10.0 * c / (1.0 + 3.0 * BULK * c / radius);
    let mean = last.at.x.iter().map(|x| radius - x.norm()).sum::<f64>() / last.at.x.len() as f64;
    assert!((mean / exact - 1.0).abs() < 0.02, "{mean} {exact}");
    // It has not drifted.
    let centre = last.at.x.iter().sum::<rumple::Vec3>() / last.at.x.len() as f64;
    assert!(centre.norm() < 1e-9, "{centre}");
}

/// Modulus of subgrade reaction of the disc's foundation.
const FOUNDATION: f64 = 1.0;

/// A disc that nothing but a foundation holds, under a load per area of the parameter.
struct Founded(Arc<Sheet>);

impl Founded {
    fn potential(&self, parameter: f64) -> Outcome<Potential> {
        let foundation = format!("kind = 'foundation'\nwhere = 'all'\nstiffness = {FOUNDATION:e}");
        let load = format!(
            "kind = 'load'\nwhere = 'all'\nforce = {{ per-area = [0.0, 0.0, {parameter:e}] }}"
        );
        let effects = ["kind = 'stretching'", "kind = 'bending'", &foundation, &load];
        mechanics(&self.0, &MATERIAL, &effects, vec![[false; 3]; self.0.vertex_count()])
    }
}

/// It sinks by p/k as a rigid body. Steps without a part along motions that pins leave free left it behind its load: 0.0108
/// in place of 0.0112 after 200 points.
#[test]
fn a_branch_on_a_foundation_neither_crawls_nor_lags_behind_its_load() {
    let sheet = Arc::new(generate(&SheetShape::Disc { radius: 10.0 }, 400, 1).unwrap());
    let family = Founded(Arc::clone(&sheet));
    let settings = Settings::over(0.0..=0.1, family.potential(0.0).unwrap().mechanics());
    let start = (sheet.rest().to_vec(), 0.0);
    let mut branch =
        Continuation::new(move |p| family.potential(p), start, true, settings, &Control::default())
            .unwrap();
    let mut count = 0;
    while !branch.has_ended() && count < 40 {
        for point in branch.advance().unwrap() {
            count += 1;
            let right = point.parameter / FOUNDATION;
            let worst = point.at.x.iter().map(|x| (x.z - right).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-7, "{worst:e} at {}", point.parameter);
        }
    }
    assert_eq!((branch.point().event.clone(), branch.point().parameter), (Event::End, 0.1));
}
