//! Gmsh's MSH formats 2 (2.0 to 2.2) and 4 (4.0, 4.1), text or binary.
//!
//! Triangles and quadrangles are read, and lines between two nodes, with the physical groups that they belong to. Points and
//! lines of no group are left aside, and so are nodes of no triangle (centres of arcs) and all other sections. Vertices keep the order of the file,
//! not the numbers that Gmsh gives nodes. Gmsh reference manual, "Gmsh file formats",
//! <https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>.

use std::collections::HashMap;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

use super::physical_groups::PhysicalGroups;
use super::polygons::Polygons;
use super::stream::{Coding, Scalar, Stream};
use crate::Surface;

/// The versions that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    Two,
    Four,
    FourOne,
}

/// What is read from a file.
struct Mesh<'a> {
    stream: Stream<'a>,
    version: Version,
    points: Vec<Vec3>,
    /// Line of every point.
    lines: Vec<u32>,
    /// Position of every node by its number.
    nodes: HashMap<usize, u32>,
    polygons: Polygons,
    polygon_lines: Vec<u32>,
    groups: PhysicalGroups,
    ignored: usize,
}

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let mut stream = Stream::new(bytes);
    let version = head(&mut stream)?;
    let mut mesh = Mesh {
        stream,
        version,
        points: Vec::new(),
        lines: Vec::new(),
        nodes: HashMap::new(),
        polygons: Polygons::default(),
        polygon_lines: Vec::new(),
        groups: PhysicalGroups::default(),
        ignored: 0,
    };
    let (mut nodes, mut elements) = (false, false);
    while let Ok(section) = mesh.stream.word("a section") {
        let Some(name) = section.strip_prefix('$') else {
            let word: String = section.chars().take(20).collect();
            return Err(mesh
                .stream
                .fault(format!("expected a section as $Nodes, found \"{word}\"")));
        };
        mesh.section(name, [&mut nodes, &mut elements])?;
        if !mesh.stream.skip_to(format!("$End{name}").as_bytes()) {
            return Err(mesh.stream.fault(format!(
                "the section ${name} has no end $End{name}: the file is cut short, or a count is wrong"
            )));
        }
    }
    for (there, name) in [(nodes, "Nodes"), (elements, "Elements")] {
        if !there {
            return Err(format!("has no section ${name}"));
        }
    }
    mesh.surface()
}

/// Reads `$MeshFormat`.
fn head(stream: &mut Stream) -> Result<Version, String> {
    if stream.word("$MeshFormat")? != "$MeshFormat" {
        return Err(stream.fault(
            "expected \"$MeshFormat\": this is not an MSH file of version 2 or 4 (version 1 begins with $NOD)",
        ));
    }
    let number = stream.word("the version")?.to_owned();
    let version = match number.as_str() {
        "2" | "2.0" | "2.1" | "2.2" => Version::Two,
        "4" | "4.0" => Version::Four,
        "4.1" => Version::FourOne,
        _ => {
            let number: String = number.chars().take(20).collect();
            return Err(stream.fault(format!(
                "version {number}; 2.0 to 2.2, 4.0 and 4.1 are read (gmsh -save -format msh41)"
            )));
        }
    };
    let binary = stream.word("0 for text or 1 for binary")?;
    if !matches!(binary, "0" | "1") {
        let word: String = binary.chars().take(20).collect();
        return Err(stream.fault(format!("expected 0 for text or 1 for binary, found \"{word}\"")));
    }
    let size = stream.word("the bytes of a number")?;
    if size != "8" {
        let word: String = size.chars().take(20).collect();
        return Err(stream.fault(format!("numbers of {word} bytes; those of 8 are read")));
    }
    if binary == "1" {
        stream.line();
        let one = stream.take::<4>("the number 1 that gives the order of bytes")?;
        stream.coding = match one {
            [1, 0, 0, 0] => Coding::Little,
            [0, 0, 0, 1] => Coding::Big,
            _ => return Err(stream.fault("expected the number 1 that gives the order of bytes")),
        };
    }
    match stream.skip_to(b"$EndMeshFormat") {
        true => Ok(version),
        false => Err(stream.fault("the section $MeshFormat has no end: the file is cut short")),
    }
}

