//! `scene.glb`: the bodies of a scene, and how they move under load, for any glTF viewer.
//!
//! The file keeps SI units where it can: mesh positions and node translations are metres, with x1, x2, x3 as glTF's
//! x, y (up), z, which are right-handed both. A viewer that is made for chairs and houses would show a 450 um sensor
//! as nothing, so one root node scales the whole to between 1 and 2.5 units and says so in its name and its extras.
//!
//! Positions are 32-bit, and a 1 nm electrode in a 1 mm layer would lose its thickness in them. So every mesh is
//! written about the centre of its own body, and the node carries the body to its place.
//!
//! A load step is a morph target: the displacement of every corner from step 0. Between two steps the corners move
//! on straight lines. A body that never moves has no targets.

use std::ops::Range;

use gltf::binary::{Glb, Header};
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::extras::{Extras, RawValue};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::USize64;
use gltf_json::{self as json, Index, Value};

use crate::scene::{Body, Box3, Purpose, Role};

/// What a body is to a viewer: decides how it looks. Walls and open space are shown too, which are no bodies of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BodyRole {
    /// Metal: opaque, each in a colour of its own.
    Conductor,
    /// The elastomer: translucent, so that the electrodes in it show.
    Layer,
    /// Any other dielectric: translucent, each in a colour of its own.
    Dielectric,
    /// What the layer lies on: opaque.
    Substrate,
    /// What lies above the layer: faintly translucent.
    Cover,
    /// An outer wall: barely visible.
    Wall,
    /// The air around: barely visible.
    Surroundings,
}

impl From<&Body> for BodyRole {
    fn from(body: &Body) -> Self {
        match (body.role, body.purpose) {
            (Role::Conductor { .. }, _) => Self::Conductor,
            (Role::Dielectric { .. }, Purpose::Layer) => Self::Layer,
            (Role::Dielectric { .. }, Purpose::Substrate) => Self::Substrate,
            (Role::Dielectric { .. }, Purpose::Cover) => Self::Cover,
            (Role::Dielectric { .. }, Purpose::Electrode | Purpose::Fixed) => Self::Dielectric,
        }
    }
}

impl BodyRole {
    /// The role's name in the file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Conductor => "conductor",
            Self::Layer => "layer",
            Self::Dielectric => "dielectric",
            Self::Substrate => "substrate",
            Self::Cover => "cover",
            Self::Wall => "wall",
            Self::Surroundings => "surroundings",
        }
    }
}

/// A body as the viewer shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneBody {
    /// Name of its node, mesh and material.
    pub name: String,
    /// What it is.
    pub role: BodyRole,
    /// Where it is at each load step, m: finite boxes, or sheets. Open bodies are to be cut off first.
    pub poses: Vec<Box3>,
}

impl SceneBody {
    fn moves(&self) -> bool {
        self.poses.windows(2).any(|pair| pair[0] != pair[1])
    }
}

/// Why a scene cannot be written as glTF.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GltfError {
    /// There is nothing to show.
    #[error("a scene file needs at least one body and one load step")]
    Empty,
    /// A body is not known at every step.
    #[error("body `{body}` has {found} poses, but there are {expected} load steps")]
    PoseCount {
        /// Its name.
        body: String,
        /// Its poses.
        found: usize,
        /// The step labels.
        expected: usize,
    },
    /// A bound is infinite or not a number.
    #[error("body `{body}` has no finite box at load step {step}; cut it off at the scene's walls first")]
    NotFinite {
        /// Its name.
        body: String,
        /// Position in the list of steps.
        step: usize,
    },
    /// Upper bound below the lower one, or no extent along two axes.
    #[error("body `{body}` is neither a box nor a sheet at load step {step}")]
    NotABody {
        /// Its name.
        body: String,
        /// Position in the list of steps.
        step: usize,
    },
    /// 32-bit positions cannot hold it.
    #[error("the scene is {extent:e} m large; a scene file holds 1e-30 m to 1e30 m")]
    OutOfRange {
        /// Largest extent, m.
        extent: f64,
    },
    /// More than the 4 GB that the format can address.
    #[error("the scene is too large for a binary glTF file")]
    TooLarge,
    /// The writer refused; not expected.
    #[error("the glTF writer failed: {0}")]
    Writer(String),
}

