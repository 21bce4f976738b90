//! Points and faces of an OBJ file, parsed by `tobj`.
//!
//! `tobj` is made for viewers: it numbers the points of a mesh by their first use, drops those that no face
//! uses, and keeps no line numbers. Points here must keep their order, because meshes and so results follow
//! from it. Hence two passes. In the first, `tobj` parses the faces while each point carries its number in
//! place of coordinates, so that a corner comes back as the number of its point. In the second, it parses the
//! coordinates, block by block, each block closed by a face that uses all its points in order.
//!
//! `tobj` gets to see points and faces only. Lines would become faces with it, names and materials would
//! split the mesh, and faulty normals would keep a good surface from being read. Until a mesh ends it takes
//! 104 bytes for each face and 24 for each corner of a long one, so a mesh ends here after a fixed number of
//! corners.

use std::io::{BufRead, Read, Write as _};

use super::super::ImportProblem;
use super::super::polygon::triangulate;
use super::Triangles;
use super::statements::{LineFault, Statement, first_fault, point_fault, statements, words};

/// The number of corners after which a mesh of `tobj` ends: those of 341 triangles, which just fit the next
/// power of two.
const CORNERS_PER_MESH: usize = 1023;
/// The largest number of corners of a face: `tobj` takes up to 72 bytes for each while it parses the face.
/// Not tuned: a limit that ordinary cases do not reach.
const MAX_CORNERS: usize = 4096;
/// The number of points that are parsed at a time. It is not tuned.
const POINTS_PER_BLOCK: usize = 512;

/// The triangles of the bytes of a file.
///
/// # Errors
/// The first fault of the file, with its line.
pub(super) fn triangles(bytes: &[u8]) -> Result<Triangles, ImportProblem> {
    let (mut out, face_count) = reserved(bytes)?;
    if face_count == 0 {
        // Points are checked nevertheless: the message about a faulty one says more than that there are no
        // faces.
        return Err(first_fault(bytes).unwrap_or(ImportProblem::Empty("faces")));
    }
    // If tobj refuses a file, one of its lines is expected to have a fault.
    let refused = |error| {
        let place = || LineFault::Refused(error).at(1);
        first_fault(bytes).unwrap_or_else(place)
    };
    let faces = Faces::parse(bytes, face_count).map_err(refused)?;
    coordinates(bytes, &mut out.points).map_err(refused)?;
    if out.points.iter().flatten().any(|x| !x.is_finite()) {
        return Err(refused(tobj::LoadError::PositionParseError));
    }
    faces.cut_into(&mut out)?;
    if out.faces.is_empty() { Err(ImportProblem::Empty("faces")) } else { Ok(out) }
}

/// Reserves memory for exactly the points and triangles that the lines can hold, and counts the faces.
///
/// # Errors
/// Lines that are neither read nor skipped, weighted points, faces with too many corners, more points or
/// faces than 32 bits can count.
fn reserved(bytes: &[u8]) -> Result<(Triangles, usize), ImportProblem> {
    let (mut points, mut faces, mut triangles) = (0_usize, 0_usize, 0_usize);
    for statement in statements(bytes) {
        match statement? {
            (line, Statement::Point(rest)) => {
                points += 1;
                // The weight is not passed on to tobj, which would divide by it.
                if words(rest).nth(3).is_some()
                    && let Some(fault) = point_fault(rest)
                {
                    return Err(fault.at(line));
                }
            }
            (line, Statement::Face(rest)) => {
                let corners = words(rest).count();
                if corners > MAX_CORNERS {
                    return Err(LineFault::TooManyCorners { corners, limit: MAX_CORNERS }.at(line));
                }
                faces += 1;
                triangles += corners.saturating_sub(2);
            }
        }
    }
    let limit = u32::MAX as usize;
    if points >= limit || triangles >= limit || bytes.len() / 2 >= limit {
        return Err(ImportProblem::TooLarge);
    }
    let out = Triangles {
        points: Vec::with_capacity(points),
        faces: Vec::with_capacity(triangles),
        lines: Vec::with_capacity(triangles),
    };
    Ok((out, faces))
}

/// Parses a text that names no material library. The default options leave out the triangulation and the
/// single index of `tobj`; the head of this file and that of `mod.rs` have the reasons.
fn load(text: &mut impl BufRead) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let options = tobj::LoadOptions::default();
    tobj::load_obj_buf(text, &options, |_| Err(tobj::LoadError::OpenFileFailed)).map(|(models, _)| models)
}

/// Appends the coordinates of all points of a file to `out`.
fn coordinates(bytes: &[u8], out: &mut Vec<[f64; 3]>) -> Result<(), tobj::LoadError> {
    let (mut block, mut count) = (Vec::new(), 0);
    let mut parse = |block: &mut Vec<u8>, count: usize| -> Result<(), tobj::LoadError> {
        block.push(b'f');
        for point in 1..=count {
            let _ = write!(block, " {point}");
        }
        for model in load(&mut block.as_slice())? {
            out.extend(model.mesh.positions.as_chunks::<3>().0);
        }
        block.clear();
        Ok(())
    };
    for statement in statements(bytes) {
        let Ok((_, Statement::Point(rest))) = statement else { continue };
        block.push(b'v');
        for word in words(rest).take(3) {
            // tobj also separates words by spaces beyond ASCII, and would find a weight where there is none.
            if !word.iter().all(u8::is_ascii_graphic) {
                return Err(tobj::LoadError::PositionParseError);
            }
            block.push(b' ');
            block.extend_from_slice(word);
        }
        block.push(b'\n');
        count += 1;
        if count == POINTS_PER_BLOCK {
            parse(&mut block, count)?;
            count = 0;
        }
    }
    if count > 0 { parse(&mut block, count) } else { Ok(()) }
}

