//! `[kinetics]` with the law itself as text in place of a plugin.

use std::collections::BTreeMap;

use crate::kinetics::formula::{Formula, Law};
use crate::kinetics::{Feedback, Observable, Parameter, Species};
use crate::num::checked::{Finite, Positive};

use super::{KineticsSpec, ParameterSpec};

impl KineticsSpec {
    /// The law that the scene writes out; `None` if it names a plugin.
    #[must_use]
    pub fn law(&self) -> Option<Law> {
        if self.rates.is_empty() {
            return None;
        }
        let named = |text: &BTreeMap<String, String>| -> Vec<Formula> {
            let formula = |(name, text): (&String, &String)| Formula {
                name: name.clone(),
                text: text.clone(),
            };
            text.iter().map(formula).collect()
        };
        let mut names: Vec<&String> = self.rates.keys().chain(self.species.keys()).collect();
        names.sort();
        names.dedup();
        let species = names.into_iter().map(|name| {
            let spec = self.species.get(name).cloned().unwrap_or_default();
            Species {
                name: name.clone(),
                unit: spec.unit,
                doc: spec.doc,
                typical: spec.typical.map(Positive::get),
                lower: spec.lower.map_or(f64::NEG_INFINITY, Finite::get),
                upper: spec.upper.map_or(f64::INFINITY, Finite::get),
                ..Species::named(name)
            }
        });
        let parameters = self.parameters.iter().map(|(name, value)| Parameter {
            unit: self.units.get(name).cloned().unwrap_or_else(|| "1".into()),
            ..Parameter::named(name, value.uniform().unwrap_or(0.0))
        });
        let observables = self.observables.iter().map(|(name, text)| {
            let unit = self.units.get(name).cloned().unwrap_or_else(|| "1".into());
            (Observable { name: name.clone(), unit, doc: String::new() }, text.clone())
        });
        Some(Law {
            name: "kinetics".into(),
            species: species.collect(),
            parameters: parameters.collect(),
            values: self.parameters.values().map(ParameterSpec::uniform).collect(),
            lets: named(&self.r#let),
            rates: named(&self.rates),
            feedback: self.feedback(),
            observables: observables.collect(),
        })
    }

    /// What its law gives besides rates.
    fn feedback(&self) -> Vec<(Feedback, String)> {
        let text = |which: Feedback| match which {
            Feedback::LengthFactor => &self.length_factor,
            Feedback::Curvature => &self.curvature,
            Feedback::FactorAcross => &self.length_factor_across,
        };
        Feedback::ALL.into_iter().filter_map(|which| Some((which, text(which).clone()?))).collect()
    }
}
