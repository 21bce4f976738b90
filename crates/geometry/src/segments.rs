//! Distances between points and segments in space, m. The two ends of a segment may be the same point.

use elastocap_linalg::vector::{dot, length, minus};

/// A point, m.
type Point = [f64; 3];

/// The point of the segment nearest to `p`, as a share of the way from its first end to its second.
fn nearest_share(p: Point, [a, b]: [Point; 2]) -> f64 {
    let along = minus(b, a);
    let squared = dot(along, along);
    if squared > 0.0 { (dot(minus(p, a), along) / squared).clamp(0.0, 1.0) } else { 0.0 }
}

/// The point at a share of the way from the first end of a segment to its second.
fn point_at([a, b]: [Point; 2], share: f64) -> Point {
    [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]))
}

/// The distance of a point from a segment.
pub fn distance_to_segment(p: Point, segment: [Point; 2]) -> f64 {
    length(minus(p, point_at(segment, nearest_share(p, segment))))
}

/// The least distance between two segments (Ericson, Real-Time Collision Detection, section 5.1.9).
pub fn distance_of_segments(one: [Point; 2], other: [Point; 2]) -> f64 {
    // The least distance is that of an end from the other segment, unless the points where the two lines are
    // nearest to each other lie inside both segments.
    let of_ends = [
        distance_to_segment(one[0], other),
        distance_to_segment(one[1], other),
        distance_to_segment(other[0], one),
        distance_to_segment(other[1], one),
    ];
    let least = of_ends.into_iter().fold(f64::INFINITY, f64::min);
    let (u, v, w) = (minus(one[1], one[0]), minus(other[1], other[0]), minus(one[0], other[0]));
    let [uu, vv, uv] = [dot(u, u), dot(v, v), dot(u, v)];
    let determinant = uu * vv - uv * uv;
    if determinant <= 0.0 {
        return least;
    }
    let s = (uv * dot(v, w) - vv * dot(u, w)) / determinant;
    let t = (uu * dot(v, w) - uv * dot(u, w)) / determinant;
    let within = |share: f64| (0.0..=1.0).contains(&share);
    if within(s) && within(t) {
        least.min(length(minus(point_at(one, s), point_at(other, t))))
    } else {
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_segments_are_those_of_their_closest_points() {
        let along1 = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        // Crossed: the middles. Beyond an end: that end. Parallel. A point.
        assert_eq!(distance_of_segments(along1, [[0.2, 2.0, -1.0], [0.2, 2.0, 1.0]]), 2.0);
        assert_eq!(distance_of_segments(along1, [[4.0, 4.0, 0.0], [4.0, 9.0, 0.0]]), 5.0);
        assert_eq!(distance_of_segments(along1, [[-3.0, 0.0, 1.5], [3.0, 0.0, 1.5]]), 1.5);
        assert_eq!(distance_of_segments(along1, [[0.5, 0.0, 3.0]; 2]), 3.0);
        assert_eq!(distance_of_segments([[0.0; 3]; 2], [[0.0, 3.0, 4.0]; 2]), 5.0);
        // Those that cross touch.
        assert_eq!(distance_of_segments(along1, [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]), 0.0);
        assert_eq!(distance_to_segment([2.0, 0.0, 0.0], along1), 1.0);
        assert_eq!(distance_to_segment([0.3, -2.0, 0.0], along1), 2.0);
    }
}
