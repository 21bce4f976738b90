//! The case file as written: every table and key of format 1 that this version reads.
//!
//! The doc comments are the descriptions in the JSON Schema, so they speak to whoever writes a case file.

use serde_json::{Value, json};
use toml::de::{DeTable, DeValue};

use super::file_unit::FileUnit;
use super::material::MaterialTable;
use super::quantities::{
    Angle, Charge, Compression, Force, Height, Modulus, Permittivity, Position, Size, Tolerance,
};
use super::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use super::tables::{Entries, TableKeys, TableSchema, choice, key, table, unknown_word, words};
use super::values::{Count, Either, Flag, FormatNumber, PotentialOrder, Text};

table! {
    /// A case file of elastocap: a soft capacitive sensor, its surroundings and its load.
    struct Document {
        /// Number of the file format.
        format: Read<FormatNumber>,
        /// One line that says what the case is. Default: the name of the file.
        title: Option<Read<Text>>,
        /// The soft layer, from the substrate plane x2 = 0 to x2 = thickness.
        layer: Option<Read<Layer>>,
        /// Electrodes by their usual forms: a pair in the layer, and any number of combs, arrays, spirals and rings.
        electrodes: Option<Read<Electrodes>>,
        /// How the layer's deformation is computed.
        mechanics: Option<Read<Mechanics>>,
        /// The load steps, in the order in which they are reported.
        load: Option<Read<Load>>,
        /// What presses on the layer, as a part of the field.
        indenter: Option<Read<FieldIndenter>>,
        /// Conductors besides the electrodes; none may touch another, unless both belong to one terminal.
        conductor: Option<Read<Vec<Read<Conductor>>>>,
        /// Conductors on one wire; a conductor that none of them names is a terminal by itself.
        terminal: Option<Read<Vec<Read<Terminal>>>>,
        /// What is measured. Default: the pair of two terminals, or of [electrodes]; of more, the whole matrix.
        measure: Option<Read<Measure>>,
        /// Dielectric bodies; where two overlap, the later one in the file wins.
        dielectric: Option<Read<Vec<Read<Dielectric>>>>,
        /// What surrounds the bodies, and where the field ends.
        surroundings: Option<Read<Surroundings>>,
        /// A volume mesh from Gmsh that is the whole scene; bodies are then `physical` groups of it.
        mesh: Option<Read<MeshFile>>,
        /// How accurately the capacitance is computed.
        electrostatics: Option<Read<Electrostatics>>,
    }
}

impl Document {
    /// Reads the whole file. The flag says whether unknown keys at the top level may stand for missing tables.
    pub(super) fn read(table: &DeTable<'_>, log: &mut Log<'_>) -> (Self, bool) {
        Self::from_entries(Entries::of_document(table), log)
    }
}

impl Document {
    /// The electrodes, if there is a pair among them.
    pub(super) fn pair(&self) -> Option<&Read<Electrodes>> {
        let has_pair = |forms: &Electrodes| forms.in_plane_pair.is_some() || forms.stacked_pair.is_some();
        self.electrodes.as_ref().filter(|read| read.get().is_none_or(has_pair))
    }
}

table! {
    /// The soft layer.
    struct Layer {
        /// Undeformed thickness H.
        thickness: Read<Size>,
        /// Undeformed half-length along x1, from the middle to the free end; the closed form does not use it.
        half_length: Option<Read<Size>>,
        /// Relative permittivity; needed as soon as there are electrodes or conductors.
        relative_permittivity: Option<Read<Permittivity>>,
        /// What it is made of; needed as soon as there is a load.
        material: Option<Read<MaterialTable>>,
    }
}

