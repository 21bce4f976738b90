//! A valid case: plain data in SI units, independent of the text that it was read from.

use std::path::PathBuf;

use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_materials::hyperfoam::pressed_freely;
use elastocap_materials::{HyperelasticLaw, StressTable};

pub use super::terminals::{Measured, MeasuredEntry, Terminal};
pub use elastocap_geometry::scene::{Body, Box3, Role, Wall};
pub use elastocap_geometry::shapes::{Curve, Shape};

/// A case that can be planned and run. Its parts fit together; every number is finite and in SI units.
///
/// A scene with a layer has the substrate plane at x2 = 0 and the electrodes centred at x1 = x3 = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The title, one line.
    pub title: String,
    /// The file of the case, as the caller named it.
    pub source: PathBuf,
    /// The soft layer.
    pub layer: Option<Layer>,
    /// The pair of electrodes in the layer; only with a layer.
    pub electrodes: Option<Electrodes>,
    /// The mechanical model of the layer; present whenever [`Case::load`] is.
    pub mechanics: Option<Mechanics>,
    /// The model in [`Case::mechanics`] and the reason for it, in words, if the file leaves the choice to the
    /// program.
    pub mechanics_chosen: Option<String>,
    /// The load steps; `None` for the undeformed scene alone.
    pub load: Option<Load>,
    /// The displacement of the indenter, and of the bodies attached to it or to the layer's top, at each
    /// step, besides the load; empty without any.
    pub poses: Vec<Pose>,
    /// The indenter that presses on the layer, where it is part of the field; only with a load.
    pub indenter: Option<FieldIndenter>,
    /// All bodies besides the layer and the pair in it, before the layer deforms: those that stay where they
    /// are, and those that move with its top or with the indenter ([`Body::purpose`]). The conductors come
    /// first, in the order of the file, then the dielectrics, of which later ones override earlier ones.
    /// Slabs are boxes with infinite bounds.
    pub bodies: Vec<Body>,
    /// Conductors that the file joins on one wire, in the order of the file; each other conductor is a
    /// terminal by itself.
    pub terminals: Vec<Terminal>,
    /// The measured capacitances: with a driven guard and no `[measure]`, that of the terminal which the
    /// guard follows. `None` if the file does not name any.
    pub measured: Option<Measured>,
    /// The names of bodies that the file gives in another form than [`Case::bodies`]: as surfaces or outlines
    /// where all bodies turned out to consist of boxes, as surfaces where all turned out to be extruded along
    /// one axis.
    pub recognised: Vec<String>,
    /// The mesh whose physical groups are the [`Case::bodies`]; `None` where these are shapes.
    pub mesh: Option<ImportedMesh>,
    /// The space around the bodies; present exactly when a capacitance is computed.
    pub surroundings: Option<Surroundings>,
    /// The accuracy of the capacitance, and its solver; present exactly when a capacitance is computed.
    pub electrostatics: Option<Electrostatics>,
    /// Measured points; only with a load and a capacitance.
    pub measured_points: Option<MeasuredPoints>,
}

/// Measured points of a capacitance under load.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPoints {
    /// The file of the points, as the case file names it.
    pub file: String,
    /// The quantity of their loads.
    pub load: MeasuredLoad,
    /// The points as measured, in the order of the file, at least one.
    pub points: Vec<MeasuredPoint>,
    /// The effect of the meter and its wires on the points.
    pub correction: Correction,
}

impl MeasuredPoints {
    /// The points without the effect of the meter: loads on the layer, and capacitances of the bodies in the
    /// case.
    pub fn corrected(&self) -> Vec<MeasuredPoint> {
        let Correction { offset, parasitic, gain } = self.correction;
        let corrected = |point: &MeasuredPoint| MeasuredPoint {
            line: point.line,
            load: point.load - offset,
            capacitance: (point.capacitance - parasitic) / gain,
            deviation: point.deviation.map(|deviation| deviation / gain),
        };
        self.points.iter().map(corrected).collect()
    }
}

