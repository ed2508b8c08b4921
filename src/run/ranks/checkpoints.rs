//! Checkpoints of a run over ranks: one a rank, each of its part; read by as many ranks, or by another number.
//!
//! Ranks write at different moments, so the last step that all have is taken. On another number of ranks each
//! takes the points of its new part from all of them, one after the other.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use super::super::Checkpoint;
use super::piece_root;
use crate::Vec3;
use crate::model::State;
use crate::output::{ResultDirectory, checkpoint};
use crate::reduction::Communicator;
use crate::sheet::Subdomain;

/// A checkpoint to continue from; where it is of another number of ranks, those of all its ranks.
pub(crate) struct UsableCheckpoint {
    pub(crate) checkpoint: Checkpoint,
    pub(crate) parts: Vec<PathBuf>,
}

/// How many ranks the run in `root` had.
pub(crate) fn ranks_of(root: &Path) -> usize {
    let newest = readable(root, &|_| true).pop_last();
    newest.and_then(|(_, path)| read(&path)?.share).map_or(1, |share| share.ranks)
}

/// The last usable checkpoint of a run in `root` for this rank of `now`; `fits` says of one of the first rank whether the
/// results are as it needs them.
///
/// # Errors
/// Why none of the checkpoints is usable; nothing where there are none.
pub(crate) fn last(
    root: &Path,
    now: Option<&dyn Communicator>,
    fits: &dyn Fn(&Checkpoint) -> bool,
) -> Result<UsableCheckpoint, Option<String>> {
    let before = ranks_of(root);
    let (rank, size) = now.map_or((0, 1), |ranks| (ranks.rank(), ranks.size()));
    // Every rank reads some; only the first one sees whether its results are whole.
    let readable = |k: usize| -> BTreeSet<u64> {
        let fits = |found: &Checkpoint| k > 0 || fits(found);
        readable(&piece_root(root, k, before), &fits).into_keys().collect()
    };
    let mine = (rank..before).step_by(size).map(readable).reduce(|a, b| &a & &b);
    let text: Vec<u8> = mine.iter().flatten().flat_map(|step| step.to_le_bytes()).collect();
    let all = now.map_or_else(|| vec![text.clone()], |ranks| ranks.all_gather(&text));
    let steps = all.iter().take(before).map(|text| {
        let steps = text.as_chunks::<8>().0.iter();
        steps.map(|bytes| u64::from_le_bytes(*bytes)).collect::<BTreeSet<u64>>()
    });
    let common = steps.reduce(|a, b| &a & &b).and_then(|mut steps| steps.pop_last());
    let missing = || {
        let text = match before {
            1 => "none of its checkpoints can be read and fits its results".to_owned(),
            _ => format!(
                "no step has a checkpoint of each of its {before} ranks that can be read and fits its results"
            ),
        };
        has_files(root).then_some(text)
    };
    let step = common.ok_or_else(missing)?;
    let path = |k| file_of(&piece_root(root, k, before), step).ok_or_else(missing);
    if before == size {
        let checkpoint = read(&path(rank)?).ok_or_else(missing)?;
        return Ok(UsableCheckpoint { checkpoint, parts: Vec::new() });
    }
    let parts = (0..before).map(path).collect::<Result<Vec<_>, _>>()?;
    Ok(UsableCheckpoint { checkpoint: read(&parts[0]).ok_or_else(missing)?, parts })
}

/// Whether the first rank has files of checkpoints, usable or not.
fn has_files(root: &Path) -> bool {
    ResultDirectory::checkpoints_in(root).is_ok_and(|found| !found.is_empty())
}

fn read(path: &Path) -> Option<Checkpoint> {
    checkpoint::read(path).ok()?.read::<Checkpoint>().ok()
}

/// The checkpoints in a directory that can be read and that `fits` takes, by step.
fn readable(root: &Path, fits: &dyn Fn(&Checkpoint) -> bool) -> BTreeMap<u64, PathBuf> {
    let found = ResultDirectory::checkpoints_in(root).unwrap_or_default().into_iter();
    let step = |path: &Path| read(path).filter(|found| fits(found)).map(|found| found.step());
    found.filter_map(|(_, path)| Some((step(&path)?, path))).collect()
}

/// The file of the checkpoint of a step.
fn file_of(root: &Path, step: u64) -> Option<PathBuf> {
    readable(root, &|_| true).remove(&step)
}

/// The state at the points of `part`, of the whole sheet where there is none, from the checkpoints of all ranks of a run,
/// of which one at a time is read.
pub(crate) fn state_of(parts: &[PathBuf], part: Option<&Subdomain>) -> Option<State> {
    let mut places: Option<[Places; 2]> = None;
    let mut made = State::default();
    for path in parts {
        let of_rank = read(path)?;
        let (share, state) = (of_rank.share.as_ref()?, of_rank.state());
        let [on_vertices, on_faces] = places.get_or_insert_with(|| match part {
            None => share.whole.map(Places::All),
            Some(part) => [&part.vertices, &part.triangles].map(|numbers| Places::new(numbers)),
        });
        (made.time, made.step) = (state.time, state.step);
        if made.x.is_empty() {
            made.x = vec![Vec3::repeat(f64::NAN); on_vertices.count()].into();
            made.species = vec![Vec::new(); state.species.len()];
        }
        on_vertices.take(&share.vertices, &state.x, &mut made.x)?;
        for (to, from) in made.species.iter_mut().zip(&state.species) {
            let (places, numbers) = match from.len() == share.vertices.len() {
                true => (&*on_vertices, &share.vertices),
                false => (&*on_faces, &share.triangles),
            };
            to.resize(places.count(), f64::NAN);
            places.take(numbers, from, to)?;
        }
    }
    let is_complete = made.x.iter().all(|x| !x.x.is_nan());
    (is_complete && made.species.iter().flatten().all(|c| !c.is_nan())).then_some(made)
}

/// Where the points of a sheet with certain numbers are: in the order of these, or of all.
enum Places {
    All(usize),
    Some(HashMap<u32, usize>),
}

impl Places {
    fn new(numbers: &[u32]) -> Self {
        Self::Some(numbers.iter().enumerate().map(|(i, number)| (*number, i)).collect())
    }

    fn count(&self) -> usize {
        match self {
            Self::All(count) => *count,
            Self::Some(places) => places.len(),
        }
    }

    /// Copies the values of points with `numbers` to where they are, if they are; `None` if there are fewer values.
    fn take<T: Copy>(&self, numbers: &[u32], from: &[T], to: &mut [T]) -> Option<()> {
        for (i, number) in numbers.iter().enumerate() {
            let place = match self {
                Self::All(count) => Some(*number as usize).filter(|place| place < count),
                Self::Some(places) => places.get(number).copied(),
            };
            if let Some(place) = place {
                to[place] = *from.get(i)?;
            }
        }
        Some(())
    }
}
