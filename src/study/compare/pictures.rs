//! Plots and pictures of a comparison.

use super::{Member, MemberRun};
use crate::num::real;
use crate::output::picture::Picture;
use crate::output::plot::{Curve, Figure, Panel, label};
use crate::run::Result;
use crate::study::draw::contact_sheet::{ACROSS, ContactSheet, GAP, LINE, Shape, TILE};
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
        return Figure { names, columns: 1, ..Figure::default() };
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
    let mut panels = Vec::new();
    let mut panel = |title: &str, across: &str, logarithmic, curves| {
        let (title, across) = (title.into(), across.into());
        panels.push(Panel { title, across, logarithmic, curves, ..Panel::default() });
    };
    let space = reference.sheet.triangle_count() > 0;
    let (up, flat) = ((false, true), (false, false));
    if space {
        panel("distance of shapes from the first", "time", up, distances(Distance::of_shape));
    }
    panel("distance of species from the first", "time", up, distances(Distance::of_species));
    let across = "seconds (▼ distance 0, ▲ diverged from the start, × failed)";
    let costs = cost(members, reference);
    panel("largest distance before divergence, by cost", across, (true, true), costs);
    if space {
        panel("elastic energy [energy]", "time", flat, measured(|m| m.energy));
        panel("largest displacement [length]", "time", flat, measured(|m| m.amplitude));
        panel("connected regions above the level", "time", flat, measured(|m| real(m.spots)));
    } else {
        let species = reference.species.first().map_or("species", String::as_str);
        let value = |c: &Vec<f64>| c.first().copied().unwrap_or(f64::NAN);
        let values = |r: &MemberRun| -> Vec<(f64, f64)> {
            r.states.iter().zip(&r.shown).map(|(s, c)| (s.time, value(c))).collect()
        };
        panel(species, "time", flat, curves(&values));
    }
    Figure { names, guides: 0, marks: Vec::new(), panels, columns: 3 }
}

/// Cost and largest distance of every member, at the edge where it has none: the reference and what
/// agrees with it exactly below, what begins apart above, what failed in the corner.
fn cost(members: &[Member], reference: &MemberRun) -> Vec<Curve> {
    let largest = |ran: &MemberRun| ran.deviations(reference).largest.map(|(a, b)| a.max(b));
    let mark = |(name, member): (usize, &Member)| {
        let ran = member.outcome.as_ref().ok();
        let seconds = ran.map_or(f64::INFINITY, MemberRun::seconds);
        let distance = ran.and_then(largest).unwrap_or(f64::INFINITY);
        Curve { name, points: vec![(seconds, distance)] }
    };
    members.iter().enumerate().map(mark).collect()
}

/// Pictures of `members` side by side, a row each, coloured by the first species on one scale, at
/// up to five of the output times; `None` without a sheet.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn contact_sheet(members: &[Member]) -> Result<Option<Picture>> {
    let all = || ran(members).map(|(_, ran)| ran);
    if all().all(|r| r.sheet.triangle_count() == 0) {
        return Ok(None);
    }
    let shapes: Vec<Shape<'_>> =
        all().flat_map(|r| (0..r.states.len()).map(|k| shape(r, k))).collect();
    let columns = all().map(|r| r.states.len()).max().unwrap_or(0).min(ACROSS);
    let mut sheet = ContactSheet::new(&shapes, TILE);
    let picture = 2 * LINE + sheet.height() + GAP;
    let row = |m: &Member| if m.outcome.is_ok() { picture } else { LINE + GAP };
    let height = members.iter().map(row).sum::<usize>() + LINE + GAP;
    sheet.resize(TILE * columns.max(2), height);
    let mut top = GAP;
    for member in members {
        match &member.outcome {
            Err(_) => sheet.write(format!("{}: failed", member.name), GAP, top),
            Ok(ran) => {
                sheet.write(member.name.clone(), GAP, top);
                for (column, k) in shown_states(ran.states.len(), columns).enumerate() {
                    let left = column * TILE;
                    sheet.draw(&shape(ran, k), left, top + 2 * LINE);
                    let time = format!("t = {}", label(ran.states[k].time));
                    sheet.write(time, left + GAP, top + LINE);
                }
            }
        }
        top += row(member);
    }
    let name = all().find_map(|r| r.species.first()).map_or("", String::as_str);
    sheet.finish(name, top).map(Some)
}

fn shape(ran: &MemberRun, state: usize) -> Shape<'_> {
    let (x, triangles) = (&ran.states[state].x, ran.sheet.triangles());
    Shape { x, triangles, values: ran.shown.get(state) }
}

/// Which of `count` states are shown in `columns` pictures: the last always, the others evenly
/// before it.
fn shown_states(count: usize, columns: usize) -> impl Iterator<Item = usize> {
    let columns = columns.min(count);
    (0..columns).map(move |column| count.saturating_sub(1) * (column + 1) / columns)
}
