//! One scene under several policies and integrators, from the same start: a sweep whose members keep their states.
//!
//! ```text
//! DIR/sweep.json, members/    a sweep whose only key is which policy and integrator
//! DIR/compare.csv             every output time of every member: distances from the first, measures, work
//! DIR/compare.md              a row a member
//! ```
//!
//! Before shapes diverge at a bifurcation members are compared by the distance of their fields from those of the first
//! that is complete, after it by what does not depend on which of equal branches was taken (energy, number of regions,
//! separation, amplitude).

use std::iter::once;
use std::path::Path;

use super::draw::plot::{cost_panel, panel};
use super::draw::table::{self, csv_table, number, work_cells, work_titles};
use super::gather::{DIVERGED, Deviations, Distance, Measures, MemberResults, Norm, Run};
use super::plan::integrator::{quoted, settings, table_of};
use super::plan::{Axis, Plan};
use super::sweep::notes;
use super::{Page, Timescales};
use crate::kinetics::PluginSearch;
use crate::num::real;
use crate::output::Interrupt;
use crate::output::plot::{Block, Curve, Figure, Panel, Plot, label};
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};

/// The key that chooses policy and integrator.
pub(super) const KEY: &str = "pairing";
/// Name of the table.
pub const TABLE: &str = "compare.csv";
/// Name of the tables for people.
pub const PAGE: &str = "compare.md";

/// Plans every pairing of `policies` and `integrators` (names or tables; those of the scene where there are none) of the
/// scene file `path` with `set`. `say` is called with pairings that are left out, and why.
///
/// # Errors
/// A scene, a policy or an integrator that is not valid; no pairing that goes together.
pub fn plan(
    path: &Path,
    set: &[String],
    [policies, integrators]: [&[String]; 2],
    search: &PluginSearch,
    say: &dyn Fn(&str),
) -> Result<Plan> {
    Scene::load(path, set)?;
    let some = |list: &[String]| -> Vec<Option<String>> {
        if list.is_empty() { vec![None] } else { list.iter().cloned().map(Some).collect() }
    };
    let integrators = some(integrators);
    let pairs = some(policies)
        .into_iter()
        .flat_map(|policy| integrators.iter().map(move |integrator| (policy.clone(), integrator)));
    let (mut named, mut left_out) = (Vec::<(String, Vec<String>)>::new(), Vec::new());
    for (policy, integrator) in pairs {
        let policy = policy.map(|policy| format!("time.policy={}", quoted(&policy)));
        let table = integrator.as_ref().map(|i| format!("time.integrator={}", table_of(i)));
        // Those of the user hold for all members.
        let sets = policy.into_iter().chain(table).chain(set.iter().cloned()).collect::<Vec<_>>();
        let scene = Scene::load(path, &sets)?;
        let mut name = format!("{}, {}", scene.time.policy.name(), scene.time.integrator.name());
        if let Some(table) = integrator.as_ref().filter(|i| i.trim_start().starts_with('{')) {
            name += &settings(table, &[]);
        }
        if named.iter().any(|(known, _)| *known == name) {
            say(&format!("{name}: listed twice, run once"));
            continue;
        }
        match Simulation::new(&scene, search) {
            Ok(_) => named.push((name, sets)),
            Err(error @ (Error::Scene(_) | Error::Solve(SolveError::Pairing(_)))) => {
                left_out.push((name, error));
            }
            Err(error) => return Err(error),
        }
    }
    if named.is_empty()
        && let Some((_, error)) = left_out.pop()
    {
        return Err(error);
    }
    for (name, error) in left_out {
        say(&format!("{name}: {}", error.to_string().lines().next().unwrap_or_default()));
    }
    let plan = Plan::new(path, &[], vec![Axis::named(KEY, named)])?;
    Ok(Plan { states: true, ..plan })
}

