//! What the names in formulas stand for.

use std::cell::RefCell;
use std::collections::BTreeSet;

use super::graph::{Graph, Id};
use super::parse::{self, FormulaError};
use super::{Law, LawError, Which};
use crate::kinetics::Signal;
use crate::kinetics::error::nearest;

/// Short names of signals.
const SHORT: [(&str, &str); 9] = [
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

/// What names stand for while formulas are put into the graph.
///
/// Inputs are numbered: species, then the columns of all signals, then parameters that vary.
pub(super) struct Names<'a> {
    law: &'a Law,
    lets: Vec<(String, Id)>,
    /// Columns of all signals, by name.
    pub(super) columns: Vec<&'static str>,
    /// Parameters that some formula mentions.
    pub(super) used: RefCell<BTreeSet<String>>,
}

impl<'a> Names<'a> {
    /// The names of a law, its `let`s not yet defined.
    pub(super) fn new(law: &'a Law) -> Self {
        let columns = Signal::ALL.iter().flat_map(|s| s.columns()).copied().collect();
        Self { law, lets: Vec::new(), columns, used: RefCell::default() }
    }

    /// What a name stands for, or what there is instead.
    pub(super) fn find(&self, graph: &mut Graph, name: &str) -> Result<Id, String> {
        if let Some((_, id)) = self.lets.iter().rev().find(|(known, _)| known == name) {
            return Ok(*id);
        }
        if let Some(s) = self.law.species.iter().position(|s| s.name == name) {
            return Ok(graph.input(crate::num::index(s)));
        }
        if let Some(k) = self.law.parameters.iter().position(|p| p.name == name) {
            self.used.borrow_mut().insert(name.to_owned());
            return Ok(match self.law.values[k] {
                Some(value) => graph.constant(value),
                None => {
                    let earlier = self.law.values[..k].iter().filter(|v| v.is_none()).count();
                    let before = self.law.species.len() + self.columns.len();
                    graph.input(crate::num::index(before + earlier))
                }
            });
        }
        if name == "pi" {
            return Ok(graph.constant(std::f64::consts::PI));
        }
        let full = SHORT.iter().find(|(short, _)| *short == name).map_or(name, |(_, full)| full);
        if let Some(column) = self.columns.iter().position(|column| *column == full) {
            return Ok(graph.input(crate::num::index(self.law.species.len() + column)));
        }
        let mut all: Vec<&str> = self.law.species.iter().map(|s| s.name.as_str()).collect();
        all.extend(self.lets.iter().map(|(name, _)| name.as_str()));
        all.extend(self.law.parameters.iter().map(|p| p.name.as_str()));
        all.extend(self.columns.iter().copied());
        all.extend(SHORT.iter().map(|(short, _)| *short));
        let list = all.join(", ");
        Err(match nearest(name, all.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? There are {list}"),
            None => format!("there are {list}"),
        })
    }

    /// Puts all `let`s into the graph, each after those that it is made of.
    pub(super) fn define(&mut self, graph: &mut Graph) -> Result<(), LawError> {
        let law = self.law;
        let wrong = |k: usize| move |error| LawError { formula: Which::Let(k), error };
        let mut waiting = Vec::new();
        for (k, part) in law.lets.iter().enumerate() {
            let taken = law.species.iter().any(|s| s.name == part.name)
                || law.parameters.iter().any(|p| p.name == part.name);
            if taken {
                let message = format!("`{}` is a species or a parameter already", part.name);
                return Err(wrong(k)(FormulaError::new(0..part.text.len(), message)));
            }
            waiting.push((k, parse::parse(&part.text).map_err(wrong(k))?));
        }
        while !waiting.is_empty() {
            let open = |name: &str| {
                law.lets.iter().any(|l| l.name == name)
                    && !self.lets.iter().any(|(known, _)| known == name)
            };
            let Some(next) = waiting.iter().position(|(_, tree)| !tree.mentions(&open)) else {
                let (k, _) = waiting[0];
                let part = &law.lets[k];
                let message = format!("`{}` is made of itself", part.name);
                return Err(wrong(k)(FormulaError::new(0..part.text.len(), message)));
            };
            let (k, tree) = waiting.remove(next);
            let id = graph.insert(&tree, &mut |g, name| self.find(g, name)).map_err(wrong(k))?;
            self.lets.push((law.lets[k].name.clone(), id));
        }
        Ok(())
    }
}
