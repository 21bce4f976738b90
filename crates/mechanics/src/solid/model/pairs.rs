//! The points of a body that may touch an obstacle; the contact module has their equations.

use super::body::Body;
use crate::solid::dimension::Dimension;
use crate::solid::hanging::add;
use crate::solid::obstacle::SIDE_POINTS;

/// A point of the surface that may touch an obstacle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pair<S: Dimension> {
    /// The index of the obstacle.
    pub(crate) obstacle: usize,
    /// The displacements on which the place of the point relative to the obstacle depends: the number of
    /// each, its axis and its factor.
    pub(crate) slots: Vec<(usize, usize, f64)>,
    /// Reference position of the point in m; along `x1` relative to the carrier of the obstacle, if it has
    /// one.
    pub(crate) reference: S::Point,
    /// Surface that belongs to the point: area in m^2, in the plane length in m.
    pub(crate) weight: f64,
    /// Size of the side that it lies on, in m.
    pub(crate) size: f64,
}

/// The linearisation of the condition `g l = w s` of a pair for a step.
///
/// `Smoothed` is Newton's method for the function of Chen, Harker, Kanzow and Smale,
/// `g + l/r - sqrt((g - l/r)^2 + 4 w s/r) = 0`, which has the same solutions and takes any signs: its linear
/// form is the tangent of the curve `g l = w s` at the point of the curve with the same `g - l/r`. The
/// stiffness `r` is that of the surface under a force on one point: that of the rubber around it, or that of
/// the last tangent where that is larger, because points around it touch as well.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Linearisation {
    /// Linear about the gap and the force of the pair, both of them positive.
    Interior,
    /// Linear about the gap and the force of the pair where both are positive, and otherwise about the point
    /// of the curve with the same `g - l/r`. Holds the slopes of the last tangents in N/m, or none before the
    /// first step.
    Smoothed(Vec<f64>),
}

impl<S: Dimension> Pair<S> {
    /// All pairs of `body`, obstacle after obstacle.
    pub(super) fn all(body: &Body<S>) -> Vec<Self> {
        let mut pairs = Vec::new();
        for (o, obstacle) in body.obstacles.iter().enumerate() {
            for side in &obstacle.sides {
                let points = body.mesh.side_points(side, SIDE_POINTS);
                let surface: f64 = points.iter().map(|point| point.weight).sum();
                let size = surface.powf(1.0 / (S::AXES - 1) as f64);
                for point in points {
                    let mut reference = point.position;
                    let mut parts: Vec<(u32, f64)> = Vec::with_capacity(point.shape.len());
                    for (&n, &value) in side.nodes.as_ref().iter().zip(&point.shape) {
                        match body.mesh.hanging.nodes.get(&n) {
                            Some(masters) => {
                                masters.iter().for_each(|&(m, part)| add(&mut parts, m, part * value))
                            }
                            None => add(&mut parts, n, value),
                        }
                    }
                    let mut slots = Vec::with_capacity(S::AXES * parts.len() + 1);
                    for (n, value) in parts {
                        slots.extend((0..S::AXES).map(|k| (S::AXES * n as usize + k, k, value)));
                    }
                    if let Some(n) = obstacle.carrier {
                        reference[0] -= body.mesh.nodes[n as usize][0];
                        slots.push((S::AXES * n as usize, 0, -1.0));
                    }
                    pairs.push(Self { obstacle: o, slots, reference, weight: point.weight, size });
                }
            }
        }
        pairs
    }

    /// The displacements that the pair couples.
    pub(super) fn displacements(&self) -> impl Iterator<Item = usize> {
        self.slots.iter().map(|slot| slot.0)
    }
}
