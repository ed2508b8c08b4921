//! Kinetics written as text: laws parsed, simplified, differentiated and run in blocks.
//!
//! ```text
//! dc/dt = R_c(c, signals)      one formula a species, of species, signals, parameters and `let`s
//! Φ     = Φ(c)                 the length factor, of species and parameters; so other feedback
//! ```
//!
//! Values of parameters become constants before anything is simplified. All partial derivatives are
//! exact and share what they have in common with the rates.

mod course;
mod derivative;
mod evaluation;
mod field_formula;
mod foreign_names;
mod graph;
mod interval;
mod kinks;
mod law;
mod names;
mod parse;
mod program;
mod species;
mod time_graph;

pub(crate) use course::FormulaCourse;
pub use law::{Formula, FormulaIndex, Law, LawError};
pub use parse::{FUNCTIONS, FormulaError, Function};

pub use field_formula::{FieldFormula, Places, time_dependence};
pub use species::SpeciesFormula;

use graph::{Graph, Id, TooLarge};
use kinks::Kinks;
use names::Names;
use program::Program;

use super::descriptor::{Capabilities, Descriptor, FORMULA};
use super::{Feedback, Signal, SignalRead};

/// Kinetics from formulas.
#[derive(Debug)]
pub struct FormulaKinetics {
    descriptor: Descriptor,
    parameters: Vec<f64>,
    /// Numbers of the parameters that differ from point to point.
    varying: Vec<usize>,
    unused_parameters: Vec<String>,
    unused_lets: Vec<String>,
    rates: Programs,
    feedback: Vec<(Feedback, Programs)>,
    observables: Programs,
    /// Times at which rates switch.
    kinks: Kinks,
}

/// A program of the values of a quantity, and one with their partial derivatives.
type Programs = (Program, Program);

/// Most species of a law as text: every rate is differentiated by each.
const MAX_SPECIES: usize = 512;

/// Numbers of inputs among those that a call has, by their numbers in the graph.
type InputIndices = Vec<Option<usize>>;

impl FormulaKinetics {
    /// Makes `law` ready.
    ///
    /// # Errors
    /// The first formula that is wrong.
    pub fn new(law: &Law) -> Result<Self, LawError> {
        if law.species.len() > MAX_SPECIES {
            let (text, count) =
                (law.rates.first().map_or("", |rate| &rate.text), law.species.len());
            let message =
                format!("the law has {count} species; as text it has at most {MAX_SPECIES}");
            let error = FormulaError::new(0..text.len(), message).help("write it as a plugin");
            return Err(LawError { formula: FormulaIndex::Rate(0), error });
        }
        let mut graph = Graph::with_budget(law.size());
        let mut names = Names::new(law);
        names.define(&mut graph)?;
        let zero = graph.constant(0.0);
        let mut rates = vec![zero; law.species.len()];
        for (k, rate) in law.rates.iter().enumerate() {
            let wrong = |error| LawError { formula: FormulaIndex::Rate(k), error };
            let id = insert(&mut graph, &names, &rate.text).map_err(wrong)?;
            if let Some(s) = law.species.iter().position(|s| s.name == rate.name) {
                rates[s] = id;
            }
        }
        let mut feedback = Vec::new();
        let grows = law.feedback.iter().any(|(which, _)| *which == Feedback::LengthFactor);
        for (k, (which, text)) in law.feedback.iter().enumerate() {
            let wrong = |error| LawError { formula: FormulaIndex::Feedback(k), error };
            if *which == Feedback::FactorAcross && !grows {
                let message = "a length factor across a fibre goes with the one along it";
                let error = FormulaError::new(0..text.len(), message);
                return Err(wrong(
                    error.help("add length_factor, \"1\" if nothing grows along it"),
                ));
            }
            let count = law.species.len();
            let id = insert_of_species(&mut graph, &names, (text, count), which.describe());
            feedback.push((*which, id.map_err(wrong)?));
        }
        let mut observables = Vec::new();
        for (k, (_, text)) in law.observables.iter().enumerate() {
            let wrong = |error| LawError { formula: FormulaIndex::Observable(k), error };
            observables.push(insert(&mut graph, &names, text).map_err(wrong)?);
        }
        let read = names.read();
        let mut kinetics = Self::compile(law, graph, &rates, &feedback, &observables)?;
        let all = law.parameters.iter().map(|p| &p.name);
        kinetics.unused_parameters = all.filter(|name| !read.contains(*name)).cloned().collect();
        let lets = law.lets.iter().map(|part| &part.name);
        kinetics.unused_lets = lets.filter(|name| !read.contains(*name)).cloned().collect();
        Ok(kinetics)
    }

