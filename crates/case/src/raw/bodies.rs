//! `[[conductor]]` and `[[dielectric]]`: bodies and their shapes.

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
        /// The name of the conductor in the results.
        name: Read<Text>,
        /// A box with its edges along the axes.
        r#box: Option<Read<BoxRegion>>,
        /// Boxes that form one conductor; they may touch, overlap or lie apart, and be flat along one axis.
        boxes: Option<Read<Vec<Read<BoxRegion>>>>,
        /// A rectangle of zero thickness.
        sheet: Option<Read<Sheet>>,
        /// A ball.
        sphere: Option<Read<Ball>>,
        /// All points within a radius of a segment: a finger, a wire.
        capsule: Option<Read<Capsule>>,
        /// A closed spherical surface around everything; the field outside of it is not solved.
        shell: Option<Read<Ball>>,
        /// A circular cylinder, disc, tube or ring.
        cylinder: Option<Read<Tube>>,
        /// An outline extruded along an axis.
        extrusion: Option<Read<Extruded>>,
        /// The body inside a closed surface in an OBJ file.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of the [mesh]: of volumes, or of surfaces (a sheet, a shell, the skin of a body).
        physical: Option<Read<Text>>,
        /// Charge of the conductor, if it floats: then it is not in the Maxwell matrix, and its potential is
        /// reported. Default: the conductor is held at a potential.
        charge: Option<Read<Charge>>,
        /// The part of the sensor that the conductor moves with when the layer is loaded. Default: "fixed".
        attached: Option<Read<Attached>>,
    }
    one_of: "box", "boxes", "sheet", "sphere", "capsule", "shell", "cylinder", "extrusion", "surface", "physical";
}

words! {
    /// The part of the sensor that a body moves with: the material of the layer that it lies in, the top of
    /// the layer, the indenter, or nothing.
    enum Attached { "layer" => Layer, "layer-top" => LayerTop, "indenter" => Indenter, "fixed" => Fixed, }
}

table! {
    /// A linear isotropic dielectric body.
    struct Dielectric {
        /// The name of the dielectric in the results.
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
        /// An outline extruded along an axis.
        extrusion: Option<Read<Extruded>>,
        /// The body inside a closed surface in an OBJ file.
        surface: Option<Read<SurfaceFile>>,
        /// A physical group of volumes of the [mesh].
        physical: Option<Read<Text>>,
        /// The part of the sensor that the dielectric moves with when the layer is loaded. Default: "fixed".
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
        /// The axis normal to the sheet.
        normal: Read<Axis>,
        /// The position of the sheet on that axis.
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
        /// The axis normal to the slab.
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
        /// The centre of the ball: x1, x2, x3.
        center: Read<[Read<Position>; 3]>,
        /// The radius of the ball.
        radius: Read<Size>,
    }
}

table! {
    /// All points within a radius of a segment: a cylinder of any direction with half balls as its ends.
    struct Capsule {
        /// One end of the segment: x1, x2, x3.
        from: Read<[Read<Position>; 3]>,
        /// The other end of the segment; equal to the first one for a ball.
        to: Read<[Read<Position>; 3]>,
        /// The radius around the segment.
        radius: Read<Size>,
    }
}

table! {
    /// A circular cylinder along an axis, or a tube.
    struct Tube {
        /// The axis of the cylinder.
        axis: Read<Axis>,
        /// The centre of its lower end: x1, x2, x3.
        base: Read<[Read<Position>; 3]>,
        /// The outer radius.
        radius: Read<Size>,
        /// The radius of the hole along the axis of a tube or ring. Default: no hole.
        inner_radius: Option<Read<Size>>,
        /// The length along the axis. A conductor with "0 mm" is a disc without thickness, or a ring.
        height: Read<Height>,
    }
}

table! {
    /// A round side or corner of an outline: an arc or a spline from the entry before, or a rounded corner.
    struct RoundEntry {
        /// The end of the arc or spline.
        to: Option<Read<[Read<Position>; 2]>>,
        /// A point on the arc between its ends.
        through: Option<Read<[Read<Position>; 2]>>,
        /// Points on the spline between its ends, in order. A spline that is the only entry is closed.
        spline: Option<Read<Vec<Read<[Read<Position>; 2]>>>>,
        /// The point where the two straight sides at a rounded corner would meet.
        corner: Option<Read<[Read<Position>; 2]>>,
        /// Radius of a rounded corner.
        radius: Option<Read<Size>>,
    }
    one_of: "to", "corner";
}

pub(crate) type OutlineEntry = Either<[Read<Position>; 2], RoundEntry>;

table! {
    /// An outline extruded along an axis.
    struct Extruded {
        /// The axis of the extrusion.
        axis: Read<Axis>,
        /// Lower end.
        from: Read<Position>,
        /// Upper end.
        to: Read<Position>,
        /// The corners of the outline in the two other axes, in order. An entry may be an arc, `{ through =
        /// [..], to = [..] }`, a spline, `{ spline = [[..], ..], to = [..] }`, or a rounded corner, `{ corner
        /// = [..], radius = .. }`.
        outline: Read<Vec<Read<OutlineEntry>>>,
        /// Holes in the outline: outlines of the same kind, which lie inside and apart from one another.
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
        /// The position of the file's origin. Default: the origin.
        translate: Option<Read<[Read<Position>; 3]>>,
    }
}

words! {
    /// An axis: x1 in-plane, x2 up, x3 along the width.
    enum Axis { "x1" => X1, "x2" => X2, "x3" => X3, }
}
