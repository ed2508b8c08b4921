//! The functions of PETSc that a distributed linear solver needs: real numbers, indices of 32 or 64 bits.
//!
//! Written by hand, as they are few; from `petscvec.h`, `petscmat.h` and `petscksp.h` of PETSc 3.18, which later versions
//! keep. Every function returns an error code, 0 for success.

#![allow(non_snake_case, missing_docs, clippy::upper_case_acronyms)]

use std::ffi::{CString, NulError, c_char, c_int, c_void};
use std::ptr;

use mpi::ffi::MPI_Comm;

/// An index of PETSc. Built with 64-bit indices by the feature `int64`; checked when PETSc starts.
#[cfg(not(feature = "int64"))]
pub type PetscInt = i32;
/// An index of PETSc.
#[cfg(feature = "int64")]
pub type PetscInt = i64;

type Code = c_int;

macro_rules! handles {
    ($($name:ident),*) => { $(
        /// A handle of PETSc.
        #[repr(transparent)]
        #[derive(Clone, Copy, PartialEq)]
        pub struct $name(*mut c_void);

        impl $name {
            pub const NULL: Self = Self(ptr::null_mut());
        }
    )* };
}

handles!(Vector, Matrix, Solver, NullSpace);

pub const INSERT_VALUES: c_int = 1;
pub const MAT_FINAL_ASSEMBLY: c_int = 0;
pub const MAT_SPD: c_int = 15;
pub const PETSC_TRUE: c_int = 1;
/// The most iterations were made: good enough for a preconditioner.
pub const KSP_DIVERGED_ITS: c_int = -3;
/// The code of `PetscInt` among data types.
const PETSC_INT: c_int = 16;

type Handler = unsafe extern "C" fn(
    MPI_Comm,
    c_int,
    *const c_char,
    *const c_char,
    Code,
    c_int,
    *const c_char,
    *mut c_void,
) -> Code;

unsafe extern "C" {
    pub fn PetscInitialize(
        argc: *mut c_int,
        argv: *mut *mut *mut c_char,
        file: *const c_char,
        help: *const c_char,
    ) -> Code;
    pub fn PetscFinalize() -> Code;
    pub fn PetscPopSignalHandler() -> Code;
    pub fn PetscPushErrorHandler(handler: Option<Handler>, context: *mut c_void) -> Code;
    pub fn PetscReturnErrorHandler(
        comm: MPI_Comm,
        line: c_int,
        function: *const c_char,
        file: *const c_char,
        code: Code,
        kind: c_int,
        message: *const c_char,
        context: *mut c_void,
    ) -> Code;
    pub fn PetscDataTypeGetSize(kind: c_int, size: *mut usize) -> Code;
    pub fn PetscOptionsSetValue(o: *mut c_void, key: *const c_char, value: *const c_char) -> Code;
    pub fn PetscOptionsInsertString(o: *mut c_void, all: *const c_char) -> Code;
    pub fn PetscErrorMessage(
        code: Code,
        text: *mut *const c_char,
        detail: *mut *mut c_char,
    ) -> Code;
    pub fn VecCreateMPI(comm: MPI_Comm, own: PetscInt, all: PetscInt, v: *mut Vector) -> Code;
    pub fn VecSetBlockSize(v: Vector, size: PetscInt) -> Code;
    pub fn VecDuplicate(v: Vector, copy: *mut Vector) -> Code;
    pub fn VecDestroy(v: *mut Vector) -> Code;
    pub fn VecGetArray(v: Vector, values: *mut *mut f64) -> Code;
    pub fn VecRestoreArray(v: Vector, values: *mut *mut f64) -> Code;
    pub fn MatCreate(comm: MPI_Comm, m: *mut Matrix) -> Code;
    pub fn MatSetSizes(m: Matrix, r: PetscInt, c: PetscInt, rows: PetscInt, cols: PetscInt)
    -> Code;
    pub fn MatSetBlockSize(m: Matrix, size: PetscInt) -> Code;
    pub fn MatSetType(m: Matrix, kind: *const c_char) -> Code;
    pub fn MatXAIJSetPreallocation(
        m: Matrix,
        size: PetscInt,
        own: *const PetscInt,
        other: *const PetscInt,
        own_upper: *const PetscInt,
        other_upper: *const PetscInt,
    ) -> Code;
    pub fn MatSetValuesBlocked(
        m: Matrix,
        row_count: PetscInt,
        rows: *const PetscInt,
        column_count: PetscInt,
        columns: *const PetscInt,
        values: *const f64,
        mode: c_int,
    ) -> Code;
    pub fn MatAssemblyBegin(m: Matrix, kind: c_int) -> Code;
    pub fn MatAssemblyEnd(m: Matrix, kind: c_int) -> Code;
    pub fn MatSetOption(m: Matrix, option: c_int, value: c_int) -> Code;
    pub fn MatDestroy(m: *mut Matrix) -> Code;
    pub fn MatNullSpaceCreateRigidBody(coordinates: Vector, n: *mut NullSpace) -> Code;
    pub fn MatNullSpaceDestroy(n: *mut NullSpace) -> Code;
    pub fn MatSetNearNullSpace(m: Matrix, n: NullSpace) -> Code;
    pub fn KSPCreate(comm: MPI_Comm, k: *mut Solver) -> Code;
    pub fn KSPSetOptionsPrefix(k: Solver, prefix: *const c_char) -> Code;
    pub fn KSPSetOperators(k: Solver, a: Matrix, p: Matrix) -> Code;
    pub fn KSPSetFromOptions(k: Solver) -> Code;
    pub fn KSPSetUp(k: Solver) -> Code;
    pub fn KSPSolve(k: Solver, b: Vector, x: Vector) -> Code;
    pub fn KSPGetConvergedReason(k: Solver, reason: *mut c_int) -> Code;
    pub fn KSPDestroy(k: *mut Solver) -> Code;
}

