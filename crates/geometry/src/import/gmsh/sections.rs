//! The sections of .msh files, versions 2.2 and 4.1.

use std::collections::HashMap;

use super::Group;
use super::cursor::Cursor;
use crate::import::{ImportError, ImportProblem};

/// The content of a file before the audit: indices are valid and coordinates finite, nothing else is known.
#[derive(Default)]
pub(super) struct Raw {
    /// Positions of all points, in units of the file.
    pub(super) points: Vec<[f64; 3]>,
    /// Corners of the tetrahedra.
    pub(super) tets: Vec<[u32; 4]>,
    /// The group of each tetrahedron: 0 for none, 1 + k for `groups[k]`.
    pub(super) tet_groups: Vec<u32>,
    /// Corners of the triangles in groups of surfaces.
    pub(super) faces: Vec<[u32; 3]>,
    /// The group of each of these triangles: 1 + k for `groups[k]`.
    pub(super) face_groups: Vec<u32>,
    /// The physical groups of surfaces and volumes.
    pub(super) groups: Vec<Group>,
    /// The number of a group, counted from 1, by its dimension and tag.
    numbers: HashMap<(i64, i64), u32>,
    /// Tag and index of every point, sorted by tag.
    tags: Vec<(u64, u32)>,
    /// The physical tag of a surface or volume, by its dimension and tag (version 4 only).
    entities: HashMap<(i64, i64), i64>,
}

/// Reads a whole file.
pub(super) fn read(cursor: &mut Cursor<'_>) -> Result<Raw, ImportError> {
    let mut raw = Raw::default();
    if cursor.line() != Some(b"$MeshFormat") {
        return Err(cursor.malformed("a .msh file begins with $MeshFormat"));
    }
    let format = String::from_utf8_lossy(cursor.line().unwrap_or_default()).into_owned();
    let words: Vec<&str> = format.split_ascii_whitespace().collect();
    let is_version_4 = match words.first() {
        Some(&"2.2" | &"2") => false,
        Some(&"4.1") => true,
        other => {
            let version: String = other.copied().unwrap_or("none").chars().take(20).collect();
            return Err(cursor.fail(ImportProblem::Unsupported {
                what: format!("version {version} of the .msh format"),
                cure: "write version 4.1 or 2.2 (in Gmsh: Mesh.MshFileVersion = 4.1)".into(),
            }));
        }
    };
    if words.get(2) != Some(&"8") {
        return Err(cursor.malformed("numbers of eight bytes are expected"));
    }
    match words.get(1) {
        Some(&"0") => {}
        Some(&"1") => cursor.binary()?,
        _ => return Err(cursor.malformed("neither ASCII (0) nor binary (1)")),
    }
    cursor.end("MeshFormat")?;
    let (mut has_nodes, mut has_elements) = (false, false);
    while let Some(line) = cursor.line() {
        let Some(section) = line.strip_prefix(b"$") else {
            return Err(cursor.malformed("a section beginning with $ is expected"));
        };
        match section {
            b"PhysicalNames" => raw.physical_names(cursor)?,
            b"Entities" if is_version_4 => raw.entities(cursor)?,
            b"PartitionedEntities" => {
                return Err(cursor.fail(ImportProblem::Unsupported {
                    what: "a partitioned mesh".into(),
                    cure: "write it in one part".into(),
                }));
            }
            b"Nodes" if !has_nodes => {
                has_nodes = true;
                if is_version_4 {
                    raw.nodes_4(cursor)?
                } else {
                    raw.nodes_2(cursor)?
                }
                raw.tags.sort_unstable();
                if let Some(twice) = raw.tags.windows(2).find(|w| w[0].0 == w[1].0) {
                    return Err(cursor.malformed(format!("node {} is listed twice", twice[0].0)));
                }
            }
            b"Elements" if has_nodes && !has_elements => {
                has_elements = true;
                if is_version_4 { raw.elements_4(cursor)? } else { raw.elements_2(cursor)? }
            }
            b"Nodes" | b"Elements" => {
                return Err(cursor.malformed("nodes and elements are expected once each, in this order"));
            }
            other => {
                let other = String::from_utf8_lossy(&other[..other.len().min(60)]).into_owned();
                cursor.skip(&other)?;
                continue;
            }
        }
        cursor.end(&String::from_utf8_lossy(section))?;
    }
    if raw.tets.is_empty() {
        return Err(cursor.fail(ImportProblem::Empty("tetrahedra")));
    }
    Ok(raw)
}

