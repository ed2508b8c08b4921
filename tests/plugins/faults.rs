//! Whatever a plugin does wrong ends in a message that names it, never in a crash.

use std::fs;
use std::path::{Path, PathBuf};

use rumple::kinetics::{
    Batch, Column, Feedback, Kinetics, KineticsError, Library, Location, Outcome, PluginKinetics,
    PluginSearch, Quantity, field,
};

use super::build::{c_library, map, misbehaving};

fn refusal(path: &Path) -> String {
    Library::load(path).unwrap_err().to_string()
}

#[test]
fn what_is_no_plugin_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let missing = place.path().join("libnone.so");
    assert!(refusal(&missing).contains("does not exist"));
    assert!(refusal(place.path()).contains("is a folder"));

    let text = place.path().join("libtext.so");
    fs::write(&text, "not a library").unwrap();
    assert!(refusal(&text).contains("cannot be loaded as a shared library"));
    let empty = place.path().join("libempty.so");
    fs::write(&empty, "").unwrap();
    assert!(refusal(&empty).contains("cannot be loaded as a shared library"));
    // The name of the entry in a message, and in a table of symbols.
    fs::write(&text, "without rumple_plugin_entry, as the engine").unwrap();
    fs::write(&empty, "\0rumple_plugin_entry\0").unwrap();
    let listed = PluginSearch::in_directories(vec![place.path().to_owned()]).list();
    assert_eq!(listed, [("empty".to_owned(), empty)]);

    let plain = place.path().join("plain.c");
    fs::write(&plain, "int answer(void) { return 42; }").unwrap();
    let library = c_library(plain.to_str().unwrap(), "plain", &[]);
    let message = refusal(&library);
    assert!(message.contains("is a shared library but not a plugin"), "{message}");
    assert!(message.contains("rumple_plugin_entry"), "{message}");
}

fn table(name: &str, definitions: &[&str]) -> PathBuf {
    c_library("tests/faulty/table.c", &format!("table_{name}"), definitions)
}

#[test]
fn faulty_tables_and_descriptors_are_refused() {
    Library::load(&table("right", &[])).unwrap();
    let cases: &[(&str, &[&str], &str)] = &[
        ("magic", &["MAGIC={'F','U','M','P','L','E',26,10}"], "(magic)"),
        ("major", &["MAJOR=2"], "built for version 2.1 of the plugin boundary"),
        ("old", &["MAJOR=0"], "built for version 0.1 of the plugin boundary"),
        ("older", &["MINOR=0"], "this engine needs 1.1: rebuild it with the SDK or the header"),
        ("newer", &["MINOR=7"], "built for version 1.7 of the plugin boundary"),
        ("truncated", &["TABLE_SIZE=40"], "truncated table: 40 bytes"),
        ("null", &["DESCRIPTOR=NULL"], "descriptor: is null"),
        ("short", &["DESCRIPTOR_SIZE=16"], "descriptor: is truncated"),
        ("create", &["CREATE=NULL"], "function `create`: is null"),
        ("name", &["NAME={NULL,0}"], "name: is empty"),
        ("null_name", &["NAME={NULL,9}"], "name: the text is null"),
        ("long_name", &["NAME={(const uint8_t*)\"x\",(size_t)-5}"], "bytes long; expected at most"),
        ("utf8", &["NAME=RUMPLE_STR(\"\\xff\\xfe\")"], "name: the text is not UTF-8"),
        ("zero_species", &["SPECIES_COUNT=0"], "species: there are none"),
        ("count", &["SPECIES_COUNT=4000000000u"], "species: there are 4000000000"),
        ("null_species", &["SPECIES=NULL"], "species: the array is null"),
        ("stride", &["SPECIES_STRIDE=8"], "species: elements are 8 bytes apart"),
        ("twice", &["SPECIES_COUNT=2", "SECOND_NAME=\"c\""], "species `c`: is declared twice"),
        ("mixed", &["SPECIES_COUNT=2", "SECOND_LOCATION=1"], "expected one location"),
        ("nowhere", &["SPECIES_COUNT=2", "SECOND_LOCATION=9"], "location is 9"),
        ("spaces", &["SPECIES_NAME=\"c 1\""], "species `c 1`: is not a valid name"),
        ("signal_name", &["SPECIES_NAME=\"tension\""], "has the name of a signal"),
        ("typical", &["TYPICAL=-2.0"], "typical magnitude is -2"),
        ("default", &["DEFAULT=3.0"], "parameter `k`: default is 3; allowed: 0 <= k <= 2"),
        ("nan", &["DEFAULT=NAN"], "parameter `k`: default is NaN"),
        ("bounds", &["UPPER=-1.0"], "valid range is 0 to -1"),
        ("default_of", &["DEFAULT_OF=\"j\""], "defaults to `j`, which is not an earlier parameter"),
        ("signal", &["SIGNAL=\"shear\""], "no signal `shear`; expected one of mean_curvature"),
        ("nothing", &["CAPABILITIES=0"], "do not include rates"),
        ("unknown", &["CAPABILITIES=1|((uint64_t)1<<40)"], "cannot do"),
        ("claims", &["CAPABILITIES=3"], "function `rate_partials`: is null"),
    ];
    for (name, definitions, expected) in cases {
        let library = table(name, definitions);
        let message = refusal(&library);
        assert!(message.contains(expected), "{name}: {message}");
        assert!(message.contains(library.to_str().unwrap()), "{name}: {message}");
    }
}

