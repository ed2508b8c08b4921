//! Pictures and plots of sweeps: what is in them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use rumple::Vec3;
use rumple::output::picture::Picture;
use rumple::study::Measures;
use rumple::study::gather::{MemberResults, MemberStatus, ShownState};
use rumple::study::plan::{Axis, Plan, Point};
use rumple::study::sweep::{contact_sheet, drawn_keys, figure};

use rumple::tally::Work;

use crate::common::lattice;

/// Title of the measure `spots` in plots.
const REGIONS: &str = "regions above the level";

pub(super) fn plan(axes: &[&str]) -> Plan {
    let axes: Vec<Axis> = axes.iter().map(|text| Axis::parse(text).unwrap()).collect();
    let count = axes.iter().map(|axis| axis.values.len()).product();
    let at = |number: usize| {
        let mut rest = number;
        let mut at: Vec<usize> = Vec::new();
        for axis in axes.iter().rev() {
            at.push(rest % axis.values.len());
            rest /= axis.values.len();
        }
        at.reverse();
        at
    };
    let point = |number: usize| Point {
        folder: number.to_string(),
        at: at(number),
        fingerprint: String::new(),
        size: 1,
        ..Default::default()
    };
    let members = (0..count).map(point).collect();
    Plan {
        version: String::new(),
        scene: PathBuf::new(),
        set: Vec::new(),
        axes,
        level: None,
        threads: 1,
        plugin_path: Vec::new(),
        plugin_limit: 1.0,
        isolate: false,
        states: false,
        repeats: 0,
        files: BTreeMap::new(),
        members,
        law: None,
    }
}

/// A complete member with `spots`, and a lattice whose first species is around `value`.
pub(super) fn complete(plan: &Plan, number: usize, spots: usize, value: f64) -> MemberResults {
    let sheet = lattice(12, 12);
    let measures = Measures {
        time: 2.0,
        energy: 10.0 * (1.0 + value),
        amplitude: 0.5,
        deflection: 0.5,
        spots,
        separation: Some(3.0 + value),
        nearest: None,
        share: 0.5,
        width: None,
        rate: 0.0,
    };
    let values = sheet.rest().iter().map(|x: &Vec3| value + 0.01 * x.y).collect();
    MemberResults {
        name: plan.name(number),
        at: plan.members[number].at.clone(),
        status: MemberStatus::Complete,
        reason: String::new(),
        measures: vec![measures],
        totals: Vec::new(),
        steady: None,
        seconds: Some(1.0),
        memory: Some(20_000_000),
        work: Some(Work { steps: 5, ..Work::default() }),
        start: None,
        intersection: None,
        timing: None,
        shown: Some(ShownState {
            x: sheet.rest().to_vec(),
            triangles: sheet.triangles().to_vec(),
            species: Some(("c".into(), values)),
        }),
    }
}

/// The same, but nothing came of it.
pub(super) fn without(plan: &Plan, number: usize, status: MemberStatus) -> MemberResults {
    let mut found = complete(plan, number, 0, 0.0);
    found.status = status;
    found.measures.clear();
    (found.shown, found.seconds, found.memory, found.work) = (None, None, None, None);
    found
}

/// Pixels of a part of a picture.
fn part(picture: &mut Picture, rows: Range<usize>, columns: Range<usize>) -> Vec<[u8; 3]> {
    let (width, _) = picture.size();
    let rgb = picture.rgb_mut();
    let pixel = |row: usize, column: usize| {
        let at = 3 * (row * width + column);
        [rgb[at], rgb[at + 1], rgb[at + 2]]
    };
    rows.flat_map(|row| columns.clone().map(move |column| (row, column)))
        .map(|(row, column)| pixel(row, column))
        .collect()
}

/// Colours of the map from dark to light: neither grey, nor the pale red of what failed.
fn coloured(p: &[u8; 3]) -> bool {
    let (least, most) = (p.iter().min().unwrap(), p.iter().max().unwrap());
    most - least > 50
}

fn red(p: &[u8; 3]) -> bool {
    *p == [255, 214, 214]
}

fn grey(p: &[u8; 3]) -> bool {
    *p == [232, 232, 232]
}

fn dark(p: &[u8; 3]) -> bool {
    !coloured(p) && p[0] < 100
}

fn share(pixels: &[[u8; 3]], is: fn(&[u8; 3]) -> bool) -> f64 {
    let count = pixels.iter().filter(|p| is(p)).count();
    f64::from(u32::try_from(count).unwrap()) / f64::from(u32::try_from(pixels.len()).unwrap())
}

#[test]
fn every_member_has_its_place_by_its_keys() {
    let plan = plan(&["a.h=1,2", "D=0,5,9"]);
    let members = [
        complete(&plan, 0, 3, 0.0),
        complete(&plan, 1, 3, 1.0),
        without(&plan, 2, MemberStatus::Failed),
        without(&plan, 3, MemberStatus::NotBegun),
        complete(&plan, 4, 3, 0.0),
        complete(&plan, 5, 3, 1.0),
    ];
    let mut picture = contact_sheet(&plan, &members).unwrap().unwrap();
    let (width, height) = picture.size();
    // The last key goes across: three columns, two rows, and the key to the colours below.
    assert_eq!(width, 900);
    let row = (height - 12 - 24 - 12) / 2;
    let mut tile = |number: usize| {
        let (top, left) = (12 + number / 3 * row, number % 3 * 300);
        let words = part(&mut picture, top..top + 48, left..left + 300);
        (words, part(&mut picture, top + 48..top + row - 12, left..left + 300))
    };
    let tiles: Vec<_> = (0..6).map(&mut tile).collect();
    for (number, (words, image)) in tiles.iter().enumerate() {
        // Each says which it is.
        assert!(share(words, dark) > 0.005, "{number}");
        let expected = match number {
            2 => [false, true, false],
            3 => [false, false, true],
            _ => [true, false, false],
        };
        let found = [share(image, coloured), share(image, red), share(image, grey)];
        assert_eq!(found.map(|s| s > 0.3), expected, "{number}: {found:?}");
    }
    // One scale and one view for all: the same state is the same picture, another one is not.
    assert!(tiles[0].1 == tiles[4].1 && tiles[1].1 == tiles[5].1 && tiles[0].1 != tiles[1].1);
    // The key to the colours, with words.
    let key = part(&mut picture, height - 36..height, 0..width);
    assert!(share(&key, coloured) > 0.01 && share(&key, dark) > 0.001);
}

