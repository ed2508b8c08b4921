//! `mesh`: makes, checks and describes triangle meshes.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::output::{Inputs, ResultFile};
use crate::run::read_sheet;
use crate::scene::Scene;
use crate::sheet::write::{self, MeshFormat};
use crate::sheet::{MeshReport, Sheet, SheetError, check, read};

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
    /// Make the mesh of a shape.
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
    /// A shape of `[sheet]`: disc, rectangle, lattice, annulus, polygon, sphere, cylinder, cap, torus, ellipsoid, wavy-strip,
    /// graph.
    shape: String,
    /// Its other keys there, as radius=5.
    #[arg(value_name = "KEY=VALUE")]
    keys: Vec<String>,
    /// Number of vertices: met exactly, but for the icosphere, which takes the nearest 10n² + 2.
    #[arg(long, default_value_t = 20_000)]
    vertices: usize,
    /// Same seed, same mesh.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the mesh to this file (.obj, .vtu, .vtp); without it only the report is printed.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace that file if it exists.
    #[arg(long)]
    force: bool,
}

impl GenerateArgs {
    /// The mesh, and the table `[sheet]` that has it.
    fn generate(&self) -> crate::Result<(Sheet, Value)> {
        let own = [
            format!("shape={}", self.shape),
            format!("vertices={}", self.vertices),
            format!("seed={}", self.seed),
        ];
        let keys = own.iter().chain(&self.keys).map(|key| format!("sheet.{key}"));
        let text = "sheet = {}\ntime = { until = 1.0 }\n";
        let scene = Scene::parse(text, "sheet", &keys.collect::<Vec<_>>())?;
        let sheet = read_sheet(&scene, &mut Vec::new())?;
        Ok((sheet, json!(scene.sheet.source)))
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
            let (sheet, shape) = given.generate()?;
            drop(waiting);
            if let Some((file, format)) = out {
                file.write(|mut out| write::mesh(&sheet, format, &mut out))?;
            }
            let report = MeshReport::new(&sheet);
            let value = json!({ "sheet": shape, "out": given.out, "mesh": report });
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
