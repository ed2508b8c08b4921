//! Formulas of position, time and species: `f(x, y, z, t, c)` at given points, and `∂f/∂c`.

use super::field_formula::{DISTANCE, NAMES, Places, TIME, known_names};
use super::graph::Graph;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::Column;
use crate::error::nearest;
use rumple_numerics::num::index;

/// The number of the first species among its inputs, behind those of place and time.
const FIRST_SPECIES: usize = NAMES.len();

/// The names that a formula can read in place of one that it cannot.
fn unknown(name: &str, timed: bool, species: &[&str]) -> String {
    let known = known_names(timed, true).map(|known: &str| known);
    let near = nearest(name, known.chain(species.iter().copied()));
    let near = match near {
        _ if NAMES.contains(&name) => "the time is not read here. ".to_owned(),
        Some(near) => format!("did you mean `{near}`? "),
        None => String::new(),
    };
    let time = if timed { ", t (time)" } else { "" };
    let species = match species.is_empty() {
        true => "no species".to_owned(),
        false => format!("the species {}", species.join(", ")),
    };
    format!(
        "{near}There are x, y, z (rest position, length){time}, distance_to_boundary, pi and {species}"
    )
}

/// A formula of the rest position `x`, `y`, `z`, the time `t` and species, with its derivatives by these.
#[derive(Debug, Clone)]
pub struct SpeciesFormula {
    value: Program,
    slopes: Program,
    read: Vec<usize>,
    timed: bool,
    distance: bool,
}

impl SpeciesFormula {
    /// Reads it; the time `t` may be read if it is `timed`. A species called x, y, z or t is hidden by position and time.
    ///
    /// # Errors
    /// If the text is not a formula, or mentions anything else.
    pub fn new(text: &str, species: &[&str], timed: bool) -> Result<Self, FormulaError> {
        let mut graph = Graph::with_budget(text.len());
        let tree = parse::parse(text)?;
        let (mut read, mut varying, mut distance) = (Vec::new(), false, false);
        let id = graph.insert(&tree, &mut |graph, name| {
            if name == "pi" {
                return Ok(graph.constant(std::f64::consts::PI));
            }
            let hidden = NAMES.iter().position(|known| *known == name);
            if let Some(k) = hidden.filter(|_| known_names(timed, true).any(|known| known == name))
            {
                varying |= index(k) == TIME;
                distance |= index(k) == DISTANCE;
                return Ok(graph.input(index(k)));
            }
            let known = |other: &&str| *other == name && hidden.is_none();
            let Some(s) = species.iter().position(known) else {
                return Err(unknown(name, timed, species));
            };
            read.push(s);
            Ok(graph.input(index(FIRST_SPECIES + s)))
        })?;
        read.sort_unstable();
        read.dedup();
        let slopes = read.iter().map(|s| graph.slope(id, index(FIRST_SPECIES + s)));
        let slopes: Vec<_> =
            slopes.collect::<Result<_, _>>().map_err(|large| large.in_formula(text))?;
        graph.complete();
        let (value, slopes) = (Program::new(&graph, &[id]), Program::new(&graph, &slopes));
        Ok(Self { value, slopes, read, timed: varying, distance })
    }

    /// Numbers of the species that it reads, ascending.
    #[must_use]
    pub fn species(&self) -> &[usize] {
        &self.read
    }

    /// Whether it reads the time.
    #[must_use]
    pub fn depends_on_time(&self) -> bool {
        self.timed
    }

    /// Whether it reads the distance to the boundary.
    #[must_use]
    pub fn depends_on_distance(&self) -> bool {
        self.distance
    }

    /// Its values at all points and a time; `species` gives the values there of the species of a number.
    #[must_use]
    pub fn evaluate<'a>(
        &self,
        places: impl Into<Places<'a>>,
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<f64> {
        self.run((&self.value, 1), places.into(), time, species).pop().unwrap_or_default()
    }

    /// Its derivatives there by each of the species that it reads.
    #[must_use]
    pub fn slopes<'a>(
        &self,
        places: impl Into<Places<'a>>,
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        self.run((&self.slopes, self.read.len()), places.into(), time, species)
    }

    fn run<'a>(
        &self,
        (program, outputs): (&Program, usize),
        places: Places<'_>,
        time: f64,
        species: impl Fn(usize) -> &'a [f64],
    ) -> Vec<Vec<f64>> {
        let axes = places.columns();
        let last = self.read.last().map_or(0, |last| last + 1);
        let of = |s: usize| match self.read.contains(&s) {
            true => species(s).into(),
            false => Column::uniform(&0.0),
        };
        let other = [Column::uniform(&time), places.distances()];
        let inputs: Vec<Column<'_>> =
            axes.iter().map(Into::into).chain(other).chain((0..last).map(of)).collect();
        let mut values = vec![vec![0.0; places.len()]; outputs];
        let mut columns: Vec<&mut [f64]> = values.iter_mut().map(Vec::as_mut_slice).collect();
        program.run(&inputs, places.len(), &mut columns);
        values
    }
}