/// Nodes of an element type, and whether it has an area that is read.
///
/// # Errors
/// The name of a type that is not read.
fn element(kind: usize) -> Result<(usize, bool), &'static str> {
    Ok(match kind {
        15 => (1, false),
        1 => (2, false),
        8 => (3, false),
        26 => (4, false),
        2 => (3, true),
        3 => (4, true),
        4 | 11 => return Err("a tetrahedron: mesh the surface only (gmsh -2)"),
        5..=7 | 12..=14 | 17..=19 => {
            return Err("a volume element: mesh the surface only (gmsh -2)");
        }
        9 | 10 | 16 | 20..=25 => return Err("an element of higher order: mesh with -order 1"),
        _ => return Err("neither a triangle nor a quadrangle"),
    })
}

impl Mesh<'_> {
    /// Reads what is wanted of the section `name`, and notes that there are nodes and elements.
    fn section(&mut self, name: &str, [nodes, elements]: [&mut bool; 2]) -> Result<(), String> {
        match name {
            "PhysicalNames" => {
                let count = self.text_count("the number of physical groups")?;
                self.groups.read_names(&mut self.stream, count)?;
            }
            "Entities" if self.version != Version::Two => {
                self.begin()?;
                let box_of_point = self.version == Version::Four;
                self.groups.read_entities(&mut self.stream, box_of_point)?;
            }
            "Nodes" => {
                self.begin()?;
                self.nodes()?;
                *nodes = true;
            }
            "ParametricNodes" if self.version == Version::Two => {
                self.begin()?;
                self.parametric_nodes()?;
                *nodes = true;
            }
            "Elements" => {
                self.begin()?;
                self.elements()?;
                *elements = true;
            }
            _ => {}
        }
        Ok(())
    }

    /// Moves to the data of a section.
    fn begin(&mut self) -> Result<(), String> {
        if self.stream.coding != Coding::Text {
            self.stream.line().ok_or("the file ends after the name of a section")?;
        }
        Ok(())
    }

    /// A count or number: of 64 bits in version 4, 32 bits in others.
    fn size(&mut self, what: &str) -> Result<usize, String> {
        let kind = if self.version == Version::Two { Scalar::I32 } else { Scalar::U64 };
        self.stream.count(kind, what)
    }

    fn int(&mut self, what: &str) -> Result<usize, String> {
        self.stream.count(Scalar::I32, what)
    }

    /// An entity's number, which may be negative.
    fn tag(&mut self, what: &str) -> Result<i64, String> {
        self.stream.integer(Scalar::I32, what)
    }

    /// The tags of an element of version 2, of which the first is its physical group, or 0.
    fn first_tag(&mut self, count: usize, what: &str) -> Result<i64, String> {
        let first = if count > 0 { self.tag(what)? } else { 0 };
        (1..count).try_for_each(|_| self.tag(what).map(drop))?;
        Ok(first)
    }

    /// The number of a node or element: of 64 bits in version 4.1, 32 bits in others.
    fn number(&mut self, what: &str) -> Result<usize, String> {
        match self.version {
            Version::FourOne => self.size(what),
            _ => self.int(what),
        }
    }

    /// The number of blocks of a section of version 4, from its head.
    fn blocks(&mut self, of: &str) -> Result<usize, String> {
        let blocks = self.size(&format!("the number of blocks of {of}s"))?;
        self.size(&format!("the number of {of}s"))?;
        if self.version == Version::FourOne {
            self.size(&format!("the least {of} number"))?;
            self.size(&format!("the largest {of} number"))?;
        }
        Ok(blocks)
    }

    fn nodes(&mut self) -> Result<(), String> {
        if self.version == Version::Two {
            // Counts of sections are text in version 2, even of binary files.
            let count = self.text_count("the number of nodes")?;
            for k in 0..count {
                let what = format!("node {k}");
                let number = self.number(&what)?;
                self.node(number, 0, &what)?;
            }
            return Ok(());
        }
        let blocks = self.blocks("node")?;
        for block in 0..blocks {
            let what = format!("block {block} of the nodes");
            let (dimension, _) = self.block_head(&what)?;
            let parameters = self.int(&what)?;
            let parameters = if parameters > 0 { dimension } else { 0 };
            let count = self.size(&what)?;
            if self.version == Version::FourOne {
                let mut numbers = Vec::new();
                for _ in 0..count {
                    numbers.push(self.number(&what)?);
                }
                for number in numbers {
                    self.node(number, parameters, &what)?;
                }
            } else {
                for _ in 0..count {
                    let number = self.number(&what)?;
                    self.node(number, parameters, &what)?;
                }
            }
        }
        Ok(())
    }

    /// Nodes of version 2 with the entity that they lie on and their parameters there, which are left aside.
    fn parametric_nodes(&mut self) -> Result<(), String> {
        let count = self.text_count("the number of nodes")?;
        for k in 0..count {
            let what = format!("node {k}");
            let number = self.number(&what)?;
            self.node(number, 0, &what)?;
            if self.stream.coding == Coding::Text {
                // Nodes without parameters have none, whatever the entity.
                self.stream.line();
                continue;
            }
            let dimension = self.int(&what)?;
            self.int(&what)?;
            for _ in 0..dimension % 3 {
                self.stream.real(Scalar::F64, &what)?;
            }
        }
        Ok(())
    }

    /// Dimension and number of the entity of a block.
    fn block_head(&mut self, what: &str) -> Result<(usize, i64), String> {
        if self.version == Version::FourOne {
            return Ok((self.int(what)?, self.tag(what)?));
        }
        let entity = self.tag(what)?;
        Ok((self.int(what)?, entity))
    }

    /// Coordinates of the node with this number.
    fn node(&mut self, number: usize, parameters: usize, what: &str) -> Result<(), String> {
        let mut point = Vec3::zeros();
        for x in point.iter_mut() {
            *x = self.stream.real(Scalar::F64, what)?;
        }
        if parameters > 3 {
            return Err(self
                .stream
                .fault(format!("an entity of dimension {parameters}, in {what}")));
        }
        for _ in 0..parameters {
            self.stream.real(Scalar::F64, what)?;
        }
        if self.nodes.insert(number, index(self.points.len())).is_some() {
            return Err(self.stream.fault(format!("there are two nodes with the number {number}")));
        }
        self.points.push(point);
        self.lines.push(index(self.stream.number()));
        Ok(())
    }

    /// A count that stands alone in its line, as text.
    fn text_count(&mut self, what: &str) -> Result<usize, String> {
        let coding = std::mem::replace(&mut self.stream.coding, Coding::Text);
        let count = self.stream.count(Scalar::I32, what);
        if coding != Coding::Text {
            self.stream.line();
        }
        self.stream.coding = coding;
        count
    }

    fn elements(&mut self) -> Result<(), String> {
        if self.version == Version::Two {
            let count = self.text_count("the number of elements")?;
            return if self.stream.coding == Coding::Text {
                self.elements_of_text(count)
            } else {
                self.elements_of_binary(count)
            };
        }
        let blocks = self.blocks("element")?;
        for block in 0..blocks {
            let what = format!("block {block} of the elements");
            let (_, entity) = self.block_head(&what)?;
            let kind = self.int(&what)?;
            let (corners, area) = self.kind(kind, &what)?;
            let count = self.size(&what)?;
            for _ in 0..count {
                self.number(&what)?;
                self.corners((corners, area), entity, &what)?;
            }
        }
        Ok(())
    }

    fn elements_of_text(&mut self, count: usize) -> Result<(), String> {
        for k in 0..count {
            let what = format!("element {k}");
            self.int(&what)?;
            let kind = self.int(&what)?;
            let (corners, area) = self.kind(kind, &what)?;
            let tags = self.int(&what)?;
            let group = self.first_tag(tags, &what)?;
            self.corners((corners, area), group, &what)?;
        }
        Ok(())
    }

    fn elements_of_binary(&mut self, count: usize) -> Result<(), String> {
        let mut read = 0;
        while read < count {
            let what = format!("the elements from {read} on");
            let kind = self.int(&what)?;
            let (corners, area) = self.kind(kind, &what)?;
            let follow = self.int(&what)?;
            let tags = self.int(&what)?;
            for _ in 0..follow {
                self.int(&what)?;
                let group = self.first_tag(tags, &what)?;
                self.corners((corners, area), group, &what)?;
            }
            // At least one, so that a head without elements does not stand still.
            read += follow.max(1);
        }
        Ok(())
    }

    fn kind(&self, kind: usize, what: &str) -> Result<(usize, bool), String> {
        element(kind)
            .map_err(|name| self.stream.fault(format!("{what}: element type {kind} is {name}")))
    }

    /// The nodes of one element, of a kind with so many and an area or none, of an entity or physical group.
    fn corners(
        &mut self,
        (corners, area): (usize, bool),
        entity: i64,
        what: &str,
    ) -> Result<(), String> {
        let mut found = [0; 4];
        for corner in &mut found[..corners] {
            let number = self.number(what)?;
            let node = self.nodes.get(&number).copied();
            if !area {
                *corner = node.unwrap_or(u32::MAX);
            } else {
                *corner = node.ok_or_else(|| {
                    self.stream.fault(format!("{what} names node {number}, which is not in $Nodes"))
                })?;
            }
        }
        if area {
            self.polygons.push(found[..corners].iter().copied());
            self.groups.push(entity);
            self.polygon_lines.push(index(self.stream.number()));
        } else if corners == 2 && found[..2].iter().all(|node| *node != u32::MAX) {
            self.groups.push_line([found[0], found[1]], entity);
        } else {
            self.ignored += 1;
        }
        Ok(())
    }

    /// The triangles with the nodes that they use.
    fn surface(self) -> Result<Surface, String> {
        let Self { stream, points, lines, polygons, polygon_lines, groups, mut ignored, .. } = self;
        let text = stream.coding == Coding::Text;
        let found = polygons.triangles(&points, |k| match text {
            true => format!("line {}: the element", polygon_lines[k]),
            false => format!("surface element {k}"),
        })?;
        let mut surface = Surface::default();
        surface.notes.extend(found.note());
        let of = |t: usize| found.polygon.get(t).map_or(t, |&polygon| polygon as usize);
        groups.of_surfaces(&mut surface, (0..found.corners.len()).map(of));
        if text {
            surface.triangle_lines = found.spread_lines(polygon_lines);
        }
        let mut used = vec![false; points.len()];
        for &v in found.corners.iter().flatten() {
            used[v as usize] = true;
        }
        let mut new = vec![u32::MAX; points.len()];
        for (v, point) in points.iter().enumerate().filter(|(v, _)| used[*v]) {
            new[v] = index(surface.points.len());
            surface.points.push(*point);
            if text {
                surface.point_lines.push(lines[v]);
            }
        }
        ignored += groups.of_curves(&mut surface, &new);
        if ignored > 0 {
            let note = format!("{ignored} points and lines among the elements were ignored");
            surface.notes.push(note);
        }
        let loose = points.len() - surface.points.len();
        if loose > 0 {
            surface.notes.push(format!("{loose} nodes that belong to no triangle were left out"));
        }
        surface.triangles = found.corners.iter().map(|t| t.map(|v| new[v as usize])).collect();
        Ok(surface)
    }
}
