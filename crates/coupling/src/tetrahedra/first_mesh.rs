//! The first mesh of a solve on tetrahedra: the choice of mesher and element sizes, and the alternatives if
//! meshing fails.

use super::{FACETS, Planes};
use crate::failure::TetrahedraError;
use crate::settings::FieldSettings;
use elastocap_case::ImportedMesh;
use elastocap_geometry::meshing::tets::{LayeredSizing, MeshError, Sizing, TetMesh, layered, mesh_unless};
use elastocap_geometry::mirror;
use elastocap_geometry::scene::{Box3, Scene};
use elastocap_geometry::segments::distance_of_segments;
use elastocap_geometry::shapes::Shape;
use elastocap_linalg::vector::{length, minus};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Share of the tolerance that the faceting error may take. Tuned:
/// `benches/peers/capacitance.py --only elastocap --scene two-spheres`.
const SHARE: f64 = 0.2;

/// Smallest and largest face size, over the radius of curved bodies. Tuned:
/// `benches/peers/capacitance.py --only elastocap --scene two-spheres`.
const FACE_SIZES: [f64; 2] = [0.02, 0.3];

/// Least [`flatness`] at which a layered scene is meshed in layers, which needs no small triangles for thin
/// gaps.
pub(super) const FLAT: f64 = 12_000.0;

/// Least number of [`strips`] at which a layered scene is meshed in layers, whose triangles may be elongated.
const STRIPS: f64 = 300.0;

/// Growth of elements away from the edges of thin conductors. Measured:
/// `cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3`, which has its own copy.
const THIN_GROWTH: f64 = 0.3;

/// Largest number of points along the edges of thin conductors: the first mesh has a few hundred tetrahedra
/// for each. It is not tuned.
const MAX_EDGE_POINTS: f64 = 8_000.0;

/// Largest number of points along the edges of thin conductors in the mesh of a forecast. Not tuned: what
/// `check` may take.
pub(super) const FORECAST_EDGE_POINTS: f64 = 150.0;

/// Largest number of point insertions in the mesh of a forecast: a second or two for each size. Not tuned:
/// what `check` may take.
const FORECAST_INSERTIONS: usize = 20_000;

/// Largest number of corners of outlines in the mesh of a forecast. Not tuned: what `check` may take.
const FORECAST_CORNERS: usize = 5_000;

/// The purpose of a first mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A solve.
    Solve,
    /// A forecast of the cost of a solve.
    Forecast,
}

impl Purpose {
    /// Largest number of points along the edges of thin conductors.
    fn edge_points(self) -> f64 {
        match self {
            Self::Solve => MAX_EDGE_POINTS,
            Self::Forecast => FORECAST_EDGE_POINTS,
        }
    }

    /// Largest number of corners of all outlines that are meshed.
    fn max_corners(self) -> usize {
        match self {
            Self::Solve => usize::MAX,
            Self::Forecast => FORECAST_CORNERS,
        }
    }

    /// Largest number of point insertions; see [`Sizing::most_insertions`].
    fn most_insertions(self) -> usize {
        match self {
            Self::Solve => usize::MAX,
            Self::Forecast => FORECAST_INSERTIONS,
        }
    }
}

/// Largest length of mesh edges along thin conductors, relative to their width. It is not tuned.
const MAX_THIN_EDGE: f64 = 0.1;

/// Number of face sizes to try. It is not tuned.
const TRIES: usize = 4;

/// Largest angle between two faces of a tetrahedron, degrees, beyond which other sizes are tried: a single
/// such tetrahedron may spoil the lower bound. It is not tuned.
const LARGEST_ANGLE: f64 = 179.9;

/// Number of points beyond which no other size is tried if the surfaces cannot be recovered: that would take
/// too long. It is not tuned.
const FEW_POINTS: usize = 100_000;

/// Length of mesh edges along thin conductors, relative to their width, over the tolerance: the spread on the
/// first mesh is then two to three times the tolerance. Measured:
/// `cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3`, which has its own copy.
pub(super) const THIN_EDGE: f64 = 4.0;

