//! `mesh`: makes, checks and describes triangle meshes.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::Vec3;
use crate::kinetics::formula::FieldFormula;
use crate::output::{Inputs, ResultFile};
use crate::sheet::write::{self, MeshFormat};
use crate::sheet::{
    MeshReport, Sheet, SheetError, SheetShape, check, generate, generate_graph, read,
};

/// Arguments of the command `mesh`.
#[derive(Debug, Args)]
pub struct MeshArgs {
    /// Print JSON instead of text.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make an irregular mesh of a simple shape (or an icosphere).
    Generate(GenerateArgs),
    /// Report all faults of a mesh file (.obj, .ply, .stl, .msh, .vtu, .vtp, .vtk); exit code 2 if it is
    /// unusable.
    Check {
        /// The mesh file.
        file: PathBuf,
    },
    /// Describe a usable mesh file: sizes, quality, arrays.
    Info {
        /// The mesh file.
        file: PathBuf,
    },
}

#[derive(Debug, Args)]
struct GenerateArgs {
    #[command(subcommand)]
    shape: ShapeCommand,
    /// Number of vertices: met exactly, but for the icosphere, which takes the nearest 10n² + 2.
    #[arg(long, default_value_t = 20_000, global = true)]
    vertices: usize,
    /// Same seed, same mesh.
    #[arg(long, default_value_t = 1, global = true)]
    seed: u64,
    /// Write the mesh to this file (.obj, .vtu, .vtp); without it only the report is printed.
    #[arg(long, value_name = "FILE", global = true)]
    out: Option<PathBuf>,
    /// Replace that file if it exists.
    #[arg(long, global = true)]
    force: bool,
}

#[derive(Debug, Clone, Subcommand)]
enum ShapeCommand {
    /// A flat disc.
    Disc {
        /// Radius of the boundary.
        #[arg(long)]
        radius: f64,
    },
    /// A flat rectangle.
    Rectangle {
        /// Extent along x.
        #[arg(long)]
        width: f64,
        /// Extent along y.
        #[arg(long)]
        height: f64,
    },
    /// A flat rectangle of rows of equilateral triangles.
    Lattice {
        /// Extent along x.
        #[arg(long)]
        width: f64,
        /// Extent along y.
        #[arg(long)]
        height: f64,
    },
    /// A flat ring.
    Annulus {
        /// Radius of the hole.
        #[arg(long)]
        inner: f64,
        /// Radius of the outer boundary.
        #[arg(long)]
        outer: f64,
    },
    /// A closed sphere.
    Sphere {
        /// Radius.
        #[arg(long)]
        radius: f64,
        /// Random and relaxed instead of an icosphere.
        #[arg(long)]
        irregular: bool,
    },
    /// A cylinder around the z axis.
    Cylinder {
        /// Radius.
        #[arg(long)]
        radius: f64,
        /// Extent along z.
        #[arg(long)]
        height: f64,
        /// Closed by flat discs.
        #[arg(long)]
        caps: bool,
    },
    /// A part of a sphere, its boundary in z = 0.
    Cap {
        /// Radius of the sphere.
        #[arg(long)]
        radius: f64,
        /// Height of the apex over the boundary.
        #[arg(long)]
        height: f64,
    },
    /// A torus around the z axis.
    Torus {
        /// Distance of the middle of the tube from the axis.
        #[arg(long)]
        major: f64,
        /// Radius of the tube.
        #[arg(long)]
        minor: f64,
    },
    /// A closed ellipsoid.
    Ellipsoid {
        /// Semi-axes along x, y and z, as 3,2,1.
        #[arg(long, value_name = "X,Y,Z", value_delimiter = ',')]
        semi_axes: Vec<f64>,
    },
    /// A strip z = amplitude · sin(2πx/wavelength).
    WavyStrip {
        /// Extent along x.
        #[arg(long)]
        width: f64,
        /// Extent along y.
        #[arg(long)]
        height: f64,
        /// Largest |z|.
        #[arg(long)]
        amplitude: f64,
        /// Period along x.
        #[arg(long)]
        wavelength: f64,
    },
    /// The surface z = f(x, y) over a rectangle.
    Graph {
        /// Extent along x.
        #[arg(long)]
        width: f64,
        /// Extent along y.
        #[arg(long)]
        height: f64,
        /// A formula of x and y, as "0.2*sin(x)*cos(y)".
        #[arg(long, value_name = "FORMULA", allow_hyphen_values = true)]
        z: String,
    },
}

