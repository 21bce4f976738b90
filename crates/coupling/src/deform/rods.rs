//! Rods: distances across bodies in a layer, and between neighbouring conductors, whose errors estimate the
//! error of capacitances.
//!
//! A rod joins two material points. The relative error of its length is about that of capacitances, since
//! both scale with the ratios of such distances. A displacement that the bodies have in common changes
//! neither.

use elastocap_case::{Case, Terminal};
use elastocap_geometry::scene::{Body, Box3, Purpose};

use super::Displacement;
use super::material::Material;

/// Positions of the rods to a neighbour, over the length on which the two face each other. It is not tuned.
const PLACES: [f64; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// Two material points before loading, m.
type Rod = [[f64; 3]; 2];

/// The rods of a case: of bodies that move with its layer.
#[derive(Debug, Default)]
pub(crate) struct Rods {
    /// From a body to the next conductor.
    gaps: Vec<Rod>,
    /// Across a body.
    extents: Vec<Rod>,
}

impl Rods {
    /// The rods of a case; empty if only a pair is in the layer.
    pub(crate) fn of(case: &Case) -> Self {
        let in_layer = |body: &&Body| body.purpose == Purpose::InLayer;
        let mut out = Self::default();
        // Conductors to which a gap may lead: those in the layer, and those below it.
        let boxes = |body: &Body| body.boxes().unwrap_or_default();
        let mut conductors: Vec<(&str, Vec<Box3>)> = Vec::new();
        if let Some(pair) = &case.electrodes {
            conductors.extend(pair.names().into_iter().zip(pair.regions().map(|region| vec![region])));
        }
        let is_below = |region: &Box3| region.max[1] <= 0.0;
        for body in case.bodies.iter().filter(|body| body.is_conductor()) {
            let regions = boxes(body);
            if in_layer(&body) || regions.iter().all(is_below) {
                conductors.push((&body.name, regions));
            }
        }
        let one_wire = |first: &str, second: &str| {
            first == second || case.terminals.iter().any(|t: &Terminal| t.holds(first) && t.holds(second))
        };
        for body in case.bodies.iter().filter(in_layer) {
            let others = conductors.iter().filter(|(name, _)| !one_wire(name, &body.name));
            let others: Vec<&Box3> = others.flat_map(|(_, regions)| regions).collect();
            for region in boxes(body) {
                out.across(&region);
                let nearest =
                    others.iter().min_by(|a, b| distance(&region, a).total_cmp(&distance(&region, b)));
                if let Some(other) = nearest.filter(|other| distance(&region, other) > 0.0) {
                    out.between(&region, other);
                }
            }
        }
        out
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count() == 0
    }

    pub(crate) fn count(&self) -> usize {
        self.gaps.len() + self.extents.len()
    }

    fn across(&mut self, region: &Box3) {
        for axis in (0..3).filter(|&a| region.extent(a) > 0.0 && region.extent(a).is_finite()) {
            let mut ends = [[0, 1, 2].map(|a| middle(region.min[a], region.max[a])); 2];
            (ends[0][axis], ends[1][axis]) = (region.min[axis], region.max[axis]);
            self.extents.push(ends);
        }
    }

    fn between(&mut self, region: &Box3, other: &Box3) {
        let facing = |a: usize| [region.min[a].max(other.min[a]), region.max[a].min(other.max[a])];
        let places = [0, 1, 2].map(|a| {
            let [low, high] = facing(a);
            match low <= high {
                true => PLACES.map(|t| [low + t * (high - low); 2]).to_vec(),
                // The two do not overlap on this axis: their facing faces.
                false if region.max[a] < other.min[a] => vec![[region.max[a], other.min[a]]],
                false => vec![[region.min[a], other.max[a]]],
            }
        });
        for x in &places[0] {
            for y in &places[1] {
                for z in &places[2] {
                    self.gaps.push([0, 1].map(|end| [x[end], y[end], z[end]]));
                }
            }
        }
    }

    /// The lengths of the rods, m, in the layer of a case with this displacement, of which half is solved or
    /// the whole; empty for a layer without finite elements.
    pub(crate) fn lengths_under(
        &self,
        case: &Case,
        is_half: bool,
        displacement: &Displacement<'_>,
    ) -> Vec<f64> {
        let solved = |x: [f64; 3]| displacement.at(x);
        let Some(material) = Material::of(case, is_half, &solved) else { return Vec::new() };
        self.lengths(&|x| {
            let u = material.displacement(x);
            [0, 1, 2].map(|a| x[a] + u[a])
        })
    }

    /// The lengths of the rods, m, with these positions of material points: gaps first, then extents.
    pub(crate) fn lengths(&self, position: &dyn Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
        let length = |rod: &Rod| {
            let [from, to] = rod.map(position);
            (0..3).map(|a| (to[a] - from[a]).powi(2)).sum::<f64>().sqrt()
        };
        self.gaps.iter().chain(&self.extents).map(length).collect()
    }

    /// The ends of all rods before loading, m.
    pub(crate) fn ends(&self) -> Vec<[f64; 3]> {
        self.gaps.iter().chain(&self.extents).flatten().copied().collect()
    }

    /// The mean stretch of the gaps and that of the extents, where [`Rods::ends`] are displaced by `moved`,
    /// m. Empty without rods.
    pub(crate) fn mean_stretches(&self, moved: &[[f64; 3]]) -> Vec<f64> {
        let (of_gaps, of_extents) = moved.split_at(2 * self.gaps.len());
        let mean = |rods: &[Rod], moved: &[[f64; 3]]| {
            let stretch = |(rod, moved): (&Rod, &[[f64; 3]])| {
                let rest = [0, 1, 2].map(|a| rod[1][a] - rod[0][a]);
                let now = [0, 1, 2].map(|a| rest[a] + moved[1][a] - moved[0][a]);
                let [rest, now] = [rest, now].map(|d| d.iter().map(|x| x * x).sum::<f64>().sqrt());
                now / rest
            };
            rods.iter().zip(moved.chunks_exact(2)).map(stretch).sum::<f64>() / rods.len() as f64
        };
        let groups = [(&self.gaps, of_gaps), (&self.extents, of_extents)];
        groups
            .into_iter()
            .filter(|(rods, _)| !rods.is_empty())
            .map(|(rods, moved)| mean(rods, moved))
            .collect()
    }

    /// The larger of the two root mean squares, over gaps and over extents, of relative errors in the order
    /// of [`Rods::lengths`].
    pub(crate) fn error(&self, relative: impl Iterator<Item = f64>) -> f64 {
        let (mut sums, count) = ([0.0; 2], [self.gaps.len(), self.extents.len()]);
        for (k, error) in relative.enumerate() {
            sums[usize::from(k >= self.gaps.len())] += error * error;
        }
        [0, 1].map(|k| (sums[k] / count[k].max(1) as f64).sqrt()).into_iter().fold(0.0, f64::max)
    }
}

fn distance(a: &Box3, b: &Box3) -> f64 {
    let along = |k: usize| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0);
    (0..3).map(|k| along(k).powi(2)).sum::<f64>().sqrt()
}

