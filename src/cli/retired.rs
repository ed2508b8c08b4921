//! Commands and options of earlier versions, which are refused with what to write instead.

/// Commands and options of earlier versions, and what to write instead.
const RETIRED: [(&[&str], &str); 12] = [
    (&["sweep", "--memory"], "give fewer --jobs"),
    (&["compare", "--memory"], "give fewer --jobs"),
    (&["accuracy", "--memory"], "give fewer --jobs"),
    (&["accuracy", "--repeats"], "the processor time of one run is taken"),
    (&["accuracy", "--over"], "make a study for each value, with --set KEY=VALUE"),
    (&["plugin", "validate", "--time-limit"], "end a check that does not return with Ctrl-C"),
    (&["sweep", "--slurm"], ARRAY_JOB),
    (&["compare", "--slurm"], ARRAY_JOB),
    (&["accuracy", "--slurm"], ARRAY_JOB),
    (
        &["run", "--slurm"],
        "write a job script in which `srun` or `mpirun` starts `rumple run`, and `rumple resume` where there are results \
         (docs/book/manual/ranks.md)",
    ),
    (
        &["mesh", "repair"],
        "mend the mesh in MeshLab, PyMeshLab or Blender; `rumple mesh check FILE` names its faults",
    ),
    (&["plugin", "bench"], "`rumple explain DIR` has the time and the points of the law in a run"),
];
const ARRAY_JOB: &str = "give --plan in its place, and write a job script of `rumple sweep member` \
                         (docs/book/manual/sweeps.md)";

/// Options of `mesh generate` that are keys of `[sheet]`.
const SIZES: [&str; 13] = [
    "--radius",
    "--width",
    "--height",
    "--inner",
    "--outer",
    "--irregular",
    "--caps",
    "--major",
    "--minor",
    "--semi-axes",
    "--amplitude",
    "--wavelength",
    "--z",
];

/// A retired command or option among the words `given`, and what to write instead.
pub(super) fn find(given: &[String]) -> Option<(&'static str, &'static str)> {
    let is_given = |word: &&str| given.iter().any(|arg| arg.split('=').next() == Some(word));
    let mut named = RETIRED.iter().filter(|(words, _)| words.iter().all(&is_given));
    let named = named.find_map(|(words, instead)| Some((*words.last()?, *instead)));
    named.or_else(|| {
        let size =
            SIZES.into_iter().find(|size| ["mesh", "generate", size].iter().all(&is_given))?;
        Some((size, "write KEY=VALUE, as radius=5"))
    })
}