/// The scene as a binary glTF file; `step_labels` name the load steps, for instance `U/H = 0.05`.
///
/// The first step is the shape as loaded; the others are morph targets, played at one second per step by the
/// animation "load steps".
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
    let mut shared = SharedShapes::default();
    let mut looks = Looks::default();
    let mut children = Vec::with_capacity(bodies.len());
    for body in bodies {
        let shape = Shape::of(&body.poses);
        let material = file.root.push(looks.material(&body.name, body.role, shape != Shape::Solid));
        let home = centre_of_first(body);
        let mesh = file.mesh(body, shape, home, material, step_labels, &mut shared)?;
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

/// The box around all bodies at all steps, once each of them is known to be sound.
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

pub(super) fn centre(region: &Box3) -> [f64; 3] {
    [0, 1, 2].map(|a| 0.5 * region.min[a] + 0.5 * region.max[a])
}

fn centre_of_first(body: &SceneBody) -> [f64; 3] {
    body.poses.first().map_or([0.0; 3], centre)
}

pub(super) fn extras(value: &Value) -> Result<Extras, GltfError> {
    RawValue::from_string(value.to_string()).map(Some).map_err(|e| GltfError::Writer(e.to_string()))
}

/// The length that one unit of the viewer stands for.
pub(super) struct SceneUnit {
    metres: f64,
    scale: f64,
    label: String,
}

impl SceneUnit {
    /// The largest of 1, 2 and 5 times a power of ten metres that is not larger than the scene.
    pub(super) fn for_extent(extent: f64) -> Result<Self, GltfError> {
        if !(1e-30..=1e30).contains(&extent) {
            return Err(GltfError::OutOfRange { extent });
        }
        // Through decimal text, because powi(10, -6) is not the number nearest to 1e-6.
        let decimal = |digit: i32, power: i32| format!("{digit}e{power}").parse::<f64>().unwrap_or(f64::NAN);
        let power = extent.log10().floor() as i32;
        // One decade to spare on each side: log10 may round across a power of ten.
        let mut candidates = (power - 1..=power + 1).flat_map(|k| [1, 2, 5].map(|digit| (digit, k)));
        let (digit, power) = candidates
            .rfind(|&(digit, k)| decimal(digit, k) <= extent)
            .ok_or(GltfError::OutOfRange { extent })?;
        let scale = match digit {
            1 => decimal(1, -power),
            2 => decimal(5, -power - 1),
            _ => decimal(2, -power - 1),
        };
        let prefixes = ["f", "p", "n", "u", "m", "", "k", "M", "G"];
        let label = match prefixes.get((power.div_euclid(3) + 5) as usize) {
            Some(prefix) => format!("{} {prefix}m", digit * 10_i32.pow(power.rem_euclid(3) as u32)),
            None => format!("{digit}e{power} m"),
        };
        Ok(Self { metres: decimal(digit, power), scale, label })
    }
}

/// Topology of a body's mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// Six faces with flat normals.
    Solid,
    /// One face across an axis, seen from both sides.
    Sheet(usize),
}

/// A corner of a box: for each axis, whether it lies at the upper bound.
type Corner = [bool; 3];

impl Shape {
    /// A sheet if the body is one, across the same axis, at every step; a solid may be flat at some.
    fn of(poses: &[Box3]) -> Self {
        match poses.first().and_then(Box3::sheet_normal) {
            Some(axis) if poses.iter().all(|p| p.extent(axis) == 0.0) => Self::Sheet(axis),
            _ => Self::Solid,
        }
    }

    /// Faces as (axis across, whether it is the upper one).
    fn faces(self) -> Vec<(usize, bool)> {
        match self {
            Self::Sheet(axis) => vec![(axis, true)],
            Self::Solid => (0..3).flat_map(|axis| [(axis, false), (axis, true)]).collect(),
        }
    }

