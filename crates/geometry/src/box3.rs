//! Boxes along the coordinate axes.

/// An axis-aligned box in metres; index 0, 1, 2 are x1 (in-plane), x2 (up), x3 (along the width).
///
/// A bound may be infinite where the scene is open. A box with `min[a] == max[a]` on exactly one axis is a
/// sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box3 {
    /// Lower corner, m.
    pub min: [f64; 3],
    /// Upper corner, m.
    pub max: [f64; 3],
}

impl Box3 {
    /// Everything.
    pub const SPACE: Self = Self { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };

    /// Extent along `axis`, m; zero across a sheet.
    pub fn extent(&self, axis: usize) -> f64 {
        self.max[axis] - self.min[axis]
    }

    /// The largest finite extent, m; zero if there is none.
    pub(crate) fn largest_extent(&self) -> f64 {
        (0..3).map(|a| self.extent(a)).filter(|e| e.is_finite()).fold(0.0, f64::max)
    }

    /// The axis across which the box has no thickness, if it is a sheet.
    pub fn sheet_normal(&self) -> Option<usize> {
        (0..3).find(|&a| self.min[a] == self.max[a])
    }

    /// Whether the closed boxes share at least one point.
    pub fn touches(&self, other: &Self) -> bool {
        (0..3).all(|a| self.min[a] <= other.max[a] && other.min[a] <= self.max[a])
    }

    /// Whether the point lies in the closed box.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= point[a] && point[a] <= self.max[a])
    }

    /// The smallest box that holds both.
    pub fn union(&self, other: &Self) -> Self {
        let mut out = *self;
        for a in 0..3 {
            out.min[a] = out.min[a].min(other.min[a]);
            out.max[a] = out.max[a].max(other.max[a]);
        }
        out
    }
}
