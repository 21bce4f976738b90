//! A valid case: plain data in SI units, with nothing left of the text it came from.

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
    /// One line that says what the case is.
    pub title: String,
    /// The file it was read from, as the caller named it.
    pub source: PathBuf,
    /// The soft layer.
    pub layer: Option<Layer>,
    /// The pair of electrodes in the layer; only with a layer.
    pub electrodes: Option<Electrodes>,
    /// How the layer's deformation is computed; present whenever [`Case::load`] is.
    pub mechanics: Option<Mechanics>,
    /// Where the file leaves it to the program how the deformation is computed, [`Case::mechanics`] is what was chosen; this says in words
    /// what, and why.
    pub mechanics_chosen: Option<String>,
    /// The load steps; `None` for the undeformed scene alone.
    pub load: Option<Load>,
    /// How the indenter, and what is attached to it or to the layer's top, is moved at each step, besides the load; empty if it is not.
    pub poses: Vec<Pose>,
    /// The indenter that presses on the layer, where it is part of the field; only with a load.
    pub indenter: Option<FieldIndenter>,
    /// All bodies besides the layer and the pair in it, as they are before the layer deforms: those that stay where they are, and those
    /// that move with its top or with the indenter ([`Body::purpose`]). First the
    /// conductors in the order of the file, then the dielectrics, which override one another in theirs. Slabs are boxes with
    /// infinite bounds.
    pub bodies: Vec<Body>,
    /// Conductors that the file joins on one wire, in its order; each other conductor is a terminal by itself.
    pub terminals: Vec<Terminal>,
    /// The capacitances that the file asks for: with a driven guard and no `[measure]`, that of the terminal which the guard follows. `None`
    /// where the file does not say.
    pub measured: Option<Measured>,
    /// Names of bodies that the file gives in another way than [`Case::bodies`]: as surfaces or outlines where all bodies turned out to
    /// consist of boxes, as surfaces where all turned out to be outlines pulled along one axis.
    pub recognised: Vec<String>,
    /// The mesh that [`Case::bodies`] are physical groups of; `None` where they are shapes.
    pub mesh: Option<ImportedMesh>,
    /// The space around the bodies; present exactly when a capacitance is asked for.
    pub surroundings: Option<Surroundings>,
    /// How accurately the capacitance is computed; present exactly when a capacitance is asked for.
    pub electrostatics: Option<Electrostatics>,
    /// Points that were measured; only with a load and a capacitance.
    pub measured_points: Option<MeasuredPoints>,
}

/// Points that were measured.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPoints {
    /// The file that they are from, as the case file has it.
    pub file: String,
    /// The quantity of their loads.
    pub load: MeasuredLoad,
    /// In the order of the file, as they were measured; never empty.
    pub points: Vec<MeasuredPoint>,
    /// The effect of the meter and its wires on them.
    pub correction: Correction,
}

impl MeasuredPoints {
    /// The points with the correction taken off: loads on the layer, capacitances of what the case describes.
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

/// How a measured point differs from what the case describes: its load is larger by `offset`, and its capacitance is `gain` times that
/// of the case, plus `parasitic`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// N, m, or U/H.
    pub offset: f64,
    /// F.
    pub parasitic: f64,
    /// Above zero.
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
    /// U/H.
    Compression,
}

impl MeasuredLoad {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Displacement => "displacement",
            Self::Compression => "compression",
        }
    }

    /// Its SI unit; empty where it has none.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Displacement => "m",
            Self::Compression => "",
        }
    }
}

/// A point that was measured, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPoint {
    /// The line of the file, from 1.
    pub line: u64,
    /// N, m, or U/H: see [`MeasuredLoad`].
    pub load: f64,
    /// F.
    pub capacitance: f64,
    /// Its standard deviation, F; positive. `None` where it is not known.
    pub deviation: Option<f64>,
}

impl Case {
    /// Whether the layer is a foam: its permittivity follows the compression, or its force is by a law of foams.
    pub fn is_foam(&self) -> bool {
        self.layer.as_ref().is_some_and(|layer| layer.foam.is_some() || layer.has_foam_law())
    }

    /// Whether the layer is a foam without a law of foams, so that no model here has its force.
    pub fn lacks_force(&self) -> bool {
        self.layer.as_ref().is_some_and(|layer| layer.foam.is_some() && !layer.has_foam_law())
    }

    /// The name of the file, without its folder.
    pub fn file_name(&self) -> String {
        self.source
            .file_name()
            .map_or_else(|| self.source.display().to_string(), |name| name.to_string_lossy().into_owned())
    }

