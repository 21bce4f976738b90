//! Tests for contact between a shape and a box.

use crate::outline;
use crate::scene::{Box3, across};
use crate::shapes::{Shape, TriangleSurface};
use crate::winding;

/// Steps of the search for the point of a segment that is nearest to a box. Each leaves two thirds of the
/// segment.
const SEARCH_STEPS: usize = 60;

/// A shape touches a box if their distance is below this share of the largest coordinate of the box, since
/// rounding may separate them. It is not tuned.
const ROUNDING: f64 = 1e-12;

impl Shape {
    /// Whether the closed shape and the closed box share a point. `false` for a group of a mesh, whose cells
    /// only the mesh knows; arcs of an outline count as the sides that replace them.
    pub fn touches_box(&self, region: &Box3) -> bool {
        // Sums of coordinates are rounded; shapes that touch in the file must still touch.
        let slack =
            ROUNDING * region.min.iter().chain(&region.max).fold(0.0, |most: f64, x| most.max(x.abs()));
        let region = &Box3 { min: region.min.map(|x| x - slack), max: region.max.map(|x| x + slack) };
        match self {
            Self::Box(box3) => box3.touches(region),
            Self::Sphere { center, radius } => nearest_distance(region, *center) <= *radius,
            Self::Shell { center, radius } => farthest_distance(region, *center) >= *radius,
            Self::Capsule { from, to, radius } => distance_to_segment(region, [*from, *to]) <= *radius,
            Self::Cylinder { axis, base, radius, height } => {
                let projection = Projection::of(region, *axis);
                projection.meets_slab([base[*axis], base[*axis] + height])
                    && projection.nearest_distance(across(*axis).map(|a| base[a])) <= *radius
            }
            Self::Tube { axis, base, radii: [inner, outer], height } => {
                let (projection, middle) = (Projection::of(region, *axis), across(*axis).map(|a| base[a]));
                projection.meets_slab([base[*axis], base[*axis] + height])
                    && projection.nearest_distance(middle) <= *outer
                    && projection.farthest_distance(middle) >= *inner
            }
            Self::Extrusion { axis, from, to, outline, .. } => {
                let projection = Projection::of(region, *axis);
                projection.meets_slab([from.min(*to), from.max(*to)]) && projection.meets_outline(outline)
            }
            Self::Surface(surface) => surface.touches_box(region),
            Self::Physical(_) => false,
        }
    }
}

impl TriangleSurface {
    /// Whether the space that the surface encloses and the closed box share a point.
    pub fn touches_box(&self, region: &Box3) -> bool {
        let corners = |face: &[u32; 3]| face.map(|p| self.points[p as usize]);
        self.faces.iter().any(|face| meets_triangle(region, corners(face)))
            || winding::contains(self, region.min)
    }

    /// A box, or its image under a map that leaves its faces flat.
    pub fn of_box(region: &Box3, image: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let corner =
            |k: usize| [0, 1, 2].map(|a| if k >> a & 1 == 1 { region.max[a] } else { region.min[a] });
        let points = (0..8).map(|k| image(corner(k))).collect();
        let sides: [[u32; 4]; 6] =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Self { points, faces: sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect() }
    }
}

/// The distance of a box from a point, m; zero for a point in it.
fn nearest_distance(region: &Box3, point: [f64; 3]) -> f64 {
    let beyond = |a: usize| (region.min[a] - point[a]).max(point[a] - region.max[a]).max(0.0);
    (0..3).map(|a| beyond(a).powi(2)).sum::<f64>().sqrt()
}

/// The distance of the farthest point of a box from a point, m.
fn farthest_distance(region: &Box3, point: [f64; 3]) -> f64 {
    let away = |a: usize| (point[a] - region.min[a]).abs().max((region.max[a] - point[a]).abs());
    (0..3).map(|a| away(a).powi(2)).sum::<f64>().sqrt()
}

