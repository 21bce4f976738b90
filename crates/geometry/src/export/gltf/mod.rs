//! `scene.glb`: the bodies of a scene, and how they move under load, for any glTF viewer.
//!
//! Lengths are SI: mesh positions and node translations are in metres, with x1, x2, x3 as glTF's x, y (up),
//! z; both systems are right-handed. Viewers expect objects of the size of a chair or a house and would not
//! show a 450 um sensor, so one root node scales the scene to between 1 and 2.5 units, and states that in its
//! name and its extras.
//!
//! Positions are 32-bit, too coarse for a 1 nm electrode in a 1 mm layer. Every mesh is therefore written
//! about the centre of its body, and the node moves the body to its place.
//!
//! A load step is a morph target: the displacement of every corner from step 0, m. Between two steps the
//! corners move on straight lines. A body that never moves has no targets.

mod animation;
mod box_mesh;
mod buffers;
mod document;
mod error;
mod materials;
mod units;

use gltf_json as json;

use crate::scene::{Body, Box3, Potential, Purpose, Role};
use box_mesh::{BoxSurface, SharedSurfaces};

pub(super) use buffers::triangles;
pub(super) use document::{File, extras};
pub use error::GltfError;
pub(super) use materials::Materials;
pub(super) use units::SceneUnit;
pub use units::round_length;

/// The kind of a body, which determines its material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BodyRole {
    /// Metal that is held at a potential: opaque, in colours that take turns.
    Conductor,
    /// Metal that floats: opaque, in shades of green.
    FloatingConductor,
    /// Metal at potential zero: opaque and grey.
    GroundedConductor,
    /// The elastomer: translucent, so that the electrodes in it show.
    Layer,
    /// Any other dielectric: translucent, in pale colours that take turns.
    Dielectric,
    /// The substrate, on which the layer lies: translucent.
    Substrate,
    /// The cover above the layer: faintly translucent.
    Cover,
    /// An insulated wall of the computed region: barely visible.
    Wall,
    /// A wall at potential zero: a little darker.
    GroundedWall,
    /// The indenter, which presses on the layer: translucent, so that it does not hide the surface under it.
    Indenter,
    /// A bar of a round length, which its name states.
    ScaleBar,
    /// The air around: barely visible.
    Surroundings,
}

impl From<&Body> for BodyRole {
    fn from(body: &Body) -> Self {
        match (body.role, body.purpose) {
            (_, Purpose::Indenter) => Self::Indenter,
            (Role::Conductor { potential: Potential::Driven }, _) => Self::Conductor,
            (Role::Conductor { potential: Potential::Grounded }, _) => Self::GroundedConductor,
            (Role::Conductor { potential: Potential::Floating { .. } }, _) => Self::FloatingConductor,
            (Role::Dielectric { .. }, Purpose::Layer) => Self::Layer,
            (Role::Dielectric { .. }, Purpose::Substrate) => Self::Substrate,
            (Role::Dielectric { .. }, Purpose::Cover) => Self::Cover,
            (
                Role::Dielectric { .. },
                Purpose::Electrode | Purpose::InLayer | Purpose::OnTop | Purpose::OnIndenter | Purpose::Fixed,
            ) => Self::Dielectric,
        }
    }
}

impl BodyRole {
    /// The role's name in the file.
    pub(in crate::export) fn name(self) -> &'static str {
        match self {
            Self::Conductor => "conductor",
            Self::FloatingConductor => "floating conductor",
            Self::GroundedConductor => "grounded conductor",
            Self::Layer => "layer",
            Self::Dielectric => "dielectric",
            Self::Substrate => "substrate",
            Self::Cover => "cover",
            Self::Wall => "wall",
            Self::GroundedWall => "grounded wall",
            Self::Indenter => "indenter",
            Self::ScaleBar => "scale bar",
            Self::Surroundings => "surroundings",
        }
    }
}

/// The text between the name of a body and the number of one of its parts.
const PART: &str = ", part ";

/// The name of a part of a body, counted from zero. Parts of one body look alike.
pub fn part_name(body: &str, part: usize) -> String {
    if part == 0 { body.to_owned() } else { format!("{body}{PART}{}", part + 1) }
}