#[test]
fn an_unknown_status_is_a_failure() {
    let library = Library::load(&table("status", &["STATUS=17"])).unwrap();
    let kinetics = library.instantiate(&map(&[])).unwrap();
    let error = evaluate(&kinetics, 3).unwrap_err().to_string();
    assert!(error.contains("plugin `table` failed in rates"), "{error}");
    assert!(error.contains("unknown status 17"), "{error}");
}

const COUNT: usize = 3000;
/// The one point with c > 0.5, in the last of three batches.
const CULPRIT: usize = 2500;

fn misbehave(fault: f64) -> PluginKinetics {
    misbehaving().instantiate(&map(&[("fault", fault)])).unwrap()
}

fn evaluate(kinetics: &dyn Kinetics, count: usize) -> Outcome {
    let mut c = vec![0.25; count];
    if let Some(c) = c.get_mut(CULPRIT) {
        *c = 0.75;
    }
    let batch = Batch {
        location: Location::Vertex,
        first: 100,
        count,
        species: &[(&c).into()],
        signals: &[Column::uniform(&0.125)],
        parameters: &[],
    };
    let mut rates = vec![0.0; count];
    field::evaluate(kinetics, Quantity::Rates, &batch, &mut [&mut rates], &mut [])
}

#[test]
fn failures_in_create_are_reported() {
    let create = |fault| {
        let error = misbehaving().instantiate(&map(&[("fault", fault)])).unwrap_err();
        error.to_string()
    };
    let panic = create(1.0);
    assert!(panic.contains("plugin `misbehaving` failed in create: panicked at"), "{panic}");
    assert!(panic.contains("misbehaving.rs:"), "{panic}");
    assert!(panic.contains("no luck in create"), "{panic}");
    assert!(create(2.0).contains("failed in create: these do not go together"));
    assert!(create(3.0).contains("asks for its parameter `flaut`, which it does not declare"));
}

#[test]
fn panics_and_errors_in_a_call_name_the_point() {
    let message = |fault| evaluate(&misbehave(fault), COUNT).unwrap_err().to_string();
    let panic = message(10.0);
    let place = "failed in rates at vertex 2600 (c = 0.75, mean_curvature = 0.125): ";
    assert!(panic.contains(&format!("{place}panicked at")), "{panic}");
    assert!(panic.contains("no luck with c = 0.75"), "{panic}");
    assert!(message(13.0).contains("index out of bounds"));
    assert!(message(14.0).contains(&format!("{place}out of range")));
}

#[test]
fn bad_numbers_name_species_point_and_inputs() {
    let error = evaluate(&misbehave(11.0), COUNT).unwrap_err();
    assert_eq!(
        error.to_string(),
        "plugin `misbehaving` returned NaN in rates for the rate of species c at vertex 2600 \
         (c = 0.75, mean_curvature = 0.125)"
    );
    let error = evaluate(&misbehave(12.0), COUNT).unwrap_err();
    assert!(error.to_string().contains("returned inf in rates for the rate"), "{error}");
}

