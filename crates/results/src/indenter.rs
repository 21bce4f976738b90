//! The surface of the indenter for a viewer, where the indenter is no body of the field: its working face and
//! a part of what is above that.

use elastocap_case::{Case, Indenter, Mechanics};
use elastocap_geometry::export::surfaces::{Corners, prism};
use elastocap_geometry::scene::Box3;

/// Height of a plate, over the thickness of the layer.
const PLATE: f64 = 0.12;
/// Height up to which other indenters are shown, over the thickness of the layer.
const SHOWN: f64 = 0.8;
/// The number of pieces of half a circle.
const PIECES: usize = 32;

/// The indenter with its lowest point at this height above the substrate, m; `None` where nothing presses, or
/// where a plate presses whose size is not known.
pub(crate) fn indenter(case: &Case, height: f64) -> Option<Vec<Corners>> {
    let layer = case.layer.as_ref()?;
    if let Some(plate) = plate(case, height) {
        return Some(of_box(&plate));
    }
    let ends = |width: f64| [-0.5 * width, 0.5 * width];
    let most = SHOWN * layer.thickness;
    let round = |radius: f64, position: f64, width: f64| {
        prism(2, ends(width), &profile(0.0, radius, most, [position, height]))
    };
    let flat = |half_width: f64, corner: f64, position: f64, width: f64| {
        let outline = profile((half_width - corner).max(0.0), corner, most, [position, height]);
        prism(2, ends(width), &outline)
    };
    let (indenter, width) = case.mechanics?.indenter()?;
    Some(match indenter {
        Indenter::WholeTop => return None,
        Indenter::FlatPunch { half_width, contact, position } => {
            flat(half_width, contact.corner_radius().unwrap_or(0.0), position, width)
        }
        Indenter::Cylinder { radius, position } => round(radius, position, width),
        Indenter::Sphere { radius } => ball(radius, most.max(layer.half_length.unwrap_or(most)), height),
        Indenter::Block { half_widths, corner_radius } => block(half_widths, corner_radius, most, height),
    })
}

/// The indenter where it is a plate: over the contact of the closed form, or over the whole layer.
pub(crate) fn plate(case: &Case, height: f64) -> Option<Box3> {
    case.load.as_ref()?;
    let layer = case.layer.as_ref()?;
    let over = |half_length: f64, width: f64| Box3 {
        min: [-half_length, height, -0.5 * width],
        max: [half_length, height + PLATE * layer.thickness, 0.5 * width],
    };
    match case.mechanics? {
        Mechanics::ClosedForm { contact_half_length, contact_width, .. } => {
            Some(over(contact_half_length, contact_width))
        }
        finite_elements => match finite_elements.indenter()? {
            (Indenter::WholeTop, width) => Some(over(layer.half_length?, width)),
            _ => None,
        },
    }
}

/// The surface of a box.
pub(crate) fn of_box(Box3 { min, max }: &Box3) -> Vec<Corners> {
    let outline = [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]];
    prism(2, [min[2], max[2]], &outline)
}

/// The right side of a body with a flat face of half-width `flat` and a corner of this radius: points
/// (distance from the middle, height) from the end of the flat upward, up to the height `most`.
fn side(flat: f64, radius: f64, most: f64) -> Vec<[f64; 2]> {
    let up_to = if radius > most { (1.0 - most / radius).acos() } else { 0.5 * std::f64::consts::PI };
    let arc = (0..=PIECES).map(|k| up_to * k as f64 / PIECES as f64);
    let mut side: Vec<[f64; 2]> = arc.map(|t| [flat + radius * t.sin(), radius * (1.0 - t.cos())]).collect();
    side.dedup();
    if radius < most {
        side.push([flat + radius, most]);
    }
    side
}

/// The outline of a body with such a right side, and its mirror image on the left, with the middle of its
/// face at `middle`.
fn profile(flat: f64, radius: f64, most: f64, middle: [f64; 2]) -> Vec<[f64; 2]> {
    let right = side(flat, radius, most);
    let left = right.iter().rev().filter(|p| p[0] > 0.0).map(|p| [-p[0], p[1]]);
    right.iter().copied().chain(left).map(|p| [middle[0] + p[0], middle[1] + p[1]]).collect()
}

/// The surface of a ball up to the height `most` above its lowest point, closed on top there if the ball is
/// higher.
fn ball(radius: f64, most: f64, height: f64) -> Vec<Corners> {
    let angle = |k: usize| std::f64::consts::PI * k as f64 / PIECES as f64;
    let up_to = (1.0 - most / radius).max(-1.0).acos();
    let ring = |k: usize| -> Vec<[f64; 3]> {
        let t = up_to * k as f64 / PIECES as f64;
        // The poles are points.
        let out = if k == 0 || (k == PIECES && most >= 2.0 * radius) { 0.0 } else { radius * t.sin() };
        let up = height + radius * (1.0 - t.cos());
        (0..2 * PIECES).map(|k| [out * angle(k).cos(), up, -out * angle(k).sin()]).collect()
    };
    lofted(&(0..=PIECES).map(ring).collect::<Vec<_>>())
}

