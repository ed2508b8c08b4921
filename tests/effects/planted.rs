//! Faults that are planted into a right energy and a right transport: the kit finds each.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::prelude::*;
use rumple::kinetics::Location;
use rumple::kit::{Report, examine, examine_with_species, synthetic_law};
use serde::Serialize;

use crate::common::irregular;

/// What is wrong, by name; "" for nothing.
#[derive(Debug, Clone, Copy, Serialize)]
struct Planted {
    transport: bool,
    fault: &'static str,
}

#[typetag::serialize(name = "test-planted")]
impl EffectSpec for Planted {
    fn needs(&self) -> Needs {
        Needs { species: self.transport, out_of_plane: Some("kind"), ..Needs::default() }
    }

    fn build(&self, _: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(match self {
            Self { fault: "nothing", .. } => Effect::default(),
            Self { fault: "no pin", .. } => Effect::pins(vec![[false; 3]; 72]),
            Self { transport: true, .. } => Effect::transport(*self),
            Self { transport: false, .. } => Effect::contact(*self),
        })
    }
}

impl Planted {
    /// NaN if that is planted, else the value.
    fn or_nan(self, fault: &str, value: f64) -> f64 {
        if self.fault == fault { f64::NAN } else { value }
    }
}

/// U = ½ Σ |x|².
impl Energy for Planted {
    type Work = ();

    fn name(&self) -> &'static str {
        "planted"
    }

    fn coupling(&self) -> Coupling {
        Coupling { low_rank: true, ..Coupling::NONE }
    }

    fn reads(&self) -> Reads<'_> {
        Reads::time(self.fault == "path")
    }

    fn evaluate(&self, shape: &Shape<'_>, (): &mut (), gradient: Option<&mut [Vec3]>) -> f64 {
        let energy: f64 = 0.5 * shape.x.iter().map(Vec3::norm_squared).sum::<f64>();
        let Some(gradient) = gradient else { return self.or_nan("energy alone", energy) };
        gradient.iter_mut().zip(shape.x).for_each(|(g, x)| *g += x);
        gradient[3].y += self.or_nan("gradient", 0.0);
        self.or_nan("energy", energy)
    }

    fn add_hessian(&self, _: &Shape<'_>, (): &mut (), part: HessianPart, into: &mut BlockMatrix) {
        let fault = if part == HessianPart::Full { "hessian" } else { "positive part" };
        let block = Block::from_diagonal_element(self.or_nan(fault, 1.0));
        into.update_rows(|i, row| row.add(i, &block));
    }

    fn low_rank(
        &self,
        shape: &Shape<'_>,
        (): &mut (),
        _: HessianPart,
        terms: &mut Vec<RankOneTerm>,
    ) {
        let stiffness = self.or_nan("low rank", 0.0);
        let direction = vec![Vec3::x() * self.or_nan("direction", 1.0); shape.x.len()];
        terms.push(RankOneTerm { stiffness, direction });
    }

    fn mixed_derivatives(
        &self,
        _: &Shape<'_>,
        _: &Conditions<'_>,
        (): &mut (),
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        if by == ParameterField::OptimalLength {
            emit(0, 0, Vec3::x() * self.or_nan("metric", 0.0));
        }
    }
}

/// It allows all steps and refuses no start.
impl Contact for Planted {
    fn interaction(&self) -> Interaction {
        Interaction { pairs: false, limits_steps: true, touches: true }
    }

    fn largest_step(&self, _: &Shape<'_>, (): &mut (), _: &[Vec3]) -> f64 {
        if self.fault == "step" { -0.5 } else { 1.0 }
    }

    fn allows_path(&self, _: &Shape<'_>, (): &mut (), _: (&[Vec3], f64)) -> bool {
        self.fault != "path"
    }

    fn touching(&self, _: &Shape<'_>, (): &mut ()) -> Touching {
        Touching { pairs: usize::from(self.fault == "pairs"), gap: f64::INFINITY }
    }

    fn refusal(&self, _: &Shape<'_>, (): &mut ()) -> Option<String> {
        (self.fault == "separated").then(|| "planted".to_owned())
    }

    fn separate(&self, shape: &Shape<'_>, (): &mut (), _: &Pins) -> Option<SeparatedStart> {
        let x = shape.x.to_vec();
        (self.fault == "separated").then_some(SeparatedStart { x, pairs: 1, moved: 0.0 })
    }
}

/// Hopping along edges, the faster the shorter they are: dc_i/dt = Σ_j (c_j - c_i)/|x_j - x_i|².
impl Transport for Planted {
    type Operator = Vec<f64>;