    /// How what is attached is moved at a step.
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

    /// Whether all fixed bodies are boxes, sheets and slabs, as the box solver takes them.
    pub fn has_only_boxes(&self) -> bool {
        self.bodies.iter().all(|body| body.boxes().is_some())
    }
}

/// A volume mesh that a case file names, with the roles that the case gives its groups.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedMesh {
    /// As the case file has it.
    pub file: String,
    /// The tetrahedra around the conductors.
    pub tets: TetMesh,
    /// Groups of volumes that no body names, filled with the surroundings.
    pub unnamed: Vec<String>,
}

/// The soft layer, from x2 = 0 to x2 = `thickness`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Undeformed thickness H, m.
    pub thickness: f64,
    /// Undeformed half-length along x1, m; the closed form does not use it.
    pub half_length: Option<f64>,
    /// eps_r, at rest; present whenever a capacitance is asked for.
    pub relative_permittivity: Option<f64>,
    /// The foam, whose eps_r grows with the compression; `None` where eps_r is the same under every load.
    pub foam: Option<Foam>,
    /// The material; present whenever [`Case::load`] is, unless [`Layer::stress_table`] is. Its shear modulus is positive.
    pub material: Option<HyperelasticLaw>,
    /// The measured stress of a foam, in place of a material.
    pub stress_table: Option<StressTable>,
    /// kappa, Pa; `None` for an incompressible material. Only finite elements know it.
    pub bulk_modulus: Option<f64>,
}

impl Layer {
    /// eps_r at a compression U/H that is the same everywhere.
    pub fn permittivity_at(&self, compression: f64) -> Option<f64> {
        match self.foam {
            Some(foam) => Some(foam.relative_permittivity(self.volume_ratio(compression))),
            None => self.relative_permittivity,
        }
    }

    /// Whether a law of foams says what force the layer takes.
    pub fn has_foam_law(&self) -> bool {
        self.stress_table.is_some() || matches!(self.material, Some(HyperelasticLaw::Hyperfoam { .. }))
    }

    /// Whether the layer is a foam that does not get wider where it is pressed: of the same width in plane strain and in three dimensions.
    pub fn gets_no_wider(&self) -> bool {
        match &self.material {
            Some(HyperelasticLaw::Hyperfoam { terms }) => terms.iter().all(|term| term.poisson_ratio == 0.0),
            _ => false,
        }
    }

    /// J of a foam at a compression U/H that is the same everywhere. Only a hyperfoam says how much wider it gets; others get no wider.
    fn volume_ratio(&self, compression: f64) -> f64 {
        let lateral = match &self.material {
            Some(HyperelasticLaw::Hyperfoam { terms }) => pressed_freely(terms, compression).lateral_stretch,
            _ => 1.0,
        };
        (1.0 - compression) * lateral * lateral
    }
}

/// A foam that gets denser under load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foam {
    /// eps_r of what it is made of.
    pub solid_permittivity: f64,
    /// Share of its volume at rest that is solid, above 0 and at most 1.
    pub solid_fraction: f64,
}

impl Foam {
    /// eps_r of the foam at a volume ratio, its volume over its volume at rest. By Looyenga's rule (Physica 31, 401, 1965) the cube root of eps_r
    /// is the mean of the cube roots of the permittivities of solid and air, weighted by volume. The share of the solid is
    /// [`Foam::solid_fraction`] over the volume ratio, and 1 at most.
    pub fn relative_permittivity(&self, volume_ratio: f64) -> f64 {
        let share = (self.solid_fraction / volume_ratio).min(1.0);
        (1.0 + share * (self.solid_permittivity.cbrt() - 1.0)).powi(3)
    }
}

/// The pair of electrodes, undeformed. All lengths are positive; both lie in the layer and may touch its faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrodes {
    /// Whether the two lie side by side or one above the other.
    pub layout: Layout,
    /// The gap D between the facing surfaces, m: along x1 for an in-plane pair, along x2 for a stacked one.
    pub gap: f64,
    /// The length of each electrode along x1, m.
    pub length: f64,
    /// The thickness T of each electrode along x2, m.
    pub thickness: f64,
    /// The width W of each electrode along x3, m.
    pub width: f64,
    /// The height S above the substrate, m: of the mid-plane of an in-plane pair, of the middle of the gap of a stacked one.
    pub height: f64,
    /// How stiff the electrodes are.
    pub stiffness: Stiffness,
}

