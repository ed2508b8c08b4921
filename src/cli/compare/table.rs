//! A comparison in numbers.

use std::fmt::Write as _;

use crate::Error;
use crate::output::SelfIntersection;
use crate::output::plot::label;
use crate::study::compare::{DIVERGED, Divergence, Member, Ran};
use crate::tally::Work;

/// Every member's distance from the first that ran as far as they are on one branch, its last
/// measures, and its cost.
pub(super) fn table(members: &[Member]) -> String {
    const HEAD: [[&str; 14]; 2] = [
        [
            "",
            "distance",
            "",
            "parts at",
            "energy",
            "amplitude",
            "spots",
            "nearest",
            "s",
            "steps",
            "iterations",
            "newton",
            "evaluations",
            "factorisations",
        ],
        ["", "shape", "species", "", "", "", "", "", "", "", "", "iterations", "", ""],
    ];
    let mut rows: Vec<[String; 14]> = HEAD.map(|row| row.map(str::to_owned)).to_vec();
    let reference = reference(members);
    let mut notes = String::new();
    let mut diverged = false;
    for member in members {
        match (&member.outcome, reference) {
            (Ok(ran), Some((first, reference))) => {
                let Some(measures) = ran.measures.last() else { continue };
                let (deviations, work) = (ran.deviations(reference), ran.work());
                if let Some(by) = &deviations.diverged {
                    diverged = true;
                    let _ = writeln!(notes, "{}: {}", member.name, in_words(by, ran, first));
                }
                if let Some(words) = ran.summary.intersection.and_then(SelfIntersection::words) {
                    let _ = writeln!(notes, "{}: {words}", member.name);
                }
                let [shape, species] = match deviations.largest {
                    Some((shape, species)) => [shape, species].map(|d| format!("{d:.2e}")),
                    None => ["-", "-"].map(str::to_owned),
                };
                let text = |by: Divergence| format!("t = {}", label(by.time));
                rows.push([
                    member.name.clone(),
                    shape,
                    species,
                    deviations.diverged.map_or("-".into(), text),
                    format!("{:.5e}", measures.energy),
                    format!("{:.4}", measures.amplitude),
                    measures.spots.to_string(),
                    measures.nearest.map_or("-".into(), |d| format!("{d:.2}")),
                    format!("{:.2}", ran.seconds()),
                    work.steps.to_string(),
                    work.iterations.to_string(),
                    work.newton_iterations.to_string(),
                    work.evaluations().to_string(),
                    work.factorisations.to_string(),
                ]);
            }
            (Err(error), _) => {
                let _ = writeln!(notes, "{}: {}", member.name, plain(error));
            }
            (Ok(_), None) => {}
        }
    }
    if diverged {
        let _ = writeln!(
            notes,
            "distances are the largest before two runs diverge, that is differ by more than {DIVERGED} of \
             their size; after that compare energy, amplitude, spots and distances of nearest centres"
        );
    }
    let widths: Vec<usize> =
        (0..14).map(|k| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0)).collect();
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

/// The member that the others are compared with: the first that ran.
fn reference(members: &[Member]) -> Option<(&str, &Ran)> {
    members.iter().find_map(|m| Some((m.name.as_str(), m.outcome.as_ref().ok()?)))
}

/// Where two runs part, by what, and what that is measured against.
fn in_words(diverged: &Divergence, ran: &Ran, first: &str) -> String {
    let share = match diverged.by.relative() {
        share if share < 10.0 => format!("{:.0} %", 100.0 * share),
        share => format!("{} times", label(share.round())),
    };
    let named = |species: usize| ran.species.get(species).map_or("species", String::as_str);
    let (what, against) = match diverged.species {
        Some(species) => (named(species), format!("the {} there", named(species))),
        None => ("shape", "the displacement there".to_owned()),
    };
    let [distance, size] = [diverged.by.distance, diverged.by.size].map(label);
    format!(
        "at t = {} its {what} is {distance} away from that of {first}, {share} of {against} \
         ({size}), root mean squares",
        label(diverged.time)
    )
}

fn plain(error: &Error) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

/// Every output time of every member, in its last row with the work of its steps; what has no value is empty.
pub(super) fn csv(members: &[Member]) -> String {
    let mut text = String::from(
        "member,time,shape distance,species distance,energy [energy],amplitude [length],spots,\
         share,separation d [length],nearest centres [length],wall [s],evaluations",
    );
    for (name, _) in Work::NAMES {
        let _ = write!(text, ",{}", name.replace('_', " "));
    }
    text.push('\n');
    let value = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    let reference = reference(members);
    for member in members {
        let (Ok(ran), Some((_, reference))) = (&member.outcome, reference) else { continue };
        let deviations = ran.deviations(reference);
        for m in &ran.measures {
            let same = deviations.course.iter().find(|c| c.0 == m.time);
            let _ = write!(
                text,
                "\"{}\",{},{},{},{},{},{},{},{},{}",
                member.name.replace('"', "\"\""),
                m.time,
                value(same.map(|c| c.1)),
                value(same.map(|c| c.2)),
                m.energy,
                m.amplitude,
                m.spots,
                m.share,
                value(m.separation),
                value(m.nearest)
            );
            if ran.measures.last().is_some_and(|last| last.time == m.time) {
                let work = ran.work();
                let _ = write!(text, ",{},{}", ran.seconds(), work.evaluations());
                for count in work.values() {
                    let _ = write!(text, ",{count}");
                }
            } else {
                text.extend(std::iter::repeat_n(',', 2 + Work::NAMES.len()));
            }
            text.push('\n');
        }
    }
    text
}
