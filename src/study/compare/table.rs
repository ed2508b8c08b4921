//! A comparison in numbers.

use std::fmt::Write as _;
use std::iter::once;

use super::{Member, MemberRun};
use crate::output::SelfIntersection;
use crate::output::plot::label;
use crate::study::draw::table::{csv_table, number, work_cells, work_titles};
use crate::study::gather::{DIVERGED, Distance};

/// The two lines of the head, cells between bars.
const HEAD: [&str; 2] = [
    "|distance||parts at|energy|amplitude|regions|nearest|s|steps|iterations|newton|evaluations|factorisations",
    "|shape|species|||||||||iterations||",
];

/// Every member's distance from the first that ran as far as they are on one branch, its last
/// measures, and its cost.
pub(crate) fn table(members: &[Member]) -> String {
    let cells = |row: &str| row.split('|').map(str::to_owned).collect::<Vec<_>>();
    let mut rows: Vec<Vec<String>> = HEAD.map(cells).to_vec();
    let mut notes = String::new();
    let mut diverged = false;
    for Member { name, outcome } in members {
        let ran = match outcome {
            Ok(ran) => ran,
            Err(error) => {
                let _ = writeln!(notes, "{name}: {}", first_line(&error.to_string()));
                continue;
            }
        };
        let known = reference(members).zip(ran.measures.last());
        let Some(((first, reference), measures)) = known else { continue };
        let (deviations, work) = (ran.deviations(reference), ran.work());
        if let Some(by) = &deviations.diverged {
            diverged = true;
            let _ = writeln!(notes, "{name}: {}", in_words(by, ran, first));
        }
        if let Some(words) = ran.summary.intersection.and_then(SelfIntersection::words) {
            let _ = writeln!(notes, "{name}: {words}");
        }
        let [shape, species] = match deviations.largest {
            Some((shape, species)) => [shape, species].map(|d| format!("{d:.2e}")),
            None => ["-", "-"].map(str::to_owned),
        };
        let counts = [
            work.steps,
            work.iterations,
            work.newton_iterations,
            work.evaluations(),
            work.factorisations,
        ];
        let mut row = vec![
            name.clone(),
            shape,
            species,
            deviations.diverged.map_or("-".into(), |by| format!("t = {}", label(by.time))),
            format!("{:.5e}", measures.energy),
            format!("{:.4}", measures.amplitude),
            measures.spots.to_string(),
            measures.nearest.map_or("-".into(), |d| format!("{d:.2}")),
            format!("{:.2}", ran.seconds()),
        ];
        row.extend(counts.map(|count| count.to_string()));
        rows.push(row);
    }
    if diverged {
        let _ = writeln!(
            notes,
            "distances are the largest before two runs diverge, that is differ by more than {DIVERGED} of \
             their size; after that compare energy, amplitude, regions and distances of nearest centres"
        );
    }
    aligned(&rows) + &notes
}

/// Rows with the first column aligned to the left and all others to the right.
fn aligned(rows: &[Vec<String>]) -> String {
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let line = |row: &Vec<String>| {
        let pad = |k: usize| " ".repeat(widths[k] - row[k].chars().count());
        let mut text = row[0].clone() + &pad(0);
        for (k, cell) in row.iter().enumerate().skip(1) {
            let _ = write!(text, "  {}{cell}", pad(k));
        }
        text + "\n"
    };
    rows.iter().map(line).collect()
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// The member that the others are compared with: the first that ran.
fn reference(members: &[Member]) -> Option<(&str, &MemberRun)> {
    members.iter().find_map(|m| Some((m.name.as_str(), m.outcome.as_ref().ok()?)))
}

/// Where two runs part, by what, and what that is measured against.
fn in_words(diverged: &Distance, ran: &MemberRun, first: &str) -> String {
    let (species, by) = diverged.worst();
    let share = match by.relative() {
        share if share < 10.0 => format!("{:.0} %", 100.0 * share),
        share => format!("{} times", label(share.round())),
    };
    let named = species.map(|k| ran.species.get(k).map_or("species", String::as_str));
    let (what, against) = match named {
        Some(name) => (name, format!("the {name} there")),
        None => ("shape", "the displacement there".to_owned()),
    };
    let [distance, size] = [by.distance, by.size].map(label);
    format!(
        "at t = {} its {what} is {distance} away from that of {first}, {share} of {against} \
         ({size}), root mean squares",
        label(diverged.time)
    )
}

/// Every output time of every member, in its last row with the work of its steps; what has no value is empty.
pub(crate) fn csv(members: &[Member]) -> String {
    let head = "member,time,shape distance,species distance,energy [energy],amplitude [length],spots,\
                share,separation d [length],nearest centres [length],wall [s],evaluations";
    let head = head.split(',').map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![head.chain(work_titles(&[])).collect()];
    for Member { name, outcome } in members {
        let (Ok(ran), Some((_, reference))) = (outcome, reference(members)) else { continue };
        let course = ran.deviations(reference).course;
        for m in &ran.measures {
            let same = course.iter().find(|d| d.time == m.time);
            let [shape, species] =
                [Distance::of_shape, Distance::of_species].map(|of| same.map(of));
            let values = [Some(m.time), shape, species, Some(m.energy), Some(m.amplitude)];
            let last = ran.measures.last().is_some_and(|last| last.time == m.time);
            let work = last.then(|| ran.work());
            let row = once(name.clone()).chain(values.map(number));
            let row = row.chain(once(m.spots.to_string()));
            let row = row.chain([Some(m.share), m.separation, m.nearest].map(number));
            let row = row.chain(once(number(work.map(|_| ran.seconds()))));
            let evaluations = work.map_or(String::new(), |w| w.evaluations().to_string());
            rows.push(row.chain(once(evaluations)).chain(work_cells(work, &[])).collect());
        }
    }
    csv_table(&rows)
}
