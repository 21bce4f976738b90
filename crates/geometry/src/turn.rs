//! Rotation of a scene about a coordinate axis that makes its planes of symmetry normal to the other axes.
//!
//! A pad with a disc on its diagonal has a mirror plane that is not normal to a coordinate axis. Where only
//! the bodies, and not the walls, distinguish directions across an axis, the scene can first be turned about
//! that axis.

use crate::cubic::Cubic;
use crate::mirror;
use crate::scene::{Body, Box3, Scene, across};
use crate::shapes::{Arc, Curve, Shape};

/// Distances from the middle of a scene that differ by less than this share are the same, and a coordinate of
/// a unit vector below it is zero. Not tuned: it only has to lie above rounding errors and below distances
/// that matter.
const ALIKE: f64 = 1e-10;

/// The largest number of features at the greatest distance from the middle that are tried as mirror images.
/// There are more only where polygons replace circles. It is not tuned.
const MAX_IMAGES: usize = 64;

/// A turn about an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// The axis about which the scene is turned.
    axis: usize,
    /// The cosine of the angle.
    cosine: f64,
    /// The sine of the angle.
    sine: f64,
}

impl Turn {
    /// The image of a point of the plane across the axis, in the two other coordinates in ascending order.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.cosine * x - self.sine * y, self.sine * x + self.cosine * y]
    }

    /// The angle in degrees, between 0 and 180: half a turn more leaves mirror planes where they are.
    pub fn degrees(&self) -> f64 {
        self.sine.atan2(self.cosine).to_degrees().rem_euclid(180.0)
    }

    /// The position of a point before the turn.
    pub fn undone(&self, point: [f64; 3]) -> [f64; 3] {
        let [p, q] = across(self.axis);
        let [x, y] = Self { sine: -self.sine, ..*self }.place([point[p], point[q]]);
        let mut out = point;
        (out[p], out[q]) = (x, y);
        out
    }

    /// A curve of an outline after the turn.
    fn curve(&self, curve: &Curve) -> Curve {
        match curve {
            Curve::Circle { center, radius } => {
                Curve::Circle { center: self.place(*center), radius: *radius }
            }
            Curve::Cubic(Cubic { control }) => {
                Curve::Cubic(Cubic { control: control.map(|p| self.place(p)) })
            }
        }
    }

    /// The scene after the turn; `None` if a body has no [`Shape`] after it, or the scene is bounded across
    /// the axis.
    fn scene(&self, scene: &Scene) -> Option<Scene> {
        let bodies = scene.bodies.iter().map(|body| {
            let parts: Option<Vec<Shape>> = body.parts.iter().map(|part| self.shape(part)).collect();
            Some(Body { parts: parts?, ..body.clone() })
        });
        is_unbounded_across(&scene.domain, self.axis)
            .then(|| Some(Scene { bodies: bodies.collect::<Option<_>>()?, ..scene.clone() }))?
    }

    /// The shape after the turn; `None` if no [`Shape`] describes it.
    fn shape(&self, shape: &Shape) -> Option<Shape> {
        let [p, q] = across(self.axis);
        let moved = |base: &[f64; 3]| {
            let mut out = *base;
            [out[p], out[q]] = self.place([base[p], base[q]]);
            out
        };
        match shape {
            Shape::Box(b) if is_unbounded_across(b, self.axis) => Some(shape.clone()),
            Shape::Box(b) => {
                let corners = corners_across(b, self.axis)?;
                let (from, to) = (b.min[self.axis], b.max[self.axis]);
                let is_sheet = corners[0] == corners[1] || corners[1] == corners[2];
                let outline = corners.map(|corner| self.place(corner)).to_vec();
                (!is_sheet).then_some(Shape::Extrusion {
                    axis: self.axis,
                    from,
                    to,
                    outline,
                    arcs: Vec::new(),
                })
            }
            Shape::Extrusion { axis, from, to, outline, arcs } if *axis == self.axis => {
                let turned = |arc: &Arc| Arc { curve: self.curve(&arc.curve), ..arc.clone() };
                Some(Shape::Extrusion {
                    axis: *axis,
                    from: *from,
                    to: *to,
                    outline: outline.iter().map(|corner| self.place(*corner)).collect(),
                    arcs: arcs.iter().map(turned).collect(),
                })
            }
            Shape::Cylinder { axis, base, radius, height } if *axis == self.axis => {
                Some(Shape::Cylinder { axis: *axis, base: moved(base), radius: *radius, height: *height })
            }
            Shape::Tube { axis, base, radii, height } if *axis == self.axis => {
                Some(Shape::Tube { axis: *axis, base: moved(base), radii: *radii, height: *height })
            }
            Shape::Sphere { .. }
            | Shape::Shell { .. }
            | Shape::Capsule { .. }
            | Shape::Extrusion { .. }
            | Shape::Cylinder { .. }
            | Shape::Tube { .. }
            | Shape::Surface(_)
            | Shape::Physical(_) => None,
        }
    }
}