impl Raw {
    /// The number of a physical group, counted from 1, which is new if the group is; 0 for the tag 0, which
    /// stands for no group.
    fn group(&mut self, dimension: i64, tag: i64) -> u32 {
        if tag == 0 {
            return 0;
        }
        let groups = &mut self.groups;
        *self.numbers.entry((dimension, tag)).or_insert_with(|| {
            groups.push(Group { dimension: dimension as u8, name: tag.to_string() });
            groups.len() as u32
        })
    }

    /// Reads the names of physical groups, which are text in binary files too: `dimension tag "name"`.
    fn physical_names(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let number = |t: Option<&str>| t.and_then(|t| t.parse::<i64>().ok());
        let count = cursor.line().and_then(|l| number(std::str::from_utf8(l).ok()));
        let count = count.ok_or_else(|| cursor.malformed("the number of physical names is missing"))?;
        for _ in 0..count {
            let line = String::from_utf8_lossy(cursor.line().unwrap_or_default()).into_owned();
            let mut words = line.split_ascii_whitespace();
            let (dimension, tag) = (number(words.next()), number(words.next()));
            let name = line.split_once('"').and_then(|(_, rest)| rest.rsplit_once('"')).map(|(name, _)| name);
            let (Some(dimension), Some(tag), Some(name)) = (dimension, tag, name) else {
                return Err(cursor.malformed("a physical name is a dimension, a number and a text in quotes"));
            };
            if dimension == 2 || dimension == 3 {
                let number = self.group(dimension, tag);
                if let Some(group) = self.groups.get_mut((number as usize).wrapping_sub(1)) {
                    group.name = name.to_owned();
                }
            }
        }
        Ok(())
    }

