//! Pictures of all members, arranged by their keys.
//!
//! The last key goes across, all the others down; one key alone goes row by row. Whatever has no picture
//! has a box in its place: red where a member failed, grey where it has not begun.

use super::member::{Found, MemberStatus, Shown};
use super::plan::Plan;
use crate::output::picture::{Picture, View, labelled, sheet};
use crate::output::plot::label;
use crate::run::Result;
use crate::study::pictures::{GAP, LINE, Scale, TILE};

/// Pictures in a row at most, where they need not be in one.
const ACROSS: usize = 5;
/// Pictures in a row from which on they are smaller, and how small.
const MANY: usize = 8;
const SMALL: usize = 180;
/// Width of a letter, about; texts are cut off where a tile ends.
const LETTER: usize = 9;
/// Colour of a box in place of a picture.
const FAILED: [u8; 3] = [255, 214, 214];
const ABSENT: [u8; 3] = [232, 232, 232];
/// Height of the bar below the last picture of one that failed.
const BAR: usize = 6;
/// Most pixels of a contact sheet across or down.
const MOST_PIXELS: usize = 30_000;

/// Pictures of `members`, coloured by the first species, all on one scale and seen from one place; `None`
/// where there is no sheet to be seen.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn contact_sheet(plan: &Plan, members: &[Found]) -> Result<Option<Picture>> {
    let shown: Vec<&Shown> = members.iter().filter_map(|f| f.shown.as_ref()).collect();
    if shown.is_empty() {
        return Ok(None);
    }
    let view = View::of(shown.iter().map(|s| s.x.as_slice()));
    let values = shown.iter().filter_map(|s| s.species.as_ref()).flat_map(|(_, values)| values);
    let scale = Scale::of(values.copied());
    let across = match &plan.axes[..] {
        [_] => members.len().clamp(1, ACROSS),
        axes => axes.last().map_or(1, |axis| axis.values.len().max(1)),
    };
    let tile = if across > MANY { SMALL } else { TILE };
    // What no shape reaches is left out, but for the room of a word.
    let seen = view.rows(tile);
    let height = seen.len().max(LINE);
    let down = members.len().div_ceil(across);
    let row = 2 * LINE + height + GAP;
    let size = ((tile * across).max(2 * TILE), GAP + row * down + LINE + GAP);
    if size.0.max(size.1) > MOST_PIXELS {
        return Ok(None);
    }
    let mut picture = Picture::blank(size.0, size.1);
    let mut texts = Vec::new();
    for (number, found) in members.iter().enumerate() {
        let (left, top) = (number % across * tile, GAP + number / across * row);
        let cut = |text: String| -> String { text.chars().take((tile - GAP) / LETTER).collect() };
        let (row_label, tile_label) = labels(plan, found);
        match number % across {
            0 if plan.axes.len() > 1 => texts.push((row_label, left + GAP, top)),
            _ if plan.axes.len() > 1 => {}
            _ => texts.push((cut(tile_label.clone()), left + GAP, top)),
        }
        let below = match plan.axes.len() {
            1 => caption(found),
            _ => format!("{tile_label}, {}", caption(found)),
        };
        texts.push((cut(below), left + GAP, top + LINE));
        let failed = matches!(found.status, MemberStatus::Failed | MemberStatus::Killed);
        let Some(shown) = &found.shown else {
            let colour = if failed { FAILED } else { ABSENT };
            let (width, height) = (tile - GAP, height.saturating_sub(GAP).max(1));
            picture.place(&filled(width, height, colour), left + GAP / 2, top + 2 * LINE + GAP / 2);
            continue;
        };
        let colour = scale.of_values(shown.species.as_ref().map(|(_, c)| c), shown.x.len());
        let drawn = sheet(&shown.x, &shown.triangles, &colour, &view, tile);
        picture.place(&drawn.rows(seen.clone()), left, top + 2 * LINE);
        if failed {
            let bar = filled(tile - GAP, BAR, FAILED);
            picture.place(&bar, left + GAP / 2, top + 2 * LINE + height);
        }
    }
    let species = shown.iter().find_map(|s| s.species.as_ref());
    let name = species.map_or("", |(name, _)| name.as_str());
    scale.draw(name, &mut picture, GAP + row * down, &mut texts);
    labelled(&mut picture, &texts)?;
    Ok(Some(picture))
}

/// The keys of a member that go down, and the one that goes across.
fn labels(plan: &Plan, found: &Found) -> (String, String) {
    let mut labels: Vec<String> =
        plan.axes.iter().zip(&found.at).map(|(axis, k)| axis.label(*k)).collect();
    let last = labels.pop().unwrap_or_default();
    (labels.join(", "), last)
}

/// How far a member came, and how it stands unless it is complete.
fn caption(found: &Found) -> String {
    let time = found.measures.last().map(|m| format!("t = {}", label(m.time)));
    match (found.status, time) {
        (MemberStatus::Complete, Some(time)) => time,
        (status, Some(time)) => format!("{time}, {status}"),
        (status, None) => status.to_string(),
    }
}

fn filled(width: usize, height: usize, colour: [u8; 3]) -> Picture {
    let mut picture = Picture::blank(width, height);
    picture.rgb_mut().chunks_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
    picture
}
