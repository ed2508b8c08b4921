//! Parameters by name: defaults, bounds, and what is said of wrong ones.

use super::build::{library, map};

#[test]
fn an_unknown_parameter_is_refused_with_the_nearest_and_all_names() {
    let error = library("curvature-feedback").instantiate(&map(&[("cstar", 0.1)])).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("plugin `curvature-feedback` has no parameter `cstar`"), "{text}");
    assert!(text.contains("did you mean `c_star`?"), "{text}");
    assert!(text.contains("w, beta, H_s, b, c_star, lambda_max, lambda_min, lambda_0"), "{text}");
}

#[test]
fn a_parameter_out_of_bounds_is_refused_with_its_range() {
    let cases = [
        ("tension-feedback", "alpha", 1.0, "0 <= alpha < 1"),
        ("tension-feedback", "k_on", -1.0, "0 <= k_on"),
        ("curvature-feedback", "lambda_min", 0.0, "0 < lambda_min"),
        ("curvature-feedback", "H_s", f64::INFINITY, "0 < H_s"),
        ("curvature-feedback", "w", f64::NAN, "0 <= w"),
    ];
    for (plugin, name, value, range) in cases {
        let text = library(plugin).instantiate(&map(&[(name, value)])).unwrap_err().to_string();
        let expected =
            format!("parameter `{name}` of plugin `{plugin}` is {value}; allowed: {range}");
        assert_eq!(text, expected);
    }
}

#[test]
fn values_are_kept_in_the_order_of_the_descriptor() {
    use rumple::kinetics::Kinetics;
    let given = map(&[("lambda_max", 0.9), ("w", 3.0)]);
    let model = library("curvature-feedback").instantiate(&given).unwrap();
    assert_eq!(model.parameters(), [3.0, 1.0, 0.05, 100.0, 0.1, 0.9, 0.65, 0.9]);
}
