//! The raw types of a case file: every table and key of format 1 that this version reads.
//!
//! The doc comments of the keys are the descriptions in the JSON Schema, and address the author of a case
//! file.

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
        /// Title of the case, one line. Default: the name of the file.
        title: Option<Read<Text>>,
        /// The soft layer, from the substrate plane x2 = 0 to x2 = thickness.
        layer: Option<Read<Layer>>,
        /// Electrodes of standard forms: a pair in the layer, and any number of combs, arrays, spirals and
        /// rings.
        electrodes: Option<Read<Electrodes>>,
        /// The mechanical model of the layer.
        mechanics: Option<Read<Mechanics>>,
        /// The load steps, in the order of the results.
        load: Option<Read<Load>>,
        /// The indenter that presses on the layer, as a part of the field.
        indenter: Option<Read<FieldIndenter>>,
        /// Conductors besides the electrodes; none may touch another, unless both belong to one terminal.
        conductor: Option<Read<Vec<Read<Conductor>>>>,
        /// Conductors on one wire; a conductor that none of them names is a terminal by itself.
        terminal: Option<Read<Vec<Read<Terminal>>>>,
        /// The measured capacitance; conductors that it does not name are at potential zero. Default: that of
        /// the only two terminals, or of [electrodes]; with more terminals, the whole matrix.
        measure: Option<Read<Measure>>,
        /// Dielectric bodies; where two overlap, the later one in the file wins.
        dielectric: Option<Read<Vec<Read<Dielectric>>>>,
        /// The space around the bodies, and where the field ends.
        surroundings: Option<Read<Surroundings>>,
        /// A volume mesh from Gmsh as the whole scene; bodies are then `physical` groups of it.
        mesh: Option<Read<MeshFile>>,
        /// The accuracy of the capacitance, and the field solver.
        electrostatics: Option<Read<Electrostatics>>,
        /// Measured points, to be drawn over the curve and to be fitted.
        measurement: Option<Read<MeasurementFile>>,
    }
}

impl Document {
    /// Reads the whole file. The flag says whether unknown keys at the top level may stand for missing
    /// tables.
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
        /// Relative permittivity; required with electrodes or conductors.
        relative_permittivity: Option<Read<Permittivity>>,
        /// For a foam, instead of `relative_permittivity`: the permittivity grows as the load closes the
        /// pores. With a load this needs [mechanics.closed_form], or a whole top on a hyperfoam with a
        /// Poisson's ratio of 0. Forces need `hyperfoam` or `foam_table` as the material.
        foam: Option<Read<Foam>>,
        /// The material of the layer; required with a load.
        material: Option<Read<MaterialTable>>,
    }
}

table! {
    /// The permittivity of a foam by Looyenga's mixing rule: its cube root is the mean of the cube roots of
    /// the permittivities of solid and air, weighted by volume. Under load the volume fraction of the solid
    /// is divided by the ratio of the volume to that at rest: by 1 - U/H for a foam that does not widen,
    /// which is assumed of all but a hyperfoam.
    struct Foam {
        /// Relative permittivity of the solid.
        solid_permittivity: Read<Permittivity>,
        /// Volume fraction of the solid at rest; the rest is air.
        solid_fraction: Read<VolumeFraction>,
    }
}

table! {
    /// Conductors on one wire: in the results they are one body with the name of the terminal.
    struct Terminal {
        /// The name of the terminal in the results.
        name: Read<Text>,
        /// The names of the conductors on the wire, from the electrodes or from [[conductor]]; they may touch
        /// one another.
        conductors: Read<Vec<Read<Text>>>,
        /// "ground": at potential zero, and in no matrix. "driven": a guard with the potential of the
        /// terminal named by `follows`. Default: a source at any potential.
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
    /// The measured capacitance, as a chip reads it; tolerance, curve and plot refer to it.
    struct Measure {
        /// Two terminals: their mutual capacitance with everything else grounded. One: its capacitance
        /// against ground, with everything else grounded. A list of such lists: several capacitances, of
        /// which curve and plot show the first.
        capacitance: Read<Vec<Read<OneOrMore<Text>>>>,
        /// The measured capacitance of two terminals: "mutual" or "two-terminal" (equal and opposite charges,
        /// as a meter without ground measures). Default: mutual.
        kind: Option<Read<MeasureKind>>,
    }
}

words! {
    /// The measured capacitance of two terminals.
    enum MeasureKind { "mutual" => Mutual, "two-terminal" => TwoTerminal, }
}

table! {
    /// A volume mesh from Gmsh: tetrahedra of first order in named physical groups. It is the whole scene:
    /// every body has the form `physical`, cells that no body names are filled with the surroundings, and
    /// `boundary` in [surroundings] holds on the outer faces without a conductor.
    struct MeshFile {
        /// A .msh file of version 4.1 or 2.2, ASCII or binary; its path is relative to the case file.
        file: Read<Text>,
        /// The length of one unit of the file.
        unit: Read<FileUnit>,
    }
}

table! {
    /// The accuracy of the capacitance, and the field solver.
    struct Electrostatics {
        /// Tolerance of the spread of the proved bounds over the value, or of the estimated error. Default:
        /// 1e-3.
        relative_tolerance: Option<Read<Tolerance>>,
        /// Spread of the proved bounds (or estimated error) that suffices however small the capacitance is,
        /// which may be zero for a screened pair. Default: none, so that only `relative_tolerance` counts.
        absolute_tolerance: Option<Read<Capacitance>>,
        /// Tolerance of the spread of the proved bounds of the change, C of a step less that of the first
        /// one, over the change. Steps that miss it are solved again. Needs at least two load steps. Default:
        /// none.
        change_tolerance: Option<Read<Tolerance>>,
        /// Whether a lower and an upper bound are proved, instead of only an estimated error. Default: true.
        bounds: Option<Read<Flag>>,
        /// The solver: "boxes" (only axis-aligned boxes and sheets, and bodies that consist of them; the
        /// fastest), "extruded" (outlines extruded along one axis) or "tetrahedra" (any shape). Default: the
        /// first of these that can solve the scene.
        solver: Option<Read<FieldSolver>>,
        /// Polynomial order of the potentials on tetrahedra, 1 to 3. Default: 2.
        order: Option<Read<PotentialOrder>>,
    }
}

words! {
    /// The field solver.
    enum FieldSolver { "boxes" => Boxes, "extruded" => Extruded, "tetrahedra" => Tetrahedra, }
}