    fn name(&self) -> &'static str {
        "planted"
    }

    fn species(&self) -> usize {
        usize::from(self.fault == "species")
    }

    fn assemble(&self, sheet: &Sheet, x: &[Vec3], rates: &mut Vec<f64>) {
        if self.fault == "stale" && !rates.is_empty() {
            return;
        }
        rates.clear();
        rates.extend(sheet.edges().iter().map(|edge| {
            let [a, b] = edge.vertices.map(|v| x[v as usize]);
            1.0 / (b - a).norm_squared()
        }));
    }

    fn add_rate(&self, (sheet, _): (&Sheet, f64), rates: &Vec<f64>, c: &[f64], out: &mut [f64]) {
        if self.fault == "overwrites" {
            out.fill(0.0);
        }
        for (edge, rate) in sheet.edges().iter().zip(rates) {
            let [i, j] = edge.vertices.map(|v| v as usize);
            out[i] += rate * (c[j] - c[i]);
            out[j] += rate * (c[i] - c[j]);
        }
        match self.fault {
            "rate" => out[4] = f64::NAN,
            "source" => out[4] += 1.0,
            "quadratic" => out[4] += c[4] * c[4],
            "threads" => out[4] *= 1.0 + 1e-14 * rayon::current_num_threads() as f64,
            _ => {}
        }
    }

    fn spectral_bound(&self, _: (&Sheet, f64), rates: &Vec<f64>) -> f64 {
        let largest = rates.iter().copied().fold(0.0, f64::max);
        let bound = if self.fault == "low bound" { largest } else { 24.0 * largest };
        self.or_nan("bound", bound)
    }

    fn entries(
        &self,
        (sheet, _): (&Sheet, f64),
        rates: &Vec<f64>,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        for (k, (edge, rate)) in sheet.edges().iter().zip(rates).enumerate() {
            let wrong = if k == 5 && self.fault == "entries" { 1.0001 } else { 1.0 };
            let [i, j] = edge.vertices.map(|v| v as usize);
            for (row, column) in [(i, j), (j, i)] {
                emit(row, column, self.or_nan("entry", wrong * rate));
                emit(row, row, -rate);
            }
        }
        if self.fault == "outside" {
            emit(0, sheet.vertex_count(), 1.0);
        }
    }

    fn shape_derivatives(
        &self,
        (sheet, _): (&Sheet, f64),
        rates: &Vec<f64>,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let wrong = if self.fault == "derivatives" { -1.0 } else { 1.0 };
        for (edge, rate) in sheet.edges().iter().zip(rates) {
            let [i, j] = edge.vertices.map(|v| v as usize);
            let by_i = wrong * 2.0 * rate * rate * (c[j] - c[i]) * (x[j] - x[i]);
            let by_i = by_i * self.or_nan("derivative", 1.0);
            for (row, by_i) in [(i, by_i), (j, -by_i)] {
                emit(row, i, by_i);
                emit(row, j, -by_i);
            }
        }
    }
}

fn report(transport: bool, fault: &'static str) -> Report {
    let sheet = Arc::new(irregular(9, 8, 0.25));
    assert_eq!(sheet.vertex_count(), 72);
    let kinetics = synthetic_law(&["c"]);
    let kinetics = transport.then_some((&kinetics, Location::Vertex));
    examine_with_species(&Planted { transport, fault }, &sheet, None, kinetics).unwrap()
}

fn found(transport: bool, fault: &'static str, words: &str) {
    let report = report(transport, fault);
    assert!(report.faults.iter().any(|f| f.contains(words)), "{fault}: {:?}", report.faults);
}

#[test]
fn without_a_planted_fault_none_is_found() {
    for transport in [false, true] {
        assert_eq!(report(transport, "").faults, Vec::<String>::new());
    }
    // It hops from vertex to vertex, whatever their areas and whatever the values are amounts per.
    let hopping = report(true, "");
    assert!(!hopping.keeps_constants && !hopping.conserves_totals);
}

#[test]
fn what_is_not_finite_in_an_energy_is_found() {
    for fault in [
        "energy",
        "energy alone",
        "gradient",
        "hessian",
        "positive part",
        "low rank",
        "direction",
        "metric",
    ] {
        found(false, fault, "not finite");
    }
}

#[test]
fn contact_that_contradicts_its_energy_is_found() {
    for (fault, words) in [
        ("step", "not a share"),
        ("energy alone", "step that it allows"),
        ("path", "does not allow a shape to stay"),
        ("pairs", "pairs touch"),
        ("separated", "start that it has separated"),
    ] {
        found(false, fault, words);
    }
}

#[test]
fn wrong_transports_are_found() {
    for fault in ["rate", "entry", "bound", "derivative"] {
        found(true, fault, "not finite");
    }
    for (fault, words) in [
        ("entries", "entries"),
        ("outside", "entry"),
        ("low bound", "bound"),
        ("source", "linear"),
        ("quadratic", "linear"),
        ("overwrites", "added"),
        ("stale", "before"),
        ("derivatives", "positions"),
        ("threads", "threads"),
        ("species", "species"),
    ] {
        found(true, fault, words);
    }
}

#[test]
fn an_effect_that_brings_nothing_is_a_fault() {
    for fault in ["nothing", "no pin"] {
        let sheet = Arc::new(irregular(9, 8, 0.25));
        let report = examine(&Planted { transport: false, fault }, &sheet, None).unwrap();
        assert_eq!(report.faults.len(), 1, "{fault}: {:?}", report.faults);
    }
}
