//! Meshes and states: OBJ, VTK's XML formats and its old one.

use std::cell::RefCell;
use std::io::Write;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::output::{Compression, vtu};
use rumple::run::inspect;
use rumple::scene::Scene;
use rumple::sheet::read;

use super::{Reader, bound, data, file, root};

pub const OBJ: Reader = Reader {
    name: "obj",
    bound: bound(1, 64),
    seeds: || {
        vec![PYRAMID.into(), b"# a triangle\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2//2 -1\n".into()]
    },
    read: |bytes| surface("mesh.obj", bytes),
    repair: None,
};

pub const PLY: Reader = Reader {
    name: "ply",
    bound: bound(1, 64),
    seeds: || data("ply"),
    read: |bytes| surface("mesh.ply", bytes),
    repair: None,
};

pub const STL: Reader = Reader {
    name: "stl",
    bound: bound(1, 64),
    seeds: || data("stl"),
    read: |bytes| surface("mesh.stl", bytes),
    repair: None,
};

pub const MSH: Reader = Reader {
    name: "msh",
    bound: bound(1, 64),
    seeds: || data("msh"),
    read: |bytes| surface("mesh.msh", bytes),
    repair: None,
};

pub const VTU: Reader = Reader {
    name: "vtu",
    bound: bound(32, 1024),
    seeds: || [data("vtu"), vec![bomb(1 << 20), bomb(1 << 23)]].concat(),
    read: |bytes| surface("mesh.vtu", bytes),
    repair: None,
};

pub const VTP: Reader = Reader {
    name: "vtp",
    bound: VTU.bound,
    seeds: || data("vtp"),
    read: |bytes| surface("mesh.vtp", bytes),
    repair: None,
};

pub const VTK: Reader = Reader {
    name: "vtk",
    bound: bound(1, 64),
    seeds: || data("vtk"),
    read: |bytes| surface("mesh.vtk", bytes),
    repair: None,
};

/// A frame as the state of a scene.
pub const STATE: Reader = Reader {
    name: "state",
    bound: VTU.bound,
    seeds: || vec![frame(Compression::default()), frame(Compression::None)],
    read: state,
    repair: None,
};

const PYRAMID: &[u8] = b"v 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nvn 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\n";

fn surface(name: &str, bytes: &[u8]) -> bool {
    match read::surface(file(name, bytes)) {
        Ok(surface) => {
            // Whatever is in it: the checks of meshes see it next.
            let _ = surface.into_sheet().map_err(|error| error.to_string());
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// A file whose points are `bytes` zeros, well compressed.
fn bomb(bytes: usize) -> Vec<u8> {
    let points = bytes / 24;
    let bytes = points * 24;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    let zeros = vec![0; 1 << 16];
    for start in (0..bytes).step_by(zeros.len()) {
        encoder.write_all(&zeros[..zeros.len().min(bytes - start)]).unwrap_or_default();
    }
    let packed = encoder.finish().unwrap_or_default();
    let header: Vec<u8> = [1, bytes as u64, 0, packed.len() as u64].map(u64::to_le_bytes).concat();
    let head = format!(
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"1\"><Points>\
         <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\
         </Points><Cells>\
         <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
         <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray>\
         </Cells></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_"
    );
    [head.as_bytes(), &header, &packed].concat()
}

fn made() -> Option<Simulation> {
    let scene = Scene::load(&root().join("tests/fuzz/scenes/small.toml"), &[]).ok()?;
    Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())).ok()
}

fn frame(compression: Compression) -> Vec<u8> {
    let mut simulation = made().unwrap_or_else(|| panic!("the small scene is not ready"));
    let frame = simulation.frame().unwrap_or_else(|error| panic!("{error}"));
    vtu::encode(&frame, compression).unwrap_or_else(|error| panic!("{error}"))
}

thread_local! {
    static SIMULATION: RefCell<Option<Simulation>> = RefCell::new(made());
}

fn state(bytes: &[u8]) -> bool {
    let Ok(surface) = read::surface(file("state.vtu", bytes)) else { return false };
    SIMULATION.with_borrow_mut(|simulation| {
        let Some(simulation) = simulation else { panic!("the small scene is not ready") };
        match inspect::take_state(simulation, &surface) {
            // Whatever can be said of it: numbers may overflow.
            Ok(()) => {
                let _ = inspect::inspect(simulation).map_err(|error| error.to_string());
                true
            }
            Err(error) => error.to_string().is_empty(),
        }
    })
}
