//! One size: mesh, energy and gradient, Hessian, factor, equilibrium, memory.

use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::{
    Bending, BondStretching, EnergyTerm, HessianPart, Material, MeyerBending, Stretching,
};
use rumple::model::{Mechanics, Potential};
use rumple::num::real;
use rumple::sheet::{Sheet, SheetShape, generate};
use rumple::solve::equilibrium::Goal;
use rumple_numerics::linear::{BlockCholesky, BlockMatrix, BlockPattern, Multigrid};

use crate::common::{Result, cpu_seconds, equilibrium, gibibytes, number};
use crate::{Options, seconds};

/// Titles of the columns.
pub const TITLES: [&str; 15] = [
    "vertices",
    "mesh",
    "energy and gradient",
    "Hessian",
    "ordering and symbolic part",
    "factorisation",
    "solve",
    "factor GiB",
    "method",
    "equilibrium",
    "iterations",
    "evaluations",
    "factorisations",
    "residual",
    "peak memory GiB",
];

/// Radius of the disc; the hexagon has the same area.
const RADIUS: f64 = 100.0;

/// Time over which something short is repeated: many ticks of the clock, seconds.
const LONG_ENOUGH: f64 = 0.5;

/// What a factorisation needs beside the factor, as a multiple of it.
const WORKSPACE_FACTOR: f64 = 1.3;

/// The row of one size.
pub fn row(options: &Options, vertices: usize) -> Result<Vec<String>> {
    let mut row = Vec::new();
    let (sheet, mesh) = timed(|| make_sheet(options, vertices))?;
    let sheet = Arc::new(sheet?);
    row.extend([sheet.vertex_count().to_string(), seconds(mesh)]);
    let mut mechanics = loaded(&sheet)?;
    let mut x = dome(&sheet);
    let mut gradient = vec![Vec3::zeros(); x.len()];
    row.push(seconds(repeated(|| {
        mechanics.energy_gradient(&x, &mut gradient);
    })?));

    let (pattern, patterned) = timed(|| mechanics.mechanics().pattern_with(&[]))?;
    let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
    row.push(seconds(repeated(|| {
        mechanics
            .hessian(&x, HessianPart::Positive, &mut hessian)
            .expect("all blocks are declared");
    })?));
    hessian.add_diagonal(1e-10 * hessian.mean_diagonal());
    let multigrid = options.set.iter().any(|s| s.contains("multigrid"));
    let fits = if multigrid {
        measure_multigrid(&pattern, &hessian, &x, &gradient, patterned, &mut row)?;
        true
    } else {
        measure_factor(&pattern, &hessian, &gradient, patterned, &mut row)?
    };
    drop(hessian);

    let method = if fits { Some(&options.method) } else { options.large_method.as_ref() };
    match method {
        None => row.extend(std::iter::repeat_n("not tried".to_owned(), 6)),
        Some(method) => relax(options, method, &mut mechanics, &mut x, &mut row)?,
    }
    row.push(number(gibibytes("/proc/self/status", "VmHWM:")?));
    Ok(row)
}

/// Ordering, factorisation, solution and size of a factor; whether it fits into memory.
fn measure_factor(
    pattern: &Arc<BlockPattern>,
    hessian: &BlockMatrix,
    gradient: &[Vec3],
    patterned: f64,
    row: &mut Vec<String>,
) -> Result<bool> {
    let (cholesky, analysed) = timed(|| BlockCholesky::<f32>::new(Arc::clone(pattern)))?;
    let mut cholesky = cholesky?;
    row.push(seconds(patterned + analysed));
    // Its memory is set aside but not touched before the first factorisation.
    let size = 4.0 * real(cholesky.factor_size()) / f64::from(1 << 30);
    let fits = WORKSPACE_FACTOR * size < gibibytes("/proc/meminfo", "MemAvailable:")?;
    if fits {
        let (done, factorised) = timed(|| cholesky.factorise(hessian))?;
        done.map_err(|_| "the positive part of the Hessian is not positive")?;
        row.push(seconds(factorised));
        row.push(seconds(solution(gradient, |rhs| cholesky.solve(rhs))?));
    } else {
        row.extend(["does not fit".to_owned(), String::new()]);
    }
    row.push(number(size));
    Ok(fits)
}

/// The same of multigrid: aggregation, taking over a matrix, one cycle, size of all levels.
fn measure_multigrid(
    pattern: &Arc<BlockPattern>,
    hessian: &BlockMatrix,
    x: &[Vec3],
    gradient: &[Vec3],
    patterned: f64,
    row: &mut Vec<String>,
) -> Result<()> {
    let (multigrid, analysed) = timed(|| Multigrid::new(pattern))?;
    let mut multigrid = multigrid?;
    row.push(seconds(patterned + analysed));
    let (done, loaded) = timed(|| multigrid.factorise(hessian, x, true))?;
    done.map_err(|_| "the positive part of the Hessian is not positive")?;
    row.push(seconds(loaded));
    row.push(seconds(solution(gradient, |rhs| multigrid.solve(rhs))?));
    row.push(number(real(multigrid.bytes()) / f64::from(1 << 30)));
    Ok(())
}

/// CPU seconds of one solution.
fn solution(gradient: &[Vec3], mut solve: impl FnMut(&mut [Vec3])) -> Result<f64> {
    // From the same right-hand side every time: solving again and again ends in denormals.
    let mut rhs = gradient.to_vec();
    repeated(|| {
        rhs.copy_from_slice(gradient);
        solve(&mut rhs);
    })
}

