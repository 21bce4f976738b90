//! The scene with a bent layer and bent electrodes as extruded outlines, for the solvers of shapes other than
//! boxes.
//!
//! The plane-strain solution of the layer gives the shape of every electrode and of the surface. The field
//! solvers take them as outlines in the plane of x1 and x2, extruded along x3: with cubics, or as polygons,
//! close enough to the curves that the difference does not matter for the capacitance.

mod surface;

use elastocap_geometry::export::gltf::BodyRole;
use elastocap_geometry::export::surfaces::{Corners, SurfaceBody, prism};
use elastocap_geometry::outline;
use elastocap_geometry::scene::{Body, Box3, Purpose, Scene, across};
use elastocap_geometry::shapes::Shape;

use crate::deform::{Curve, DeformedCurves, PIECES, simplified};
use crate::failure::SurfaceCrossesItself;
use crate::outline_curves::{self, Curved, Piece, both_halves as both_curved_halves, closed, followed};
use crate::scene::{DeformedScene, ElectrodePlace};
use surface::{below_surface, cut, fill};
pub(crate) use surface::{far_off, under_wall};

/// Share of the tolerance that the error of polygons may take. Tuned: `elastocap run cases/punched-pair.toml`
/// at tolerances of 2e-2, 1e-3 and 1e-4.
const SHARE: f64 = 0.2;

/// Share of the tolerance that the error of cubics may take. That needs no more cubics than polygons with
/// [`SHARE`] need sides, and cubics are exact where there are as many of them as element sides. Tuned:
/// `elastocap run cases/punched-pair.toml` at tolerances of 2e-2, 1e-3 and 1e-4.
const SHARE_OF_CURVES: f64 = 0.02;

/// A scene for the solvers of shapes other than boxes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LayerScene {
    /// The bodies, those of the layer as outlines.
    pub(crate) scene: Scene,
    /// An estimate of the relative error of a capacitance from the faceting or the approximation by cubics.
    pub(crate) facets: f64,
    /// Whether some outlines contain cubics.
    pub(crate) is_curved: bool,
    /// An estimate of the relative error of a capacitance because the surface has not returned to its height
    /// where the finite elements end.
    pub(crate) ends: f64,
    /// An estimate of the relative error of a capacitance because a wall on the bent surface is taken as
    /// flat.
    pub(crate) under_wall: f64,
}

/// The representation of bent outlines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sides {
    /// Cubics, which the solver for outlines takes.
    Curves,
    /// Polygons.
    Polygons,
}

impl LayerScene {
    /// The scene with the pair and the layer as boxes.
    pub(crate) fn of_boxes(deformed: &DeformedScene) -> Self {
        Self { scene: deformed.scene.clone(), facets: 0.0, is_curved: false, ends: 0.0, under_wall: 0.0 }
    }

    /// The bodies for a viewer, clipped to the `window`; without the cover, which fills the rest of the
    /// space. Surfaces of curved bodies are those of the mesh, `meshed`, by name.
    pub(crate) fn surfaces(&self, window: &Box3, meshed: &[SurfaceBody]) -> Vec<SurfaceBody> {
        let conductors = self.scene.conductors().map(|c| c.body);
        let shown = conductors.chain(self.scene.dielectrics().map(|d| d.body));
        let shown = shown.filter(|body| body.purpose != Purpose::Cover);
        let surface = |body: &Body| {
            let of_mesh = meshed.iter().find(|m| m.name == body.name).map(|m| m.triangles.clone());
            // Round bodies are shown with the facets of the mesh, if there is one.
            let is_round = |part: &Shape| matches!(part, Shape::Cylinder { .. } | Shape::Tube { .. });
            let shown_as_meshed = of_mesh.is_some() && body.parts.iter().any(is_round);
            let of_parts = || body.parts.iter().map(|part| flat_surface(part, window)).collect();
            let of_parts: Option<Vec<_>> = if shown_as_meshed { None } else { of_parts() };
            let triangles = of_parts.map(|parts| parts.concat()).or(of_mesh).unwrap_or_default();
            SurfaceBody { name: body.name.clone(), role: BodyRole::from(body), triangles }
        };
        shown.map(surface).collect()
    }
}