/// The first mesh of a solve.
pub(super) struct First {
    /// The mesh of the part of the scene above the planes.
    pub(super) mesh: TetMesh,
    /// The mirror planes above which the scene is meshed.
    pub(super) planes: Planes,
    /// Face size over the radius on curved bodies.
    pub(super) size: f64,
    /// The least gap between balls, over their radius; see [`ball_gap`].
    pub(super) gap: f64,
}

/// Makes the first mesh, with face sizes multiplied by `smaller`. A mesh for a forecast that takes too much
/// work is abandoned with [`MeshError::Cancelled`].
pub(super) fn first(
    scene: &Scene,
    imported: Option<&ImportedMesh>,
    settings: &FieldSettings,
    smaller: f64,
    purpose: Purpose,
) -> Result<First, TetrahedraError> {
    // Between close balls, faces must also be small compared with the gap.
    let gap = ball_gap(scene)?;
    let size = (SHARE * settings.relative_tolerance / FACETS)
        .sqrt()
        .min((8.0 * settings.relative_tolerance * gap).sqrt());
    let size = smaller * size.clamp(FACE_SIZES[0], FACE_SIZES[1]);
    let (mesh, planes) = match imported {
        Some(imported) => (imported.tets.clone(), Planes::default()),
        None => {
            let planes = if settings.symmetry { mirror::planes(scene) } else { Planes::default() };
            let cancel = settings.cancel.as_ref();
            let fineness = Fineness { size, tolerance: settings.relative_tolerance, purpose, cancel };
            mesh_of(scene, fineness, planes)?
        }
    };
    Ok(First { mesh, planes, size, gap })
}

/// The fineness of a first mesh, and the flag that stops the mesher.
#[derive(Debug, Clone, Copy)]
struct Fineness<'a> {
    /// The face size over the radius on curved bodies.
    size: f64,
    /// The relative tolerance of the solve.
    tolerance: f64,
    /// The purpose of the mesh.
    purpose: Purpose,
    /// Stops the mesher when set.
    cancel: Option<&'a Arc<AtomicBool>>,
}

/// A mesh of the part above the planes, and these planes. If that part cannot be meshed, the whole scene is
/// meshed, without planes.
fn mesh_of(
    scene: &Scene,
    fineness: Fineness<'_>,
    planes: Planes,
) -> Result<(TetMesh, Planes), TetrahedraError> {
    let part = mirror::part(scene, &planes);
    match whole_of(&part, fineness) {
        Err(TetrahedraError::Mesh(MeshError::Cancelled)) => Err(MeshError::Cancelled.into()),
        Err(_) if part != *scene => whole_of(scene, fineness).map(|mesh| (mesh, Planes::default())),
        found => found.map(|mesh| (mesh, planes)),
    }
}

