//! From an imported mesh and its groups to the mesh on which Laplace's equation is solved.

use std::collections::BTreeMap;

use super::{VolumeMesh, outward, sides};
use crate::import::audit::middle;
use crate::import::{ImportError, ImportProblem, Place};
use crate::meshing::tets::{BoundaryFace, FaceRole, TetMesh, determinant};
use crate::scene::{Conductor, Scene, Wall};
use crate::shapes::Shape;

impl VolumeMesh {
    /// The mesh around the conductors of a scene whose shapes are all [`Shape::Physical`].
    ///
    /// A conductor is a group of volumes, whose tetrahedra are left out, or a group of surfaces, which is a
    /// sheet. A dielectric is a group of volumes; where several have the same group, the last one counts. The
    /// background fills the rest. An outer face in a side of the mesh's bounding box belongs to that side's
    /// wall; any other outer face needs six equal walls. A ray from an open face to infinity is assumed to
    /// meet only the background and those dielectrics that end at open faces. Parts of the mesh that border
    /// no conductor and no grounded or open wall have no field, and are left out.
    ///
    /// # Errors
    /// Names that the file does not have; shapes that are not physical groups; conductors that touch one
    /// another or a grounded wall, or that end the mesh next to open faces; outer faces without a wall; open
    /// faces that do not face away from the middle of the conductors.
    pub fn tet_mesh(&self, scene: &Scene) -> Result<TetMesh, ImportError> {
        self.with_roles(scene).map_err(|problem| ImportError::new(&self.file, problem))
    }

    /// The middle of a face.
    fn place(&self, face: [u32; 3]) -> Place {
        Place { at: middle(face.map(|p| self.points[p as usize])), line: None }
    }

    /// The mesh of [`Self::tet_mesh`], or the fault without the name of the file.
    fn with_roles(&self, scene: &Scene) -> Result<TetMesh, ImportProblem> {
        let conductors: Vec<Conductor<'_>> = scene.conductors().collect();
        let conductor_of = self.conductor_of(scene, &conductors)?;
        let region_of = self.region_of(scene)?;
        let touched = self.touched(&conductors, &conductor_of)?;
        let center = self.center(&touched);
        let sorted = self.sorted_faces(scene, &conductors, &conductor_of, &touched)?;
        self.check_open_ends(&conductors, &sorted.ends, sorted.open.iter().map(|o| o.face))?;
        self.check_open_faces(&sorted.open, center)?;
        let SortedFaces { mut roles, open, field, .. } = sorted;
        let permittivities = scene.permittivities();
        let region_inside = |o: &OpenFace| region_of[self.tet_groups[o.tet] as usize] as usize;
        let met = open.iter().map(|o| permittivities[region_inside(o)]);
        let background = scene.background_permittivity;
        let permittivity = met.fold([background; 2], |[low, high], e| [low.min(e), high.max(e)]);
        roles.extend(open.iter().map(|o| (o.face, FaceRole::Open { permittivity })));
        let reached = field.spread();
        Ok(self.without(|t| !reached[t], &roles, &region_of, center))
    }

