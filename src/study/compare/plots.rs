//! Plots of a comparison.

use super::{Member, MemberRun};
use crate::num::real;
use crate::output::plot::{Curve, Figure, Panel};
use crate::study::gather::{Distance, Measures};

fn ran(members: &[Member]) -> impl Iterator<Item = (usize, &MemberRun)> + Clone {
    let all = members.iter().enumerate();
    all.filter_map(|(k, m)| Some((k, m.outcome.as_ref().ok()?)))
}

/// Distances, measures and costs of `members`; distances are from the first that ran. Those that
/// did not run are in the legend with the word `failed`.
#[must_use]
pub fn figure(members: &[Member]) -> Figure {
    let name = |m: &Member| match &m.outcome {
        Ok(_) => m.name.clone(),
        Err(_) => format!("{} (failed)", m.name),
    };
    let names = members.iter().map(name).collect();
    let Some((first, reference)) = ran(members).next() else {
        return Figure { names, ..Figure::default() };
    };
    let curves = |of: &dyn Fn(&MemberRun) -> Vec<(f64, f64)>| -> Vec<Curve> {
        ran(members).map(|(name, ran)| Curve { name, points: of(ran) }).collect()
    };
    let distances = |of: fn(&Distance) -> f64| -> Vec<Curve> {
        let points = |ran: &MemberRun| -> Vec<(f64, f64)> {
            let course = ran.deviations(reference).course;
            course.iter().map(|d| (d.time, of(d))).filter(|p| p.1 > 0.0).collect()
        };
        let mut curves = curves(&points);
        curves.retain(|curve| curve.name != first);
        curves
    };
    let measured = |of: fn(&Measures) -> f64| {
        curves(&|ran| ran.measures.iter().map(|m| (m.time, of(m))).collect())
    };
    let panel = |title: &str, logarithmic, curves| {
        let (title, across) = (title.into(), "time".into());
        Panel { title, across, logarithmic, curves, ..Panel::default() }
    };
    let mut panels = Vec::new();
    let space = reference.sheet.triangle_count() > 0;
    let (up, flat) = ((false, true), (false, false));
    if space {
        panels.push(panel("distance of shapes from the first", up, distances(Distance::of_shape)));
    }
    panels.push(panel("distance of species from the first", up, distances(Distance::of_species)));
    panels.push(cost(members, reference));
    if space {
        panels.push(panel("elastic energy [energy]", flat, measured(|m| m.energy)));
        panels.push(panel("largest displacement [length]", flat, measured(|m| m.amplitude)));
        panels.push(panel("connected regions above the level", flat, measured(|m| real(m.spots))));
    } else {
        let species = reference.species.first().map_or("species", String::as_str);
        let value = |c: &Vec<f64>| c.first().copied().unwrap_or(f64::NAN);
        let values = |r: &MemberRun| -> Vec<(f64, f64)> {
            r.states.iter().zip(&r.shown).map(|(s, c)| (s.time, value(c))).collect()
        };
        panels.push(panel(species, flat, curves(&values)));
    }
    Figure { names, guides: 0, marks: Vec::new(), panels }
}

/// Cost and largest distance of every member: those that agree with the first exactly are at the lower edge, as the first
/// itself, those that begin apart at the upper one.
fn cost(members: &[Member], reference: &MemberRun) -> Panel {
    let mut panel = Panel {
        title: "largest distance before divergence, by cost".to_owned(),
        across: "seconds (▼ distance 0, × diverged from the start)".to_owned(),
        logarithmic: (true, true),
        ..Panel::default()
    };
    for (name, ran) in ran(members) {
        let largest = ran.deviations(reference).largest.map(|(a, b)| a.max(b));
        match largest {
            None => panel.failed.push((name, ran.seconds())),
            Some(largest) if largest > 0.0 => {
                panel.curves.push(Curve { name, points: vec![(ran.seconds(), largest)] });
            }
            Some(_) => panel.zeros.push((name, ran.seconds())),
        }
    }
    panel
}
