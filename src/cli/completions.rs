//! `rumple completions` and `rumple man`: completions for shells and pages for `man`, from the commands themselves.

use std::path::{Path, PathBuf};
use std::{fs, io};

use clap::{Args, Command};

use crate::Result;
use crate::output::{Inputs, OutputError, ResultFile};
use clap_complete::Shell;
use clap_mangen::Man;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionArgs {
    /// The shell.
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Directory to write the pages into, one for every command; made if it does not exist.
    dir: PathBuf,
    /// Replace pages that exist.
    #[arg(long)]
    force: bool,
}

/// Prints the completions for a shell.
pub(super) fn completions(args: &CompletionArgs, mut command: clap::Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "rumple", &mut script);
    Ok(ResultFile::StandardOutput.write(|out| out.write_all(&script))?)
}

/// Writes the pages for `man`.
pub(super) fn man(args: &ManArgs, command: clap::Command) -> Result<()> {
    fs::create_dir_all(&args.dir).map_err(OutputError::write(&args.dir))?;
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    man_pages(&command, &args.dir, &mut pages).map_err(OutputError::write(&args.dir))?;
    // All are checked before one is written.
    let file = |(path, page): (PathBuf, Vec<u8>)| {
        Ok((ResultFile::new(&path, args.force, &Inputs::default())?, page))
    };
    let pages = pages.into_iter().map(file).collect::<Result<Vec<_>>>()?;
    for (file, page) in &pages {
        file.write(|out| out.write_all(page))?;
    }
    say!("{} pages are in {}; read one by `man -l FILE`", pages.len(), args.dir.display());
    Ok(())
}

/// The pages of a command and of those below it, with their files.
fn man_pages(
    command: &Command,
    directory: &Path,
    pages: &mut Vec<(PathBuf, Vec<u8>)>,
) -> io::Result<()> {
    let man = Man::new(command.clone());
    let mut page = Vec::new();
    man.render(&mut page)?;
    pages.push((directory.join(man.get_filename()), page));
    for below in command.get_subcommands().filter(|command| command.get_name() != "help") {
        man_pages(below, directory, pages)?;
    }
    Ok(())
}
