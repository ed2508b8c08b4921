//! How a species starts: a field over the rest positions X of its points.
//!
//! ```text
//! gaussian    c = background + amplitude · exp(-|X - centre|² / (2 width²))
//! spots       the sum of several gaussians
//! rectangle   c = value where |X_k - centre_k| ≤ size_k / 2 for k = x, y, else background
//! stripe      c = value where |(X - centre) · normal| ≤ width / 2, else background
//! formula     c = f(X_x, X_y, X_z), as text of x, y, z
//! regions     c = value of the last region that has X, else default
//! random      c = mean + amplitude · u,  u uniform in [-1, 1), seeded
//! ```

use std::path::PathBuf;

use rand::distr::uniform::SampleRange;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::effects::Field;
use crate::num::checked::{Finite, Positive};

use super::sheet::{default_seed, origin};
use crate::document::DocumentError;
use crate::document::read;
use crate::document::{Node, Value};

/// How one species starts.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Initial {
    /// The same value everywhere.
    Uniform(Finite),
    /// A field given by a formula.
    Pattern(Pattern),
    /// An array of a mesh file.
    File(FieldFile),
    /// A number for each of several regions.
    Regions(Field),
}

/// Whether a table gives numbers by region.
pub(super) fn is_by_region(node: &Node) -> bool {
    node.get("default").is_some() || node.get("regions").is_some()
}

/// An array of a mesh file with the same points or faces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldFile {
    /// The file; absolute, or relative to the working directory if the scene has no place.
    pub file: PathBuf,
    /// Name of the array.
    pub array: String,
}

/// A field given by a formula; the head of this file has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// A round spot.
    Gaussian(Gaussian),
    /// A rectangular spot in x and y.
    Rectangle(RectangularSpot),
    /// A band.
    Stripe(Stripe),
    /// Several round spots.
    Spots(Vec<Gaussian>),
    /// Noise.
    Random(Random),
    /// A formula of the rest position `x`, `y`, `z`.
    Formula(String),
}

/// A round spot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// Centre, in units of length.
    #[serde(default = "origin")]
    pub centre: [Finite; 3],
    /// Standard deviation, in units of length.
    pub width: Positive,
    /// Height above the background.
    pub amplitude: Finite,
    /// Value far away.
    #[serde(default)]
    pub background: Finite,
}

/// A rectangular spot in x and y.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectangularSpot {
    /// Centre, in units of length.
    #[serde(default = "origin")]
    pub centre: [Finite; 3],
    /// Extents along x and y, in units of length.
    pub size: [Positive; 2],
    /// Value inside.
    pub value: Finite,
    /// Value outside.
    #[serde(default)]
    pub background: Finite,
}

/// A band.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stripe {
    /// A point in the middle of the band.
    #[serde(default = "origin")]
    pub centre: [Finite; 3],
    /// Direction across the band, of any length but 0; x by default.
    #[serde(default = "along_x")]
    pub normal: [Finite; 3],
    /// Extent across, in units of length.
    pub width: Positive,
    /// Value inside.
    pub value: Finite,
    /// Value outside.
    #[serde(default)]
    pub background: Finite,
}

/// Noise, drawn point by point in the order of the points of the whole sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Random {
    /// Mean value.
    pub mean: Finite,
    /// Largest deviation from the mean.
    pub amplitude: Finite,
    /// Seed of the random numbers.
    #[serde(default = "default_seed")]
    pub seed: u64,
}

/// A seeded sequence of random numbers, read at ascending places: of a part of a sheet those that the whole one has there.
pub(crate) struct Sequence<R> {
    random: ChaCha8Rng,
    range: R,
    next: u32,
}

impl<R: SampleRange<f64> + Clone> Sequence<R> {
    pub(crate) fn new(seed: u64, range: R) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), range, next: 0 }
    }

    /// The number at `place`, which is beyond those of earlier calls.
    pub(crate) fn draw(&mut self, place: u32) -> f64 {
        for _ in self.next..place {
            self.random.random_range(self.range.clone());
        }
        self.next = place + 1;
        self.random.random_range(self.range.clone())
    }
}