/// A mesh of a whole scene, by the mesher that suits it.
fn whole_of(scene: &Scene, fineness: Fineness<'_>) -> Result<TetMesh, TetrahedraError> {
    let Fineness { size, tolerance, cancel, .. } = fineness;
    let reach = reach(scene, tolerance);
    if strips(scene) <= STRIPS
        && let Some(sizing) = thin_metal(scene, fineness, reach)
    {
        match mesh_unless(scene, &sizing, cancel) {
            Ok(found) if found.refined => return Ok(found.mesh),
            Err(MeshError::Cancelled) => return Err(MeshError::Cancelled.into()),
            // The other meshers may succeed.
            Ok(_) | Err(_) => {}
        }
    }
    let corners = |shape: &Shape| match shape {
        Shape::Extrusion { outline, .. } => outline.len(),
        Shape::Cylinder { .. } | Shape::Tube { .. } => (std::f64::consts::TAU / size) as usize,
        // The planes of boxes cut the faces of other boxes.
        Shape::Box(_) => 16,
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => 4,
    };
    if scene.shapes().map(corners).sum::<usize>() > fineness.purpose.max_corners() {
        return Err(MeshError::Cancelled.into());
    }
    if flatness(scene) > FLAT || strips(scene) > STRIPS {
        // An even number of sides preserves the mirror symmetry of the circle.
        let circle = ((std::f64::consts::TAU / size).ceil() as usize).next_multiple_of(2);
        let sizing = LayeredSizing { circle, reach, ..LayeredSizing::default() };
        if let Some(found) = layered(scene, &sizing) {
            return Ok(found?);
        }
    }
    // Another size may avoid a flat tetrahedron that is due to rounding.
    let most_insertions = fineness.purpose.most_insertions();
    let mut sizing = Sizing { facet: size, far: 2.0 * reach, most_insertions, ..Sizing::default() };
    let mut flattest: Option<(f64, TetMesh)> = None;
    let mut tries = TRIES;
    loop {
        tries -= 1;
        match mesh_unless(scene, &sizing, cancel) {
            Ok(found) => {
                let angle = found.quality.largest_angle;
                let has_few_points = found.mesh.points.len() < FEW_POINTS;
                if flattest.as_ref().is_none_or(|(least, _)| angle < *least) {
                    flattest = Some((angle, found.mesh));
                }
                if angle < LARGEST_ANGLE || !has_few_points {
                    tries = 0;
                }
            }
            Err(MeshError::Cancelled) => return Err(MeshError::Cancelled.into()),
            Err(error) if tries == 0 || flattest.is_some() => {
                return flattest.map(|(_, mesh)| mesh).ok_or_else(|| error.into());
            }
            Err(
                MeshError::Flat { .. }
                | MeshError::Torn { .. }
                | MeshError::Leak { .. }
                | MeshError::Tangled { .. }
                | MeshError::Unreachable { points: ..FEW_POINTS, .. },
            ) => {}
            // Corners of facets lie outside round bodies: coarse facets may cross where the bodies do not.
            Err(MeshError::Crossing { .. } | MeshError::Near { .. }) => {
                sizing.facet *= 0.5;
                tries = tries.min(1);
                continue;
            }
            Err(error) => return Err(error.into()),
        }
        if tries == 0
            && let Some((_, mesh)) = flattest
        {
            return Ok(mesh);
        }
        sizing.facet *= 0.9;
        // The mesh of bodies that are not round does not depend on the face size.
        sizing.growth *= 0.95;
    }
}

/// The sizing for a scene with thin conductors; `None` without any, or if their edges are too long for fine
/// elements.
fn thin_metal(scene: &Scene, fineness: Fineness<'_>, reach: f64) -> Option<Sizing> {
    let sizing = |thin_edge: f64| Sizing {
        facet: fineness.size,
        thin_edge,
        growth: THIN_GROWTH,
        far: 2.0 * reach,
        most_insertions: fineness.purpose.most_insertions(),
        ..Sizing::default()
    };
    let wanted = THIN_EDGE * fineness.tolerance;
    let points = sizing(wanted).points_along_thin_edges(scene)?;
    let edge_for = |most: f64| wanted * (points / most).max(1.0);
    let (finest, coarsest) = (edge_for(MAX_EDGE_POINTS), wanted.max(MAX_THIN_EDGE));
    (finest <= coarsest).then(|| sizing(edge_for(fineness.purpose.edge_points()).clamp(finest, coarsest)))
}

/// Distance at which open space begins, over the size of the scene. The loss of the bounds outside falls with
/// its square (measured on spheres and pads). Infinite dielectrics need a larger distance.
fn reach(scene: &Scene, tolerance: f64) -> f64 {
    let is_infinite = |b: Box3| (0..3).any(|a| b.min[a].is_infinite() || b.max[a].is_infinite());
    let has_infinite_dielectrics =
        scene.dielectric_parts().any(|(_, part)| part.as_box().is_some_and(is_infinite));
    let lost = if has_infinite_dielectrics { 0.6 } else { 0.004 };
    (lost / (SHARE * tolerance)).sqrt().clamp(10.0, 40.0)
}