impl Electrodes {
    /// Names of the two, in the order of [`Electrodes::regions`].
    pub fn names(&self) -> [&'static str; 2] {
        match self.layout {
            Layout::InPlane => ["electrode-left", "electrode-right"],
            Layout::Stacked => ["electrode-lower", "electrode-upper"],
        }
    }

    /// Where the two are before the layer deforms: left and right, or lower and upper.
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
    /// How tall a punch or a plate is, m; `None` for as tall as it is wide along x1.
    pub height: Option<f64>,
}

impl FieldIndenter {
    /// Its name among the bodies of a scene.
    pub const NAME: &'static str = "indenter";
}

/// How bodies are moved besides what the load does to them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// The distance of the indenter, with what is attached to it, from the surface of the layer, m; zero from contact on.
    pub distance: f64,
    /// The shift along x1 and along x3, m.
    pub shift: [f64; 2],
    /// The angles of the tilt about x3 and about x1, right-handed, radians. Both axes pass through the middle of the lower side of all that is
    /// moved.
    pub tilt: [f64; 2],
}

impl Pose {
    /// Whether nothing is shifted or tilted, at whatever distance.
    pub fn is_aligned(&self) -> bool {
        self.shift == [0.0; 2] && self.tilt == [0.0; 2]
    }
}

/// How the pair is laid out.
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
    /// They keep their thickness. Also where there is no load and the file does not say.
    Rigid,
    /// Incompressible neo-Hookean with this shear modulus, Pa.
    ShearModulus(f64),
}

/// How the layer's deformation is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mechanics {
    /// The closed-form solution of the paper "Large deformation mechanics of a soft elastomeric layer under compressive loading
    /// for a MEMS tactile sensor application", whose equation numbers these are.
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
    /// Whether it is one of the finite-element models.
    pub fn is_finite_element(&self) -> bool {
        matches!(self, Self::PlaneStrain(_) | Self::Solid(_))
    }

    /// Whether what presses covers the whole top of the layer, which then stays flat.
    pub fn covers_all(&self) -> bool {
        match self {
            Self::ClosedForm { .. } => true,
            Self::PlaneStrain(model) => model.indenter == Indenter::WholeTop,
            Self::Solid(model) => model.indenter == SolidIndenter::WholeTop,
        }
    }
}

/// Where the shear length, L in eq. (45) of the paper, comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShearLength {
    /// The file gives it, m.
    Given(f64),
    /// Found at each compression from finite elements of the layer under a sharp punch of the contact's length.
    FiniteElement,
}

/// The layer by finite elements in plane strain. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneStrain {
    /// The load.
    pub indenter: Indenter,
    /// The boundary condition at the layer's end.
    pub end: LayerEnd,
    /// Width of the layer along x3.
    pub width: f64,
    /// Relative discretisation error of the force to reach; in (0, 1).
    pub relative_tolerance: f64,
}

/// A rigid indenter. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A smooth plate over the whole layer.
    WholeTop,
    /// A flat-faced punch.
    FlatPunch {
        /// Half of its width along x1.
        half_width: f64,
        /// Radius of its corners; zero for a sharp one, as all are that are held or bonded.
        corner_radius: f64,
        /// How it touches the layer.
        contact: PunchContact,
        /// Its middle, along x1 from the middle of the layer.
        position: f64,
    },
    /// A cylinder with its axis along x3.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Its middle, along x1 from the middle of the layer.
        position: f64,
    },
}

/// How a flat punch touches the layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PunchContact {
    /// Contact without friction: what lies under the punch may slide around its corners.
    Smooth,
    /// The layer sticks to the face.
    Bonded,
    /// No contact: the patch that lies under the punch at rest is moved down, and slides sideways without friction, past the width of
    /// the punch too.
    Held,
}

/// The layer by finite elements in three dimensions. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// The indenter, above the middle of the layer.
    pub indenter: SolidIndenter,
    /// The boundary condition at the layer's end.
    pub end: LayerEnd,
    /// Width of the layer along x3.
    pub width: f64,
    /// The boundary condition at its sides.
    pub side: LayerSide,
    /// Relative discretisation error of the force to reach; in (0, 1).
    pub relative_tolerance: f64,
}

