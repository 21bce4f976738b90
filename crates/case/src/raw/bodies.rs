//! `[[conductor]]` and `[[dielectric]]`: what bodies are, and their shapes.

use serde_json::{Value, json};
use toml::de::DeValue;

use crate::file_unit::FileUnit;
use crate::quantities::{Charge, Height, Permittivity, Position, Size};
use crate::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use crate::tables::{Entries, TableKeys, TableSchema, key, table, unknown_word, words};
use crate::values::{Either, Text};

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
        /// The body inside a closed surface in an OBJ file.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of the [mesh]: of volumes, or of surfaces (a sheet, a shell, the skin of a body).
        physical: Option<Read<Text>>,
        /// Its charge, if it floats: then it is not in the Maxwell matrix, and its potential is reported. Default: it is held at
        /// a potential.
        charge: Option<Read<Charge>>,
        /// The part of the sensor that it moves with when the layer is loaded. Default: "fixed".
        attached: Option<Read<Attached>>,
    }
    one_of: "box", "boxes", "sheet", "sphere", "capsule", "shell", "cylinder", "extrusion", "surface", "physical";
}

words! {
    /// The part of the sensor that a body moves with: the material of the layer that it lies in, the top of the layer, the indenter, or nothing.
    enum Attached { "layer" => Layer, "layer-top" => LayerTop, "indenter" => Indenter, "fixed" => Fixed, }
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
        /// The body inside a closed surface in an OBJ file.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of volumes of the [mesh].
        physical: Option<Read<Text>>,
        /// The part of the sensor that it moves with when the layer is loaded. Default: "fixed".
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
        /// Radius of a rounded corner.
        radius: Option<Read<Size>>,
    }
    one_of: "to", "corner";
}

pub(crate) type OutlineEntry = Either<[Read<Position>; 2], RoundEntry>;

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

words! {
    /// An axis: x1 in-plane, x2 up, x3 along the width.
    enum Axis { "x1" => X1, "x2" => X2, "x3" => X3, }
}
