//! The other side: a scratch copy of the baselines, their meshes and starts, and their runs.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::{Result, first_line};
use crate::problem::{read_sheet, write_positions};

/// Longest wall time of one baseline, seconds.
const WALL_TIME_LIMIT: &str = "7200";

/// Height of the noise in the starts of the hard relaxation.
const NOISE_HEIGHT: f64 = 0.01;

/// A scratch copy with everything built.
pub struct Baselines {
    root: PathBuf,
    python: String,
}

/// What a baseline reached.
#[derive(Debug, Clone)]
pub struct Reached {
    /// CPU seconds by its own clock, from its first evaluation.
    pub cpu: f64,
    /// Evaluations of energy and gradient.
    pub evaluations: f64,
    /// Energy by its own code.
    pub energy: f64,
    /// Norm of the gradient relative to the start.
    pub relative: f64,
}

/// A coupled run of a baseline.
#[derive(Debug, Clone)]
pub struct Coupled {
    /// CPU seconds to the relaxed state at the end time.
    pub cpu: f64,
    /// Relaxations.
    pub steps: f64,
    /// Evaluations of energy and gradient.
    pub evaluations: f64,
    /// Relaxations that failed.
    pub failed: f64,
    /// Energy of the last state.
    pub energy: f64,
    /// Share of the vertices with c > 0.1.
    pub share: f64,
}

impl Baselines {
    /// Copies `source` to `root` and compiles its C files.
    ///
    /// # Errors
    /// Files or programs that are missing, by name.
    pub fn prepare(source: &Path, root: &Path, python: String) -> Result<Self> {
        for folder in ["A", "seed", "mesh"] {
            let (from, to) = (source.join(folder), root.join(folder));
            fs::create_dir_all(&to)?;
            let entries = fs::read_dir(&from).map_err(|e| format!("{}: {e}", from.display()))?;
            for entry in entries {
                let entry = entry?;
                let target = to.join(entry.file_name());
                if entry.file_type()?.is_file() && !target.exists() {
                    // The content, not the mode: sources may be read-only.
                    fs::write(target, fs::read(entry.path())?)?;
                }
            }
        }
        fs::create_dir_all(root.join("out"))?;
        let all = Self { root: root.to_owned(), python };
        let optimised = ["-O3", "-march=native", "-fopenmp"];
        for (result, options) in [
            ("seed_baseline", &["-o", "seed_baseline", "seed_baseline.c", "-lm"][..]),
            ("libsheet.so", &["-shared", "-fPIC", "-o", "libsheet.so", "sheetlib.c", "-lm"][..]),
        ] {
            if !root.join("seed").join(result).exists() {
                let mut gcc = Command::new("gcc");
                finish(gcc.args(optimised).args(options).current_dir(root.join("seed")))?;
            }
        }
        Ok(all)
    }

    /// Versions of what the other side runs on.
    pub fn versions(&self) -> String {
        let code = "import petsc4py, numpy; print('PETSc', petsc4py.__version__, '| NumPy', \
                    numpy.__version__)";
        let petsc = first_line(&self.python, &["-c", code]);
        format!("* {petsc} | {}\n", first_line("gcc", &["--version"]))
    }

    /// The mesh with this number of vertices, made if it is not there.
    pub fn mesh(&self, vertices: usize) -> Result<PathBuf> {
        let path = self.root.join(format!("mesh/disc_{vertices}.txt"));
        if !path.exists() {
            let script = self.root.join("mesh/make_mesh.py");
            finish(Command::new(&self.python).arg(script).arg(vertices.to_string()).arg(&path))?;
        }
        Ok(path)
    }

