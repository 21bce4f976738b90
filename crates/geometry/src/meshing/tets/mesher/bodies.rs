//! From the bodies of a scene to points, segments and facets.

use super::complex::{Complex, Owner};
use super::meet::NOBODY;
use super::skin::{Cut, Skin};
use super::thin::too_near;
use super::{MeshError, Sizing};
use crate::scene::{Box3, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};
use std::collections::HashMap;

type P = [f64; 3];

/// The box that holds a body; infinite where the body is.
pub(crate) fn bounds(shape: &Shape) -> Box3 {
    shape.bounds().unwrap_or(Box3 { min: [0.0; 3], max: [0.0; 3] })
}

/// Largest finite extent.
fn extent(b: &Box3) -> f64 {
    (0..3).map(|a| b.extent(a)).filter(|e| e.is_finite()).fold(0.0, f64::max)
}

/// Corners of the polygon that stands for a circle: of the same area.
fn circle(middle: [f64; 2], radius: f64, relative: f64) -> Vec<[f64; 2]> {
    let turn = std::f64::consts::TAU;
    let n = ((turn / relative).ceil() as usize).clamp(8, 400).next_multiple_of(4);
    let angle = turn / n as f64;
    let out = radius * (angle / angle.sin()).sqrt();
    (0..n)
        .map(|k| [middle[0] + out * (k as f64 * angle).cos(), middle[1] + out * (k as f64 * angle).sin()])
        .collect()
}

/// A sphere as triangles of about `relative` times its radius that enclose the volume of the ball.
///
/// The faces of an icosahedron in equal parts, brought to the sphere; then all corners move out by the same factor,
/// 1 + O(relative^2).
pub(super) fn geodesic(center: P, radius: f64, relative: f64) -> TriangleSurface {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners: Vec<P> = Vec::new();
    for k in 0..3 {
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let mut p = [0.0; 3];
            p[(k + 1) % 3] = s;
            p[(k + 2) % 3] = t * g;
            corners.push(p);
        }
    }
    let distance = |a: P, b: P| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    let adjacent = |i: usize, j: usize| (distance(corners[i], corners[j]) - 4.0).abs() < 1e-9;
    let n = ((1.1 / relative).ceil() as usize).clamp(1, 100);
    let mut out = TriangleSurface::default();
    let mut known: HashMap<Vec<(usize, usize)>, u32> = HashMap::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if !(adjacent(i, j) && adjacent(j, k) && adjacent(i, k)) {
                    continue;
                }
                let outward = super::delaunay::orient([0.0; 3], corners[i], corners[j], corners[k]) > 0.0;
                let ids = if outward { [i, j, k] } else { [i, k, j] };
                let mut at = |a: usize, b: usize| {
                    let weights = [n - a - b, a, b];
                    let mut key: Vec<(usize, usize)> =
                        (0..3).filter(|&m| weights[m] > 0).map(|m| (ids[m], weights[m])).collect();
                    key.sort_unstable();
                    let mut p = [0.0; 3];
                    for &(corner, weight) in &key {
                        p = [0, 1, 2].map(|m| p[m] + weight as f64 * corners[corner][m]);
                    }
                    let length = distance(p, [0.0; 3]).sqrt();
                    *known.entry(key).or_insert_with(|| {
                        out.points.push(p.map(|x| x / length));
                        out.points.len() as u32 - 1
                    })
                };
                let mut faces = Vec::new();
                for a in 0..n {
                    for b in 0..n - a {
                        faces.push([at(a, b), at(a + 1, b), at(a, b + 1)]);
                        if a + b + 1 < n {
                            faces.push([at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)]);
                        }
                    }
                }
                out.faces.extend(faces);
            }
        }
    }
    let volume: f64 = out
        .faces
        .iter()
        .map(|f| {
            let [a, b, c] = f.map(|p| out.points[p as usize]);
            crate::meshing::tets::determinant([0.0; 3], a, b, c) / 6.0
        })
        .sum();
    let factor = radius * (4.0 / 3.0 * std::f64::consts::PI / volume).cbrt();
    for p in &mut out.points {
        *p = [0, 1, 2].map(|k| center[k] + factor * p[k]);
    }
    out
}

