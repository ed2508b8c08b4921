//! Formulas of position and time, and laws made of several.

use rumple::Vec3;
use rumple::kinetics::formula::{FieldFormula, Formula, FormulaKinetics, Law};
use rumple::kinetics::{Feedback, Location, Observable, Species};

use super::{Reader, bound};

pub const FORMULA: Reader = Reader {
    name: "formula",
    bound: bound(2, 512),
    seeds: || {
        let texts = [
            "1 + 2*x - y/(3 + z^2)",
            "hill(abs(x), 0.5, 4) * exp(-t/2) + min(x, max(y, -z))",
            "-x**2**-1 + sqrt(1e-3 + x*x) - log(pi)",
            "step(x) * pos(tanh(sin(x) + cos(y))) / logistic(z)",
            "((((x))))^-3 + +-+1.5e-3*x^0.5*y^2147483647",
        ];
        texts.map(|text| text.as_bytes().to_vec()).to_vec()
    },
    read: formula,
    repair: None,
};

pub const LAW: Reader = Reader {
    name: "law",
    // So many operations a byte as there may be, with what finds them again.
    bound: bound(16, 24 << 10),
    seeds: || {
        let texts = [
            "let k 2*a\nrate c k*tanh(H) - c*d\nrate d a*c^2 - d/(1 + c)\nfactor 1 + 0.1*c\nshow r c/(d + 1)",
            "let a1 a2*2\nlet a2 a3 + c\nlet a3 strain^3\nrate c a1 - a2*a3\nrate d hill(c, 1, 4) - d",
            "rate c x + y*t - sigma\nfactor exp(c)^d",
        ];
        texts.map(|text| text.as_bytes().to_vec()).to_vec()
    },
    read: law,
    repair: None,
};

fn formula(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    match FieldFormula::new(&text, true) {
        Ok(formula) => {
            let points = [Vec3::zeros(), Vec3::new(1.0, -2.0, 1e300), Vec3::repeat(f64::NAN)];
            formula.evaluate(&points, 0.5).len() == points.len()
        }
        Err(error) => {
            // Where it is wrong can be pointed to.
            assert!(text.get(error.span.clone()).is_some(), "{error:?}");
            false
        }
    }
}

/// A line each: `let NAME TEXT`, `rate SPECIES TEXT`, `show NAME TEXT`, `factor TEXT`.
fn law(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let mut law = Law {
        name: "tried".into(),
        species: Vec::new(),
        parameters: Vec::new(),
        values: Vec::new(),
        lets: Vec::new(),
        rates: Vec::new(),
        feedback: Vec::new(),
        observables: Vec::new(),
    };
    for line in text.lines() {
        let (kind, rest) = line.split_once(' ').unwrap_or((line, ""));
        let (name, formula) = rest.split_once(' ').unwrap_or((rest, ""));
        let (name, formula) = (name.to_owned(), formula.to_owned());
        match kind {
            "let" => law.lets.push(Formula { name, text: formula }),
            "show" => {
                let about = Observable { name, unit: String::new(), doc: String::new() };
                law.observables.push((about, formula));
            }
            "factor" => law.feedback.push((Feedback::LengthFactor, rest.to_owned())),
            _ => {
                law.species.push(species(&name));
                law.rates.push(Formula { name, text: formula });
            }
        }
    }
    match FormulaKinetics::new(&law) {
        Ok(ready) => ready.operations().1 >= ready.operations().0,
        Err(error) => {
            assert!(!error.error.message.is_empty());
            false
        }
    }
}

fn species(name: &str) -> Species {
    Species {
        name: name.to_owned(),
        unit: "1".into(),
        doc: String::new(),
        typical: None,
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        diffusion: 0.0,
        location: Location::Vertex,
    }
}
