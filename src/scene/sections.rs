//! The tables of a scene, one after the other.

use crate::document::{DocumentError, Node, Value};
use crate::effects::EffectSpec;
use crate::registry;
use crate::solve::{DEFAULT_EQUILIBRIUM, EquilibriumSpec};

/// Takes the tables of a scene one by one and notes what is wrong with them.
pub(super) struct Sections<'a> {
    pub(super) root: &'a mut Node,
    pub(super) problems: &'a mut Vec<DocumentError>,
}

impl Sections<'_> {
    pub(super) fn optional<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(Node) -> Result<T, DocumentError>,
    ) -> Option<T> {
        let (_, node) = self.root.take(key)?;
        let place = node.place.clone();
        match read(node) {
            Ok(value) => Some(value),
            Err(problem) => {
                self.problems.push(problem.under(key).placed(&place));
                None
            }
        }
    }

    pub(super) fn required<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(Node) -> Result<T, DocumentError>,
    ) -> Option<T> {
        if self.root.get(key).is_none() {
            self.problems.push(DocumentError::missing_table(key));
        }
        self.optional(key, read)
    }

    pub(super) fn effects(&mut self) -> Vec<Box<dyn EffectSpec>> {
        let mut effects = Vec::new();
        match self.root.take("effect") {
            None => {}
            Some((_, Node { value: Value::Array(items), .. })) => {
                for (i, item) in items.into_iter().enumerate() {
                    match registry::choose(item, None) {
                        Ok(effect) => effects.push(effect),
                        Err(p) => self.problems.push(p.under_index(i).under("effect")),
                    }
                }
            }
            Some((_, Node { value, place })) => {
                let problem = DocumentError::mismatch("a list of tables", value.describe())
                    .help("write [[effect]] before every effect")
                    .placed(&place);
                self.problems.push(problem.under("effect"));
            }
        }
        effects
    }

    pub(super) fn equilibrium(&mut self) -> Option<Box<dyn EquilibriumSpec>> {
        if self.root.get("equilibrium").is_some() {
            return self
                .optional("equilibrium", |node| registry::choose(node, Some(DEFAULT_EQUILIBRIUM)));
        }
        let default = Node::default_text(DEFAULT_EQUILIBRIUM, self.root.place.clone());
        registry::choose(default, None).map_err(|problem| self.problems.push(problem)).ok()
    }
}
