//! Dielectrics that leave the field as it is without them, because they have the permittivity of all that they lie in.
//!
//! Without them a scene of boxes stays one whatever their shape, and scenes that differ in them alone are the same: the change of the
//! capacitance from one to the other is zero, which no two solves could show.

use elastocap_case::{Case, Extent, Face, FieldIndenter};
use elastocap_geometry::scene::{Body, Box3, Purpose, Role};

/// The permittivity of a dielectric; `None` for a conductor.
fn permittivity(body: &Body) -> Option<f64> {
    match body.role {
        Role::Dielectric { relative_permittivity } => Some(relative_permittivity),
        Role::Conductor { .. } => None,
    }
}

/// The indenter of a case as the field meets it; `None` without one, and where what surrounds it has its permittivity.
pub(crate) fn indenter_in_field(case: &Case) -> Option<FieldIndenter> {
    let own = case.indenter?;
    let Role::Dielectric { relative_permittivity } = own.role else { return Some(own) };
    let is_of_it = |permittivity: f64| permittivity == relative_permittivity;
    let surroundings = case.surroundings.as_ref()?;
    let cover_is = match &surroundings.extent {
        Extent::AroundLayer { above: Face::Medium { relative_permittivity: cover, .. }, .. } => {
            is_of_it(*cover)
        }
        _ => false,
    };
    let is_neutral = is_of_it(surroundings.relative_permittivity)
        && cover_is
        && case.bodies.iter().filter_map(permittivity).all(is_of_it);
    (!is_neutral).then_some(own)
}

/// The places of bodies that are neutral among the `dielectrics` of a scene, slabs included. What moves with the layer lies in it, wherever its
/// boxes are before a map takes them there. Groups of a volume mesh are none: the mesh is
/// the scene.
pub(super) fn neutral_bodies(dielectrics: &[&Body], background: f64) -> Vec<usize> {
    let is_of_it = |body: &&&Body| permittivity(body) == Some(background) && body.purpose != Purpose::InLayer;
    let others: Vec<Option<Box3>> =
        dielectrics.iter().filter(|body| !is_of_it(body)).map(|body| body.bounds()).collect();
    let is_neutral = |(_, body): &(usize, &&Body)| {
        let own = body.bounds();
        let is_apart = |other: &Option<Box3>| match (&own, other) {
            (Some(own), Some(other)) => are_apart(own, other),
            // Only a mesh knows.
            _ => false,
        };
        is_of_it(body) && own.is_some() && others.iter().all(is_apart)
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