/// The faces of a file as `tobj` has them: in each model's positions, x is the number of a point, counted
/// from 0.
struct Faces {
    /// The meshes of `tobj`, which hold the faces in order.
    models: Vec<tobj::Model>,
    /// Line of each face, counted from 1.
    lines: Vec<u32>,
    /// Pairs of a face and the number of points above it, which holds until the face of the next pair. A face
    /// may use points above it only.
    points_above: Vec<(usize, usize)>,
}

impl Faces {
    /// Parses all faces of a file.
    fn parse(bytes: &[u8], face_count: usize) -> Result<Self, tobj::LoadError> {
        let mut text = FaceText {
            statements: statements(bytes),
            line: Vec::new(),
            read: 0,
            points: 0,
            corners: 0,
            lines: Vec::with_capacity(face_count),
            points_above: Vec::new(),
        };
        let models = load(&mut text)?;
        Ok(Self { models, lines: text.lines, points_above: text.points_above })
    }

    /// Cuts the faces into triangles.
    ///
    /// # Errors
    /// Faces with fewer than three corners, corners below their face, outlines that cross themselves.
    fn cut_into(self, out: &mut Triangles) -> Result<(), ImportProblem> {
        let Self { models, lines, points_above } = self;
        let mut lines = lines.into_iter().enumerate();
        let mut points_above = points_above.into_iter().peekable();
        let mut above = 0;
        let mut corners = Vec::new();
        for tobj::Model { mesh, .. } in models {
            let mut indices = mesh.indices.as_slice();
            // Without a list of arities, all faces are triangles.
            let all_triangles = if mesh.face_arities.is_empty() { indices.len() / 3 } else { 0 };
            let arities = mesh.face_arities.iter().copied().chain(std::iter::repeat_n(3, all_triangles));
            for (arity, (face, line)) in arities.zip(&mut lines) {
                while let Some((_, points)) = points_above.next_if(|(from, _)| *from <= face) {
                    above = points;
                }
                let face_indices = indices.split_off(..arity as usize).unwrap_or_default();
                corners.clear();
                corners.extend(face_indices.iter().map(|&k| mesh.positions[3 * k as usize] as u32));
                let beyond = corners.iter().find(|&&p| p as usize >= above);
                let fault = match beyond {
                    Some(&p) => Some(LineFault::MissingPoint { corner: i64::from(p) + 1, points: above }),
                    None if arity < 3 => Some(LineFault::CornerCount(arity as usize)),
                    None => triangulate(&out.points, &mut corners, &mut out.faces).err().map(LineFault::from),
                };
                if let Some(fault) = fault {
                    return Err(fault.at(line as usize));
                }
                out.lines.resize(out.faces.len(), line);
            }
        }
        Ok(())
    }
}

/// The text from which `tobj` parses the faces, made line by line as it is read.
struct FaceText<I> {
    /// The statements of the file that are not in the text yet.
    statements: I,
    /// The present line of the text.
    line: Vec<u8>,
    /// The number of bytes of that line that `tobj` has read.
    read: usize,
    /// The number of points so far.
    points: usize,
    /// The number of corners so far in the present mesh.
    corners: usize,
    /// As [`Faces::lines`], so far.
    lines: Vec<u32>,
    /// As [`Faces::points_above`], so far.
    points_above: Vec<(usize, usize)>,
}

impl<'a, I: Iterator<Item = Result<(usize, Statement<'a>), ImportProblem>>> FaceText<I> {
    /// Makes the next line of the text; it is empty at the end.
    fn next_line(&mut self) {
        self.line.clear();
        self.read = 0;
        // Lines that are faulty were refused before.
        let Some(Ok((number, statement))) = self.statements.next() else { return };
        match statement {
            Statement::Point(_) => {
                let _ = writeln!(self.line, "v {} 0 0", self.points);
                self.points += 1;
            }
            Statement::Face(rest) => {
                if self.points_above.last().is_none_or(|(_, points)| *points != self.points) {
                    self.points_above.push((self.lines.len(), self.points));
                }
                self.lines.push(number as u32);
                self.line.push(b'f');
                self.line.extend_from_slice(rest);
                self.line.push(b'\n');
                self.corners += words(rest).count().max(3);
                if self.corners >= CORNERS_PER_MESH {
                    // A new object ends the mesh.
                    self.line.extend_from_slice(b"o\n");
                    self.corners = 0;
                }
            }
        }
    }
}

impl<'a, I: Iterator<Item = Result<(usize, Statement<'a>), ImportProblem>>> BufRead for FaceText<I> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.read == self.line.len() {
            self.next_line();
        }
        Ok(&self.line[self.read..])
    }

    fn consume(&mut self, amount: usize) {
        self.read += amount;
    }
}

impl<'a, I: Iterator<Item = Result<(usize, Statement<'a>), ImportProblem>>> Read for FaceText<I> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}
