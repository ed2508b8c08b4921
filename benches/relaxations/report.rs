//! Results by scene and method, on disk and as tables.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write};
use std::fs;
use std::path::Path;

use crate::METHODS;
use crate::common::{Result, Table, number};
use crate::list::Entry;

/// Energies count as the same up to this share.
const ENERGY_TOLERANCE: f64 = 0.01;

/// What came of one relaxation by one method.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub vertices: usize,
    pub tolerance: f64,
    pub seconds: f64,
    pub iterations: u64,
    pub factorisations: u64,
    pub energy: f64,
    /// Smallest angle, in degrees.
    pub angle: f64,
    pub failure: Option<String>,
}

impl Display for Outcome {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { vertices, tolerance, seconds, iterations, factorisations, .. } = self;
        let failure = self.failure.as_deref().unwrap_or("").replace(['\t', '\n'], " ");
        write!(
            f,
            "{vertices}\t{tolerance:e}\t{seconds}\t{iterations}\t{factorisations}\t{:e}\t{}\t{failure}",
            self.energy, self.angle
        )
    }
}

impl Outcome {
    pub fn parse(line: &str) -> Option<Self> {
        let mut fields = line.trim_end_matches('\n').split('\t');
        let mut next = || fields.next();
        Some(Self {
            vertices: next()?.parse().ok()?,
            tolerance: next()?.parse().ok()?,
            seconds: next()?.parse().ok()?,
            iterations: next()?.parse().ok()?,
            factorisations: next()?.parse().ok()?,
            energy: next()?.parse().ok()?,
            angle: next()?.parse().ok()?,
            failure: next().filter(|f| !f.is_empty()).map(str::to_owned),
        })
    }

    /// Of a process that printed nothing.
    pub fn broken(failure: String) -> Self {
        Self { energy: f64::NAN, angle: f64::NAN, failure: Some(failure), ..Self::default() }
    }

    pub fn words(&self) -> String {
        format!(
            "{:.2} s, {} iterations, energy {:.6e}, {:.1}° {}",
            self.seconds,
            self.iterations,
            self.energy,
            self.angle,
            self.failure.as_deref().unwrap_or("")
        )
    }

    fn cell(&self) -> String {
        let Some(failure) = &self.failure else {
            return format!("{} ({})", number(self.seconds), self.iterations);
        };
        let short = [
            ("more than", "time"),
            ("stalled", "stalled"),
            ("collapse", "collapsed"),
            ("constraint", "constraint"),
            ("stopped after", "iterations"),
        ];
        let found = short.iter().find(|(part, _)| failure.contains(part));
        format!("– {}", found.map_or("fails", |(_, word)| *word))
    }
}

/// All results there are.
pub struct Results(BTreeMap<(String, String), Outcome>);

impl Results {
    pub fn load(folder: &Path) -> Result<Self> {
        let file = folder.join("results.tsv");
        let text = if file.exists() { fs::read_to_string(file)? } else { String::new() };
        let row = |line: &str| -> Option<((String, String), Outcome)> {
            let mut parts = line.splitn(3, '\t');
            let key = (parts.next()?.to_owned(), parts.next()?.to_owned());
            Some((key, Outcome::parse(parts.next()?)?))
        };
        Ok(Self(text.lines().filter_map(row).collect()))
    }

    pub fn save(&self, folder: &Path) -> Result<()> {
        let mut text = String::new();
        for ((name, method), outcome) in &self.0 {
            writeln!(text, "{name}\t{method}\t{outcome}")?;
        }
        Ok(fs::write(folder.join("results.tsv"), text)?)
    }

    pub fn get(&self, name: &str, method: &str) -> Option<&Outcome> {
        self.0.get(&(name.to_owned(), method.to_owned()))
    }

    pub fn put(&mut self, name: &str, method: &str, outcome: Outcome) {
        self.0.insert((name.to_owned(), method.to_owned()), outcome);
    }

    /// Times with iterations and the default's ratio to the best; energies with smallest angles; failures.
    pub fn tables(&self, entries: &[Entry]) -> String {
        let names = METHODS.map(|m| m.0);
        let titles: Vec<&str> =
            ["relaxation", "vertices", "tolerance"].into_iter().chain(names).collect();
        let mut times = Table::new(&[&titles[..], &["default / best", "best"]].concat());
        let mut energies = Table::new(&[&["relaxation", "lowest energy"], &names[..]].concat());
        let mut failures = String::new();
        let (mut counted, mut worse, mut lost) = (0, Vec::new(), Vec::new());
        for Entry { name, .. } in entries {
            let row: Vec<Option<&Outcome>> = names.iter().map(|m| self.get(name, m)).collect();
            let good = |o: &&&Outcome| o.failure.is_none();
            let done: Vec<(&str, &Outcome)> = names
                .iter()
                .zip(&row)
                .filter_map(|(m, o)| o.as_ref().filter(good).map(|o| (*m, *o)))
                .collect();
            // Who stops on a saddle or in a minimum high above is not compared.
            let own = row[0].filter(|o| o.failure.is_none()).map(|o| o.energy);
            let low = |e: f64| own.is_none_or(|own| e <= own + ENERGY_TOLERANCE * own.abs());
            let best = done
                .iter()
                .filter(|d| low(d.1.energy))
                .min_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
            let Some(first) = row.iter().flatten().find(|o| o.vertices > 0) else { continue };
            let ratio = match (row[0], best) {
                (Some(own), Some((_, best))) if own.failure.is_none() => {
                    counted += 1;
                    let ratio = own.seconds / best.seconds;
                    if ratio > 3.0 {
                        worse.push(name.as_str());
                    }
                    format!("{ratio:.1}")
                }
                (Some(_), Some(_)) => {
                    lost.push(name.as_str());
                    "fails".into()
                }
                _ => "–".into(),
            };
            let cell = |o: &Option<&Outcome>| o.map_or(String::new(), Outcome::cell);
            let mut line =
                vec![name.clone(), first.vertices.to_string(), format!("{:e}", first.tolerance)];
            line.extend(row.iter().map(cell));
            line.push(ratio);
            line.push(best.map_or("none", |b| b.0).to_owned());
            times.push(line);
            let lowest = done.iter().map(|d| d.1.energy).fold(f64::INFINITY, f64::min);
            let mut line = vec![name.clone(), format!("{lowest:.5e}")];
            line.extend(row.iter().map(|o| match o {
                Some(o) if o.failure.is_none() => {
                    let above = (o.energy - lowest) / lowest.abs().max(f64::MIN_POSITIVE);
                    format!(
                        "{} ({:.0}°)",
                        if above < 5e-6 { "0".into() } else { number(above) },
                        o.angle
                    )
                }
                _ => String::new(),
            }));
            energies.push(line);
            for (method, outcome) in names.iter().zip(&row) {
                if let Some(failure) = outcome.and_then(|o| o.failure.as_ref()) {
                    let _ = writeln!(failures, "* {name}, {method}: {failure}");
                }
            }
        }
        format!(
            "CPU seconds (iterations); the last columns: how many times as long the default takes as the fastest \
             of the methods whose energy is not above its own by more than 1 %, and which that is.\n\n{}\nEnergy above the lowest, as a share of it (smallest angle).\n\n{}\n\
             {counted} relaxations in which the default succeeds; more than 3 times the best: {worse:?}; \
             fails where another succeeds: {lost:?}\n\n## Failures\n\n{failures}",
            times.markdown(),
            energies.markdown()
        )
    }
}