    /// The corners of all faces, four each, counter-clockwise as seen from outside.
    fn corners(self) -> Vec<(Corner, [f32; 3])> {
        let mut out = Vec::with_capacity(24);
        for (axis, upper) in self.faces() {
            // (axis, u, v) is a cyclic permutation, hence right-handed.
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [(false, false), (true, false), (true, true), (false, true)];
            let mut normal = [0.0; 3];
            normal[axis] = if upper { 1.0 } else { -1.0 };
            for turn in 0..4 {
                let (at_u, at_v) = if upper { around[turn] } else { around[3 - turn] };
                let mut corner = [upper; 3];
                corner[u] = at_u;
                corner[v] = at_v;
                out.push((corner, normal));
            }
        }
        out
    }

    fn indices(self) -> Vec<u16> {
        let faces = self.faces().len() as u16;
        (0..faces).flat_map(|f| [0, 1, 2, 0, 2, 3].map(|i| 4 * f + i)).collect()
    }
}

/// What bodies of the same shape have in common.
#[derive(Default)]
struct SharedShapes {
    known: Vec<(Shape, Index<json::Accessor>, Index<json::Accessor>)>,
}

/// Hands out materials: a role has its look, and conductors and dielectrics each a colour of their own.
#[derive(Default)]
pub(super) struct Looks {
    conductors: usize,
    dielectrics: usize,
}

/// Metals that can be told apart: copper, silver, gold, rose, gunmetal, brass, verdigris, bronze (sRGB).
const METALS: [[u8; 3]; 8] = [
    [0xC8, 0x75, 0x33],
    [0xB4, 0xBC, 0xC8],
    [0xE6, 0xB4, 0x22],
    [0xC4, 0x5A, 0x6A],
    [0x54, 0x60, 0x6E],
    [0x9C, 0xA8, 0x2E],
    [0x3E, 0x8E, 0x7E],
    [0x7A, 0x4A, 0x2A],
];

/// Dielectrics other than the layer (sRGB).
const DIELECTRICS: [[u8; 3]; 5] =
    [[0x8E, 0x6C, 0xC0], [0x5F, 0xA8, 0x5B], [0xC8, 0x6F, 0xA0], [0x5B, 0x7F, 0xC8], [0xB0, 0x98, 0x60]];

impl Looks {
    pub(super) fn material(&mut self, name: &str, role: BodyRole, double_sided: bool) -> json::Material {
        let next = |palette: &[[u8; 3]], count: &mut usize| {
            let colour = palette[*count % palette.len()];
            *count += 1;
            colour
        };
        // Only partly metallic: a pure metal is black in viewers that have no surroundings to mirror.
        let (colour, alpha, metallic, roughness) = match role {
            BodyRole::Conductor => (next(&METALS, &mut self.conductors), 1.0, 0.3, 0.4),
            BodyRole::Layer => ([0x5A, 0xB4, 0xD6], 0.3, 0.0, 0.4),
            BodyRole::Dielectric => (next(&DIELECTRICS, &mut self.dielectrics), 0.4, 0.0, 0.5),
            BodyRole::Substrate => ([0x9A, 0xA0, 0xA6], 1.0, 0.0, 0.9),
            BodyRole::Cover => ([0xD8, 0xDC, 0xE0], 0.2, 0.0, 0.3),
            BodyRole::Wall => ([0x9A, 0xA0, 0xA8], 0.12, 0.0, 1.0),
            BodyRole::Surroundings => ([0xC4, 0xD8, 0xEC], 0.06, 0.0, 1.0),
        };
        let [red, green, blue] = colour.map(linear);
        json::Material {
            name: Some(name.to_owned()),
            alpha_mode: Valid(if alpha < 1.0 {
                json::material::AlphaMode::Blend
            } else {
                json::material::AlphaMode::Opaque
            }),
            // The far faces of a translucent solid would be drawn through the near ones, in no order.
            double_sided,
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                base_color_factor: json::material::PbrBaseColorFactor([red, green, blue, alpha]),
                metallic_factor: json::material::StrengthFactor(metallic),
                roughness_factor: json::material::StrengthFactor(roughness),
                ..Default::default()
            },
            ..Default::default()
        }
    }
}

