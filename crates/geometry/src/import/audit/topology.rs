//! Checks of how the faces of a surface are connected, its closed parts, and the side of each on which the
//! body is.

use super::{ImportProblem, Place, middle};
use crate::shapes::TriangleSurface;
use crate::winding;

/// The closed parts of a surface, in each of which all faces are turned the same way.
pub(super) struct Components {
    /// The part that each face belongs to; parts are numbered in the order of their first faces.
    part: Vec<u32>,
    /// The number of parts.
    count: usize,
    /// For each face whether it was turned to agree with the first one of its part.
    turned: Vec<bool>,
}

/// Finds the closed parts and turns the faces of each the same way. `lines` has the line of each face in the
/// file.
///
/// # Errors
/// Edges with one face or more than two, parts that meet in a point, parts with one side only.
pub(super) fn components(surface: &mut TriangleSurface, lines: &[u32]) -> Result<Components, ImportProblem> {
    let neighbours = neighbours(surface, lines)?;
    let faces = &mut surface.faces;
    let mut parts =
        Components { part: vec![u32::MAX; faces.len()], count: 0, turned: vec![false; faces.len()] };
    let mut open = Vec::new();
    for seed in 0..faces.len() {
        if parts.part[seed] != u32::MAX {
            continue;
        }
        parts.part[seed] = parts.count as u32;
        open.push(seed);
        while let Some(f) = open.pop() {
            for &(g, agrees) in &neighbours[f] {
                let g = g as usize;
                let turned = parts.turned[f] == agrees;
                if parts.part[g] == u32::MAX {
                    parts.part[g] = parts.count as u32;
                    parts.turned[g] = turned;
                    open.push(g);
                } else if parts.turned[g] != turned {
                    let at = middle(faces[g].map(|p| surface.points[p as usize]));
                    let line = lines.get(g).map(|&l| l as usize);
                    return Err(ImportProblem::OneSided(Place { at, line }));
                }
            }
        }
        parts.count += 1;
    }
    for (face, _) in faces.iter_mut().zip(&parts.turned).filter(|(_, turned)| **turned) {
        face.swap(1, 2);
    }
    check_fans(surface, lines)?;
    Ok(parts)
}

/// The three neighbours of each face, and whether each is turned the same way.
fn neighbours(surface: &TriangleSurface, lines: &[u32]) -> Result<Vec<[(u32, bool); 3]>, ImportProblem> {
    let mut edges = Vec::with_capacity(3 * surface.faces.len());
    for (f, face) in surface.faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            edges.push((a.min(b), a.max(b), 3 * f + k));
        }
    }
    edges.sort_unstable();
    let place = |&(a, b, side): &(u32, u32, usize)| Place {
        at: middle([a, b].map(|p| surface.points[p as usize])),
        line: lines.get(side / 3).map(|&l| l as usize),
    };
    let groups = || edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    if let Some(many) = groups().find(|g| g.len() > 2) {
        return Err(ImportProblem::NonManifoldEdge(place(&many[0]), many.len()));
    }
    if let Some(single) = groups().find(|g| g.len() == 1) {
        return Err(ImportProblem::NotClosed(place(&single[0]), groups().filter(|g| g.len() == 1).count()));
    }
    let mut out = vec![[(0, false); 3]; surface.faces.len()];
    for pair in groups() {
        let (s, t) = (pair[0].2, pair[1].2);
        let agrees = surface.faces[s / 3][s % 3] != surface.faces[t / 3][t % 3];
        out[s / 3][s % 3] = ((t / 3) as u32, agrees);
        out[t / 3][t % 3] = ((s / 3) as u32, agrees);
    }
    Ok(out)
}

/// Checks that the faces around each point form a single closed fan.
fn check_fans(surface: &TriangleSurface, lines: &[u32]) -> Result<(), ImportProblem> {
    // For each corner of a face: its point, the two other points of the face, and the face.
    let mut corners: Vec<(u32, u32, u32, u32)> = Vec::with_capacity(3 * surface.faces.len());
    for (f, face) in surface.faces.iter().enumerate() {
        for k in 0..3 {
            corners.push((face[k], face[(k + 1) % 3], face[(k + 2) % 3], f as u32));
        }
    }
    corners.sort_unstable();
    for fan in corners.chunk_by(|a, b| a.0 == b.0) {
        let mut steps = 0;
        let mut neighbour = fan[0].1;
        while let Ok(k) = fan.binary_search_by_key(&neighbour, |c| c.1) {
            neighbour = fan[k].2;
            steps += 1;
            if neighbour == fan[0].1 || steps > fan.len() {
                break;
            }
        }
        if steps != fan.len() {
            let line = lines.get(fan[0].3 as usize).map(|&l| l as usize);
            return Err(ImportProblem::Pinched(Place { at: surface.points[fan[0].0 as usize], line }));
        }
    }
    Ok(())
}

