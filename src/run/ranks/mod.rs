//! A run of one sheet over several ranks.
//!
//! ```text
//! DIR              results of the first rank: ledger, status, index of the frames
//! DIR/ranks/N/R    those of rank R of N: its pieces of the frames, its checkpoints
//! ```
//!
//! Every rank goes through the run as one process does; what is summed, compared or decided passes the reduction of the
//! sheet. A frame is one piece a rank, without ghosts, under one `.pvtu`.

pub(super) mod checkpoints;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Error, Result};
use crate::Vec3;
use crate::model::{AtBoundary, State};
use crate::output::provenance::MeshRecord;
use crate::output::{Field, Frame};
use crate::reduction::Communicator;
use crate::scene::{Scene, SheetSource};
use crate::sheet::read::pvtu::{TRIANGLE_NUMBER, VERTEX_NUMBER};
use crate::sheet::{Sheet, Subdomain};

/// What a rank has of the sheet.
pub(crate) struct RankPart {
    pub(super) part: Subdomain,
    /// The record of the whole mesh.
    pub(super) mesh: MeshRecord,
    ranks: usize,
}

/// Which part of a sheet over ranks a checkpoint is of: numbers in the whole.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Share {
    ranks: usize,
    vertices: Vec<u32>,
    triangles: Vec<u32>,
    whole: [usize; 2],
}

impl RankPart {
    pub(super) fn new(part: Subdomain, mesh: MeshRecord) -> Self {
        let ranks = part.sheet.reduction().distribution().map_or(1, |d| d.communicator.size());
        Self { part, mesh, ranks }
    }

    pub(super) fn share(&self) -> Share {
        let Subdomain { vertices, triangles, whole, .. } = &self.part;
        let (vertices, triangles) = (vertices.to_vec(), triangles.to_vec());
        Share { ranks: self.ranks, vertices, triangles, whole: *whole }
    }
}

/// Refuses what a scene asks for and a run of a `periodic` sheet, or else over ranks, does not have.
pub(super) fn check(scene: &Scene, periodic: bool) -> Result<()> {
    let place = if periodic { "on a periodic sheet" } else { "on more than one rank" };
    let refuse = |path: &str, what: &str, help: &str| {
        let message = format!("{what} {place}");
        Err(scene.error_at(path, &message, Some(help)).into())
    };
    if matches!(scene.sheet.source, SheetSource::Point { .. }) {
        return refuse("sheet.shape", "a point is not spread", "run it in one process");
    }
    let watched = scene.stability.as_ref().is_some_and(|stability| stability.watch);
    if watched && !periodic {
        return refuse("stability", "stability is not watched", "leave [stability] out");
    }
    if !periodic && scene.kinetics.iter().any(|law| law.boundary == AtBoundary::OneSided) {
        let help = "boundary = \"zero\"";
        return refuse("kinetics", "curvatures at the boundary are not extrapolated", help);
    }
    if scene.invariants.is_some() {
        return refuse("invariants", "invariants are not watched", "leave [invariants] out");
    }
    Ok(())
}

/// Where a rank writes.
#[must_use]
pub fn root(of_run: &Path, ranks: &dyn Communicator) -> PathBuf {
    piece_root(of_run, ranks.rank(), ranks.size())
}

fn piece_root(of_run: &Path, rank: usize, ranks: usize) -> PathBuf {
    match rank {
        0 => of_run.to_owned(),
        rank => of_run.join("ranks").join(ranks.to_string()).join(rank.to_string()),
    }
}

/// The folders of the frames of all ranks, as the first one's frames see them.
pub(super) fn piece_folders(ranks: usize) -> Vec<PathBuf> {
    let of = |rank| match rank {
        0 => PathBuf::new(),
        rank => piece_root(Path::new(".."), rank, ranks).join("frames"),
    };
    (0..ranks).map(of).collect()
}