/// The body as it is meshed: with flat faces in place of curved ones. That around a shell becomes the hollow.
pub(super) fn flat(shape: &Shape, sizing: &Sizing) -> Shape {
    match shape {
        Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
            Shape::Surface(geodesic(*center, *radius, sizing.facet))
        }
        Shape::Cylinder { axis, base, radius, height } => {
            let across = [[1, 2], [0, 2], [0, 1]][*axis].map(|a| base[a]);
            let outline = circle(across, *radius, sizing.facet);
            Shape::Extrusion { axis: *axis, from: base[*axis], to: base[*axis] + height, outline }
        }
        other => other.clone(),
    }
}

/// Where the mesh ends: the walls, and far from the bodies where there is none.
pub(super) fn domain(scene: &Scene, sizing: &Sizing) -> Result<Box3, MeshError> {
    if let Some(shell) = scene.shapes().find(|s| matches!(s, Shape::Shell { .. })) {
        let b = bounds(shell);
        let grown = 0.25 * extent(&b);
        let mut out = Box3 { min: b.min.map(|x| x - grown), max: b.max.map(|x| x + grown) };
        for a in 0..3 {
            if scene.domain.min[a] > b.min[a] {
                out.min[a] = scene.domain.min[a];
            }
            if scene.domain.max[a] < b.max[a] {
                out.max[a] = scene.domain.max[a];
            }
        }
        return Ok(out);
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for b in scene.shapes().map(bounds).chain([scene.domain]) {
        for a in 0..3 {
            for x in [b.min[a], b.max[a]].into_iter().filter(|x| x.is_finite()) {
                low[a] = low[a].min(x);
                high[a] = high[a].max(x);
            }
        }
    }
    let size = (0..3).map(|a| high[a] - low[a]).filter(|x| x.is_finite()).fold(0.0, f64::max);
    if size <= 0.0 {
        return Err(MeshError::Empty);
    }
    let far = 0.5 * sizing.far * size;
    let mut out = scene.domain;
    for a in 0..3 {
        let middle = if low[a] <= high[a] { 0.5 * (low[a] + high[a]) } else { 0.0 };
        if out.min[a].is_infinite() {
            out.min[a] = middle - far;
        }
        if out.max[a].is_infinite() {
            out.max[a] = middle + far;
        }
    }
    Ok(out)
}

/// All surfaces of the scene.
pub(super) fn complex(scene: &Scene, domain: &Box3, sizing: &Sizing) -> Result<Complex, MeshError> {
    let mut out = Complex::default();
    // Every part owns its surface.
    let conductors = scene
        .conductors()
        .flat_map(|c| c.body.parts.iter().map(move |part| (&c.body.name, part, Some(c.index as u32))));
    let dielectrics =
        scene.dielectrics().flat_map(|d| d.body.parts.iter().map(move |part| (&d.body.name, part, None)));
    let all = || conductors.clone().chain(dielectrics.clone());
    out.bodies.extend(all().map(|(name, shape, conductor)| Owner {
        name: name.clone(),
        conductor,
        ball: matches!(shape, Shape::Sphere { .. } | Shape::Shell { .. }),
    }));
    boxes(&mut out, scene, domain, sizing);
    let mut planes = [0, 1, 2].map(|a| {
        let boxes = all().filter_map(|b| if let Shape::Box(b) = b.1 { Some(*b) } else { None });
        boxes.chain([*domain]).flat_map(|b| [b.min[a], b.max[a]]).filter(|x| x.is_finite()).collect()
    });
    for (owner, (name, shape, conductor)) in (0..).zip(all()) {
        let unsupported = |what| MeshError::Unsupported { body: name.clone(), what };
        let mut size = sizing.facet * extent(&bounds(shape));
        let mut ball = false;
        match shape {
            Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
                size = sizing.facet * radius;
                ball = true;
                middle(&mut out, domain, *center, size);
            }
            Shape::Cylinder { radius, .. } => size = sizing.facet * radius,
            _ => {}
        }
        let mut skin = match flat(shape, sizing) {
            Shape::Extrusion { axis, from, to, outline } => {
                Skin::prism(axis, [from, to], &outline, conductor)
            }
            Shape::Surface(surface) => Skin::triangles(&surface, !ball),
            Shape::Physical(_) => {
                return Err(unsupported("a group of a volume mesh, which is a mesh already"));
            }
            _ => continue,
        };
        skin.align(&mut planes);
        for axis in 0..3 {
            for (at, above, wall) in [
                (domain.min[axis], true, scene.walls[axis][0]),
                (domain.max[axis], false, scene.walls[axis][1]),
            ] {
                skin.cut(Cut { axis, at, above })
                    .ok_or_else(|| unsupported("a surface that is not closed"))?;
                if let Some(at) = skin.touches(axis, at)
                    && conductor.is_some()
                    && wall == Wall::Grounded
                {
                    let second = "a grounded wall".into();
                    return Err(MeshError::Crossing { first: name.clone(), second, at });
                }
            }
        }
        let mut parts = vec![skin];
        for (axis, at) in through(scene, domain, &bounds(shape)) {
            let cut = parts.into_iter().map(|part| part.parted(axis, at)).collect::<Option<Vec<_>>>();
            parts = cut
                .ok_or_else(|| unsupported("a surface that is not closed"))?
                .into_iter()
                .flatten()
                .collect();
        }
        for part in parts {
            part.put(&mut out, owner, size).ok_or_else(|| unsupported("a face without an area"))?;
        }
    }
    out.close(domain)?;
    let shape = |o: u32| all().nth(o as usize).map(|b| b.1);
    for &[first, second] in &out.crossed {
        if let (Some(one), Some(other)) = (shape(first), shape(second))
            && too_near(one, other, sizing.facet)
        {
            let name = |o: u32| out.bodies[o as usize].name.clone();
            return Err(MeshError::Near { first: name(first), second: name(second) });
        }
    }
    Ok(out)
}

