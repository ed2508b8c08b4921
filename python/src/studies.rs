//! Sweeps, accuracy studies and comparisons, by the library's `study`.

use std::cell::RefCell;
use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rumple::kinetics::HostLaw;
use rumple::num::checked::Positive;
use rumple::output::Interrupt;
use rumple::run::Error;
use rumple::study::accuracy::{Quantity, Study, StudyOptions};
use rumple::study::plan::{Axis, Plan, seed_axis};
use rumple::study::run::{Runs, Settings};
use rumple::study::{Purpose, compare as comparison, run};
use rumple::view;

use crate::engine::{Pending, Slot};
use crate::law::Law;
use crate::plugins::Plugins;
use crate::run::full;
use crate::scene::Scene;
use crate::{log, overrides};

/// What all studies have.
#[derive(FromPyObject)]
pub(crate) struct How {
    /// The directory.
    out: PathBuf,
    /// Whether an earlier study in it is replaced.
    force: bool,
    /// Most members at once.
    jobs: u64,
    /// Whether members that failed are run again.
    retry_failed: bool,
    /// Threads of a member.
    threads: u16,
    /// Folders in which plugins are looked for first.
    plugins: Option<Plugins>,
    /// Command of a member in a process of its own.
    member: Vec<OsString>,
    /// Called with a line of text for everything that happens, if given.
    progress: Option<Py<PyAny>>,
}

impl How {
    /// Gives `plan` what members have.
    fn give(&self, plan: &mut Plan, law: Option<HostLaw>) -> rumple::Result<()> {
        plan.law = law;
        counted(&[("jobs", self.jobs), ("threads", self.threads.into())])?;
        let search = Plugins::search(self.plugins.as_ref());
        plan.threads = self.threads;
        plan.plugin_path =
            search.directories().iter().map(|path| full(path)).collect::<rumple::Result<_>>()?;
        Ok(())
    }

    /// Runs `plan` for `purpose`; the lines of results.
    fn on(
        &self,
        purpose: Purpose,
        mut plan: Plan,
        (interrupt, raised): (Interrupt, &Slot),
    ) -> rumple::Result<Vec<String>> {
        let root = full(&self.out)?;
        let settings = Settings {
            jobs: usize::try_from(self.jobs).ok(),
            retry_failed: self.retry_failed,
            force: self.force,
            ..Settings::default()
        };
        let said = RefCell::new(Vec::new());
        let say = &|text: &str| said.borrow_mut().push(text.to_owned());
        let member = self.member.clone();
        let happens = &|text: &str| {
            log::info(text);
            let Some(progress) = &self.progress else { return };
            if let Err(error) = Python::attach(|py| progress.call1(py, (text,)).map(drop)) {
                raised.keep(error);
                interrupt.request();
            }
        };
        let runs = Runs { purpose, settings, member, happens, say };
        let first = runs.seal(&mut plan, &root)?;
        let claim = runs.open(&plan, &root)?;
        let ended = runs.on(&plan, (&root, &claim), interrupt);
        if first.output.report {
            // The results are complete without it.
            let _ = view::write_report(&root);
        }
        ended.map(|()| said.into_inner())
    }
}

/// Refuses settings that are 0 and count something.
fn counted(settings: &[(&str, u64)]) -> rumple::Result<()> {
    match settings.iter().find(|(_, count)| *count == 0) {
        None => Ok(()),
        Some((name, _)) => Err(Error::Refused(format!("{name} is 0, expected 1 or more"))),
    }
}

fn axes(texts: &[String]) -> rumple::Result<Vec<Axis>> {
    texts.iter().map(|text| Axis::parse(text).map_err(Error::Refused)).collect()
}

/// Runs a scene over values of its keys.
#[pyfunction]
#[pyo3(signature = (scene, over, seeds, level, how))]
pub(crate) fn sweep(
    py: Python<'_>,
    scene: &Scene,
    over: Option<&Bound<'_, PyDict>>,
    seeds: Option<u16>,
    level: Option<f64>,
    how: How,
) -> PyResult<()> {
    let over = overrides::axes(over)?;
    let (pending, interrupt) = (Pending::default(), Interrupt::of_one_run());
    let law = scene.host_law(None, &pending.law);
    pending.attend(py, (interrupt, 0), || {
        let (file, set) = (scene.file()?, &scene.set);
        let mut axes = axes(&over)?;
        if let Some(count) = seeds {
            counted(&[("seeds", count.into())])?;
            let count = count.into();
            axes.push(seed_axis(file, set, &axes, count)?);
        }
        let mut plan = Plan::new(file, set, axes)?;
        plan.level = level;
        how.give(&mut plan, law.clone())?;
        match how.on(Purpose::Sweep, plan, (interrupt, &pending.signal)) {
            // The table says which members failed.
            Err(Error::Incomplete(_)) => Ok(()),
            ended => ended.map(|_| ()),
        }
    })
}