/// What `part` has of a state of the sheet that it was cut from.
pub(super) fn restricted(part: &Subdomain, mut state: State) -> State {
    let mut x = state.x.to_vec();
    part.restrict(&mut x);
    state.x = x.into();
    state.species.iter_mut().for_each(|values| part.restrict(values));
    state
}

/// `outcome`, or an error on all ranks where one of them has one.
///
/// # Errors
/// That of this rank, or that there is one elsewhere.
pub fn agreed<T>(ranks: Option<&dyn Communicator>, outcome: Result<T>) -> Result<T> {
    let Some(ranks) = ranks else { return outcome };
    let mut failed = [if outcome.is_err() { 1.0 } else { 0.0 }];
    ranks.max(&mut failed);
    match outcome {
        Ok(_) if failed[0] > 0.0 => Err(Error::Elsewhere),
        outcome => outcome,
    }
}

/// A rank's piece of a frame: the triangles that it counts, and their vertices. Of a periodic sheet all vertices of the cell
/// come first, and the images that triangles across its edges need follow.
pub(super) struct Piece {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Numbers in the frame of the points.
    vertices: Vec<usize>,
}

impl Piece {
    /// That of `frame`, a frame of all that the rank has of `sheet`.
    pub(super) fn new(sheet: &Sheet, frame: &Frame<'_>) -> Self {
        let counted = sheet.reduction().owned(sheet.triangle_count());
        let mut place = vec![u32::MAX; frame.points.len()];
        let periodic = !sheet.reduction().periods().is_empty();
        let first = if periodic { sheet.reduction().owned(frame.points.len()) } else { 0 };
        let mut vertices: Vec<usize> = (0..first).collect();
        place[..first].iter_mut().zip(0..).for_each(|(place, v)| *place = v);
        let triangles = frame.triangles[..counted].iter().map(|corners| {
            corners.map(|v| {
                let place = &mut place[v as usize];
                if *place == u32::MAX {
                    *place = crate::num::index(vertices.len());
                    vertices.push(v as usize);
                }
                *place
            })
        });
        let triangles = triangles.collect();
        let points = vertices.iter().map(|&v| frame.points[v]).collect();
        Self { points, triangles, vertices }
    }

    /// It as a frame, with the numbers of points and triangles in the whole sheet; single numbers are those of the whole.
    pub(super) fn frame<'a>(&'a self, sheet: &Sheet, of: &Frame<'_>) -> Frame<'a> {
        let counted = self.triangles.len();
        // What is not known at ghosts comes from their owners.
        let on_points = of.point.iter().map(|field| {
            let mut columns: Vec<Vec<f64>> = (0..field.components)
                .map(|c| field.data.iter().skip(c).step_by(field.components).copied().collect())
                .collect();
            sheet.reduction().update_ghost_columns(&mut columns);
            let rows = self.vertices.iter().flat_map(|&v| columns.iter().map(move |c| c[v]));
            array(field, rows.collect())
        });
        let mut point: Vec<_> = on_points.collect();
        let of_cells = of.cell.iter();
        let mut cell: Vec<_> = of_cells
            .map(|field| array(field, field.data[..counted * field.components].to_vec()))
            .collect();
        if sheet.reduction().ranks().is_some() {
            let numbers: Vec<f64> = self.vertices.iter().map(|&v| sheet.number(v).into()).collect();
            point.push(Field::scalar(VERTEX_NUMBER.to_owned(), numbers));
            let numbers: Vec<f64> = (0..counted).map(|t| sheet.triangle_number(t).into()).collect();
            cell.push(Field::scalar(TRIANGLE_NUMBER.to_owned(), numbers));
        }
        let Frame { time, step, .. } = *of;
        let (points, triangles, field_data) =
            (&self.points, &self.triangles, of.field_data.clone());
        Frame { time, step, points, triangles, point, cell, field_data }
    }
}

/// A field like `of` with other values.
fn array(of: &Field<'_>, data: Vec<f64>) -> Field<'static> {
    Field { name: of.name.clone(), components: of.components, data: Cow::Owned(data) }
}
