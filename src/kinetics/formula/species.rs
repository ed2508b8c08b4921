//! Formulas of position, time and species, or signals in their place: `f(x, y, z, t, c)` at given points, and `∂f/∂c`.

use super::field_formula::{DISTANCE, NAMES, Places, TIME, known_names};
use super::graph::Graph;
use super::names::full_name;
use super::parse::{self, FormulaError};
use super::program::Program;
use crate::error::nearest;
use crate::{Column, Signal};
use rumple_numerics::num::index;

/// The number of the first species among its inputs, behind those of place and time.
const FIRST_SPECIES: usize = NAMES.len();

/// The names that a formula can read in place of one that it cannot; beside position and time these, which are `what`.
fn unknown(name: &str, timed: bool, (what, species): (&str, &[&str])) -> String {
    let known = known_names(timed, true).map(|known: &str| known);
    let near = nearest(name, known.chain(species.iter().copied()));
    let near = match near {
        _ if NAMES.contains(&name) => "the time is not read here. ".to_owned(),
        Some(near) => format!("did you mean `{near}`? "),
        None => String::new(),
    };
    let time = if timed { ", t (time)" } else { "" };
    let species = match species.is_empty() {
        true => format!("no {what}"),
        false => format!("the {what} {}", species.join(", ")),
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
        let number = |name: &str| species.iter().position(|known| *known == name);
        Self::parse_with(text, timed, number, ("species", species))
    }

    /// Reads it with signals in place of species, by the names that laws use, but for those that are not smooth or are position
    /// and time: numbers of species are those of columns among those of all signals.
    ///
    /// # Errors
    /// As for [`SpeciesFormula::new`].
    pub fn of_signals(text: &str) -> Result<Self, FormulaError> {
        let columns = || Signal::ALL.iter().flat_map(|s| s.columns().iter().map(move |c| (*s, *c)));
        let readable = |signal: Signal| !matches!(signal, Signal::Time | Signal::ContactPressure);
        let number = |name: &str| {
            let name = full_name(name);
            columns().position(|(signal, column)| column == name && readable(signal))
        };
        let names: Vec<&str> =
            columns().filter(|(signal, _)| readable(*signal)).map(|(_, column)| column).collect();
        Self::parse_with(text, true, number, ("signals", &names))
    }

    fn parse_with(
        text: &str,
        timed: bool,
        number: impl Fn(&str) -> Option<usize>,
        (what, names): (&str, &[&str]),
    ) -> Result<Self, FormulaError> {
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
            let Some(s) = number(name).filter(|_| hidden.is_none()) else {
                return Err(unknown(name, timed, (what, names)));
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
