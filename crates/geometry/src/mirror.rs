//! Planes of mirror symmetry of a scene: of a symmetric scene, only one half needs to be solved.
//!
//! Conductors either lie on both sides of such a plane, or change places with one another about it. Every
//! potential is the sum of one that is even about the plane, for which it takes the place of an insulated
//! wall, and one that is odd, for which it takes the place of a grounded one. Where no conductors change
//! places, all potentials of interest are even.

use crate::meshing::tets::{bounds, flat_parts};
use crate::scene::{Body, Box3, MirrorPlane, Scene, Wall, across};
use crate::shapes::{Arc, Curve, Shape, TriangleSurface};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Distances below this, relative to the extent of the scene, count as zero. Not tuned: it only has to lie
/// above rounding errors and below distances that matter.
const TOLERANCE: f64 = 1e-12;

/// The planes about which a scene is symmetric, at most one normal to each axis.
///
/// No plane is found along an axis on which no body ends, for groups of a volume mesh, where a sheet lies in
/// the plane, where conductors that change places about the plane touch it, and where a surface has edges on
/// one side of it that have no mirror images on the other.
pub fn planes(scene: &Scene) -> [Option<MirrorPlane>; 3] {
    let boxes: Vec<Box3> = scene.shapes().map(bounds).chain([scene.domain]).collect();
    let extents = boxes.iter().flat_map(|b| (0..3).map(|a| b.extent(a)));
    let near = TOLERANCE * extents.filter(|e| e.is_finite()).fold(0.0, f64::max);
    let conductors: Vec<&Body> = scene.conductors().map(|c| c.body).collect();
    let dielectrics: Vec<&Body> = scene.dielectrics().map(|d| d.body).collect();
    [0, 1, 2].map(|axis| {
        if scene.walls[axis][0] != scene.walls[axis][1] {
            return None;
        }
        // The candidates are the middle of one body, and that of all conductors together.
        let of_one = scene.shapes().zip(&boxes).find_map(|(shape, b)| middle(shape, b, axis))?;
        let joint = scene.conductor_parts().map(|(_, part)| bounds(part)).reduce(|a, b| a.union(&b));
        let of_all = joint.map(|b| 0.5 * (b.min[axis] + b.max[axis])).filter(|at| at.is_finite());
        let candidates = std::iter::once(of_one).chain(of_all.filter(|at| (at - of_one).abs() > near));
        candidates.into_iter().find_map(|at| {
            let plane = Plane { axis, at, near };
            if !plane.halves(&scene.domain) {
                return None;
            }
            let images = plane.images(&conductors)?;
            let touch = (0..images.len()).any(|k| images[k] != k && plane.touches(conductors[k]));
            let of_dielectrics = plane.images(&dielectrics)?;
            (!touch && keeps_order(&dielectrics, &of_dielectrics)).then_some(MirrorPlane {
                at,
                conductors: images,
                dielectrics: of_dielectrics,
            })
        })
    })
}

/// The part of the scene above the planes, which become insulated walls. Bodies reach across them as before.
pub fn part(scene: &Scene, planes: &[Option<MirrorPlane>; 3]) -> Scene {
    let mut out = scene.clone();
    for (axis, plane) in planes.iter().enumerate() {
        if let Some(plane) = plane {
            out.domain.min[axis] = plane.at;
            out.walls[axis][0] = Wall::Insulated;
        }
    }
    out
}

