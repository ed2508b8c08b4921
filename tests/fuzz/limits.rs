//! Limits of the readers, each with the error that says so.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use rumple::kinetics::formula::FormulaKinetics;
use rumple::scene::Scene;
use rumple::sheet::read;
use rumple::study::sweep::Axis;

use super::readers::root;
use crate::common::peak_of;

const SMALL: &str = include_str!("scenes/small.toml");

fn law_of(rates: &str) -> Result<(usize, usize), String> {
    let head = "sheet = { shape = \"point\" }\ntime = { until = 1.0 }\n[kinetics]\n";
    let scene = Scene::parse(&format!("{head}{rates}"), "s.toml", &[]).unwrap();
    let law = scene.kinetics[0].law().unwrap();
    FormulaKinetics::new(&law).map(|law| law.operations()).map_err(|e| e.error.message)
}

#[test]
fn a_law_of_more_than_512_species_is_refused() {
    let rates = |count: usize| {
        (0..count).fold(String::new(), |mut text, k| {
            let _ = writeln!(text, "rates.s{k:06} = \"-s{k:06}\"");
            text
        })
    };
    law_of(&rates(512)).unwrap();
    let began = Instant::now();
    for count in [513, 200_000] {
        let message = law_of(&rates(count)).unwrap_err();
        assert!(message.contains(&format!("{count} species")), "{message}");
    }
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
}

/// Products of sums: the derivatives by every species need many times the operations of the rates.
#[test]
fn a_law_whose_derivatives_are_too_many_is_refused() {
    let mut rates = String::new();
    for k in 0..300 {
        let sum: Vec<String> =
            (0..60).map(|j| format!("sin(s{:03}*{j}.5)", (k + j) % 300)).collect();
        let _ = writeln!(rates, "rates.s{k:03} = \"{}\"", sum.join("*"));
    }
    let (result, peak) = peak_of(|| law_of(&rates));
    let message = result.unwrap_err();
    assert!(message.contains("operations"), "{message}");
    assert!(peak < 512 << 20, "{peak}");
}

/// One long key with many keys in it: their paths would be its length times their number.
#[test]
fn places_of_a_scene_take_no_more_memory_than_it() {
    let key = "k".repeat(50_000);
    let mut text = format!("{SMALL}\n[{key}]\n");
    (0..20_000).for_each(|k| {
        let _ = writeln!(text, "a{k} = 1");
    });
    let (error, peak) = peak_of(|| Scene::parse(&text, "s.toml", &[]).unwrap_err());
    assert!(error.to_string().contains("unknown key"));
    assert!(peak < 100 * text.len(), "{peak} bytes for {}", text.len());
}

/// Beyond 65535 columns nothing can be padded to.
#[test]
fn a_problem_far_out_in_a_line_is_shown() {
    let text = format!("{}\nwrong = 1 # {}\n", SMALL.replace('\n', "\n\n"), "é".repeat(40_000));
    let far = format!("x = [{} {{ = 1 }}]\n{SMALL}", "1,".repeat(50_000));
    for (text, word) in [(text, "wrong"), (far, "1,1,1")] {
        let error = Scene::parse(&text, "s.toml", &[]).unwrap_err();
        let shown = error.rendered(false);
        assert!(shown.contains(word), "{shown}");
        assert!(shown.lines().all(|line| line.len() < 2000), "{shown}");
        let (line, column) = error.position().unwrap();
        assert!(shown.contains(&format!("[s.toml:{line}:{column}]")), "{line}:{column}\n{shown}");
    }
}

fn refused(name: &str) -> String {
    let path = root().join("tests/fuzz/corpus/vtu").join(name);
    let (result, peak) = peak_of(|| read::surface(&path));
    assert!(peak < 160 << 20, "{peak}");
    result.unwrap_err().to_string()
}

/// 60 arrays name the same data, 9.6 MB each as numbers of 64 bits.
#[test]
fn arrays_may_not_name_the_same_data_without_end() {
    let message = refused("same-data.vtu");
    assert!(message.contains("67108864") && message.contains("same-data.vtu"), "{message}");
}

/// Its header asks for a dictionary of 1.5 GB.
#[test]
fn a_decoder_of_lzma_data_gets_no_more_memory_than_that() {
    let message = refused("lzma-dictionary.vtu");
    assert!(message.contains("memory"), "{message}");
}

/// Each against each they would be parsed fifty million times.
#[test]
fn ten_thousand_long_values_are_compared_in_no_time() {
    let zeros = "0".repeat(80);
    let values: Vec<String> = (0..10_000).map(|k| format!("{k}.{zeros}{k}")).collect();
    let began = Instant::now();
    let parse = |values: &[String]| Axis::parse(&format!("a.b={}", values.join(",")));
    assert_eq!(parse(&values).unwrap().values.len(), 10_000);
    let again = [&values[1..], &[format!("1.{zeros}10e0")]].concat();
    let message = parse(&again).unwrap_err();
    assert!(message.contains("are the same"), "{message}");
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
}
