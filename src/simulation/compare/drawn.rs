//! Plots and pictures of a comparison.

use super::{Measures, Member, Ran};
use crate::num::real;
use crate::output::picture::{Picture, View, labelled, sheet};
use crate::output::plot::{Curve, Figure, Panel, label};
use crate::{Result, Vec3};

/// Width and height of one picture on a contact sheet, pixels.
const TILE: usize = 300;
/// Height of a line of text.
const LINE: usize = 26;
/// Distances below this are those of one state from itself.
const ROUND_OFF: f64 = 1e-13;
/// Pictures in a row at most.
const ACROSS: usize = 5;

fn ran(members: &[Member]) -> Vec<(usize, &Ran)> {
    let all = members.iter().enumerate();
    all.filter_map(|(k, m)| Some((k, m.outcome.as_ref().ok()?))).collect()
}

/// Distances, measures and costs of `members`; distances are from the first that ran. Those that
/// did not run are in the legend with the word `failed`.
#[must_use]
pub fn figure(members: &[Member]) -> Figure {
    let ran = ran(members);
    let name = |m: &Member| match &m.outcome {
        Ok(_) => m.name.clone(),
        Err(_) => format!("{} (failed)", m.name),
    };
    let mut panels = Vec::new();
    let mut panel = |title: &str, across: &str, logarithmic, curves| {
        panels.push(Panel { title: title.into(), across: across.into(), logarithmic, curves });
    };
    let Some((_, reference)) = ran.first() else {
        let names = members.iter().map(name).collect();
        return Figure { names, panels, columns: 1 };
    };
    let apart: Vec<_> = ran.iter().map(|(k, r)| (*k, r.apart(reference))).collect();
    let others = || apart.iter().filter(|(k, _)| *k != ran[0].0);
    let over_time = |of: fn(&(f64, f64, f64)) -> f64| -> Vec<Curve> {
        let points = |a: &super::Apart| {
            // Round-off of the alignment is no distance.
            a.course.iter().map(|c| (c.0, of(c))).filter(|p| p.1 > ROUND_OFF).collect()
        };
        others().map(|(k, a)| Curve { name: *k, points: points(a) }).collect()
    };
    panel("distance of shapes from the first", "time", (false, true), over_time(|c| c.1));
    panel("distance of species from the first", "time", (false, true), over_time(|c| c.2));
    let cost = |of: fn(&super::Apart) -> f64| -> Vec<Curve> {
        let curve = |(k, a): &(usize, super::Apart)| {
            let seconds = ran.iter().find(|(j, _)| j == k).map_or(f64::NAN, |(_, r)| r.seconds());
            Curve { name: *k, points: vec![(seconds, of(a))] }
        };
        others().map(curve).collect()
    };
    panel(
        "largest distance before parting, by cost",
        "seconds",
        (true, true),
        cost(|a| a.largest.map_or(f64::NAN, |(shape, species)| shape.max(species))),
    );
    let measured = |of: fn(&Measures) -> f64| -> Vec<Curve> {
        let points = |r: &Ran| r.measures.iter().map(|m| (m.time, of(m))).collect();
        ran.iter().map(|(k, r)| Curve { name: *k, points: points(r) }).collect()
    };
    if reference.sheet.triangle_count() == 0 {
        let first = |r: &Ran| -> Vec<(f64, f64)> {
            let value = |c: &Vec<f64>| c.first().copied().unwrap_or(f64::NAN);
            r.states.iter().zip(&r.shown).map(|(s, c)| (s.time, value(c))).collect()
        };
        let curves = ran.iter().map(|(k, r)| Curve { name: *k, points: first(r) }).collect();
        panel("first species", "time", (false, false), curves);
        return Figure { names: members.iter().map(name).collect(), panels, columns: 2 };
    }
    panel("elastic energy", "time", (false, false), measured(|m| m.energy));
    panel("largest displacement", "time", (false, false), measured(|m| m.amplitude));
    panel("spots", "time", (false, false), measured(|m| real(m.spots)));
    Figure { names: members.iter().map(name).collect(), panels, columns: 3 }
}

/// Pictures of `members` side by side, a row each, coloured by the first species on one scale, at
/// up to five of the output times; `None` where there is no sheet to be seen.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn contact_sheet(members: &[Member]) -> Result<Option<Picture>> {
    let ran = ran(members);
    if ran.iter().all(|(_, r)| r.sheet.triangle_count() == 0) {
        return Ok(None);
    }
    let columns = ran.iter().map(|(_, r)| r.states.len()).max().unwrap_or(0).min(ACROSS);
    let shapes = ran.iter().flat_map(|(_, r)| r.states.iter().map(|s| s.x.as_slice()));
    let view = View::of(shapes);
    let values = || ran.iter().flat_map(|(_, r)| r.shown.iter().flatten().copied());
    let (least, most) =
        values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)));
    // Those that did not run take a line.
    let heights = members.iter().map(|m| if m.outcome.is_ok() { TILE + LINE } else { LINE });
    let height = heights.sum::<usize>() + LINE;
    let mut picture = Picture::blank(TILE * columns.max(2), height);
    let mut texts = Vec::new();
    let mut top = 0;
    for member in members {
        let Ok(ran) = &member.outcome else {
            texts.push((format!("{}: failed", member.name), 8, top + 8));
            top += LINE;
            continue;
        };
        texts.push((member.name.clone(), 8, top + 8));
        let count = ran.states.len();
        for column in 0..columns.min(count) {
            // The last state always, the others evenly before it.
            let k = (count - 1) * (column + 1) / columns.min(count).max(1);
            let colour: Vec<f64> = match ran.shown.get(k) {
                Some(c) if most > least => c.iter().map(|c| (c - least) / (most - least)).collect(),
                _ => vec![0.5; ran.states[k].x.len()],
            };
            let x: &[Vec3] = &ran.states[k].x;
            let tile = sheet(x, ran.sheet.triangles(), &colour, &view, TILE);
            picture.place(&tile, column * TILE, top + LINE);
            texts.push((
                format!("t = {}", label(ran.states[k].time, false)),
                column * TILE + 8,
                top + LINE,
            ));
        }
    }
    if least < most {
        let scale = format!(
            "colours from {} (dark) to {} (light)",
            label(least, false),
            label(most, false)
        );
        texts.push((scale, 8, height - LINE + 4));
    }
    labelled(&mut picture, &texts)?;
    Ok(Some(picture))
}
