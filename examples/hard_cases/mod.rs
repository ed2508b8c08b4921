//! What `04_hard_cases` is made of: [cases](case) from a file, [how they are run](trial), [what is expected](expected)
//! and the [same problem in other units](rescaled).

mod case;
mod expected;
mod ledger;
mod rescaled;
mod trial;

use std::error::Error;
use std::path::PathBuf;

use case::{Case, Cases};
use trial::{Trial, Where};

/// What an example returns.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// Which cases are run, with what, and where.
#[derive(Debug)]
pub struct Options {
    /// Slow ones as well.
    pub slow: bool,
    /// Other ways to do the same as well, of which nothing is expected.
    pub beside: bool,
    /// By how much a case may exceed the seconds that it may take: other work on the machine takes some.
    pub patience: f64,
    /// Only those with these names, if there are any.
    pub only: Vec<String>,
    /// Folder of the repository.
    pub root: PathBuf,
    pub program: PathBuf,
    /// Folder of all results; those of the same cases there are lost.
    pub results: PathBuf,
}

impl Options {
    fn wants(&self, name: &str, slow: bool) -> bool {
        if self.only.is_empty() { self.slow || !slow } else { self.only.iter().any(|o| o == name) }
    }
}

/// Runs what `options` asks for and prints the table; how many rows are not as expected.
///
/// # Errors
/// A file of cases that cannot be read, a program that cannot be started.
pub fn run(options: &Options) -> Outcome<usize> {
    let root = &options.root;
    let place = Where {
        program: options.program.clone(),
        models: root.join("models"),
        patience: options.patience,
        results: options.results.clone(),
    };
    let cases = Cases::read(&root.join("models/hard/cases.toml"))?;
    if let Some(unknown) = options.only.iter().find(|only| !cases.has(only)) {
        return Err(format!("no case `{unknown}`: {}", cases.names().join(", ")).into());
    }
    let (mut rows, mut failed) = (0, 0);
    println!("| case | tried | expected | what happened | CPU s | |");
    println!("| --- | --- | --- | --- | ---: | --- |");
    for case in cases.case.iter().filter(|case| options.wants(&case.name, case.slow)) {
        for value in case.values() {
            let trial = Trial::of(&place, case, &value)?;
            rows += 1;
            failed += usize::from(!trial.faults.is_empty());
            row(case, &value, &trial);
            for other in case.beside.iter().filter(|other| options.beside && other.possible()) {
                let trial = Trial::beside(&place, case, other, &value)?;
                println!("| | {} | | {} | {} | |", other.by, trial.seen, seconds(trial.cpu));
            }
        }
    }
    for scales in cases.rescaled.iter().filter(|s| options.wants(&s.name, s.slow)) {
        for row in rescaled::rows(&place, scales)? {
            rows += 1;
            failed += usize::from(!row.passed);
            println!("{}", row.text);
        }
    }
    println!("\n{} of {rows} rows are as expected.", rows - failed);
    Ok(failed)
}

/// Prints the row of a case.
fn row(case: &Case, value: &str, trial: &Trial) {
    let verdict = if trial.faults.is_empty() { "✓".to_owned() } else { trial.faults.join("; ") };
    let verdict = verdict.replace('|', "\\|").replace('\n', " ");
    println!(
        "| `{}` | {} | {} | {} | {} | {verdict} |",
        case.name,
        case.tried.replace("{}", value),
        case.expected(),
        trial.seen,
        seconds(trial.cpu)
    );
}

/// Nothing where nothing was measured.
fn seconds(cpu: f64) -> String {
    if cpu.is_nan() { String::new() } else { format!("{cpu:.1}") }
}
