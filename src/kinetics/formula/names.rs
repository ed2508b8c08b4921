//! What the names in formulas stand for.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use super::graph::{Graph, Id};
use super::law::{FormulaIndex, Law, LawError};
use super::parse::{self, FormulaError};
use crate::error::nearest;
use crate::{Parameter, Signal};

/// Short names of signals.
const SHORT_NAMES: [(&str, &str); 9] = [
    ("H", "mean_curvature"),
    ("K", "gaussian_curvature"),
    ("sigma", "tension"),
    ("strain", "area_strain"),
    ("J", "area_ratio"),
    ("t", "time"),
    ("x", "position_x"),
    ("y", "position_y"),
    ("z", "position_z"),
];

/// The name of the column of a signal that `name` stands for, or `name` itself.
pub(super) fn full_name(name: &str) -> &str {
    SHORT_NAMES.iter().find(|(short, _)| *short == name).map_or(name, |(_, full)| full)
}

/// So many known names are listed where one is not known.
const MAX_LISTED: usize = 100;

/// What names stand for while formulas are put into the graph.
///
/// Inputs are numbered: species, then the columns of all signals, then parameters that vary.
pub(super) struct Names<'a> {
    law: &'a Law,
    /// Numbers of species, by name.
    species: HashMap<&'a str, usize>,
    /// Numbers of parameters among all, and among those that vary.
    parameters: HashMap<&'a str, (usize, usize)>,
    lets: HashMap<&'a str, Id>,
    /// Columns of all signals, by name.
    pub(super) columns: Vec<&'static str>,
    /// Parameters and `let`s that formulas outside of `let`s mention.
    used: RefCell<BTreeSet<String>>,
    /// Names that each `let` mentions.
    parts: HashMap<&'a str, Vec<String>>,
}

impl<'a> Names<'a> {
    /// The names of a law, its `let`s not yet defined.
    pub(super) fn new(law: &'a Law) -> Self {
        let columns = Signal::ALL.iter().flat_map(|s| s.columns()).copied().collect();
        let species = law.species.iter().enumerate().map(|(k, s)| (s.name.as_str(), k)).collect();
        let mut varying = 0;
        let number = |(k, parameter): (usize, &'a Parameter)| {
            let numbers = (k, varying);
            varying += usize::from(law.values.get(k).is_none_or(Option::is_none));
            (parameter.name.as_str(), numbers)
        };
        let parameters = law.parameters.iter().enumerate().map(number).collect();
        let (lets, used, parts) = (HashMap::new(), RefCell::default(), HashMap::new());
        Self { law, species, parameters, lets, columns, used, parts }
    }

    /// Names of parameters and `let`s that rates, length factor and observables read, also by way of `let`s.
    pub(super) fn read(&self) -> BTreeSet<String> {
        let mut read = self.used.borrow().clone();
        let mut open: Vec<String> = read.iter().cloned().collect();
        while let Some(name) = open.pop() {
            for part in self.parts.get(name.as_str()).into_iter().flatten() {
                if read.insert(part.clone()) {
                    open.push(part.clone());
                }
            }
        }
        read
    }

    /// What a name stands for, or what there is instead.
    pub(super) fn find(&self, graph: &mut Graph, name: &str) -> Result<Id, String> {
        if let Some(id) = self.lets.get(name) {
            self.used.borrow_mut().insert(name.to_owned());
            return Ok(*id);
        }
        if let Some(s) = self.species.get(name) {
            return Ok(graph.input(rumple_numerics::num::index(*s)));
        }
        if let Some((k, earlier)) = self.parameters.get(name) {
            self.used.borrow_mut().insert(name.to_owned());
            return Ok(match self.law.values[*k] {
                Some(value) => graph.constant(value),
                None => {
                    let before = self.law.species.len() + self.columns.len();
                    graph.input(rumple_numerics::num::index(before + earlier))
                }
            });
        }
        if name == "pi" {
            return Ok(graph.constant(std::f64::consts::PI));
        }
        let full = full_name(name);
        if let Some(column) = self.columns.iter().position(|column| *column == full) {
            return Ok(graph.input(rumple_numerics::num::index(self.law.species.len() + column)));
        }
        let mut all: Vec<&str> = self.law.species.iter().map(|s| s.name.as_str()).collect();
        let lets = self.law.lets.iter().map(|part| part.name.as_str());
        all.extend(lets.filter(|name| self.lets.contains_key(name)));
        all.extend(self.law.parameters.iter().map(|p| p.name.as_str()));
        all.extend(self.columns.iter().copied());
        all.extend(SHORT_NAMES.iter().map(|(short, _)| *short));
        let first = all.get(..MAX_LISTED).unwrap_or(&all);
        let list = first.join(", ") + if first.len() < all.len() { ", …" } else { "" };
        Err(match nearest(name, all.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? There are {list}"),
            None => format!("there are {list}"),
        })
    }

    /// Puts all `let`s into the graph, each after those that it is made of: of those that could be
    /// next the first one, so that the time is about that of reading them.
    pub(super) fn define(&mut self, graph: &mut Graph) -> Result<(), LawError> {
        let law = self.law;
        let wrong = |k: usize| move |error| LawError { formula: FormulaIndex::Let(k), error };
        let number: HashMap<&str, usize> =
            law.lets.iter().enumerate().map(|(k, part)| (part.name.as_str(), k)).collect();
        let mut trees = Vec::with_capacity(law.lets.len());
        // How many parts of each are not yet defined, and whose part each is.
        let mut open = vec![0; law.lets.len()];
        let mut part_of = vec![Vec::new(); law.lets.len()];
        for (k, part) in law.lets.iter().enumerate() {
            let name = part.name.as_str();
            if self.species.contains_key(name) || self.parameters.contains_key(name) {
                let message = format!("`{name}` is a species or a parameter already");
                return Err(wrong(k)(FormulaError::new(0..part.text.len(), message)));
            }
            let tree = parse::parse(&part.text).map_err(wrong(k))?;
            let mentioned = self.parts.entry(name).or_default();
            tree.names(&mut |name| {
                mentioned.push(name.to_owned());
                if let Some(&other) = number.get(name) {
                    open[k] += 1;
                    part_of[other].push(k);
                }
            });
            trees.push(tree);
        }
        let mut ready: BTreeSet<usize> = (0..open.len()).filter(|k| open[*k] == 0).collect();
        while let Some(k) = ready.pop_first() {
            let find = &mut |graph: &mut Graph, name: &str| self.find(graph, name);
            let id = graph.insert(&trees[k], find).map_err(wrong(k))?;
            graph.room().map_err(|large| wrong(k)(large.in_formula(&law.lets[k].text)))?;
            self.lets.insert(&law.lets[k].name, id);
            for &whole in &part_of[k] {
                open[whole] -= 1;
                if open[whole] == 0 {
                    ready.insert(whole);
                }
            }
        }
        // What `let`s mention is read where they are.
        self.used.take();
        match open.iter().position(|open| *open > 0) {
            None => Ok(()),
            Some(k) => {
                let part = &law.lets[k];
                let message = format!("`{}` depends on itself", part.name);
                Err(wrong(k)(FormulaError::new(0..part.text.len(), message)))
            }
        }
    }
}
