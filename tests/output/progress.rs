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
    ProgressLine { time, step, dt: 0.5, residual: 1e-7, left: String::new(), note: String::new() }
}

#[test]
fn first_and_last_are_shown_whatever_the_interval() {
    let page = Page::default();
    let hour = Duration::from_secs(3600);
    let mut progress = Progress::lines_to(Box::new(page.clone()), hour, 0.0, 50.0);
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
    assert_eq!(lines[2], "time 50.000000 of 50  step 100  dt 5.000e-1  residual 1.00e-7");
}

#[test]
fn a_shown_last_line_is_not_repeated() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 0.0, 2.0);
    progress.update(&line(1, 1.0));
    progress.update(&ProgressLine { note: "steady".to_owned(), ..line(2, 2.0) });
    progress.finish();
    let lines = page.lines();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(lines[0].ends_with("residual 1.00e-7"), "{lines:?}");
    assert!(lines[1].ends_with("  steady"), "{lines:?}");
}

/// Times without an end, or with nothing between start and end, must not upset the bar.
#[test]
fn every_mode_takes_odd_times() {
    for mode in [Mode::Bar, Mode::Silent] {
        for end in [0.0, f64::INFINITY, f64::NAN] {
            let mut progress = Progress::new(mode, 0.0, end);
            progress.update(&line(1, 1.0));
            progress.update(&line(2, f64::NAN));
            progress.finish();
        }
    }
}

#[test]
fn the_time_left_is_shown_where_it_is_known() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 0.0, 2.0);
    let left = "about 2 to 4 min left".to_owned();
    progress.update(&ProgressLine { left, note: "steady".to_owned(), ..line(1, 1.0) });
    progress.update(&line(2, 1.5));
    progress.finish();
    let lines = page.lines();
    assert!(lines[0].ends_with("1.00e-7  about 2 to 4 min left  steady"), "{lines:?}");
    assert!(!lines[1].contains("left"), "{lines:?}");
}

/// Work within a step is reported where nothing was shown for long, and not more often.
#[test]
fn an_aside_waits_for_its_turn() {
    let hour = Duration::from_secs(3600);
    for (every, expected) in [(Duration::ZERO, 2), (hour, 0)] {
        let page = Page::default();
        let progress = Progress::lines_to(Box::new(page.clone()), every, 0.0, 2.0);
        let aside = progress.aside();
        aside.report(&|| "half way".into());
        aside.report(&|| "nearly there".into());
        assert_eq!(page.lines().len(), expected);
    }
}

/// Such a line says, as every other, how far the run is and what is left.
#[test]
fn an_aside_says_where_the_run_is_and_what_is_left() {
    let page = Page::default();
    let mut progress = Progress::lines_to(Box::new(page.clone()), Duration::ZERO, 1.0, 2.0);
    let aside = progress.aside();
    aside.report(&|| "relaxing".into());
    progress.update(&ProgressLine { left: "about 3 min left".to_owned(), ..line(1, 1.5) });
    aside.report(&|| "relaxing".into());
    let lines = page.lines();
    assert_eq!(lines[0], "time 1.000000 of 2: relaxing");
    assert_eq!(lines[2], "time 1.500000 of 2: relaxing  about 3 min left");
}
