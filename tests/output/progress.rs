use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rumple::output::{Mode, Progress, ProgressLine};

#[derive(Clone, Default)]
struct Page(Arc<Mutex<Vec<u8>>>);

impl Page {
    fn lines(&self) -> Vec<String> {
        let bytes = self.0.lock().unwrap().clone();
        String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
    }
}

impl Write for Page {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn line(step: u64, time: f64) -> ProgressLine {
    ProgressLine { time, step, dt: 0.5 }
}

#[test]
fn first_and_last_are_shown_whatever_the_interval() {
    let page = Page::default();
    let hour = Duration::from_secs(3600);
    let mut progress = Progress::lines_to(Box::new(page.clone()), hour, 50.0);
    for step in 0..=100u32 {
        progress.update(&line(step.into(), f64::from(step) * 0.5));
        if step == 10 {
            progress.message("a frame");
        }
    }
    progress.finish();
    let lines = page.lines();
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(lines[0].contains("step 0"));
    assert_eq!(lines[1], "a frame");
    let (elapsed, rest) = lines[2].split_once("  ").unwrap();
    assert!(elapsed.starts_with("00:00:"), "{lines:?}");
    assert_eq!(rest, "[####################] 100 %  time 50.000000 of 50  step 100  dt 5.000e-1");
}

#[test]
fn a_shown_last_line_is_not_repeated() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 2.0);
    progress.update(&line(1, 1.0));
    progress.update(&line(2, 2.0));
    progress.finish();
    let lines = page.lines();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[0].contains("step 1 ") && lines[1].contains("step 2 "), "{lines:?}");
}

/// Times without an end, or with nothing between start and end, must not upset the bar.
#[test]
fn every_mode_takes_odd_times() {
    for mode in [Mode::Bar, Mode::Silent] {
        for end in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            let mut progress = Progress::new(mode, end);
            progress.update(&line(1, 1.0));
            progress.update(&line(2, f64::NAN));
            progress.finish();
        }
    }
}

/// The bar begins at the time 0 of the scene, is full at its end alone, and is empty where the share is not a number.
#[test]
fn the_bar_is_the_share_of_the_time() {
    let cases = [
        (0.0, 2.0, "[....................]   0 %"),
        (0.5, 2.0, "[#####...............]  25 %"),
        (1.999, 2.0, "[###################.]  99 %"),
        (2.0, 2.0, "[####################] 100 %"),
        (3.0, 2.0, "[####################] 100 %"),
        (-1.0, 2.0, "[....................]   0 %"),
        (0.0, 0.0, "[....................]   0 %"),
        (1.0, f64::INFINITY, "[....................]   0 %"),
        (f64::NAN, 2.0, "[....................]   0 %"),
    ];
    for (time, end, expected) in cases {
        let page = Page::default();
        let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, end);
        progress.update(&line(1, time));
        assert!(page.lines()[0].contains(expected), "{time} of {end}: {:?}", page.lines());
    }
}

/// Work within a step is reported where nothing was shown for long, and not more often.
#[test]
fn an_aside_waits_for_its_turn() {
    let hour = Duration::from_secs(3600);
    for (every, expected) in [(Duration::ZERO, 2), (hour, 0)] {
        let page = Page::default();
        let progress = Progress::lines_to(Box::new(page.clone()), every, 2.0);
        let aside = progress.aside();
        aside.report(&|| "half way".into());
        aside.report(&|| "nearly there".into());
        assert_eq!(page.lines().len(), expected);
    }
}

/// Such a line begins with the progress up to the last step, as every other.
#[test]
fn an_aside_begins_with_the_progress_so_far() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 2.0);
    let aside = progress.aside();
    aside.report(&|| "relaxing".into());
    progress.update(&line(1, 1.5));
    aside.report(&|| "relaxing".into());
    let lines = page.lines();
    assert!(lines[0].contains("[....................]   0 %"), "{lines:?}");
    assert!(lines[0].ends_with("time 0.000000 of 2  relaxing"), "{lines:?}");
    assert!(lines[2].contains("[###############.....]  75 %"), "{lines:?}");
    assert!(lines[2].ends_with("time 1.500000 of 2  relaxing"), "{lines:?}");
}