/// The middle between two coordinates, either of which may be infinite.
fn middle(low: f64, high: f64) -> f64 {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => 0.5 * (low + high),
        (true, false) => low,
        (false, true) => high,
        (false, false) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(min: [f64; 3], max: [f64; 3]) -> Box3 {
        Box3 { min, max }
    }

    #[test]
    fn a_gap_is_measured_where_two_boxes_face_each_other() {
        let mut rods = Rods::default();
        rods.between(&region([0.0; 3], [1.0, 1.0, 2.0]), &region([3.0, 0.5, 0.0], [4.0, 2.0, 1.0]));
        assert_eq!(rods.gaps.len(), 9);
        assert!(rods.lengths(&|x| x).iter().all(|length| *length == 2.0));
        for [from, to] in rods.gaps {
            assert_eq!((from[0], to[0]), (1.0, 3.0));
            assert!(from[1] > 0.5 && from[1] < 1.0 && from[2] < 1.0);
        }
    }

    #[test]
    fn a_common_displacement_leaves_lengths_and_a_stretch_of_one_axis_changes_them() {
        let mut rods = Rods::default();
        rods.across(&region([0.0; 3], [1.0, 2.0, f64::INFINITY]));
        assert_eq!(rods.lengths(&|x| x.map(|x| x + 5.0)), [1.0, 2.0]);
        assert_eq!(rods.lengths(&|x| [x[0], 1.1 * x[1], x[2]]), [1.0, 2.2]);
        let error = rods.error([0.0, 0.1].into_iter());
        assert!((error - 0.1 / 2.0_f64.sqrt()).abs() < 1e-15, "{error}");
    }
}
