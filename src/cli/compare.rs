//! `rumple compare SCENE`: the same scene under several policies and integrators.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;

use super::SceneArgs;
use crate::kinetics::Search;
use crate::output::{Interrupt, Mode, Progress, ResultDirectory, atomic};
use crate::scene::Scene;
use crate::simulation::compare::{Member, PARTED, Timescales, contact_sheet, figure, member};
use crate::simulation::prepare;
use crate::{Error, Result};

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Policies, as in `quasi-static,simultaneous`; without it, that of the scene.
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    policies: Vec<String>,
    /// An integrator: a name, or a table as in `{ kind = "monolithic", method = "tr-bdf2" }`; may
    /// be repeated. Without it, that of the scene.
    #[arg(long = "integrator", value_name = "NAME|TABLE")]
    integrators: Vec<String>,
    /// Directory for the results, one folder a member; by default the scene's name with the time.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier comparison in that directory.
    #[arg(long)]
    force: bool,
    /// Print the table alone.
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &CompareArgs) -> Result<()> {
    let (_, search) = args.scene.load()?;
    announce(args, &search)?;
    let stamp = || ResultDirectory::default_path(&args.scene.scene, SystemTime::now());
    let root = args.out.clone().unwrap_or_else(stamp);
    let interrupt = Interrupt::install()?;
    let one = |list: &[String]| -> Vec<Option<String>> {
        if list.is_empty() { vec![None] } else { list.iter().cloned().map(Some).collect() }
    };
    let mut members: Vec<Member> = Vec::new();
    for policy in one(&args.policies) {
        for integrator in one(&args.integrators) {
            let mut overrides = args.scene.overrides.clone();
            if let Some(policy) = &policy {
                overrides.push(format!("time.policy={}", quoted(policy)));
            }
            if let Some(integrator) = &integrator {
                overrides.push(format!("time.integrator={}", quoted(integrator)));
            }
            // A name that nothing has ends the comparison, a pairing that makes no sense does not.
            let scene = Scene::load(&args.scene.scene, &overrides)?;
            let mut name =
                format!("{}, {}", scene.time.policy.name(), scene.time.integrator.name());
            if let Some(table) = integrator.as_ref().filter(|i| i.trim_start().starts_with('{')) {
                name += &settings(table);
            }
            let folder = root.join(folder(&name, members.len()));
            let mode = if args.quiet { Mode::Silent } else { Mode::detect() };
            let mut progress = Progress::new(mode, 0.0, scene.time.span.until.get());
            progress.message(&name);
            let outcome = member(&scene, &search, &folder, args.force, &mut progress, interrupt);
            progress.finish();
            if interrupt.requested() {
                // What is done stays, with its files.
                print!("{}", table(&members));
                return Err(Error::Solve(crate::solve::SolveError::Interrupted));
            }
            if let Err(error @ Error::Output(_)) = outcome {
                return Err(error);
            }
            members.push(Member { name, outcome });
            write(&root, &members)?;
        }
    }
    print!("{}", table(&members));
    println!(
        "{}: compare.csv has every output time, compare.svg and compare.png the plots, pictures.png \
         the shapes side by side",
        root.display()
    );
    Ok(())
}

/// Prints the timescales at the start, whatever the scene's own pairing.
fn announce(args: &CompareArgs, search: &Search) -> Result<()> {
    let mut overrides = args.scene.overrides.clone();
    let plain = [r#"time.policy="quasi-static""#, r#"time.integrator="staggered""#];
    overrides.extend(plain.map(str::to_owned));
    let mut setup = prepare(&Scene::load(&args.scene.scene, &overrides)?, search)?;
    setup.system.relax(&mut setup.state)?;
    match Timescales::of(&mut setup) {
        Ok(Some(timescales)) => println!("{}", timescales.verdict()),
        Ok(None) => {}
        Err(error) => println!("the timescales are not known: {error}"),
    }
    Ok(())
}

/// Writes numbers, plots and pictures.
fn write(root: &Path, members: &[Member]) -> Result<()> {
    let figure = figure(members);
    let files = [
        ("compare.csv", csv(members).into_bytes()),
        ("compare.svg", figure.svg()?.into_bytes()),
        ("compare.png", figure.picture()?.png()?),
        ("pictures.png", contact_sheet(members)?.png()?),
    ];
    for (name, bytes) in files {
        atomic::replace(&root.join(name), |writer| writer.write_all(&bytes))?;
    }
    Ok(())
}

/// What of a table for an integrator its name does not say, as in `, rtol = 1e-4`.
fn settings(table: &str) -> String {
    let inner = table.trim().trim_start_matches('{').trim_end_matches('}');
    let said = ["kind", "method", "chemistry"];
    let rest = inner.split(',').filter(|pair| {
        let key = pair.split('=').next().unwrap_or_default().trim();
        !key.is_empty() && !said.contains(&key)
    });
    rest.map(|pair| {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        format!(", {} = {}", key.trim(), value.trim())
    })
    .collect()
}

/// A name in quotes; a table as it is.
fn quoted(value: &str) -> String {
    let table = value.trim_start().starts_with(['{', '"']);
    if table { value.to_owned() } else { format!("\"{value}\"") }
}

fn folder(name: &str, number: usize) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|word| !word.is_empty()).collect();
    format!("{}-{}", number + 1, words.join("-").to_lowercase())
}

/// Every member's distance from the first that ran as far as they are on one branch, its last
/// measures, and its cost.
fn table(members: &[Member]) -> String {
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
                rows.push([
                    member.name.clone(),
                    format!("{:.2e}", apart.largest.0),
                    format!("{:.2e}", apart.largest.1),
                    apart.parted.map_or("-".into(), |time| format!("t = {time}")),
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

fn csv(members: &[Member]) -> String {
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
                member.name, m.time, m.energy, m.amplitude, m.spots, m.separation
            );
        }
    }
    text
}
