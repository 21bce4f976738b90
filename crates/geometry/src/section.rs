//! Where a section through the conductors of a scene lies.

use crate::scene::Box3;

/// How far a section lies from the middle, as a share of the conductors' extent: meshes that are mirrored in the middle have faces there,
/// which would be cut along themselves.
const BESIDE: f64 = 1.3e-4;

/// A plane through the middle of the conductors, at right angles to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionPlane {
    /// The axis, 0 to 2.
    pub axis: usize,
    /// The middle of the conductors along it, m.
    pub middle: f64,
    /// Their extent along it, m.
    pub extent: f64,
}

impl SectionPlane {
    /// The plane that shows most of some conductors: across x3; across x1 where they lie beside each other along x3 alone, or have no extent
    /// along x3. Each conductor has one or several parts, whose bounds are given with what tells the conductors apart. `None` where the
    /// conductors have no finite extent along that axis.
    pub fn through<K: PartialEq>(parts: &[(K, Box3)]) -> Option<Self> {
        let all = parts.iter().map(|(_, bounds)| *bounds).reduce(|all, bounds| all.union(&bounds))?;
        let apart = |a: usize| {
            let pairs = parts.iter().flat_map(|p| parts.iter().map(move |q| (p, q)));
            pairs.filter(|(p, q)| p.0 != q.0).any(|(p, q)| p.1.max[a] < q.1.min[a])
        };
        let across_x1 = all.extent(2) == 0.0 || (apart(2) && !apart(0) && !apart(1));
        let axis = if across_x1 { 0 } else { 2 };
        let extent = all.extent(axis);
        let middle = 0.5 * (all.min[axis] + all.max[axis]);
        (extent > 0.0 && extent.is_finite()).then_some(Self { axis, middle, extent })
    }

    /// Where it cuts, m.
    pub fn at(&self) -> f64 {
        self.middle + BESIDE * self.extent
    }

    /// The ends of a thin slab around it, m. The lower end is the middle, where grids of mirrored scenes have a plane.
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
    fn a_sheet_at_right_angles_to_x3_is_cut_across_x1_and_what_has_no_extent_not_at_all() {
        let sheet = Box3 { min: [0.0; 3], max: [1.0, 1.0, 0.0] };
        assert_eq!(SectionPlane::through(&[("a", sheet)]).map(|found| found.axis), Some(0));
        let endless = Box3 { max: [1.0, 1.0, f64::INFINITY], ..sheet };
        assert_eq!(SectionPlane::through(&[("a", endless)]), None);
        assert_eq!(SectionPlane::through::<usize>(&[]), None);
    }
}