fn along_x() -> [Finite; 3] {
    [Finite::ONE, Finite::ZERO, Finite::ZERO]
}

fn vector(components: &[Finite; 3]) -> Vec3 {
    Vec3::new(components[0].get(), components[1].get(), components[2].get())
}

impl Gaussian {
    fn value(&self, point: &Vec3) -> f64 {
        let distance = (point - vector(&self.centre)).norm() / self.width.get();
        self.background.get() + self.amplitude.get() * (-0.5 * distance * distance).exp()
    }
}

impl Initial {
    /// Reads a number or one of the tables.
    pub(crate) fn read(node: Node) -> Result<Self, DocumentError> {
        match &node.value {
            Value::Integer(_) | Value::Float(_) => read(node).map(Self::Uniform),
            Value::Table(_) if is_by_region(&node) => read(node).map(Self::Regions),
            Value::Table(_) if node.get("file").is_some() => read(node).map(Self::File),
            Value::Table(entries) if entries.len() == 1 => {
                let pattern =
                    read(node).map_err(|p: DocumentError| p.also_allowed(&["file", "regions"]))?;
                Self::checked(pattern)
            }
            Value::Table(entries) if entries.len() > 1 => {
                let keys: Vec<&str> = entries.iter().map(|(key, _)| key.name.as_str()).collect();
                let message = format!(
                    "an initial value has exactly one kind; found \
                    {}",
                    keys.join(", ")
                );
                Err(DocumentError::plain(message).help(
                    "the keys of a kind go inside it: \
                     { gaussian = { width = 5.0, amplitude = 0.2, background = 0.1 } }",
                ))
            }
            other => {
                let expected = "a number or a table such as { gaussian = { … } }";
                Err(DocumentError::mismatch(expected, other.describe()).help(
                    "allowed: gaussian, rectangle, stripe, spots, random, formula, file, regions",
                ))
            }
        }
    }

    fn checked(pattern: Pattern) -> Result<Self, DocumentError> {
        match &pattern {
            Pattern::Stripe(stripe) if vector(&stripe.normal).norm() == 0.0 => {
                let problem = DocumentError::mismatch("a nonzero vector", "0".to_owned());
                Err(problem.under("normal").under("stripe"))
            }
            _ => Ok(Self::Pattern(pattern)),
        }
    }

    /// Values at the rest positions of all points, in their order; `None` for a file, regions or a formula.
    #[must_use]
    pub fn values(&self, points: &[Vec3], number: &dyn Fn(usize) -> u32) -> Option<Vec<f64>> {
        let everywhere = |value: &dyn Fn(&Vec3) -> f64| points.iter().map(value).collect();
        Some(match self {
            Self::File(_) | Self::Regions(_) | Self::Pattern(Pattern::Formula(_)) => return None,
            Self::Uniform(value) => vec![value.get(); points.len()],
            Self::Pattern(Pattern::Gaussian(spot)) => everywhere(&|x| spot.value(x)),
            Self::Pattern(Pattern::Spots(spots)) => {
                everywhere(&|x| spots.iter().map(|spot| spot.value(x)).sum())
            }
            Self::Pattern(Pattern::Rectangle(spot)) => everywhere(&|x| {
                let from_centre = x - vector(&spot.centre);
                let inside = (0..2).all(|k| from_centre[k].abs() <= spot.size[k].get() / 2.0);
                if inside { spot.value.get() } else { spot.background.get() }
            }),
            Self::Pattern(Pattern::Stripe(stripe)) => {
                let normal = vector(&stripe.normal).normalize();
                everywhere(&|x| {
                    let across = (x - vector(&stripe.centre)).dot(&normal);
                    let inside = across.abs() <= stripe.width.get() / 2.0;
                    if inside { stripe.value.get() } else { stripe.background.get() }
                })
            }
            Self::Pattern(Pattern::Random(noise)) => {
                let mut sequence = Sequence::new(noise.seed, -1.0..1.0);
                let mut draw = |i| sequence.draw(number(i));
                let value = |u| noise.mean.get() + noise.amplitude.get() * u;
                (0..points.len()).map(|i| value(draw(i))).collect()
            }
        })
    }
}
