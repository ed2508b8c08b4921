//! `rumple plugin list` and `rumple plugin describe`.

use clap::Args;

use super::{LawArgs, LawSource};
use crate::Result;
use crate::kinetics::descriptor::Default;
use crate::kinetics::{Descriptor, Feedback, Library, PluginSearch, SignalRead};

/// Arguments of `plugin describe`.
#[derive(Debug, Args)]
pub(super) struct DescribeArgs {
    #[command(flatten)]
    law: LawArgs,
}

pub(super) fn list(search: &PluginSearch) -> Result<()> {
    let found = search.list();
    for (name, file) in &found {
        match Library::load(file) {
            Ok(library) => {
                let d = library.descriptor();
                say!("{name:<20} {:<8} {}", d.version, d.doc);
            }
            Err(error) => say!("{name:<20} refused  {error}"),
        }
    }
    if found.is_empty() {
        say!("no plugins");
    }
    say!("\nlooked in:");
    for directory in search.directories() {
        say!("  {}", directory.display());
    }
    Ok(())
}

pub(super) fn run(args: &DescribeArgs) -> Result<()> {
    match args.law.find()? {
        LawSource::Library(library) => {
            say!("file        {}", library.path().display());
            describe(library.descriptor(), &|p| match library.descriptor().parameters[p].default {
                Default::Value(value) => value.to_string(),
                Default::SameAs(earlier) => library.descriptor().parameters[earlier].name.clone(),
            });
        }
        LawSource::Scene { kinetics, fields } => {
            describe(
                kinetics.descriptor(),
                &|p| match fields.get(p).map_or(&[][..], Vec::as_slice) {
                    [] => kinetics.parameters()[p].to_string(),
                    [one] => one.to_string(),
                    field => describe_field(field),
                },
            );
        }
    }
    Ok(())
}

/// The least and the greatest value of a parameter that differs from place to place.
pub(in crate::cli) fn describe_field(field: &[f64]) -> String {
    let least = field.iter().copied().fold(f64::INFINITY, f64::min);
    let most = field.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!("{least} to {most} over the sheet")
}

/// Prints a description; `value` says what each parameter is.
fn describe(d: &Descriptor, value: &dyn Fn(usize) -> String) {
    say!("name        {} {} ({})", d.name, d.version, d.id);
    for (what, text) in [("author", &d.author), ("licence", &d.licence), ("doc", &d.doc)] {
        if !text.is_empty() {
            say!("{what:<11} {text}");
        }
    }
    for s in &d.species {
        let range = match (s.lower.is_finite(), s.upper.is_finite()) {
            (true, true) => format!(", {} to {}", s.lower, s.upper),
            (true, false) => format!(", from {}", s.lower),
            (false, true) => format!(", up to {}", s.upper),
            (false, false) => String::new(),
        };
        let typical = s.typical.map_or(String::new(), |typical| format!(", typically {typical}"));
        let diffusion =
            if s.diffusion > 0.0 { format!(", D = {}", s.diffusion) } else { String::new() };
        say!(
            "species     {} [{}] {}{typical}{range}{diffusion}, on {}",
            s.name,
            s.unit,
            s.doc,
            s.location.nouns()
        );
    }
    for (number, p) in d.parameters.iter().enumerate() {
        let doc = if p.doc.is_empty() { String::new() } else { format!(" {}", p.doc) };
        say!("parameter   {} = {} [{}]{doc} ({})", p.name, value(number), p.unit, p.range());
    }
    for read in &d.signals {
        say!(
            "reads       {} [{}], typically {}",
            read.signal.name(),
            read.signal.unit(),
            read.typical
        );
    }
    let more = |read: &&SignalRead| !d.signals.iter().any(|s| s.signal == read.signal);
    for read in d.observed.iter().filter(more) {
        say!("reads       {} [{}], for observables", read.signal.name(), read.signal.unit());
    }
    let exact =
        |exact: bool| if exact { "exact derivatives" } else { "derivatives by differences" };
    say!("gives       rates, {}", exact(d.capabilities.rate_partials));
    for which in Feedback::ALL.into_iter().filter(|which| which.is_given(&d.capabilities)) {
        let name = which.describe().trim_start_matches("the ");
        match which {
            Feedback::LengthFactor => {
                say!("gives       {name}, {}", exact(d.capabilities.length_factor_partials));
            }
            Feedback::Curvature | Feedback::FactorAcross => say!("gives       {name}"),
        }
    }
    for o in &d.observables {
        say!("gives       observable {} [{}] {}", o.name, o.unit, o.doc);
    }
    if !d.capabilities.parameter_fields && !d.parameters.is_empty() {
        say!("fields      non-uniform parameters need an instance for each value");
    }
}