/// The turn about an axis after which a scene has more mirror planes normal to coordinate axes, with the
/// scene after it; `None` if there is none, or the scene is bounded across the axis.
pub fn to_mirror_planes(scene: &Scene, axis: usize) -> Option<(Turn, Scene)> {
    if !is_unbounded_across(&scene.domain, axis) {
        return None;
    }
    let count_planes = |scene: &Scene| {
        let planes = mirror::planes(scene);
        across(axis).into_iter().filter(|k| planes[*k].is_some()).count()
    };
    let mut most = count_planes(scene);
    let mut best = None;
    for direction in mirror_lines(scene, axis)? {
        if most == 2 {
            break;
        }
        let turn = Turn { axis, cosine: direction[0], sine: -direction[1] };
        let Some(turned) = turn.scene(scene) else { continue };
        let count = count_planes(&turned);
        if count > most {
            (most, best) = (count, Some((turn, turned)));
        }
    }
    best
}

/// Candidate directions, as unit vectors across the axis, of lines about which the scene may be symmetric. In
/// a symmetric scene, the feature that is farthest from the middle of all features is its own mirror image,
/// or that of another feature at the same distance. `None` where a shape has no known features.
fn mirror_lines(scene: &Scene, axis: usize) -> Option<Vec<[f64; 2]>> {
    let mut features = Vec::new();
    for shape in scene.shapes() {
        features.extend(features_of(shape, axis)?);
    }
    let count = features.len() as f64;
    let middle = [0, 1].map(|k| features.iter().map(|f| f[k]).sum::<f64>() / count);
    let from_middle: Vec<[f64; 2]> = features.iter().map(|f| [f[0] - middle[0], f[1] - middle[1]]).collect();
    let distance = |f: &[f64; 2]| f[0].hypot(f[1]);
    let farthest = from_middle.iter().max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let most = distance(farthest);
    let angle = |f: &[f64; 2]| f[1].atan2(f[0]);
    let as_far = from_middle.iter().filter(|f| distance(f) >= (1.0 - ALIKE) * most);
    let lines = as_far.take(MAX_IMAGES).map(|image| {
        let (sine, cosine) = (0.5 * (angle(farthest) + angle(image))).sin_cos();
        [cosine, sine]
    });
    // A scene that is symmetric about a line along a coordinate axis needs no turn.
    Some(lines.filter(|line| line.iter().all(|x| x.abs() > ALIKE)).collect())
}