    /// Start number `noise` of the hard relaxation; number 1 is that of the baselines' own script.
    /// Returns the name under which the baselines know mesh and start, and the start's file.
    pub fn start(&self, vertices: usize, noise: u64) -> Result<(String, PathBuf)> {
        let mesh = self.mesh(vertices)?;
        if noise == 1 {
            let start = self.root.join(format!("A/start_{vertices}.bin"));
            let script = self.root.join("A/make_start.py");
            finish(Command::new(&self.python).arg(script).arg(&mesh).arg(&start))?;
            return Ok((vertices.to_string(), start));
        }
        let name = format!("{vertices}-noise-{noise}");
        let start = self.root.join(format!("A/start_{name}.bin"));
        let sheet = read_sheet(&mesh)?;
        let mut random = ChaCha8Rng::seed_from_u64(noise);
        let mut x = sheet.rest().to_vec();
        for (x, boundary) in x.iter_mut().zip(sheet.boundary()) {
            let height: f64 = random.random_range(-NOISE_HEIGHT..=NOISE_HEIGHT);
            x.z = if *boundary { 0.0 } else { height };
        }
        write_positions(&start, &x)?;
        fs::copy(&mesh, self.root.join(format!("mesh/disc_{name}.txt")))?;
        Ok((name, start))
    }

    /// Energy and norm of the gradient at the start, by their code.
    pub fn energy_at_start(&self, name: &str) -> Result<(f64, f64)> {
        let code = format!(
            "import numpy as np; from sheet import *; s = Sheet('../mesh/disc_{name}.txt'); \
             s.growA(); f, g = s.fg(np.fromfile('start_{name}.bin')); \
             print(repr(float(f)), repr(float(np.linalg.norm(g))))"
        );
        let text = finish(self.run_python(&["-c", &code]))?;
        let mut words = text.split_whitespace().map(str::parse::<f64>);
        match (words.next(), words.next()) {
            (Some(Ok(energy)), Some(Ok(norm))) => Ok((energy, norm)),
            _ => Err(format!("two numbers were expected, not: {text}").into()),
        }
    }

    /// PETSc TAO on the hard relaxation to a relative gradient of 1e-6; its positions are read from
    /// the second value.
    pub fn tao(&self, name: &str, solver: &str) -> Result<(Reached, PathBuf)> {
        let text = finish(self.run_python(&["tao_A.py", name, solver, WALL_TIME_LIMIT]))?;
        let end = text.lines().rfind(|line| line.starts_with("END"));
        let end = end.ok_or_else(|| format!("TAO printed no END line: {text}"))?;
        let reached = Reached {
            cpu: value(end, "cpu")?,
            evaluations: value(end, "nf")?,
            energy: value(end, "U")?,
            relative: value(end, "rel")?,
        };
        Ok((reached, self.root.join(format!("out/A_tao_{solver}_{name}_h0.5.npy"))))
    }

    /// The seed's descent with its analytic gradient to the relative gradient `level`.
    pub fn descent(&self, name: &str, level: f64) -> Result<Reached> {
        let (mesh, start) = (format!("../mesh/disc_{name}.txt"), format!("start_{name}.bin"));
        let mut command = Command::new("../seed/seed_baseline");
        command
            .arg(mesh)
            .args(["--benchA", "1", "--grad", "an", "--amax", "1.5", "--start", &start])
            .args(["--wall", WALL_TIME_LIMIT]);
        let mut reached = None;
        self.watch(&mut command, |line| {
            let relative = value(line, "rel|g|").unwrap_or(f64::INFINITY);
            if relative <= level {
                let iterations = value(line, "it").unwrap_or(f64::NAN);
                let cpu = value(line, "cpu").unwrap_or(f64::NAN);
                let energy = value(line, "U").unwrap_or(f64::NAN);
                reached = Some(Reached { cpu, evaluations: iterations, energy, relative });
            }
            reached.is_none()
        })?;
        reached.ok_or_else(|| format!("the descent did not reach {level:e}").into())
    }