/// Turns the faces of bodies outward and those of hollows inward; returns how many end up turned against the
/// file.
///
/// # Errors
/// Parts without a volume, and parts inside another that the file does not turn the opposite way, as it would
/// a hollow.
pub(super) fn outward(
    surface: &mut TriangleSurface,
    parts: &Components,
    lines: &[u32],
) -> Result<usize, ImportProblem> {
    let mut members = vec![Vec::new(); parts.count];
    for (f, &c) in parts.part.iter().enumerate() {
        members[c as usize].push(f);
    }
    let points = &surface.points;
    let place = |f: usize| Place {
        at: middle(surface.faces[f].map(|p| points[p as usize])),
        line: lines.get(f).map(|&l| l as usize),
    };
    let bounds: Vec<_> =
        members.iter().map(|m| Bounds::of(points, m.iter().map(|&f| surface.faces[f]))).collect();
    let mut is_outward = Vec::new();
    for (c, faces) in members.iter().enumerate() {
        let origin = points[surface.faces[faces[0]][0] as usize];
        let six_volumes = || {
            faces.iter().map(|&f| {
                let [a, b, c] = surface.faces[f].map(|p| points[p as usize]);
                crate::meshing::tets::determinant(origin, a, b, c)
            })
        };
        let (volume, size): (f64, f64) = (six_volumes().sum(), six_volumes().map(f64::abs).sum());
        if volume.abs() <= 1e-14 * size || bounds[c].is_flat() {
            return Err(ImportProblem::NoVolume(place(faces[0])));
        }
        is_outward.push(volume > 0.0);
    }
    // For each part the parts that contain it.
    let around: Vec<Vec<usize>> = (0..parts.count)
        .map(|c| {
            let p = points[surface.faces[members[c][0]][0] as usize];
            let holds = |d: &usize| {
                *d != c
                    && bounds[*d].contains(p)
                    && winding::of_faces(points, members[*d].iter().map(|&f| &surface.faces[f]), p).abs()
                        > 0.5
            };
            (0..parts.count).filter(holds).collect()
        })
        .collect();
    // Whether a part is turned outward in the file; known only if all its faces agree there.
    let outward_in_file: Vec<Option<bool>> = (0..parts.count)
        .map(|c| members[c].iter().all(|&f| !parts.turned[f]).then_some(is_outward[c]))
        .collect();
    let mut turned = parts.turned.clone();
    for c in 0..parts.count {
        let depth = around[c].len();
        if depth % 2 == 1 {
            let parent = around[c].iter().find(|&&d| around[d].len() + 1 == depth);
            let hollow = parent.is_some_and(|&d| {
                outward_in_file[c].is_some()
                    && outward_in_file[d].is_some()
                    && outward_in_file[c] != outward_in_file[d]
            });
            if !hollow {
                return Err(ImportProblem::Nested(place(members[c][0])));
            }
        }
        if is_outward[c] == (depth % 2 == 1) {
            for &f in &members[c] {
                turned[f] = !turned[f];
            }
        }
    }
    for f in 0..turned.len() {
        if turned[f] != parts.turned[f] {
            surface.faces[f].swap(1, 2);
        }
    }
    Ok(turned.iter().filter(|&&t| t).count())
}

/// One point of every connected part of a surface, m.
pub(super) fn representatives(surface: &TriangleSurface) -> Vec<[f64; 3]> {
    let mut parent: Vec<u32> = (0..surface.points.len() as u32).collect();
    fn root(parent: &mut [u32], mut p: u32) -> u32 {
        while parent[p as usize] != p {
            parent[p as usize] = parent[parent[p as usize] as usize];
            p = parent[p as usize];
        }
        p
    }
    for face in &surface.faces {
        for k in 1..3 {
            let (a, b) = (root(&mut parent, face[0]), root(&mut parent, face[k]));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let first = |p: &u32| parent[*p as usize] == *p;
    (0..surface.points.len() as u32).filter(first).map(|p| surface.points[p as usize]).collect()
}

/// The bounding box of a part.
struct Bounds {
    /// Its lower corner, m.
    low: [f64; 3],
    /// Its upper corner, m.
    high: [f64; 3],
}

impl Bounds {
    /// The bounding box of some faces.
    fn of(points: &[[f64; 3]], faces: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut out = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
        for p in faces.flatten().map(|p| points[p as usize]) {
            for a in 0..3 {
                out.low[a] = out.low[a].min(p[a]);
                out.high[a] = out.high[a].max(p[a]);
            }
        }
        out
    }

    fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|a| self.low[a] <= p[a] && p[a] <= self.high[a])
    }

    /// Whether the box has no extent along an axis.
    fn is_flat(&self) -> bool {
        (0..3).any(|a| self.low[a] == self.high[a])
    }
}
