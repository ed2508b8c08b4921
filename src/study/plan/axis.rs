//! Axis of a parameter study: a key of the scene and its values, from the text `KEY=VALUES`.
//!
//! ```text
//! material.thickness=0.5,1,1.5        a list
//! sheet.seed=1..8                     whole numbers from 1 to 8
//! material.thickness=0.5..1.5:5       5 numbers, evenly spaced, both ends among them
//! kinetics.parameters.k=0.01..10:4:log   the same with equal ratios
//! time.policy=quasi-static,simultaneous  names
//! ```
//!
//! An item of a list may be a range. Commas within brackets, braces and quotes part nothing.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::num::{decimal, real, whole};

/// Most values of a key, and most members of a sweep.
pub const MAX_VALUES: usize = 10_000;

/// A key with the values that it takes.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// Its name in tables and pictures: the path of the key, or `seed`.
    pub key: String,
    /// The keys that are set; several for the seeds of a scene.
    pub paths: Vec<String>,
    /// Values as overrides have them.
    pub values: Vec<String>,
    /// Whether they are spaced by equal ratios.
    #[serde(default)]
    pub logarithmic: bool,
    /// Overrides of every value, in place of `paths`, where values are names of settings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub settings: Vec<Vec<String>>,
    /// Title in tables and pictures where another key has the same last word; empty where none has.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
}

impl Axis {
    /// Reads `KEY=VALUES`.
    ///
    /// # Errors
    /// The syntax error, and what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        Self::parsed(text).map_err(|what| format!("--over {text}: {what}"))
    }

    fn parsed(text: &str) -> Result<Self, String> {
        let (key, list) = text
            .split_once('=')
            .ok_or("expected KEY=VALUES, as in material.thickness=0.5,1,1.5")?;
        let key = key.trim();
        if key.is_empty() {
            return Err("a key is missing before the =".into());
        }
        if list.trim().is_empty() {
            return Err(format!(
                "{key} has no values; give a list as 0.5,1,1.5 or a range as 1..8 or 0.5..1.5:5"
            ));
        }
        let mut axis = Self { paths: vec![key.to_owned()], key: key.to_owned(), ..Self::default() };
        for (number, item) in split(list).into_iter().map(str::trim).enumerate() {
            if item.is_empty() {
                return Err(format!("value {} of {key} is empty", number + 1));
            }
            match range(item)? {
                Some((values, logarithmic)) => {
                    axis.logarithmic |= logarithmic;
                    axis.values.extend(values);
                }
                None => axis.values.push(item.to_owned()),
            }
            if axis.values.len() > MAX_VALUES {
                return Err(format!("more than {MAX_VALUES} values"));
            }
        }
        match repeated(&axis.values) {
            None => Ok(axis),
            Some((same, value)) if same == value => Err(format!("{value} is given twice")),
            Some((same, value)) => Err(format!("{same} and {value} are the same")),
        }
    }

    /// Seeds 1 to `count` for all the keys `paths` at once.
    pub(crate) fn seeds(paths: Vec<String>, count: usize) -> Self {
        let values = (1..=count).map(|seed| seed.to_string()).collect();
        Self { key: SEED_KEY.to_owned(), paths, values, ..Self::default() }
    }

    /// Named groups of overrides, under the key `key`.
    pub(crate) fn named(key: &str, named: Vec<(String, Vec<String>)>) -> Self {
        let (values, settings) = named.into_iter().unzip();
        Self { key: key.to_owned(), values, settings, ..Self::default() }
    }

    /// Whether its values are repetitions of one thing by other random numbers.
    pub(crate) fn is_seed(&self) -> bool {
        self.short() == SEED_KEY
    }

    /// Value `k` without its quotes; empty if there is none.
    pub(crate) fn value(&self, k: usize) -> &str {
        self.values.get(k).map_or("", |value| plain(value))
    }

    /// The overrides that give it value `k`.
    pub fn overrides(&self, k: usize) -> impl Iterator<Item = String> {
        let value = self.values.get(k).map_or("", String::as_str);
        let set = self.settings.get(k).into_iter().flatten().cloned();
        set.chain(self.paths.iter().map(move |path| format!("{path}={value}")))
    }

    /// The last word of the key, as in `thickness`.
    pub(crate) fn short(&self) -> &str {
        let last = self.key.rsplit('.').next().unwrap_or(&self.key);
        last.trim_matches('"')
    }

    /// Returns the title in tables and pictures: the last word of the key, with more where another key has the same.
    pub(crate) fn title(&self) -> &str {
        if self.title.is_empty() { self.short() } else { &self.title }
    }

    /// Its values as numbers, if all are.
    #[must_use]
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.values.iter().map(|value| number(value)).collect()
    }

    /// `title = value` of value `k`; settings have a name alone.
    #[must_use]
    pub fn label(&self, k: usize) -> String {
        let value = self.value(k);
        if self.settings.is_empty() { format!("{} = {value}", self.title()) } else { value.into() }
    }
}