/// The difference between a measured point and the case: the measured load is larger by `offset`, and the
/// measured capacitance is `gain` times that of the case, plus `parasitic`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// The offset of the load: N, m, or U/H.
    pub offset: f64,
    /// The parasitic capacitance, F.
    pub parasitic: f64,
    /// The gain, above zero.
    pub gain: f64,
}

impl Default for Correction {
    fn default() -> Self {
        Self { offset: 0.0, parasitic: 0.0, gain: 1.0 }
    }
}

/// The quantity of the load of a measured point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasuredLoad {
    /// Compressive force, N.
    Force,
    /// Displacement U of the layer's top, m.
    Displacement,
    /// Compression U/H.
    Compression,
}

impl MeasuredLoad {
    /// The name of the quantity.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Displacement => "displacement",
            Self::Compression => "compression",
        }
    }

    /// The SI unit; empty for a number without a unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Displacement => "m",
            Self::Compression => "",
        }
    }
}

/// A measured point, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPoint {
    /// The line of the point in the file, from 1.
    pub line: u64,
    /// The load: N, m, or U/H, see [`MeasuredLoad`].
    pub load: f64,
    /// The capacitance, F.
    pub capacitance: f64,
    /// The standard deviation of the capacitance, F; positive. `None` where it is not known.
    pub deviation: Option<f64>,
}

impl Case {
    /// Whether the layer is a foam: its permittivity depends on the compression, or its force follows a foam
    /// law.
    pub fn is_foam(&self) -> bool {
        self.layer.as_ref().is_some_and(|layer| layer.foam.is_some() || layer.has_foam_law())
    }

    /// Whether the layer is a foam without a foam law, so that no model gives its force.
    pub fn lacks_force(&self) -> bool {
        self.layer.as_ref().is_some_and(|layer| layer.foam.is_some() && !layer.has_foam_law())
    }

    /// The name of the case file, without its folder.
    pub fn file_name(&self) -> String {
        self.source
            .file_name()
            .map_or_else(|| self.source.display().to_string(), |name| name.to_string_lossy().into_owned())
    }

    /// The displacement of the attached bodies at a step.
    pub fn pose(&self, step: usize) -> Pose {
        self.poses.get(step).copied().unwrap_or_default()
    }

    /// Whether some steps are before contact.
    pub fn approaches(&self) -> bool {
        self.poses.iter().any(|pose| pose.distance > 0.0)
    }

    /// Whether there is a capacitance to compute: electrodes or conductors.
    pub fn has_conductors(&self) -> bool {
        self.electrodes.is_some() || self.bodies.iter().any(Body::is_conductor)
    }

    /// Whether all fixed bodies are boxes, sheets and slabs, which the box solver requires.
    pub fn has_only_boxes(&self) -> bool {
        self.bodies.iter().all(|body| body.boxes().is_some())
    }
}

/// A volume mesh that a case file names, with the roles that the case gives its groups.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedMesh {
    /// The file of the mesh, as the case file names it.
    pub file: String,
    /// The tetrahedra around the conductors.
    pub tets: TetMesh,
    /// The groups of volumes that no body names; the medium of the surroundings fills them.
    pub unnamed: Vec<String>,
}

/// The soft layer, from x2 = 0 to x2 = `thickness`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Undeformed thickness H, m.
    pub thickness: f64,
    /// Undeformed half-length along x1, m; the closed form does not use it.
    pub half_length: Option<f64>,
    /// eps_r at rest; present whenever a capacitance is computed.
    pub relative_permittivity: Option<f64>,
    /// The foam, whose eps_r grows with the compression; `None` for an eps_r that does not depend on the
    /// load.
    pub foam: Option<Foam>,
    /// The material; present whenever [`Case::load`] is, unless [`Layer::stress_table`] is. Its shear modulus
    /// is positive.
    pub material: Option<HyperelasticLaw>,
    /// The measured stress of a foam, instead of a material.
    pub stress_table: Option<StressTable>,
    /// kappa, Pa; `None` for an incompressible material. Only finite elements use it.
    pub bulk_modulus: Option<f64>,
}

