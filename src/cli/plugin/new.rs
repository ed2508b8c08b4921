//! `rumple plugin new`: files from the templates beside this one.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::kinetics::{C_HEADER, search};
use crate::{Error, Result};

/// Arguments of `plugin new`.
#[derive(Debug, Args)]
pub(super) struct NewArgs {
    /// Name of the plugin, for example `stretch-growth`.
    name: String,
    /// Language.
    #[arg(long, value_enum, default_value_t = Language::Rust)]
    lang: Language,
    /// Folder to make; by default one of the plugin's name here.
    #[arg(long, value_name = "DIR")]
    dir: Option<PathBuf>,
    /// Folder of the SDK for Rust; by default that of the installation, or of the source this program was built from.
    #[arg(long, value_name = "DIR")]
    sdk: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    Rust,
    C,
}

/// The SDK in the source, and where an installation has it, from the folder above that of the program.
const SDK_IN_SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/plugins/sdk");
const SDK_IN_INSTALLATION: &str = "share/rumple/plugins/sdk";

/// What the placeholders of a template stand for.
struct Names {
    name: String,
    stem: String,
    law: String,
    library: String,
    author: String,
    sdk: String,
}

impl Names {
    fn fill(&self, template: &str) -> String {
        [
            ("@name@", &self.name),
            ("@stem@", &self.stem),
            ("@Law@", &self.law),
            ("@library@", &self.library),
            ("@author@", &self.author),
            ("@sdk@", &self.sdk),
            ("@version@", &env!("CARGO_PKG_VERSION").to_owned()),
        ]
        .iter()
        .fold(template.to_owned(), |text, (mark, value)| text.replace(mark, value))
    }
}

pub(super) fn run(args: &NewArgs) -> Result<()> {
    let name = &args.name;
    let folder = args.dir.clone().unwrap_or_else(|| PathBuf::from(name));
    check_name(name)?;
    // A link that leads nowhere counts as well.
    if fs::symlink_metadata(&folder).is_ok() {
        return Err(refuse(format!("{} exists already; nothing is written", folder.display())));
    }
    let stem = name.replace('-', "_");
    let file = search::file_name(name);
    let mut names = Names {
        law: camel_case(name),
        library: file.clone(),
        author: std::env::var("USER").unwrap_or_else(|_| "me".into()).replace(['"', '\\'], ""),
        sdk: String::new(),
        name: name.clone(),
        stem,
    };
    let (mut files, build) = match args.lang {
        Language::Rust => {
            names.sdk = sdk(args)?;
            names.library = format!("target/release/{file}");
            let files = vec![
                ("Cargo.toml".to_owned(), names.fill(include_str!("templates/rust/Cargo.toml.in"))),
                ("src/lib.rs".to_owned(), names.fill(include_str!("templates/rust/lib.rs.in"))),
            ];
            (files, "cargo build --release")
        }
        Language::C => {
            let files = vec![
                ("rumple_plugin.h".to_owned(), C_HEADER.to_owned()),
                ("Makefile".to_owned(), names.fill(include_str!("templates/c/Makefile.in"))),
                (format!("{}.c", names.stem), names.fill(include_str!("templates/c/law.c.in"))),
            ];
            (files, "make")
        }
    };
    files.push(("scene.toml".to_owned(), names.fill(include_str!("templates/scene.toml.in"))));
    write(&folder, &files)
        .map_err(|e| refuse(format!("{} cannot be written: {e}", folder.display())))?;
    say!("{} is written. Next:", folder.display());
    say!("  cd {}", folder.display());
    say!("  {build}");
    say!("  rumple plugin validate ./{}", names.library);
    say!("  rumple run scene.toml --out results      # and open results/sheet.pvd in ParaView");
    Ok(())
}

/// Writes the files of a folder that does not exist yet. They are put together in another one
/// first: what is there is whole, or not there.
fn write(folder: &Path, files: &[(String, String)]) -> io::Result<()> {
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
    let fresh = unused_name(parent.unwrap_or(Path::new(".")));
    let all = || -> io::Result<()> {
        for (path, text) in files {
            let path = fresh.join(path);
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            fs::write(path, text)?;
        }
        fs::rename(&fresh, folder)
    };
    all().inspect_err(|_| {
        // Its own files only; if even that fails there is nothing more to do.
        let _ = fs::remove_dir_all(&fresh);
    })
}

/// A name that nothing has.
fn unused_name(parent: &Path) -> PathBuf {
    let name = |k: u32| parent.join(format!(".rumple-new-{}-{k}", std::process::id()));
    (0..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0))
}

fn refuse(message: String) -> Error {
    Error::Refused(message)
}

fn check_name(name: &str) -> Result<()> {
    let mut letters = name.chars();
    let first = letters.next().is_some_and(|c| c.is_ascii_lowercase());
    if first && letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-') {
        return Ok(());
    }
    let near: String = name
        .to_lowercase()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    Err(refuse(format!(
        "`{name}` is not a valid plugin name; expected a lower-case letter, then lower-case \
         letters, digits or `-`, for example `{}`",
        near.trim_matches(|c: char| !c.is_ascii_lowercase())
    )))
}

fn camel_case(name: &str) -> String {
    name.split('-')
        .map(|word| {
            let mut letters = word.chars();
            letters
                .next()
                .map(|c| c.to_ascii_uppercase())
                .into_iter()
                .chain(letters)
                .collect::<String>()
        })
        .collect()
}

fn sdk(args: &NewArgs) -> Result<String> {
    let program = std::env::current_exe().ok();
    let root = program.as_deref().and_then(Path::parent).and_then(Path::parent);
    let installed = root.map(|root| root.join(SDK_IN_INSTALLATION));
    let candidates = match &args.sdk {
        Some(folder) => vec![folder.clone()],
        None => installed.into_iter().chain([PathBuf::from(SDK_IN_SOURCE)]).collect(),
    };
    let found = candidates.iter().find(|folder| folder.join("Cargo.toml").is_file());
    let Some(folder) = found else {
        let places: Vec<_> = candidates.iter().map(|folder| folder.display().to_string()).collect();
        return Err(refuse(format!(
            "no SDK at {}; expected the folder plugins/sdk of the source of rumple: give \
             it by --sdk",
            places.join(" or ")
        )));
    };
    let full = fs::canonicalize(folder).unwrap_or_else(|_| folder.clone());
    Ok(path_text(&full))
}

fn path_text(path: &Path) -> String {
    path.display().to_string().replace('\\', "/")
}