#[test]
fn one_key_goes_row_by_row_and_a_failed_member_with_a_picture_has_a_bar() {
    let plan = plan(&["h=1..7"]);
    let mut members: Vec<MemberResults> = (0..7).map(|k| complete(&plan, k, 1, 0.1)).collect();
    members[6].status = MemberStatus::Failed;
    let mut picture = contact_sheet(&plan, &members).unwrap().unwrap();
    let (width, height) = picture.size();
    assert_eq!(width, 5 * 300);
    let row = (height - 12 - 24 - 12) / 2;
    let mut red_in = |row_at: usize, column: usize| {
        let (top, left) = (12 + row_at * row, column * 300);
        part(&mut picture, top..top + row, left..left + 300).iter().filter(|p| red(p)).count()
    };
    assert!(red_in(1, 1) > 500);
    assert_eq!([red_in(0, 0), red_in(1, 0), red_in(1, 2)], [0, 0, 0]);
    // Nothing to be seen, no pictures.
    let none: Vec<MemberResults> =
        (0..7).map(|k| without(&plan, k, MemberStatus::NotBegun)).collect();
    assert!(contact_sheet(&plan, &none).unwrap().is_none());
}

#[test]
fn measures_are_drawn_against_a_key_with_a_curve_for_every_other_value() {
    let plan = plan(&["a.h=0.5,1,50", "D=0,5", "sheet.seed=1..3"]);
    let members: Vec<MemberResults> = (0..18)
        .map(|k| match k {
            // h = 50, D = 5 failed with every seed.
            15..18 => without(&plan, k, MemberStatus::Failed),
            _ => complete(&plan, k, 1 + k % 3, 0.0),
        })
        .collect();
    assert_eq!(drawn_keys(&plan), [0, 1], "seeds are no key to draw against");
    let drawn = figure(&plan, &members, 0);
    assert_eq!(drawn.names, ["D = 0", "D = 5"]);
    let titles: Vec<&str> = drawn.panels.iter().map(|p| p.title.as_str()).collect();
    assert!(titles.contains(&REGIONS) && titles.contains(&"separation d [length]"), "{titles:?}");
    assert!(!titles.contains(&"nearest centres [length]"), "no member has any: {titles:?}");
    let spots = drawn.panels.iter().find(|p| p.title == REGIONS).unwrap();
    assert_eq!(spots.logarithmic, (true, false));
    // A curve through the means over seeds, and a mark for every seed.
    let curves: Vec<_> = spots.curves.iter().filter(|c| c.points.len() > 1).collect();
    assert_eq!(curves[0].points, [(0.5, 2.0), (1.0, 2.0), (50.0, 2.0)]);
    assert_eq!(curves[1].points, [(0.5, 2.0), (1.0, 2.0)]);
    assert_eq!(spots.curves.len() - curves.len(), 15);
    assert_eq!(spots.failed, [(1, 50.0); 3]);
    // In the picture: three crosses, of the colour of their curve.
    let mut one = figure(&plan, &members, 0);
    one.panels.retain(|p| p.title == REGIONS);
    one.columns = 1;
    let svg = one.svg().unwrap();
    assert_eq!(svg.matches("<polygon").count(), 3, "{svg}");
    assert!(svg.contains("a.h") && svg.contains("× failed") && svg.contains("D = 5"), "{svg}");
    let with = one.picture().unwrap();
    one.panels[0].failed.clear();
    assert!(with != one.picture().unwrap(), "the crosses are to be seen");
}

#[test]
fn keys_without_numbers_have_places_of_their_own() {
    let plan = plan(&["time.policy=quasi-static,simultaneous"]);
    let members = [complete(&plan, 0, 1, 0.0), complete(&plan, 1, 4, 1.0)];
    let drawn = figure(&plan, &members, 0);
    let spots = drawn.panels.iter().find(|p| p.title == REGIONS).unwrap();
    assert_eq!(spots.curves[0].points, [(1.0, 1.0), (2.0, 4.0)]);
    assert!(spots.across.contains("1 quasi-static, 2 simultaneous"), "{}", spots.across);
    assert_eq!(drawn.names, ["all members"]);
}

#[test]
fn a_sweep_of_which_all_failed_has_plots_that_show_it() {
    let plan = plan(&["h=1,2"]);
    let members = [0, 1].map(|k| without(&plan, k, MemberStatus::Failed));
    let drawn = figure(&plan, &members, 0);
    assert!(!drawn.panels.is_empty());
    assert!(drawn.svg().unwrap().matches("<polygon").count() >= 2);
    // Nothing has begun: nothing to draw.
    let members = [0, 1].map(|k| without(&plan, k, MemberStatus::NotBegun));
    assert!(figure(&plan, &members, 0).panels.is_empty());
}