/// A body as the viewer shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneBody {
    /// Name of its node, mesh and material.
    pub name: String,
    /// The kind of body.
    pub role: BodyRole,
    /// Its box or sheet at each load step, m, all finite: bodies that extend to infinity must be cut off
    /// first.
    pub poses: Vec<Box3>,
}

impl SceneBody {
    /// Whether the body has another pose at some step.
    fn moves(&self) -> bool {
        self.poses.windows(2).any(|pair| pair[0] != pair[1])
    }
}

/// The scene as a binary glTF file; `step_labels` name the load steps, for instance `U/H = 0.05`.
///
/// The first step is the base shape. The others are morph targets, which the animation "load steps" plays at
/// one second per step.
///
/// # Errors
/// When a body is not a finite box or sheet at every step: see [`GltfError`].
///
/// ```
/// use elastocap_geometry::export::gltf::{glb, BodyRole, SceneBody};
/// use elastocap_geometry::scene::Box3;
///
/// let layer = SceneBody {
///     name: "layer".into(),
///     role: BodyRole::Layer,
///     poses: vec![
///         Box3 { min: [0.0, 0.0, 0.0], max: [1e-3, 450e-6, 1e-3] },
///         Box3 { min: [0.0, 0.0, 0.0], max: [1e-3, 405e-6, 1e-3] },
///     ],
/// };
/// let file = glb(&[layer], &["U/H = 0".into(), "U/H = 0.1".into()])?;
/// assert_eq!(&file[..4], b"glTF");
/// # Ok::<(), elastocap_geometry::export::gltf::GltfError>(())
/// ```
pub fn glb(bodies: &[SceneBody], step_labels: &[String]) -> Result<Vec<u8>, GltfError> {
    let bounds = checked_bounds(bodies, step_labels.len())?;
    let unit = SceneUnit::for_extent((0..3).fold(0.0, |l, a| bounds.extent(a).max(l)))?;
    let centre = centre(&bounds);

    let mut file = File::default();
    let clock = bodies.iter().any(SceneBody::moves).then(|| file.clock(step_labels.len()));
    let mut shared = SharedSurfaces::default();
    let mut materials = Materials::default();
    let mut children = Vec::with_capacity(bodies.len());
    for body in bodies {
        let surface = BoxSurface::of(&body.poses);
        let material =
            file.root.push(materials.material(&body.name, body.role, surface != BoxSurface::Solid));
        let home = centre_of_first(body);
        let mesh = file.mesh(body, surface, home, material, step_labels, &mut shared)?;
        let node = file.root.push(json::Node {
            name: Some(body.name.clone()),
            mesh: Some(mesh),
            translation: Some([0, 1, 2].map(|a| (home[a] - centre[a]) as f32)),
            extras: extras(&serde_json::json!({ "role": body.role.name() }))?,
            ..Default::default()
        });
        children.push(node);
        if let (true, Some(clock)) = (body.moves(), clock) {
            file.animate(node, clock);
        }
    }
    file.finish(children, &unit, centre, step_labels)
}

/// The box around all bodies at all steps, after a check that each is a finite box or sheet at every step.
fn checked_bounds(bodies: &[SceneBody], steps: usize) -> Result<Box3, GltfError> {
    let mut bounds: Option<Box3> = None;
    for body in bodies {
        if body.poses.len() != steps {
            return Err(GltfError::PoseCount {
                body: body.name.clone(),
                found: body.poses.len(),
                expected: steps,
            });
        }
        for (step, pose) in body.poses.iter().enumerate() {
            if !pose.min.iter().chain(&pose.max).all(|x| x.is_finite()) {
                return Err(GltfError::NotFinite { body: body.name.clone(), step });
            }
            let flat = (0..3).filter(|&a| pose.extent(a) == 0.0).count();
            if flat > 1 || (0..3).any(|a| pose.extent(a) < 0.0) {
                return Err(GltfError::NotABody { body: body.name.clone(), step });
            }
            bounds = Some(bounds.map_or(*pose, |b| b.union(pose)));
        }
    }
    bounds.ok_or(GltfError::Empty)
}

/// The middle of a box, m.
pub(in crate::export) fn centre(region: &Box3) -> [f64; 3] {
    [0, 1, 2].map(|a| 0.5 * region.min[a] + 0.5 * region.max[a])
}

/// The middle of a body at the first step, m.
fn centre_of_first(body: &SceneBody) -> [f64; 3] {
    body.poses.first().map_or([0.0; 3], centre)
}
