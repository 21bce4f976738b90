//! Checks that a computed equilibrium is one that a layer can be in.
//!
//! A state can satisfy the discrete equations and still be unphysical: the surface may have passed through a
//! corner of the indenter, may have folded onto itself or shrunk to a point, and the pressures may be far
//! beyond those of the load. Every state is checked before its force is used; a state with a fault counts as
//! not reached.
//!
//! Effects that a model neglects on purpose are not faults: a held patch is not a punch, spreads, and crowds
//! towards its edge; a free end without a substrate may pass through itself (see [`folds`](super::folds)).

use super::dimension::{Dimension, Numbers};
use super::layer::{Indenter, LayerModel};
use super::obstacle::ObstacleShape;
use super::side::Side;

/// The largest accepted depth of the surface inside an indenter or the substrate, over the thickness of the
/// layer. Tuned: `benches/layer_errors.py`.
const DEPTH: f64 = 2e-3;
/// The least and the largest stretch of a side of the surface. Not tuned: limits that ordinary cases do not
/// reach.
const STRETCHES: [f64; 2] = [5e-3, 200.0];
/// The largest accepted pressure in the layer, over the sum of the shear modulus and the force on an area as
/// wide as the layer is thick. Not tuned: a limit that ordinary cases do not reach.
const PRESSURE: f64 = 1000.0;
/// The least distance between successive points of the surface, over the thickness, for the line between them
/// to count as a direction of the surface. It is not tuned.
const APART: f64 = 1e-3;
/// The number of points, along each direction of a side of the surface, that are checked. They are not the
/// points of the contact conditions. It is not tuned.
const POINTS: usize = 5;

/// The reason why an equilibrium is not one of a layer under its indenter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StateFault {
    /// The surface is inside a rigid body.
    #[error("the surface lies {depth:.2e} m inside the indenter or the substrate at x1 = {x1:.3e} m")]
    Penetration {
        /// Depth in m.
        depth: f64,
        /// `x1` of the place after loading, in m.
        x1: f64,
    },
    /// The surface crosses itself.
    #[error("the surface of the layer crosses itself at x1 = {x1:.3e} m")]
    Fold {
        /// `x1` of the place after loading, in m.
        x1: f64,
    },
    /// A side of the surface has shrunk to nothing, or is stretched without bounds.
    #[error("the surface of the layer is stretched by a factor of {stretch:.2e} at x1 = {x1:.3e} m")]
    Stretch {
        /// Length after loading over the length at rest.
        stretch: f64,
        /// `x1` of the place after loading, in m.
        x1: f64,
    },
    /// A pressure far beyond that of the load.
    #[error(
        "the pressure in the layer reaches {pressure:.2e} Pa, where the load explains {explained:.2e} Pa"
    )]
    Pressure {
        /// The largest magnitude of the pressure in Pa.
        pressure: f64,
        /// The sum of the shear modulus and the force over the thickness (in space, over its square), in Pa.
        explained: f64,
    },
}

impl<S: Dimension> LayerModel<S> {
    /// The first fault that the last equilibrium has, if it has any. `force` is that of the indenter on the
    /// whole layer in N, in the plane in N/m.
    pub fn fault(&self, force: f64) -> Option<StateFault> {
        self.penetration_fault().or_else(|| self.surface_fault()).or_else(|| self.pressure_fault(force))
    }

    /// The position after loading of the point of a side with the given values of the shape functions.
    fn place(&self, side: &Side<S>, shape: &[f64]) -> S::Point {
        let nodes = &self.equations().body().mesh.nodes;
        let u = &self.state().displacement;
        let coordinate = |n: usize, k: usize| nodes[n][k] + u[S::AXES * n + k];
        S::Point::from_fn(|k| {
            side.nodes.as_ref().iter().zip(shape).map(|(&n, s)| s * coordinate(n as usize, k)).sum()
        })
    }

    /// The deepest penetration of the surface into a rigid body, if it is too deep.
    fn penetration_fault(&self) -> Option<StateFault> {
        let body = self.equations().body();
        let mut deepest = (0.0, 0.0);
        let mut note = |depth: f64, x1: f64| {
            if depth > deepest.0 {
                deepest = (depth, x1);
            }
        };
        for (obstacle, shift) in body.obstacles.iter().zip(&self.state().shift) {
            // An obstacle that is carried by a node of the surface is not a separate body.
            if obstacle.carrier.is_some() {
                continue;
            }
            // The corners that the surface slides around may be rounder than those of the requested indenter.
            let shape = match (obstacle.shape, self.indenter) {
                (ObstacleShape::Indenter(_), Indenter::Smooth(profile)) => ObstacleShape::Indenter(profile),
                (shape, _) => shape,
            };
            for side in &obstacle.sides {
                for point in body.mesh.side_points(side, POINTS) {
                    let place = self.place(side, &point.shape);
                    let y = S::Point::from_fn(|k| place[k] - shift[k]);
                    note(-shape.gap(S::in_space(&y)).distance, place[0]);
                }
            }
        }
        // The surface that is bonded to the face of a punch has prescribed positions; the rest may not be
        // behind the face.
        let punch = match self.indenter {
            Indenter::Bonded { half_width } => Some(half_width),
            Indenter::WholeTop | Indenter::Held { .. } | Indenter::Smooth(_) => None,
        };
        if let Some(half_width) = punch {
            let face = self.thickness * (1.0 - self.compression());
            for side in self.top_sides() {
                for point in body.mesh.side_points(&side, POINTS) {
                    let place = self.place(&side, &point.shape);
                    note((half_width - place[0].abs()).min(place[1] - face), place[0]);
                }
            }
        }
        let (depth, x1) = deepest;
        (depth > DEPTH * self.thickness).then_some(StateFault::Penetration { depth, x1 })
    }

