//! `rumple plugin validate`: all checks of a law.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use clap::Args;
use serde_json::json;

use super::{LawArgs, LawSource};
use crate::cli::Findings;
use crate::kinetics::Kinetics;
use crate::kinetics::validation::{self, Finding, Verdict};
use crate::num::plural;
use crate::{Error, Result};

/// Arguments of `plugin validate`.
#[derive(Debug, Args)]
pub(super) struct ValidateArgs {
    #[command(flatten)]
    law: LawArgs,
    /// Seed of the inputs: another one tries other points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print what is found as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &ValidateArgs) -> Result<()> {
    let (seed, name) = (args.seed, &args.law.law);
    if !args.json {
        say!("validating {name} at random points of its ranges (--seed {seed})");
    }
    let (law, fields): (Arc<dyn Kinetics>, _) = match args.law.find()? {
        LawSource::Library(library) => {
            (Arc::new(library.instantiate(&BTreeMap::new())?), Vec::new())
        }
        LawSource::Scene { kinetics, fields } => (kinetics, fields),
    };
    let (mut document, mut faults) = (Findings::default(), 0);
    document.set("law", name.as_str());
    document.set("seed", seed);
    // The name of a check is printed before it begins: a law that ends the process, or does not return, ends the list there.
    let mut begin = |check: &'static str| {
        if !args.json {
            let mut out = std::io::stdout().lock();
            let _ = write!(out, "  {check:<32} ").and_then(|()| out.flush());
        }
    };
    let mut end = |Finding { check, verdict }| {
        let (verdict, text) = match verdict {
            Verdict::Good(text) => ("ok", text),
            Verdict::Skipped(text) => ("-", text),
            Verdict::Fault(text) => ("FAULT", text),
        };
        faults += usize::from(verdict == "FAULT");
        if !args.json {
            say!("{verdict:<6} {text}");
        }
        document.add("checks", json!({ "check": check, "verdict": verdict, "text": text }));
    };
    validation::validate(&*law, &fields, seed, &mut begin, &mut end);
    document.set("faults", faults);
    if args.json {
        document.print(true);
    }
    match faults {
        0 if args.json => Ok(()),
        0 => {
            say!("no faults found");
            Ok(())
        }
        n => {
            let found = plural(n, "fault", "faults");
            let again = format!("--seed {seed} gives the same inputs again");
            Err(Error::Refused(format!("{name} has {found} ({again})")))
        }
    }
}
