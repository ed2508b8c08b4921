//! Checkpoints of a run over ranks: one a rank, each of its part; read by as many ranks, or by another number.
//!
//! Ranks write at different moments, so the last step that all have is taken. On another number of ranks the parts are put
//! together to the state of the whole sheet, of which each rank takes its new part.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::Checkpoint;
use super::piece_root;
use crate::Vec3;
use crate::model::State;
use crate::output::{ResultDirectory, checkpoint};
use crate::reduction::Communicator;

/// A checkpoint to continue from; where it is of another number of ranks, the state of the whole sheet beside it.
pub(crate) struct Usable {
    pub(crate) checkpoint: Checkpoint,
    pub(crate) whole: Option<State>,
}

/// How many ranks the run in `root` had.
pub(crate) fn ranks_of(root: &Path) -> usize {
    let newest = readable(root, &|_| true).pop_last();
    newest.and_then(|(_, found)| found.spread).map_or(1, |share| share.ranks)
}

/// The last usable checkpoint of a run in `root` for this rank of `now`, or why there is none; `fits` says of one of the
/// first rank whether the results are as it needs them.
pub(crate) fn last(
    root: &Path,
    now: Option<&dyn Communicator>,
    fits: &dyn Fn(&Checkpoint) -> bool,
) -> Result<Usable, String> {
    let before = ranks_of(root);
    let rank = now.map_or(0, Communicator::rank);
    let all = (0..before).map(|k| {
        let fits = |found: &Checkpoint| k > 0 || rank > 0 || fits(found);
        readable(&piece_root(root, k, before), &fits)
    });
    let mut all: Vec<_> = all.collect();
    let common = |step: &u64| all.iter().all(|of_rank| of_rank.contains_key(step));
    let steps: Vec<u64> = all[0].keys().copied().filter(common).collect();
    // Only the first rank has seen whether its results are whole.
    let step = match now {
        None => steps.last().copied(),
        Some(ranks) => {
            let text: Vec<u8> = steps.iter().flat_map(|step| step.to_le_bytes()).collect();
            let of_first = ranks.all_gather(&text).into_iter().next().unwrap_or_default();
            let last = of_first.as_chunks::<8>().0.last();
            last.map(|bytes| u64::from_le_bytes(*bytes))
        }
    };
    let missing = || format!("no step has a checkpoint of each of its {before} ranks");
    let step = step.ok_or_else(missing)?;
    let mut parts = Vec::new();
    for of_rank in &mut all {
        parts.push(of_rank.remove(&step).ok_or_else(missing)?);
    }
    if before == now.map_or(1, Communicator::size) {
        return Ok(Usable { checkpoint: parts.swap_remove(rank), whole: None });
    }
    let whole = assembled(&parts).ok_or("its parts do not make up a sheet")?;
    Ok(Usable { checkpoint: parts.swap_remove(0), whole: Some(whole) })
}

/// The checkpoints in a directory that can be read and that `fits` takes, by step.
fn readable(root: &Path, fits: &dyn Fn(&Checkpoint) -> bool) -> BTreeMap<u64, Checkpoint> {
    let found = ResultDirectory::checkpoints_in(root).unwrap_or_default().into_iter();
    let read = |path: &Path| checkpoint::read(path).ok()?.read::<Checkpoint>().ok();
    let read = found.filter_map(|(_, path)| read(&path)).filter(|found| fits(found));
    read.map(|found| (found.step(), found)).collect()
}

/// The state of the whole sheet.
fn assembled(parts: &[Checkpoint]) -> Option<State> {
    let first = parts.first()?;
    let [vertices, triangles] = first.spread.as_ref()?.whole;
    let State { time, step, species, .. } = first.state();
    let on_vertices = first.spread.as_ref()?.vertices.len();
    let count = |values: &Vec<f64>| if values.len() == on_vertices { vertices } else { triangles };
    let mut x = vec![Vec3::repeat(f64::NAN); vertices];
    let mut all: Vec<Vec<f64>> = species.iter().map(|c| vec![f64::NAN; count(c)]).collect();
    for part in parts {
        let (share, state) = (part.spread.as_ref()?, part.state());
        for (i, &v) in share.vertices.iter().enumerate() {
            *x.get_mut(v as usize)? = *state.x.get(i)?;
        }
        for (whole, here) in all.iter_mut().zip(&state.species) {
            let on_vertices = here.len() == share.vertices.len();
            let numbers = if on_vertices { &share.vertices } else { &share.triangles };
            for (i, &p) in numbers.iter().enumerate() {
                *whole.get_mut(p as usize)? = *here.get(i)?;
            }
        }
    }
    let whole = x.iter().all(|x| !x.x.is_nan()) && all.iter().flatten().all(|c| !c.is_nan());
    let x = x.into();
    whole.then(|| State { time: *time, step: *step, x, species: all, internal: Vec::new() })
}
