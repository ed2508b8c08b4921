//! One sheet over ranks: each keeps its part with two rings of ghosts, and all take the steps of one process.
//!
//! Here ranks are threads that exchange messages by channels; what they say to one another is the same as over MPI.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rumple::effects::{
    ActiveTension, Axes, Bending, Diffusion, Field, Material, ObstacleShape, ObstacleSpec, Pin,
    Pressure, Region, Stretching,
};
use rumple::kinetics::Feedback;
use rumple::kinetics::formula::{FormulaKinetics, Law};
use rumple::model::{Policy, State};
use rumple::num::checked::{Finite, Positive};
use rumple::reduction::Communicator;
use rumple::sheet::{Lattice, Sheet, SheetShape, Subdomain, generate, is_turned};
use rumple::solve::equilibrium::{LbfgsSpec, Preconditioner};
use rumple::solve::staggered::StaggeredSpec;
use rumple::{Problem, Vec3, problem};

/// A rank that is a thread.
pub struct ThreadRank {
    rank: usize,
    to: Vec<Sender<Vec<f64>>>,
    from: Vec<Mutex<Receiver<Vec<f64>>>>,
}

impl ThreadRank {
    pub fn all(size: usize) -> Vec<Arc<dyn Communicator>> {
        let mut to: Vec<Vec<Sender<Vec<f64>>>> = vec![Vec::new(); size];
        let mut from: Vec<Vec<Mutex<Receiver<Vec<f64>>>>> = (0..size).map(|_| Vec::new()).collect();
        for sender in &mut to {
            for receiver in &mut from {
                let (send, receive) = channel();
                sender.push(send);
                receiver.push(Mutex::new(receive));
            }
        }
        let all = to.into_iter().zip(from).enumerate();
        all.map(|(rank, (to, from))| Arc::new(Self { rank, to, from }) as Arc<dyn Communicator>)
            .collect()
    }

    fn receive(&self, from: usize) -> Vec<f64> {
        let patience = Duration::from_secs(120);
        let message = self.from[from].lock().unwrap().recv_timeout(patience);
        message.expect("another rank asks for nothing, or has ended")
    }

    /// What every rank has, by rank.
    fn gathered(&self, values: &[f64]) -> Vec<Vec<f64>> {
        self.to.iter().for_each(|to| to.send(values.to_vec()).expect("another rank has ended"));
        (0..self.to.len()).map(|rank| self.receive(rank)).collect()
    }

    fn combine(&self, values: &mut [f64], with: fn(f64, f64) -> f64) {
        let all = self.gathered(values);
        for (k, value) in values.iter_mut().enumerate() {
            assert!(all.iter().all(|other| other.len() == all[0].len()), "different reductions");
            *value = all.iter().map(|other| other[k]).reduce(with).unwrap();
        }
    }
}

impl Communicator for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.to.len()
    }

    fn sum(&self, values: &mut [f64]) {
        self.combine(values, |a, b| a + b);
    }

    fn max(&self, values: &mut [f64]) {
        self.combine(values, |a, b| if a.is_nan() || a > b { a } else { b });
    }

    fn exchange(&self, send: &[(usize, Vec<f64>)], receive: &mut [(usize, Vec<f64>)]) {
        for (rank, values) in send {
            self.to[*rank].send(values.clone()).expect("another rank has ended");
        }
        for (rank, values) in receive {
            let message = self.receive(*rank);
            assert_eq!(message.len(), values.len(), "the ranks send other ghosts");
            *values = message;
        }
    }

    fn all_gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        // A number a byte, and back by its bits.
        let values: Vec<f64> = bytes.iter().map(|b| f64::from_bits(u64::from(*b))).collect();
        let all = self.gathered(&values).into_iter();
        all.map(|values| values.iter().map(|v| v.to_bits().to_le_bytes()[0]).collect()).collect()
    }
}

/// Held at its edge.
fn disc() -> Sheet {
    generate(&SheetShape::Disc { radius: 5.0 }, 250, 3).unwrap()
}

