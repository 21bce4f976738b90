//! `[measurement]`: measured points, to be drawn over the curve and to be fitted.

use serde_json::Value;
use toml::de::DeValue;

use crate::quantities::{Capacitance, Gain, LoadShift, SignedCapacitance};
use crate::reader::{FromToml, Log, Node, Read, alternatives};
use crate::tables::{Entries, TableKeys, TableSchema, key, table};
use crate::values::{Either, Text};

table! {
    /// Measured points: they are drawn over the curve, and `elastocap fit` adapts keys of this file to them.
    struct MeasurementFile {
        /// A CSV file whose first line names the columns; lines that begin with # are skipped. Its path is
        /// relative to the case file.
        file: Read<Text>,
        /// The columns of the load, of the capacitance and of its deviation.
        columns: Read<MeasuredColumns>,
        /// Uses only the rows with a certain text in a column. Default: all rows.
        rows: Option<Read<MeasuredRows>>,
        /// Standard deviation of each measured capacitance, if no column has it. Default: unknown.
        deviation: Option<Read<Capacitance>>,
        /// The measured load at which the load on the layer begins, from play before contact or from the zero
        /// of a scale. It is subtracted from the measured loads; a bare number for a compression. Default: 0.
        offset: Option<Read<Either<LoadShift, Text>>>,
        /// Capacitance of cables and of other bodies that are not in the case. It is subtracted from the
        /// measured capacitances. Default: 0.
        parasitic: Option<Read<SignedCapacitance>>,
        /// Ratio of the capacitance shown by the meter to the true one; measured capacitances, less the
        /// parasitic one, are divided by it. Default: 1.
        gain: Option<Read<Gain>>,
    }
}

table! {
    /// The columns of a file of measured points: one load, the capacitance, and its deviation if there is
    /// one.
    struct MeasuredColumns {
        /// Force on the layer, with a unit such as "N".
        force: Option<Read<MeasuredColumn>>,
        /// Displacement of the layer's top, with a unit such as "mm".
        displacement: Option<Read<MeasuredColumn>>,
        /// Displacement of the layer's top over its thickness, without a unit.
        compression: Option<Read<MeasuredColumn>>,
        /// The capacitance that the case measures, with a unit such as "pF".
        capacitance: Read<MeasuredColumn>,
        /// Standard deviation of the capacitance, with a unit such as "fF".
        deviation: Option<Read<MeasuredColumn>>,
    }
}

table! {
    /// A column of a CSV file.
    struct MeasuredColumn {
        /// The name of the column in the first line of the file.
        name: Read<Text>,
        /// The unit of the numbers in the column.
        unit: Option<Read<Text>>,
    }
}

table! {
    /// Rows of a CSV file that have a certain text in a column.
    struct MeasuredRows {
        /// The name of the column.
        column: Read<Text>,
        /// The text that a row must have there.
        equals: Read<Text>,
    }
}