impl Layer {
    /// eps_r at a uniform compression U/H.
    pub fn permittivity_at(&self, compression: f64) -> Option<f64> {
        match self.foam {
            Some(foam) => Some(foam.relative_permittivity(self.volume_ratio(compression))),
            None => self.relative_permittivity,
        }
    }

    /// Whether a foam law gives the force on the layer.
    pub fn has_foam_law(&self) -> bool {
        self.stress_table.is_some() || matches!(self.material, Some(HyperelasticLaw::Hyperfoam { .. }))
    }

    /// Whether the layer is a foam that does not widen under compression, so that plane strain and three
    /// dimensions agree.
    pub fn gets_no_wider(&self) -> bool {
        match &self.material {
            Some(HyperelasticLaw::Hyperfoam { terms }) => terms.iter().all(|term| term.poisson_ratio == 0.0),
            _ => false,
        }
    }

    /// J of a foam at a uniform compression U/H. Only a hyperfoam may widen.
    fn volume_ratio(&self, compression: f64) -> f64 {
        let lateral = match &self.material {
            Some(HyperelasticLaw::Hyperfoam { terms }) => pressed_freely(terms, compression).lateral_stretch,
            _ => 1.0,
        };
        (1.0 - compression) * lateral * lateral
    }
}

/// A foam whose density grows under load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foam {
    /// eps_r of the solid.
    pub solid_permittivity: f64,
    /// The volume fraction of the solid at rest, above 0 and at most 1.
    pub solid_fraction: f64,
}

impl Foam {
    /// eps_r of the foam at a volume ratio, its volume over its volume at rest. By Looyenga's rule (Physica
    /// 31, 401, 1965) the cube root of eps_r is the mean of the cube roots of the permittivities of solid and
    /// air, weighted by volume. The share of the solid is [`Foam::solid_fraction`] over the volume ratio, and
    /// 1 at most.
    pub fn relative_permittivity(&self, volume_ratio: f64) -> f64 {
        let share = (self.solid_fraction / volume_ratio).min(1.0);
        (1.0 + share * (self.solid_permittivity.cbrt() - 1.0)).powi(3)
    }
}

/// The pair of electrodes, undeformed. All lengths are positive; both lie in the layer and may touch its
/// faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrodes {
    /// The layout: side by side or one above the other.
    pub layout: Layout,
    /// The gap D between the facing surfaces, m: along x1 for an in-plane pair, along x2 for a stacked one.
    pub gap: f64,
    /// The length of each electrode along x1, m.
    pub length: f64,
    /// The thickness T of each electrode along x2, m.
    pub thickness: f64,
    /// The width W of each electrode along x3, m.
    pub width: f64,
    /// The height S above the substrate, m: of the mid-plane of an in-plane pair, of the middle of the gap of
    /// a stacked one.
    pub height: f64,
    /// The stiffness of the electrodes.
    pub stiffness: Stiffness,
}

impl Electrodes {
    /// The names of the two electrodes, in the order of [`Electrodes::regions`].
    pub fn names(&self) -> [&'static str; 2] {
        match self.layout {
            Layout::InPlane => ["electrode-left", "electrode-right"],
            Layout::Stacked => ["electrode-lower", "electrode-upper"],
        }
    }

    /// The boxes of the two electrodes before the layer deforms: left and right, or lower and upper.
    pub fn regions(&self) -> [Box3; 2] {
        let Self { gap, length, thickness, width, height, .. } = *self;
        let x3 = width / 2.0;
        match self.layout {
            Layout::InPlane => {
                let (near, far) = (gap / 2.0, gap / 2.0 + length);
                let (low, high) = (height - thickness / 2.0, height + thickness / 2.0);
                [
                    Box3 { min: [-far, low, -x3], max: [-near, high, x3] },
                    Box3 { min: [near, low, -x3], max: [far, high, x3] },
                ]
            }
            Layout::Stacked => {
                let x1 = length / 2.0;
                let (low, high) = (height - gap / 2.0, height + gap / 2.0);
                [
                    Box3 { min: [-x1, low - thickness, -x3], max: [x1, low, x3] },
                    Box3 { min: [-x1, high, -x3], max: [x1, high + thickness, x3] },
                ]
            }
        }
    }
}

