//! `mesh`: makes, checks and describes triangle meshes.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::output::{Inputs, ResultFile};
use crate::sheet::write::{self, MeshFormat};
use crate::sheet::{MeshReport, Shape, SheetError, check, generate, read};

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
    /// Report all faults of a mesh file (.obj, .vtu, .vtp, .vtk); exit code 2 if it is
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
    /// Write the mesh to this file (.obj, .vtu, .vtp, .vtk); without it only the report is printed.
    #[arg(long, value_name = "FILE", global = true)]
    out: Option<PathBuf>,
    /// Replace that file if it exists.
    #[arg(long, global = true)]
    force: bool,
}

#[derive(Debug, Clone, Copy, Subcommand)]
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
    /// An open cylinder around the z axis.
    Cylinder {
        /// Radius.
        #[arg(long)]
        radius: f64,
        /// Extent along z.
        #[arg(long)]
        height: f64,
    },
}

impl From<ShapeCommand> for Shape {
    fn from(command: ShapeCommand) -> Self {
        match command {
            ShapeCommand::Disc { radius } => Self::Disc { radius },
            ShapeCommand::Rectangle { width, height } => Self::Rectangle { width, height },
            ShapeCommand::Annulus { inner, outer } => Self::Annulus { inner, outer },
            ShapeCommand::Sphere { radius, irregular } => Self::Sphere { radius, irregular },
            ShapeCommand::Cylinder { radius, height } => Self::Cylinder { radius, height },
        }
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
            let shape = Shape::from(given.shape);
            let out = given.out.as_deref().map(|path| mesh_file(path, given.force)).transpose()?;
            let waiting = super::Waiting::on("making the mesh", false);
            let sheet = generate(&shape, given.vertices, given.seed)?;
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
                let message =
                    format!("the mesh is unusable; {kinds} above marked as error must be repaired");
                return Err(SheetError::File { path: file.clone(), message }.into());
            }
        }
        Command::Info { file } => {
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
            print(args.json, &value, &text);
        }
    }
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
fn mesh_file(path: &Path, force: bool) -> crate::Result<(ResultFile, MeshFormat)> {
    let Some(format) = MeshFormat::of(path) else {
        let message = "a mesh is written as .obj, .vtu, .vtp or .vtk; give the file one of these \
            extensions";
        return Err(SheetError::File { path: path.to_owned(), message: message.into() }.into());
    };
    Ok((ResultFile::new(path, force, &Inputs::default())?, format))
}
