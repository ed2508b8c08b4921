//! Keys of a scene that a sweep sets: those that clash, and those of all seeds.

use std::path::Path;

use super::Axis;
use crate::run::{Error, Result};
use crate::scene::{OVER, Scene, path_to};

/// Overrides of the first values of `axes`, and the keys that `set` and they set.
fn overridden_keys(
    scene: &Path,
    set: &[String],
    axes: &[Axis],
) -> Result<(Vec<String>, Vec<String>, Vec<String>)> {
    let over: Vec<String> = axes.iter().flat_map(|axis| axis.overrides(0)).collect();
    let mut given = Scene::overridden_keys(scene, set, &over, OVER)?;
    let varied = given.split_off(set.len());
    Ok((over, given, varied))
}

/// Refuses keys of which one sets what another sets too.
pub(super) fn check_keys(scene: &Path, set: &[String], axes: &[Axis]) -> Result<()> {
    let (over, given, varied) = overridden_keys(scene, set, axes)?;
    let inside = |rest: &str| rest.is_empty() || rest.starts_with(['.', '[']);
    let within = |inner: &str, outer: &str| inner.strip_prefix(outer).is_some_and(inside);
    let key = |text: &str| text.split('=').next().unwrap_or_default().trim().to_owned();
    let counts = axes.iter().enumerate().map(|(k, axis)| (k, axis.overrides(0).count()));
    let axis: Vec<usize> = counts.flat_map(|(k, count)| std::iter::repeat_n(k, count)).collect();
    let refuse = |message: String| Err(Error::Refused(message));
    for (k, own_key) in varied.iter().enumerate() {
        let own = key(&over[k]);
        // Overrides of one value follow one another: the last one holds.
        let others = varied[..k].iter().zip(&over).zip(&axis).filter(|(_, of)| **of != axis[k]);
        for ((earlier, other), _) in others {
            if own_key == earlier {
                return refuse(format!(
                    "--over sets {own_key} twice; give it once, with all values"
                ));
            }
            if within(own_key, earlier) || within(earlier, own_key) {
                let what = "clash: one is inside the other";
                return refuse(format!("--over {} and --over {own} {what}", key(other)));
            }
        }
        if let Some(given) = given.iter().position(|given| within(given, own_key)) {
            let what = "clash: what --set gives would be lost; leave out --set";
            return refuse(format!("--set {} and --over {own} {what}", set[given]));
        }
    }
    Ok(())
}

/// Gives keys that end with the same word titles that say what they are of: the effect, as in `coefficient of
/// diffusion of u`, or all of the key.
pub(super) fn disambiguate_titles(scene: &Path, set: &[String], axes: &mut [Axis]) -> Result<()> {
    let shorts: Vec<String> = axes.iter().map(|axis| axis.short().to_owned()).collect();
    let twice = |all: &[String], one: &String| all.iter().filter(|other| *other == one).count() > 1;
    if !shorts.iter().any(|short| twice(&shorts, short)) {
        return Ok(());
    }
    let (over, _, varied) = overridden_keys(scene, set, axes)?;
    let scene = Scene::varied(scene, set, &over, OVER)?;
    let mut keys = varied.into_iter();
    let mut titles: Vec<String> = Vec::new();
    for axis in &*axes {
        // One path a key, but for seeds and settings.
        let mut own = keys.by_ref().take(axis.overrides(0).count());
        let effect = own.next().and_then(|key| {
            let (number, _) = key.strip_prefix("effect[")?.split_once(']')?;
            Some(scene.effects.get(number.parse::<usize>().ok()?)?.name())
        });
        own.for_each(drop);
        titles.push(effect.map_or(axis.key.clone(), |name| format!("{} of {name}", axis.short())));
    }
    for (k, axis) in axes.iter_mut().enumerate().filter(|(k, _)| twice(&shorts, &shorts[*k])) {
        let unclear = twice(&titles, &titles[k]);
        axis.title = if unclear { axis.key.clone() } else { titles[k].clone() };
    }
    Ok(())
}

/// The keys of all seeds that a scene has, with those it leaves to their defaults.
///
/// # Errors
/// If the scene cannot be written as TOML.
pub fn seed_keys(scene: &Scene) -> Result<Vec<String>> {
    fn collect(value: &toml::Value, path: &str, found: &mut Vec<String>) {
        if let toml::Value::Table(entries) = value {
            for (key, value) in entries {
                let path = if path.is_empty() { key.clone() } else { path_to(path, key) };
                if key == "seed" && value.is_integer() {
                    found.push(path);
                } else if key != "parameters" {
                    collect(value, &path, found);
                }
            }
        }
        for (k, item) in value.as_array().into_iter().flatten().enumerate() {
            collect(item, &format!("{path}[{k}]"), found);
        }
    }
    let mut found = Vec::new();
    let text = scene.resolved()?;
    if let Ok(value) = toml::from_str::<toml::Value>(&text) {
        collect(&value, "", &mut found);
    }
    Ok(found)
}

/// Seeds 1 to `count` for everything random in the scene file `scene` with `set` and the first values of `axes`.
///
/// # Errors
/// A scene that is not valid, or in which nothing is random.
pub fn seed_axis(scene: &Path, set: &[String], axes: &[Axis], count: usize) -> Result<Axis> {
    let first: Vec<String> = axes.iter().flat_map(|axis| axis.overrides(0)).collect();
    let paths = seed_keys(&Scene::varied(scene, set, &first, OVER)?)?;
    if paths.is_empty() {
        let message = "--seeds: nothing in the scene is random; give sheet.imperfection, or a \
                       random start of a species";
        return Err(Error::Refused(message.into()));
    }
    Ok(Axis::seeds(paths, count))
}