/// The coordinate that a mirror plane of a shape normal to `axis` would have, given the bounds of the shape.
fn middle(shape: &Shape, b: &Box3, axis: usize) -> Option<f64> {
    match shape {
        Shape::Sphere { center, .. } | Shape::Shell { center, .. } => Some(center[axis]),
        Shape::Capsule { from, to, .. } => Some(0.5 * (from[axis] + to[axis])),
        Shape::Cylinder { axis: along, base, .. } | Shape::Tube { axis: along, base, .. }
            if *along != axis =>
        {
            Some(base[axis])
        }
        Shape::Box(_)
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Extrusion { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => Some(0.5 * (b.min[axis] + b.max[axis])).filter(|at| at.is_finite()),
    }
}

/// Whether dielectrics override one another after the reflection as they do before it.
fn keeps_order(dielectrics: &[&Body], images: &[usize]) -> bool {
    let boxes: Vec<Option<Box3>> = dielectrics.iter().map(|body| body.bounds()).collect();
    let overlap = |i: usize, j: usize| match (boxes[i], boxes[j]) {
        (Some(a), Some(b)) => a.touches(&b),
        (None, _) | (_, None) => true,
    };
    let swapped: Vec<usize> = (0..images.len()).filter(|&i| images[i] != i).collect();
    swapped.iter().all(|&i| {
        (0..images.len()).filter(|&j| j != i).all(|j| {
            let same = dielectrics[i].role == dielectrics[j].role;
            same || (i < j) == (images[i] < images[j]) || !overlap(i, j)
        })
    })
}

/// A candidate for a mirror plane.
#[derive(Debug, Clone, Copy)]
struct Plane {
    /// The axis to which the plane is normal.
    axis: usize,
    /// The coordinate of the plane along that axis, m.
    at: f64,
    /// The error that coordinates may have from rounding, m.
    near: f64,
}

impl Plane {
    /// For each body the index of its mirror image; `None` if a body has none.
    fn images(&self, bodies: &[&Body]) -> Option<Vec<usize>> {
        let boxes: Vec<Vec<Box3>> = bodies.iter().map(|b| b.parts.iter().map(bounds).collect()).collect();
        let mut images: Vec<Option<usize>> = vec![None; bodies.len()];
        for k in 0..bodies.len() {
            if images[k].is_some() {
                continue;
            }
            let mut others = (k..bodies.len()).filter(|&other| images[other].is_none());
            let image = others.find(|&other| {
                self.maps_body((bodies[k], &boxes[k]), (bodies[other], &boxes[other]), k == other)
            })?;
            images[k] = Some(image);
            images[image] = Some(k);
        }
        images.into_iter().collect()
    }

    /// Whether a body, with the bounds of its parts, is the image of another one, or of itself.
    fn maps_body(&self, one: (&Body, &[Box3]), other: (&Body, &[Box3]), itself: bool) -> bool {
        let same_role = match (one.0.is_conductor(), other.0.is_conductor()) {
            (true, true) => true,
            (false, false) => one.0.role == other.0.role,
            (true, false) | (false, true) => false,
        };
        let mut unmatched: Vec<usize> = (0..other.1.len()).collect();
        let same_count = one.1.len() == unmatched.len();
        same_role
            && same_count
            && one.1.iter().enumerate().all(|(p, b)| {
                let image = unmatched.iter().position(|&q| {
                    // A sheet in the plane has a field on both of its sides.
                    let in_plane = itself && p == q && b.min[self.axis] == b.max[self.axis];
                    !in_plane
                        && self.maps_box(b, &other.1[q])
                        && self.maps_shape(&one.0.parts[p], &other.0.parts[q])
                });
                image.map(|k| unmatched.swap_remove(k)).is_some()
            })
    }

    /// Whether the plane touches a part of a body.
    fn touches(&self, body: &Body) -> bool {
        let (low, high) = (self.at - self.near, self.at + self.near);
        body.parts.iter().map(bounds).any(|b| b.min[self.axis] <= high && b.max[self.axis] >= low)
    }

    /// Whether the plane goes through the middle of the box, or the box is infinite in both directions along
    /// the axis.
    fn halves(&self, b: &Box3) -> bool {
        self.maps_box(b, b)
    }

    /// Whether one box is the image of the other.
    fn maps_box(&self, one: &Box3, other: &Box3) -> bool {
        // The image of infinity is infinity.
        let apart = |x: f64, y: f64| if x == y { 0.0 } else { (x - y).abs() };
        let image = |x: f64| 2.0 * self.at - x;
        (0..3).all(|a| {
            let [min, max] = if a == self.axis {
                [image(one.max[a]), image(one.min[a])]
            } else {
                [one.min[a], one.max[a]]
            };
            apart(min, other.min[a]) <= 2.0 * self.near && apart(max, other.max[a]) <= 2.0 * self.near
        })
    }

    /// Whether a shape is the image of another one, or of itself, given that their bounds are images of each
    /// other.
    fn maps_shape(&self, one: &Shape, other: &Shape) -> bool {
        match (one, other) {
            (Shape::Box(_), Shape::Box(_))
            | (Shape::Sphere { .. }, Shape::Sphere { .. })
            | (Shape::Shell { .. }, Shape::Shell { .. }) => true,
            (Shape::Capsule { from, to, .. }, Shape::Capsule { from: first, to: second, .. }) => {
                // Bounds do not determine the direction of the segment.
                let maps = |p: &[f64; 3], q: &[f64; 3]| {
                    let image = |a: usize| if a == self.axis { 2.0 * self.at - p[a] } else { p[a] };
                    (0..3).all(|a| (image(a) - q[a]).abs() <= 4.0 * self.near)
                };
                (maps(from, first) && maps(to, second)) || (maps(from, second) && maps(to, first))
            }
            (Shape::Cylinder { axis, .. }, Shape::Cylinder { axis: along, .. }) => axis == along,
            (
                Shape::Tube { axis, radii: [inner, _], .. },
                Shape::Tube { axis: along, radii: [other, _], .. },
            ) => axis == along && (inner - other).abs() <= 2.0 * self.near,
            (
                Shape::Extrusion { axis, outline, arcs, .. },
                Shape::Extrusion { axis: along, outline: other, arcs: others, .. },
            ) => {
                let reflected = across(*axis).into_iter().position(|k| k == self.axis);
                axis == along
                    && self.maps_outline(outline, other, reflected)
                    && self.maps_curves(arcs, others, reflected)
            }
            (Shape::Surface(one), Shape::Surface(other)) => self.maps_surface(one, other),
            (
                Shape::Box(_)
                | Shape::Sphere { .. }
                | Shape::Shell { .. }
                | Shape::Capsule { .. }
                | Shape::Cylinder { .. }
                | Shape::Tube { .. }
                | Shape::Extrusion { .. }
                | Shape::Surface(_)
                | Shape::Physical(_),
                _,
            ) => false,
        }
    }

    /// Whether the corners of an outline are the images of those of another, one after the other, either way
    /// round. Of the two coordinates, the mirror reflects the one with the number `reflected`, if any.
    fn maps_outline(&self, one: &[[f64; 2]], other: &[[f64; 2]], reflected: Option<usize>) -> bool {
        let n = one.len();
        let image = |i: usize| self.image(one[i], reflected);
        let same = |p: [f64; 2], q: [f64; 2]| (0..2).all(|m| (p[m] - q[m]).abs() <= 4.0 * self.near);
        let from = |start: usize| {
            (0..n).all(|i| same(image(i), other[(start + n - i) % n]))
                || (0..n).all(|i| same(image(i), other[(start + i) % n]))
        };
        n == other.len() && (0..n).any(from)
    }

    /// Whether each curve of an outline has an image among those of another, given that their corners are
    /// images of each other. The corners determine circles, but not cubics.
    fn maps_curves(&self, one: &[Arc], other: &[Arc], reflected: Option<usize>) -> bool {
        let same = |p: [f64; 2], q: [f64; 2]| (0..2).all(|m| (p[m] - q[m]).abs() <= 1e2 * self.near);
        let is_image = |one: &Curve, other: &Curve| match (one, other) {
            (Curve::Circle { .. }, Curve::Circle { .. }) => true,
            (Curve::Cubic(one), Curve::Cubic(other)) => [*other, other.reversed()].iter().any(|other| {
                let mut pairs = one.control.iter().zip(&other.control);
                pairs.all(|(p, q)| same(self.image(*p, reflected), *q))
            }),
            (Curve::Circle { .. }, Curve::Cubic(_)) | (Curve::Cubic(_), Curve::Circle { .. }) => false,
        };
        one.len() == other.len()
            && one.iter().all(|arc| other.iter().any(|image| is_image(&arc.curve, &image.curve)))
    }

    /// A point after the reflection of one of its coordinates, if any.
    fn image(&self, mut point: [f64; 2], reflected: Option<usize>) -> [f64; 2] {
        if let Some(k) = reflected {
            point[k] = 2.0 * self.at - point[k];
        }
        point
    }

    /// Whether the flat parts of one surface are the images of those of another. Edges determine a flat part,
    /// so that its edges are compared.
    fn maps_surface(&self, one: &TriangleSurface, other: &TriangleSurface) -> bool {
        let (Some(first), Some(second)) = (outlines(one), outlines(other)) else { return false };
        let Some(images) = self.corner_images((one, &first), (other, &second)) else { return false };
        let others: BTreeSet<&Vec<[u32; 2]>> = second.iter().collect();
        first.len() == second.len()
            && first.iter().all(|outline| {
                let mut image: Vec<[u32; 2]> = outline
                    .iter()
                    .map(|e| {
                        let [a, b] = e.map(|p| images[&p]);
                        [a.min(b), a.max(b)]
                    })
                    .collect();
                image.sort_unstable();
                others.contains(&image)
            })
    }

    /// For each corner of the outlines of one surface, the corner of the other surface at its image; `None`
    /// if a corner has no image, or shares it with another corner.
    fn corner_images(
        &self,
        one: (&TriangleSurface, &[Outline]),
        other: (&TriangleSurface, &[Outline]),
    ) -> Option<HashMap<u32, u32>> {
        let corners = |outlines: &[Outline]| -> BTreeSet<u32> {
            outlines.iter().flatten().flatten().copied().collect()
        };
        let cell = 1e3 * self.near;
        let place = |p: [f64; 3]| p.map(|x| (x / cell).floor() as i64);
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for c in corners(other.1) {
            cells.entry(place(other.0.points[c as usize])).or_default().push(c);
        }
        let step = |x: i64, k: i64| x.saturating_add(k - 1);
        let mut taken = BTreeSet::new();
        let mut out = HashMap::new();
        for c in corners(one.1) {
            let mut p = one.0.points[c as usize];
            p[self.axis] = 2.0 * self.at - p[self.axis];
            let same = |q: u32| {
                let q = other.0.points[q as usize];
                (0..3).all(|k| (p[k] - q[k]).abs() <= 4.0 * self.near)
            };
            let [x, y, z] = place(p);
            let image = (0..27)
                .filter_map(|k| cells.get(&[step(x, k % 3), step(y, k / 3 % 3), step(z, k / 9)]))
                .flatten()
                .copied()
                .find(|&q| same(q))?;
            if !taken.insert(image) {
                return None;
            }
            out.insert(c, image);
        }
        Some(out)
    }
}

/// The edges around a flat part of a surface, each with the lower index of its two corners first, sorted.
type Outline = Vec<[u32; 2]>;

/// The outlines of a surface's flat parts; `None` if an edge belongs to more or fewer than two triangles.
fn outlines(surface: &TriangleSurface) -> Option<Vec<Outline>> {
    let parts = flat_parts(surface);
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (t, f) in surface.faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(parts[t]);
        }
    }
    let mut outlines: BTreeMap<usize, Outline> = BTreeMap::new();
    for (edge, sides) in &edges {
        if sides.len() != 2 {
            return None;
        }
        if sides[0] != sides[1] {
            sides.iter().for_each(|&part| outlines.entry(part).or_default().push(*edge));
        }
    }
    Some(outlines.into_values().collect())
}

#[cfg(test)]
mod tests;
