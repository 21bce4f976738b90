//! `[mechanics]`, `[indenter]` and `[load]`: the mechanical model of the layer, the indenter, and the load
//! steps.

use serde_json::{Value, json};
use toml::de::DeValue;

use crate::quantities::{Angle, Compression, Force, Permittivity, Position, Size, Tolerance};
use crate::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use crate::tables::{Entries, TableKeys, TableSchema, choice, key, table, unknown_word, words};
use crate::values::{Count, Either};

choice! {
    /// The mechanical model of the layer.
    enum Mechanics {
        "auto" => Auto(Auto),
        "closed_form" => ClosedForm(ClosedForm),
        "plane_strain" => PlaneStrain(PlaneStrain),
        "solid" => Solid(Solid),
    }
}

table! {
    /// Finite elements in plane strain or in three dimensions, as the scene needs: in plane strain if the
    /// indenter is at least ten times as long along x3 as it is wide and as the layer is thick, and the pair
    /// at least ten times as long as the layer is thick. `elastocap check` reports the choice and the reason
    /// for it.
    struct Auto {
        /// The indenter, above the middle of the layer: "whole-top" for a smooth plate over the whole layer,
        /// or an indenter.
        indenter: Read<Either<WholeTop, SolidIndenter>>,
        /// The layer's end along x1: "free" of traction, "free-on-substrate" (where the end folds over, it
        /// rests on the substrate plane), or "far" (no motion along x1 there, as if the layer continued).
        /// Default: "free-on-substrate" if [layer] has a `half_length`, otherwise "far", four thicknesses
        /// beyond the indenter and the bodies in the layer.
        end: Option<Read<LayerEnd>>,
        /// Width of the layer along x3, from side to side. It may be left out under a sphere or a punch with
        /// a `half_depth`: the layer then continues far beyond the indenter. Every other indenter presses
        /// along all of the width, so that the force depends on it.
        width: Option<Read<Size>>,
        /// The layer's sides along x3: "free" like the end, or "symmetric" (no motion along x3 there, as if
        /// the layer continued). Default: "free" if `width` is given, otherwise "symmetric".
        side: Option<Read<LayerSide>>,
        /// Relative discretisation error of the force to be reached. Default: 5e-3 in plane strain, 2e-2 in
        /// three dimensions.
        relative_tolerance: Option<Read<Tolerance>>,
    }
}

table! {
    /// The closed-form solution: bonded layer under a wide flat probe, plane strain. Equation numbers are
    /// those of "Large deformation mechanics of a soft elastomeric layer under compressive loading for a MEMS
    /// tactile sensor application".
    struct ClosedForm {
        /// Half-length L of the contact in the force formula, eq. (50).
        contact_half_length: Read<Size>,
        /// Width w of the contact in the force formula, eq. (50).
        contact_width: Read<Size>,
        /// Length L in the shear constant B, eq. (45), or "finite-element" to compute it at each step.
        shear_length: Read<Either<FiniteElement, Size>>,
    }
}

words! {
    /// The shear length at each step from finite elements of the layer under a sharp punch of the contact's
    /// length.
    enum FiniteElement { "finite-element" => FiniteElement, }
}

table! {
    /// Finite elements in plane strain: large deformations, contact, electrodes as stiffer inclusions.
    struct PlaneStrain {
        /// The indenter: "whole-top" for a smooth plate over the whole layer, or an indenter.
        indenter: Read<Either<WholeTop, Indenter>>,
        /// The layer's end: "free" of traction, "free-on-substrate" (where the end folds over, it rests on
        /// the substrate plane), or "far" (no motion along x1 there, as if the layer continued).
        end: Read<LayerEnd>,
        /// Width of the layer along x3, which the force is for.
        width: Read<Size>,
        /// Relative discretisation error of the force to be reached. Default: 5e-3.
        relative_tolerance: Option<Read<Tolerance>>,
    }
}

words! {
    /// A smooth plate over the whole layer.
    enum WholeTop { "whole-top" => WholeTop, }
}

words! {
    /// The boundary condition at the layer's end.
    enum LayerEnd { "free" => Free, "free-on-substrate" => FreeOnSubstrate, "far" => Far, }
}

choice! {
    /// A rigid indenter.
    enum Indenter {
        "flat_punch" => FlatPunch(FlatPunch),
        "cylinder" => Cylinder(Cylinder),
    }
}

table! {
    /// A flat-faced punch, long along x3.
    struct FlatPunch {
        /// Half of the width of the punch along x1.
        half_width: Read<Size>,
        /// Radius of the corners. Default: sharp corners.
        corner_radius: Option<Read<Size>>,
        /// "smooth" (contact without friction: the layer slides around the corners), "bonded" (the layer
        /// sticks to the face), or "held" (no punch, but the patch under it at rest is moved down, and may
        /// spread). Default: "smooth".
        contact: Option<Read<Contact>>,
        /// The middle of the punch, along x1 from the middle of the layer. Default: 0.
        position: Option<Read<Position>>,
    }
}

table! {
    /// A cylinder with its axis along x3.
    struct Cylinder {
        /// Radius of the cylinder.
        radius: Read<Size>,
        /// The middle of the cylinder, along x1 from the middle of the layer. Default: 0.
        position: Option<Read<Position>>,
    }
}

