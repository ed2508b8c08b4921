//! Kinetics written as text: laws parsed, simplified, differentiated and run in blocks.
//!
//! ```text
//! dc/dt = R_c(c, signals)      one formula a species, of species, signals, parameters and `let`s
//! Φ     = Φ(c)                 the length factor, of species and parameters
//! ```
//!
//! Values of parameters become constants before anything is simplified. All partial derivatives are
//! exact and share what they have in common with the rates.

mod derivative;
mod graph;
mod parse;
mod program;

pub use parse::{FUNCTIONS, FormulaError, Function};

use graph::{Graph, Id};
use program::Program;

use super::descriptor::{Capabilities, Default, Descriptor};
use super::error::nearest;
use super::{Batch, Kinetics, Outcome, Signal, SignalRead, Species};

/// One formula of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// The species whose rate it is, or the name that it gets.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// A law as text.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// What the law is called.
    pub name: String,
    /// Species, in order.
    pub species: Vec<Species>,
    /// Parameters with their values.
    pub parameters: Vec<(super::Parameter, f64)>,
    /// Names for parts of formulas, in any order.
    pub lets: Vec<Formula>,
    /// Rates; species without one do not react.
    pub rates: Vec<Formula>,
    /// The length factor.
    pub length_factor: Option<String>,
}

/// Which formula of a law is wrong, and how.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawError {
    /// Which.
    pub formula: Which,
    /// How and where in its text.
    pub error: FormulaError,
}

/// A formula of a law.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Which {
    /// The k-th of `lets`.
    Let(usize),
    /// The k-th of `rates`.
    Rate(usize),
    /// The length factor.
    LengthFactor,
}

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

/// Kinetics from formulas.
#[derive(Debug)]
pub struct FormulaKinetics {
    descriptor: Descriptor,
    parameters: Vec<f64>,
    rates: Program,
    rate_partials: Program,
    factor: Option<(Program, Program)>,
}

/// What names stand for while formulas are put into the graph.
struct Names<'a> {
    law: &'a Law,
    lets: Vec<(String, Id)>,
    /// Columns of all signals, by name; numbers follow those of the species.
    columns: Vec<&'static str>,
}

impl Names<'_> {
    fn find(&self, graph: &mut Graph, name: &str) -> Result<Id, String> {
        if let Some((_, id)) = self.lets.iter().rev().find(|(known, _)| known == name) {
            return Ok(*id);
        }
        if let Some(s) = self.law.species.iter().position(|s| s.name == name) {
            return Ok(graph.input(crate::num::index(s)));
        }
        if let Some((_, value)) = self.law.parameters.iter().find(|(p, _)| p.name == name) {
            return Ok(graph.constant(*value));
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
        all.extend(self.law.parameters.iter().map(|(p, _)| p.name.as_str()));
        all.extend(self.columns.iter().copied());
        all.extend(SHORT.iter().map(|(short, _)| *short));
        let list = all.join(", ");
        Err(match nearest(name, all.iter().copied()) {
            Some(near) => format!("did you mean `{near}`? There are {list}"),
            None => format!("there are {list}"),
        })
    }
}

