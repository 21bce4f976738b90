//! `[electrodes]`: a pair in the layer, combs, arrays, spirals and rings.

use serde_json::{Value, json};
use toml::de::DeValue;

use crate::quantities::{Charge, Height, Modulus, Position, Size};
use crate::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use crate::tables::{Entries, TableKeys, TableSchema, key, table, unknown_word, words};
use crate::values::{Count, Either, Text};

table! {
    /// Electrodes of standard forms: at most one pair, which lies in the layer, centred at x1 = x3 = 0, and
    /// deforms with it, and any number of the other forms, each a table or an array of tables.
    struct Electrodes {
        /// Two coplanar electrodes side by side.
        in_plane_pair: Option<Read<InPlanePair>>,
        /// Two plates, one above the other.
        stacked_pair: Option<Read<StackedPair>>,
        /// Two combs with interleaved fingers.
        comb: Option<Read<OneOrMore<Comb>>>,
        /// Rows and columns of pads.
        array: Option<Read<OneOrMore<Array>>>,
        /// Square spirals.
        spiral: Option<Read<OneOrMore<Spiral>>>,
        /// Rings and discs.
        ring: Option<Read<OneOrMore<Ring>>>,
    }
}

pub(crate) type OneOrMore<T> = Either<Vec<Read<T>>, T>;

words! {
    /// The face that electrodes lie on: in the surface of the substrate, flush with it, or on top of the
    /// layer, with which they move.
    enum On { "substrate" => Substrate, "layer-top" => LayerTop, }
}

table! {
    /// A frame around electrodes, at the same height and of the same thickness. It is grounded unless it
    /// belongs to a [[terminal]].
    struct Guard {
        /// Gap between the electrodes and the frame.
        gap: Read<Size>,
        /// Width of the sides of the frame.
        width: Read<Size>,
    }
}

table! {
    /// Two combs, `<name>-1` and `<name>-2`, with fingers along x3 that are interleaved along x1.
    struct Comb {
        /// The beginning of the names of its conductors. Default: "comb".
        name: Option<Read<Text>>,
        /// The face that the combs lie on.
        on: Option<Read<On>>,
        /// Height of the mid-plane of the combs, instead of `on`, in a layer without load or outside of it.
        height: Option<Read<Position>>,
        /// Number of fingers of both combs together; they belong alternately to the first and the second
        /// comb.
        fingers: Read<Count>,
        /// Width of a finger along x1.
        finger_width: Read<Size>,
        /// Gap between neighbouring fingers, along x1.
        gap: Read<Size>,
        /// Length over which neighbouring fingers overlap, along x3.
        overlap: Read<Size>,
        /// Gap from the end of a finger to the bus of the other comb, along x3.
        end_gap: Read<Size>,
        /// Width of the bus, the bar that joins the fingers of a comb, along x3.
        bus_width: Read<Size>,
        /// Thickness of the combs along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The middle of the two combs: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A frame around both combs.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// Pads in rows along x1 and columns along x3: `<name>-i-j`, where i counts along x1 and j along x3.
    struct Array {
        /// The beginning of the names of its conductors. Default: "pad".
        name: Option<Read<Text>>,
        /// The face that the pads lie on.
        on: Option<Read<On>>,
        /// Height of the mid-plane of the pads, instead of `on`, in a layer without load or outside of it.
        height: Option<Read<Position>>,
        /// Number of pads along x1 and along x3.
        pads: Read<[Read<Count>; 2]>,
        /// Size of a rectangular pad along x1 and along x3.
        size: Option<Read<[Read<Size>; 2]>>,
        /// Diameter of a round pad.
        diameter: Option<Read<Size>>,
        /// Diameter of the hole of a round pad, which is then a ring.
        inner_diameter: Option<Read<Size>>,
        /// Distance between the middles of neighbouring pads, along x1 and along x3.
        pitch: Read<[Read<Size>; 2]>,
        /// Thickness of the pads along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The middle of the array: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A plate above or below all pads.
        common_plate: Option<Read<CommonPlate>>,
        /// A frame around all pads.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// A rectangular plate that all pads of an array face: `<name>-plate`.
    struct CommonPlate {
        /// The face that the plate lies on.
        on: Option<Read<On>>,
        /// Height of the mid-plane of the plate, instead of `on`.
        height: Option<Read<Position>>,
        /// Margin of the plate beyond the pads, on each side. Default: 0.
        margin: Option<Read<Height>>,
        /// Thickness of the plate along x2; "0 um" for a sheet.
        thickness: Read<Height>,
        /// Charge of the plate, if it floats. Default: the plate is driven.
        charge: Option<Read<Charge>>,
    }
    one_of: "on", "height";
}

table! {
    /// A square spiral, `<name>`, or two interleaved ones, `<name>-1` and `<name>-2`.
    struct Spiral {
        /// The beginning of the names of its conductors. Default: "spiral".
        name: Option<Read<Text>>,
        /// The face that the spiral lies on.
        on: Option<Read<On>>,
        /// Height of the mid-plane of the spiral, instead of `on`, in a layer without load or outside of it.
        height: Option<Read<Position>>,
        /// Number of arms: 1, or 2 interleaved ones. Default: 2.
        arms: Option<Read<Count>>,
        /// Number of turns of each arm.
        turns: Read<Count>,
        /// Width of the trace.
        trace_width: Read<Size>,
        /// Gap between neighbouring traces.
        gap: Read<Size>,
        /// Distance from the centre of the spiral to the middle of the innermost trace.
        inner: Read<Size>,
        /// Thickness of the trace along x2; "0 um" for sheets.
        thickness: Read<Height>,
        /// The centre of the spiral: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A frame around the spiral.
        guard: Option<Read<Guard>>,
    }
    one_of: "on", "height";
}

table! {
    /// A disc or ring, `<name>`.
    struct Ring {
        /// The name of the conductor. Default: "ring".
        name: Option<Read<Text>>,
        /// The face that the disc or ring lies on.
        on: Option<Read<On>>,
        /// Height of the mid-plane of the disc or ring, instead of `on`, in a layer without load or outside
        /// of it.
        height: Option<Read<Position>>,
        /// Outer diameter of the disc or ring.
        diameter: Read<Size>,
        /// Diameter of the hole of a ring. Default: no hole, a disc.
        inner_diameter: Option<Read<Size>>,
        /// Thickness of the disc or ring along x2; "0 um" for a sheet.
        thickness: Read<Height>,
        /// The middle of the disc or ring: x1, x3. Default: 0.
        center: Option<Read<[Read<Position>; 2]>>,
        /// A round frame around the disc or ring.
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
        /// Shear modulus of the electrodes, or "rigid"; required with a load.
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
        /// Shear modulus of the plates, or "rigid"; required with a load.
        shear_modulus: Option<Read<Stiffness>>,
    }
}

words! {
    /// Electrodes of constant thickness.
    enum Rigid { "rigid" => Rigid, }
}

pub(crate) type Stiffness = Either<Rigid, Modulus>;