/// The planes of dielectric boxes and slabs that go all the way through a body within `around`: axis and place.
fn through(scene: &Scene, domain: &Box3, around: &Box3) -> Vec<(usize, f64)> {
    // Flat faces of a round body reach out of it a little.
    let room = 0.1 * extent(around);
    let mut out = Vec::new();
    for (_, part) in scene.dielectric_parts() {
        let Some(b) = part.as_box() else { continue };
        for axis in 0..3 {
            let covers = |a: usize| {
                b.min[a] <= (around.min[a] - room).max(domain.min[a])
                    && b.max[a] >= (around.max[a] + room).min(domain.max[a])
            };
            if (0..3).all(|a| a == axis || covers(a)) {
                let inside = |x: &f64| domain.min[axis] < *x && *x < domain.max[axis];
                out.extend([b.min[axis], b.max[axis]].into_iter().filter(inside).map(|at| (axis, at)));
            }
        }
    }
    out.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    out.dedup();
    out
}

/// Gives a ball a point in its middle, so that not all points are on spheres.
fn middle(out: &mut Complex, domain: &Box3, center: P, size: f64) {
    let on = (0..3).any(|a| center[a] == domain.min[a] || center[a] == domain.max[a]);
    if on && domain.contains(center) {
        out.point(center, size);
    } else {
        out.seeds.push((center, size));
    }
}

