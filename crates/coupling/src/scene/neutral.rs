//! Neutral dielectrics, which do not change the field because their surroundings have the same permittivity.
//!
//! They are left out of the scene. What is left may then be boxes alone, which the box solver takes, although
//! neutral bodies have other shapes. Scenes that differ only in neutral bodies become equal, so that the
//! change of the capacitance between them is exactly zero, which two solves could not show.

use elastocap_case::{Case, Extent, Face, FieldIndenter};
use elastocap_geometry::scene::{Body, Box3, Purpose, Role};

/// The permittivity of a dielectric; `None` for a conductor.
fn permittivity(body: &Body) -> Option<f64> {
    match body.role {
        Role::Dielectric { relative_permittivity } => Some(relative_permittivity),
        Role::Conductor { .. } => None,
    }
}

/// The indenter of a case as part of the field; `None` without one, and where it is neutral.
pub(crate) fn indenter_in_field(case: &Case) -> Option<FieldIndenter> {
    let indenter = case.indenter?;
    let Role::Dielectric { relative_permittivity } = indenter.role else { return Some(indenter) };
    let is_equal = |permittivity: f64| permittivity == relative_permittivity;
    let surroundings = case.surroundings.as_ref()?;
    let cover_is_equal = match &surroundings.extent {
        Extent::AroundLayer { above: Face::Medium { relative_permittivity: cover, .. }, .. } => {
            is_equal(*cover)
        }
        _ => false,
    };
    let is_neutral = is_equal(surroundings.relative_permittivity)
        && cover_is_equal
        && case.bodies.iter().filter_map(permittivity).all(is_equal);
    (!is_neutral).then_some(indenter)
}

/// The indices of the neutral bodies among the `dielectrics` of a scene, including slabs. Bodies that move
/// with the layer are never neutral: their boxes are at other places before a map. Neither are groups of a
/// volume mesh, which defines the scene.
pub(super) fn neutral_bodies(dielectrics: &[&Body], background: f64) -> Vec<usize> {
    let has_background =
        |body: &&&Body| permittivity(body) == Some(background) && body.purpose != Purpose::InLayer;
    let others: Vec<Option<Box3>> =
        dielectrics.iter().filter(|body| !has_background(body)).map(|body| body.bounds()).collect();
    let is_neutral = |(_, body): &(usize, &&Body)| {
        let bounds = body.bounds();
        let is_apart = |other: &Option<Box3>| match (&bounds, other) {
            (Some(bounds), Some(other)) => are_apart(bounds, other),
            // The bounds of a group of a volume mesh are unknown.
            _ => false,
        };
        has_background(body) && bounds.is_some() && others.iter().all(is_apart)
    };
    dielectrics.iter().enumerate().filter(is_neutral).map(|(place, _)| place).collect()
}

/// Whether two boxes share no more than faces.
fn are_apart(a: &Box3, b: &Box3) -> bool {
    (0..3).any(|axis| a.max[axis] <= b.min[axis] || b.max[axis] <= a.min[axis])
}

#[cfg(test)]
mod tests {
    use elastocap_geometry::shapes::Shape;

    use super::*;

    fn block(permittivity: f64, [low, high]: [f64; 2]) -> Body {
        let region = Box3 { min: [low, 0.0, 0.0], max: [high, 1.0, 1.0] };
        Body::dielectric("block", Shape::Box(region), permittivity)
    }

    #[test]
    fn a_body_is_neutral_where_all_that_it_overlaps_has_its_permittivity() {
        let [air, rubber] = [block(1.0, [0.0, 1.0]), block(2.8, [1.0, 2.0])];
        assert_eq!(neutral_bodies(&[&air, &rubber], 1.0), [0]);
        assert_eq!(neutral_bodies(&[&air, &rubber], 2.8), [1]);
        let hole = block(1.0, [1.5, 1.75]);
        assert_eq!(neutral_bodies(&[&air, &rubber, &hole], 1.0), [0]);
        assert_eq!(neutral_bodies(&[&air, &hole], 1.0), [0, 1]);
        let void = hole.with_purpose(Purpose::InLayer);
        assert_eq!(neutral_bodies(&[&air, &void], 1.0), [0]);
    }
}
