//! `--set key.path=value`: changes to a scene's document before it is checked.

use super::toml_tree;
use crate::document::DocumentError;
use crate::document::{Key, MAX_DEPTH, Node, Place, Segment, Value, key_path};

/// Applies the override number `source` (from 1) to `root`.
///
/// The value is read as TOML; a value that is not TOML and has no quotes or brackets is taken as text, so
/// `time.policy=quasi-static` needs no quotes. A list element is named by its number (`effect[1]`
/// or `effect.1`) or, for tables with a kind, by that (`effect.bending`). Tables on the way are
/// made where they are missing.
///
/// Returns the path of what was set, list elements by their numbers.
///
/// # Errors
/// No `=`, a path that cannot be followed, a value that is not TOML; placed in the override.
pub(crate) fn apply(root: &mut Node, text: &str, source: usize) -> Result<String, DocumentError> {
    let all = Place { source, span: 0..text.len() };
    let Some((path, value)) = text.split_once('=') else {
        return Err(DocumentError::located(all, "an override has the form key.path=value"));
    };
    let path_place = Place { source, span: 0..path.len() };
    let segments = parse_path(path).map_err(|message| {
        DocumentError::located(path_place.clone(), message).help(
            "a path has the form time.until or \
            effect[0].model",
        )
    })?;
    if segments.len() > MAX_DEPTH {
        return Err(DocumentError::located(
            path_place,
            format!("a path of more than {MAX_DEPTH} steps"),
        ));
    }
    let value = parse_value(value, source, path.len() + 1, &segments)?;
    set(root, &segments, value, &path_place)
}

fn parse_path(path: &str) -> Result<Vec<Segment>, String> {
    let mut segments = Vec::new();
    let mut rest = path.trim();
    loop {
        if let Some(quoted) = rest.strip_prefix('"') {
            let (key, after) = quoted.split_once('"').ok_or("a quote is not closed")?;
            segments.push(Segment::Key(key.to_owned()));
            rest = after;
        } else {
            let end = rest.find(['.', '[']).unwrap_or(rest.len());
            let key = rest[..end].trim();
            if key.is_empty() {
                return Err("a key is missing in the path".to_owned());
            }
            segments.push(Segment::Key(key.to_owned()));
            rest = &rest[end..];
        }
        while let Some(after) = rest.strip_prefix('[') {
            let (number, after) = after.split_once(']').ok_or("a bracket is not closed")?;
            let index = number.trim().parse();
            let index = index.map_err(|_| format!("{number:?} is not an element number"))?;
            segments.push(Segment::Index(index));
            rest = after;
        }
        if rest.is_empty() {
            return Ok(segments);
        }
        rest = rest.strip_prefix('.').ok_or_else(|| format!("unexpected {rest:?} in the path"))?;
    }
}

fn parse_value(
    raw: &str,
    source: usize,
    offset: usize,
    path: &[Segment],
) -> Result<Node, DocumentError> {
    let text = raw.trim();
    let offset = offset + (raw.len() - raw.trim_start().len());
    let place = Place { source, span: offset..offset + text.len() };
    if text.is_empty() {
        let problem = DocumentError::located(place, "an override needs a value after the =");
        // A key alone may belong into a table.
        let home = match path {
            [Segment::Key(key)] => super::misplaced_key::find(key),
            _ => None,
        };
        return Err(problem.help(home.map_or_else(
            || "an empty string is written \"\"".to_owned(),
            |home| format!("did you mean {home}?"),
        )));
    }
    toml_tree::value(text, source, offset).or_else(|problem| {
        if !problem.is_syntax() || text.starts_with(['[', '{', '"', '\'']) {
            return Err(problem.placed(&place));
        }
        Ok(Node { value: Value::String(text.to_owned()), place })
    })
}

