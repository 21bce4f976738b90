//! Outlines of the deformed electrodes and of the layer's surface, as fine polygons.

/// Points along a curve, m.
pub type Curve = Vec<[f64; 2]>;

/// Number of segments of one side of an element, whose deformed shape is a parabola. Its polygon is a
/// sixty-fourth as far from the parabola as its chord is.
pub const PIECES: usize = 8;

/// The outlines of the electrodes and the layer's surface in the plane of x1 and x2.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeformedCurves {
    /// The lower, right, upper and left face of each electrode, anticlockwise. The electrodes are the right
    /// (or lower) one, and the upper one of a stacked pair; where the whole layer is solved, the left and the
    /// right one.
    pub electrodes: Vec<[Curve; 4]>,
    /// The top of the layer, with ascending x1 before loading.
    pub surface: Curve,
    /// Whether these are the curves of the right half only.
    pub half: bool,
    /// The least and the greatest height of the top, m.
    pub heights: [f64; 2],
}

impl DeformedCurves {
    /// The heights between which the surface lies, m; `None` where it is a plane.
    pub fn bent_between(&self) -> Option<[f64; 2]> {
        let [low, high] = self.heights;
        (high - low > 1e-9 * high.abs()).then_some(self.heights)
    }
}

/// The smallest and the largest of some heights; infinite, and out of order, without any.
pub(super) fn range(heights: impl Iterator<Item = f64>) -> [f64; 2] {
    heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// The curve through deformed nodes of biquadratic elements: corner, middle, corner, and so on.
pub(super) fn through(nodes: &[[f64; 2]]) -> Curve {
    let mut curve: Curve = nodes.first().copied().into_iter().collect();
    for side in nodes.windows(3).step_by(2) {
        for k in 1..=PIECES {
            let s = k as f64 / PIECES as f64;
            let weights = [(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)];
            curve.push([0, 1].map(|a| (0..3).map(|i| weights[i] * side[i][a]).sum()));
        }
    }
    curve
}

/// A subset of the points of a curve, with its ends, whose polygon is `within` a distance (m) of all points
/// (Douglas and Peucker, Cartographica 10, 1973).
pub fn simplified(curve: &[[f64; 2]], within: f64) -> Curve {
    let mut keep = vec![false; curve.len()];
    let mut open = vec![[0, curve.len().saturating_sub(1)]];
    while let Some([from, to]) = open.pop() {
        for end in [from, to] {
            if let Some(keep) = keep.get_mut(end) {
                *keep = true;
            }
        }
        let farthest = (from + 1..to)
            .map(|i| (i, off_segment(curve[i], [curve[from], curve[to]])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((at, far)) = farthest
            && far > within
        {
            open.extend([[from, at], [at, to]]);
        }
    }
    curve.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

/// The distance of a point from a segment.
pub fn off_segment(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let s = if square > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - s * along[0]).hypot(to[1] - s * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_goes_through_its_nodes_and_stays_one() {
        let nodes: Vec<[f64; 2]> = (0..5).map(|i| f64::from(i) / 4.0).map(|x| [x, x * x]).collect();
        let curve = through(&nodes);
        assert_eq!(curve.len(), 2 * PIECES + 1);
        assert!(curve.iter().all(|[x, y]| (y - x * x).abs() < 1e-15));
        assert!(nodes.iter().all(|n| curve.iter().any(|p| (p[0] - n[0]).hypot(p[1] - n[1]) < 1e-15)));
    }

    #[test]
    fn fewer_points_stay_as_near_as_asked_and_a_straight_line_keeps_its_ends() {
        let arc: Curve = (0..=400).map(|i| f64::from(i) / 400.0).map(|t| [t.cos(), t.sin()]).collect();
        let within = 1e-4;
        let few = simplified(&arc, within);
        assert!(few.len() < 70 && few[0] == arc[0] && few[few.len() - 1] == arc[400]);
        for p in &arc {
            let far = few.windows(2).map(|w| off_segment(*p, [w[0], w[1]])).fold(f64::INFINITY, f64::min);
            assert!(far <= within, "{far:e}");
        }
        let line: Curve = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(simplified(&line, 1e-9), vec![[0.0, 0.0], [8.0, 16.0]]);
        assert_eq!(simplified(&[], 1.0), Curve::new());
    }
}
