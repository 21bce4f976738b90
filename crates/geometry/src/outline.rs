//! Polygons in a plane.

/// Whether a point lies in a simple polygon.
///
/// Two polygons with a common edge neither share a point next to it nor leave one out: the edge is always taken from its lower
/// end up, whichever way the polygon passes it, so that rounding puts a point on the same side of it for both.
pub fn contains(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
    let mut inside = false;
    for (k, &a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        if (a[1] > p[1]) != (b[1] > p[1]) {
            let [low, high] = if a[1] < b[1] { [a, b] } else { [b, a] };
            if p[0] < low[0] + (high[0] - low[0]) * (p[1] - low[1]) / (high[1] - low[1]) {
                inside = !inside;
            }
        }
    }
    inside
}
