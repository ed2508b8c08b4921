//! Plugins in processes of their own: the same bits, and faults that end there.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use rumple::kinetics::{
    Batch, Column, Feedback, IsolatedLibrary, Isolation, Kinetics, KineticsError, Location,
    Outcome, Quantity, field,
};

use super::build::{SHIPPED, directory, library, map, misbehaving};
use crate::run::program;

fn isolation() -> Isolation {
    Isolation::by(program(), Duration::from_secs(20))
}

const COUNT: usize = 3000;

/// All that a law gives at some points, bit by bit.
fn all(law: &dyn Kinetics, parameters: &[Column<'_>]) -> Vec<u64> {
    let d = law.descriptor();
    let (species, inputs) = (d.species.len(), d.inputs());
    let value = |k: usize, column: usize| {
        let share = (rumple::num::real(k * 7 + column) * 0.618_033_988_749_894_9).fract();
        0.05 + 0.4 * share
    };
    let columns: Vec<Vec<f64>> =
        (0..inputs).map(|c| (0..COUNT).map(|k| value(k, c)).collect()).collect();
    let columns: Vec<Column<'_>> = columns.iter().map(Into::into).collect();
    let (species_columns, signals) = columns.split_at(species);
    let (location, first) = (Location::Vertex, 7);
    let batch =
        Batch { location, first, count: COUNT, species: species_columns, signals, parameters };
    let still = Batch { signals: &[], ..batch };
    let mut out = field::Columns::new(2 * species + species * inputs + 2 + species, COUNT);
    let mut slices = out.slices_mut();
    let (rates, rest) = slices.split_at_mut(species);
    field::evaluate(law, Quantity::Rates, &batch, rates, &mut []).unwrap();
    let (rates, rest) = rest.split_at_mut(species);
    let (partials, rest) = rest.split_at_mut(species * inputs);
    field::evaluate(law, Quantity::Rates, &batch, rates, partials).unwrap();
    field::evaluate(law, Feedback::LengthFactor.into(), &still, &mut rest[..1], &mut []).unwrap();
    let (factor, partials) = rest[1..].split_at_mut(1);
    field::evaluate(law, Feedback::LengthFactor.into(), &still, &mut factor[..1], partials)
        .unwrap();
    out.into_inner().iter().map(|value| value.to_bits()).collect()
}

#[test]
fn laws_give_the_same_bits_in_a_process_of_their_own() {
    for name in SHIPPED {
        let here = library(name);
        let apart = IsolatedLibrary::load(here.path(), &isolation()).unwrap();
        assert_eq!(here.descriptor(), apart.descriptor(), "{name}");
        let none = BTreeMap::new();
        let (here, apart) = (here.instantiate(&none).unwrap(), apart.instantiate(&none).unwrap());
        assert_eq!(here.parameters(), apart.parameters());
        assert_eq!(all(&here, &[]), all(&apart, &[]), "{name}");
        // Parameters over the sheet, one of which varies.
        let values = here.parameters().to_vec();
        if values.is_empty() {
            continue;
        }
        let varying: Vec<f64> =
            (0..COUNT).map(|k| values[0] * (1.0 + 1e-3 * rumple::num::real(k / 500))).collect();
        let mut columns: Vec<Column<'_>> = values.iter().map(Column::uniform).collect();
        columns[0] = (&varying).into();
        assert_eq!(all(&here, &columns), all(&apart, &columns), "{name}");
    }
}

fn evaluate(law: &dyn Kinetics) -> Outcome {
    let mut c = vec![0.25; COUNT];
    c[2500] = 0.75;
    let batch = Batch {
        location: Location::Vertex,
        first: 100,
        count: COUNT,
        species: &[(&c).into()],
        signals: &[Column::uniform(&0.125)],
        parameters: &[],
    };
    field::evaluate(law, Quantity::Rates, &batch, &mut [&mut vec![0.0; COUNT]], &mut [])
}

#[test]
fn what_a_law_reports_is_the_same() {
    let here = misbehaving();
    let apart = IsolatedLibrary::load(here.path(), &isolation()).unwrap();
    for fault in [10.0, 11.0, 13.0, 14.0, 15.0, 16.0, 17.0] {
        let given = map(&[("fault", fault)]);
        let here = evaluate(&here.instantiate(&given).unwrap());
        let apart = evaluate(&apart.instantiate(&given).unwrap());
        assert_eq!(format!("{here:?}"), format!("{apart:?}"));
    }
    for fault in [1.0, 2.0, 3.0] {
        let given = map(&[("fault", fault)]);
        let here = here.instantiate(&given).unwrap_err();
        let apart = apart.instantiate(&given).unwrap_err();
        assert_eq!(here.to_string(), apart.to_string());
    }
}

#[test]
fn what_is_no_plugin_is_refused_in_words() {
    let place = tempfile::tempdir().unwrap();
    let text = place.path().join("libtext.so");
    fs::write(&text, "not a library").unwrap();
    let error = IsolatedLibrary::load(&text, &isolation()).unwrap_err().to_string();
    assert!(error.contains("cannot be loaded as a shared library"), "{error}");
    // A program that serves no plugins, and none at all.
    let curvature = library("curvature-feedback").path().to_owned();
    for (program, message) in [("/bin/true", "exits with status 0"), ("/none", "no process can be")]
    {
        let isolation = Isolation::by(program.into(), Duration::from_secs(5));
        let error = IsolatedLibrary::load(&curvature, &isolation).unwrap_err();
        assert!(matches!(error, KineticsError::Isolated(_)));
        assert!(error.to_string().contains(message), "{error}");
    }
    // This one does not begin as it must.
    let error = Isolation::here(Duration::from_secs(5)).unwrap_err().to_string();
    assert!(error.contains("serve_if_asked"), "{error}");
}

#[test]
fn a_run_has_the_same_bits() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/model-i/small.toml");
    let place = tempfile::tempdir().unwrap();
    let run = |out: &str, more: &[&str]| {
        let mut command = Command::new(program());
        command.current_dir(place.path()).arg("run").arg(&scene).args(["--out", out]);
        command.args(["--quiet", "--set", "time.until=0.05", "--set", "output.every=0.05"]);
        command.arg("--plugin-path").arg(directory()).args(more);
        let out = command.output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    };
    run("here", &[]);
    run("apart", &["--isolate"]);
    let frames = |out: &str| {
        let files = fs::read_dir(place.path().join(out).join("frames")).unwrap();
        let mut files: Vec<_> = files.map(|file| file.unwrap().path()).collect();
        files.sort();
        files.iter().map(|file| fs::read(file).unwrap()).collect::<Vec<_>>()
    };
    assert!(frames("here").len() > 1);
    assert!(frames("here") == frames("apart"), "frames differ");
}