#[test]
fn a_retry_carries_a_usable_factor() {
    let error = evaluate(&misbehave(15.0), COUNT).unwrap_err();
    let KineticsError::Retry { factor, point, message, .. } = &error else { panic!("{error}") };
    assert_eq!((*factor, message.as_str()), (0.25, "too fast"));
    let site = point.as_ref().unwrap();
    assert_eq!(site.to_string(), "vertex 2600 (c = 0.75, mean_curvature = 0.125)");
    // Nonsense as a factor, and a message longer than the buffer.
    let error = evaluate(&misbehave(16.0), COUNT).unwrap_err();
    let KineticsError::Retry { factor, message, .. } = &error else { panic!("{error}") };
    assert_eq!((*factor, message.as_str()), (0.5, "ü".repeat(512).as_str()));
}

#[test]
fn an_unreliable_result_is_a_warning() {
    let warning = evaluate(&misbehave(17.0), COUNT).unwrap().unwrap();
    assert_eq!((warning.message.as_str(), warning.point), ("extrapolated", Some(2600)));
}

#[test]
fn bad_derivatives_and_length_factors_are_refused() {
    // √(c - 0.75) has the value 0 at the culprit, but no derivative.
    let mut c = vec![0.25; COUNT];
    c[CULPRIT] = 0.75;
    let batch = Batch {
        location: Location::Face,
        first: 0,
        count: COUNT,
        species: &[(&c).into()],
        signals: &[Column::uniform(&0.0)],
        parameters: &[],
    };
    let mut rate = vec![0.0; COUNT];
    let mut partials = field::Columns::new(2, COUNT);
    let slices = &mut partials.slices_mut();
    let error =
        field::evaluate(&misbehave(18.0), Quantity::Rates, &batch, &mut [&mut rate], slices);
    let text = error.unwrap_err().to_string();
    let expected =
        "inf in rate_partials for the derivative by c of the rate of species c at face 2500";
    assert!(text.contains(expected), "{text}");

    let mut c = c.clone();
    c[CULPRIT] = 1.0;
    let batch = Batch { species: &[(&c).into()], signals: &[], ..batch };
    let error = field::evaluate(
        &misbehave(20.0),
        Feedback::LengthFactor.into(),
        &batch,
        &mut [&mut rate],
        &mut [],
    )
    .unwrap_err();
    let expected = "returned 0 in length_factor for the length factor at face 2500 (c = 1)";
    assert!(error.to_string().contains(expected), "{error}");
    let error = field::evaluate(
        &misbehave(21.0),
        Feedback::LengthFactor.into(),
        &batch,
        &mut [&mut rate],
        &mut [],
    )
    .unwrap_err();
    assert!(
        error.to_string().contains("failed in length_factor at face 0 (c = 0.25): panicked"),
        "{error}"
    );
}

#[test]
fn inputs_that_are_not_finite_are_not_blamed_on_the_plugin() {
    let kinetics = misbehave(0.0);
    let mut rates = vec![0.0; 3];
    let batch = Batch {
        location: Location::Vertex,
        first: 0,
        count: 3,
        species: &[Column::uniform(&0.0)],
        signals: &[[0.0, f64::NAN, 0.0].as_slice().into()],
        parameters: &[],
    };
    let error = field::evaluate(&kinetics, Quantity::Rates, &batch, &mut [&mut rates], &mut [])
        .unwrap_err();
    let expected = "mean_curvature = NaN at vertex 1: kinetics need finite inputs";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn columns_that_do_not_fit_are_refused_before_any_pointer_is_given_away() {
    let kinetics = misbehave(0.0);
    let (short, long) = (vec![0.0; 2], vec![0.0; 3]);
    let call = |species: &Vec<f64>, signals: &[_], outputs: usize| {
        let mut rates = vec![0.0; outputs];
        let (location, species) = (Location::Vertex, &[species.into()][..]);
        let batch = Batch { location, first: 0, count: 3, species, signals, parameters: &[] };
        kinetics
            .evaluate(Quantity::Rates, &batch, &mut [&mut rates], &mut [])
            .map_err(|error| error.to_string())
    };
    assert_eq!(call(&long, &[(&long).into()], 3), Ok(None));
    let wrong = [
        (call(&short, &[(&long).into()], 3), "values of an input: expected 3, found 2"),
        (call(&long, &[], 3), "signal columns: expected 1, found 0"),
        (call(&long, &[(&long).into()], 2), "values of an output: expected 3, found 2"),
    ];
    for (outcome, expected) in wrong {
        let message = outcome.unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
}
