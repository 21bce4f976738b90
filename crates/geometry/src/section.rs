//! The choice of planes for sections through the conductors of a scene.

use crate::scene::Box3;

/// The distance between a section and its nominal place, as a share of the conductors' extent: meshes that
/// are mirrored in the middle of the conductors have faces there, and a section must not coincide with faces.
/// It is not tuned.
const BESIDE: f64 = 1.3e-4;

/// A plane through the conductors, at right angles to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionPlane {
    /// The axis, 0 to 2.
    pub axis: usize,
    /// The nominal place of the plane along the axis, m: the middle of the conductors, or another place that
    /// the section is to show.
    pub middle: f64,
    /// The extent of the conductors along the axis, m.
    pub extent: f64,
}

impl SectionPlane {
    /// The plane through the middle of some conductors that shows most of them. It is at right angles to x3,
    /// or to x1 where the conductors lie beside each other along x3 alone, or have no extent along x3.
    /// `parts` are the bounds of the parts of the conductors, each with a key of its conductor. `None` where
    /// the conductors have no extent along the axis of the plane, or an infinite one.
    pub fn through<K: PartialEq>(parts: &[(K, Box3)]) -> Option<Self> {
        let bounds_of_all = parts.iter().map(|(_, bounds)| *bounds).reduce(|a, b| a.union(&b))?;
        let apart = |a: usize| {
            let pairs = parts.iter().flat_map(|p| parts.iter().map(move |q| (p, q)));
            pairs.filter(|(p, q)| p.0 != q.0).any(|(p, q)| p.1.max[a] < q.1.min[a])
        };
        let across_x1 = bounds_of_all.extent(2) == 0.0 || (apart(2) && !apart(0) && !apart(1));
        let axis = if across_x1 { 0 } else { 2 };
        let extent = bounds_of_all.extent(axis);
        let middle = 0.5 * (bounds_of_all.min[axis] + bounds_of_all.max[axis]);
        (extent > 0.0 && extent.is_finite()).then_some(Self { axis, middle, extent })
    }

    /// The planes that show a scene which is loaded around a place, [x1, x3] in m. The first goes through
    /// that place, at right angles to the same axis as [`SectionPlane::through`]. Where it misses more than
    /// half of the conductors, a second plane cuts as many as possible. Without a load, the plane of
    /// [`SectionPlane::through`] is the only one.
    pub fn of_scene<K: PartialEq>(parts: &[(K, Box3)], load: Option<[f64; 2]>) -> Vec<Self> {
        let Some(usual) = Self::through(parts) else { return Vec::new() };
        let Some([x1, x3]) = load else { return vec![usual] };
        let at_load = Self { middle: if usual.axis == 0 { x1 } else { x3 }, ..usual };
        // A conductor is identified by the number of its first part.
        let first = |key: &K| parts.iter().position(|(other, _)| other == key);
        let numbered: Vec<(usize, &Box3)> =
            parts.iter().filter_map(|(key, bounds)| Some((first(key)?, bounds))).collect();
        let conductors_cut = |plane: &Self| {
            let mut is_cut = vec![false; parts.len()];
            for (conductor, _) in numbered.iter().filter(|(_, bounds)| plane.cuts(bounds)) {
                is_cut[*conductor] = true;
            }
            is_cut.into_iter().filter(|is_cut| *is_cut).count()
        };
        let conductors = numbered.iter().enumerate().filter(|(k, (conductor, _))| k == conductor).count();
        let cut_at_load = conductors_cut(&at_load);
        if 2 * cut_at_load >= conductors {
            return vec![at_load];
        }
        let mut ends: Vec<f64> =
            parts.iter().flat_map(|(_, bounds)| [bounds.min[usual.axis], bounds.max[usual.axis]]).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let candidates = ends.windows(2).map(|pair| Self { middle: 0.5 * (pair[0] + pair[1]), ..usual });
        let from_load = |plane: &Self| (plane.middle - at_load.middle).abs();
        let best = candidates
            .map(|plane| (conductors_cut(&plane), plane))
            .max_by(|a, b| a.0.cmp(&b.0).then(from_load(&b.1).total_cmp(&from_load(&a.1))));
        let second = best.filter(|(cut, _)| *cut > cut_at_load).map(|(_, plane)| plane);
        std::iter::once(at_load).chain(second).collect()
    }

