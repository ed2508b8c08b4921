//! `rumple compare SCENE`: the same scene under several policies and integrators.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;

use super::SceneArgs;
use crate::output::{Interrupt, Mode, Progress, ResultDirectory, atomic};
use crate::scene::Scene;
use crate::simulation::compare::{Member, Timescales, distance, member};
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
    let rest = {
        // The start, whatever the scene's own pairing.
        let mut overrides = args.scene.overrides.clone();
        let plain = [r#"time.policy="quasi-static""#, r#"time.integrator="staggered""#];
        overrides.extend(plain.map(str::to_owned));
        let mut setup = prepare(&Scene::load(&args.scene.scene, &overrides)?, &search)?;
        setup.system.relax(&mut setup.state)?;
        match Timescales::of(&mut setup) {
            Ok(Some(timescales)) => println!("{}", timescales.verdict()),
            Ok(None) => {}
            Err(error) => println!("the timescales are not known: {error}"),
        }
        setup.sheet.rest().to_vec()
    };
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
            let name = format!("{}, {}", scene.time.policy.name(), scene.time.integrator.name());
            let folder = root.join(folder(&name, members.len()));
            let mode = if args.quiet { Mode::Silent } else { Mode::detect() };
            let mut progress = Progress::new(mode, 0.0, scene.time.span.until.get());
            progress.message(&name);
            let outcome = member(&scene, &search, &folder, args.force, &mut progress, interrupt);
            progress.finish();
            if interrupt.requested() {
                return Err(Error::Solve(crate::solve::SolveError::Interrupted));
            }
            if let Err(error @ Error::Output(_)) = outcome {
                return Err(error);
            }
            members.push(Member { name, outcome });
        }
    }
    print!("{}", table(&members, &rest));
    let path = root.join("compare.csv");
    let text = csv(&members, &rest);
    atomic::replace(&path, |writer| writer.write_all(text.as_bytes()))?;
    println!("every output time is in {}", path.display());
    Ok(())
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

/// The last state of every member, its distance from the first that ran, and its cost.
fn table(members: &[Member], rest: &[crate::Vec3]) -> String {
    let mut rows = vec![
        [
            "",
            "distance",
            "",
            "energy",
            "amplitude",
            "spots",
            "separation",
            "s",
            "steps",
            "its",
            "factors",
        ]
        .map(str::to_owned),
        ["", "shape", "species", "", "", "", "", "", "", "", ""].map(str::to_owned),
    ];
    let reference = members.iter().find_map(|m| m.outcome.as_ref().ok());
    let mut failures = String::new();
    for member in members {
        match (&member.outcome, reference) {
            (Ok(ran), Some(reference)) => {
                let (Some(last), Some(first), Some(measures)) =
                    (ran.states.last(), reference.states.last(), ran.measures.last())
                else {
                    continue;
                };
                let (shape, species) = distance(last, first, rest, &ran.typical);
                let seconds = ran.summary.wall - ran.summary.output - ran.summary.start;
                rows.push([
                    member.name.clone(),
                    format!("{shape:.2e}"),
                    format!("{species:.2e}"),
                    format!("{:.5e}", measures.energy),
                    format!("{:.4}", measures.amplitude),
                    measures.spots.to_string(),
                    format!("{:.2}", measures.separation),
                    format!("{:.2}", seconds.as_secs_f64()),
                    ran.summary.steps.to_string(),
                    ran.summary.iterations.to_string(),
                    ran.summary.factorisations.to_string(),
                ]);
            }
            (Err(error), _) => {
                let _ = writeln!(failures, "{}: {}", member.name, plain(error));
            }
            (Ok(_), None) => {}
        }
    }
    let widths: Vec<usize> =
        (0..11).map(|k| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(width - cell.chars().count());
            let _ =
                if k == 0 { write!(text, "{cell}{pad}") } else { write!(text, "  {pad}{cell}") };
        }
        text.push('\n');
    }
    text + &failures
}

fn plain(error: &Error) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

fn csv(members: &[Member], rest: &[crate::Vec3]) -> String {
    let mut text = String::from(
        "member,time,shape distance,species distance,energy [energy],amplitude [length],spots,\
         separation [length]\n",
    );
    let reference = members.iter().find_map(|m| m.outcome.as_ref().ok());
    for member in members {
        let (Ok(ran), Some(reference)) = (&member.outcome, reference) else { continue };
        for (state, m) in ran.states.iter().zip(&ran.measures) {
            let same = reference.states.iter().find(|r| r.time == state.time);
            let (shape, species) =
                same.map_or((f64::NAN, f64::NAN), |r| distance(state, r, rest, &ran.typical));
            let _ = writeln!(
                text,
                "\"{}\",{},{shape},{species},{},{},{},{}",
                member.name, m.time, m.energy, m.amplitude, m.spots, m.separation
            );
        }
    }
    text
}
