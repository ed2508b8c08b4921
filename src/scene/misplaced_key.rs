//! Where a key belongs that stands where only tables do.

use std::sync::OnceLock;

use super::checkpoint::CheckpointSpec;
use super::invariants::InvariantsSpec;
use super::material::Material;
use super::output::OutputSpec;
use super::stability::StabilitySpec;
use super::{kinetics, sheet, time};
use crate::document::DocumentError;
use crate::document::read;
use crate::document::{Key, Node, Place, Value};
use crate::registry::choose;
use crate::solve::{DEFAULT_EQUILIBRIUM, EquilibriumSpec};

/// Tables with what reads them.
pub(super) type Reader = fn(Node) -> Option<DocumentError>;
pub(super) const READERS: [(&str, Reader); 9] = [
    ("time", |node| time::read_time(node, false).err()),
    ("output", |node| read::<OutputSpec>(node).err()),
    ("sheet", |node| sheet::read_sheet(node).err()),
    ("material", |node| read::<Material>(node).err()),
    ("kinetics", |node| kinetics::read_kinetics(node).err()),
    ("equilibrium", |node| choose::<dyn EquilibriumSpec>(node, Some(DEFAULT_EQUILIBRIUM)).err()),
    ("stability", |node| read::<StabilitySpec>(node).err()),
    ("invariants", |node| read::<InvariantsSpec>(node).err()),
    ("checkpoint", |node| read::<CheckpointSpec>(node).err()),
];

/// The path of the first table's key that is called `key`, as in `time.until`.
pub(super) fn find(key: &str) -> Option<String> {
    static KEYS: OnceLock<Vec<(&str, Vec<String>)>> = OnceLock::new();
    let keys = KEYS.get_or_init(|| READERS.map(|(table, reader)| (table, known(reader))).to_vec());
    let (table, _) = keys.iter().find(|(_, known)| known.iter().any(|known| known == key))?;
    Some(format!("{table}.{key}"))
}

/// The keys that a table can have: those that its reader names when it meets one that none has.
fn known(reader: Reader) -> Vec<String> {
    let place = Place { source: 0, span: 0..0 };
    let key = Key { name: "?".to_owned(), place: place.clone() };
    let value = Node { value: Value::Integer(0), place: place.clone() };
    let table = Node { value: Value::Table(vec![(key, value)]), place };
    reader(table).map(|problem| problem.allowed().to_vec()).unwrap_or_default()
}
