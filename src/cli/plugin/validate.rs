//! `rumple plugin validate`: all checks, in a process of its own that may crash or hang.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{LawArgs, LawSource};
use crate::cli::Findings;
use crate::kinetics::Kinetics;
use crate::kinetics::validation::{self, Finding, Verdict};
use crate::{Error, Result};

/// Arguments of `plugin validate`.
#[derive(Debug, Args)]
pub(super) struct ValidateArgs {
    #[command(flatten)]
    law: LawArgs,
    /// Seed of the inputs: another one tries other points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Seconds that a check may take.
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    time_limit: f64,
    /// Print what is found as JSON.
    #[arg(long)]
    json: bool,
    /// The part that touches the plugin.
    #[arg(long, hide = true)]
    in_child: bool,
    /// In a child: only the rates, from the last point to the first.
    #[arg(long, hide = true)]
    backwards: bool,
}

/// The check before all others.
const LOADING_CHECK: &str = "table, description, instance";

/// The check after all others, of two processes.
const FRESH_PROCESS_CHECK: &str = "the same in a fresh process";

/// What the child reports; one line of standard output each, after [`LINE_PREFIX`].
#[derive(Debug, Serialize, Deserialize)]
enum Message {
    Begin(String),
    Good(String, String),
    Skipped(String, String),
    Fault(String, String),
    /// Rates, bit by bit, to compare with those of another process.
    Rates(Vec<u64>),
    Done,
}

/// Before every line of the child: a plugin may print what it likes.
const LINE_PREFIX: &str = "\u{1}rumple ";

fn emit(message: &Message) {
    let text = serde_json::to_string(message).unwrap_or_default();
    // In one piece; a broken pipe cannot be reported to anybody.
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(format!("\n{LINE_PREFIX}{text}\n").as_bytes()).and_then(|()| out.flush());
}

pub(super) fn run(args: &ValidateArgs) -> Result<()> {
    if args.in_child { child(args) } else { parent(args) }
}

fn child(args: &ValidateArgs) -> Result<()> {
    emit(&Message::Begin(LOADING_CHECK.to_owned()));
    let seed = args.seed;
    let outcome = args.law.find().and_then(|found| {
        let (law, fields): (Arc<dyn Kinetics>, _) = match found {
            LawSource::Library(library) => {
                (Arc::new(library.instantiate(&BTreeMap::new())?), Vec::new())
            }
            LawSource::Scene { kinetics, fields } => (kinetics, fields),
        };
        if !args.backwards {
            try_out(&*law, &fields, seed);
        }
        emit(&Message::Begin(FRESH_PROCESS_CHECK.to_owned()));
        // A law that fails was found by the other checks.
        if let Ok(rates) = validation::rates_in_order(&*law, &fields, seed, args.backwards) {
            emit(&Message::Rates(rates));
        }
        Ok(())
    });
    if let Err(error) = outcome {
        let text = match error {
            Error::Scene(scene) => scene.rendered(false),
            other => other.to_string(),
        };
        emit(&Message::Fault(LOADING_CHECK.to_owned(), text));
    }
    emit(&Message::Done);
    Ok(())
}

/// Runs all checks and reports what they find.
fn try_out(law: &dyn Kinetics, fields: &[Vec<f64>], seed: u64) {
    let d = law.descriptor();
    let read: Vec<&str> = d.signals.iter().map(|s| s.signal.name()).collect();
    let text = format!(
        "{}: {} species, {} parameters, reads {}",
        format!("{} {}", d.name, d.version).trim_end(),
        d.species.len(),
        d.parameters.len(),
        if read.is_empty() { "nothing".to_owned() } else { read.join(", ") }
    );
    emit(&Message::Good(LOADING_CHECK.to_owned(), text));
    validation::validate(
        law,
        fields,
        seed,
        &mut |check| emit(&Message::Begin(check.to_owned())),
        &mut |Finding { check, verdict }| {
            let check = check.to_owned();
            emit(&match verdict {
                Verdict::Good(text) => Message::Good(check, text),
                Verdict::Skipped(text) => Message::Skipped(check, text),
                Verdict::Fault(text) => Message::Fault(check, text),
            });
        },
    );
}

/// Starts the checks of the law in a child process and reads its reports; lines that are not reports are passed on.
fn begin(
    args: &ValidateArgs,
    seed: u64,
    backwards: bool,
) -> Result<(Child, Receiver<std::result::Result<Message, String>>)> {
    let program: PathBuf = std::env::current_exe().map_err(|e| no_child(&e))?;
    let mut command = Command::new(program);
    command.args(["plugin", "validate", "--in-child", "--seed", &seed.to_string()]);
    if backwards {
        command.arg("--backwards");
    }
    for directory in &args.law.search.plugin_path {
        command.arg("--plugin-path").arg(directory);
    }
    command.arg("--").arg(&args.law.law);
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    let mut child = command.spawn().map_err(|e| no_child(&e))?;
    let (send, receive) = mpsc::channel();
    if let Some(out) = child.stdout.take() {
        thread::spawn(move || {
            for line in BufReader::new(out).split(b'\n').map_while(std::result::Result::ok) {
                let line = String::from_utf8_lossy(&line).into_owned();
                let message =
                    line.strip_prefix(LINE_PREFIX).and_then(|t| serde_json::from_str(t).ok());
                if send.send(message.ok_or(line)).is_err() {
                    return;
                }
            }
        });
    }
    Ok((child, receive))
}

