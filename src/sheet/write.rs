//! Writing a sheet as Wavefront OBJ.

use std::io::{self, Write};

use super::Sheet;

/// Writes the rest positions and triangles; every number reads back with the same bits.
///
/// # Errors
/// Those of the writer.
pub fn obj(sheet: &Sheet, out: &mut impl Write) -> io::Result<()> {
    for p in sheet.rest() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| u64::from(v) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}