/// The indenter that presses on the layer, as a part of the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldIndenter {
    /// A conductor, with its potential, or a dielectric.
    pub role: Role,
    /// The height of a punch or a plate, m; `None` for its width along x1.
    pub height: Option<f64>,
}

impl FieldIndenter {
    /// The name of the indenter among the bodies of a scene.
    pub const NAME: &'static str = "indenter";
}

/// The displacement of attached bodies at a step, besides that by the load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// The distance of the indenter, with the bodies attached to it, from the surface of the layer, m; zero
    /// from contact on.
    pub distance: f64,
    /// The shift along x1 and along x3, m.
    pub shift: [f64; 2],
    /// The angles of the tilt about x3 and about x1, right-handed, radians. Both axes pass through the middle
    /// of the lower side of all moved bodies.
    pub tilt: [f64; 2],
}

impl Pose {
    /// Whether there is neither shift nor tilt, at any distance.
    pub fn is_aligned(&self) -> bool {
        self.shift == [0.0; 2] && self.tilt == [0.0; 2]
    }
}

/// The layout of the pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Two coplanar electrodes side by side along x1.
    InPlane,
    /// Two plates, one above the other.
    Stacked,
}

/// The stiffness of the electrodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stiffness {
    /// Electrodes of constant thickness. Also without a load, if the file gives no stiffness.
    Rigid,
    /// Incompressible neo-Hookean with this shear modulus, Pa.
    ShearModulus(f64),
}

/// The mechanical model of the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mechanics {
    /// The closed-form solution of the paper "Large deformation mechanics of a soft elastomeric layer under
    /// compressive loading for a MEMS tactile sensor application"; the equation numbers below are those of
    /// the paper.
    ClosedForm {
        /// L in eq. (50), m.
        contact_half_length: f64,
        /// w in eq. (50), m.
        contact_width: f64,
        /// L in eq. (45).
        shear_length: ShearLength,
    },
    /// Finite elements in plane strain; the layer's half-length is given.
    PlaneStrain(PlaneStrain),
    /// Finite elements in three dimensions; the layer's half-length is given.
    Solid(Solid),
}

impl Mechanics {
    /// Whether the model is one of the finite-element models.
    pub fn is_finite_element(&self) -> bool {
        matches!(self, Self::PlaneStrain(_) | Self::Solid(_))
    }

    /// The indenter of the finite elements, and the width of the layer along x3 in m; `None` for the closed
    /// form.
    pub fn indenter(&self) -> Option<(Indenter, f64)> {
        match self {
            Self::ClosedForm { .. } => None,
            Self::PlaneStrain(model) => Some((model.indenter, model.width)),
            Self::Solid(model) => Some((model.indenter, model.width)),
        }
    }

    /// Whether the indenter covers the whole top of the layer, which then stays flat.
    pub fn covers_all(&self) -> bool {
        self.indenter().is_none_or(|(indenter, _)| indenter == Indenter::WholeTop)
    }
}

/// The source of the shear length, L in eq. (45) of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShearLength {
    /// The shear length that the file gives, m.
    Given(f64),
    /// The shear length at each compression from finite elements of the layer under a sharp punch of the
    /// contact's length.
    FiniteElement,
}

/// The plane-strain finite-element model of the layer. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneStrain {
    /// The indenter.
    pub indenter: Indenter,
    /// The boundary condition at the layer's end.
    pub end: LayerEnd,
    /// Width of the layer along x3.
    pub width: f64,
    /// The relative discretisation error of the force to be reached; in (0, 1).
    pub relative_tolerance: f64,
}

