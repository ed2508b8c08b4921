use std::fs;
use std::path::Path;

use rumple::output::{Ledger, OutputError};

fn columns() -> Vec<String> {
    ["step", "time [time]", "energy of \"bending\", total [energy]"].map(str::to_owned).to_vec()
}

const HEADER: &str = "step,time [time],\"energy of \"\"bending\"\", total [energy]\"\n";

#[test]
fn rows_are_on_the_disk_at_once_and_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ledger.csv");
    let mut ledger = Ledger::create(&path, &columns()).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), HEADER);
    ledger.append(&[0.0, 0.1 + 0.2, f64::NAN]).unwrap();
    ledger.append(&[123_456_789.0, 1.5e-9, f64::NEG_INFINITY]).unwrap();
    assert_eq!(
        fs::read_to_string(&path).unwrap(),
        format!("{HEADER}0,0.30000000000000004,\n123456789,1.5e-9,\n")
    );
    assert_eq!(ledger.rows(), 2);
}

#[test]
fn a_row_must_fit_its_columns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ledger.csv");
    let mut ledger = Ledger::create(&path, &columns()).unwrap();
    let error = ledger.append(&[1.0]).unwrap_err();
    assert!(error.to_string().ends_with("ledger.csv:2: expected 3 numbers, got 1"), "{error}");
    assert_eq!(fs::read_to_string(&path).unwrap(), HEADER);
}

#[test]
fn reopening_drops_later_and_broken_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ledger.csv");
    let kept = format!("{HEADER}0,0,1\n1,0.5,2\n");
    fs::write(&path, format!("{kept}2,1,3\n3,1.5")).unwrap();
    let mut ledger = Ledger::reopen(&path, &columns(), 1).unwrap();
    assert_eq!(ledger.rows(), 2);
    assert_eq!(fs::read_to_string(&path).unwrap(), kept);
    ledger.append(&[2.0, 0.75, 4.0]).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), format!("{kept}2,0.75,4\n"));
}

#[test]
fn reopening_refuses_a_file_that_is_not_this_ledger() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ledger.csv");
    for (text, line, words) in [
        ("a,b\n1,2\n".to_owned(), 1, "found `a,b`"),
        (format!("{HEADER}0,0,1\n1,2\n"), 3, "expected 3 numbers, found 2"),
        (format!("{HEADER}x,0,1\n"), 2, "expected a step number, found `x`"),
    ] {
        fs::write(&path, &text).unwrap();
        let error = Ledger::reopen(&path, &columns(), 9).unwrap_err();
        assert!(matches!(error, OutputError::Ledger { line: l, .. } if l == line), "{error}");
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_with_the_words_of_the_system() {
    let error = Ledger::create(Path::new("/dev/full"), &columns()).unwrap_err();
    assert!(error.to_string().starts_with("cannot write /dev/full: No space left"), "{error}");
}
