//! A comparison in numbers.

use std::fmt::Write as _;

use crate::Error;
use crate::simulation::compare::{Member, PARTED};

/// Every member's distance from the first that ran as far as they are on one branch, its last
/// measures, and its cost.
pub(super) fn table(members: &[Member]) -> String {
    const HEAD: [[&str; 12]; 2] = [
        [
            "",
            "distance",
            "",
            "parts at",
            "energy",
            "amplitude",
            "spots",
            "separation",
            "s",
            "steps",
            "iterations",
            "factors",
        ],
        ["", "shape", "species", "", "", "", "", "", "", "", "", ""],
    ];
    let mut rows: Vec<[String; 12]> = HEAD.map(|row| row.map(str::to_owned)).to_vec();
    let reference = members.iter().find_map(|m| m.outcome.as_ref().ok());
    let mut notes = String::new();
    let mut parted = false;
    for member in members {
        match (&member.outcome, reference) {
            (Ok(ran), Some(reference)) => {
                let Some(measures) = ran.measures.last() else { continue };
                let apart = ran.apart(reference);
                parted |= apart.parted.is_some();
                let [shape, species] = match apart.largest {
                    Some((shape, species)) => [shape, species].map(|d| format!("{d:.2e}")),
                    None => ["-", "-"].map(str::to_owned),
                };
                let parts = |(time, by): (f64, f64)| format!("t = {time}, by {by:.2}");
                rows.push([
                    member.name.clone(),
                    shape,
                    species,
                    apart.parted.map_or("-".into(), parts),
                    format!("{:.5e}", measures.energy),
                    format!("{:.4}", measures.amplitude),
                    measures.spots.to_string(),
                    format!("{:.2}", measures.separation),
                    format!("{:.2}", ran.seconds()),
                    ran.summary.steps.to_string(),
                    ran.summary.iterations.to_string(),
                    ran.summary.factorisations.to_string(),
                ]);
            }
            (Err(error), _) => {
                let _ = writeln!(notes, "{}: {}", member.name, plain(error));
            }
            (Ok(_), None) => {}
        }
    }
    if parted {
        let _ = writeln!(
            notes,
            "distances are the largest before two runs part, that is differ by more than {PARTED} of \
             their size; after that compare energy, amplitude, spots and separation"
        );
    }
    let widths: Vec<usize> =
        (0..12).map(|k| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(width - cell.chars().count());
            let _ =
                if k == 0 { write!(text, "{cell}{pad}") } else { write!(text, "  {pad}{cell}") };
        }
        text.push('\n');
    }
    text + &notes
}

fn plain(error: &Error) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

/// Every output time of every member.
pub(super) fn csv(members: &[Member]) -> String {
    let mut text = String::from(
        "member,time,shape distance,species distance,energy [energy],amplitude [length],spots,\
         separation [length]\n",
    );
    let reference = members.iter().find_map(|m| m.outcome.as_ref().ok());
    for member in members {
        let (Ok(ran), Some(reference)) = (&member.outcome, reference) else { continue };
        let apart = ran.apart(reference);
        for m in &ran.measures {
            let same = apart.course.iter().find(|c| c.0 == m.time);
            let (shape, species) = same.map_or((f64::NAN, f64::NAN), |c| (c.1, c.2));
            let _ = writeln!(
                text,
                "\"{}\",{},{shape},{species},{},{},{},{}",
                member.name.replace('"', "\"\""),
                m.time,
                m.energy,
                m.amplitude,
                m.spots,
                m.separation
            );
        }
    }
    text
}