/// The key of seeds.
const SEED_KEY: &str = "seed";

/// A value without its quotes.
fn plain(value: &str) -> &str {
    value.trim_matches(['"', '\''])
}

fn number(value: &str) -> Option<f64> {
    value.parse().ok().filter(|v: &f64| v.is_finite())
}

/// The first value that means the same as one before it, after that: by number, or else by text.
fn repeated(values: &[String]) -> Option<(&str, &str)> {
    let (mut numbers, mut texts) = (HashMap::new(), HashMap::new());
    values.iter().find_map(|value| {
        // Of the two zeros one.
        let bits = number(value).map(|number| (number + 0.0).to_bits());
        let same = bits.and_then(|bits| numbers.insert(bits, value.as_str()));
        let same = same.or(texts.insert(plain(value), value.as_str()));
        same.map(|same| (same, value.as_str()))
    })
}

/// The items of a list, which commas part.
fn split(list: &str) -> Vec<&str> {
    let (mut items, mut from, mut depth, mut quote) = (Vec::new(), 0, 0i32, None);
    for (at, c) in list.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth -= 1,
            (None, ',') if depth <= 0 => {
                items.push(&list[from..at]);
                from = at + 1;
            }
            _ => {}
        }
    }
    items.push(&list[from..]);
    items
}

/// The values of a range, and whether their ratios are equal; none for an item that is not a range.
fn range(item: &str) -> Result<Option<(Vec<String>, bool)>, String> {
    const RANGE_SYNTAX: &str =
        "a range is FROM..TO for whole numbers, FROM..TO:COUNT or FROM..TO:COUNT:log";
    let wrong = |what: String| Err(format!("`{item}`{what}"));
    let Some((first, rest)) = item.split_once("..") else { return Ok(None) };
    // Names and paths may have two points in them.
    let Some(from) = number(first.trim()) else { return Ok(None) };
    let mut parts = rest.split(':').map(str::trim);
    let last = parts.next().unwrap_or_default();
    let Some(to) = number(last) else {
        return wrong(format!(": {last:?} is not a number; {RANGE_SYNTAX}"));
    };
    let whole_numbers = [first.trim(), last].iter().all(|text| text.parse::<i64>().is_ok());
    let count = match parts.next().map(|count| (count, count.parse())) {
        None if !whole_numbers => {
            return wrong(format!(" does not say how many values; {RANGE_SYNTAX}"));
        }
        None if to < from => return wrong(format!(" ends before it begins; {RANGE_SYNTAX}")),
        None if to - from >= real(MAX_VALUES) => {
            return wrong(format!(": more than {MAX_VALUES} values"));
        }
        None => whole(to - from) + 1,
        Some((_, Ok(count))) if (2..=MAX_VALUES).contains(&count) => count,
        Some((count, _)) => {
            let what = format!("{count:?} is not a number of values from 2 to {MAX_VALUES}");
            return wrong(format!(": {what}; {RANGE_SYNTAX}"));
        }
    };
    let logarithmic = match (parts.next(), parts.next()) {
        (Some(other), _) if other != "log" => {
            return wrong(format!(": {other:?} is not log; {RANGE_SYNTAX}"));
        }
        (_, Some(more)) => return wrong(format!(": {more:?} is too much; {RANGE_SYNTAX}")),
        (log, None) => log.is_some(),
    };
    if logarithmic && !(from > 0.0 && to > 0.0) {
        return wrong(": both ends of a logarithmic range are above 0".into());
    }
    let value = |k: usize| match real(k) / real(count.max(2) - 1) {
        _ if k == 0 => from,
        _ if k + 1 == count => to,
        share if logarithmic => from * (to / from).powf(share),
        share => from + (to - from) * share,
    };
    let values = (0..count).map(|k| text(decimal(value(k)), whole_numbers)).collect();
    Ok(Some((values, logarithmic)))
}

/// A number as a scene has it: with a point, but where the ends of a range have none.
fn text(value: f64, whole_numbers: bool) -> String {
    if whole_numbers && value.fract() == 0.0 { format!("{value}") } else { format!("{value:?}") }
}
