//! Functions by the names that other languages have for them, and how they are written here.

/// Names elsewhere, and what has the same value here.
const FOREIGN_NAMES: [(&[&str], &str); 19] = [
    (&["ln", "loge"], "log(x)"),
    (&["log10", "lg"], "log(x)/log(10)"),
    (&["log2", "lb"], "log(x)/log(2)"),
    (&["log1p"], "log(1 + x)"),
    (&["expm1"], "exp(x) - 1"),
    (&["pow", "power"], "x^y"),
    (&["sqr", "square"], "x^2"),
    (&["fabs"], "abs(x)"),
    (&["heaviside", "theta"], "step(x)"),
    (&["relu", "ramp", "positive"], "pos(x)"),
    (&["sigmoid", "expit", "fermi"], "logistic(x)"),
    (&["sign", "sgn", "signum"], "step(x) - step(-x)"),
    (&["fmin", "minimum"], "min(x, y)"),
    (&["fmax", "maximum"], "max(x, y)"),
    (&["clip", "clamp"], "min(max(x, least), largest)"),
    (&["if", "where", "piecewise", "ifelse"], "a*step(x) + b*(1 - step(x))"),
    (&["tan"], "sin(x)/cos(x)"),
    (&["sinh"], "(exp(x) - exp(-x))/2"),
    (&["cosh"], "(exp(x) + exp(-x))/2"),
];

/// How the function `name` of other languages is written here, if it is known.
pub(super) fn written_here(name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    FOREIGN_NAMES.iter().find(|(names, _)| names.contains(&name.as_str())).map(|(_, here)| *here)
}