/// A rigid indenter in three dimensions. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolidIndenter {
    /// A smooth plate over the whole layer.
    WholeTop,
    /// A flat-faced punch all along x3; smooth ones have rounded corners, the others sharp ones.
    FlatPunch {
        /// Half of its width along x1.
        half_width: f64,
        /// Radius of its corners; zero for a sharp one, as all are that are held or bonded.
        corner_radius: f64,
        /// How it touches the layer.
        contact: PunchContact,
    },
    /// A flat-faced, smooth punch with an end along x3 as well.
    Block {
        /// Half of its widths along x1 and along x3.
        half_widths: [f64; 2],
        /// Radius of its edges, above zero and at most the half widths.
        corner_radius: f64,
    },
    /// A cylinder with its axis along x3.
    Cylinder {
        /// Its radius.
        radius: f64,
    },
    /// A sphere.
    Sphere {
        /// Its radius.
        radius: f64,
    },
}

/// The boundary condition at the layer's sides along x3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerSide {
    /// Like the end.
    Free,
    /// The layer goes on as in a mirror: no motion along x3.
    Symmetric,
}

/// The boundary condition at the layer's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerEnd {
    /// Free of traction all the way.
    Free,
    /// Free, and what folds over rests on the plane of the substrate.
    FreeOnSubstrate,
    /// The layer goes on: no motion along x1.
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
    /// How many steps there are.
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
    /// eps_r wherever nothing else is.
    pub relative_permittivity: f64,
    /// Where the walls are.
    pub extent: Extent,
}

impl Surroundings {
    /// Whether infinity, a wall or a plane beside the layer is at potential zero.
    pub(super) fn has_ground(&self) -> bool {
        let planes = match &self.extent {
            Extent::AroundLayer { below, above, .. } => [Some(below), Some(above)],
            Extent::Everywhere | Extent::Walls(_) => [None, None],
        };
        self.boundary != Wall::Insulated || planes.into_iter().flatten().any(|face| *face == Face::Grounded)
    }

    /// Where the field of bodies that are shapes without a layer ends, and the wall there: at a shell, at the walls of the case,
    /// or nowhere. `None` around a layer, whose walls follow from it.
    pub fn end_without_layer<'a>(&self, bodies: impl IntoIterator<Item = &'a Body>) -> Option<(Box3, Wall)> {
        let mut parts = bodies.into_iter().flat_map(|body| &body.parts);
        let hollow = parts.find(|part| matches!(part, Shape::Shell { .. })).and_then(Shape::bounds);
        match (hollow, &self.extent) {
            (Some(Box3 { min, max }), _) => {
                // A mesh needs room around the hollow, which is dropped again.
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

/// Where the outer walls are.
#[derive(Debug, Clone, PartialEq)]
pub enum Extent {
    /// No layer: [`Wall::Open`], and there are none; or at a shell, or at the outer faces of [`Case::mesh`].
    Everywhere,
    /// No layer, insulated or grounded: the faces of this box, in which all bodies lie.
    Walls(Box3),
    /// Around the layer.
    AroundLayer {
        /// Along x1 and x3 from the outermost deformed electrode (or conductor) to the walls, m; `None` exactly
        /// when the boundary is [`Wall::Open`].
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
    /// No flux through it: the field ends there.
    Insulated,
    /// At potential zero: the field ends there.
    Grounded,
    /// A dielectric; behind it a wall, or space with [`Surroundings::relative_permittivity`] if that is open.
    Medium {
        /// eps_r.
        relative_permittivity: f64,
        /// m; `None` for infinitely thick, only if the boundary is [`Wall::Open`].
        thickness: Option<f64>,
        /// The wall behind it: [`Surroundings::boundary`] unless the file says.
        then: Wall,
    },
}

/// How accurately the capacitance is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electrostatics {
    /// (upper - lower)/value to reach, or the estimated relative error if `bounds` is false; in (0, 1).
    pub relative_tolerance: f64,
    /// upper - lower that is enough however small the capacitance, F, or the estimated error; above zero. `None` where only the relative
    /// tolerance counts.
    pub absolute_tolerance: Option<f64>,
    /// (upper - lower)/value of the change against the first load step to reach, in (0, 1); only with bounds and at least two load
    /// steps. `None` where the change is not asked for by itself.
    pub change_tolerance: Option<f64>,
    /// Whether a lower and an upper bound are proved.
    pub bounds: bool,
    /// The solver asked for; `None` for the box solver where it can take the scene, otherwise the solver on tetrahedra.
    pub solver: Option<FieldSolver>,
    /// Order of the potentials on tetrahedra, 1 to 3; `None` for the solver's own choice, and for the box solver.
    pub order: Option<u8>,
}

/// A field solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldSolver {
    /// The box solver, for axis-aligned boxes and sheets.
    Boxes,
    /// The solver for extruded scenes: outlines pulled along one axis.
    Extruded,
    /// The solver on tetrahedra, for any shape.
    Tetrahedra,
}