fn relax(
    options: &Options,
    method: &str,
    mechanics: &mut Potential,
    x: &mut [Vec3],
    row: &mut Vec<String>,
) -> Result<()> {
    row.push(method.to_owned());
    let spec = equilibrium(method, &options.set)?;
    let goal = Goal {
        tolerance: spec.tolerance().on(mechanics),
        max_iterations: spec.max_iterations(),
        ..Goal::default()
    };
    let before = mechanics.mechanics().tally().work();
    let (done, time) = timed(|| spec.build(mechanics.mechanics())?.relax(mechanics, x, &goal))?;
    row.push(seconds(time));
    match done {
        Ok(done) => {
            let work = mechanics.mechanics().tally().work() - before;
            row.extend(
                [work.iterations, work.gradients, work.factorisations].map(|n| n.to_string()),
            );
            row.push(format!("{:.1e}", done.residual));
        }
        Err(error) => row.extend([error.to_string(), String::new(), String::new(), String::new()]),
    }
    Ok(())
}

/// Runs `f` once; its result and CPU seconds.
fn timed<R>(f: impl FnOnce() -> R) -> Result<(R, f64)> {
    let began = cpu_seconds()?;
    let result = f();
    Ok((result, cpu_seconds()? - began))
}

/// CPU seconds of one `f`, after a first one that does not count.
fn repeated(mut f: impl FnMut()) -> Result<f64> {
    f();
    let (began, mut count, mut batch) = (cpu_seconds()?, 0usize, 1usize);
    loop {
        for _ in 0..batch {
            f();
        }
        count += batch;
        let used = cpu_seconds()? - began;
        if used > LONG_ENOUGH {
            return Ok(used / real(count));
        }
        batch *= 2;
    }
}

fn make_sheet(options: &Options, vertices: usize) -> Result<Sheet> {
    if options.lattice {
        return Ok(hexagon(vertices)?);
    }
    Ok(generate(&SheetShape::Disc { radius: RADIUS }, vertices, 1)?)
}

/// A regular hexagon of equilateral triangles with 3n² + 3n + 1 vertices, n as fits `vertices`
/// best, and the area of the disc. Rows from bottom to top, so neighbours are near in memory only
/// along a row.
fn hexagon(vertices: usize) -> std::result::Result<Sheet, rumple::sheet::SheetError> {
    let n = rumple::num::whole(((12.0 * real(vertices) - 3.0).sqrt() - 3.0) / 6.0).max(2);
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let edge = (area / (1.5 * 3f64.sqrt())).sqrt() / real(n);
    let (mut points, mut first) = (Vec::new(), Vec::new());
    let length = |row: usize| 2 * n + 1 - row.abs_diff(n);
    for row in 0..=2 * n {
        first.push(points.len());
        let y = (real(row) - real(n)) * 0.75f64.sqrt() * edge;
        let left = -0.5 * real(length(row) - 1);
        points.extend((0..length(row)).map(|k| Vec3::new((left + real(k)) * edge, y, 0.0)));
    }
    let mut triangles = Vec::new();
    for row in 0..2 * n {
        // The upper row starts half an edge to the left in the lower half, to the right above it.
        let shift = usize::from(row < n);
        let (low, high) = (first[row], first[row + 1]);
        let at = |start: usize, k: usize| rumple::num::index(start + k);
        for k in 0..length(row) {
            let above = k + shift;
            if k + 1 < length(row) && above < length(row + 1) {
                triangles.push([at(low, k), at(low, k + 1), at(high, above)]);
            }
            if above >= 1 && above < length(row + 1) {
                triangles.push([at(low, k), at(high, above), at(high, above - 1)]);
            }
        }
    }
    Sheet::new(points, triangles)
}

/// The sheet with its energies, pins and growth.
fn loaded(sheet: &Arc<Sheet>) -> Result<Potential> {
    let material = Material { young: 1e6, poisson: 1.0 / 3.0, thickness: 2.0 };
    let (stretching, bending) = (Stretching::default(), Bending::default());
    let energies: Vec<EnergyTerm> = vec![
        EnergyTerm::new(BondStretching::new(&material, stretching.weight)),
        EnergyTerm::new(MeyerBending::new(sheet, &material, bending.weight, bending.area)),
    ];
    let pins = sheet.boundary().iter().map(|boundary| [false, false, *boundary]).collect();
    let mut mechanics = Potential::new(&Mechanics::new(Arc::clone(sheet), energies, pins)?);
    let factor: Vec<f64> = sheet
        .edges()
        .iter()
        .map(|e| {
            let [a, b] = e.vertices.map(|v| sheet.rest()[v as usize]);
            1.0 + 0.05 * spot(&(0.5 * (a + b)))
        })
        .collect();
    mechanics.set_length_factor(&factor);
    Ok(mechanics)
}

/// The start: a dome over the part that grows.
fn dome(sheet: &Sheet) -> Vec<Vec3> {
    let height = |x: &Vec3, boundary: bool| if boundary { 0.0 } else { 0.5 * spot(x) };
    let raised = sheet.rest().iter().zip(sheet.boundary());
    raised.map(|(x, boundary)| Vec3::new(x.x, x.y, height(x, *boundary))).collect()
}

fn spot(x: &Vec3) -> f64 {
    (-(x.x * x.x + x.y * x.y) / (2.0 * 20.0 * 20.0)).exp()
}
