//! Plots and pictures of a comparison.

use super::{Member, Ran};
use crate::num::real;
use crate::output::picture::{Picture, View, labelled, sheet};
use crate::output::plot::{Curve, Figure, Panel, label};
use crate::run::Result;
use crate::study::measures::Measures;
use crate::study::pictures::{GAP, LINE, Scale, TILE};

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
        let (title, across) = (title.into(), across.into());
        let (failed, zeros) = (Vec::new(), Vec::new());
        panels.push(Panel { title, across, logarithmic, curves, failed, zeros });
    };
    let Some((_, reference)) = ran.first() else {
        let names = members.iter().map(name).collect();
        return Figure { names, guides: 0, panels, columns: 1 };
    };
    let apart: Vec<_> = ran.iter().map(|(k, r)| (*k, r.deviations(reference))).collect();
    let others = || apart.iter().filter(|(k, _)| *k != ran[0].0);
    let over_time = |of: fn(&(f64, f64, f64)) -> f64| -> Vec<Curve> {
        let points = |a: &super::Deviations| {
            a.course.iter().map(|c| (c.0, of(c))).filter(|p| p.1 > 0.0).collect()
        };
        others().map(|(k, a)| Curve { name: *k, points: points(a) }).collect()
    };
    let space = reference.sheet.triangle_count() > 0;
    if space {
        panel("distance of shapes from the first", "time", (false, true), over_time(|c| c.1));
    }
    panel("distance of species from the first", "time", (false, true), over_time(|c| c.2));
    panel(
        "largest distance before divergence, by cost",
        "seconds (▼ distance 0, ▲ diverged from the start, × failed)",
        (true, true),
        cost(members, reference),
    );
    let measured = |of: fn(&Measures) -> f64| -> Vec<Curve> {
        let points = |r: &Ran| r.measures.iter().map(|m| (m.time, of(m))).collect();
        ran.iter().map(|(k, r)| Curve { name: *k, points: points(r) }).collect()
    };
    if !space {
        let first = |r: &Ran| -> Vec<(f64, f64)> {
            let value = |c: &Vec<f64>| c.first().copied().unwrap_or(f64::NAN);
            r.states.iter().zip(&r.shown).map(|(s, c)| (s.time, value(c))).collect()
        };
        let curves = ran.iter().map(|(k, r)| Curve { name: *k, points: first(r) }).collect();
        let species = reference.species.first().map_or("species", String::as_str);
        panel(species, "time", (false, false), curves);
        return Figure { names: members.iter().map(name).collect(), guides: 0, panels, columns: 3 };
    }
    panel("elastic energy [energy]", "time", (false, false), measured(|m| m.energy));
    panel("largest displacement [length]", "time", (false, false), measured(|m| m.amplitude));
    panel("number of spots", "time", (false, false), measured(|m| real(m.spots)));
    Figure { names: members.iter().map(name).collect(), guides: 0, panels, columns: 3 }
}

/// Cost and largest distance of every member, at the edge where it has none: the reference and what
/// agrees with it exactly below, what begins apart above, what failed in the corner.
fn cost(members: &[Member], reference: &Ran) -> Vec<Curve> {
    let mark = |(name, member): (usize, &Member)| {
        let at = match &member.outcome {
            Ok(ran) => {
                let largest = ran.deviations(reference).largest;
                let distance = largest.map_or(f64::INFINITY, |(shape, species)| shape.max(species));
                (ran.seconds(), distance)
            }
            Err(_) => (f64::INFINITY, f64::INFINITY),
        };
        Curve { name, points: vec![at] }
    };
    members.iter().enumerate().map(mark).collect()
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
    // What no shape reaches, at the top and at the bottom of every tile, is left out.
    let seen = view.rows(TILE);
    let scale = Scale::of(ran.iter().flat_map(|(_, r)| r.shown.iter().flatten().copied()));
    let row = |m: &Member| if m.outcome.is_ok() { 2 * LINE + seen.len() + GAP } else { LINE + GAP };
    let height = members.iter().map(row).sum::<usize>() + LINE + GAP;
    let mut picture = Picture::blank(TILE * columns.max(2), height);
    let mut texts = Vec::new();
    let mut top = GAP;
    for member in members {
        match &member.outcome {
            Err(_) => texts.push((format!("{}: failed", member.name), GAP, top)),
            Ok(ran) => {
                texts.push((member.name.clone(), GAP, top));
                for (column, k) in shown_states(ran.states.len(), columns).enumerate() {
                    let state = &ran.states[k];
                    let colour = scale.of_values(ran.shown.get(k), state.x.len());
                    let tile = sheet(&state.x, ran.sheet.triangles(), &colour, &view, TILE);
                    let left = column * TILE;
                    picture.place(&tile.rows(seen.clone()), left, top + 2 * LINE);
                    let time = format!("t = {}", label(state.time));
                    texts.push((time, left + GAP, top + LINE));
                }
            }
        }
        top += row(member);
    }
    let name = ran.iter().find_map(|(_, r)| r.species.first()).map_or("", String::as_str);
    scale.draw(name, &mut picture, top, &mut texts);
    labelled(&mut picture, &texts)?;
    Ok(Some(picture))
}

/// Which of `count` states are shown in `columns` pictures: the last always, the others evenly
/// before it.
fn shown_states(count: usize, columns: usize) -> impl Iterator<Item = usize> {
    let columns = columns.min(count);
    (0..columns).map(move |column| count.saturating_sub(1) * (column + 1) / columns)
}
