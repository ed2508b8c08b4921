//! `rumple plugin list` and `rumple plugin describe`.

use clap::Args;

use super::{Found, LawArgs};
use crate::Result;
use crate::kinetics::descriptor::Default;
use crate::kinetics::{Descriptor, Library, Search};

/// Arguments of `plugin describe`.
#[derive(Debug, Args)]
pub(super) struct DescribeArgs {
    #[command(flatten)]
    law: LawArgs,
}

pub(super) fn list(search: &Search) -> Result<()> {
    let found = search.list();
    for (name, file) in &found {
        match Library::load(file) {
            Ok(library) => {
                let d = library.descriptor();
                println!("{name:<20} {:<8} {}", d.version, d.doc);
            }
            Err(error) => println!("{name:<20} refused  {error}"),
        }
    }
    if found.is_empty() {
        println!("no plugins");
    }
    println!("\nlooked in:");
    for directory in search.directories() {
        println!("  {}", directory.display());
    }
    Ok(())
}

pub(super) fn run(args: &DescribeArgs) -> Result<()> {
    match args.law.find()? {
        Found::Library(library) => {
            println!("file        {}", library.path().display());
            describe(library.descriptor());
        }
        Found::Scene(kinetics) => describe(kinetics.descriptor()),
    }
    Ok(())
}

fn describe(d: &Descriptor) {
    println!("name        {} {} ({})", d.name, d.version, d.id);
    for (what, text) in [("author", &d.author), ("licence", &d.licence), ("doc", &d.doc)] {
        if !text.is_empty() {
            println!("{what:<11} {text}");
        }
    }
    for s in &d.species {
        let range = match (s.lower.is_finite(), s.upper.is_finite()) {
            (true, true) => format!(", {} to {}", s.lower, s.upper),
            (true, false) => format!(", from {}", s.lower),
            (false, true) => format!(", up to {}", s.upper),
            (false, false) => String::new(),
        };
        let diffusion =
            if s.diffusion > 0.0 { format!(", D = {}", s.diffusion) } else { String::new() };
        println!(
            "species     {} [{}] {}, typically {}{range}{diffusion}, on {}",
            s.name,
            s.unit,
            s.doc,
            s.typical,
            s.location.nouns()
        );
    }
    for p in &d.parameters {
        let default = match p.default {
            Default::Value(value) => value.to_string(),
            Default::SameAs(earlier) => d.parameters[earlier].name.clone(),
        };
        println!("parameter   {} = {default} [{}] {} ({})", p.name, p.unit, p.doc, p.range());
    }
    for read in &d.signals {
        println!(
            "reads       {} [{}], typically {}",
            read.signal.name(),
            read.signal.unit(),
            read.typical
        );
    }
    let exact =
        |exact: bool| if exact { "exact derivatives" } else { "derivatives by differences" };
    println!("gives       rates, {}", exact(d.capabilities.rate_partials));
    if d.capabilities.length_factor {
        println!("gives       length factor, {}", exact(d.capabilities.length_factor_partials));
    }
    for o in &d.observables {
        println!("gives       observable {} [{}] {}", o.name, o.unit, o.doc);
    }
    if !d.capabilities.parameter_fields && !d.parameters.is_empty() {
        println!("fields      parameters that differ from place to place cost an instance each");
    }
}