/// Approximate number of cubes that would cover the conductors, as seen along the axis along which there are
/// most of them. Their side is the smallest distance along this axis between faces of the conductors' boxes.
pub(super) fn flatness(scene: &Scene) -> f64 {
    let shapes: Vec<(&Shape, Box3)> =
        scene.conductor_parts().filter_map(|(_, part)| Some((part, part.bounds()?))).collect();
    let size = shapes.iter().flat_map(|(_, b)| [0, 1, 2].map(|a| b.extent(a))).fold(0.0, f64::max);
    let axes = (0..3).map(|axis| {
        let mut planes: Vec<f64> = shapes.iter().flat_map(|(_, b)| [b.min[axis], b.max[axis]]).collect();
        planes.sort_by(f64::total_cmp);
        let gaps = planes.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 1e-6 * size);
        let lowest = gaps.fold(f64::INFINITY, f64::min);
        shapes.iter().map(|(shape, b)| area(shape, b, axis)).sum::<f64>() / (lowest * lowest)
    });
    axes.fold(0.0, f64::max)
}

/// Approximate number of squares that would cover the sides of finite extrusions: large where an outline
/// follows a curve.
fn strips(scene: &Scene) -> f64 {
    let squares = |shape: &Shape| {
        let Shape::Extrusion { from, to, outline, .. } = shape else { return 0.0 };
        let next = outline.iter().cycle().skip(1);
        let sides = outline.iter().zip(next).map(|(p, q)| (q[0] - p[0]).hypot(q[1] - p[1]));
        sides.map(|side| (to - from) / side).filter(|ratio| *ratio > 1.0 && ratio.is_finite()).sum()
    };
    scene.shapes().map(squares).sum()
}

/// The gap between two balls or capsules, or between one and the shell around it, m, and the smaller radius,
/// m. `None` for other shapes, whose gaps are those of their facets.
fn gap_between(one: &Shape, other: &Shape) -> Option<(f64, f64)> {
    /// The ends of the axis segment, the radius, and whether the shape is a shell.
    fn round(shape: &Shape) -> Option<([[f64; 3]; 2], f64, bool)> {
        match shape {
            Shape::Sphere { center, radius } => Some(([*center; 2], *radius, false)),
            Shape::Capsule { from, to, radius } => Some(([*from, *to], *radius, false)),
            Shape::Shell { center, radius } => Some(([*center; 2], *radius, true)),
            Shape::Box(_)
            | Shape::Cylinder { .. }
            | Shape::Tube { .. }
            | Shape::Extrusion { .. }
            | Shape::Surface(_)
            | Shape::Physical(_) => None,
        }
    }
    let ((c, r, r_hollow), (d, s, s_hollow)) = (round(one)?, round(other)?);
    let apart = distance_of_segments(c, d);
    // Inside a shell, the end that is farther from its center counts.
    let farther = || c.iter().flat_map(|p| d.map(|q| length(minus(*p, q)))).fold(0.0, f64::max);
    match (r_hollow, s_hollow) {
        (false, false) => Some((apart - r - s, r.min(s))),
        (false, true) => Some((s - farther() - r, r)),
        (true, false) => Some((r - farther() - s, s)),
        // A scene has at most one shell.
        (true, true) => None,
    }
}

/// Approximate area of a body's projection along an axis, m^2.
fn area(shape: &Shape, b: &Box3, along: usize) -> f64 {
    match shape {
        Shape::Extrusion { axis, outline, .. } if *axis == along => {
            let next = outline.iter().cycle().skip(1);
            0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>().abs()
        }
        Shape::Box(_)
        | Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Extrusion { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => b.extent((along + 1) % 3) * b.extent((along + 2) % 3),
    }
}

/// The least gap between balls of different conductors, or between one and the shell around it, over the
/// radius of the smaller; at most 1.
///
/// # Errors
/// Two conductors touch or cross.
pub(super) fn ball_gap(scene: &Scene) -> Result<f64, TetrahedraError> {
    let mut least = 1.0_f64;
    let parts: Vec<(usize, &Shape)> = scene.conductor_parts().collect();
    let name = |k: usize| scene.conductors().nth(k).map_or("", |c| c.body.name.as_str());
    for (k, &(one, shape)) in parts.iter().enumerate() {
        for &(other, earlier) in parts[..k].iter().filter(|(other, _)| *other != one) {
            let Some((gap, radius)) = gap_between(shape, earlier) else { continue };
            if gap <= 0.0 {
                let [first, second] = [other, one].map(|conductor| name(conductor).to_owned());
                return Err(TetrahedraError::Touching { first, second });
            }
            least = least.min(gap / radius);
        }
    }
    Ok(least)
}