impl ShapeCommand {
    /// Generates the mesh; returned with the description of its shape.
    fn generate(&self, vertices: usize, seed: u64) -> crate::Result<(Sheet, Value)> {
        let shape = match *self {
            Self::Disc { radius } => SheetShape::Disc { radius },
            Self::Rectangle { width, height } => SheetShape::Rectangle { width, height },
            Self::Lattice { width, height } => SheetShape::Lattice { width, height },
            Self::Annulus { inner, outer } => SheetShape::Annulus { inner, outer },
            Self::Sphere { radius, irregular } => SheetShape::Sphere { radius, irregular },
            Self::Cylinder { radius, height, caps } => {
                SheetShape::Cylinder { radius, height, caps }
            }
            Self::Cap { radius, height } => SheetShape::Cap { radius, height },
            Self::Torus { major, minor } => SheetShape::Torus { major, minor },
            Self::Ellipsoid { ref semi_axes } => {
                let semi_axes = <[f64; 3]>::try_from(&semi_axes[..]).map_err(|_| {
                    let n = semi_axes.len();
                    SheetError::Unusable(format!("--semi-axes has {n} numbers; 3 are expected"))
                })?;
                SheetShape::Ellipsoid { semi_axes }
            }
            Self::WavyStrip { width, height, amplitude, wavelength } => {
                SheetShape::WavyStrip { width, height, amplitude, wavelength }
            }
            Self::Graph { width, height, ref z } => {
                let formula = FieldFormula::new(z, false).map_err(|e| {
                    let help = e.help.map(|help| format!("; {help}")).unwrap_or_default();
                    SheetError::Unusable(format!("--z \"{z}\": {}{help}", e.message))
                })?;
                let heights = |points: &[Vec3]| formula.evaluate(points, 0.0);
                let sheet = generate_graph([width, height], &heights, vertices, seed)?;
                let named = json!({ "shape": "graph", "width": width, "height": height, "z": z });
                return Ok((sheet, named));
            }
        };
        Ok((generate(&shape, vertices, seed)?, json!(shape)))
    }
}

/// Runs the command and prints to standard output.
///
/// # Errors
/// Shapes that cannot be made, files that cannot be read or written, and (after everything found
/// has been printed) meshes that cannot be used.
pub fn run(args: &MeshArgs) -> crate::Result<()> {
    match &args.command {
        Command::Generate(given) => {
            let out = given
                .out
                .as_deref()
                .map(|path| mesh_file(path, given.force, &Inputs::default()))
                .transpose()?;
            let waiting = super::Waiting::on("making the mesh", false);
            let (sheet, shape) = given.shape.generate(given.vertices, given.seed)?;
            drop(waiting);
            if let Some((file, format)) = out {
                file.write(|mut out| write::mesh(&sheet, format, &mut out))?;
            }
            let report = MeshReport::new(&sheet);
            let value = json!({
                "shape": shape, "seed": given.seed, "out": given.out, "mesh": report
            });
            print(args.json, &value, &report.to_string());
        }
        Command::Check { file } => {
            let surface = read::surface(file)?;
            let (findings, _) = check::examine(&surface);
            let fatal = findings.iter().filter(|f| f.fatal).count();
            let mut lines: Vec<String> = findings
                .iter()
                .map(|f| format!("{} {f}", if f.fatal { "error:" } else { "note:" }))
                .chain(surface.notes.iter().map(|note| format!("note: {note}")))
                .collect();
            let value = json!({
                "file": file, "usable": fatal == 0, "findings": findings, "notes": surface.notes
            });
            if fatal == 0 {
                lines.push(format!("{}: usable", file.display()));
            }
            print(args.json, &value, &lines.join("\n"));
            if fatal > 0 {
                let kinds = if fatal == 1 { "the kind of fault" } else { "the kinds of faults" };
                let advice: Vec<&str> = findings.iter().filter_map(|f| f.fault.advice()).collect();
                let advice = advice.join(". ");
                let message = format!(
                    "the mesh is unusable; {kinds} above marked as error must be repaired. {advice}"
                );
                return Err(SheetError::File { path: file.clone(), message }.into());
            }
        }
        Command::Info { file } => describe(file, args.json)?,
    }
    Ok(())
}

/// Describes a usable mesh.
fn describe(file: &Path, as_json: bool) -> crate::Result<()> {
    let surface = read::surface(file)?;
    let arrays = |list: &[crate::sheet::Array]| -> Vec<Value> {
        list.iter().map(|a| json!({ "name": a.name, "components": a.components })).collect()
    };
    let (points, cells) = (arrays(&surface.point_arrays), arrays(&surface.cell_arrays));
    let (sheet, findings) = surface.into_sheet()?;
    let report = MeshReport::new(&sheet);
    let mut text = report.to_string();
    for (place, list) in [("point", &points), ("cell", &cells)] {
        for array in list {
            text += &format!("\n{place} array      {array}");
        }
    }
    for finding in &findings {
        text += &format!("\nnote: {finding}");
    }
    let value = json!({
        "file": file, "mesh": report, "point_arrays": points, "cell_arrays": cells,
        "findings": findings
    });
    print(as_json, &value, &text);
    Ok(())
}

/// Prints one of the two forms.
fn print(as_json: bool, value: &Value, text: &str) {
    if as_json {
        say!("{value:#}");
    } else {
        say!("{text}");
    }
}

/// The file to be written, and its format.
fn mesh_file(path: &Path, force: bool, inputs: &Inputs) -> crate::Result<(ResultFile, MeshFormat)> {
    let Some(format) = MeshFormat::from_path(path) else {
        let message =
            "a mesh is written as .obj, .vtu or .vtp; give the file one of these extensions";
        return Err(SheetError::File { path: path.to_owned(), message: message.into() }.into());
    };
    Ok((ResultFile::new(path, force, inputs)?, format))
}