/// Assesses the time scales at the relaxed start of the scene of `plan`, whatever its pairings.
///
/// # Errors
/// A scene that cannot be set up or relaxed; an interruption.
pub(super) fn timescales(plan: &Plan, interrupt: Interrupt) -> Result<Option<String>> {
    let first = plan.axes.first().and_then(|axis| axis.settings.first());
    let plain = [r#"time.policy="quasi-static""#, r#"time.integrator="staggered""#];
    let sets = first.into_iter().flatten().cloned().chain(plain.map(str::to_owned));
    let scene = Scene::load(&plan.scene, &sets.collect::<Vec<_>>())?;
    let mut start = Simulation::new(&scene, &plan.search())?;
    start.set_control(Control::new(move || interrupt.requested(), |_| ()));
    start.relax()?;
    Ok(match Timescales::new(&mut start) {
        Ok(timescales) => timescales.map(|timescales| timescales.verdict()),
        Err(error) => Some(format!("the timescales are not known: {error}")),
    })
}

/// Members with their distances from the first that is complete.
pub struct Comparison {
    members: Vec<Run>,
    /// Of every member; none of one that is not complete.
    deviations: Vec<Option<Deviations>>,
    species: Vec<String>,
    /// Whether there is a sheet.
    space: bool,
}

impl Comparison {
    /// Compares `members`, whose `species` are measured by `norm`.
    #[must_use]
    pub fn new(members: Vec<Run>, norm: &Norm, species: Vec<String>) -> Self {
        let reference = members.iter().find(|m| m.found.is_complete());
        let deviations = members.iter().map(|member| {
            let states = &reference.filter(|_| member.found.is_complete())?.states;
            Some(Deviations::new(norm.course(&member.states, states)))
        });
        Self { deviations: deviations.collect(), species, space: norm.has_sheet(), members }
    }

    /// Compares the members of `plan` in `root`.
    pub(super) fn read(plan: &Plan, root: &Path) -> Result<Self> {
        let simulation = Simulation::new(&plan.scene(0)?, &plan.search())?;
        let names = simulation.model().chemistry().map(|c| &c.descriptor().species);
        let species = names.into_iter().flatten().map(|s| s.name.clone()).collect();
        let members = (0..plan.members.len()).map(|number| Run::read(plan, root, number));
        Ok(Self::new(members.collect(), &Norm::of_model(simulation.model()), species))
    }

    /// The complete members with their numbers and distances.
    fn complete(&self) -> impl Iterator<Item = (usize, &Run, &Deviations)> + Clone {
        let all = self.members.iter().zip(&self.deviations).enumerate();
        all.filter_map(|(k, (member, deviations))| Some((k, member, deviations.as_ref()?)))
    }

    /// Its table and plots.
    pub(super) fn page(self) -> Page {
        let found: Vec<MemberResults> = self.members.iter().map(|m| m.found.clone()).collect();
        let mut notes = notes(&found);
        notes.extend(self.partings());
        let mut blocks = vec![Block::Table(self.table())];
        blocks.extend((!notes.is_empty()).then_some(Block::List(notes)));
        let said = table::markdown(&blocks);
        let caption = "Distances, measures and costs of all members along time.".to_owned();
        blocks.push(Block::Plot(Plot { name: "compare".into(), caption, figure: self.figure() }));
        Page { blocks, files: vec![(PAGE, said.clone()), (TABLE, self.csv())], said }
    }

    /// A row for every complete member: its distance from the first as far as they are on one branch, its last measures,
    /// its cost.
    fn table(&self) -> Vec<Vec<String>> {
        type Cell = fn(&MemberResults, &Deviations) -> Option<String>;
        const COLUMNS: [(&str, Cell); 14] = [
            ("member", |f, _| Some(f.name.clone())),
            ("shape distance", |_, by| Some(format!("{:.2e}", by.largest?.0))),
            ("species distance", |_, by| Some(format!("{:.2e}", by.largest?.1))),
            ("parts at", |_, by| Some(format!("t = {}", label(by.diverged?.time)))),
            ("energy", |f, _| Some(format!("{:.5e}", f.measures.last()?.energy))),
            ("amplitude", |f, _| Some(format!("{:.4}", f.measures.last()?.amplitude))),
            ("regions", |f, _| Some(f.measures.last()?.spots.to_string())),
            ("nearest", |f, _| Some(format!("{:.2}", f.measures.last()?.nearest?))),
            ("s", |f, _| Some(format!("{:.2}", f.step_seconds()?))),
            ("steps", |f, _| Some(f.step_work()?.steps.to_string())),
            ("iterations", |f, _| Some(f.step_work()?.iterations.to_string())),
            ("newton iterations", |f, _| Some(f.step_work()?.newton_iterations.to_string())),
            ("evaluations", |f, _| Some(f.step_work()?.evaluations().to_string())),
            ("factorisations", |f, _| Some(f.step_work()?.factorisations.to_string())),
        ];
        let row = |(_, run, by): (usize, &Run, &Deviations)| {
            let cells = COLUMNS.iter().map(|(_, cell)| cell(&run.found, by));
            cells.map(|cell| cell.unwrap_or("-".to_owned())).collect()
        };
        let head = COLUMNS.map(|(title, _)| title.to_owned()).to_vec();
        once(head).chain(self.complete().map(row)).collect()
    }

    /// Where members part from the first, by what, and what that is measured against.
    fn partings(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let first = self.complete().next().map_or("", |(_, first, _)| &first.found.name);
        for (_, member, deviations) in self.complete() {
            let Some(diverged) = &deviations.diverged else { continue };
            let (species, by) = diverged.worst();
            let share = match by.relative() {
                share if share < 10.0 => format!("{:.0} %", 100.0 * share),
                share => format!("{} times", label(share.round())),
            };
            let (what, against) = match species {
                Some(k) => {
                    let name = self.species.get(k).map_or("species", String::as_str);
                    (name, format!("the {name} there"))
                }
                None => ("shape", "the displacement there".to_owned()),
            };
            let [distance, size] = [by.distance, by.size].map(label);
            notes.push(format!(
                "{}: at t = {} its {what} is {distance} away from that of {first}, {share} of {against} ({size}), root mean \
                 squares",
                member.found.name,
                label(diverged.time)
            ));
        }
        if !notes.is_empty() {
            notes.push(format!(
                "distances are the largest before two runs diverge, that is differ by more than {DIVERGED} of their size; \
                 after that compare energy, amplitude, regions and distances of nearest centres"
            ));
        }
        notes
    }

    /// Every output time of every complete member, in its last row with the work of its steps; what has no value is empty.
    fn csv(&self) -> String {
        let head = "member,time,shape distance,species distance,energy [energy],amplitude [length],spots,\
                    share,separation d [length],nearest centres [length],steps [s],evaluations";
        let head = head.split(',').map(str::to_owned);
        let mut rows: Vec<Vec<String>> = vec![head.chain(work_titles(&[])).collect()];
        for (_, Run { found, .. }, deviations) in self.complete() {
            for m in &found.measures {
                let same = deviations.course.iter().find(|d| d.time == m.time);
                let [shape, species] =
                    [Distance::of_shape, Distance::of_species].map(|of| same.map(of));
                let values = [Some(m.time), shape, species, Some(m.energy), Some(m.amplitude)];
                let last = found.measures.last().is_some_and(|last| last.time == m.time);
                let work = found.step_work().filter(|_| last);
                let row = once(found.name.clone()).chain(values.map(number));
                let row = row.chain(once(m.spots.to_string()));
                let row = row.chain([Some(m.share), m.separation, m.nearest].map(number));
                let row = row.chain(once(number(found.step_seconds().filter(|_| last))));
                let evaluations = work.map_or(String::new(), |w| w.evaluations().to_string());
                rows.push(row.chain(once(evaluations)).chain(work_cells(work, &[])).collect());
            }
        }
        csv_table(&rows)
    }

    /// Distances from the first, measures and costs of all members. Those that are not complete are in the legend with
    /// their status.
    #[must_use]
    pub fn figure(&self) -> Figure {
        let name = |m: &Run| match m.found.is_complete() {
            true => m.found.name.clone(),
            false => format!("{} ({})", m.found.name, m.found.status),
        };
        let names = self.members.iter().map(name).collect();
        // Of the first all are 0, which a logarithmic axis does not reach.
        let distance = |title, of: fn(&Distance) -> f64| {
            self.across(title, true, |_, by| by.course.iter().map(|d| (d.time, of(d))).collect())
        };
        let measured = |title, of: fn(&Measures) -> f64| {
            self.across(title, false, |run, _| {
                run.found.measures.iter().map(|m| (m.time, of(m))).collect()
            })
        };
        let costs = self.complete().filter_map(|(name, run, by)| {
            Some((name, run.found.step_seconds()?, by.largest.map(|(a, b)| a.max(b))))
        });
        let cost = cost_panel(
            "largest distance before divergence, by cost",
            "seconds (▼ distance 0, × diverged from the start)",
            costs,
        );
        let mut panels =
            vec![distance("distance of species from the first", Distance::of_species), cost];
        if self.space {
            panels.insert(0, distance("distance of shapes from the first", Distance::of_shape));
            panels.push(measured("elastic energy [energy]", |m| m.energy));
            panels.push(measured("largest displacement [length]", |m| m.amplitude));
            panels.push(measured("connected regions above the level", |m| real(m.spots)));
        } else {
            let value = |c: &Vec<f64>| c.first().copied().unwrap_or(f64::NAN);
            let species = self.species.first().map_or("species", String::as_str);
            panels.push(self.across(species, false, |run, _| {
                run.states
                    .iter()
                    .map(|s| (s.time, s.species.first().map_or(f64::NAN, value)))
                    .collect()
            }));
        }
        Figure { names, panels, ..Figure::default() }
    }

    /// A panel of a curve for every complete member along time.
    fn across(
        &self,
        title: &str,
        logarithmic: bool,
        of: impl Fn(&Run, &Deviations) -> Vec<(f64, f64)>,
    ) -> Panel {
        let curves = self.complete().map(|(name, run, by)| Curve { name, points: of(run, by) });
        let panel = panel(title, "time", curves.collect());
        Panel { logarithmic: (false, logarithmic), ..panel }
    }
}