/// Steps under drag end where a share of this allows: the shape depends on the linear solver by as much.
const TIGHT: Positive = Positive::constant(1e-4);

/// A dome under pressure that grows where the species is.
fn problem(sheet: Sheet, method: &str, policy: Policy) -> Problem<'static> {
    let law = Law::named("patches")
        .parameter("k", 2.0)
        .species("c", "k*(0.5 + 0.5*tanh(x) - c)")
        .length_factor("1 + 0.2*c")
        .feedback(Feedback::Curvature, "0.05*c");
    let law = problem::Law::new(Arc::new(FormulaKinetics::new(&law).unwrap()));
    let below = ObstacleShape::Plane {
        point: [Finite::ZERO, Finite::ZERO, Finite::constant(-0.1)],
        normal: [Finite::ZERO, Finite::ZERO, Finite::ONE],
    };
    let problem = Problem::on(sheet)
        .material(Material { young: 1e3, poisson: 1.0 / 3.0, thickness: 0.3 })
        .effect(Stretching::default())
        .effect(Bending::default())
        .effect(Pressure { value: Finite::ONE, ramp: None })
        .effect(ObstacleSpec {
            shape: below,
            distance: None,
            stiffness: None,
            displacement: None,
            ramp: None,
        })
        .effect(ActiveTension { value: Field::Formula("5*c".into()), fibre: None, ramp: None })
        .effect(Pin {
            region: Region::Boundary,
            axes: Axes([true; 3]),
            displacement: None,
            ramp: None,
        })
        .effect(Diffusion::new("c", Some(Field::Formula("0.4 + 0.1*c".into()))))
        .law(law)
        .policy(policy)
        .integrator(StaggeredSpec { rtol: TIGHT, atol: TIGHT, ..StaggeredSpec::default() });
    match method {
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

/// What all ranks have, in the numbers of the whole.
fn on_ranks(
    whole: &Sheet,
    size: usize,
    method: &'static str,
    policy: Policy,
) -> (Vec<State>, Vec<u64>) {
    let handles: Vec<_> = ThreadRank::all(size)
        .into_iter()
        .map(|rank| {
            let part = Subdomain::cut(whole, rank).unwrap();
            std::thread::spawn(move || {
                let (state, iterations) = run(part.sheet.clone(), method, policy);
                (part, state, iterations)
            })
        })
        .collect();
    let all = handles.into_iter().map(|handle| handle.join().expect("a rank has failed"));
    let all: Vec<_> = all.collect();
    let states = all.iter().map(|(part, state, _)| {
        // Ghosts included, so that what they have is compared as well.
        let mut in_whole = State { time: state.time, step: state.step, ..State::default() };
        in_whole.x = vec![Vec3::repeat(f64::NAN); whole.vertex_count()].into();
        in_whole.species = vec![vec![f64::NAN; whole.vertex_count()]];
        for (i, &v) in part.vertices.iter().enumerate() {
            in_whole.x[v as usize] = state.x[i];
            in_whole.species[0][v as usize] = state.species[0][i];
        }
        in_whole
    });
    (states.collect(), all.iter().map(|(_, _, iterations)| *iterations).collect())
}

/// The largest difference where both have a value.
fn difference(a: &State, b: &State) -> f64 {
    let x = a.x.iter().zip(&*b.x).map(|(a, b)| (a - b).norm()).filter(|d| !d.is_nan());
    let c = a.species[0].iter().zip(&b.species[0]).map(|(a, b)| (a - b).abs());
    x.chain(c.filter(|d| !d.is_nan())).fold(0.0, f64::max)
}

#[test]
fn ranks_take_the_steps_of_one_process() {
    for (method, policy, size) in [
        ("factor", Policy::QuasiStatic, 3),
        ("blocks", Policy::QuasiStatic, 2),
        ("factor", Policy::Simultaneous, 4),
    ] {
        let whole = disc();
        let (alone, _) = run(disc(), method, policy);
        let moved = alone.x.iter().zip(whole.rest()).map(|(a, b)| (a - b).norm());
        assert!(moved.fold(0.0, f64::max) > 0.2, "{method}: nothing happens");
        let (states, iterations) = on_ranks(&whole, size, method, policy);
        let what = format!("{method}, {policy:?}, {size} ranks");
        for state in &states {
            assert_eq!((state.time, state.step), (states[0].time, states[0].step), "{what}");
            // Saddles are left by one process alone, and the controller may take one step more.
            assert!(alone.step.abs_diff(state.step) <= 1, "{what}: {} {}", alone.step, state.step);
            let error = difference(&alone, state);
            let most = if policy == Policy::QuasiStatic { 2e-5 } else { 1e-4 };
            assert!(error < most, "{what}: {error}");
        }
        assert!(iterations.iter().all(|count| *count == iterations[0]), "{what}: {iterations:?}");
    }
}

#[test]
fn a_law_that_fails_on_one_rank_ends_all() {
    let whole = disc();
    let handles: Vec<_> = ThreadRank::all(2)
        .into_iter()
        .map(|rank| {
            let part = Subdomain::cut(&whole, rank).unwrap();
            std::thread::spawn(move || {
                // No number where x and y are above 3, which is on the second rank only.
                let law = Law::named("root").species("c", "sqrt(3 - min(x, y))");
                let law = problem::Law::new(Arc::new(FormulaKinetics::new(&law).unwrap()));
                let problem = Problem::on(part.sheet.clone()).law(law);
                let mut stepper = problem.stepper().unwrap();
                stepper.prepare().and_then(|_| stepper.step(1.0)).unwrap_err().to_string()
            })
        })
        .collect();
    let all = handles.into_iter().map(|handle| handle.join().expect("a rank has panicked"));
    let all: Vec<String> = all.collect();
    assert_eq!(all[0], "another rank has failed");
    assert!(
        all[1].contains("root") || all[1].contains("sqrt") || all[1].contains("NaN"),
        "{all:?}"
    );
}

#[test]
fn parts_make_up_the_sheet() {
    let whole = disc();
    for size in [1, 2, 3, 5, 8] {
        let cut = |rank| Subdomain::cut(&whole, rank).unwrap();
        make_up(&whole, &ThreadRank::all(size).into_iter().map(cut).collect::<Vec<_>>());
    }
    let few = generate(&SheetShape::Disc { radius: 1.0 }, 50, 1).unwrap();
    let rank = ThreadRank::all(100).remove(0);
    let error = Subdomain::cut(&few, rank).unwrap_err().to_string();
    assert!(error.contains("100 ranks"), "{error}");
}

#[test]
fn parts_of_a_lattice_are_made_without_the_rest() {
    for (size, vertices) in [([4.0, 3.0], 120), ([1.0, 9.0], 300), ([30.0, 2.0], 2000)] {
        let lattice = Lattice::new(size, vertices).unwrap();
        let whole = lattice.sheet().unwrap();
        assert_eq!(whole.vertex_count(), lattice.vertex_count());
        assert_eq!(whole.triangle_count(), lattice.triangle_count());
        for ranks in [1, 2, 3, 5, 8, 16] {
            let made = |rank| Subdomain::of_lattice(&lattice, rank).unwrap();
            let made: Vec<(Sheet, Subdomain)> =
                ThreadRank::all(ranks).into_iter().map(made).collect();
            for (around, part) in &made {
                let owned = part.sheet.reduction().owned(part.vertices.len());
                let rings = 6.0 * (part.vertices.len() - owned) as f64;
                assert!((around.vertex_count() as f64) < owned as f64 + 30.0 + rings);
                for (i, x) in around.rest().iter().enumerate() {
                    assert_eq!(*x, whole.rest()[around.number(i) as usize]);
                }
                let mut rest = around.rest().to_vec();
                part.restrict(&mut rest);
                assert_eq!(rest, part.sheet.rest());
            }
            make_up(&whole, &made.into_iter().map(|(_, part)| part).collect::<Vec<_>>());
        }
    }
    let few = Lattice::new([4.0, 3.0], 60).unwrap();
    let error = few.patch(0, 100).err().unwrap().to_string();
    assert!(error.contains("100 ranks"), "{error}");
}

/// Of 16 parts of a square four have no boundary; they were taken for closed sheets, and a run that turned one of them over was
/// refused.
#[test]
fn a_part_without_a_boundary_is_no_closed_sheet() {
    let sphere = generate(&SheetShape::Sphere { radius: 3.0, irregular: false }, 300, 1).unwrap();
    let lattice = Lattice::new([10.0, 10.0], 1000).unwrap().sheet().unwrap();
    for (whole, size, closed) in [(lattice, 16, false), (sphere, 3, true)] {
        let turned = |rank| {
            let sheet = Subdomain::cut(&whole, rank).unwrap().sheet;
            let dome: Vec<Vec3> =
                sheet.rest().iter().map(|x| x + 0.01 * x.xy().norm_squared() * Vec3::z()).collect();
            let other: Vec<Vec3> = dome.iter().map(|x| Vec3::new(x.x, x.y, -x.z)).collect();
            std::thread::spawn(move || {
                let inside = !sheet.boundary().contains(&true);
                (inside, is_turned(&sheet, &dome, &other), is_turned(&sheet, &dome, &dome))
            })
        };
        let handles: Vec<_> = ThreadRank::all(size).into_iter().map(turned).collect();
        let all: Vec<_> = handles.into_iter().map(|handle| handle.join().unwrap()).collect();
        assert!(all.iter().any(|(inside, ..)| *inside));
        assert!(all.iter().all(|(_, turned, same)| *turned == closed && !same), "{all:?}");
    }
}

/// Every vertex, edge and triangle of `whole` belongs to one of `parts`, with its neighbours.
fn make_up(whole: &Sheet, parts: &[Subdomain]) {
    let size = parts.len();
    {
        let mut owners = vec![0; whole.vertex_count()];
        let mut counted = vec![0; whole.triangle_count()];
        let mut edges = 0;
        for part in parts {
            let sheet = &part.sheet;
            let reduction = sheet.reduction();
            let owned = reduction.owned(sheet.vertex_count());
            part.vertices[..owned].iter().for_each(|v| owners[*v as usize] += 1);
            let own = reduction.owned(sheet.triangle_count());
            part.triangles[..own].iter().for_each(|t| counted[*t as usize] += 1);
            edges += sheet.edges().iter().filter(|edge| sheet.counts(&edge.vertices)).count();
            for (t, corners) in sheet.triangles().iter().enumerate() {
                assert_eq!(sheet.counts(corners), t < own);
                let there = whole.triangles()[part.triangles[t] as usize];
                assert_eq!(corners.map(|v| part.vertices[v as usize]), there);
            }
            for i in 0..owned {
                let there = part.vertices[i] as usize;
                let around = |sheet: &Sheet, v: usize| sheet.vertex_edges().entries(v).len();
                assert_eq!(around(sheet, i), around(whole, there), "neighbours of {there}");
            }
            let boundary = |i: usize| whole.boundary()[part.vertices[i] as usize];
            assert!((0..sheet.vertex_count()).all(|i| sheet.boundary()[i] == boundary(i)));
        }
        assert!(owners.iter().chain(&counted).all(|count| *count == 1), "{size} ranks");
        assert_eq!(edges, whole.edges().len());
        let euler: i64 = parts.iter().map(|part| part.sheet.euler_characteristic()).sum();
        assert_eq!(euler, whole.euler_characteristic());
        let most = parts.iter().map(|part| part.sheet.reduction().owned(part.vertices.len())).max();
        let row = 2 + whole.boundary().iter().filter(|b| **b).count() / 2;
        assert!(most.unwrap() <= whole.vertex_count().div_ceil(size) + row);
    }
}