fn set(
    root: &mut Node,
    segments: &[Segment],
    value: Node,
    place: &Place,
) -> Result<String, DocumentError> {
    let mut node = root;
    let mut followed = segments.to_vec();
    for (done, segment) in segments.iter().enumerate() {
        let here = || key_path(&segments[..done]);
        node = match (&mut node.value, segment) {
            (Value::Table(entries), Segment::Key(name)) => {
                let at = entries.iter().position(|(key, _)| key.name == *name);
                let at = at.unwrap_or_else(|| {
                    let key = Key { name: name.clone(), place: place.clone() };
                    entries.push((key, Node::empty_table(place.clone())));
                    entries.len() - 1
                });
                if done + 1 == segments.len() {
                    entries[at].0.place = place.clone();
                }
                &mut entries[at].1
            }
            (Value::Array(items), segment) => {
                let rest = &segments[done + 1..];
                let found = element_index(items, (segment, rest), &here());
                let at = found.map_err(|p| p.placed(place))?;
                followed[done] = Segment::Index(at);
                &mut items[at]
            }
            (Value::Table(entries), Segment::Index(_)) => {
                let message = match entries.is_empty() {
                    true => format!(
                        "the scene gives no list {}: one element of it cannot be set alone",
                        here()
                    ),
                    false => format!("{} is a table, not a list", here()),
                };
                return Err(DocumentError::located(place.clone(), message));
            }
            (other, _) => {
                let message = format!("{} is {}, nothing is inside", here(), other.describe());
                return Err(DocumentError::located(place.clone(), message));
            }
        };
    }
    *node = value;
    Ok(key_path(&followed))
}

/// Which element of a list a step of the path means; `rest` are those that follow it.
fn element_index(
    items: &[Node],
    (segment, rest): (&Segment, &[Segment]),
    list: &str,
) -> Result<usize, DocumentError> {
    let index = match segment {
        Segment::Index(index) => Some(*index),
        Segment::Key(key) => key.parse().ok(),
    };
    let count = items.len();
    match (index, segment) {
        (Some(index), _) if index < count => Ok(index),
        (None, Segment::Key(wanted)) => index_by_kind(items, (wanted, rest), list),
        _ => Err(DocumentError::plain(format!("{list} has {count} elements, numbered from 0"))),
    }
}

fn index_by_kind(
    items: &[Node],
    (wanted, rest): (&str, &[Segment]),
    list: &str,
) -> Result<usize, DocumentError> {
    let kinds: Vec<&str> = items
        .iter()
        .map(|item| match item.get("kind").map(|node| &node.value) {
            Some(Value::String(kind)) => kind.as_str(),
            _ => "",
        })
        .collect();
    let mut found = kinds.iter().enumerate().filter(|(_, kind)| **kind == wanted);
    match (found.next(), found.next()) {
        (Some((at, _)), None) => Ok(at),
        (Some((at, _)), Some(_)) => {
            let message = format!("{list} lists {wanted} more than once");
            Err(DocumentError::plain(message)
                .help(format!("name one by its number, as in {list}[{at}]")))
        }
        (None, _) if kinds.iter().all(|kind| kind.is_empty()) => {
            // A key of its elements, without saying of which: the first that has most of the path is meant.
            let key = [Segment::Key(wanted.to_owned())];
            let path = || key.iter().chain(rest);
            let known = |item: &Node| {
                let mut at = Some(item);
                let step = |segment: &Segment| match segment {
                    Segment::Key(key) => {
                        at.and_then(|node| node.get(key)).inspect(|node| at = Some(node))
                    }
                    Segment::Index(_) => None,
                };
                path().map_while(step).count()
            };
            let most = items.iter().map(known).max().unwrap_or(0);
            let place = items.iter().position(|item| known(item) == most).unwrap_or(0);
            let message =
                format!("{list} is a list of {}, named by their numbers from 0", items.len());
            Err(DocumentError::plain(message)
                .help(format!("write {list}[{place}].{}", key_path(path()))))
        }
        (None, _) => {
            let named: Vec<_> = kinds.into_iter().filter(|kind| !kind.is_empty()).collect();
            Err(DocumentError::unknown_name(&format!("element of {list}"), wanted, &named))
        }
    }
}
