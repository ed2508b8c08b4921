//! Richardson extrapolation from three meshes.

/// Orders that are looked for.
const ORDERS: (f64, f64) = (0.2, 4.5);
/// Halvings of the range of orders: to its last digit.
const HALVINGS: usize = 60;

/// Order p and limit f₀ of `f(h) = f₀ + C h^p` through three values `(h, f)`, the coarsest first:
///
/// ```text
/// (f₁ - f₂) / (f₂ - f₃) = (h₁^p - h₂^p) / (h₂^p - h₃^p)
/// ```
///
/// None where no order from 0.2 to 4.5 fits, more than elements have, as where differences change their sign.
/// Source: Roache, J. Fluids Eng. 116 (1994), doi:10.1115/1.2910291.
pub(super) fn limit([a, b, c]: [(f64, f64); 3]) -> Option<(f64, f64)> {
    let ratio = (a.1 - b.1) / (b.1 - c.1);
    if !(ratio > 0.0 && ratio.is_finite()) {
        return None;
    }
    let of = |p: f64| (a.0.powf(p) - b.0.powf(p)) / (b.0.powf(p) - c.0.powf(p)) - ratio;
    let (mut low, mut high) = ORDERS;
    if !(of(low) < 0.0 && of(high) > 0.0) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if of(middle) < 0.0 { low = middle } else { high = middle }
    }
    let p = 0.5 * (low + high);
    let constant = (b.1 - c.1) / (b.0.powf(p) - c.0.powf(p));
    Some((p, c.1 - constant * c.0.powf(p)))
}

#[cfg(test)]
mod tests {
    use super::limit;

    #[test]
    fn order_and_limit_are_those_of_a_power() {
        let value = |h: f64| (h, 3.0 - 0.7 * h.powf(1.6));
        let (order, limit) = limit([0.3, 0.2, 0.11].map(value)).expect("a power");
        assert!((order - 1.6).abs() < 1e-9, "{order}");
        assert!((limit - 3.0).abs() < 1e-9, "{limit}");
    }

    #[test]
    fn values_that_go_to_and_fro_have_no_limit() {
        assert_eq!(limit([(0.3, 1.0), (0.2, 2.0), (0.1, 1.5)]), None);
    }
}