    /// The sides of elements at the top of the layer.
    fn top_sides(&self) -> Vec<Side<S>> {
        let top = self.thickness * (1.0 - 1e-9);
        self.equations().body().mesh.boundary_where(|x| x[1] > top)
    }

    /// A side of the top that is stretched too much or too little or, in the plane, a place where the top
    /// crosses itself.
    fn surface_fault(&self) -> Option<StateFault> {
        let body = self.equations().body();
        let mut sides = self.top_sides();
        let middle = |side: &Side<S>| {
            let nodes = side.nodes.as_ref();
            body.mesh.nodes[nodes[nodes.len() / 2] as usize][0]
        };
        sides.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
        let (nodes, u) = (&body.mesh.nodes, &self.state().displacement);
        let place_after = |n: usize| S::Point::from_fn(|k| nodes[n][k] + u[S::AXES * n + k]);
        for side in &sides {
            let corners: Vec<usize> =
                S::SIDE_CORNERS.iter().map(|&k| side.nodes.as_ref()[k] as usize).collect();
            let pairs = || corners.iter().flat_map(|&a| corners.iter().map(move |&b| [a, b]));
            let ratio = |[a, b]: [usize; 2]| {
                distance::<S>(place_after(a), place_after(b)) / distance::<S>(nodes[a], nodes[b])
            };
            let stretch = pairs().filter(|[a, b]| a < b).map(ratio).fold(0.0, f64::max);
            // The points of a held patch crowd towards its edge, and are kept from passing it.
            let least = if matches!(self.indenter, Indenter::Held { .. }) { 0.0 } else { STRETCHES[0] };
            if !(least..=STRETCHES[1]).contains(&stretch) {
                return Some(StateFault::Stretch { stretch, x1: place_after(corners[0])[0] });
            }
        }
        if S::AXES > 2 {
            return None;
        }
        let mut curve: Vec<[f64; 2]> = Vec::with_capacity(POINTS * sides.len());
        for side in &sides {
            let mut points: Vec<(f64, [f64; 3])> = body
                .mesh
                .side_points(side, POINTS)
                .iter()
                .map(|point| (point.position[0], S::in_space(&self.place(side, &point.shape))))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, [x, y, _]) in points {
                let is_apart = |last: &[f64; 2]| (x - last[0]).hypot(y - last[1]) > APART * self.thickness;
                // Coincident points do not define a direction.
                if curve.last().is_none_or(is_apart) {
                    curve.push([x, y]);
                }
            }
        }
        crossing(&curve).map(|x1| StateFault::Fold { x1 })
    }

    /// The largest pressure in the rubber of the layer, if it is too large for the `force`.
    fn pressure_fault(&self, force: f64) -> Option<StateFault> {
        let equations = self.equations();
        let body = equations.body();
        let per_area = self.thickness.powi(S::AXES as i32 - 1);
        let explained = equations.modulus + force.abs() / per_area;
        let of_layer = self.state().pressure.iter().zip(&body.material).filter(|(_, m)| **m == 0);
        let larger = |m: f64, p: f64| if p.is_nan() || p > m { p } else { m };
        let pressure = of_layer.map(|(p, _)| p[0].abs()).fold(0.0, larger);
        (pressure.is_nan() || pressure > PRESSURE * explained)
            .then_some(StateFault::Pressure { pressure, explained })
    }
}

