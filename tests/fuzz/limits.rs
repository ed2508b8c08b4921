//! Limits of the readers, each with its error.

use std::fmt::Write as _;

use rumple::kinetics::formula::{FormulaKinetics, Law};
use rumple::scene::Scene;
use rumple::sheet::read;
use rumple::study::plan::Axis;

use super::readers::{LAW, root};
use crate::common::{allocations, peak_of};

const SMALL: &str = include_str!("scenes/small.toml");

fn law_of(rates: &str) -> Law {
    let head = "sheet = { shape = \"point\" }\ntime = { until = 1.0 }\n[kinetics]\n";
    let scene = Scene::parse(&format!("{head}{rates}"), "s.toml", &[]).unwrap();
    scene.kinetics[0].law().unwrap()
}

/// Operations of rates, and with derivatives.
fn ready(law: &Law) -> Result<(usize, usize), String> {
    FormulaKinetics::new(law).map(|law| law.operations()).map_err(|e| e.error.message)
}

#[test]
fn a_law_of_more_than_512_species_is_refused() {
    let rates = |count: usize| {
        (0..count).fold(String::new(), |mut text, k| {
            let _ = writeln!(text, "rates.s{k:06} = \"-s{k:06}\"");
            text
        })
    };
    ready(&law_of(&rates(512))).unwrap();
    for count in [513, 200_000] {
        let law = law_of(&rates(count));
        let before = allocations();
        let message = ready(&law).unwrap_err();
        assert!(message.contains(&format!("{count} species")), "{message}");
        // Nothing is done for each of them.
        assert!(allocations() - before < 20, "{}", allocations() - before);
    }
}

/// `count` products of `factors` sines, each of them of another species.
fn products(count: usize, factors: usize) -> Law {
    let mut rates = String::new();
    for k in 0..count {
        let sines: Vec<String> =
            (0..factors).map(|j| format!("sin(s{:03}*{j}.5)", (k + j) % count)).collect();
        let _ = writeln!(rates, "rates.s{k:03} = \"{}\"", sines.join("*"));
    }
    law_of(&rates)
}

/// The derivatives of products by every species need many times the operations of the products.
#[test]
fn a_law_whose_derivatives_are_too_many_for_its_text_is_refused() {
    for (count, factors, accepted) in [(300, 60, false), (100, 100, true), (100, 8, true)] {
        let law = products(count, factors);
        let bytes: usize = law.rates.iter().map(|rate| rate.text.len()).sum();
        let (result, peak) = peak_of(|| ready(&law));
        let most = LAW.bound.of(bytes).min(600 << 20);
        assert!(peak < most, "{peak} of {most} bytes for {count} products of {factors}");
        assert_eq!(result.is_ok(), accepted, "{result:?}");
        if let Err(message) = result {
            assert!(message.contains("operations"), "{message}");
        }
    }
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
    assert!(peak < 16 << 20, "{peak}");
    result.unwrap_err().to_string()
}

/// 60 arrays name the same data, 0.96 MB each as numbers of 64 bits.
#[test]
fn arrays_may_not_name_the_same_data_without_end() {
    let message = refused("same-data.vtu");
    assert!(message.contains("8388608") && message.contains("same-data.vtu"), "{message}");
}

/// Its header asks for a dictionary of 1.5 GB.
#[test]
fn a_decoder_of_lzma_data_gets_no_more_memory_than_that() {
    let message = refused("lzma-dictionary.vtu");
    assert!(message.contains("memory"), "{message}");
}

/// Each against each they would be parsed fifty million times.
#[test]
fn ten_thousand_long_values_are_not_compared_each_with_each() {
    let zeros = "0".repeat(80);
    let values: Vec<String> = (0..10_000).map(|k| format!("{k}.{zeros}{k}")).collect();
    let parse = |values: &[String]| Axis::parse(&format!("a.b={}", values.join(",")));
    let before = allocations();
    assert_eq!(parse(&values).unwrap().values.len(), 10_000);
    assert!(allocations() - before < 20_000, "{}", allocations() - before);
    let again = [&values[1..], &[format!("1.{zeros}10e0")]].concat();
    let message = parse(&again).unwrap_err();
    assert!(message.contains("are the same"), "{message}");
}