impl Names<'_> {
    /// Puts all `let`s into the graph, each after those that it is made of.
    fn define(&mut self, graph: &mut Graph) -> Result<(), LawError> {
        let law = self.law;
        let wrong = |k: usize| move |error| LawError { formula: Which::Let(k), error };
        let mut waiting = Vec::new();
        for (k, part) in law.lets.iter().enumerate() {
            let taken = law.species.iter().any(|s| s.name == part.name)
                || law.parameters.iter().any(|(p, _)| p.name == part.name);
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

impl FormulaKinetics {
    /// Makes `law` ready.
    ///
    /// # Errors
    /// The first formula that is wrong.
    pub fn new(law: &Law) -> Result<Self, LawError> {
        let mut graph = Graph::default();
        let columns = Signal::ALL.iter().flat_map(|s| s.columns()).copied().collect();
        let mut names = Names { law, lets: Vec::new(), columns };
        names.define(&mut graph)?;
        let zero = graph.constant(0.0);
        let mut rates = vec![zero; law.species.len()];
        for (k, rate) in law.rates.iter().enumerate() {
            let wrong = |error| LawError { formula: Which::Rate(k), error };
            let id = insert(&mut graph, &names, &rate.text).map_err(wrong)?;
            if let Some(s) = law.species.iter().position(|s| s.name == rate.name) {
                rates[s] = id;
            }
        }
        // The length factor sees no signals, not even through `let`s.
        let mut factor = None;
        if let Some(text) = &law.length_factor {
            let wrong = |error| LawError { formula: Which::LengthFactor, error };
            let id = insert(&mut graph, &names, text).map_err(wrong)?;
            if let Some(column) = first_signal(&graph, id, law.species.len()) {
                let message = format!(
                    "the length factor reads the signal {}; it is of species and parameters alone",
                    names.columns[column]
                );
                return Err(wrong(FormulaError::new(0..text.len(), message)));
            }
            factor = Some(id);
        }
        Ok(Self::compile(law, graph, &names.columns, &rates, factor))
    }

    fn compile(
        law: &Law,
        mut graph: Graph,
        columns: &[&'static str],
        rates: &[Id],
        factor: Option<Id>,
    ) -> Self {
        let species = law.species.len();
        // Signals of which any column is read, in the order of all.
        let read = inputs(&graph, rates);
        let mut signals = Vec::new();
        let mut number_of = vec![None; species + columns.len()];
        for s in 0..species {
            number_of[s] = Some(s);
        }
        let (mut column, mut next) = (species, species);
        for signal in Signal::ALL {
            let count = signal.columns().len();
            if (column..column + count).any(|c| read.contains(&c)) {
                for k in 0..count {
                    number_of[column + k] = Some(next + k);
                }
                next += count;
                signals.push(SignalRead { signal, typical: 1.0 });
            }
            column += count;
        }
        let mut wanted = rates.to_vec();
        let all: Vec<usize> = (0..number_of.len()).filter(|k| number_of[*k].is_some()).collect();
        for &rate in rates {
            for &input in &all {
                wanted.push(graph.slope(rate, crate::num::index(input)));
            }
        }
        let program = |graph: &Graph, outputs: &[Id]| {
            let mut program = Program::new(graph, outputs);
            program.renumber(&number_of);
            program
        };
        let factor = factor.map(|id| {
            let mut wanted = vec![id];
            wanted.extend((0..species).map(|s| graph.slope(id, crate::num::index(s))));
            (program(&graph, &[id]), program(&graph, &wanted))
        });
        let (parameters, values): (Vec<_>, Vec<f64>) = law.parameters.iter().cloned().unzip();
        let capabilities = Capabilities {
            rate_partials: true,
            length_factor: factor.is_some(),
            length_factor_partials: factor.is_some(),
        };
        let descriptor = Descriptor {
            id: format!("formula.{}", law.name),
            name: law.name.clone(),
            version: String::new(),
            author: String::new(),
            licence: String::new(),
            doc: law.rates.iter().map(|r| format!("d{}/dt = {}; ", r.name, r.text)).collect(),
            species: law.species.clone(),
            parameters: parameters
                .into_iter()
                .zip(&values)
                .map(|(p, value)| super::Parameter { default: Default::Value(*value), ..p })
                .collect(),
            signals,
            capabilities,
        };
        Self {
            descriptor,
            parameters: values,
            rates: program(&graph, rates),
            rate_partials: program(&graph, &wanted),
            factor,
        }
    }

    /// Operations a point: of the rates, and of the rates with their partial derivatives.
    #[must_use]
    pub fn operations(&self) -> (usize, usize) {
        (self.rates.operations(), self.rate_partials.operations())
    }
}

fn insert(graph: &mut Graph, names: &Names<'_>, text: &str) -> Result<Id, FormulaError> {
    let tree = parse::parse(text)?;
    graph.insert(&tree, &mut |graph, name| names.find(graph, name))
}

/// Numbers of the inputs that `nodes` read.
fn inputs(graph: &Graph, nodes: &[Id]) -> Vec<usize> {
    let mut needed = vec![false; graph.ops().len()];
    nodes.iter().for_each(|n| needed[*n as usize] = true);
    let mut read = Vec::new();
    for k in (0..needed.len()).rev() {
        if needed[k] {
            let op = graph.ops()[k];
            if let graph::Op::Input(number) = op {
                read.push(number as usize);
            }
            op.operands().into_iter().flatten().for_each(|o| needed[o as usize] = true);
        }
    }
    read
}

fn first_signal(graph: &Graph, node: Id, species: usize) -> Option<usize> {
    inputs(graph, &[node]).into_iter().find(|n| *n >= species).map(|n| n - species)
}

impl Kinetics for FormulaKinetics {
    fn descriptor(&self) -> &Descriptor {
        &self.descriptor
    }

    fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    fn rates(&self, batch: &Batch<'_>, rates: &mut [&mut [f64]]) -> Outcome {
        let inputs = [batch.species, batch.signals].concat();
        self.rates.run(&inputs, batch.count, rates);
        Ok(None)
    }

    fn rate_partials(
        &self,
        batch: &Batch<'_>,
        rates: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let inputs = [batch.species, batch.signals].concat();
        let mut all: Vec<&mut [f64]> = Vec::with_capacity(rates.len() + partials.len());
        all.extend(rates.iter_mut().map(|column| &mut **column));
        all.extend(partials.iter_mut().map(|column| &mut **column));
        self.rate_partials.run(&inputs, batch.count, &mut all);
        Ok(None)
    }

    fn length_factor(&self, batch: &Batch<'_>, factor: &mut [f64]) -> Outcome {
        match &self.factor {
            Some((program, _)) => program.run(batch.species, batch.count, &mut [factor]),
            None => factor.fill(1.0),
        }
        Ok(None)
    }

    fn length_factor_partials(
        &self,
        batch: &Batch<'_>,
        factor: &mut [f64],
        partials: &mut [&mut [f64]],
    ) -> Outcome {
        let Some((_, program)) = &self.factor else {
            factor.fill(1.0);
            partials.iter_mut().for_each(|column| column.fill(0.0));
            return Ok(None);
        };
        let mut all: Vec<&mut [f64]> = vec![factor];
        all.extend(partials.iter_mut().map(|column| &mut **column));
        program.run(batch.species, batch.count, &mut all);
        Ok(None)
    }
}