/// The points that determine the position of a shape across the axis: corners of outlines, and centres of
/// circles. `None` for other shapes.
fn features_of(shape: &Shape, axis: usize) -> Option<Vec<[f64; 2]>> {
    let [p, q] = across(axis);
    match shape {
        Shape::Box(b) if is_unbounded_across(b, axis) => Some(Vec::new()),
        Shape::Box(b) => corners_across(b, axis).map(|corners| corners.to_vec()),
        Shape::Extrusion { axis: a, outline, .. } if *a == axis => Some(outline.clone()),
        Shape::Cylinder { axis: a, base, .. } | Shape::Tube { axis: a, base, .. } if *a == axis => {
            Some(vec![[base[p], base[q]]])
        }
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Extrusion { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => None,
    }
}

/// Whether a box has no end across an axis.
fn is_unbounded_across(b: &Box3, axis: usize) -> bool {
    across(axis).into_iter().all(|k| b.min[k] == f64::NEG_INFINITY && b.max[k] == f64::INFINITY)
}

/// The corners of a box across an axis, one after the other, if they are all finite.
fn corners_across(b: &Box3, axis: usize) -> Option<[[f64; 2]; 4]> {
    let [p, q] = across(axis);
    let corners = [[b.min[p], b.min[q]], [b.max[p], b.min[q]], [b.max[p], b.max[q]], [b.min[p], b.max[q]]];
    corners.as_flattened().iter().all(|x| x.is_finite()).then_some(corners)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Wall;

    fn open(bodies: Vec<Body>) -> Scene {
        Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
    }

    fn pull(name: &str, outline: Vec<[f64; 2]>) -> Body {
        Body::conductor(name, Shape::Extrusion { axis: 1, from: 0.0, to: 0.1, outline, arcs: Vec::new() })
    }

    fn cylinder(name: &str, [x, y]: [f64; 2], radius: f64) -> Body {
        Body::conductor(name, Shape::Cylinder { axis: 1, base: [x, 0.0, y], radius, height: 0.1 })
    }

    fn pad(size: f64) -> Body {
        pull("pad", vec![[0.0, 0.0], [3.0, 0.0], [3.0, size], [1.0, size], [1.0, 3.0], [0.0, 3.0]])
    }

    fn slab() -> Body {
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        let region = Box3 { min: [low, -1.0, low], max: [high, 0.0, high] };
        Body::dielectric("board", Shape::Box(region), 4.5)
    }

    #[test]
    fn a_pad_with_a_disc_on_its_diagonal_is_turned_by_half_a_right_angle() {
        let scene = open(vec![pad(1.0), cylinder("disc", [2.2, 2.2], 0.8), slab()]);
        let (turn, turned) = to_mirror_planes(&scene, 1).unwrap();
        let planes = mirror::planes(&turned);
        assert_eq!(planes.iter().filter(|plane| plane.is_some()).count(), 1);
        assert!((turn.cosine.abs() - 0.5_f64.sqrt()).abs() < 1e-12, "{turn:?}");
        let Shape::Cylinder { base, .. } = turned.bodies[1].parts[0] else { panic!() };
        let back = turn.undone(base);
        assert!((0..3).all(|k| (back[k] - [2.2, 0.0, 2.2][k]).abs() < 1e-14), "{back:?}");
        assert_eq!(turned.bodies[2], scene.bodies[2]);
    }

    #[test]
    fn two_discs_in_any_direction_from_each_other_get_two_mirror_planes() {
        for angle in [0.3_f64, 1.1, 2.0, 2.9] {
            let scene = open(vec![
                cylinder("a", [0.7, -0.4], 1.0),
                cylinder("b", [0.7 + 3.0 * angle.cos(), -0.4 + 3.0 * angle.sin()], 1.0),
            ]);
            let (_, turned) = to_mirror_planes(&scene, 1).unwrap();
            let planes = mirror::planes(&turned);
            assert!(planes[0].is_some() && planes[2].is_some(), "{angle}");
        }
    }

    #[test]
    fn what_has_no_mirror_plane_or_needs_no_turn_stays() {
        let disc = || cylinder("disc", [2.2, 2.2], 0.8);
        assert!(to_mirror_planes(&open(vec![pad(1.1), disc()]), 1).is_none());
        assert!(to_mirror_planes(&open(vec![pad(1.0), cylinder("disc", [2.3, 2.2], 0.8)]), 1).is_none());
        assert!(to_mirror_planes(&open(vec![disc()]), 1).is_none());
        assert!(to_mirror_planes(&open(vec![pad(1.0), disc()]), 0).is_none(), "pulled along another axis");
        let square = Box3 { min: [0.0; 3], max: [1.0, 0.1, 1.0] };
        let boxes = open(vec![Body::conductor("square", Shape::Box(square))]);
        assert!(to_mirror_planes(&boxes, 1).is_none(), "it has two planes as it is");
        let mut walled = open(vec![pad(1.0), disc()]);
        (walled.domain.min[0], walled.walls[0][0]) = (-5.0, Wall::Insulated);
        assert!(to_mirror_planes(&walled, 1).is_none());
    }
}