table! {
    /// Finite elements in three dimensions, for a layer of finite width. Indenters are above its middle.
    struct Solid {
        /// The indenter: "whole-top" for a smooth plate over the whole layer, or an indenter.
        indenter: Read<Either<WholeTop, SolidIndenter>>,
        /// The layer's end along x1: "free" of traction, "free-on-substrate" (where the end folds over, it
        /// rests on the substrate plane), or "far" (no motion along x1 there, as if the layer continued).
        end: Read<LayerEnd>,
        /// Width of the layer along x3, from side to side.
        width: Read<Size>,
        /// The layer's sides along x3: "free" like the end, or "symmetric" (no motion along x3 there, as if
        /// the layer continued). Default: "free".
        side: Option<Read<LayerSide>>,
        /// Relative discretisation error of the force to be reached. Default: 2e-2.
        relative_tolerance: Option<Read<Tolerance>>,
    }
}

words! {
    /// The boundary condition at the layer's sides.
    enum LayerSide { "free" => Free, "symmetric" => Symmetric, }
}

choice! {
    /// A rigid indenter above the middle of the layer.
    enum SolidIndenter {
        "flat_punch" => FlatPunch(SolidPunch),
        "cylinder" => Cylinder(SolidCylinder),
        "sphere" => Sphere(Sphere),
    }
}

table! {
    /// A flat-faced punch.
    struct SolidPunch {
        /// Half of the width of the punch along x1.
        half_width: Read<Size>,
        /// Half of the depth of the punch along x3, with a corner radius. Default: the punch goes all along
        /// x3.
        half_depth: Option<Read<Size>>,
        /// Radius of the corners. Default: sharp corners, which need a `contact` of "bonded" or "held".
        corner_radius: Option<Read<Size>>,
        /// "smooth" (contact without friction, with rounded corners), "bonded" (the layer sticks to the
        /// face), or "held" (no punch, but the patch under it at rest is moved down, and may spread).
        /// Default: "smooth".
        contact: Option<Read<Contact>>,
    }
    later: "position";
}

table! {
    /// A cylinder with its axis along x3.
    struct SolidCylinder {
        /// Radius of the cylinder.
        radius: Read<Size>,
    }
    later: "position";
}

table! {
    /// A sphere.
    struct Sphere {
        /// Radius of the sphere.
        radius: Read<Size>,
    }
    later: "position";
}

words! {
    /// The contact between layer and indenter.
    enum Contact { "smooth" => Smooth, "bonded" => Bonded, "held" => Held, }
}

table! {
    /// The indenter of [mechanics] as a part of the field. That of the closed form is a plate of the length
    /// and width of the contact, that of `indenter = "whole-top"` a plate over the whole layer.
    struct FieldIndenter {
        /// "grounded" (a conductor at potential zero), "floating" (a conductor without charge), `{
        /// relative_permittivity = .. }` (a dielectric), or "absent" (no part of the field, as without this
        /// table).
        role: Read<Either<IndenterRole, IndenterMedium>>,
        /// Height of a punch or a plate along x2. Default: its width along x1. Cylinders and spheres are
        /// complete.
        height: Option<Read<Size>>,
    }
}

words! {
    /// The electric role of the indenter in the field.
    enum IndenterRole { "grounded" => Grounded, "floating" => Floating, "absent" => Absent, }
}

table! {
    /// A dielectric indenter.
    struct IndenterMedium {
        /// Relative permittivity.
        relative_permittivity: Read<Permittivity>,
    }
}

table! {
    /// The load steps: exactly one of `compression`, `force` and `steps`, from contact on.
    struct Load {
        /// Distances of the indenter's lowest point from the surface of the layer, before contact: steps
        /// before those of the load, in which the layer is at rest. With an empty list of loads, as
        /// `compression = []`, the indenter approaches without contact.
        approach: Option<Read<Vec<Read<Size>>>>,
        /// Top displacement over thickness, U/H, of each step.
        compression: Option<Read<Either<Vec<Read<Compression>>, CompressionRange>>>,
        /// Compressive force of each step.
        force: Option<Read<Either<Vec<Read<Force>>, ForceRange>>>,
        /// Steps that also move the bodies attached to the layer's top or to the indenter.
        steps: Option<Read<Vec<Read<LoadStep>>>>,
    }
    one_of: "compression", "force", "steps";
}

table! {
    /// One load step; the steps of a case all give a compression, or all a force.
    struct LoadStep {
        /// Top displacement over thickness, U/H.
        compression: Option<Read<Compression>>,
        /// Compressive force.
        force: Option<Read<Force>>,
        /// Shift of the attached bodies along x1 and x3. Default: 0.
        shift: Option<Read<[Read<Position>; 2]>>,
        /// Tilt of the attached bodies about x3 and about x1, about the middle of their lower side;
        /// right-handed: the first angle lifts the side towards +x1, the second lowers that towards +x3.
        /// Default: 0.
        tilt: Option<Read<[Read<Angle>; 2]>>,
    }
    one_of: "compression", "force";
}

table! {
    /// Equally spaced compressions, both ends included.
    struct CompressionRange {
        /// First step.
        from: Read<Compression>,
        /// Last step.
        to: Read<Compression>,
        /// Number of steps.
        points: Read<Count>,
    }
}

table! {
    /// Equally spaced forces, both ends included.
    struct ForceRange {
        /// First step.
        from: Read<Force>,
        /// Last step.
        to: Read<Force>,
        /// Number of steps.
        points: Read<Count>,
    }
}