/// The rates of a fresh process that calls the points in the opposite order; `None` if it does not
/// come to that.
fn afresh(args: &ValidateArgs, seed: u64, limit: Duration) -> Result<Option<Vec<u64>>> {
    let (mut child, receive) = begin(args, seed, true)?;
    let rates = loop {
        match receive.recv_timeout(limit) {
            Ok(Ok(Message::Rates(rates))) => break Some(rates),
            Ok(Ok(Message::Done)) | Err(_) => break None,
            Ok(_) => {}
        }
    };
    // It may hang, or have ended already.
    let _ = child.kill();
    let _ = child.wait();
    Ok(rates)
}

/// Compares rates with those of a process that calls the points in the opposite order, where it got so far.
fn same_afresh(here: &[u64], there: Option<Vec<u64>>) -> (&'static str, String) {
    let Some(there) = there else { return ("-", "not reached".to_owned()) };
    if there == here {
        return ("ok", "points called in the opposite order".to_owned());
    }
    let differ = here.iter().zip(&there).position(|(a, b)| a != b).unwrap_or(0);
    let [one, other] = [here[differ], there[differ]].map(f64::from_bits);
    let text = format!(
        "rates gives {one} after other calls and {other} in a process that calls the points in the \
         opposite order: a law must not keep internal state"
    );
    ("FAULT", text)
}

/// Runs the checks in a child process and prints what they find.
fn parent(args: &ValidateArgs) -> Result<()> {
    let seed = args.seed;
    let limit = Duration::try_from_secs_f64(args.time_limit).unwrap_or(Duration::from_secs(20));
    let (mut child, receive) = begin(args, seed, false)?;
    let print = |text: String| {
        if !args.json {
            say!("{text}");
        }
    };
    print(format!("validating {} at random points of its ranges (--seed {seed})", args.law.law));
    let mut faults: Vec<(String, String)> = Vec::new();
    let mut current = String::new();
    let mut document = Findings::default();
    document.set("law", args.law.law.as_str());
    document.set("seed", seed);
    let mut report = |verdict: &str, check: &str, text: &str| {
        document.add("checks", json!({ "check": check, "verdict": verdict, "text": text }));
        let cause = cause(text);
        let known = || faults.iter().find(|(known, _)| *known == cause);
        let text = match known().filter(|_| verdict == "FAULT") {
            Some((_, earlier)) => format!("as in \"{earlier}\""),
            None => text.to_owned(),
        };
        let new = verdict == "FAULT" && known().is_none();
        print(format!("  {verdict:<6} {check:<32} {text}"));
        faults.extend(new.then(|| (cause, check.to_owned())));
    };
    loop {
        match receive.recv_timeout(limit) {
            Ok(Ok(Message::Begin(check))) => current = check,
            Ok(Ok(Message::Good(check, text))) => report("ok", &check, &text),
            Ok(Ok(Message::Skipped(check, text))) => report("-", &check, &text),
            Ok(Ok(Message::Fault(check, text))) => report("FAULT", &check, &text),
            Ok(Ok(Message::Rates(here))) => {
                let (verdict, text) = same_afresh(&here, afresh(args, seed, limit)?);
                report(verdict, FRESH_PROCESS_CHECK, &text);
            }
            Ok(Ok(Message::Done)) => break,
            Ok(Err(line)) if line.trim().is_empty() => {}
            Ok(Err(line)) => print(format!("  it prints: {line}")),
            Err(RecvTimeoutError::Timeout) => {
                let text = format!("does not return within {} s (--time-limit)", args.time_limit);
                report("FAULT", &current, &text);
                break;
            }
            Err(RecvTimeoutError::Disconnected) => {
                let status = child.wait().map_err(|e| no_child(&e))?;
                report("FAULT", &current, &format!("ends the process: {status}"));
                break;
            }
        }
    }
    // It may hang, or have ended already.
    let _ = child.kill();
    let _ = child.wait();
    document.set("faults", faults.len());
    conclude(args, &document, faults.len())
}

/// Prints the document, or `no faults found`; an error with their number otherwise.
fn conclude(args: &ValidateArgs, document: &Findings, faults: usize) -> Result<()> {
    let seed = args.seed;
    if args.json {
        document.print(true);
    }
    match faults {
        0 => {
            if !args.json {
                say!("no faults found");
            }
            Ok(())
        }
        n => {
            let (law, s) = (&args.law.law, if n == 1 { "" } else { "s" });
            let again = format!("--seed {seed} gives the same inputs again");
            Err(Error::Refused(format!("{law} has {n} fault{s} ({again})")))
        }
    }
}

/// What is wrong, without the numbers: the same cause shows at other points in other checks.
fn cause(text: &str) -> String {
    let plain = |word: &&str| !word.contains(|c: char| c.is_ascii_digit());
    text.split_whitespace().filter(plain).collect::<Vec<_>>().join(" ")
}

fn no_child(error: &std::io::Error) -> Error {
    Error::Refused(format!("the process that tries the plugin cannot be started: {error}"))
}