/// An error of PETSc.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error(pub String);

/// An outcome of PETSc as a value.
pub fn ok(code: Code) -> Result<(), Error> {
    if code == 0 {
        return Ok(());
    }
    let mut text = ptr::null();
    // SAFETY: PETSc writes the address of a constant text, or leaves it null.
    let known = unsafe { PetscErrorMessage(code, &raw mut text, ptr::null_mut()) } == 0;
    let text = match known && !text.is_null() {
        // SAFETY: a constant text of PETSc, ended by 0.
        true => unsafe { std::ffi::CStr::from_ptr(text) }.to_string_lossy().into_owned(),
        false => "unknown".to_owned(),
    };
    Err(Error(format!("PETSc error {code}: {text}")))
}

/// A text for PETSc.
pub fn text(text: &str) -> Result<CString, Error> {
    CString::new(text).map_err(|e: NulError| Error(e.to_string()))
}

/// Starts PETSc on the communicator of all ranks. Signals stay with the program, and errors are returned.
pub fn start(defaults: &[(&str, &str)]) -> Result<(), Error> {
    // SAFETY: MPI is initialised; null arguments are allowed: options then come from PETSC_OPTIONS alone.
    unsafe {
        ok(PetscInitialize(ptr::null_mut(), ptr::null_mut(), ptr::null(), ptr::null()))?;
        ok(PetscPopSignalHandler())?;
        ok(PetscPushErrorHandler(Some(PetscReturnErrorHandler), ptr::null_mut()))?;
        let mut width = 0;
        ok(PetscDataTypeGetSize(PETSC_INT, &raw mut width))?;
        if width != size_of::<PetscInt>() {
            let message = format!(
                "PETSc has indices of {} bits, and this program was built for {}: build it {} the feature mpi64",
                8 * width,
                PetscInt::BITS,
                if width == 8 { "with" } else { "without" }
            );
            return Err(Error(message));
        }
        for (key, value) in defaults {
            ok(PetscOptionsSetValue(ptr::null_mut(), text(key)?.as_ptr(), text(value)?.as_ptr()))?;
        }
        if let Ok(own) = std::env::var("PETSC_OPTIONS") {
            ok(PetscOptionsInsertString(ptr::null_mut(), text(&own)?.as_ptr()))?;
        }
    }
    Ok(())
}
