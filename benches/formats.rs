//! Bytes and seconds of a long series in every format: the table of docs/notebook/formats.md.
//!
//! `cargo bench --bench formats -- FOLDER` takes minutes and 3 GB in the folder.

#![allow(missing_docs)]

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use rumple::Vec3;
use rumple::output::{Compression, Field, Frame, ResultDirectory, Series};
use rumple::sheet::{SheetShape, generate};

const FRAMES: u32 = 1000;
const VERTICES: usize = 10_000;

fn size(path: &Path) -> std::io::Result<u64> {
    let about = fs::metadata(path)?;
    if !about.is_dir() {
        return Ok(about.len());
    }
    fs::read_dir(path)?.map(|entry| size(&entry?.path())).sum()
}

/// Frame `k`: waves that move over a disc, with the displacement and two fields.
fn positions(rest: &[Vec3], k: u32) -> Vec<Vec3> {
    let phase = 0.01 * f64::from(k);
    let height = |p: &Vec3| 2.0 * (0.1 * p.x + phase).sin() * (0.07 * p.y - phase).cos();
    rest.iter().map(|p| p + Vec3::z() * height(p)).collect()
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let done = match arguments.as_slice() {
        [folder] => measure(Path::new(folder)),
        _ => Err("give a folder".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("formats: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(root: &Path) -> Result<(), Box<dyn Error>> {
    let sheet = generate(&SheetShape::Disc { radius: 100.0 }, VERTICES, 1)?;
    for (name, compression) in [("vtu", Compression::Zlib), ("vtu-none", Compression::None)] {
        let directory = ResultDirectory::prepare(&root.join(name), true)?;
        let mut series = Series::create(&directory, compression);
        let mut seconds = 0.0;
        for k in 0..FRAMES {
            let points = positions(sheet.rest(), k);
            let moved: Vec<Vec3> = points.iter().zip(sheet.rest()).map(|(x, r)| x - r).collect();
            let field = |f: fn(&Vec3) -> f64| points.iter().map(f).collect::<Vec<f64>>();
            let frame = Frame {
                time: 0.01 * f64::from(k),
                step: u64::from(k),
                points: &points,
                triangles: sheet.triangles(),
                point: vec![
                    Field::scalar(
                        "c",
                        field(|p| (-1e-3 * p.norm_squared()).exp() + 0.1 * p.z.tanh()),
                    ),
                    Field::scalar("mean_curvature [1/length]", field(|p| 0.01 * p.z)),
                    Field::vector("displacement [length]", &moved),
                ],
                cell: Vec::new(),
                field_data: vec![("energy of bending [energy]".to_owned(), 1.0)],
            };
            let start = Instant::now();
            series.push(&frame)?;
            seconds += start.elapsed().as_secs_f64();
        }
        let megabytes = size(directory.root())? / 1_000_000;
        println!("{name}: {megabytes} MB, {seconds:.1} s to write {FRAMES} frames");
    }
    Ok(())
}