    /// Whether the plane cuts a body with these bounds.
    pub fn cuts(&self, bounds: &Box3) -> bool {
        bounds.min[self.axis] <= self.at() && self.at() <= bounds.max[self.axis]
    }

    /// The coordinate of the cut along the axis, m.
    pub fn at(&self) -> f64 {
        self.middle + BESIDE * self.extent
    }

    /// The ends of a thin slab around the cut, m. Its lower end is the nominal place, where grids of mirrored
    /// scenes have a plane.
    pub fn slab(&self) -> [f64; 2] {
        [self.middle, self.middle + 2.0 * BESIDE * self.extent]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(min: [f64; 3]) -> Box3 {
        Box3 { min, max: min.map(|x| x + 1.0) }
    }

    #[test]
    fn a_section_lies_across_x3_unless_conductors_stand_beside_each_other_along_it_alone() {
        let found = SectionPlane::through(&[("a", cube([0.0; 3])), ("b", cube([2.0, 0.0, 0.0]))]).unwrap();
        assert_eq!((found.axis, found.middle, found.extent), (2, 0.5, 1.0));
        let [low, high] = found.slab();
        assert!(low < found.at() && found.at() < high && high < low + 1e-3);
        let beside = [("a", cube([0.0; 3])), ("b", cube([0.0, 0.0, 2.0]))];
        assert_eq!(SectionPlane::through(&beside).map(|found| found.axis), Some(0));
        // Parts of one conductor do not stand beside each other.
        let parts = [("a", cube([0.0; 3])), ("a", cube([0.0, 0.0, 2.0]))];
        assert_eq!(SectionPlane::through(&parts).map(|found| (found.axis, found.middle)), Some((2, 1.5)));
    }

    #[test]
    fn a_section_of_a_loaded_scene_goes_through_the_load_and_a_second_one_where_the_electrodes_are() {
        // Four cubes beside each other along x1, two of them farther along x3.
        let rows = [[0.0; 3], [2.0, 0.0, 0.0], [4.0, 0.0, 3.0], [6.0, 0.0, 3.0]].map(cube);
        let parts: Vec<(usize, Box3)> = rows.into_iter().enumerate().collect();
        let middles = |load| -> Vec<f64> {
            SectionPlane::of_scene(&parts, load).iter().map(|plane| plane.middle).collect()
        };
        assert_eq!(middles(None), [2.0]);
        assert_eq!(middles(Some([9.0, 0.25])), [0.25]);
        // Between them, and far away, the nearest two are shown besides.
        assert_eq!(middles(Some([0.0, 1.5])), [1.5, 0.5]);
        assert_eq!(middles(Some([0.0, 9.0])), [9.0, 3.5]);
        // One that cuts one of two is enough.
        assert_eq!(SectionPlane::of_scene(&parts[1..3], Some([0.0, 0.5])).len(), 1);
    }

    #[test]
    fn a_sheet_at_right_angles_to_x3_is_cut_across_x1_and_what_has_no_extent_not_at_all() {
        let sheet = Box3 { min: [0.0; 3], max: [1.0, 1.0, 0.0] };
        assert_eq!(SectionPlane::through(&[("a", sheet)]).map(|found| found.axis), Some(0));
        let endless = Box3 { max: [1.0, 1.0, f64::INFINITY], ..sheet };
        assert_eq!(SectionPlane::through(&[("a", endless)]), None);
        assert_eq!(SectionPlane::through::<usize>(&[]), None);
    }
}