    /// Start of the coupled run as its script makes it, in a file.
    pub fn coupled_start(&self, vertices: usize) -> Result<PathBuf> {
        self.mesh(vertices)?;
        let file = format!("start_coupled_{vertices}.bin");
        let code = format!(
            "import numpy as np; from sheet import *; s = Sheet('../mesh/disc_{vertices}.txt'); \
             rng = np.random.default_rng(7); x = s.x0.copy(); r2 = (s.x0[:, :2]**2).sum(1); \
             noise = 1e-3 * rng.uniform(-1, 1, s.N) + 0.5 * np.exp(-r2 / 128); \
             x[:, 2] = np.where(s.bf > 0, 0, noise); x.tofile('{file}')"
        );
        finish(self.run_python(&["-c", &code]))?;
        Ok(self.root.join("A").join(file))
    }

    /// The coupled run with TAO, stopped after the relaxation at time `until`.
    pub fn coupled(&self, vertices: usize, step: f64, until: f64) -> Result<Coupled> {
        // The script knows a limit of wall time only; the copy gets one of time.
        let script = fs::read_to_string(self.root.join("A/coupled_tao.py"))?;
        if script.matches("t<5000").count() != 1 {
            return Err("coupled_tao.py has another end than `t<5000`".into());
        }
        let ended = script.replace("t<5000", &format!("t<{}", until + 0.5 * step));
        let name = format!("coupled_tao_to_{until}.py");
        fs::write(self.root.join("A").join(&name), ended)?;
        let (n, step) = (vertices.to_string(), step.to_string());
        let mut command = self.run_python(&[&name, &n, "5e-3", WALL_TIME_LIMIT, &step]);
        let at_end = format!("t {until:.1} ");
        let (mut last, mut end) = (None, None);
        self.watch(&mut command, |line| {
            if line.starts_with("t ") {
                eprintln!("  TAO: {line}");
            }
            if line.starts_with(&at_end) {
                last = Some(line.to_owned());
            } else if line.starts_with("END") {
                end = Some(line.to_owned());
            }
            true
        })?;
        let (Some(last), Some(end)) = (last, end) else {
            return Err(format!(
                "coupled_tao.py printed nothing at t = {until} (it prints every tenth step)"
            )
            .into());
        };
        Ok(Coupled {
            cpu: value(&last, "cpu")?,
            steps: value(&end, "steps")?,
            evaluations: value(&end, "evals")?,
            failed: value(&end, "fails")?,
            energy: value(&last, "U")?,
            share: value(&last, "frac")?,
        })
    }

    fn run_python(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.python);
        command.args(arguments).current_dir(self.root.join("A"));
        one_thread(&mut command);
        command
    }

    /// Runs a command in `A`, hands over every line, and ends it when `more` says no.
    fn watch(&self, command: &mut Command, mut more: impl FnMut(&str) -> bool) -> Result<()> {
        one_thread(command).current_dir(self.root.join("A")).stdout(Stdio::piped());
        let mut child = command.spawn().map_err(|e| format!("{command:?}: {e}"))?;
        let output = child.stdout.take().ok_or("no output of a baseline")?;
        for line in BufReader::new(output).lines() {
            if !more(&line?) {
                child.kill()?;
                break;
            }
        }
        child.wait()?;
        Ok(())
    }
}

fn one_thread(command: &mut Command) -> &mut Command {
    command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1")
}

/// Runs a command to its end and returns what it printed.
fn finish(mut command: impl std::borrow::BorrowMut<Command>) -> Result<String> {
    let command = command.borrow_mut();
    eprintln!("  {command:?}");
    std::io::stderr().flush()?;
    let output = command.output().map_err(|e| format!("{command:?}: {e}"))?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(format!("{command:?} failed: {why}").into());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The number behind the last `key` of a line of words.
fn value(line: &str, key: &str) -> Result<f64> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let found = words.windows(2).rfind(|pair| pair[0] == key);
    let word = found.map(|pair| pair[1]).ok_or_else(|| format!("no {key} in: {line}"))?;
    word.parse().map_err(|_| format!("{key} {word} is not a number in: {line}").into())
}
