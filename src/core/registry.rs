//! Registries of what a scene can name: a new kind is one file, and no list is edited.
//!
//! Scenes read from here, effects and solvers write into it, and neither knows the other.
//!
//! A *family* is a trait whose implementations a scene chooses by a tag (`kind = "stretching"`).
//! The file of an implementation ends with
//!
//! ```text
//! #[typetag::serialize(name = "stretching")]          // for resolved scenes and checkpoints
//! impl EffectSpec for Stretching { … }
//! rumple::register_kind!(dyn EffectSpec, "stretching", Stretching);   // for scene files
//! ```
//!
//! The registration is collected at link time; it exists beside typetag's because typetag
//! buffers a table before it knows its type and so loses the place of every value.

use crate::document::{DocumentError, Key, Node, Place, Value, read};

#[doc(hidden)]
pub use inventory;

/// One kind of a family: its name in scenes and how its table is read.
#[derive(Debug)]
pub struct Kind<T: ?Sized + 'static> {
    name: &'static str,
    read: fn(Node) -> Result<Box<T>, DocumentError>,
}

impl<T: ?Sized + 'static> Kind<T> {
    /// A kind called `name`; use [`register_kind!`](crate::register_kind).
    #[must_use]
    pub const fn new(name: &'static str, read: fn(Node) -> Result<Box<T>, DocumentError>) -> Self {
        Self { name, read }
    }

    /// The kind's name in scenes.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// The keys of its table, as the error about one that it cannot have lists them.
    fn keys(&self, place: &Place) -> Vec<String> {
        let impossible = Key { name: String::new(), place: place.clone() };
        let value = Node::empty_table(place.clone());
        let node = Node { value: Value::Table(vec![(impossible, value)]), place: place.clone() };
        let refused = (self.read)(node).err();
        refused.map_or_else(Vec::new, |problem| problem.allowed().to_vec())
    }
}

/// Registers a `Deserialize` type as a kind of a family:
/// `register_kind!(dyn EffectSpec, "stretching", Stretching)`.
#[macro_export]
macro_rules! register_kind {
    ($family:ty, $name:literal, $spec:ty) => {
        $crate::registry::inventory::submit! {
            $crate::registry::Kind::<$family>::new($name, |node| {
                let spec = $crate::registry::spec::<$spec>(node)?;
                Ok(Box::new(spec))
            })
        }
    };
}

/// Reads the table of a kind, its tag taken out.
///
/// # Errors
/// Whatever the type's `Deserialize` refuses, with the place.
pub fn spec<T: serde::de::DeserializeOwned>(node: Node) -> Result<T, DocumentError> {
    read(node)
}

/// A trait whose implementations are chosen in a scene by name.
pub trait Family: 'static {
    /// What an implementation is called in messages.
    const NOUN: &'static str;
    /// The key that holds the name.
    const TAG: &'static str;

    /// Every registered kind.
    fn kinds() -> Vec<&'static Kind<Self>>;
}

/// Makes a trait a family: `family!(dyn EffectSpec, "effect", "kind")`, in the room that defines it.
#[macro_export]
#[doc(hidden)]
macro_rules! family {
    ($family:ty, $noun:literal, $tag:literal) => {
        $crate::registry::inventory::collect!($crate::registry::Kind<$family>);

        impl $crate::registry::Family for $family {
            const NOUN: &'static str = $noun;
            const TAG: &'static str = $tag;

            fn kinds() -> Vec<&'static $crate::registry::Kind<Self>> {
                inventory::iter::<$crate::registry::Kind<Self>>.into_iter().collect()
            }
        }
    };
}

/// The names of all kinds of a family, sorted.
#[must_use]
pub fn names<T: ?Sized + Family>() -> Vec<&'static str> {
    let mut names: Vec<_> = T::kinds().iter().map(|kind| kind.name).collect();
    names.sort_unstable();
    names
}

/// Reads a table with a tag, or a name alone, which stands for a table with nothing else.
///
/// A table without a tag is the `default` kind, if there is one.
pub fn choose<T: ?Sized + Family>(
    mut node: Node,
    default: Option<&str>,
) -> Result<Box<T>, DocumentError> {
    let whole = node.place.clone();
    let (name, place) = match node.value {
        Value::String(name) => {
            node = Node::empty_table(whole.clone());
            (name, whole.clone())
        }
        Value::Table(_) => match node.take(T::TAG) {
            Some((_, Node { value: Value::String(name), place })) => (name, place),
            Some((_, Node { value, place })) => {
                let problem = DocumentError::mismatch("a string in quotes", value.describe());
                return Err(problem.placed(&place).under(T::TAG));
            }
            None => match default {
                Some(name) => (name.to_owned(), whole.clone()),
                None => return Err(untagged::<T>(&whole)),
            },
        },
        other => {
            let expected = format!("a table with a {}", T::TAG);
            return Err(DocumentError::mismatch(&expected, other.describe()).placed(&whole));
        }
    };
    match T::kinds().into_iter().find(|kind| kind.name == name) {
        Some(kind) => {
            (kind.read)(node).map_err(|problem| whose::<T>(problem.also_allowed(&[T::TAG]), &whole))
        }
        None => Err(DocumentError::unknown_name(T::NOUN, &name, &names::<T>()).placed(&place)),
    }
    .map_err(|problem| problem.placed(&whole))
}

/// Says of an unknown key which other kinds have it.
fn whose<T: ?Sized + Family>(problem: DocumentError, place: &Place) -> DocumentError {
    let Some(key) = problem.unknown_key_here().map(str::to_owned) else { return problem };
    let mut kinds = T::kinds();
    kinds.retain(|kind| kind.keys(place).contains(&key));
    let mut owners: Vec<String> =
        kinds.iter().map(|kind| format!("{} = {:?}", T::TAG, kind.name)).collect();
    owners.sort_unstable();
    match owners.as_slice() {
        [] => problem,
        _ => {
            let allowed = problem.allowed().join(", ");
            problem.help(format!("{key} belongs to {}; allowed: {allowed}", owners.join(", ")))
        }
    }
}

fn untagged<T: ?Sized + Family>(place: &Place) -> DocumentError {
    DocumentError::missing_key(T::TAG).placed(place).help(format!(
        "the {} is one of: {}",
        T::NOUN,
        names::<T>().join(", ")
    ))
}