/// The triangles of a shape, with boxes and extrusions clipped to the `window`; `None` for shapes whose
/// triangles only a mesh provides.
fn flat_surface(shape: &Shape, window: &Box3) -> Option<Vec<Corners>> {
    match shape {
        Shape::Extrusion { axis, from, to, outline, .. } => {
            let mut outline = outline.clone();
            for (k, a) in across(*axis).into_iter().enumerate() {
                outline = cut(&cut(&outline, k, window.min[a], true), k, window.max[a], false);
            }
            let ends = [from.max(window.min[*axis]), to.min(window.max[*axis])];
            let is_seen = outline.len() > 2 && ends[0] <= ends[1];
            Some(if is_seen { prism(*axis, ends, &outline) } else { Vec::new() })
        }
        Shape::Cylinder { axis, base, radius, height } => {
            let circle = outline::on_circle(place_across(*axis, base), *radius, CORNERS);
            Some(prism(*axis, [base[*axis], base[*axis] + height], &circle))
        }
        Shape::Tube { axis, base, radii, height } => {
            let middle = place_across(*axis, base);
            let [inner, outer] = radii.map(|radius| outline::on_circle(middle, radius, CORNERS));
            let ends = [base[*axis], base[*axis] + height];
            let halves = outline::halves_between(&inner, &outer);
            Some(halves.iter().flat_map(|half| prism(*axis, ends, half)).collect())
        }
        Shape::Box(region) => {
            let clipped = |a: usize| [region.min[a].max(window.min[a]), region.max[a].min(window.max[a])];
            let ([x0, x1], [y0, y1]) = (clipped(0), clipped(1));
            if (0..3).any(|a| clipped(a)[0] > clipped(a)[1]) {
                return Some(Vec::new());
            }
            Some(prism(2, clipped(2), &[[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))
        }
        Shape::Surface(surface) => {
            Some(surface.faces.iter().map(|t| t.map(|p| surface.points[p as usize])).collect())
        }
        Shape::Sphere { .. } | Shape::Shell { .. } | Shape::Capsule { .. } | Shape::Physical(_) => None,
    }
}

/// Corners of the polygons that circles are shown as.
const CORNERS: usize = 96;

/// The coordinates across an axis.
fn place_across(axis: usize, point: &[f64; 3]) -> [f64; 2] {
    across(axis).map(|a| point[a])
}

/// The scene `deformed` with its pair and its layer in the shape of `curves`. `flat` is the height of the
/// surface at rest, m, and `tolerance` the relative tolerance of capacitances.
///
/// # Errors
/// The surface crosses itself.
pub(crate) fn outlined(
    deformed: &DeformedScene,
    curves: &DeformedCurves,
    flat: f64,
    tolerance: f64,
    sides: Sides,
) -> Result<LayerScene, SurfaceCrossesItself> {
    let mut scene = deformed.scene.clone();
    let places = deformed.pair.iter().flat_map(|pair| pair.places);
    let regions: Vec<(ElectrodePlace, Box3)> =
        places.filter_map(|place| Some((place, place.in_scene(&mut scene)?.bounds()?))).collect();
    let gap = deformed.pair.map_or(f64::INFINITY, |pair| pair.gap);
    let smallest = regions.iter().map(|(_, r)| r.extent(0).min(r.extent(1))).fold(gap, f64::min);
    let within = SHARE * tolerance * smallest;
    let drawn: Vec<Curved> = match sides {
        Sides::Curves => {
            let chains = chains(curves, SHARE_OF_CURVES * tolerance * smallest);
            chains.iter().map(|chain| closed(chain, within)).collect()
        }
        Sides::Polygons => outlines(curves, within).into_iter().map(|o| polygon(o, within)).collect(),
    };
    let mut facets = drawn.iter().map(|curved| curved.off / smallest).fold(0.0, f64::max);
    let mut is_curved = sides == Sides::Curves;
    for ((place, region), Curved { outline, arcs, .. }) in regions.into_iter().zip(drawn) {
        if let Some(part) = place.in_scene(&mut scene) {
            let (from, to) = (region.min[2], region.max[2]);
            *part = Shape::Extrusion { axis: 2, from, to, outline, arcs };
        }
    }
    let mut ends = 0.0;
    if let Some(below) = below_surface(deformed, curves, flat, tolerance, sides)? {
        facets = facets.max(below.facets);
        is_curved |= below.is_curved;
        ends = below.ends;
        fill(&mut scene, &below.parts);
    }
    let under_wall = under_wall(&scene, curves);
    Ok(LayerScene { scene, facets, is_curved, ends, under_wall })
}

/// A polygon whose distance from its curve is `off`.
fn polygon(outline: Curve, off: f64) -> Curved {
    Curved { outline, arcs: Vec::new(), off }
}

/// The outlines of the pair as closed chains of straight lines and cubics at most `within` (m) from the
/// curves, in the order of its conductors.
fn chains(curves: &DeformedCurves, within: f64) -> Vec<Vec<Piece>> {
    let along =
        |faces: &[Curve]| faces.iter().flat_map(|face| followed(face, PIECES, within)).collect::<Vec<_>>();
    let electrodes = curves.electrodes.iter();
    if !curves.half {
        return electrodes.map(|faces| along(faces)).collect();
    }
    match curves.electrodes.as_slice() {
        [right] => {
            let right = along(right);
            vec![outline_curves::mirrored(&right), right]
        }
        // The modelled half of each electrode has its left face on the axis.
        _ => electrodes.map(|faces| both_curved_halves(along(&faces[..3]))).collect(),
    }
}

/// The outlines of the pair as polygons at most `within` (m) from the curves, in the order of its conductors.
fn outlines(curves: &DeformedCurves, within: f64) -> Vec<Curve> {
    let along = |faces: &[Curve]| {
        let mut path: Curve = Vec::new();
        for face in faces {
            let corners = simplified(face, within);
            // A face begins where the one before it ends.
            path.extend(&corners[usize::from(!path.is_empty()).min(corners.len())..]);
        }
        path
    };
    let closed = |faces: &[Curve]| {
        let mut outline = along(faces);
        outline.pop();
        outline
    };
    let electrodes = curves.electrodes.iter();
    if !curves.half {
        return electrodes.map(|faces| closed(faces)).collect();
    }
    match curves.electrodes.as_slice() {
        [right] => {
            let right = closed(right);
            vec![mirrored(&right), right]
        }
        // The modelled half of each electrode has its left face on the axis.
        _ => electrodes.map(|faces| both_halves(&along(&faces[..3]))).collect(),
    }
}

/// The mirror image of a curve about x1 = 0, which runs the other way round.
fn mirrored(curve: &[[f64; 2]]) -> Curve {
    curve.iter().rev().map(|p| [-p[0], p[1]]).collect()
}

/// A curve on the right of the axis together with its mirror image, as one. It begins on the axis, and may
/// end there.
fn both_halves(curve: &[[f64; 2]]) -> Curve {
    let size = curve.iter().map(|p| p[0]).fold(0.0, f64::max);
    let on_axis = |p: &[f64; 2]| p[0].abs() <= 1e-9 * size;
    let mut whole = mirrored(curve);
    whole.retain(|p| !on_axis(p));
    whole.extend(curve.iter().map(|p| if on_axis(p) { [0.0, p[1]] } else { *p }));
    whole
}

#[cfg(test)]
mod tests {
    use elastocap_geometry::scene::Wall;

    use super::surface::{under, without_loops};
    use super::*;
    use crate::scene::DeformedPair;

    fn line(from: [f64; 2], to: [f64; 2]) -> Curve {
        let at = |k: u32| [0, 1].map(|a| from[a] + f64::from(k) / 8.0 * (to[a] - from[a]));
        (0..=8).map(at).collect()
    }

    fn faces([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> [Curve; 4] {
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        [0, 1, 2, 3].map(|k| line(corners[k], corners[(k + 1) % 4]))
    }

    fn area(outline: &[[f64; 2]]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>()
    }

    fn slab(low: f64, high: f64) -> Box3 {
        Box3 { min: [f64::NEG_INFINITY, low, f64::NEG_INFINITY], max: [f64::INFINITY, high, f64::INFINITY] }
    }

    /// A pair in a layer of height 2 on a substrate, under a cover up to 4.
    fn deformed() -> DeformedScene {
        let plate = |name: &str, x: [f64; 2]| {
            let region = Box3 { min: [x[0], 1.0, -1.0], max: [x[1], 1.5, 1.0] };
            Body::conductor(name, Shape::Box(region)).with_purpose(Purpose::Electrode)
        };
        let body = |name: &str, region, eps, purpose| {
            Body::dielectric(name, Shape::Box(region), eps).with_purpose(purpose)
        };
        DeformedScene {
            scene: Scene {
                bodies: vec![
                    plate("left", [-3.0, -1.0]),
                    plate("right", [1.0, 3.0]),
                    body("layer", slab(0.0, 2.0), 3.0, Purpose::Layer),
                    body("substrate", slab(f64::NEG_INFINITY, 0.0), 4.0, Purpose::Substrate),
                    body("cover", slab(2.0, f64::INFINITY), 1.0, Purpose::Cover),
                ],
                background_permittivity: 1.0,
                domain: Box3 { min: [-5.0, -1.0, -2.0], max: [5.0, 4.0, 2.0] },
                walls: [[Wall::Insulated; 2]; 3],
            },
            pair: Some(DeformedPair {
                places: [0, 1].map(|conductor| ElectrodePlace { conductor, part: 0 }),
                gap: 2.0,
                height: 1.25,
                thickness: 0.5,
                parallel_plate: 1.0,
            }),
            electrodes_are_bent: false,
            tilt: None,
        }
    }

    fn outline<'a>(scene: &'a Scene, name: &str) -> &'a [[f64; 2]] {
        let body = scene.bodies.iter().find(|body| body.name == name).unwrap();
        let [Shape::Extrusion { axis: 2, outline, .. }] = &body.parts[..] else { panic!("{body:?}") };
        outline
    }

    fn dielectrics(scene: &Scene) -> Vec<&str> {
        scene.dielectrics().map(|d| d.body.name.as_str()).collect()
    }

    #[test]
    fn straight_faces_give_rectangles_and_their_mirror_images() {
        let curves = DeformedCurves {
            electrodes: vec![faces([1.0, 3.0], [1.0, 1.5])],
            surface: line([0.0, 2.0], [4.0, 2.0]),
            half: true,
            heights: [2.0; 2],
        };
        let LayerScene { scene, facets, .. } =
            outlined(&deformed(), &curves, 2.0, 1e-3, Sides::Polygons).unwrap();
        assert!(facets > 0.0 && facets < 1e-3);
        let right = outline(&scene, "right");
        assert_eq!(right, [[1.0, 1.0], [3.0, 1.0], [3.0, 1.5], [1.0, 1.5]]);
        let left = outline(&scene, "left");
        assert!(left.iter().all(|p| right.contains(&[-p[0], p[1]])) && (area(left) - 1.0).abs() < 1e-12);
        // Beyond its end the layer continues at the same height.
        assert!((area(outline(&scene, "layer")) - 20.0).abs() < 1e-12);
    }

    #[test]
    fn a_plate_on_the_axis_becomes_whole() {
        let curves = DeformedCurves {
            electrodes: vec![faces([0.0, 2.0], [0.5, 1.0]), faces([0.0, 1.0], [1.2, 1.5])],
            surface: Curve::new(),
            half: true,
            heights: [2.0; 2],
        };
        let found = outlines(&curves, 1e-6);
        assert!((area(&found[0]) - 2.0).abs() < 1e-12 && (area(&found[1]) - 0.6).abs() < 1e-12);
        let doubled = found.iter().flat_map(|o| o.iter().zip(o.iter().cycle().skip(1))).any(|(p, q)| p == q);
        assert!(!doubled, "{found:?}");
    }

    #[test]
    fn the_cover_fills_what_the_layer_leaves_and_not_the_substrate() {
        let mut surface = line([0.0, 1.8], [2.0, 1.8]);
        surface.extend(&line([2.0, 1.8], [3.0, 2.4])[1..]);
        surface.extend(&line([3.0, 2.4], [6.0, 2.0])[1..]);
        let curves = DeformedCurves {
            electrodes: vec![faces([1.0, 3.0], [1.0, 1.5])],
            surface,
            half: true,
            heights: [1.5, 2.4],
        };
        let LayerScene { scene, .. } = outlined(&deformed(), &curves, 2.0, 1e-3, Sides::Polygons).unwrap();
        assert_eq!(dielectrics(&scene), ["cover", "substrate", "layer"]);
        assert_eq!(scene.bodies[0].bounds().unwrap().min[1], 0.0);
        assert_eq!(scene.conductors().map(|c| c.body.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
        // Up to the walls at 5, where the surface is at 2.4 - 0.4 * 2 / 3.
        let at_wall = 2.4 - 0.8 / 3.0;
        let half = 1.8 * 2.0 + 0.5 * (1.8 + 2.4) + 0.5 * (2.4 + at_wall) * 2.0;
        assert!((area(outline(&scene, "layer")) - 2.0 * half).abs() < 1e-9);
    }

    #[test]
    fn in_open_space_the_surface_is_followed_to_its_level_and_goes_on_from_there() {
        let mut surface = line([0.0, 1.5], [2.0, 1.5]);
        surface.extend(&line([2.0, 1.5], [3.0, 2.4])[1..]);
        surface.extend(&line([3.0, 2.4], [6.0, 2.1])[1..]);
        surface.extend(&line([6.0, 2.1], [9.0, 2.1])[1..]);
        surface.extend(&line([9.0, 2.1], [13.0, 2.1])[1..]);
        let curves = DeformedCurves {
            electrodes: vec![faces([1.0, 3.0], [1.0, 1.5])],
            surface,
            half: true,
            heights: [1.5, 2.4],
        };
        let mut open = deformed();
        (open.scene.domain, open.scene.walls) = (Box3::SPACE, [[Wall::Open; 2]; 3]);
        for sides in [Sides::Curves, Sides::Polygons] {
            let LayerScene { scene, ends, .. } = outlined(&open, &curves, 2.0, 1e-3, sides).unwrap();
            assert_eq!(dielectrics(&scene), ["cover", "substrate", "layer"]);
            // The surface ends 0.1 above where it was, 10 from electrodes of half a width of 3.
            assert!((ends - 0.1 / 10.0 * 3.0 / 13.0).abs() < 1e-12, "{ends}");
            let layer = scene.bodies.iter().find(|body| body.name == "layer").unwrap();
            let [middle, left, right] = &layer.parts[..] else { panic!("{layer:?}") };
            let [Some(middle), Some(left), Some(right)] = [middle, left, right].map(Shape::bounds) else {
                panic!("{layer:?}")
            };
            assert_eq!((left.max[0], right.min[0]), (middle.min[0], middle.max[0]));
            assert!((6.0..8.0).contains(&middle.max[0]) && middle.min[0] == -middle.max[0]);
            for (slab, x) in [(left, -1e3), (right, 1e3)] {
                assert_eq!((slab.min[1], slab.max[1]), (0.0, 2.1));
                assert!(slab.contains([x, 1.0, 1e6]) && slab.contains([x, 2.0, -1e6]));
            }
            let holds = |x: f64, y: f64| layer.contains([x, y, 50.0]);
            assert!(holds(0.5, 1.49) && !holds(0.5, 1.51) && holds(-2.999, 2.39) && !holds(-2.999, 2.41));
            assert!(holds(5.99, 2.09) && holds(6.01, 2.09) && !holds(6.01, 2.11));
        }
        // Nearer to its end than the surface is off there, nothing is known.
        let LayerScene { ends, .. } = outlined(&open, &curves, 15.0, 1e-3, Sides::Curves).unwrap();
        assert_eq!(ends, 1.0);
    }

    #[test]
    fn a_surface_that_crosses_itself_is_refused_with_the_place() {
        let mut surface = vec![[0.0, 2.0], [1.2, 2.0], [0.9, 1.0], [1.1, 1.0], [0.8, 2.1], [4.0, 2.0]];
        let found = without_loops(&surface, 0.5).unwrap_err();
        assert!((found[1] - 2.0).abs() < 1e-12 && (0.8..0.9).contains(&found[0]), "{found:?}");
        // A small one is cut where it closes.
        let found = without_loops(&surface, 2.0).unwrap();
        assert_eq!((found.len(), found[0], found[2], found[3]), (4, [0.0, 2.0], [0.8, 2.1], [4.0, 2.0]));
        let electrodes = vec![faces([1.0, 3.0], [1.0, 1.5])];
        let curves = DeformedCurves { electrodes, surface: surface.clone(), half: true, heights: [1.0, 2.1] };
        let error = outlined(&deformed(), &curves, 2.0, 1e-3, Sides::Polygons).unwrap_err();
        assert!(error.to_string().contains("crosses itself at x1 = 8.2"), "{error}");
        surface[4] = [1.19, 1.9];
        assert_eq!(without_loops(&surface, 0.0), Ok(surface));
    }

    #[test]
    fn a_surface_that_hangs_over_is_cut_where_the_walls_are() {
        let hanging = vec![[-2.0, 1.0], [1.0, 1.0], [0.8, 1.5], [1.5, 2.0], [2.0, 2.0]];
        let domain = Box3 { min: [-1.0, 0.0, 0.0], max: [1.2, 3.0, 1.0] };
        let outline = under(&hanging, &domain);
        assert!(outline.iter().all(|p| (-1.0..=1.2).contains(&p[0]) && (0.0..=3.0).contains(&p[1])));
        assert!(outline.contains(&[0.8, 1.5]));
    }
}