/// A rigid indenter. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A smooth plate over the whole layer.
    WholeTop,
    /// A flat-faced punch all along x3.
    FlatPunch {
        /// Half of its width along x1.
        half_width: f64,
        /// The contact with the layer.
        contact: PunchContact,
        /// The middle of the punch, along x1 from the middle of the layer; zero in three dimensions.
        position: f64,
    },
    /// A cylinder with its axis along x3.
    Cylinder {
        /// The radius of the cylinder.
        radius: f64,
        /// The middle of the cylinder, along x1 from the middle of the layer; zero in three dimensions.
        position: f64,
    },
    /// A flat-faced, smooth punch with an end along x3 as well, in three dimensions.
    Block {
        /// Half of its width along x1 and of its depth along x3.
        half_widths: [f64; 2],
        /// Radius of its edges, above zero and at most the half widths.
        corner_radius: f64,
    },
    /// A sphere, in three dimensions.
    Sphere {
        /// The radius of the sphere.
        radius: f64,
    },
}

impl Indenter {
    /// The middle of the indenter, along x1 from the middle of the layer, m.
    pub fn position(self) -> f64 {
        match self {
            Self::FlatPunch { position, .. } | Self::Cylinder { position, .. } => position,
            Self::WholeTop | Self::Block { .. } | Self::Sphere { .. } => 0.0,
        }
    }
}

/// The contact between a flat punch and the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PunchContact {
    /// Contact without friction: material under the punch may slide around its corners.
    Smooth {
        /// Radius of the corners in m; `None` for sharp ones.
        corner_radius: Option<f64>,
    },
    /// The layer sticks to the face.
    Bonded,
    /// No contact: the patch under the punch at rest is moved down, and slides sideways without friction,
    /// also beyond the width of the punch.
    Held,
}

impl PunchContact {
    /// Radius of the corners of the punch in m; `None` for sharp ones, which held and bonded punches have.
    pub fn corner_radius(self) -> Option<f64> {
        match self {
            Self::Smooth { corner_radius } => corner_radius,
            Self::Bonded | Self::Held => None,
        }
    }
}

/// The three-dimensional finite-element model of the layer. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// The indenter, above the middle of the layer.
    pub indenter: Indenter,
    /// The boundary condition at the layer's end.
    pub end: LayerEnd,
    /// Width of the layer along x3.
    pub width: f64,
    /// The boundary condition at the layer's sides.
    pub side: LayerSide,
    /// The relative discretisation error of the force to be reached; in (0, 1).
    pub relative_tolerance: f64,
}

/// The boundary condition at the layer's sides along x3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerSide {
    /// Free of traction; if the end is [`LayerEnd::FreeOnSubstrate`], the sides rest on the substrate, too.
    Free,
    /// Mirror symmetry: no motion along x3, as if the layer continued.
    Symmetric,
}

/// The boundary condition at the layer's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerEnd {
    /// Free of traction all over.
    Free,
    /// Free of traction; where the end folds over, it rests on the plane of the substrate.
    FreeOnSubstrate,
    /// No motion along x1, as if the layer continued.
    Far,
}

/// The load steps, in the order of the file; never empty.
#[derive(Debug, Clone, PartialEq)]
pub enum Load {
    /// U/H of each step, in [0, 1).
    Compression(Vec<f64>),
    /// Compressive force of each step, N, not negative.
    Force(Vec<f64>),
}

impl Load {
    /// The number of steps.
    pub fn steps(&self) -> usize {
        match self {
            Self::Compression(steps) | Self::Force(steps) => steps.len(),
        }
    }
}

/// The space around the bodies, and where the field ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Surroundings {
    /// The condition on the outer walls.
    pub boundary: Wall,
    /// eps_r outside of all bodies.
    pub relative_permittivity: f64,
    /// The position of the walls.
    pub extent: Extent,
}

impl Surroundings {
    /// Whether the potential is zero at infinity, at a wall or at a plane beside the layer.
    pub(super) fn has_ground(&self) -> bool {
        let planes = match &self.extent {
            Extent::AroundLayer { below, above, .. } => [Some(below), Some(above)],
            Extent::Everywhere | Extent::Walls(_) => [None, None],
        };
        self.boundary != Wall::Insulated || planes.into_iter().flatten().any(|face| *face == Face::Grounded)
    }

