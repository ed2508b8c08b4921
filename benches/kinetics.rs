//! Time per field evaluation at 20 000 points: the same laws compiled into the engine, as plugins
//! through the boundary, and as text.
//!
//! The built-in ones are the plugins' own source in this program, called in a plain loop. Beside
//! them stand laws with derivatives by hand: the fastest that this interface allows. After
//! criterion's own figures comes a table of ratios, measured turn by turn.
//!
//! Build the plugins first: `cargo build --release -p curvature-feedback -p tension-feedback`.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rumple::kinetics::formula::FormulaKinetics;
use rumple::kinetics::{
    Batch, Feedback, Kinetics, Library, Location, PluginSearch, Quantity, field,
};
use rumple::scene::Scene;

#[path = "kinetics/laws.rs"]
mod laws;

use laws::curvature_feedback::CurvatureFeedback;
use laws::tension_feedback::TensionFeedback;
use laws::{BuiltIn, CurvatureByHand, InProgram, TensionByHand};

const POINTS: usize = 20_000;

fn kinetics(criterion: &mut Criterion) {
    // The bench runs from target/release/deps; the plugins are one level up.
    let executable = std::env::current_exe().expect("an executable");
    let directory = executable.ancestors().nth(2).expect("a target directory").to_owned();
    let search = PluginSearch::in_directories(vec![directory]);
    let fraction = |k: usize| (rumple::num::real(k) * 0.618_033_988_749_894_9).fract();
    let species: Vec<f64> = (0..POINTS).map(|k| 0.2 * fraction(k)).collect();

    for (name, scene, scale) in [
        ("curvature-feedback", "models/model-i/formula.toml", 0.2),
        ("tension-feedback", "models/model-ii/formula.toml", 3e4),
    ] {
        let path = search.resolve(name, Path::new(".")).expect("the plugins are built");
        let library = Library::load(&path).expect("a plugin");
        let native = library.instantiate(&BTreeMap::new()).expect("an instance");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
        let scene = Scene::load(&path, &[]).expect("a scene");
        let law = scene.kinetics.first().and_then(|k| k.law()).expect("a law");
        let text = FormulaKinetics::new(&law).expect("formulas");
        let signals: Vec<f64> = (0..POINTS).map(|k| scale * (fraction(7 * k) - 0.5)).collect();
        let built_in: [Box<dyn Kinetics>; 2] = if name == "curvature-feedback" {
            let law = BuiltIn::<CurvatureFeedback>::new(native.parameters());
            let by_hand = CurvatureByHand(native.parameters().try_into().expect("parameters"));
            [Box::new(InProgram::new(&native, law)), Box::new(InProgram::new(&native, by_hand))]
        } else {
            let law = BuiltIn::<TensionFeedback>::new(native.parameters());
            let by_hand = TensionByHand(native.parameters().try_into().expect("parameters"));
            [Box::new(InProgram::new(&native, law)), Box::new(InProgram::new(&native, by_hand))]
        };
        let laws: [(&str, &dyn Kinetics); 4] = [
            ("built in", &*built_in[0]),
            ("by hand", &*built_in[1]),
            ("plugin", &native),
            ("text", &text),
        ];
        for (kind, law) in laws {
            measure(criterion, &format!("{name}, {kind}"), law, &species, &signals);
        }
        compare(name, &laws, &species, &signals);
    }
}

/// Prints medians of single evaluations, each law in turn, so that all see the same machine.
fn compare(name: &str, laws: &[(&str, &dyn Kinetics)], species: &[f64], signals: &[f64]) {
    const ROUNDS: usize = 400;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (species, signals) = ([species.into()], [signals.into()]);
    let (location, first, count) = (Location::Vertex, 0, POINTS);
    let (species, signals) = (&species[..], &signals[..]);
    let batch = Batch { location, first, count, species, signals, parameters: &[] };
    let still = Batch { signals: &[], ..batch };
    let mut values = vec![0.0; POINTS];
    let mut partials = field::Columns::new(2, POINTS);
    let what = ["rates", "rates and partials", "length factor and partials"];
    let mut times = vec![[const { Vec::new() }; 3]; laws.len()];
    // All within the pool: to hand work to another thread takes longer than the work.
    pool.install(|| {
        for (which, law) in (0..ROUNDS).flat_map(|_| laws.iter().enumerate()) {
            let times = &mut times[which];
            let partials = &mut partials.slices_mut();
            for (quantity, times) in times.iter_mut().enumerate() {
                let start = Instant::now();
                let outcome = match quantity {
                    0 => field::evaluate(
                        law.1,
                        Quantity::Rates,
                        black_box(&batch),
                        &mut [&mut values],
                        &mut [],
                    ),
                    1 => field::evaluate(
                        law.1,
                        Quantity::Rates,
                        &batch,
                        &mut [&mut values],
                        partials,
                    ),
                    _ => field::evaluate(
                        law.1,
                        Feedback::LengthFactor.into(),
                        &still,
                        &mut [&mut values],
                        &mut partials[..1],
                    ),
                };
                outcome.expect("numbers");
                times.push(start.elapsed().as_secs_f64());
            }
        }
    });
    println!("\n{name}: nanoseconds a point, one thread (ratio to built in)");
    for (quantity, what) in what.iter().enumerate() {
        let mut line = format!("{what:<28}");
        let median = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            times[ROUNDS / 2] * 1e9 / rumple::num::real(POINTS)
        };
        let reference = median(&mut times[0][quantity]);
        for (law, times) in laws.iter().zip(&mut times) {
            let median = median(&mut times[quantity]);
            line += &format!("  {} {median:.2} ({:.2})", law.0, median / reference);
        }
        println!("{line}");
    }
}

fn measure(
    criterion: &mut Criterion,
    name: &str,
    model: &dyn Kinetics,
    species: &[f64],
    signals: &[f64],
) {
    let (species, signals) = ([species.into()], [signals.into()]);
    let (location, first, count) = (Location::Vertex, 0, POINTS);
    let batch =
        Batch { location, first, count, species: &species, signals: &signals, parameters: &[] };
    let still = Batch { signals: &[], ..batch };
    let mut values = vec![0.0; POINTS];
    let mut partials = field::Columns::new(2, POINTS);

    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(u64::try_from(POINTS).expect("a count")));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads");
        group.bench_function(format!("rates/{threads}"), |bencher| {
            let mut run = || {
                field::evaluate(
                    model,
                    Quantity::Rates,
                    black_box(&batch),
                    &mut [&mut values],
                    &mut [],
                )
            };
            pool.install(|| bencher.iter(&mut run));
        });
        group.bench_function(format!("rates and partials/{threads}"), |bencher| {
            let mut partials = partials.slices_mut();
            let mut run = || {
                let batch = black_box(&batch);
                field::evaluate(model, Quantity::Rates, batch, &mut [&mut values], &mut partials)
            };
            pool.install(|| bencher.iter(&mut run));
        });
        group.bench_function(format!("length factor and partials/{threads}"), |bencher| {
            let mut partials = partials.slices_mut();
            let mut run = || {
                let batch = black_box(&still);
                let partials = &mut partials[..1];
                field::evaluate(
                    model,
                    Feedback::LengthFactor.into(),
                    batch,
                    &mut [&mut values],
                    partials,
                )
            };
            pool.install(|| bencher.iter(&mut run));
        });
    }
}

criterion_group!(benches, kinetics);
criterion_main!(benches);
