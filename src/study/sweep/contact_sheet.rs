//! Pictures of all members, arranged by their keys.
//!
//! The last key goes across, all the others down; one key alone goes row by row. A member without a picture
//! has a box in its place: red where it failed, grey where it has not begun.

use crate::output::picture::Picture;
use crate::output::plot::label;
use crate::run::Result;
use crate::study::draw::picture::{ACROSS, ContactSheet, GAP, LINE, Shape, TILE};
use crate::study::gather::{Found, MemberStatus, Shown};
use crate::study::plan::Plan;

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
    let shapes: Vec<Shape<'_>> = shown.iter().map(|shown| shape(shown)).collect();
    let across = match &plan.axes[..] {
        [_] => members.len().clamp(1, ACROSS),
        axes => axes.last().map_or(1, |axis| axis.values.len().max(1)),
    };
    let tile = if across > MANY { SMALL } else { TILE };
    let mut sheet = ContactSheet::new(&shapes, tile);
    // Room for a word.
    let height = sheet.height().max(LINE);
    let row = 2 * LINE + height + GAP;
    let bottom = GAP + row * members.len().div_ceil(across);
    let size = ((tile * across).max(2 * TILE), bottom + LINE + GAP);
    if shapes.is_empty() || size.0.max(size.1) > MOST_PIXELS {
        return Ok(None);
    }
    sheet.resize(size.0, size.1);
    let cut = |text: String| -> String { text.chars().take((tile - GAP) / LETTER).collect() };
    let last = plan.axes.len().saturating_sub(1);
    for (number, found) in members.iter().enumerate() {
        let (left, top) = (number % across * tile, GAP + number / across * row);
        let tile_label = plan.label(&found.at, |k| k == last);
        let below = if last > 0 {
            if number % across == 0 {
                sheet.write(plan.label(&found.at, |k| k != last), left + GAP, top);
            }
            format!("{tile_label}, {}", caption(found))
        } else {
            sheet.write(cut(tile_label), left + GAP, top);
            caption(found)
        };
        sheet.write(cut(below), left + GAP, top + LINE);
        let (width, left_of_box, top) = (tile - GAP, left + GAP / 2, top + 2 * LINE);
        let failed = matches!(found.status, MemberStatus::Failed | MemberStatus::Killed);
        if let Some(shown) = &found.shown {
            sheet.draw(&shape(shown), left, top);
            if failed {
                sheet.fill((width, BAR), FAILED, left_of_box, top + height);
            }
        } else {
            let size = (width, height.saturating_sub(GAP).max(1));
            sheet.fill(size, if failed { FAILED } else { ABSENT }, left_of_box, top + GAP / 2);
        }
    }
    let name = shown.iter().find_map(|s| s.species.as_ref()).map_or("", |(name, _)| name);
    sheet.finish(name, bottom).map(Some)
}

fn shape(shown: &Shown) -> Shape<'_> {
    let values = shown.species.as_ref().map(|(_, values)| values);
    Shape { x: &shown.x, triangles: &shown.triangles, values }
}

/// Time that a member has reached, and how it stands unless it is complete.
fn caption(found: &Found) -> String {
    let time = found.measures.last().map(|m| format!("t = {}", label(m.time)));
    match (found.status, time) {
        (MemberStatus::Complete, Some(time)) => time,
        (status, Some(time)) => format!("{time}, {status}"),
        (status, None) => status.to_string(),
    }
}
