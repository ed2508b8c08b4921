//! Bytes and seconds of a long series in every format: the table of docs/notebook/formats.md.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rumple::Vec3;
use rumple::output::{Compression, Field, Format, Frame, ResultDirectory, Series};
use rumple::sheet::{Shape, generate};

const FRAMES: u32 = 1000;
const VERTICES: usize = 10_000;

fn size(path: &Path) -> u64 {
    let about = fs::metadata(path).unwrap();
    if !about.is_dir() {
        return about.len();
    }
    fs::read_dir(path).unwrap().map(|entry| size(&entry.unwrap().path())).sum()
}

/// Frame `k`: waves that move over a disc, with the displacement and two fields.
fn positions(rest: &[Vec3], k: u32) -> Vec<Vec3> {
    let phase = 0.01 * f64::from(k);
    let height = |p: &Vec3| 2.0 * (0.1 * p.x + phase).sin() * (0.07 * p.y - phase).cos();
    rest.iter().map(|p| p + Vec3::z() * height(p)).collect()
}

#[test]
#[ignore = "takes minutes and 3 GB in the folder RUMPLE_FORMATS; docs/notebook/formats.md has its table"]
fn formats_take_bytes_and_seconds() {
    let root =
        PathBuf::from(std::env::var_os("RUMPLE_FORMATS").expect("RUMPLE_FORMATS is a folder"));
    let sheet = generate(&Shape::Disc { radius: 100.0 }, VERTICES, 1).unwrap();
    let formats = [
        ("vtu", Format::Vtu, Compression::Zlib),
        ("vtu-none", Format::Vtu, Compression::None),
        ("vtkhdf", Format::Vtkhdf, Compression::Zlib),
        ("vtkhdf-none", Format::Vtkhdf, Compression::None),
    ];
    for (name, format, compression) in formats {
        let directory = ResultDirectory::prepare(&root.join(name), true).unwrap();
        let mut series = Series::create(&directory, compression).in_format(format);
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
            series.push(&frame).unwrap();
            seconds += start.elapsed().as_secs_f64();
        }
        let bytes = rumple::num::real(usize::try_from(size(directory.root())).unwrap());
        println!("{name}: {:.1} MB, {seconds:.1} s to write {FRAMES} frames", 1e-6 * bytes);
    }
}
