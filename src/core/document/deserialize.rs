//! Serde's view of a document: every error gets the place of the value that caused it.
//!
//! The TOML crate's own deserialiser reports a problem as text; this one keeps the parts (the
//! unknown word, the allowed ones, what was expected), from which help is made.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, VariantAccess, Visitor,
};

use super::error::DocumentError;
use super::{Key, Node, Place, Value};

impl<'de> Deserializer<'de> for Node {
    type Error = DocumentError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DocumentError> {
        let place = self.place;
        match self.value {
            Value::String(s) => visitor.visit_string(s),
            Value::Integer(i) => visitor.visit_i64(i),
            Value::Float(x) => visitor.visit_f64(x),
            Value::Boolean(b) => visitor.visit_bool(b),
            Value::Date(_) => {
                Err(DocumentError::invalid_type(Unexpected::Other("a date"), &visitor))
            }
            Value::Array(items) => visit_array(items, visitor),
            Value::Table(entries) => {
                visitor.visit_map(Table { rest: entries.into_iter(), value: None })
            }
        }
        .map_err(|problem: DocumentError| problem.placed(&place))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DocumentError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let place = self.place.clone();
        visitor.visit_newtype_struct(self).map_err(|problem| problem.placed(&place))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        // Derived code would also take a list, by position; a scene names what it gives.
        if matches!(self.value, Value::Array(_)) {
            return Err(
                DocumentError::mismatch("a table", self.value.describe()).placed(&self.place)
            );
        }
        self.deserialize_any(visitor)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let place = self.place;
        match self.value {
            Value::Table(entries) => match entries.first() {
                None => visitor.visit_unit(),
                Some((key, _)) => {
                    Err(DocumentError::unknown_field(&key.name, &[]).placed(&key.place))
                }
            },
            other => Err(DocumentError::mismatch("a table", other.describe())),
        }
        .map_err(|problem: DocumentError| problem.placed(&place))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let place = self.place;
        match self.value {
            Value::String(s) => {
                let key = Key { name: s, place: place.clone() };
                visitor.visit_enum(Variant { key, value: None })
            }
            Value::Table(mut entries) if entries.len() == 1 => match entries.pop() {
                Some((key, value)) => visitor.visit_enum(Variant { key, value: Some(value) }),
                None => Err(DocumentError::missing_field(name)),
            },
            other => {
                let found = match &other {
                    Value::Table(entries) => format!("a table with {} keys", entries.len()),
                    value => value.describe(),
                };
                let one_of = format!("one of {}", variants.join(", "));
                Err(DocumentError::mismatch(&one_of, found))
            }
        }
        .map_err(|problem: DocumentError| problem.placed(&place))
    }

    serde::forward_to_deserialize_any! {
        bool u8 u16 u32 u64 u128 i8 i16 i32 i64 i128 f32 f64 char str string seq bytes byte_buf
        map unit ignored_any tuple_struct tuple identifier
    }
}

impl<'de> IntoDeserializer<'de, DocumentError> for Node {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

fn visit_array<'de, V: Visitor<'de>>(
    items: Vec<Node>,
    visitor: V,
) -> Result<V::Value, DocumentError> {
    let length = items.len();
    let expected = DocumentError::invalid_length(length, &visitor);
    let mut array = Array { rest: items.into_iter(), next: 0 };
    let value = visitor.visit_seq(&mut array)?;
    if array.rest.len() == 0 { Ok(value) } else { Err(expected) }
}

struct Array {
    rest: std::vec::IntoIter<Node>,
    next: usize,
}

impl<'de> SeqAccess<'de> for &mut Array {
    type Error = DocumentError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DocumentError> {
        let Some(node) = self.rest.next() else {
            return Ok(None);
        };
        let index = self.next;
        self.next += 1;
        let place = node.place.clone();
        seed.deserialize(node)
            .map(Some)
            .map_err(|problem| problem.placed(&place).under_index(index))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

struct Table {
    rest: std::vec::IntoIter<(Key, Node)>,
    value: Option<(Key, Node)>,
}

impl<'de> MapAccess<'de> for Table {
    type Error = DocumentError;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, DocumentError> {
        let Some((key, value)) = self.rest.next() else {
            return Ok(None);
        };
        let name = seed
            .deserialize(StrDeserializer::<DocumentError>::new(&key.name))
            .map_err(|problem| problem.placed(&key.place))?;
        self.value = Some((key, value));
        Ok(Some(name))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(
        &mut self,
        seed: V,
    ) -> Result<V::Value, DocumentError> {
        let Some((key, value)) = self.value.take() else {
            return Err(DocumentError::custom("a value was asked for before its key"));
        };
        let place = value.place.clone();
        seed.deserialize(value).map_err(|problem| problem.placed(&place).under(&key.name))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

struct Variant {
    key: Key,
    value: Option<Node>,
}

impl<'de> EnumAccess<'de> for Variant {
    type Error = DocumentError;
    type Variant = Payload;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Payload), DocumentError> {
        let name = seed
            .deserialize(StrDeserializer::<DocumentError>::new(&self.key.name))
            .map_err(|problem| problem.placed(&self.key.place))?;
        Ok((name, Payload { key: self.key, value: self.value }))
    }
}

/// What stands behind the name of an enum's variant.
struct Payload {
    key: Key,
    value: Option<Node>,
}

impl Payload {
    fn required(self) -> Result<(String, Node), DocumentError> {
        let Self { key: Key { name, place }, value } = self;
        match value {
            Some(node) => Ok((name, node)),
            None => {
                let message = format!("{name} needs a value");
                Err(DocumentError::located(place, message).help(format!("write {{ {name} = … }}")))
            }
        }
    }
}

impl<'de> VariantAccess<'de> for Payload {
    type Error = DocumentError;

    fn unit_variant(self) -> Result<(), DocumentError> {
        match self.value {
            None => Ok(()),
            Some(node) => {
                let name = self.key.name;
                Err(DocumentError::located(node.place, format!("{name} takes no value"))
                    .help(format!("write {name:?} alone")))
            }
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(
        self,
        seed: T,
    ) -> Result<T::Value, DocumentError> {
        let (name, node) = self.required()?;
        seed.deserialize(node).map_err(|problem| problem.under(&name))
    }

    fn tuple_variant<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let (name, node) = self.required()?;
        node.deserialize_tuple(length, visitor).map_err(|problem| problem.under(&name))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let (name, node) = self.required()?;
        node.deserialize_struct("", fields, visitor).map_err(|problem| problem.under(&name))
    }
}

/// Reads `node` as a `T`; the place of a problem is at worst that of the whole node.
pub fn read<T: serde::de::DeserializeOwned>(node: Node) -> Result<T, DocumentError> {
    let place: Place = node.place.clone();
    T::deserialize(node).map_err(|problem| problem.placed(&place))
}
