//! A plugin of an older minor version of the boundary: header and source as they were.

use rumple::kinetics::{Batch, Column, Feedback, Kinetics, Library, Location, Quantity, field};

use super::build::{c_library, map, plugin};

#[test]
fn a_plugin_of_minor_version_0_loads_and_gives_the_same_numbers() {
    assert_eq!(rumple_plugin_abi::ABI_MINOR, 1);
    let library = c_library("tests/plugins/old/model_i_1_0.c", "model_i_1_0", &["WITH_PARTIALS"]);
    let library = Library::load(&library).unwrap();
    assert!(!library.descriptor().capabilities.parameter_fields);
    let old = library.instantiate(&map(&[])).unwrap();
    let new = plugin("curvature-feedback", &[]);

    let count = 700;
    let at = |k: usize| rumple::num::real(k) / 700.0;
    let c: Vec<f64> = (0..count).map(|k| 0.3 * at(k)).collect();
    let h: Vec<f64> = (0..count).map(|k| 0.2 * (at(k) - 0.4)).collect();
    // As an engine of minor version 1 calls it: with parameters that differ from point to point.
    let b: Vec<f64> = (0..count).map(|k| if k < 300 { 50.0 } else { 100.0 }).collect();
    let w: Vec<f64> = (0..count).map(|k| if k < 500 { 15.0 } else { 30.0 }).collect();
    let defaults = old.parameters().to_vec();
    let mut parameters: Vec<Column<'_>> = defaults.iter().map(Column::uniform).collect();
    (parameters[0], parameters[3]) = ((&w).into(), (&b).into());
    let (species, signals) = ([(&c).into()], [(&h).into()]);
    for parameters in [&[][..], &parameters] {
        let evaluate = |kinetics: &dyn Kinetics| {
            let batch = Batch {
                location: Location::Vertex,
                first: 0,
                count,
                species: &species,
                signals: &signals,
                parameters,
            };
            let mut rates = vec![0.0; count];
            let mut partials = field::Columns::new(2, count);
            let slices = &mut partials.slices_mut();
            field::evaluate(kinetics, Quantity::Rates, &batch, &mut [&mut rates], slices).unwrap();
            let mut factor = vec![0.0; count];
            let batch = Batch { signals: &[], ..batch };
            field::evaluate(
                kinetics,
                Feedback::LengthFactor.into(),
                &batch,
                &mut [&mut factor],
                &mut [],
            )
            .unwrap();
            [rates, partials.into_inner(), factor].concat()
        };
        for (old, new) in evaluate(&old).iter().zip(evaluate(&new)) {
            assert!((old - new).abs() <= 1e-13 * new.abs().max(1.0), "{old} {new}");
        }
    }
}