    /// The end of the field around bodies of any shape without a layer, and the wall there: at a shell, at
    /// the walls of the case, or nowhere. `None` around a layer, whose walls follow from it.
    pub fn end_without_layer<'a>(&self, bodies: impl IntoIterator<Item = &'a Body>) -> Option<(Box3, Wall)> {
        let mut parts = bodies.into_iter().flat_map(|body| &body.parts);
        let hollow = parts.find(|part| matches!(part, Shape::Shell { .. })).and_then(Shape::bounds);
        match (hollow, &self.extent) {
            (Some(Box3 { min, max }), _) => {
                // The mesher needs room around the hollow; the tetrahedra there are dropped afterwards.
                let room = 0.5 * (max[0] - min[0]);
                let domain = Box3 { min: min.map(|x| x - room), max: max.map(|x| x + room) };
                Some((domain, Wall::Grounded))
            }
            (None, Extent::Everywhere) => Some((Box3::SPACE, Wall::Open)),
            (None, Extent::Walls(walls)) => Some((*walls, self.boundary)),
            (None, Extent::AroundLayer { .. }) => None,
        }
    }
}

/// The position of the outer walls.
#[derive(Debug, Clone, PartialEq)]
pub enum Extent {
    /// No layer, and no walls with [`Wall::Open`]; otherwise the walls are at a shell, or at the outer faces
    /// of [`Case::mesh`].
    Everywhere,
    /// No layer: the insulated or grounded faces of this box, which contains all bodies.
    Walls(Box3),
    /// Around the layer.
    AroundLayer {
        /// Along x1 and x3 from the outermost deformed electrode (or conductor) to the walls, m; `None`
        /// exactly when the boundary is [`Wall::Open`].
        side_margin: Option<f64>,
        /// The medium below x2 = 0, or the end of the field there.
        below: Face,
        /// The medium above the layer's deformed top, or the end of the field there.
        above: Face,
    },
}

/// The medium against a face of the layer, or the end of the field there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Face {
    /// A plane without flux, where the field ends.
    Insulated,
    /// A plane at potential zero, where the field ends.
    Grounded,
    /// A dielectric, with a wall behind it, or with space of [`Surroundings::relative_permittivity`] if the
    /// wall is open.
    Medium {
        /// eps_r of the dielectric.
        relative_permittivity: f64,
        /// The thickness, m; `None` for infinitely thick, only if the boundary is [`Wall::Open`].
        thickness: Option<f64>,
        /// The wall behind the dielectric: [`Surroundings::boundary`] by default.
        then: Wall,
    },
}

/// The accuracy of the capacitance, and its solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electrostatics {
    /// The tolerance of (upper - lower)/value, or of the estimated relative error if `bounds` is false; in
    /// (0, 1).
    pub relative_tolerance: f64,
    /// The tolerance of upper - lower, F, or of the estimated error, which suffices however small the
    /// capacitance is; above zero. `None` if only the relative tolerance counts.
    pub absolute_tolerance: Option<f64>,
    /// The tolerance of (upper - lower)/value of the change against the first load step, in (0, 1); only with
    /// bounds and at least two load steps. `None` if the change has no tolerance.
    pub change_tolerance: Option<f64>,
    /// Whether a lower and an upper bound are proved.
    pub bounds: bool,
    /// The requested solver; `None` for the box solver where it suits the scene, otherwise the solver on
    /// tetrahedra.
    pub solver: Option<FieldSolver>,
    /// The polynomial order of the potentials on tetrahedra, 1 to 3; `None` to let the solver choose, and for
    /// the box solver.
    pub order: Option<u8>,
}

/// A field solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldSolver {
    /// The box solver, for axis-aligned boxes and sheets.
    Boxes,
    /// The solver for scenes of bodies extruded along one axis.
    Extruded,
    /// The solver on tetrahedra, for any shape.
    Tetrahedra,
}
