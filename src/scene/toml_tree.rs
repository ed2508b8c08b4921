//! TOML as a tree of values with their places.

use toml::de::{DeTable, DeValue};

use crate::document::{DocumentError, Key, MAX_DEPTH, Node, Place, Value};

/// Reads a whole document.
pub(super) fn document(text: &str) -> Result<Node, DocumentError> {
    let root = DeTable::parse(text).map_err(|e| syntax(&e, 0, 0))?;
    let whole = 0..text.len();
    table(root.into_inner(), Place { source: 0, span: whole }, MAX_DEPTH)
}

/// Reads one value that stands at byte `offset` of the text number `source`.
pub(super) fn value(text: &str, source: usize, offset: usize) -> Result<Node, DocumentError> {
    let value = DeValue::parse(text).map_err(|e| syntax(&e, source, offset))?;
    let span = value.span();
    let place = Place { source, span: span.start + offset..span.end + offset };
    // The spans inside are relative to `text`: shift them along.
    let mut node = convert(value.into_inner(), place, MAX_DEPTH)?;
    node.shift_children(offset);
    Ok(node)
}

fn syntax(error: &toml::de::Error, source: usize, offset: usize) -> DocumentError {
    let place =
        error.span().map(|span| Place { source, span: span.start + offset..span.end + offset });
    DocumentError::syntax(error.message(), place)
}

fn table(entries: DeTable<'_>, place: Place, depth: usize) -> Result<Node, DocumentError> {
    let source = place.source;
    let mut out = Vec::with_capacity(entries.len());
    for (key, value) in entries {
        let key_place = Place { source, span: key.span() };
        let place = Place { source, span: value.span() };
        let node = convert(value.into_inner(), place, depth)?;
        out.push((Key { name: key.into_inner().into_owned(), place: key_place }, node));
    }
    out.sort_by_key(|(key, _)| key.place.span.start);
    Ok(Node { value: Value::Table(out), place })
}

fn convert(value: DeValue<'_>, place: Place, depth: usize) -> Result<Node, DocumentError> {
    let Some(depth) = depth.checked_sub(1) else {
        return Err(DocumentError::located(
            place,
            format!("nested more than {MAX_DEPTH} levels deep"),
        ));
    };
    let source = place.source;
    let value = match value {
        DeValue::String(s) => Value::String(s.into_owned()),
        DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Value::Integer(i),
            Err(_) => {
                return Err(DocumentError::located(place, "this integer needs more than 64 bits")
                    .help("write a large real number with a point or exponent, as in 1e20"));
            }
        },
        DeValue::Float(x) => match x.as_str().parse::<f64>() {
            Ok(v) if v.is_finite() || x.as_str().contains("inf") || v.is_nan() => Value::Float(v),
            _ => {
                return Err(DocumentError::located(place, "this number is too large")
                    .help("the largest number is 1.797e308"));
            }
        },
        DeValue::Boolean(b) => Value::Boolean(b),
        DeValue::Datetime(d) => Value::Date(d.to_string()),
        DeValue::Array(items) => Value::Array(
            items
                .into_iter()
                .map(|item| {
                    let place = Place { source, span: item.span() };
                    convert(item.into_inner(), place, depth)
                })
                .collect::<Result<_, _>>()?,
        ),
        DeValue::Table(entries) => return table(entries, place, depth),
    };
    Ok(Node { value, place })
}