    /// Reads which physical group each surface and volume belongs to (version 4 only).
    fn entities(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let counts = [cursor.size()?, cursor.size()?, cursor.size()?, cursor.size()?];
        for dimension in 0..4_i64 {
            for _ in 0..counts[dimension as usize] {
                let tag = cursor.int()?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    cursor.real()?;
                }
                let physical = cursor.size()?;
                for k in 0..physical {
                    let group = cursor.int()?.saturating_abs();
                    if k > 0 && dimension > 1 {
                        return Err(cursor.fail(ImportProblem::Unsupported {
                            what: format!(
                                "entity {tag} of dimension {dimension} in more than one physical group"
                            ),
                            cure: "put it in one group only".into(),
                        }));
                    }
                    if dimension > 1 {
                        self.entities.insert((dimension, tag), group);
                    }
                }
                if dimension > 0 {
                    for _ in 0..cursor.size()? {
                        cursor.int()?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Reserves memory for `count` points, as far as the file can hold them.
    fn reserve_points(&mut self, cursor: &Cursor<'_>, count: u64) -> Result<(), ImportError> {
        if count >= u64::from(u32::MAX) {
            return Err(cursor.fail(ImportProblem::TooLarge));
        }
        let room = cursor.room(count, 8, 28);
        self.points.reserve_exact(room);
        self.tags.reserve_exact(room);
        Ok(())
    }

    /// Reads the points of a file of version 2.
    fn nodes_2(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let count = self.text_count(cursor)?;
        self.reserve_points(cursor, count)?;
        for k in 0..count {
            let tag = cursor.int()?;
            let tag = u64::try_from(tag).map_err(|_| cursor.malformed(format!("node {tag}")))?;
            self.tags.push((tag, k as u32));
            self.points.push([cursor.real()?, cursor.real()?, cursor.real()?]);
        }
        Ok(())
    }

    /// Reads the number of items in a section of version 2, which is text even in binary files.
    fn text_count(&self, cursor: &mut Cursor<'_>) -> Result<u64, ImportError> {
        let line = cursor.line().and_then(|l| std::str::from_utf8(l).ok());
        line.and_then(|l| l.parse().ok()).ok_or_else(|| cursor.malformed("a count is missing"))
    }

    /// Reads the elements of a file of version 2.
    fn elements_2(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let count = self.text_count(cursor)?;
        let mut elements_read = 0;
        while elements_read < count {
            // Text: number, kind, tags per element. Binary: kind, elements to come, tags per block.
            let (kind, block, tags) = if cursor.is_binary() {
                (cursor.int()?, cursor.int()?, cursor.int()?)
            } else {
                cursor.size()?;
                (cursor.int()?, 1, cursor.int()?)
            };
            if block < 1 || tags < 0 {
                return Err(cursor.malformed("a block of elements without elements"));
            }
            for _ in 0..block {
                if cursor.is_binary() {
                    cursor.int()?;
                }
                let mut physical = 0;
                for k in 0..tags {
                    let tag = cursor.int()?;
                    physical = if k == 0 { tag.saturating_abs() } else { physical };
                }
                self.element(cursor, kind, Some(physical), |c| {
                    let node = c.int()?;
                    u64::try_from(node).map_err(|_| c.malformed(format!("node {node}")))
                })?;
            }
            elements_read += block as u64;
        }
        Ok(())
    }

    /// Reads the points of a file of version 4.
    fn nodes_4(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let (blocks, count) = (cursor.size()?, cursor.size()?);
        cursor.size()?;
        cursor.size()?;
        self.reserve_points(cursor, count)?;
        for _ in 0..blocks {
            let dimension = cursor.int()?;
            cursor.int()?;
            let parametric = if cursor.int()? == 0 { 0 } else { dimension };
            let size = cursor.size()?;
            let begin = self.points.len() as u64;
            if begin.saturating_add(size) > count {
                return Err(cursor.malformed("more nodes than announced"));
            }
            for k in 0..size {
                self.tags.push((cursor.size()?, (begin + k) as u32));
            }
            for _ in 0..size {
                self.points.push([cursor.real()?, cursor.real()?, cursor.real()?]);
                for _ in 0..parametric {
                    cursor.real()?;
                }
            }
        }
        Ok(())
    }

    /// Reads the elements of a file of version 4.
    fn elements_4(&mut self, cursor: &mut Cursor<'_>) -> Result<(), ImportError> {
        let blocks = cursor.size()?;
        // The total number of elements, and the range of their numbers.
        for _ in 0..3 {
            cursor.size()?;
        }
        for _ in 0..blocks {
            let (dimension, tag, kind) = (cursor.int()?, cursor.int()?, cursor.int()?);
            let physical = self.entities.get(&(dimension, tag)).copied();
            for _ in 0..cursor.size()? {
                cursor.size()?;
                self.element(cursor, kind, physical, |c| c.size())?;
            }
        }
        Ok(())
    }

    /// Reads the nodes of an element of type `kind` in the group with the tag `physical`, each by `node`, and
    /// keeps triangles and tetrahedra.
    fn element(
        &mut self,
        cursor: &mut Cursor<'_>,
        kind: i64,
        physical: Option<i64>,
        node: fn(&mut Cursor<'_>) -> Result<u64, ImportError>,
    ) -> Result<(), ImportError> {
        let physical = physical.unwrap_or(0);
        match kind {
            2 => {
                let face = self.nodes(cursor, node)?;
                let group = self.group(2, physical);
                if group != 0 {
                    self.faces.push(face);
                    self.face_groups.push(group);
                }
            }
            4 => {
                let tet = self.nodes(cursor, node)?;
                let group = self.group(3, physical);
                self.tets.push(tet);
                self.tet_groups.push(group);
            }
            // Points, and lines of the orders 1 to 5.
            15 => drop(self.nodes::<1>(cursor, node)?),
            1 => drop(self.nodes::<2>(cursor, node)?),
            8 => drop(self.nodes::<3>(cursor, node)?),
            26 => drop(self.nodes::<4>(cursor, node)?),
            27 => drop(self.nodes::<5>(cursor, node)?),
            28 => drop(self.nodes::<6>(cursor, node)?),
            _ => {
                let (what, cure) = match kind {
                    3 | 5 | 6 | 7 => (
                        "a mesh of quadrangles, hexahedra, prisms or pyramids".to_owned(),
                        "mesh with triangles and tetrahedra (in Gmsh: without Recombine)",
                    ),
                    9 | 11 | 20..=25 | 29..=31 => (
                        "a mesh of curved elements".to_owned(),
                        "write straight ones (in Gmsh: Mesh.ElementOrder = 1)",
                    ),
                    _ => (format!("element type {kind}"), "mesh with triangles and tetrahedra"),
                };
                return Err(cursor.fail(ImportProblem::Unsupported { what, cure: cure.into() }));
            }
        }
        Ok(())
    }

    /// Reads the tags of nodes, each by `node`, and finds their indices.
    fn nodes<const N: usize>(
        &self,
        cursor: &mut Cursor<'_>,
        node: fn(&mut Cursor<'_>) -> Result<u64, ImportError>,
    ) -> Result<[u32; N], ImportError> {
        let mut out = [0; N];
        for n in &mut out {
            let tag = node(cursor)?;
            let found = self.tags.binary_search_by_key(&tag, |t| t.0);
            *n = self.tags[found.map_err(|_| cursor.malformed(format!("there is no node {tag}")))?].1;
        }
        Ok(out)
    }
}
