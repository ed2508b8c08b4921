//! Models I and II through the boundary, against what is known of them.

use rumple::kinetics::field::{self, Columns};
use rumple::kinetics::{
    Batch, Column, Feedback, Kinetics, Location, PluginKinetics, Quantity, Signal, differences,
};

use super::build::{c_library, library, map, plugin};

fn batch<'a>(species: &'a [Column<'a>], signals: &'a [Column<'a>], count: usize) -> Batch<'a> {
    Batch { location: Location::Vertex, first: 0, count, species, signals, parameters: &[] }
}

fn rates(kinetics: &PluginKinetics, c: &[f64], signal: &[f64]) -> Vec<f64> {
    let mut rates = vec![0.0; c.len()];
    let batch = Batch {
        location: Location::Vertex,
        first: 0,
        count: c.len(),
        species: &[c.into()],
        signals: &[signal.into()],
        parameters: &[],
    };
    assert_eq!(
        field::evaluate(kinetics, Quantity::Rates, &batch, &mut [&mut rates], &mut []).unwrap(),
        None
    );
    rates
}

fn length_factors(kinetics: &PluginKinetics, c: &[f64]) -> Vec<f64> {
    let mut factors = vec![0.0; c.len()];
    let species = [c.into()];
    field::evaluate(
        kinetics,
        Feedback::LengthFactor.into(),
        &batch(&species, &[], c.len()),
        &mut [&mut factors],
        &mut [],
    )
    .unwrap();
    factors
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found:e} instead of {expected:e}");
}

#[test]
fn model_i_reaches_its_fixed_points_truth_k1() {
    let model = plugin("curvature-feedback", &[]);
    // dc/dt vanishes at the known pairs of curvature and concentration.
    let curvatures = [1.0 / 130.0, 0.057_142_857_142_857_14, 0.05];
    let rates_there = rates(&model, &[0.1, 0.4, 0.375], &curvatures);
    rates_there.iter().for_each(|rate| assert_close(*rate, 0.0, 1e-13));
    // The maximum under an ever greater curvature; and none from downward curvature.
    assert_close(rates(&model, &[0.0], &[1e12])[0], 0.75, 1e-9);
    assert_eq!(rates(&model, &[0.25, 0.25], &[-0.05, -1e9]), [-0.25, -0.25]);
    // Explicit Euler follows c_n = c_inf + (c_0 - c_inf)(1 - β dt)^n.
    let (mut c, dt, steps) = (0.02, 0.01, 200);
    for _ in 0..steps {
        c += dt * rates(&model, &[c], &[0.05])[0];
    }
    assert_close(c, 0.375 + (0.02 - 0.375) * 0.99_f64.powi(steps), 1e-13);
}

#[test]
fn model_ii_relaxes_without_stress_truth_k2() {
    let model = plugin("tension-feedback", &[]);
    let fixed = 0.019_607_843_137_254_905;
    assert_close(rates(&model, &[fixed], &[0.0])[0], 0.0, 1e-13);
    // dm/dt is linear in m with slope -(k_on + k_off) = -10.2, whatever the compression.
    let slopes = rates(&model, &[fixed + 0.5, fixed + 0.5], &[0.0, -1e6]);
    slopes.iter().for_each(|rate| assert_close(*rate, -0.5 * 10.2, 1e-13));
    // m(0.1) from m(0) = 1, by classical Runge-Kutta.
    let (mut m, steps) = (1.0, 400);
    let dt = 0.1 / f64::from(steps);
    let rate = |m: f64| rates(&model, &[m], &[0.0])[0];
    for _ in 0..steps {
        let a = rate(m);
        let b = rate(m + 0.5 * dt * a);
        let c = rate(m + 0.5 * dt * b);
        let d = rate(m + dt * c);
        m += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    assert_close(m, 0.373_132_294_287_733_1, 1e-12);
    // Under strong tension nothing unbinds; at aσ = 1 the e-th part does.
    assert_eq!(rates(&model, &[0.5], &[1e12])[0], 0.1);
    let expected = 0.1 - 5.0 * (-1.0_f64).exp();
    assert_close(rates(&model, &[0.5], &[1e4])[0], expected, 1e-13);
    assert_close(length_factors(&model, &[1.0])[0], 0.8, 1e-15);
}

#[test]
fn length_factor_of_model_i_truth_k3() {
    let model = plugin("curvature-feedback", &[]);
    let [at_zero, at_threshold, far]: [f64; 3] =
        length_factors(&model, &[0.0, 0.1, 7.5]).try_into().unwrap();
    assert_close(1.0 / at_zero, 0.999_984_110_745_954_2, 1e-14);
    assert_close(1.0 - 1.0 / at_zero, 1.588_925_404_583_108e-5, 1e-14);
    assert_close(1.0 / at_threshold, 0.825, 1e-14);
    assert_close(far, 1.538_461_538_461_538_3, 1e-14);
    let late = plugin("curvature-feedback", &[("c_star", 0.4)]);
    assert_close(length_factors(&late, &[0.0])[0], 1.0, 1e-14);
    // Λ⁰ follows Λ_max unless it is given.
    let other = plugin("curvature-feedback", &[("lambda_max", 0.9)]);
    assert_close(length_factors(&other, &[-1e3])[0], 1.0, 1e-15);
    let relaxed = plugin("curvature-feedback", &[("lambda_0", 0.999_984_110_745_954_2)]);
    assert_close(length_factors(&relaxed, &[0.0])[0], 1.0, 1e-15);
}

#[test]
fn extreme_inputs_give_finite_values_and_derivatives() {
    let values = [-1e3, -1.0, -1e-300, 0.0, 0.1, 1.0, 1e3];
    for b in [0.0, 100.0, 1e6, 1e300] {
        let model = plugin("curvature-feedback", &[("b", b)]);
        let species = [values.as_slice().into()];
        let (mut factor, mut partial) = ([0.0; 7], [0.0; 7]);
        let batch = batch(&species, &[], values.len());
        field::evaluate(
            &model,
            Feedback::LengthFactor.into(),
            &batch,
            &mut [&mut factor],
            &mut [&mut partial],
        )
        .unwrap();
        assert!(factor.iter().all(|phi| (0.999..=1.54).contains(phi)), "b = {b}: {factor:?}");
        if b == 1e6 {
            assert_eq!([factor[0], factor[6]], [1.0, 1.0 / 0.65]);
            assert_eq!([partial[0], partial[6]], [0.0, 0.0]);
        }
    }
    let signals = [-1e308, -1e6, -0.05, 0.0, 1e6, 1e200, 1e308];
    for name in ["curvature-feedback", "tension-feedback"] {
        let model = plugin(name, &[]);
        let species = [values.as_slice().into()];
        let signals = [signals.as_slice().into()];
        let (mut rate, mut by_species, mut by_signal) = ([0.0; 7], [0.0; 7], [0.0; 7]);
        let mut partials = [by_species.as_mut_slice(), by_signal.as_mut_slice()];
        let batch = batch(&species, &signals, values.len());
        field::evaluate(&model, Quantity::Rates, &batch, &mut [&mut rate], &mut partials).unwrap();
    }
}

/// Inputs over the working range of Model I or II, away from the kink at zero.
fn sample(count: usize, scale: f64) -> (Vec<f64>, Vec<f64>) {
    let fraction = |k: usize| (rumple::num::real(k) * 0.618_033_988_749_894_9).fract();
    let species = (0..count).map(|k| 0.01 + 0.9 * fraction(k)).collect();
    let signals = (0..count).map(|k| scale * (2.0 * fraction(7 * k + 3) - 1.0)).collect();
    (species, signals)
}

#[test]
fn partial_derivatives_match_differences() {
    let cases: [(_, &[_], _); 2] =
        [("curvature-feedback", &[("b", 10.0)], 0.2), ("tension-feedback", &[("alpha", 0.3)], 3e4)];
    for (name, parameters, scale) in cases {
        let model = plugin(name, parameters);
        let (species, signals) = sample(500, scale);
        let species = [(&species).into()];
        let signals = [(&signals).into()];
        let batch = batch(&species, &signals, 500);
        compare(&model, Quantity::Rates, &batch, 2);
        compare(&model, Feedback::LengthFactor.into(), &Batch { signals: &[], ..batch }, 1);
    }
}

/// Compares the derivatives by `inputs` that a law gives with differences, relative to the largest.
fn compare(model: &impl Kinetics, which: Quantity, batch: &Batch<'_>, inputs: usize) {
    let [mut value, mut given, mut expected] = [1, inputs, inputs].map(|n| Columns::new(n, 500));
    let values = &mut value.slices_mut();
    model.evaluate(which, batch, values, &mut given.slices_mut()).unwrap();
    differences::partials(model, which, batch, values, &mut expected.slices_mut()).unwrap();
    for input in 0..inputs {
        let expected = expected.column(input);
        let most = expected.iter().fold(0.1_f64, |most, d| most.max(d.abs()));
        for (given, expected) in given.column(input).iter().zip(expected) {
            assert_close(*given, *expected, 1e-8 * most);
        }
    }
}

#[test]
fn descriptors_say_what_the_laws_are() {
    let model = library("curvature-feedback");
    let descriptor = model.descriptor();
    assert_eq!(descriptor.id, "org.rumple.curvature-feedback");
    assert_eq!(descriptor.input_names().collect::<Vec<_>>(), ["c", "mean_curvature"]);
    assert!(descriptor.reads(Signal::MeanCurvature) && !descriptor.reads(Signal::Tension));
    assert!(descriptor.capabilities.rate_partials && descriptor.capabilities.length_factor);
    assert_eq!(descriptor.species[0].location, Location::Vertex);
    let names: Vec<_> = descriptor.parameters.iter().map(|p| p.name.as_str()).collect();
    let expected = ["w", "beta", "H_s", "b", "c_star", "lambda_max", "lambda_min", "lambda_0"];
    assert_eq!(names, expected);
    let model = library("tension-feedback");
    assert_eq!(model.descriptor().input_names().collect::<Vec<_>>(), ["m", "tension"]);
}

#[test]
fn a_model_in_c_gives_the_same_numbers_with_and_without_its_own_derivatives() {
    let rust = plugin("curvature-feedback", &[]);
    let (species, signals) = sample(3000, 0.2);
    let species_columns = [(&species).into()];
    let signal_columns = [(&signals).into()];
    let batch = batch(&species_columns, &signal_columns, 3000);
    let evaluate = |kinetics: &dyn Kinetics| {
        let mut rate = vec![0.0; 3000];
        let mut partials = field::Columns::new(2, 3000);
        let slices = &mut partials.slices_mut();
        field::evaluate(kinetics, Quantity::Rates, &batch, &mut [&mut rate], slices).unwrap();
        (rate, partials)
    };
    let (rate, partials) = evaluate(&rust);
    for (name, definition) in [("model_i", "PLAIN"), ("model_i_partials", "WITH_PARTIALS")] {
        let library = c_library("tests/plugins/model_i.c", name, &[definition]);
        let library = rumple::kinetics::Library::load(&library).unwrap();
        assert_eq!(library.descriptor().capabilities.rate_partials, name != "model_i");
        let c = library.instantiate(&map(&[])).unwrap();
        let (c_rate, c_partials) = evaluate(&c);
        let tolerance = if name == "model_i" { 1e-8 } else { 1e-14 };
        for point in 0..3000 {
            assert_close(c_rate[point], rate[point], 1e-15);
            for column in 0..2 {
                let (given, expected) =
                    (c_partials.column(column)[point], partials.column(column)[point]);
                assert_close(given, expected, tolerance * 15.0);
            }
        }
        for (c, rust) in length_factors(&c, &species).iter().zip(length_factors(&rust, &species)) {
            assert_close(*c, rust, 1e-15);
        }
    }
}

#[test]
fn results_do_not_depend_on_threads_or_on_how_points_are_stored() {
    let model = plugin("curvature-feedback", &[]);
    let (species, signals) = sample(5000, 0.2);
    let interleaved: Vec<f64> = species.iter().zip(&signals).flat_map(|(c, h)| [*c, *h]).collect();
    let evaluate = |threads, species: Column<'_>, signals: Column<'_>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut rate = vec![0.0; 5000];
        let (species, signals) = ([species], [signals]);
        let batch = batch(&species, &signals, 5000);
        pool.install(|| {
            field::evaluate(&model, Quantity::Rates, &batch, &mut [&mut rate], &mut [])
        })
        .unwrap();
        rate.iter().map(|rate| rate.to_bits()).collect::<Vec<_>>()
    };
    let one = evaluate(1, (&species).into(), (&signals).into());
    assert_eq!(one, evaluate(3, (&species).into(), (&signals).into()));
    let strided = |component| Column::component(&interleaved, component, 2);
    assert_eq!(one, evaluate(2, strided(0), strided(1)));
    let uniform = evaluate(2, Column::uniform(&0.25), (&signals).into());
    assert_eq!(uniform, evaluate(1, (&vec![0.25; 5000]).into(), (&signals).into()));
}
