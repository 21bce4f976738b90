//! `[electrodes]`: a pair in the layer, combs, arrays, spirals and rings.

use serde_json::{Value, json};
use toml::de::DeValue;

use crate::quantities::{Charge, Height, Modulus, Position, Size};
use crate::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use crate::tables::{Entries, TableKeys, TableSchema, key, table, unknown_word, words};
use crate::values::{Count, Either, Text};

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

pub(crate) type OneOrMore<T> = Either<Vec<Read<T>>, T>;

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

pub(crate) type Stiffness = Either<Rigid, Modulus>;
