//! Order of convergence and limit on ever finer meshes: known answers.

use rumple::study::gather::Statistics;
use rumple::study::refinement::{Convergence, order_and_limit};

#[test]
fn order_and_limit_are_those_of_a_power() {
    let value = |h: f64| (h, 3.0 - 0.7 * h.powf(1.6));
    let (order, limit) = order_and_limit([0.3, 0.2, 0.11].map(value)).expect("a power");
    assert!((order - 1.6).abs() < 1e-9, "{order}");
    assert!((limit - 3.0).abs() < 1e-9, "{limit}");
}

#[test]
fn values_that_go_to_and_fro_have_no_limit() {
    assert_eq!(order_and_limit([(0.3, 1.0), (0.2, 2.0), (0.1, 1.5)]), None);
}

#[test]
fn counts_that_agree_or_scatter_are_told_from_those_that_do_not_converge() {
    let of = |values: [&[f64]; 3]| {
        let meshes = [1000.0, 2000.0, 4000.0];
        Convergence::judge([0, 1, 2].map(|k| (meshes[k], Statistics::new(values[k]))))
    };
    assert_eq!(of([&[7.0], &[7.0], &[7.0]]), Convergence::Same(7.0));
    assert_eq!(of([&[31.0], &[24.0], &[14.0]]), Convergence::NotConverged);
    assert_eq!(of([&[30.0], &[7.0, 9.0], &[8.0, 8.6]]).to_string(), "within the spread");
    let Convergence::Order(order, limit) = of([&[1.04], &[1.02], &[1.01]]) else { panic!() };
    assert!((order - 2.0).abs() < 1e-9 && (limit - 1.0).abs() < 1e-9, "{order} {limit}");
}