/// The distance between two points, m.
fn distance<S: Dimension>(a: S::Point, b: S::Point) -> f64 {
    (0..S::AXES).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// `x1` of a place where the polyline `curve` crosses itself or turns back on itself, if there is one.
fn crossing(curve: &[[f64; 2]]) -> Option<f64> {
    let segments: Vec<[[f64; 2]; 2]> = curve.windows(2).map(|w| [w[0], w[1]]).collect();
    let direction = |[a, b]: &[[f64; 2]; 2]| [b[0] - a[0], b[1] - a[1]];
    for pair in segments.windows(2) {
        let [a, b] = [direction(&pair[0]), direction(&pair[1])];
        if a[0] * b[0] + a[1] * b[1] < TURNS_BACK * a[0].hypot(a[1]) * b[0].hypot(b[1]) {
            return Some(pair[0][1][0]);
        }
    }
    // Only segments that overlap along x1 can cross: they are compared in the order of their lower ends.
    let ends = |[a, b]: &[[f64; 2]; 2], k: usize| (a[k].min(b[k]), a[k].max(b[k]));
    let mut order: Vec<usize> = (0..segments.len()).collect();
    order.sort_by(|&a, &b| ends(&segments[a], 0).0.total_cmp(&ends(&segments[b], 0).0));
    for (k, &first) in order.iter().enumerate() {
        let (_, last) = ends(&segments[first], 0);
        let (low, high) = ends(&segments[first], 1);
        for &second in order[k + 1..].iter().take_while(|&&s| ends(&segments[s], 0).0 <= last) {
            let (from, to) = ends(&segments[second], 1);
            if from <= high && low <= to && cross(&segments[first], &segments[second]) {
                return Some(segments[first][0][0]);
            }
        }
    }
    None
}

/// A surface turns back on itself where the cosine of the angle between successive segments is below this.
/// Not tuned: a limit that ordinary cases do not reach.
const TURNS_BACK: f64 = -0.95;

/// Whether the insides of two segments cross at a point.
fn cross(one: &[[f64; 2]; 2], other: &[[f64; 2]; 2]) -> bool {
    let side =
        |[a, b]: &[[f64; 2]; 2], p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let parts = |a: &[[f64; 2]; 2], b: &[[f64; 2]; 2]| side(a, &b[0]) * side(a, &b[1]) < 0.0;
    parts(one, other) && parts(other, one)
}

#[cfg(test)]
mod tests {
    use super::super::layer::{End, LayerMesh};
    use super::super::newton::NewtonSettings;
    use super::super::obstacle::IndenterProfile;
    use super::super::plane::press::PlaneLayer;
    use super::super::press::{Goal, PressError, Refinement};
    use super::*;
    use elastocap_materials::Rubber;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn a_curve_that_loops_crosses_itself_and_one_that_turns_a_corner_does_not() {
        let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.1, 1.5], [3.0, 1.5]];
        assert_eq!(crossing(&corner), None);
        let overhang = [[0.0, 0.0], [1.0, 0.0], [0.8, 1.0], [3.0, 1.5]];
        assert_eq!(crossing(&overhang), None);
        let falls_through = [[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [0.6, 0.5], [0.7, -1.0], [3.0, 1.5]];
        assert!(crossing(&falls_through).is_some());
        assert!(crossing(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [2.0, 0.0]]).is_some());
    }

    fn pressed(indenter: Indenter) -> LayerModel {
        let mesh = LayerMesh::uniform(1.0, 4.0, 6, 0.8, 4);
        let mut model = LayerModel::new(&mesh, Rubber::neo_hookean(1.0), indenter, End::Far).unwrap();
        model.press(0.1, &NewtonSettings::default()).unwrap();
        model
    }

    #[test]
    fn states_that_were_tampered_with_are_found() {
        let mut model = pressed(Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 }));
        assert_eq!(model.fault(1.0), None);
        let node = model.equations().body().mesh.nearest_node([0.2, 1.0]);
        let sound = model.state().displacement.clone();
        model.state.displacement[2 * node + 1] += 0.1;
        assert!(matches!(model.fault(1.0), Some(StateFault::Penetration { depth, .. }) if depth > 0.05));
        model.state.displacement.clone_from(&sound);
        let corner = model.equations().body().mesh.nearest_node([3.0, 1.0]);
        model.state.displacement[2 * corner] -= 0.45;
        assert!(matches!(model.fault(1.0), Some(StateFault::Fold { .. } | StateFault::Stretch { .. })));
        model.state.displacement.clone_from(&sound);
        model.state.pressure[7][0] = 1e5;
        assert!(matches!(model.fault(1.0), Some(StateFault::Pressure { .. })));
        model.state.pressure[7][0] = f64::NAN;
        assert!(matches!(model.fault(1.0), Some(StateFault::Pressure { .. })));
    }

    #[test]
    fn a_patch_that_spreads_beyond_a_sharp_punch_would_be_found_inside_it() {
        // Under a held patch as wide as a sharp punch, points beside the patch are inside the punch.
        let half_width = 1.0;
        let layer = PlaneLayer {
            thickness: 1.0,
            half_length: 4.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: Indenter::Held { half_width },
            position: 0.0,
            end: End::Free,
        };
        let refinement = Refinement::to(3e-2);
        let goals = [Goal::Compression(0.1)];
        let found = layer.press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap();
        let held = &found.levels.last().unwrap().model;
        assert_eq!(held.fault(1.0), None, "a patch is not a punch");
        // The same state under a punch half as wide again: the surface beside the patch is inside it.
        let last = found.levels.into_iter().next_back().and_then(Arc::into_inner);
        let mut punch = last.unwrap().model;
        punch.indenter = Indenter::Bonded { half_width: 1.5 };
        assert!(matches!(punch.fault(1.0), Some(StateFault::Penetration { depth, .. }) if depth > 0.05));
    }

    #[test]
    fn a_load_whose_every_state_has_a_fault_is_refused_with_the_reason() {
        let fault = StateFault::Fold { x1: 1.0 };
        let text = PressError::Unsound { compression: 0.2, fault }.to_string();
        assert!(text.contains("crosses itself") && text.contains("0.2"), "{text}");
    }
}