/// The surface of a block with rounded lower edges up to the height `most` above its face, closed on top.
fn block(half_widths: [f64; 2], radius: f64, most: f64, height: f64) -> Vec<Corners> {
    // Each ring goes round anticlockwise as seen from above.
    let ring = |[out, up]: [f64; 2]| -> Vec<[f64; 3]> {
        let [a, b] = half_widths.map(|half| half - radius + out);
        [[a, b], [a, -b], [-a, -b], [-a, b]].map(|[x, z]| [x, height + up, z]).to_vec()
    };
    let rings: Vec<_> = side(0.0, radius, most).into_iter().map(ring).collect();
    lofted(&rings)
}

/// The surface of the body between rings above each other, which go round anticlockwise as seen from above,
/// with caps at both ends.
fn lofted(rings: &[Vec<[f64; 3]>]) -> Vec<Corners> {
    let mut triangles = Vec::new();
    for pair in rings.windows(2) {
        let [low, high] = [&pair[0], &pair[1]];
        for k in 0..low.len() {
            let next = (k + 1) % low.len();
            triangles.push([low[k], low[next], high[next]]);
            triangles.push([low[k], high[next], high[k]]);
        }
    }
    for (ring, below) in [(rings.first(), true), (rings.last(), false)] {
        let Some(ring) = ring else { continue };
        for k in 1..ring.len().saturating_sub(1) {
            let [a, b, c] = [ring[0], ring[k], ring[k + 1]];
            triangles.push(if below { [a, c, b] } else { [a, b, c] });
        }
    }
    // The lowest ring of a ball is a point.
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(triangles: &[Corners]) -> f64 {
        let six = |[a, b, c]: &Corners| {
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        triangles.iter().map(six).sum::<f64>() / 6.0
    }

    fn lowest(triangles: &[Corners]) -> f64 {
        triangles.iter().flatten().map(|p| p[1]).fold(f64::INFINITY, f64::min)
    }

    /// The pair under a sphere, with its indenter replaced by this text.
    fn case(indenter: &str) -> Case {
        let path =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/pair-under-sphere.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        let sphere = "[mechanics.solid.indenter.sphere]\nradius = \"600 um\"";
        assert!(text.contains(sphere));
        elastocap_case::parse(&text.replace(sphere, indenter), &path).unwrap()
    }

    #[test]
    fn every_indenter_is_closed_outside_out_and_begins_where_the_load_puts_it() {
        // In mm: the part of a ball up to the height h holds pi h^2 (r - h / 3); h is the half length of the
        // layer at most.
        let part = |h: f64| std::f64::consts::PI * h * h * (0.6 - h / 3.0);
        let half_length =
            case("[mechanics.solid.indenter.sphere]\nradius = \"600 um\"").layer.unwrap().half_length;
        let whole = part(half_length.map_or(0.36, |half| 1e3 * half).min(1.2));
        for h in [0.36, 0.9, 1.2, 5.0] {
            let share = volume(&ball(0.6, h, 0.0)) / part(h.min(1.2));
            assert!((0.99..1.0 + 1e-9).contains(&share), "{h}: {share}");
        }
        let rounded = |half: f64, r: f64| {
            // Over the width: a rectangle without two corners.
            1.4 * (2.0 * half * 0.36 - 2.0 * (1.0 - 0.25 * std::f64::consts::PI) * r * r)
        };
        // A circle's segment of height h.
        let segment = {
            let (r, h): (f64, f64) = (0.6, 0.36);
            1.4 * (r * r * ((r - h) / r).acos() - (r - h) * (2.0 * r * h - h * h).sqrt())
        };
        let cases = [
            ("[mechanics.solid.indenter.sphere]\nradius = \"600 um\"", whole),
            ("[mechanics.solid.indenter.cylinder]\nradius = \"600 um\"", segment),
            (
                "[mechanics.solid.indenter.flat_punch]\nhalf_width = \"300 um\"\ncorner_radius = \"100 um\"\ncontact = \"smooth\"",
                rounded(0.3, 0.1),
            ),
            (
                "[mechanics.solid.indenter.flat_punch]\nhalf_width = \"300 um\"\ncontact = \"bonded\"",
                rounded(0.3, 0.0),
            ),
        ];
        for (text, expected) in cases {
            let found = indenter(&case(text), 0.4e-3).unwrap();
            let share = volume(&found) * 1e9 / expected;
            assert!((0.99..1.0 + 1e-9).contains(&share), "{text}: {share}");
            assert!((lowest(&found) - 0.4e-3).abs() < 1e-12);
        }
        let found = block([0.3, 0.2], 1e-3, 0.36, 0.4);
        assert!((volume(&found) / (0.6 * 0.4 * 0.36) - 1.0).abs() < 1e-2, "{}", volume(&found));
    }
}