/// What an accuracy study is asked for.
#[derive(FromPyObject)]
pub(crate) struct Asked {
    integrators: Vec<String>,
    tolerances: Option<Vec<f64>>,
    references: Vec<String>,
    seeds: u16,
    limit: u64,
    want: f64,
    of: Option<String>,
}

impl Asked {
    fn options(&self) -> rumple::Result<StudyOptions> {
        counted(&[("limit", self.limit)])?;
        if !(self.want > 0.0 && self.want.is_finite()) {
            let text = format!("want is {}, expected a share above 0, as 0.01", self.want);
            return Err(Error::Refused(text));
        }
        let usual = StudyOptions::default();
        let numbers = |name: &str, values: &[f64]| -> rumple::Result<Vec<Positive>> {
            let number = |value: &f64| {
                Positive::new(*value).filter(|value| value.get() < 1.0).ok_or_else(|| {
                    Error::Refused(format!("{name}: {value} is not a number between 0 and 1"))
                })
            };
            values.iter().map(number).collect()
        };
        let tolerances = self.tolerances.as_deref().map(|all| numbers("tolerances", all));
        Ok(StudyOptions {
            integrators: self.integrators.clone(),
            tolerances: tolerances.unwrap_or(Ok(usual.tolerances))?,
            references: self.references.clone(),
            seeds: self.seeds,
            limit: self.limit,
            wanted: self.want,
            of: self.of.as_deref().map(Quantity::named).transpose()?,
        })
    }
}

/// Runs a scene by several integrators and tolerances against references; the advice.
#[pyfunction]
#[pyo3(signature = (scene, level, asked, how))]
pub(crate) fn accuracy(
    py: Python<'_>,
    scene: &Scene,
    level: Option<f64>,
    asked: Asked,
    how: How,
) -> PyResult<String> {
    let (pending, interrupt) = (Pending::default(), Interrupt::of_one_run());
    let law = scene.host_law(None, &pending.law);
    pending.attend(py, (interrupt, 0), || {
        let (file, set) = (scene.file()?, &scene.set);
        let search = Plugins::search(how.plugins.as_ref()).with_law(law.clone());
        let (study, mut plan) = Study::plan(file, set, &search, &asked.options()?)?;
        plan.level = level;
        how.give(&mut plan, law.clone())?;
        let said = how.on(Purpose::Accuracy(study), plan, (interrupt, &pending.signal))?;
        Ok(said.into_iter().next().unwrap_or_default())
    })
}

/// Runs a scene under several policies and integrators.
#[pyfunction]
#[pyo3(signature = (scene, policies, integrators, how))]
pub(crate) fn compare(
    py: Python<'_>,
    scene: &Scene,
    policies: Vec<String>,
    integrators: Vec<String>,
    how: How,
) -> PyResult<Vec<String>> {
    let (pending, interrupt) = (Pending::default(), Interrupt::of_one_run());
    let law = scene.host_law(None, &pending.law);
    pending.attend(py, (interrupt, 0), || {
        let search = Plugins::search(how.plugins.as_ref()).with_law(law.clone());
        let left_out = RefCell::new(Vec::new());
        let say = |text: &str| left_out.borrow_mut().push(text.to_owned());
        let lists = [&policies[..], &integrators[..]];
        let mut plan = comparison::plan(scene.file()?, &scene.set, lists, &search, &say)?;
        how.give(&mut plan, law.clone())?;
        let said = how.on(Purpose::Compare, plan, (interrupt, &pending.signal))?;
        Ok([left_out.into_inner(), said].concat())
    })
}

/// Runs one member of a study in this process, which was started for it.
#[pyfunction]
pub(crate) fn member(
    py: Python<'_>,
    root: PathBuf,
    number: usize,
    law: Option<&Law>,
) -> PyResult<()> {
    let pending = Pending::default();
    let law = law.map(|law| law.host_law(&pending.law));
    pending.call(py, &mut false, || run::member(&full(&root)?, number, law, true))
}