table! {
    /// Electrodes by their usual forms: at most one pair, which lies in the layer, centred at x1 = x3 = 0, and deforms with it; of the
    /// others any number, each a table or an array of tables.
    struct Electrodes {
        /// Two coplanar electrodes side by side.
        in_plane_pair: Option<Read<InPlanePair>>,
        /// Two plates, one above the other.
        stacked_pair: Option<Read<StackedPair>>,
        /// Two combs whose fingers lie between one another.
        comb: Option<Read<OneOrMore<Comb>>>,
        /// Rows and columns of pads.
        array: Option<Read<OneOrMore<Array>>>,
        /// Square spirals.
        spiral: Option<Read<OneOrMore<Spiral>>>,
        /// Rings and discs about one centre.
        ring: Option<Read<OneOrMore<Ring>>>,
    }
}

pub(super) type OneOrMore<T> = Either<Vec<Read<T>>, T>;

words! {
    /// Where electrodes lie: in the face of the substrate, level with it, or on top of the layer, which they move with.
    enum On { "substrate" => Substrate, "layer-top" => LayerTop, }
}

table! {
    /// A frame around electrodes, at their height and of their thickness. It is grounded unless a [[terminal]] holds it.
    struct Guard {
        /// From the electrodes to the frame.
        gap: Read<Size>,
        /// Of the frame's sides.
        width: Read<Size>,
    }
}

