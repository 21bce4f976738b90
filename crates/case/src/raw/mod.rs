//! The case file as written: every table and key of format 1 that this version reads.
//!
//! The doc comments are the descriptions in the JSON Schema, so they speak to whoever writes a case file.

mod bodies;
mod electrodes;
mod measurement;
mod mechanics;
mod surroundings;

use serde_json::{Value, json};
use toml::de::{DeTable, DeValue};

use super::file_unit::FileUnit;
use super::material::MaterialTable;
use super::quantities::{Capacitance, Permittivity, Size, Tolerance, VolumeFraction};
use super::reader::{FromToml, Log, Node, Read, alternatives, nearest};
use super::tables::{Entries, TableKeys, TableSchema, key, table, unknown_word, words};
use super::values::{Flag, FormatNumber, PotentialOrder, Text};
pub(crate) use bodies::*;
pub(crate) use electrodes::*;
pub(crate) use measurement::*;
pub(crate) use mechanics::*;
pub(crate) use surroundings::*;

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
        /// The indenter that presses on the layer, as a part of the field.
        indenter: Option<Read<FieldIndenter>>,
        /// Conductors besides the electrodes; none may touch another, unless both belong to one terminal.
        conductor: Option<Read<Vec<Read<Conductor>>>>,
        /// Conductors on one wire; a conductor that none of them names is a terminal by itself.
        terminal: Option<Read<Vec<Read<Terminal>>>>,
        /// The capacitance that is measured; conductors that it does not name are at potential zero. Default: the pair of two terminals, or of
        /// [electrodes]; of more, the whole matrix.
        measure: Option<Read<Measure>>,
        /// Dielectric bodies; where two overlap, the later one in the file wins.
        dielectric: Option<Read<Vec<Read<Dielectric>>>>,
        /// The space around the bodies, and where the field ends.
        surroundings: Option<Read<Surroundings>>,
        /// A volume mesh from Gmsh that is the whole scene; bodies are then `physical` groups of it.
        mesh: Option<Read<MeshFile>>,
        /// How accurately the capacitance is computed.
        electrostatics: Option<Read<Electrostatics>>,
        /// Points that were measured, to be drawn over the curve and fitted to.
        measurement: Option<Read<MeasurementFile>>,
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
        /// In place of `relative_permittivity`, for a foam: its permittivity grows as the load closes its pores. Where there is a load it
        /// needs [mechanics.closed_form], or a whole top on a hyperfoam with a Poisson's ratio of 0. Forces need `hyperfoam` or
        /// `foam_table` as the material.
        foam: Option<Read<Foam>>,
        /// The material of the layer; needed as soon as there is a load.
        material: Option<Read<MaterialTable>>,
    }
}

table! {
    /// The permittivity of a foam by Looyenga's mixing rule: the cube root of the permittivity is the mean of those of solid and air
    /// by volume. Under load the solid's share of the volume is divided by the volume over that at rest: by 1 - U/H where the foam gets no
    /// wider, as all but a hyperfoam are taken.
    struct Foam {
        /// Relative permittivity of what the foam is made of.
        solid_permittivity: Read<Permittivity>,
        /// Share of the volume at rest that is solid; the rest is air.
        solid_fraction: Read<VolumeFraction>,
    }
}

table! {
    /// Conductors on one wire: in the results they are one body with the name of the terminal.
    struct Terminal {
        /// Its name in the results.
        name: Read<Text>,
        /// The names of its conductors, of the electrodes or of [[conductor]]; they may touch one another.
        conductors: Read<Vec<Read<Text>>>,
        /// "ground": at potential zero, and in no matrix. "driven": a guard that has the potential of the terminal which `follows` names.
        /// Default: a source, which may be given any potential.
        potential: Option<Read<TerminalPotential>>,
        /// With `potential = "driven"`: the terminal whose potential the guard has.
        follows: Option<Read<Text>>,
    }
}

words! {
    /// The potential of a terminal.
    enum TerminalPotential { "ground" => Ground, "driven" => Driven, }
}

table! {
    /// The capacitance that a chip measures: tolerance, curve and plot are about it.
    struct Measure {
        /// Two terminals: their mutual capacitance with everything else grounded. One: its capacitance against ground, with everything
        /// else grounded. A list of such lists: several capacitances, of which curve and plot show the first.
        capacitance: Read<Vec<Read<OneOrMore<Text>>>>,
        /// The capacitance of two terminals that is measured: "mutual" or "two-terminal" (equal and opposite charges, as a meter without ground
        /// measures). Default: mutual.
        kind: Option<Read<MeasureKind>>,
    }
}

words! {
    /// The capacitance of two terminals that is measured.
    enum MeasureKind { "mutual" => Mutual, "two-terminal" => TwoTerminal, }
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

table! {
    /// How accurately the capacitance is computed.
    struct Electrostatics {
        /// Spread of the proved bounds over the value (or the estimated error) to reach. Default: 1e-3.
        relative_tolerance: Option<Read<Tolerance>>,
        /// Spread of the proved bounds (or the estimated error) that is enough however small the capacitance is, which may be zero: of a
        /// screened pair, for instance. Default: none, so that only `relative_tolerance` counts.
        absolute_tolerance: Option<Read<Capacitance>>,
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