/// All boxes and the walls: faces between cells of their common grid that are filled differently.
fn boxes(out: &mut Complex, scene: &Scene, domain: &Box3, sizing: &Sizing) {
    let mut bodies: Vec<(Box3, i64)> = Vec::new();
    for (d, part) in scene.dielectric_parts() {
        bodies.extend(part.as_box().map(|b| (b, d as i64 + 1)));
    }
    for (c, part) in scene.conductor_parts() {
        bodies.extend(part.as_box().map(|b| (b, -1 - c as i64)));
    }
    // The first part of a body owns the faces of all its boxes, which are made together.
    let metal: Vec<usize> = scene.conductor_parts().map(|(c, _)| c).collect();
    let filled_by: Vec<usize> = scene.dielectric_parts().map(|(d, _)| d).collect();
    let lines = [0, 1, 2].map(|a| {
        let mut line = vec![domain.min[a], domain.max[a]];
        for (b, _) in &bodies {
            line.extend([b.min[a], b.max[a]].iter().filter(|&&x| domain.min[a] < x && x < domain.max[a]));
        }
        line.sort_unstable_by(f64::total_cmp);
        line.dedup();
        line
    });
    let count = [0, 1, 2].map(|a| lines[a].len() as isize);
    // What fills a cell; outside the domain something of its own.
    let filled = |cell: [isize; 3]| -> i64 {
        if (0..3).any(|a| cell[a] < 0 || cell[a] + 1 >= count[a]) {
            return i64::MIN;
        }
        let middle = [0, 1, 2].map(|a| 0.5 * (lines[a][cell[a] as usize] + lines[a][cell[a] as usize + 1]));
        bodies.iter().rev().find(|b| b.0.sheet_normal().is_none() && b.0.contains(middle)).map_or(0, |b| b.1)
    };
    // What is on either side of the face of the grid normal to `axis` at `at`, and the sheet in it, unless there is no face.
    let face = |axis: usize, at: [isize; 3]| -> Option<[i64; 3]> {
        if (0..3).any(|a| a != axis && (at[a] < 0 || at[a] + 1 >= count[a])) {
            return None;
        }
        let mut below = at;
        below[axis] -= 1;
        let middle = [0, 1, 2].map(|a| {
            let low = lines[a][at[a] as usize];
            if a == axis { low } else { 0.5 * (low + lines[a][at[a] as usize + 1]) }
        });
        let sheet = bodies.iter().find(|b| b.0.sheet_normal() == Some(axis) && b.0.contains(middle));
        let code = [filled(below), filled(at), sheet.map_or(0, |s| s.1)];
        (code[0] != code[1] || code[2] != 0).then_some(code)
    };
    // Conductors first: their surface it is.
    let owner = |codes: [i64; 3]| {
        let conductor = codes.into_iter().find(|&c| c < 0 && c != i64::MIN).map(|c| (-1 - c) as usize);
        let dielectric = codes.into_iter().find(|&c| c > 0).map(|c| c as usize - 1);
        let of_conductor = conductor.and_then(|c| metal.iter().position(|&m| m == c));
        let of_dielectric = || Some(metal.len() + filled_by.iter().position(|f| Some(*f) == dielectric)?);
        of_conductor.or_else(of_dielectric).map_or(NOBODY, |o| o as u32)
    };
    let far = extent(domain);
    let size = |codes: &[i64]| {
        let of = |b: &&(Box3, i64)| codes.contains(&b.1) && b.1 < 0;
        bodies.iter().filter(of).map(|b| sizing.facet * extent(&b.0)).fold(far, f64::min)
    };
    for axis in 0..3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        for i in 0..count[0] {
            for j in 0..count[1] {
                for k in 0..count[2] {
                    let at = [i, j, k];
                    if let Some(code) = face(axis, at) {
                        let facet = out.plane(axis, lines[axis][at[axis] as usize]);
                        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|s| {
                            let mut to = at;
                            to[u] += s[0];
                            to[v] += s[1];
                            [0, 1, 2].map(|a| lines[a][to[a] as usize])
                        });
                        out.area(facet, &corners, owner(code));
                        if code[2] < 0 {
                            let polygon = out.facets[facet as usize].polygons.len() - 1;
                            out.facets[facet as usize].sheets.push(((-1 - code[2]) as u32, polygon));
                        }
                    }
                    // The edge along `axis`: kept unless one face goes straight through.
                    if at[axis] + 1 >= count[axis] {
                        continue;
                    }
                    let around = |at: [isize; 3]| {
                        let (mut before_u, mut before_v) = (at, at);
                        before_u[u] -= 1;
                        before_v[v] -= 1;
                        [face(v, before_u), face(v, at), face(u, before_v), face(u, at)]
                    };
                    let faces @ [a, b, c, d] = around(at);
                    if a == b && c == d && (a.is_none() || c.is_none()) {
                        continue;
                    }
                    // As far as the same faces meet it is one edge: planes that only cross it far from their body cut nothing.
                    let mut next = at;
                    next[axis] -= 1;
                    if at[axis] > 0 && around(next) == faces {
                        continue;
                    }
                    let mut end = at;
                    end[axis] += 1;
                    while end[axis] + 1 < count[axis] && around(end) == faces {
                        end[axis] += 1;
                    }
                    let codes: Vec<i64> = [a, b, c, d].into_iter().flatten().flatten().collect();
                    let [p, q] = [at, end]
                        .map(|x| out.point([0, 1, 2].map(|m| lines[m][x[m] as usize]), size(&codes)));
                    for (normal, is) in [(v, a.or(b)), (u, c.or(d))] {
                        if is.is_some() {
                            let facet = out.plane(normal, lines[normal][at[normal] as usize]);
                            out.segment(p, q, facet);
                        }
                    }
                }
            }
        }
    }
}
