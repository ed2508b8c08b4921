//! Scenes that are built: right in most keys, wrong in one or two, read, set up and stepped.
//!
//! The input chooses, byte by byte, what is listed and which keys get invalid values. So
//! whatever makes bytes makes scenes: mutations, proptest, and a fuzzer that sees which code they reach.

mod scene;
mod wrong;

use std::sync::atomic::{AtomicUsize, Ordering};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rumple::kinetics::PluginSearch;
use rumple::output::vtu;
use rumple::run::Error;
use rumple::scene::Scene;
use rumple::solve::Control;
use rumple::{Simulation, output::Compression};

use super::{Reader, bound};

pub const BUILT: Reader = Reader {
    name: "built",
    // Of this 64 MiB are a buffer that products of matrices keep for every thread.
    bound: bound(72, 64),
    seeds,
    read: built,
    repair: None,
};

/// Polls of the interrupt after which a run is interrupted.
const PATIENCE: usize = 300;

/// Choices, a byte each; when all have been used, always the first.
pub struct Choices<'a>(&'a [u8]);

impl Choices<'_> {
    fn below(&mut self, count: usize) -> usize {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        usize::from(*first) % count
    }

    fn pick<'t>(&mut self, all: &[&'t str]) -> &'t str {
        all[self.below(all.len())]
    }

    /// Seldom, and never when all bytes have been used.
    fn seldom(&mut self) -> bool {
        self.below(4) == 3
    }
}

/// A table of a scene: its head, and its keys with their values.
pub struct Table {
    head: &'static str,
    rows: Vec<(String, String)>,
}

impl Table {
    fn new(head: &'static str) -> Self {
        Self { head, rows: Vec::new() }
    }

    fn with(mut self, rows: &[(&str, &str)]) -> Self {
        rows.iter().for_each(|(key, value)| self.set(key, value));
        self
    }

    fn set(&mut self, key: &str, value: &str) {
        self.rows.push((key.to_owned(), value.to_owned()));
    }
}

/// Random choices, the same wherever they are made.
fn seeds() -> Vec<Vec<u8>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    (0..64).map(|_| (0..120).map(|_| random.random()).collect()).collect()
}

/// The scene that `bytes` choose.
pub fn text(bytes: &[u8]) -> String {
    let mut choices = Choices(bytes);
    let wrong = [0, 1, 1, 2][choices.below(4)];
    let mut tables = scene::tables(&mut choices);
    (0..wrong).for_each(|_| wrong::spoil(&mut choices, &mut tables));
    let mut text = String::new();
    for table in &tables {
        text += table.head;
        text.push('\n');
        for (key, value) in &table.rows {
            text += &format!("{key} = {value}\n");
        }
    }
    text
}

fn built(bytes: &[u8]) -> bool {
    let text = text(bytes);
    let made = Scene::parse(&text, "built.toml", &[]).map_err(Error::from);
    let made = made.and_then(|scene| {
        let simulation = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
        Ok((scene, simulation))
    });
    match made {
        Ok((scene, simulation)) => {
            stepped(simulation, scene.time.span.until.get(), &text);
            true
        }
        Err(error) => {
            assert!(names_a_key(&error, &text), "says no key: {error}\n{text}");
            false
        }
    }
}

/// Whether an error points to a place in the scene, or names one of its keys.
fn names_a_key(error: &Error, text: &str) -> bool {
    if let Error::Scene(error) = error
        && error.position().is_some()
    {
        return !error.rendered(false).is_empty();
    }
    let message = error.to_string();
    let tables = ["sheet", "material", "effect", "kinetics", "time", "equilibrium"];
    let keys = text.lines().filter_map(|line| line.split_once(" = "));
    let mut words = keys.flat_map(|(key, _)| key.split('.')).chain(tables);
    words.any(|word| message.contains(word))
}

/// Takes a step or two, for as long as patience lasts: what is reached is finite, and fit to be written.
fn stepped(mut simulation: Simulation, until: f64, text: &str) {
    let asked = AtomicUsize::new(0);
    let enough = move || asked.fetch_add(1, Ordering::Relaxed) > PATIENCE;
    simulation.set_control(Control::new(enough, |_| ()));
    let mut done = simulation.prepare().map(|_| ());
    for _ in 0..2 {
        if done.is_ok() && simulation.state().time < until {
            done = simulation.step(until).map(|_| ());
        }
    }
    if let Err(error) = done {
        assert!(!error.to_string().is_empty());
        return;
    }
    let state = simulation.state();
    let numbers = || state.x.iter().flatten().chain(state.species.iter().flatten());
    assert!(numbers().all(|number| number.is_finite()), "a state that is not finite\n{text}");
    if let Ok(frame) = simulation.frame() {
        assert!(vtu::encode(&frame, Compression::None).is_ok_and(|bytes| !bytes.is_empty()));
    }
}
