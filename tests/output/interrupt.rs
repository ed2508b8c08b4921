#![cfg(unix)]

use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rumple::output::Interrupt;

const CHILD: &str = "RUMPLE_TEST_INTERRUPT";

/// The other half of the test below: a run that is slow to end its step.
#[test]
fn child_waits_for_signals() {
    let Ok(seen) = std::env::var(CHILD) else { return };
    let interrupt = Interrupt::install().unwrap();
    assert!(!interrupt.requested());
    std::fs::write(&seen, "ready").unwrap();
    let patience = Instant::now();
    while patience.elapsed() < Duration::from_secs(30) {
        if Interrupt::install().unwrap().requested() {
            std::fs::write(&seen, "requested").unwrap();
        }
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_first_signal_asks_and_the_second_kills() {
    let folder = tempfile::tempdir().unwrap();
    let seen = folder.path().join("seen");
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "output::interrupt::child_waits_for_signals", "--nocapture"])
        .env(CHILD, &seen)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let reaches = |word: &str| {
        let start = Instant::now();
        while std::fs::read_to_string(&seen).unwrap_or_default() != word {
            assert!(start.elapsed() < Duration::from_secs(20), "never `{word}`");
            sleep(Duration::from_millis(5));
        }
    };
    let id = child.id().to_string();
    let signal = |name: &str| {
        assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
    };
    reaches("ready");
    signal("-TERM");
    reaches("requested");
    assert!(child.try_wait().unwrap().is_none(), "one signal must not kill");
    signal("-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn a_request_to_one_run_ends_no_other() {
    let [one, other] = [Interrupt::of_one_run(), Interrupt::of_one_run()];
    one.request();
    assert!(one.requested() && !other.requested());
    assert_eq!((one.signal(), other.signal()), (Some(15), None));
    other.pass_on(None);
    assert!(other.requested() && other.signal().is_none());
}