/// The distance of a box from a segment, m, by ternary search: along the segment, the distance from the box
/// is a convex function.
fn distance_to_segment(region: &Box3, [from, to]: [[f64; 3]; 2]) -> f64 {
    let distance_at =
        |share: f64| nearest_distance(region, [0, 1, 2].map(|a| from[a] + share * (to[a] - from[a])));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..SEARCH_STEPS {
        let third = (high - low) / 3.0;
        if distance_at(low + third) <= distance_at(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    distance_at(0.5 * (low + high)).min(distance_at(0.0)).min(distance_at(1.0))
}

/// A box as an interval along an axis and a rectangle across it, m.
struct Projection {
    /// The ends of the box along the axis.
    ends: [f64; 2],
    /// The lower corner of the rectangle.
    min: [f64; 2],
    /// The upper corner of the rectangle.
    max: [f64; 2],
}

impl Projection {
    /// The box seen along an axis.
    fn of(region: &Box3, axis: usize) -> Self {
        Self {
            ends: [region.min[axis], region.max[axis]],
            min: across(axis).map(|a| region.min[a]),
            max: across(axis).map(|a| region.max[a]),
        }
    }

    /// Whether the box reaches into the slab between two coordinates along the axis.
    fn meets_slab(&self, [low, high]: [f64; 2]) -> bool {
        self.ends[0] <= high && low <= self.ends[1]
    }

    /// The distance of the rectangle from a point, m; zero for a point in it.
    fn nearest_distance(&self, point: [f64; 2]) -> f64 {
        let beyond = |k: usize| (self.min[k] - point[k]).max(point[k] - self.max[k]).max(0.0);
        beyond(0).hypot(beyond(1))
    }

    /// The distance of the farthest point of the rectangle from a point, m.
    fn farthest_distance(&self, point: [f64; 2]) -> f64 {
        let away = |k: usize| (point[k] - self.min[k]).abs().max((self.max[k] - point[k]).abs());
        away(0).hypot(away(1))
    }

    /// Whether the rectangle and a polygon share a point.
    fn meets_outline(&self, outline: &[[f64; 2]]) -> bool {
        let flat = |[x, y]: [f64; 2]| [x, y, 0.0];
        let region = Box3 { min: flat(self.min), max: flat(self.max) };
        let mut sides = outline.iter().zip(outline.iter().cycle().skip(1));
        outline::contains(outline, self.min)
            || sides.any(|(a, b)| meets_triangle(&region, [flat(*a), flat(*b), flat(*b)]))
    }
}

/// Whether a box and a triangle share a point, by clipping the triangle at the faces of the box.
fn meets_triangle(region: &Box3, triangle: [[f64; 3]; 3]) -> bool {
    let mut clipped = triangle.to_vec();
    for a in 0..3 {
        for (sign, end) in [(1.0, region.max[a]), (-1.0, -region.min[a])] {
            let beyond = |p: &[f64; 3]| sign * p[a] - end;
            let corners = std::mem::take(&mut clipped);
            for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let (from, to) = (beyond(p), beyond(q));
                if from <= 0.0 {
                    clipped.push(*p);
                }
                if (from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0) {
                    let share = from / (from - to);
                    let mut cut = [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]));
                    cut[a] = sign * end;
                    clipped.push(cut);
                }
            }
        }
    }
    !clipped.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 0 to 1 along all axes.
    const UNIT: Box3 = Box3 { min: [0.0; 3], max: [1.0; 3] };

    /// Whether a shape touches the box, and whether it still does after a move away by a thousandth.
    fn touches(shape: &Shape, away: [f64; 3]) -> [bool; 2] {
        let moved = shape.moved(away.map(|x| 1e-3 * x)).unwrap();
        [shape, &moved].map(|shape| shape.touches_box(&UNIT))
    }

    #[test]
    fn shapes_touch_a_box_at_a_face_an_edge_and_a_corner_and_not_a_thousandth_away() {
        let slope = 0.5_f64.sqrt();
        let ball = |center| Shape::Sphere { center, radius: 0.5 };
        let beside = ball([1.0 + 0.5 * slope, 1.0 + 0.5 * slope, 0.5]);
        let capsule = Shape::Capsule { from: [1.3, 1.4, -1.0], to: [1.3, 1.4, 2.0], radius: 0.5 };
        let upright = Shape::Cylinder { axis: 1, base: [0.5, 1.0, 0.5], radius: 0.2, height: 1.0 };
        let lying = Shape::Cylinder { axis: 2, base: [1.3, 0.5, -1.0], radius: 0.3, height: 3.0 };
        let ring = Shape::Tube { axis: 2, base: [-1.0, 0.5, 0.2], radii: [0.9, 1.0], height: 0.1 };
        let outline = vec![[2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let wedge = Shape::Extrusion { axis: 0, from: 0.2, to: 0.4, outline, arcs: Vec::new() };
        for (shape, away) in [
            (ball([0.5, 0.5, 1.5]), [0.0, 0.0, 1.0]),
            (beside, [1.0, 1.0, 0.0]),
            (capsule, [1.0, 1.0, 0.0]),
            (upright, [0.0, 1.0, 0.0]),
            (lying, [1.0, 0.0, 0.0]),
            (ring, [-1.0, 0.0, 0.0]),
            (wedge, [0.0, 1.0, 1.0]),
        ] {
            assert_eq!(touches(&shape, away), [true, false], "{shape:?}");
        }
        assert!(Shape::Sphere { center: [0.5; 3], radius: 0.1 }.touches_box(&UNIT), "inside");
        assert!(Shape::Sphere { center: [0.5; 3], radius: 9.0 }.touches_box(&UNIT), "around");
        let hollow = |radius: f64| Shape::Shell { center: [0.5; 3], radius };
        assert_eq!([0.86, 0.87].map(|r| hollow(r).touches_box(&UNIT)), [true, false]);
        let around = Shape::Tube { axis: 1, base: [0.5, 0.0, 0.5], radii: [0.8, 1.0], height: 1.0 };
        assert!(!around.touches_box(&UNIT), "the box stands in its hole");
    }

    #[test]
    fn surfaces_touch_a_box_that_they_cross_hold_or_lie_in() {
        let cube = |center: f64, half: f64| {
            let region = Box3 { min: [center - half; 3], max: [center + half; 3] };
            TriangleSurface::of_box(&region, |x| x)
        };
        for (center, half, expected) in
            [(1.5, 0.5, true), (0.5, 0.1, true), (0.5, 9.0, true), (1.51, 0.5, false), (-1.0, 1.0, true)]
        {
            assert_eq!(cube(center, half).touches_box(&UNIT), expected, "{center} {half}");
        }
        assert!(winding::contains(&cube(0.0, 1.0), [0.5; 3]), "its faces look outwards");
        // A square plate that stands on its corner beside an edge of the box.
        let turned = |gap: f64| {
            let plate = Box3 { min: [0.0, 0.0, 0.4], max: [1.0, 1.0, 0.6] };
            let slope = 0.5_f64.sqrt();
            TriangleSurface::of_box(&plate, |[x, y, z]| {
                [1.0 + gap + slope * (x + y), 0.5 + slope * (y - x), z]
            })
        };
        assert!(turned(0.0).touches_box(&UNIT) && !turned(1e-6).touches_box(&UNIT));
    }
}
