//! Formulas of any form mean what they say: trees written as text give the numbers of the trees.

use proptest::prelude::*;
use rumple::Vec3;
use rumple::kinetics::formula::FieldFormula;

/// A formula with what it means.
#[derive(Debug, Clone)]
enum Tree {
    Number(f64),
    Name(usize),
    Negative(Box<Tree>),
    Binary(char, Box<Tree>, Box<Tree>),
    Call(&'static str, Vec<Tree>),
}

const NAMES: [&str; 4] = ["x", "y", "z", "t"];
const ONE: [&str; 8] = ["pos", "exp", "sqrt", "tanh", "sin", "cos", "abs", "logistic"];

impl Tree {
    fn value(&self, at: &[f64; 4]) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Name(k) => at[*k],
            Self::Negative(inner) => -inner.value(at),
            Self::Binary(operation, a, b) => {
                let (a, b) = (a.value(at), b.value(at));
                match operation {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' => a / b,
                    _ => a.powf(b),
                }
            }
            Self::Call(name, arguments) => {
                let a = arguments[0].value(at);
                match *name {
                    // What is not a number stays that.
                    "pos" if a < 0.0 => 0.0,
                    "pos" => a,
                    "exp" => a.exp(),
                    "sqrt" => a.sqrt(),
                    "tanh" => a.tanh(),
                    "sin" => a.sin(),
                    "cos" => a.cos(),
                    "abs" => a.abs(),
                    "logistic" => 1.0 / (1.0 + (-a).exp()),
                    "min" => a.min(arguments[1].value(at)),
                    _ => a.max(arguments[1].value(at)),
                }
            }
        }
    }

    /// Whether all of its parts have values: what the reader simplifies may have no value that is left out.
    fn is_finite(&self, at: &[f64; 4]) -> bool {
        let inside = match self {
            Self::Number(_) | Self::Name(_) => true,
            Self::Negative(inner) => inner.is_finite(at),
            Self::Binary(_, a, b) => a.is_finite(at) && b.is_finite(at),
            Self::Call(_, arguments) => arguments.iter().all(|part| part.is_finite(at)),
        };
        inside && self.value(at).is_finite()
    }

    /// How tightly its outermost operation binds.
    fn rank(&self) -> u8 {
        match self {
            Self::Binary('+' | '-', ..) => 1,
            Self::Binary('*' | '/', ..) => 2,
            Self::Negative(_) => 3,
            Self::Binary(..) => 4,
            _ => 5,
        }
    }

    /// As text, with no more parentheses than it needs.
    fn text(&self) -> String {
        let part = |tree: &Tree, least: u8| match tree.rank() < least {
            true => format!("({})", tree.text()),
            false => tree.text(),
        };
        match self {
            Self::Number(value) => format!("{value:?}"),
            Self::Name(k) => NAMES[*k].to_owned(),
            Self::Negative(inner) => format!("-{}", part(inner, 3)),
            Self::Binary(operation, a, b) => {
                let (left, right) = match operation {
                    '+' | '-' => (1, 2),
                    '*' | '/' => (2, 3),
                    // The exponent may have a sign, and be a power itself.
                    _ => (5, 3),
                };
                format!("{}{operation}{}", part(a, left), part(b, right))
            }
            Self::Call(name, arguments) => {
                let arguments: Vec<String> = arguments.iter().map(Tree::text).collect();
                format!("{name}({})", arguments.join(", "))
            }
        }
    }
}

fn tree() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        (0.0..10.0f64).prop_map(Tree::Number),
        (0u8..4).prop_map(|n| Tree::Number(n.into())),
        (0..NAMES.len()).prop_map(Tree::Name),
    ];
    leaf.prop_recursive(6, 40, 2, |inner| {
        let two = (prop::sample::select(vec!["min", "max"]), inner.clone(), inner.clone());
        prop_oneof![
            inner.clone().prop_map(|a| Tree::Negative(a.into())),
            (prop::sample::select(vec!['+', '-', '*', '/', '^']), inner.clone(), inner.clone())
                .prop_map(|(c, a, b)| Tree::Binary(c, a.into(), b.into())),
            (prop::sample::select(ONE.to_vec()), inner).prop_map(|(n, a)| Tree::Call(n, vec![a])),
            two.prop_map(|(n, a, b)| Tree::Call(n, vec![a, b])),
        ]
    })
}

/// What is wrong by rounding alone; where nothing is left but that, nothing is compared.
fn alike(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * (1.0 + a.abs() + b.abs())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_formula_means_what_its_tree_does(tree in tree()) {
        let text = tree.text();
        let formula = match FieldFormula::new(&text, true) {
            Ok(formula) => formula,
            Err(error) => {
                // Too long, too deep, or 0 in a denominator: nothing else is wrong with it.
                let known = ["at most", "nested", "division by zero"];
                prop_assert!(known.iter().any(|w| error.message.contains(w)), "{text}: {error:?}");
                return Ok(());
            }
        };
        for at in [[0.7, -1.3, 0.2, 2.0], [1.0, 2.0, 3.0, 0.5]] {
            let expected = tree.value(&at);
            let found = formula.evaluate(&[Vec3::new(at[0], at[1], at[2])], at[3])[0];
            // Large numbers make errors of rounding large.
            if tree.is_finite(&at) && expected.abs() < 1e6 && stable(&tree, &at) {
                prop_assert!(alike(expected, found), "{text} at {at:?}: {found}, expected {expected}");
            }
        }
    }

    #[test]
    fn any_words_are_a_formula_or_an_error(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "x", "t", "1", "2.5e3", ".", "e", "pi", "+", "-", "*", "**", "/", "^", "(", ")", ",", " ",
                "sin(", "hill(", "min(", "é", "\n", "1e400", "_",
            ]),
            0..60,
        )
    ) {
        let text = words.concat();
        if let Err(error) = FieldFormula::new(&text, true) {
            prop_assert!(text.get(error.span.clone()).is_some(), "{text:?}: {error:?}");
        }
    }
}

/// Whether small changes of where it is taken change its value little: not near a pole or a jump.
fn stable(tree: &Tree, at: &[f64; 4]) -> bool {
    let value = tree.value(at);
    [1.0 + 1e-10, 1.0 - 1e-10].iter().all(|factor| {
        let near = at.map(|x| x * factor);
        (tree.value(&near) - value).abs() <= 1e-6 * (1.0 + value.abs())
    })
}
