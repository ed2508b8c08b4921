//! `rumple plugin list` and `rumple plugin describe`.

use clap::Args;
use serde_json::json;

use super::{LawArgs, LawSource, SearchArgs};
use crate::Result;
use crate::cli::Findings;
use crate::kinetics::descriptor::Default;
use crate::kinetics::{Descriptor, Feedback, Library, SignalRead, Species};

/// Arguments of `plugin describe`.
#[derive(Debug, Args)]
pub(super) struct DescribeArgs {
    #[command(flatten)]
    law: LawArgs,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

/// Arguments of `plugin list`.
#[derive(Debug, Args)]
pub(super) struct ListArgs {
    #[command(flatten)]
    search: SearchArgs,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn list(args: &ListArgs) -> Result<()> {
    let search = args.search.search();
    let plugins = search.list();
    let mut found = Findings::new(0);
    for (name, file) in &plugins {
        match Library::load(file) {
            Ok(library) => {
                let Descriptor { version, doc, .. } = library.descriptor();
                found.line(format!("{name:<20} {version:<8} {doc}"));
                let about = json!({ "name": name, "file": file, "version": version, "doc": doc });
                found.add("plugins", about);
            }
            Err(error) => {
                found.line(format!("{name:<20} refused  {error}"));
                let about = json!({ "name": name, "file": file, "refused": error.to_string() });
                found.add("plugins", about);
            }
        }
    }
    if plugins.is_empty() {
        found.line("no plugins");
    }
    found.line("\nlooked in:");
    for directory in search.directories() {
        found.line(format!("  {}", directory.display()));
        found.add("directories", json!(directory));
    }
    found.print(args.json);
    Ok(())
}

pub(super) fn run(args: &DescribeArgs) -> Result<()> {
    let mut found = Findings::new(12);
    match args.law.find()? {
        LawSource::Library(library) => {
            found.one("file", library.path().display());
            let d = library.descriptor();
            describe(&mut found, d, &|p| match d.parameters[p].default {
                Default::Value(value) => value.to_string(),
                Default::SameAs(earlier) => d.parameters[earlier].name.clone(),
            });
        }
        LawSource::Scene { kinetics, fields } => {
            describe(&mut found, kinetics.descriptor(), &|p| match fields
                .get(p)
                .map_or(&[][..], Vec::as_slice)
            {
                [] => kinetics.parameters()[p].to_string(),
                [one] => one.to_string(),
                field => describe_field(field),
            });
        }
    }
    found.print(args.json);
    Ok(())
}

/// The least and the greatest value of a parameter that differs from place to place.
pub(in crate::cli) fn describe_field(field: &[f64]) -> String {
    let least = field.iter().copied().fold(f64::INFINITY, f64::min);
    let most = field.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!("{least} to {most} over the sheet")
}

/// Adds a description; `value` says what each parameter is.
fn describe(found: &mut Findings, d: &Descriptor, value: &dyn Fn(usize) -> String) {
    found.one("name", format!("{} {} ({})", d.name, d.version, d.id));
    for (what, text) in [("author", &d.author), ("licence", &d.licence), ("doc", &d.doc)] {
        if !text.is_empty() {
            found.one(what, text);
        }
    }
    d.species.iter().for_each(|species| describe_species(found, species));
    for (number, p) in d.parameters.iter().enumerate() {
        let doc = if p.doc.is_empty() { String::new() } else { format!(" {}", p.doc) };
        let (value, range) = (value(number), p.range().to_string());
        let text = format!("{} = {value} [{}]{doc} ({range})", p.name, p.unit);
        let about =
            json!({ "name": p.name, "value": value, "unit": p.unit, "doc": p.doc, "range": range });
        found.each("parameter", text, about);
    }
    for SignalRead { signal, typical, .. } in &d.signals {
        let (name, unit) = (signal.name(), signal.unit());
        let about = json!({ "name": name, "unit": unit, "typical": typical });
        found.each("reads", format!("{name} [{unit}], typically {typical}"), about);
    }
    let more = |read: &&SignalRead| !d.signals.iter().any(|s| s.signal == read.signal);
    for SignalRead { signal, .. } in d.observed.iter().filter(more) {
        let (name, unit) = (signal.name(), signal.unit());
        let about = json!({ "name": name, "unit": unit, "observables": true });
        found.each("reads", format!("{name} [{unit}], for observables"), about);
    }
    let mut gives = |text: String| found.each("gives", &text, text.as_str());
    let exact =
        |exact: bool| if exact { "exact derivatives" } else { "derivatives by differences" };
    gives(format!("rates, {}", exact(d.capabilities.rate_partials)));
    for which in Feedback::ALL.into_iter().filter(|which| which.is_given(&d.capabilities)) {
        let name = which.describe().trim_start_matches("the ");
        match which {
            Feedback::LengthFactor => {
                gives(format!("{name}, {}", exact(d.capabilities.length_factor_partials)));
            }
            Feedback::Curvature | Feedback::FactorAcross => gives(name.to_owned()),
        }
    }
    d.observables
        .iter()
        .for_each(|o| gives(format!("observable {} [{}] {}", o.name, o.unit, o.doc)));
    if !d.capabilities.parameter_fields && !d.parameters.is_empty() {
        found.one("fields", "non-uniform parameters need an instance for each value");
    }
}

fn describe_species(found: &mut Findings, s: &Species) {
    let range = match (s.lower.is_finite(), s.upper.is_finite()) {
        (true, true) => format!(", {} to {}", s.lower, s.upper),
        (true, false) => format!(", from {}", s.lower),
        (false, true) => format!(", up to {}", s.upper),
        (false, false) => String::new(),
    };
    let typical = s.typical.map_or(String::new(), |typical| format!(", typically {typical}"));
    let diffusion =
        if s.diffusion > 0.0 { format!(", D = {}", s.diffusion) } else { String::new() };
    let (Species { name, unit, doc, .. }, place) = (s, s.location.nouns());
    let about = json!({
        "name": name, "unit": unit, "doc": doc, "typical": s.typical, "lower": s.lower, "upper": s.upper,
        "diffusion": s.diffusion, "location": place,
    });
    let text = format!("{name} [{unit}] {doc}{typical}{range}{diffusion}, on {place}");
    found.each("species", text, about);
}