/// From a picture's 0..255 to the linear light that glTF wants.
fn linear(srgb: u8) -> f32 {
    let x = f32::from(srgb) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Times and weights that every moving body follows.
#[derive(Clone, Copy)]
struct Clock {
    times: Index<json::Accessor>,
    weights: Index<json::Accessor>,
}

/// The file as it grows: the JSON part, and the three sections of the binary one.
#[derive(Default)]
pub(super) struct File {
    pub(super) root: json::Root,
    vertices: Vec<u8>,
    indices: Vec<u8>,
    keyframes: Vec<u8>,
    channels: Vec<json::animation::Channel>,
    samplers: Vec<json::animation::Sampler>,
}

/// Sections of the binary part; [`File::into_bytes`] makes a buffer view of each that is not empty.
const VERTICES: u32 = 0;
const INDICES: u32 = 1;
const KEYFRAMES: u32 = 2;

fn accessor(view: u32, bytes: Range<usize>, component: ComponentType, kind: Type) -> json::Accessor {
    let size = component.size() * kind.multiplicity();
    json::Accessor {
        buffer_view: Some(Index::new(view)),
        byte_offset: Some(USize64::from(bytes.start)),
        count: USize64::from(bytes.len() / size),
        component_type: Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}

fn append<const N: usize>(section: &mut Vec<u8>, items: impl IntoIterator<Item = [u8; N]>) -> Range<usize> {
    let start = section.len();
    section.extend(items.into_iter().flatten());
    start..section.len()
}

/// A mesh of triangles, three corners after three corners unless it gets indices.
pub(super) fn triangles(
    name: &str,
    material: Index<json::Material>,
    positions: Index<json::Accessor>,
    normals: Index<json::Accessor>,
) -> json::Mesh {
    json::Mesh {
        extensions: None,
        extras: None,
        name: Some(name.to_owned()),
        weights: None,
        primitives: vec![json::mesh::Primitive {
            attributes: [
                (Valid(json::mesh::Semantic::Positions), positions),
                (Valid(json::mesh::Semantic::Normals), normals),
            ]
            .into(),
            extensions: None,
            extras: None,
            indices: None,
            material: Some(material),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
        }],
    }
}

impl File {
    /// Vectors with their exact bounds, as the format demands for positions.
    pub(super) fn vectors(&mut self, vectors: &[[f32; 3]], bounds: bool) -> Index<json::Accessor> {
        let bytes = append(&mut self.vertices, vectors.iter().flatten().map(|x| x.to_le_bytes()));
        let mut entry = accessor(VERTICES, bytes, ComponentType::F32, Type::Vec3);
        if bounds {
            let over = |pick: fn(f32, f32) -> f32, start: f32| {
                vectors.iter().fold([start; 3], |b, v| [0, 1, 2].map(|a| pick(b[a], v[a])))
            };
            entry.min = Some(over(f32::min, f32::INFINITY).to_vec().into());
            entry.max = Some(over(f32::max, f32::NEG_INFINITY).to_vec().into());
        }
        self.root.push(entry)
    }

    fn mesh(
        &mut self,
        body: &SceneBody,
        shape: Shape,
        home: [f64; 3],
        material: Index<json::Material>,
        step_labels: &[String],
        shared: &mut SharedShapes,
    ) -> Result<Index<json::Mesh>, GltfError> {
        let corners = shape.corners();
        let (normals, indices) = self.shape_accessors(shape, &corners, shared);
        let place = |pose: &Box3| -> Vec<[f64; 3]> {
            let at = |corner: &Corner, a: usize| if corner[a] { pose.max[a] } else { pose.min[a] };
            corners.iter().map(|(corner, _)| [0, 1, 2].map(|a| at(corner, a) - home[a])).collect()
        };
        let base: Vec<[f32; 3]> = match body.poses.first() {
            Some(pose) => place(pose).iter().map(|p| p.map(|x| x as f32)).collect(),
            None => Vec::new(),
        };
        let positions = self.vectors(&base, true);
        let mut targets = Vec::new();
        for pose in body.poses.iter().skip(1).filter(|_| body.moves()) {
            // From the rounded base, so that base + displacement is as near to the pose as 32 bits allow.
            let displacement: Vec<[f32; 3]> = (place(pose).iter().zip(&base))
                .map(|(to, from)| [0, 1, 2].map(|a| (to[a] - f64::from(from[a])) as f32))
                .collect();
            targets.push(json::mesh::MorphTarget {
                positions: Some(self.vectors(&displacement, true)),
                normals: None,
                tangents: None,
            });
        }
        let target_names = serde_json::json!({ "targetNames": step_labels.get(1..) });
        let mut mesh = triangles(&body.name, material, positions, normals);
        mesh.primitives[0].indices = Some(indices);
        if body.moves() {
            mesh.extras = extras(&target_names)?;
            mesh.weights = Some(vec![0.0; targets.len()]);
            mesh.primitives[0].targets = Some(targets);
        }
        Ok(self.root.push(mesh))
    }

    fn shape_accessors(
        &mut self,
        shape: Shape,
        corners: &[(Corner, [f32; 3])],
        shared: &mut SharedShapes,
    ) -> (Index<json::Accessor>, Index<json::Accessor>) {
        if let Some((_, normals, indices)) = shared.known.iter().find(|(known, ..)| *known == shape) {
            return (*normals, *indices);
        }
        let directions: Vec<[f32; 3]> = corners.iter().map(|(_, normal)| *normal).collect();
        let normals = self.vectors(&directions, false);
        let bytes = append(&mut self.indices, shape.indices().into_iter().map(u16::to_le_bytes));
        let indices = self.root.push(accessor(INDICES, bytes, ComponentType::U16, Type::Scalar));
        shared.known.push((shape, normals, indices));
        (normals, indices)
    }

    /// One second per step; at each, the weight of its own target is 1 and step 0 is where all are 0.
    fn clock(&mut self, steps: usize) -> Clock {
        let times = self.seconds(steps);
        let weight = |step: usize, target: usize| if step == target { 1.0_f32 } else { 0.0 };
        let weights = append(
            &mut self.keyframes,
            (0..steps).flat_map(|s| (1..steps).map(move |t| weight(s, t).to_le_bytes())),
        );
        let weights = self.root.push(accessor(KEYFRAMES, weights, ComponentType::F32, Type::Scalar));
        Clock { times, weights }
    }

    /// The times of the steps: one second each.
    pub(super) fn seconds(&mut self, steps: usize) -> Index<json::Accessor> {
        let times = append(&mut self.keyframes, (0..steps).map(|s| (s as f32).to_le_bytes()));
        let mut input = accessor(KEYFRAMES, times, ComponentType::F32, Type::Scalar);
        input.min = Some(vec![0.0_f32].into());
        input.max = Some(vec![steps.saturating_sub(1) as f32].into());
        self.root.push(input)
    }

    /// Shows a node at one of the steps, at these times, and gives it no size at the others.
    pub(super) fn show_at(
        &mut self,
        node: Index<json::Node>,
        times: Index<json::Accessor>,
        step: usize,
        steps: usize,
    ) {
        let size = |s: usize| if s == step { 1.0_f32 } else { 0.0 };
        let scales = append(&mut self.keyframes, (0..steps).flat_map(|s| [size(s).to_le_bytes(); 3]));
        let output = self.root.push(accessor(KEYFRAMES, scales, ComponentType::F32, Type::Vec3));
        self.channels.push(json::animation::Channel {
            sampler: Index::new(self.samplers.len() as u32),
            target: json::animation::Target {
                extensions: None,
                extras: None,
                node,
                path: Valid(json::animation::Property::Scale),
            },
            extensions: None,
            extras: None,
        });
        self.samplers.push(json::animation::Sampler {
            extensions: None,
            extras: None,
            input: times,
            interpolation: Valid(json::animation::Interpolation::Step),
            output,
        });
    }

    fn animate(&mut self, node: Index<json::Node>, clock: Clock) {
        if self.samplers.is_empty() {
            self.samplers.push(json::animation::Sampler {
                extensions: None,
                extras: None,
                input: clock.times,
                interpolation: Valid(json::animation::Interpolation::Linear),
                output: clock.weights,
            });
        }
        self.channels.push(json::animation::Channel {
            sampler: Index::new(0),
            target: json::animation::Target {
                extensions: None,
                extras: None,
                node,
                path: Valid(json::animation::Property::MorphTargetWeights),
            },
            extensions: None,
            extras: None,
        });
    }

    /// Puts the nodes of the bodies under a root that scales them, and ends the file.
    pub(super) fn finish(
        mut self,
        children: Vec<Index<json::Node>>,
        unit: &SceneUnit,
        centre: [f64; 3],
        step_labels: &[String],
    ) -> Result<Vec<u8>, GltfError> {
        let root = self.root.push(json::Node {
            name: Some(format!("elastocap scene, scaled by {} (1 unit = {})", unit.scale, unit.label)),
            children: Some(children),
            scale: Some([unit.scale as f32; 3]),
            extras: extras(&serde_json::json!({
                "metres_per_unit": unit.metres,
                "scale": unit.scale,
                "scene_centre_m": centre,
            }))?,
            ..Default::default()
        });
        let scene = self.root.push(json::Scene {
            extensions: None,
            extras: None,
            name: Some("elastocap scene".into()),
            nodes: vec![root],
        });
        self.root.scene = Some(scene);
        self.root.asset = json::Asset {
            generator: Some(concat!("elastocap ", env!("CARGO_PKG_VERSION")).into()),
            extras: extras(&serde_json::json!({
                "about": "Mesh positions and node translations are in metres; the root node scales them for viewing.",
                "metres_per_unit": unit.metres,
                "scale": unit.scale,
                "axes": "x = x1 (in-plane), y = x2 (up), z = x3 (along the width)",
                "load_steps": step_labels,
            }))?,
            ..Default::default()
        };
        self.into_bytes()
    }

    fn into_bytes(mut self) -> Result<Vec<u8>, GltfError> {
        use json::buffer::{Buffer, Stride, Target, View};
        if !self.channels.is_empty() {
            self.root.animations.push(json::Animation {
                extensions: None,
                extras: None,
                channels: std::mem::take(&mut self.channels),
                name: Some("load steps".into()),
                samplers: std::mem::take(&mut self.samplers),
            });
        }
        let mut bin: Vec<u8> = Vec::new();
        let sections = [
            (&self.vertices, Some(12), Some(Target::ArrayBuffer), "vertices"),
            (&self.indices, None, Some(Target::ElementArrayBuffer), "indices"),
            (&self.keyframes, None, None, "keyframes"),
        ];
        let mut views = [Index::new(0); 3];
        for ((section, stride, target, name), view) in sections.into_iter().zip(&mut views) {
            if section.is_empty() {
                continue;
            }
            *view = Index::new(self.root.buffer_views.len() as u32);
            bin.resize(bin.len().next_multiple_of(4), 0);
            self.root.buffer_views.push(View {
                buffer: Index::new(0),
                byte_length: USize64::from(section.len()),
                byte_offset: Some(USize64::from(bin.len())),
                byte_stride: stride.map(Stride),
                name: Some(name.into()),
                target: target.map(Valid),
                extensions: None,
                extras: None,
            });
            bin.extend_from_slice(section);
        }
        for accessor in &mut self.root.accessors {
            accessor.buffer_view =
                accessor.buffer_view.and_then(|section| views.get(section.value()).copied());
        }
        bin.resize(bin.len().next_multiple_of(4), 0);
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(bin.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let json = self.root.to_vec().map_err(|e| GltfError::Writer(e.to_string()))?;
        // Two headers of 8 bytes, one of 12, and padding.
        let length = u32::try_from(json.len() + bin.len() + 32).map_err(|_| GltfError::TooLarge)?;
        let file = Glb {
            header: Header { magic: *b"glTF", version: 2, length },
            json: json.into(),
            bin: Some(bin.into()),
        };
        file.to_vec().map_err(|e| GltfError::Writer(e.to_string()))
    }
}