    /// For each number of a group, the conductor that the group belongs to, if any. Number 0 is that of no
    /// group.
    fn conductor_of(
        &self,
        scene: &Scene,
        conductors: &[Conductor<'_>],
    ) -> Result<Vec<Option<usize>>, ImportProblem> {
        let mut conductor_of = vec![None; self.groups.len() + 1];
        for (k, part) in scene.conductor_parts() {
            for number in self.find(&conductors[k].body.name, part, 2)? {
                let earlier = conductor_of[number].replace(k).filter(|&earlier| earlier != k);
                if let Some(earlier) = earlier {
                    let [first, second] = [earlier, k].map(|k| conductors[k].body.name.clone());
                    let place = Place { at: self.some_point(number as u32), line: None };
                    return Err(ImportProblem::Touching { first, second, place });
                }
            }
        }
        Ok(conductor_of)
    }

    /// For each number of a group, the region of its tetrahedra: 0 for the background, else 1 + the index of
    /// the dielectric.
    fn region_of(&self, scene: &Scene) -> Result<Vec<u32>, ImportProblem> {
        let mut region_of = vec![0_u32; self.groups.len() + 1];
        for dielectric in scene.dielectrics() {
            for part in &dielectric.body.parts {
                for number in self.find(&dielectric.body.name, part, 3)? {
                    region_of[number] = dielectric.index as u32 + 1;
                }
            }
        }
        Ok(region_of)
    }

    /// Sorts the faces of all tetrahedra: on conductors, on walls, and between two tetrahedra outside
    /// conductors. `touched` is the conductor that each point belongs to.
    fn sorted_faces(
        &self,
        scene: &Scene,
        conductors: &[Conductor<'_>],
        conductor_of: &[Option<usize>],
        touched: &[Option<usize>],
    ) -> Result<SortedFaces, ImportProblem> {
        let conductor_in = |t: usize| conductor_of[self.tet_groups[t] as usize];
        let mut sheets = BTreeMap::new();
        for (face, &group) in self.faces.iter().zip(&self.face_groups) {
            if let Some(k) = conductor_of[group as usize] {
                let mut face = *face;
                face.sort_unstable();
                sheets.insert(face, k);
            }
        }
        let mut sorted = SortedFaces {
            roles: BTreeMap::new(),
            ends: Vec::new(),
            open: Vec::new(),
            field: Field::new(self.tets.len()),
        };
        for group in sides(self, |_| true).chunk_by(|a, b| a.0 == b.0) {
            let held = group
                .iter()
                .find_map(|s| conductor_in(s.1 as usize / 4))
                .or(sheets.get(&group[0].0).copied());
            if let ([_], Some(k)) = (group, held) {
                sorted.ends.push((group[0].0, k));
            }
            let free = group.iter().find(|s| conductor_in(s.1 as usize / 4).is_none());
            let Some(free) = free else { continue };
            let (face, tet) = (free.0, free.1 as usize / 4);
            if let Some(k) = held {
                sorted.roles.insert(face, FaceRole::Conductor(k as u32));
                let tets = group.iter().map(|s| s.1 as usize / 4);
                tets.filter(|&t| conductor_in(t).is_none()).for_each(|t| sorted.field.begin(t));
            } else if let [one, two] = group {
                sorted.field.join(one.1, two.1);
            } else {
                match self.wall(scene, face)? {
                    Wall::Insulated => {}
                    Wall::Grounded => {
                        self.check_apart_from_ground(face, conductors, touched)?;
                        sorted.roles.insert(face, FaceRole::Grounded);
                        sorted.field.begin(tet);
                    }
                    Wall::Open => {
                        sorted.open.push(OpenFace { face, outward: outward(free), tet });
                        sorted.field.begin(tet);
                    }
                }
            }
        }
        Ok(sorted)
    }

    /// Refuses a conductor at a grounded face.
    fn check_apart_from_ground(
        &self,
        face: [u32; 3],
        conductors: &[Conductor<'_>],
        touched: &[Option<usize>],
    ) -> Result<(), ImportProblem> {
        for p in face {
            if let Some(k) = touched[p as usize] {
                let place = Place { at: self.points[p as usize], line: None };
                return Err(ImportProblem::TouchingWall { name: conductors[k].body.name.clone(), place });
            }
        }
        Ok(())
    }

    /// Refuses open faces that do not face away from the middle of the conductors.
    fn check_open_faces(&self, open: &[OpenFace], center: [f64; 3]) -> Result<(), ImportProblem> {
        for o in open {
            let [a, b, c] = o.outward.map(|p| self.points[p as usize]);
            // Positive if the centre is on the inner side of the face, whose corners run anticlockwise as
            // seen from outside.
            if determinant(center, a, b, c) <= 0.0 {
                return Err(ImportProblem::OuterFace {
                    what: "an open outer face does not see the middle of the conductors",
                    place: self.place(o.face),
                    cure: "mesh up to a convex outer surface, as a box or a ball",
                });
            }
        }
        Ok(())
    }

    /// The numbers, counted from 1, of the groups that a shape names. Their dimension is at least `least`: 3
    /// for volumes alone, 2 for volumes and surfaces. `body` is the body of the shape, for messages.
    fn find(&self, body: &str, shape: &Shape, least: u8) -> Result<Vec<usize>, ImportProblem> {
        let Shape::Physical(name) = shape else {
            return Err(ImportProblem::NotPhysical(format!("\"{body}\" is not a physical group")));
        };
        let fits = |k: &usize| self.groups[*k].dimension >= least && self.groups[*k].name == *name;
        let numbers: Vec<usize> = (0..self.groups.len()).filter(fits).map(|k| k + 1).collect();
        if !numbers.is_empty() {
            return Ok(numbers);
        }
        let known: Vec<String> =
            self.groups.iter().filter(|g| g.dimension >= least).map(|g| format!("\"{}\"", g.name)).collect();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        let wanted = if least == 2 { "of volumes or surfaces" } else { "of volumes" };
        Err(ImportProblem::UnknownGroup { name: name.clone(), wanted, known })
    }

    /// A point of a group, m.
    fn some_point(&self, group: u32) -> [f64; 3] {
        let tet = self.tets.iter().zip(&self.tet_groups).find(|(_, g)| **g == group).map(|(t, _)| t[0]);
        let face = self.faces.iter().zip(&self.face_groups).find(|(_, g)| **g == group).map(|(f, _)| f[0]);
        tet.or(face).map_or([0.0; 3], |p| self.points[p as usize])
    }

    /// The conductor that each point belongs to, if any.
    fn touched(
        &self,
        conductors: &[Conductor<'_>],
        conductor_of: &[Option<usize>],
    ) -> Result<Vec<Option<usize>>, ImportProblem> {
        let mut out: Vec<Option<usize>> = vec![None; self.points.len()];
        let tets = self.tets.iter().zip(&self.tet_groups).map(|(t, &g)| (&t[..], g));
        let faces = self.faces.iter().zip(&self.face_groups).map(|(f, &g)| (&f[..], g));
        for (corners, group) in tets.chain(faces) {
            let Some(k) = conductor_of[group as usize] else { continue };
            for &p in corners {
                let earlier = out[p as usize].replace(k).filter(|&e| e != k);
                if let Some(earlier) = earlier {
                    let [first, second] = [earlier.min(k), earlier.max(k)];
                    let name = |k: usize| conductors[k].body.name.clone();
                    let place = Place { at: self.points[p as usize], line: None };
                    return Err(ImportProblem::Touching { first: name(first), second: name(second), place });
                }
            }
        }
        Ok(out)
    }

    /// The middle of the box around the conductors, or around the mesh if there are none, m.
    fn center(&self, touched: &[Option<usize>]) -> [f64; 3] {
        let [low, high] =
            bounds(self.points.iter().zip(touched).filter(|(_, t)| t.is_some()).map(|(p, _)| p))
                .or_else(|| bounds(self.points.iter()))
                .unwrap_or_default();
        [0, 1, 2].map(|a| 0.5 * (low[a] + high[a]))
    }

    /// The wall that an outer face is part of.
    fn wall(&self, scene: &Scene, face: [u32; 3]) -> Result<Wall, ImportProblem> {
        let first = scene.walls[0][0];
        if scene.walls.iter().flatten().all(|&w| w == first) {
            return Ok(first);
        }
        let ends = bounds(self.points.iter()).unwrap_or_default();
        for axis in 0..3 {
            let near = 1e-9 * (ends[1][axis] - ends[0][axis]);
            for side in 0..2 {
                if face.iter().all(|&p| (self.points[p as usize][axis] - ends[side][axis]).abs() <= near) {
                    return Ok(scene.walls[axis][side]);
                }
            }
        }
        Err(ImportProblem::OuterFace {
            what: "an outer face lies in no side of the mesh's bounding box, and the walls differ",
            place: self.place(face),
            cure: "make all walls equal, or name the faces as a conductor",
        })
    }

    /// Refuses a conductor on an outer surface that also has open faces. The space beyond that conductor
    /// would be neither in a tetrahedron nor beyond an open face, so its field would be missing. Skins of
    /// hollows, and a shell around everything, are outer surfaces without open faces.
    fn check_open_ends(
        &self,
        conductors: &[Conductor<'_>],
        ends: &[([u32; 3], usize)],
        open: impl Iterator<Item = [u32; 3]> + Clone,
    ) -> Result<(), ImportProblem> {
        // Points of one connected outer surface have the same first one.
        let mut parent: Vec<u32> = (0..self.points.len() as u32).collect();
        fn first(parent: &mut [u32], mut p: u32) -> u32 {
            while parent[p as usize] != p {
                parent[p as usize] = parent[parent[p as usize] as usize];
                p = parent[p as usize];
            }
            p
        }
        for [a, b, c] in ends.iter().map(|e| e.0).chain(open.clone()) {
            for p in [b, c] {
                let [one, two] = [a, p].map(|p| first(&mut parent, p));
                parent[one.max(two) as usize] = one.min(two);
            }
        }
        let mut is_open = vec![false; self.points.len()];
        for [a, ..] in open {
            is_open[first(&mut parent, a) as usize] = true;
        }
        match ends.iter().find(|(face, _)| is_open[first(&mut parent, face[0]) as usize]) {
            Some((face, k)) => {
                let (name, place) = (conductors[*k].body.name.clone(), self.place(*face));
                Err(ImportProblem::EndsAtOpenSpace { name, place })
            }
            None => Ok(()),
        }
    }

    /// The mesh without the tetrahedra for which `gone` holds, and without the points that only they use.
    fn without(
        &self,
        gone: impl Fn(usize) -> bool,
        roles: &BTreeMap<[u32; 3], FaceRole>,
        region_of: &[u32],
        center: [f64; 3],
    ) -> TetMesh {
        let mut out = TetMesh { center, ..TetMesh::default() };
        let mut number = vec![u32::MAX; self.points.len()];
        for t in (0..self.tets.len()).filter(|&t| !gone(t)) {
            let tet = self.tets[t].map(|p| {
                let n = &mut number[p as usize];
                if *n == u32::MAX {
                    *n = out.points.len() as u32;
                    out.points.push(self.points[p as usize]);
                }
                *n
            });
            out.tets.push(tet);
            out.regions.push(region_of[self.tet_groups[t] as usize]);
        }
        out.boundary = roles
            .iter()
            .map(|(face, &role)| BoundaryFace { face: face.map(|p| number[p as usize]), role })
            .collect();
        out
    }
}

/// The faces of a mesh, sorted by what they lie on, and what they tell of where there is a field.
struct SortedFaces {
    /// The roles of the faces on conductors and grounded walls; the corners of each face are ascending.
    roles: BTreeMap<[u32; 3], FaceRole>,
    /// Outer faces on conductors, each with its conductor.
    ends: Vec<([u32; 3], usize)>,
    /// Outer faces in open walls.
    open: Vec<OpenFace>,
    /// The search for the tetrahedra that have a field, not finished yet.
    field: Field,
}

/// An outer face beyond which space is open.
struct OpenFace {
    /// Corners, ascending.
    face: [u32; 3],
    /// Corners, anticlockwise as seen from outside.
    outward: [u32; 3],
    /// The tetrahedron that the face belongs to.
    tet: usize,
}

/// Finds the tetrahedra that have a field: those connected through faces to a conductor, a grounded or an
/// open wall.
struct Field {
    /// The neighbour through each face of each tetrahedron; the tetrahedron itself where it has none.
    neighbours: Vec<[u32; 4]>,
    /// For each tetrahedron whether it is known to have a field.
    reached: Vec<bool>,
    /// Tetrahedra with a field whose neighbours have not been looked at.
    pending: Vec<usize>,
}

impl Field {
    /// A search in a mesh with this number of tetrahedra, none of which is known to have a field.
    fn new(tets: usize) -> Self {
        let neighbours = (0..tets as u32).map(|t| [t; 4]).collect();
        Self { neighbours, reached: vec![false; tets], pending: Vec::new() }
    }

    /// Notes that two tetrahedra are neighbours; each is given as 4 t + k, by its number and that of the
    /// face.
    fn join(&mut self, one: u32, two: u32) {
        self.neighbours[one as usize / 4][one as usize % 4] = two / 4;
        self.neighbours[two as usize / 4][two as usize % 4] = one / 4;
    }

    /// Notes that a tetrahedron has a field.
    fn begin(&mut self, tet: usize) {
        if !std::mem::replace(&mut self.reached[tet], true) {
            self.pending.push(tet);
        }
    }

    /// For each tetrahedron whether it has a field.
    fn spread(mut self) -> Vec<bool> {
        while let Some(tet) = self.pending.pop() {
            for next in self.neighbours[tet] {
                self.begin(next as usize);
            }
        }
        self.reached
    }
}

/// The smallest box that holds all points: its lower and its upper corner.
pub(super) fn bounds<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> Option<[[f64; 3]; 2]> {
    points.fold(None, |all, p| {
        let [low, high] = all.unwrap_or([*p; 2]);
        Some([[0, 1, 2].map(|a| f64::min(low[a], p[a])), [0, 1, 2].map(|a| f64::max(high[a], p[a]))])
    })
}