table! {
    /// Two combs, `<name>-1` and `<name>-2`, whose fingers, along x3, lie between one another along x1.
    struct Comb {
        /// What the names of its conductors begin with. Default: "comb".
        name: Option<Read<Text>>,
        /// The face that they lie on.
        on: Option<Read<On>>,
        /// The height of their mid-plane instead, in a layer that is not loaded or outside of it.
        height: Option<Read<Position>>,
        /// Of both together, alternately of the first and the second.
        fingers: Read<Count>,
        /// Along x1.
        finger_width: Read<Size>,
        /// Between neighbouring fingers, along x1.
        gap: Read<Size>,
        /// Length along which neighbouring fingers lie side by side, along x3.
        overlap: Read<Size>,
        /// From the end of a finger to the bus of the other comb.
        end_gap: Read<Size>,
        /// Of the bar that joins the fingers of a comb, along x3.
        bus_width: Read<Size>,
        /// Along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The middle: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A frame around both.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// Pads in rows along x1 and columns along x3: `<name>-i-j`, where i counts along x1 and j along x3.
    struct Array {
        /// What the names of its conductors begin with. Default: "pad".
        name: Option<Read<Text>>,
        /// The face that they lie on.
        on: Option<Read<On>>,
        /// The height of their mid-plane instead, in a layer that is not loaded or outside of it.
        height: Option<Read<Position>>,
        /// How many along x1 and along x3.
        pads: Read<[Read<Count>; 2]>,
        /// Of a rectangular pad, along x1 and x3.
        size: Option<Read<[Read<Size>; 2]>>,
        /// Of a round pad.
        diameter: Option<Read<Size>>,
        /// Of the hole of a round pad, which is then a ring.
        inner_diameter: Option<Read<Size>>,
        /// From the middle of a pad to that of the next, along x1 and x3.
        pitch: Read<[Read<Size>; 2]>,
        /// Along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The middle: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A plate over or under all pads.
        common_plate: Option<Read<CommonPlate>>,
        /// A frame around all pads.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// A rectangular plate that all pads of an array face: `<name>-plate`.
    struct CommonPlate {
        /// The face that it lies on.
        on: Option<Read<On>>,
        /// The height of its mid-plane instead.
        height: Option<Read<Position>>,
        /// How far it reaches beyond the pads, on each side. Default: 0.
        margin: Option<Read<Height>>,
        /// Along x2; "0 um" for a sheet.
        thickness: Read<Height>,
        /// Its charge, if it floats. Default: it is held at a potential.
        charge: Option<Read<Charge>>,
    }
    one_of: "on", "height";
}

table! {
    /// A square spiral, `<name>`, or two within one another, `<name>-1` and `<name>-2`.
    struct Spiral {
        /// What the names of its conductors begin with. Default: "spiral".
        name: Option<Read<Text>>,
        /// The face that it lies on.
        on: Option<Read<On>>,
        /// The height of its mid-plane instead, in a layer that is not loaded or outside of it.
        height: Option<Read<Position>>,
        /// 1, or 2 within one another. Default: 2.
        arms: Option<Read<Count>>,
        /// Of each arm.
        turns: Read<Count>,
        /// Of the trace.
        trace_width: Read<Size>,
        /// Between neighbouring traces.
        gap: Read<Size>,
        /// From the centre to the middle of the innermost trace.
        inner: Read<Size>,
        /// Along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The middle: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A frame around it.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// A disc or ring, `<name>`.
    struct Ring {
        /// The name of its conductor. Default: "ring".
        name: Option<Read<Text>>,
        /// The face that it lies on.
        on: Option<Read<On>>,
        /// The height of its mid-plane instead, in a layer that is not loaded or outside of it.
        height: Option<Read<Position>>,
        /// On the outside.
        diameter: Read<Size>,
        /// Of the hole. Default: none, a disc.
        inner_diameter: Option<Read<Size>>,
        /// Along x2; "0 um" for a sheet.
        thickness: Read<Height>,
        /// The middle: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A round frame around it.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// Two coplanar electrodes side by side along x1.
    struct InPlanePair {
        /// Undeformed gap D, face to face along x1.
        gap: Read<Size>,
        /// Length of each electrode along x1.
        length: Read<Size>,
        /// Undeformed thickness T along x2.
        thickness: Read<Size>,
        /// Width W along x3.
        width: Read<Size>,
        /// Undeformed height S of the mid-plane above the substrate.
        height: Read<Size>,
        /// Shear modulus of the electrodes, or "rigid"; needed as soon as there is a load.
        shear_modulus: Option<Read<Stiffness>>,
    }
}

table! {
    /// Two plates, one above the other.
    struct StackedPair {
        /// Undeformed gap between the facing surfaces, along x2.
        gap: Read<Size>,
        /// Length of each plate along x1.
        length: Read<Size>,
        /// Undeformed thickness of each plate along x2.
        thickness: Read<Size>,
        /// Width of each plate along x3.
        width: Read<Size>,
        /// Undeformed height of the middle of the gap above the substrate.
        height: Read<Size>,
        /// Shear modulus of the plates, or "rigid"; needed as soon as there is a load.
        shear_modulus: Option<Read<Stiffness>>,
    }
}

words! {
    /// The electrodes keep their thickness.
    enum Rigid { "rigid" => Rigid, }
}

pub(super) type Stiffness = Either<Rigid, Modulus>;

choice! {
    /// How the layer's deformation is computed.
    enum Mechanics {
        "closed_form" => ClosedForm(ClosedForm),
        "plane_strain" => PlaneStrain(PlaneStrain),
        "solid" => Solid(Solid),
    }
}

table! {
    /// The closed-form solution: bonded layer under a wide flat probe, plane strain. Equation numbers are those of "Large
    /// deformation mechanics of a soft elastomeric layer under compressive loading for a MEMS tactile sensor application".
    struct ClosedForm {
        /// Half-length L of the contact in the force formula, eq. (50).
        contact_half_length: Read<Size>,
        /// Width w of the contact in the force formula, eq. (50).
        contact_width: Read<Size>,
        /// Length L in the shear constant B, eq. (45), or "finite-element" to find it at each step.
        shear_length: Read<Either<FiniteElement, Size>>,
    }
}

words! {
    /// Found at each step from finite elements of the layer under a sharp punch of the contact's length.
    enum FiniteElement { "finite-element" => FiniteElement, }
}

table! {
    /// Finite elements in plane strain: large deformations, contact, electrodes as stiffer inclusions.
    struct PlaneStrain {
        /// The indenter: "whole-top" for a smooth plate over the whole layer, or an indenter.
        indenter: Read<Either<WholeTop, Indenter>>,
        /// The layer's end: "free" of traction all the way, "free-on-substrate" (what folds over rests on the substrate
        /// plane), or "far" (the layer goes on: no motion along x1 there).
        end: Read<LayerEnd>,
        /// Width of the layer along x3, which the force is for.
        width: Read<Size>,
        /// Relative discretisation error of the force to reach. Default: 5e-3.
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
        /// Half of its width along x1.
        half_width: Read<Size>,
        /// Radius of its corners. Default: none, that is sharp corners.
        corner_radius: Option<Read<Size>>,
        /// "smooth" (contact without friction: the layer slides around the corners), "bonded" (the layer sticks to the face), or "held"
        /// (no punch, but the patch that lay under it at rest is moved down, and may spread). Default: "smooth".
        contact: Option<Read<Contact>>,
        /// Its middle, along x1 from the middle of the layer. Default: 0.
        position: Option<Read<Position>>,
    }
}

table! {
    /// A cylinder, its axis along x3.
    struct Cylinder {
        /// Its radius.
        radius: Read<Size>,
        /// Its middle, along x1 from the middle of the layer. Default: 0.
        position: Option<Read<Position>>,
    }
}

table! {
    /// Finite elements in three dimensions, for a layer of finite width. Indenters are above its middle.
    struct Solid {
        /// The indenter: "whole-top" for a smooth plate over the whole layer, or an indenter.
        indenter: Read<Either<WholeTop, SolidIndenter>>,
        /// The layer's end along x1: "free" of traction all the way, "free-on-substrate" (what folds over rests on the
        /// substrate plane), or "far" (the layer goes on: no motion along x1 there).
        end: Read<LayerEnd>,
        /// Width of the layer along x3, from side to side.
        width: Read<Size>,
        /// The layer's sides along x3: "free" like the end, or "symmetric" (the layer goes on as in a mirror: no motion
        /// along x3 there). Default: "free".
        side: Option<Read<LayerSide>>,
        /// Relative discretisation error of the force to reach. Default: 2e-2.
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
        /// Half of its width along x1.
        half_width: Read<Size>,
        /// Half of its depth along x3, with a corner radius. Default: it goes all along x3.
        half_depth: Option<Read<Size>>,
        /// Radius of its corners. Default: none, that is sharp corners; those need a `contact` of "bonded" or "held".
        corner_radius: Option<Read<Size>>,
        /// "smooth" (contact without friction, with rounded corners), "bonded" (the layer sticks to the face), or "held" (no punch, but
        /// the patch that lay under it at rest is moved down, and may spread). Default: "smooth".
        contact: Option<Read<Contact>>,
    }
    later: "position";
}

table! {
    /// A cylinder, its axis along x3.
    struct SolidCylinder {
        /// Its radius.
        radius: Read<Size>,
    }
    later: "position";
}

table! {
    /// A sphere.
    struct Sphere {
        /// Its radius.
        radius: Read<Size>,
    }
    later: "position";
}

words! {
    /// How layer and indenter touch.
    enum Contact { "smooth" => Smooth, "bonded" => Bonded, "held" => Held, }
}

table! {
    /// What presses on the layer, by its form in [mechanics], as a part of the field. The closed form presses with a plate of the length
    /// and width of the contact, `indenter = "whole-top"` with one over the whole layer.
    struct FieldIndenter {
        /// "grounded" (a conductor at potential zero), "floating" (one without charge), `{ relative_permittivity = .. }` (a dielectric),
        /// or "absent" (the field is that without it, as without this table).
        role: Read<Either<IndenterRole, IndenterMedium>>,
        /// How tall a punch or a plate is, along x2. Default: as tall as it is wide along x1. Cylinders and spheres are whole.
        height: Option<Read<Size>>,
    }
}

words! {
    /// What the indenter is to the field.
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
        /// Distances of the indenter's lowest point from the surface of the layer, before contact: steps before those of the load, in
        /// which the layer is at rest.
        approach: Option<Read<Vec<Read<Size>>>>,
        /// Top displacement over thickness, U/H, of each step.
        compression: Option<Read<Either<Vec<Read<Compression>>, CompressionRange>>>,
        /// Compressive force of each step.
        force: Option<Read<Either<Vec<Read<Force>>, ForceRange>>>,
        /// Steps that also move what is attached to the layer's top or to the indenter.
        steps: Option<Read<Vec<Read<LoadStep>>>>,
    }
    one_of: "compression", "force", "steps";
}

table! {
    /// One load step; all of a case give a compression, or all a force.
    struct LoadStep {
        /// Top displacement over thickness, U/H.
        compression: Option<Read<Compression>>,
        /// Compressive force.
        force: Option<Read<Force>>,
        /// How far what is attached is moved along x1 and x3. Default: 0.
        shift: Option<Read<[Read<Position>; 2]>>,
        /// By how much what is attached is turned about x3 and about x1, about the middle of its lower side; right-handed: the first lifts
        /// the side towards +x1, the second lowers that towards +x3. Default: 0.
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

table! {
    /// Conductors on one wire: in the results they are one body with the name of the terminal.
    struct Terminal {
        /// Its name in the results.
        name: Read<Text>,
        /// The names of its conductors, of the electrodes or of [[conductor]]; they may touch one another.
        conductors: Read<Vec<Read<Text>>>,
        /// "ground": at potential zero, and in no matrix. Default: a source, which may be given any potential.
        potential: Option<Read<TerminalPotential>>,
    }
}

words! {
    /// The potential of a terminal.
    enum TerminalPotential { "ground" => Ground, }
}

table! {
    /// What is measured. Tolerance, curve and plot are those of this capacitance.
    struct Measure {
        /// Two terminals: their mutual capacitance with everything else grounded. One: its capacitance against ground, with everything
        /// else grounded.
        capacitance: Read<Vec<Read<Text>>>,
    }
}

table! {
    /// A conductor: held at a potential, or floating with a given charge.
    struct Conductor {
        /// Its name in the results.
        name: Read<Text>,
        /// A box with its edges along the axes.
        r#box: Option<Read<BoxRegion>>,
        /// Boxes that are one conductor together; they may touch, overlap or lie apart, and be flat along one axis.
        boxes: Option<Read<Vec<Read<BoxRegion>>>>,
        /// A rectangle of zero thickness.
        sheet: Option<Read<Sheet>>,
        /// A ball.
        sphere: Option<Read<Ball>>,
        /// All points within a radius of a segment: a finger, a wire.
        capsule: Option<Read<Capsule>>,
        /// A closed spherical surface around everything; nothing outside it is solved.
        shell: Option<Read<Ball>>,
        /// A circular cylinder, disc, tube or ring.
        cylinder: Option<Read<Tube>>,
        /// An outline pulled along an axis.
        extrusion: Option<Read<Extruded>>,
        /// What a closed surface in an OBJ file encloses.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of the [mesh]: of volumes, or of surfaces (a sheet, a shell, the skin of a body).
        physical: Option<Read<Text>>,
        /// Its charge, if it floats: then it is not in the Maxwell matrix, and its potential is reported. Default: it is held at
        /// a potential.
        charge: Option<Read<Charge>>,
        /// What it moves with when the layer is loaded. Default: "fixed".
        attached: Option<Read<Attached>>,
    }
    one_of: "box", "boxes", "sheet", "sphere", "capsule", "shell", "cylinder", "extrusion", "surface", "physical";
}

words! {
    /// What a body moves with: the top of the layer, the indenter, or nothing.
    enum Attached { "layer-top" => LayerTop, "indenter" => Indenter, "fixed" => Fixed, }
}

table! {
    /// A linear isotropic dielectric body.
    struct Dielectric {
        /// Its name in the results.
        name: Read<Text>,
        /// Relative permittivity.
        relative_permittivity: Read<Permittivity>,
        /// A box with its edges along the axes.
        r#box: Option<Read<BoxRegion>>,
        /// All space between two planes.
        slab: Option<Read<Slab>>,
        /// A ball.
        sphere: Option<Read<Ball>>,
        /// All points within a radius of a segment: a finger, a wire.
        capsule: Option<Read<Capsule>>,
        /// A circular cylinder, disc, tube or ring.
        cylinder: Option<Read<Tube>>,
        /// An outline pulled along an axis.
        extrusion: Option<Read<Extruded>>,
        /// What a closed surface in an OBJ file encloses.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of volumes of the [mesh].
        physical: Option<Read<Text>>,
        /// What it moves with when the layer is loaded. Default: "fixed".
        attached: Option<Read<Attached>>,
    }
    one_of: "box", "slab", "sphere", "capsule", "cylinder", "extrusion", "surface", "physical";
}

table! {
    /// A box with its edges along the axes.
    struct BoxRegion {
        /// Lower corner: x1, x2, x3.
        min: Read<[Read<Position>; 3]>,
        /// Upper corner: x1, x2, x3.
        max: Read<[Read<Position>; 3]>,
    }
}

table! {
    /// A rectangle of zero thickness.
    struct Sheet {
        /// The axis across it.
        normal: Read<Axis>,
        /// Where it is on that axis.
        at: Read<Position>,
        /// Lower corner on the two other axes, in order.
        min: Read<[Read<Position>; 2]>,
        /// Upper corner on the two other axes, in order.
        max: Read<[Read<Position>; 2]>,
    }
}

table! {
    /// All space between two planes; cut off at the walls.
    struct Slab {
        /// The axis across it.
        axis: Read<Axis>,
        /// Lower plane.
        from: Read<Position>,
        /// Upper plane.
        to: Read<Position>,
    }
}

table! {
    /// A ball, or the hollow of a shell.
    struct Ball {
        /// Its middle: x1, x2, x3.
        center: Read<[Read<Position>; 3]>,
        /// Its radius.
        radius: Read<Size>,
    }
}

table! {
    /// All points within a radius of a segment: a cylinder of any direction with half balls as its ends.
    struct Capsule {
        /// One end of the segment: x1, x2, x3.
        from: Read<[Read<Position>; 3]>,
        /// The other end; the same one for a ball.
        to: Read<[Read<Position>; 3]>,
        /// Its radius.
        radius: Read<Size>,
    }
}

table! {
    /// A circular cylinder along an axis, or a tube.
    struct Tube {
        /// The axis it stands along.
        axis: Read<Axis>,
        /// The middle of its lower end: x1, x2, x3.
        base: Read<[Read<Position>; 3]>,
        /// Its radius, on the outside.
        radius: Read<Size>,
        /// The radius of the hole along the axis of a tube or ring. Default: no hole.
        inner_radius: Option<Read<Size>>,
        /// Its length along the axis. A conductor with "0 mm" is a disc without thickness, or a ring.
        height: Read<Height>,
    }
}

table! {
    /// A side or corner of an outline that is round: an arc or a spline from the entry before, or a rounded corner.
    struct RoundEntry {
        /// Where the arc or spline ends.
        to: Option<Read<[Read<Position>; 2]>>,
        /// A point that the arc passes through on its way.
        through: Option<Read<[Read<Position>; 2]>>,
        /// Points that the spline passes through on its way, in order. A spline that is the only entry is closed.
        spline: Option<Read<Vec<Read<[Read<Position>; 2]>>>>,
        /// Where the two straight sides at a rounded corner would meet.
        corner: Option<Read<[Read<Position>; 2]>>,
        /// Of the rounding.
        radius: Option<Read<Size>>,
    }
    one_of: "to", "corner";
}

pub(super) type OutlineEntry = Either<[Read<Position>; 2], RoundEntry>;

table! {
    /// An outline pulled along an axis.
    struct Extruded {
        /// The axis along which it is pulled.
        axis: Read<Axis>,
        /// Lower end.
        from: Read<Position>,
        /// Upper end.
        to: Read<Position>,
        /// Its corners in the two other axes, in order. An entry may be an arc, `{ through = [..], to = [..] }`, a spline,
        /// `{ spline = [[..], ..], to = [..] }`, or a rounded corner, `{ corner = [..], radius = .. }`.
        outline: Read<Vec<Read<OutlineEntry>>>,
        /// Holes in it: outlines of the same kind, which lie inside and apart from one another.
        holes: Option<Read<Vec<Read<Vec<Read<OutlineEntry>>>>>>,
    }
}

table! {
    /// A closed surface of triangles.
    struct SurfaceFile {
        /// An OBJ file; its path is relative to the case file.
        file: Read<Text>,
        /// The length of one unit of the file.
        unit: Read<FileUnit>,
        /// Where the origin of the file goes. Default: where the origin is.
        translate: Option<Read<[Read<Position>; 3]>>,
    }
}

table! {
    /// A volume mesh from Gmsh: tetrahedra of first order in named physical groups. It is the whole scene: no body has
    /// another form than `physical`, cells that no body names are filled with the surroundings, and `boundary` in
    /// [surroundings] holds on the outer faces that are not a conductor's.
    struct MeshFile {
        /// A .msh file of version 4.1 or 2.2, ASCII or binary; its path is relative to the case file.
        file: Read<Text>,
        /// The length of one unit of the file.
        unit: Read<FileUnit>,
    }
}

words! {
    /// An axis: x1 in-plane, x2 up, x3 along the width.
    enum Axis { "x1" => X1, "x2" => X2, "x3" => X3, }
}

table! {
    /// What surrounds the bodies, and where the field ends.
    struct Surroundings {
        /// The outer walls: "insulated" (no flux), "grounded" (potential zero) or "open" (none, infinite space).
        boundary: Read<Boundary>,
        /// With a layer and walls: distance along x1 and x3 from the deformed electrodes to the walls.
        side_margin: Option<Read<Size>>,
        /// Without a layer: the box of the walls.
        walls: Option<Read<BoxRegion>>,
        /// Relative permittivity wherever nothing else is. Default: 1.
        relative_permittivity: Option<Read<Permittivity>>,
        /// What lies below x2 = 0. Default: the boundary itself, or infinite space if it is open.
        below: Option<Read<Face>>,
        /// What lies above the layer. Default: the boundary itself, or infinite space if it is open.
        above: Option<Read<Face>>,
    }
}

words! {
    /// The outer walls.
    enum Boundary { "insulated" => Insulated, "grounded" => Grounded, "open" => Open, }
}

words! {
    /// A plane at which the field ends.
    enum Plane { "insulated" => Insulated, "grounded" => Grounded, }
}

pub(super) type Face = Either<Plane, Medium>;

table! {
    /// A dielectric against the face of the layer.
    struct Medium {
        /// Relative permittivity.
        relative_permittivity: Read<Permittivity>,
        /// Its thickness, up to the boundary; "open" for infinitely thick (needs boundary = "open").
        thickness: Read<Either<OpenEnd, Size>>,
        /// What lies behind it: "grounded" (a ground plane), "insulated", or "open". Default: the boundary.
        then: Option<Read<Boundary>>,
    }
}

words! {
    /// Infinitely thick.
    enum OpenEnd { "open" => Open, }
}

table! {
    /// How accurately the capacitance is computed.
    struct Electrostatics {
        /// Spread of the proved bounds over the value (or the estimated error) to reach. Default: 1e-3.
        relative_tolerance: Option<Read<Tolerance>>,
        /// Spread of the proved bounds of the change, C of a step less that of the first one, over the change, to reach. Steps whose
        /// change is known less well are solved again. Needs at least two load steps. Default: the change is as well known as it is.
        change_tolerance: Option<Read<Tolerance>>,
        /// Whether to prove a lower and an upper bound, or only estimate the error. Default: true.
        bounds: Option<Read<Flag>>,
        /// Which solver: "boxes" (axis-aligned boxes and sheets only, and what consists of them; the fastest), "extruded" (outlines
        /// pulled along one axis) or "tetrahedra" (any shape, as it is given). Default: the first of these that can.
        solver: Option<Read<FieldSolver>>,
        /// Order of the potentials on tetrahedra, 1 to 3. Default: 2.
        order: Option<Read<PotentialOrder>>,
    }
}

words! {
    /// Which solver.
    enum FieldSolver { "boxes" => Boxes, "extruded" => Extruded, "tetrahedra" => Tetrahedra, }
}
