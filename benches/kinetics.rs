//! Time per field evaluation at 20 000 points: the shipped plugins through the boundary, and the
//! same laws as text.
//!
//! Build the plugins first: `cargo build --release -p curvature-feedback -p tension-feedback`.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rumple::kinetics::formula::FormulaKinetics;
use rumple::kinetics::{Batch, Kinetics, Library, Location, Search, field};
use rumple::scene::Scene;

const POINTS: usize = 20_000;

fn kinetics(criterion: &mut Criterion) {
    // The bench runs from target/release/deps; the plugins are one level up.
    let executable = std::env::current_exe().expect("an executable");
    let directory = executable.ancestors().nth(2).expect("a target directory").to_owned();
    let search = Search::in_directories(vec![directory]);
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
        let law = scene.kinetics.and_then(|k| k.law()).expect("a law");
        let text = FormulaKinetics::new(&law).expect("formulas");
        let signals: Vec<f64> = (0..POINTS).map(|k| scale * (fraction(7 * k) - 0.5)).collect();
        // Turn by turn, so that both see the same machine.
        measure(criterion, name, &native, &species, &signals);
        measure(criterion, &format!("{name} as text"), &text, &species, &signals);
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
    let batch = Batch { location, first, count, species: &species, signals: &signals };
    let still = Batch { signals: &[], ..batch };
    let mut values = vec![0.0; POINTS];
    let mut partials = field::Columns::new(2, POINTS);

    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(u64::try_from(POINTS).expect("a count")));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads");
        group.bench_function(format!("rates/{threads}"), |bencher| {
            let mut run = || field::rates(model, black_box(&batch), &mut [&mut values]);
            pool.install(|| bencher.iter(&mut run));
        });
        group.bench_function(format!("rates and partials/{threads}"), |bencher| {
            let mut partials = partials.slices_mut();
            let mut run = || {
                let batch = black_box(&batch);
                field::rate_partials(model, batch, &mut [&mut values], &mut partials)
            };
            pool.install(|| bencher.iter(&mut run));
        });
        group.bench_function(format!("length factor and partials/{threads}"), |bencher| {
            let mut partials = partials.slices_mut();
            let mut run = || {
                let batch = black_box(&still);
                let partials = &mut partials[..1];
                field::length_factor_partials(model, batch, &mut values, partials)
            };
            pool.install(|| bencher.iter(&mut run));
        });
    }
}

criterion_group!(benches, kinetics);
criterion_main!(benches);
