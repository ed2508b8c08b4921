//! One sheet over two ranks side by side: the sums, maxima and decisions of the solvers pass the reduction.
//!
//! Both ranks have the whole sheet, numbered from either end, and own the first half of their numbers. So a sum over
//! what a rank owns is right only once both are added, and ranks that branch apart no longer exchange the same sums.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rumple::effects::{
    Axes, Bending, Diffusion, DiffusionMetric, Material, Pin, Pressure, Region, Stretching,
};
use rumple::kinetics::formula::{FormulaKinetics, Law};
use rumple::model::{Policy, State};
use rumple::num::checked::{Finite, NonNegative};
use rumple::reduction::{AllReduce, Reduction};
use rumple::sheet::{Shape, Sheet, generate};
use rumple::solve::equilibrium::{LbfgsSpec, NewtonSpec, Preconditioner};
use rumple::{Problem, Vec3, problem};

struct Rank {
    number: usize,
    to: Sender<Vec<f64>>,
    from: Mutex<Receiver<Vec<f64>>>,
    /// Vertices and triangles of the sheet.
    counts: [usize; 2],
}

impl Rank {
    fn combine(&self, values: &mut [f64], with: fn(f64, f64) -> f64) {
        self.to.send(values.to_vec()).expect("the other rank has ended before");
        let patience = Duration::from_secs(120);
        let other = self.from.lock().unwrap().recv_timeout(patience);
        let other = other.expect("the other rank asks for no sum");
        assert_eq!(other.len(), values.len(), "the ranks ask for different sums");
        for (own, other) in values.iter_mut().zip(other) {
            // In the same order on both.
            *own = if self.number == 0 { with(*own, other) } else { with(other, *own) };
        }
    }
}

impl AllReduce for Rank {
    fn sum(&self, values: &mut [f64]) {
        self.combine(values, |a, b| a + b);
    }

    /// Both ranks have all elements.
    fn sum_over_elements(&self, values: &mut [f64]) {
        self.combine(values, |a, b| 0.5 * (a + b));
    }

    fn max(&self, values: &mut [f64]) {
        self.combine(values, |a, b| if a.is_nan() || a > b { a } else { b });
    }

    fn owned(&self, count: usize) -> usize {
        assert!(self.counts.contains(&count), "{count} points are neither vertices nor triangles");
        if self.number == 0 { count / 2 } else { count - count / 2 }
    }
}

/// Held at its edge: nothing is left to a gauge, whose springs every rank would choose for itself.
fn disc() -> Sheet {
    generate(&Shape::Disc { radius: 5.0 }, 250, 3).unwrap()
}

/// The same with its numbers in reverse.
fn reversed(sheet: &Sheet) -> Sheet {
    let last = u32::try_from(sheet.vertex_count()).unwrap() - 1;
    let rest = sheet.rest().iter().rev().copied().collect();
    let triangles = sheet.triangles().iter().rev().map(|t| t.map(|v| last - v)).collect();
    Sheet::new(rest, triangles).unwrap()
}

/// A dome under pressure that grows where the species is.
fn problem(sheet: Sheet, method: &str, policy: Policy) -> Problem<'static> {
    let law = Law::named("patches")
        .parameter("k", 2.0)
        .species("c", "k*(0.5 + 0.5*tanh(x) - c)")
        .length_factor("1 + 0.2*c");
    let law = problem::Law::new(Arc::new(FormulaKinetics::new(&law).unwrap()));
    let problem = Problem::on(sheet)
        .material(Material { young: 1e3, poisson: 1.0 / 3.0, thickness: 0.3 })
        .effect(Stretching::default())
        .effect(Bending::default())
        .effect(Pressure { value: Finite::ONE, ramp: None })
        .effect(Pin {
            region: Region::Boundary,
            axes: Axes([true; 3]),
            displacement: None,
            ramp: None,
        })
        .effect(Diffusion {
            species: "c".into(),
            coefficient: Some(NonNegative::new(0.5).unwrap().into()),
            scheme: None,
            metric: DiffusionMetric::default(),
        })
        .law(law)
        .policy(policy);
    match method {
        "newton" => problem.equilibrium(NewtonSpec::default()),
        "blocks" => problem.equilibrium(LbfgsSpec {
            preconditioner: Preconditioner::Blocks,
            ..LbfgsSpec::default()
        }),
        _ => problem.equilibrium(LbfgsSpec::default()),
    }
}

fn run(sheet: Sheet, method: &str, policy: Policy) -> (State, u64) {
    let mut stepper = problem(sheet, method, policy).stepper().unwrap();
    stepper.prepare().unwrap();
    while stepper.state.time < 1.0 {
        stepper.step(1.0).unwrap();
    }
    (stepper.state.clone(), stepper.model().tally().work().iterations)
}

/// The states on two ranks, the second in the numbers of the first.
fn on_two_ranks(method: &'static str, policy: Policy) -> [(State, u64); 2] {
    let whole = disc();
    let counts = [whole.vertex_count(), whole.triangle_count()];
    let ((to_b, from_a), (to_a, from_b)) = (channel(), channel());
    let sheets = [(to_b, from_b, disc()), (to_a, from_a, reversed(&whole))];
    let handles: Vec<_> = sheets
        .into_iter()
        .enumerate()
        .map(|(number, (to, from, sheet))| {
            let rank = Rank { number, to, from: Mutex::new(from), counts };
            let sheet = sheet.reduced_by(Reduction::over(Arc::new(rank)));
            std::thread::spawn(move || run(sheet, method, policy))
        })
        .collect();
    let mut all = handles.into_iter().map(|handle| handle.join().expect("a rank has failed"));
    let (a, mut b) = (all.next().unwrap(), all.next().unwrap());
    let x: Vec<Vec3> = b.0.x.iter().rev().copied().collect();
    b.0.x = x.into();
    b.0.species.iter_mut().for_each(|c| c.reverse());
    [a, b]
}

fn difference(a: &State, b: &State) -> f64 {
    let x = a.x.iter().zip(&*b.x).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    a.species[0].iter().zip(&b.species[0]).map(|(a, b)| (a - b).abs()).fold(x, f64::max)
}

#[test]
fn two_ranks_take_the_steps_of_one_process() {
    for (method, policy) in [
        ("factor", Policy::QuasiStatic),
        ("newton", Policy::QuasiStatic),
        ("blocks", Policy::QuasiStatic),
        ("factor", Policy::Simultaneous),
    ] {
        let (alone, iterations) = run(disc(), method, policy);
        let sheet = disc();
        let moved = alone.x.iter().zip(sheet.rest()).map(|(a, b)| (a - b).norm());
        assert!(moved.fold(0.0, f64::max) > 0.2, "{method}: nothing happens");
        let [a, b] = on_two_ranks(method, policy);
        assert_eq!((a.0.time, a.0.step), (b.0.time, b.0.step), "{method}");
        assert_eq!(a.1, b.1, "{method}: iterations of the two ranks");
        assert!(difference(&a.0, &b.0) < 2e-5, "{method}: {}", difference(&a.0, &b.0));
        assert_eq!(alone.step, a.0.step, "{method}");
        let share = a.1.abs_diff(iterations);
        assert!(10 * share <= iterations, "{method}: {} iterations for {iterations}", a.1);
        assert!(difference(&alone, &a.0) < 2e-5, "{method}: {}", difference(&alone, &a.0));
    }
}