    fn compile(
        law: &Law,
        mut graph: Graph,
        rates: &[Id],
        feedback: &[(Feedback, Id)],
        observables: &[Id],
    ) -> Result<Self, LawError> {
        let species = law.species.len();
        let varying: Vec<usize> =
            (0..law.values.len()).filter(|k| law.values[*k].is_none()).collect();
        let reading = |nodes: &[Id]| numbers(species, varying.len(), &inputs(&graph, nodes));
        let (signals, of_rates) = reading(rates);
        let (observed, of_observables) = reading(observables);
        let (_, of_feedback) = reading(&[]);

        let read: usize = signals.iter().map(|s| s.signal.columns().len()).sum();
        let differentiated = (0..of_rates.len())
            .filter(|k| of_rates[*k].is_some_and(|number| number < species + read));
        // Which formula takes most room is not known: the first stands for all.
        let too_large = |large: TooLarge| LawError {
            formula: FormulaIndex::Rate(0),
            error: large.in_formula(law.rates.first().map_or("", |rate| &rate.text)),
        };
        let wanted = with_slopes(&mut graph, rates, differentiated).map_err(too_large)?;
        let by_species =
            |(which, id): &(_, Id)| Ok((*which, with_slopes(&mut graph, &[*id], 0..species)?));
        let feedback = feedback.iter().map(by_species);
        let feedback: Vec<_> = feedback.collect::<Result<_, _>>().map_err(too_large)?;
        let kinks = Kinks::of_rates(&mut graph, rates, species);
        graph.complete();
        let programs = |wanted: &[Id], outputs: usize, numbers: &InputIndices| {
            [&wanted[..outputs], wanted]
                .map(|wanted| {
                    let mut program = Program::new(&graph, wanted);
                    program.renumber(numbers);
                    program
                })
                .into()
        };
        let of_species =
            |(which, wanted): (_, Vec<Id>)| (which, programs(&wanted, 1, &of_feedback));
        let feedback: Vec<_> = feedback.into_iter().map(of_species).collect();
        let capabilities = capabilities(feedback.iter().map(|(which, _)| *which));
        let descriptor = Descriptor { signals, observed, capabilities, ..described(law) };
        Ok(Self {
            descriptor,
            parameters: law.values.iter().map(|v| v.unwrap_or(f64::NAN)).collect(),
            varying,
            unused_parameters: Vec::new(),
            unused_lets: Vec::new(),
            rates: programs(&wanted, rates.len(), &of_rates),
            feedback,
            observables: programs(observables, observables.len(), &of_observables),
            kinks,
        })
    }

    /// Operations a point: of the rates, and of the rates with their partial derivatives.
    #[must_use]
    pub fn operations(&self) -> (usize, usize) {
        (self.rates.0.operation_count(), self.rates.1.operation_count())
    }

    /// Parameters that neither rates nor length factor nor observables read, directly or by a `let`.
    #[must_use]
    pub fn unused_parameters(&self) -> &[String] {
        &self.unused_parameters
    }

    /// The same of `let`s.
    #[must_use]
    pub fn unused_lets(&self) -> &[String] {
        &self.unused_lets
    }
}

/// Which signals are read, in the order of all, and the numbers that inputs have in a call: species,
/// columns of the signals read, parameters that vary.
fn numbers(species: usize, varying: usize, read: &[usize]) -> (Vec<SignalRead>, InputIndices) {
    let mut number_of: InputIndices = (0..species).map(Some).collect();
    let mut signals = Vec::new();
    let mut next = species;
    for signal in Signal::ALL {
        let first = number_of.len();
        let columns = first..first + signal.columns().len();
        if columns.clone().any(|c| read.contains(&c)) {
            signals.push(SignalRead { signal, typical: 1.0 });
            number_of.extend(columns.map(|column| Some(next + column - first)));
            next += signal.columns().len();
        } else {
            number_of.extend(columns.map(|_| None));
        }
    }
    number_of.extend((0..varying).map(|k| Some(next + k)));
    (signals, number_of)
}

fn insert(graph: &mut Graph, names: &Names<'_>, text: &str) -> Result<Id, FormulaError> {
    let tree = parse::parse(text)?;
    graph.insert(&tree, &mut |graph, name| names.find(graph, name))
}

/// The same of species and parameters: `what` of the law sees no signals, not even through `let`s.
fn insert_of_species(
    graph: &mut Graph,
    names: &Names<'_>,
    (text, species): (&str, usize),
    what: &str,
) -> Result<Id, FormulaError> {
    let id = insert(graph, names, text)?;
    let Some(column) = first_signal(graph, id, species, names.columns.len()) else {
        return Ok(id);
    };
    let message = format!(
        "{what} reads the signal {}; it may depend on species and parameters only",
        names.columns[column]
    );
    Err(FormulaError::new(0..text.len(), message))
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

/// Nodes, followed by their derivatives by these inputs.
fn with_slopes(
    graph: &mut Graph,
    nodes: &[Id],
    inputs: impl Iterator<Item = usize> + Clone,
) -> Result<Vec<Id>, TooLarge> {
    let mut wanted = nodes.to_vec();
    for &node in nodes {
        for input in inputs.clone() {
            wanted.push(graph.slope(node, rumple_numerics::num::index(input))?);
        }
    }
    Ok(wanted)
}

fn first_signal(graph: &Graph, node: Id, species: usize, columns: usize) -> Option<usize> {
    let signals = species..species + columns;
    inputs(graph, &[node]).into_iter().find(|n| signals.contains(n)).map(|n| n - species)
}

/// Names, texts, species, parameters and observables of a law; what it reads and can do is left empty.
fn described(law: &Law) -> Descriptor {
    let rates = law.rates.iter().map(|r| format!("d{}/dt = {}", r.name, r.text));
    Descriptor {
        doc: rates.collect::<Vec<_>>().join("; "),
        species: law.species.clone(),
        parameters: law.parameters.clone(),
        observables: law.observables.iter().map(|(o, _)| o.clone()).collect(),
        ..Descriptor::named(format!("{FORMULA}{}", law.name), law.name.clone())
    }
}

/// What a law of formulas gives.
fn capabilities(feedback: impl Iterator<Item = Feedback>) -> Capabilities {
    let mut capabilities =
        Capabilities { rate_partials: true, parameter_fields: true, ..Capabilities::default() };
    feedback.for_each(|which| which.give(&mut capabilities));
    capabilities
}
