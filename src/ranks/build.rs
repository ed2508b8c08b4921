//! Finds PETSc with the feature `mpi`: `libpetsc-real-dev` on Debian, a module or a Spack package on a cluster.

#[cfg(not(feature = "mpi"))]
fn main() {}

#[cfg(feature = "mpi")]
fn main() {
    println!("cargo:rerun-if-env-changed=PKG_CONFIG_PATH");
    if let Err(error) = pkg_config::Config::new().atleast_version("3.18").probe("PETSc") {
        eprintln!(
            "PETSc 3.18 or later is not found by pkg-config ({error}).\n\
             On Debian and Ubuntu: apt-get install libpetsc-real-dev libopenmpi-dev libclang-dev.\n\
             Elsewhere: PKG_CONFIG_PATH=$PETSC_DIR/$PETSC_ARCH/lib/pkgconfig"
        );
        std::process::exit(1);
    }
}
