//! The row of curve.csv of a step.

use elastocap_electrostatics::Bounded;
use serde::{Deserialize, Serialize};

use crate::status::Status;

/// The columns of curve.csv, in order. All values are in SI units; values that a case does not have are
/// empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The compression U/H.
    pub compression: Option<f64>,
    /// The distance of the indenter from the surface of the layer, m: zero from contact on; `None` in cases
    /// without `approach`.
    pub distance_m: Option<f64>,
    /// The compressive force, N. `None` in the closed form beyond the maximum of eq. (50) of the paper, where
    /// the formula no longer applies.
    pub force_n: Option<f64>,
    /// An estimate of the relative error of the force at its compression, from the finite elements and the
    /// model of the layer. `None` where one of the two is not known.
    #[serde(default)]
    pub force_error_estimate: Option<f64>,
    /// The horizontal force along x1, N, that shifts the attached bodies, by simple shear of a closed-form
    /// layer that is bonded to them. `None` under a tilt, and for layers by finite elements.
    pub force_x1_n: Option<f64>,
    /// The horizontal force along x3, N; see [`Row::force_x1_n`].
    pub force_x3_n: Option<f64>,
    /// The displacement U of the top of the layer, m.
    pub top_displacement_m: Option<f64>,
    /// The gap between the facing surfaces of the electrodes, m.
    pub gap_m: Option<f64>,
    /// The height above the substrate of the mid-plane of an in-plane pair, or of the middle of the gap of a
    /// stacked one, m.
    pub electrode_height_m: Option<f64>,
    /// The thickness of the electrodes, m; the mean of the two of a stacked pair.
    pub electrode_thickness_m: Option<f64>,
    /// The two-terminal capacitance where it is measured, F: of a pair, with all others at potential zero, or
    /// of the only terminal against ground.
    pub two_terminal_capacitance_f: Option<f64>,
    /// The measured capacitance, F: two-terminal, mutual, or against ground. For a whole matrix under load,
    /// the mutual capacitance of its first two terminals.
    pub capacitance_f: Option<f64>,
    /// The lower bound of [`Row::capacitance_f`], F.
    pub capacitance_lower_f: Option<f64>,
    /// The upper bound of [`Row::capacitance_f`], F.
    pub capacitance_upper_f: Option<f64>,
    /// The relative error of the capacitance: half the spread of the bounds over the value, or the estimate.
    /// Without conductors, the relative error of the force, where finite elements give one.
    pub relative_error_estimate: Option<f64>,
    /// An estimate of the relative error of the capacitance from the finite elements of the layer, which
    /// place the electrodes; in addition to `relative_error_estimate`.
    pub mechanics_error_estimate: Option<f64>,
    /// An estimate of the relative error of the capacitance from flat faces in place of curved ones, or from
    /// cubics in place of the sides of several finite elements; in addition to the errors above. Zero where
    /// all bodies are represented exactly.
    pub geometry_error_estimate: Option<f64>,
    /// An estimate of the relative error of the capacitance from the model of the layer: the difference of
    /// the closed form, or of plane strain, from the next better model; in addition to the errors above. Zero
    /// without a better model, and without load.
    pub model_error_estimate: Option<f64>,
    /// The sum of the relative errors of the capacitance above.
    pub total_error_estimate: Option<f64>,
    /// The capacitance by the formula of parallel plates, F.
    pub parallel_plate_f: Option<f64>,
    /// The capacitance over that of parallel plates.
    pub fringe_ratio: Option<f64>,
    /// [`Row::capacitance_f`] less that of the first load step, F; exactly zero for the same load and scene.
    pub change_f: Option<f64>,
    /// The lower bound of the change, F.
    pub change_lower_f: Option<f64>,
    /// The upper bound of the change, F.
    pub change_upper_f: Option<f64>,
    /// The change over the capacitance of the first load step.
    pub change_relative: Option<f64>,
    /// The largest distance of the change from the true one, F, from its bounds and the estimated errors of
    /// both capacitances.
    pub change_total_error_f: Option<f64>,
    /// The sensitivity dC/dF by differences between the steps, F/N. `None` where forces are not known, and
    /// where it has no error although its sign is uncertain.
    pub sensitivity_f_per_n: Option<f64>,
    /// An estimate of the error of the sensitivity, F/N, from the bounds and all estimated errors of the
    /// capacitances, and from the differences; `None` with two steps.
    pub sensitivity_error_f_per_n: Option<f64>,
    /// The number of unknowns of the largest problem solved, primal plus dual.
    pub unknowns: Option<usize>,
    /// The status of the step. It is written for readers, and not read back.
    #[serde(skip_deserializing)]
    pub status: Status,
}

impl Row {
    /// Names of the columns.
    pub const COLUMNS: [&'static str; 30] = [
        "compression",
        "distance_m",
        "force_n",
        "force_error_estimate",
        "force_x1_n",
        "force_x3_n",
        "top_displacement_m",
        "gap_m",
        "electrode_height_m",
        "electrode_thickness_m",
        "two_terminal_capacitance_f",
        "capacitance_f",
        "capacitance_lower_f",
        "capacitance_upper_f",
        "relative_error_estimate",
        "mechanics_error_estimate",
        "geometry_error_estimate",
        "model_error_estimate",
        "total_error_estimate",
        "parallel_plate_f",
        "fringe_ratio",
        "change_f",
        "change_lower_f",
        "change_upper_f",
        "change_relative",
        "change_total_error_f",
        "sensitivity_f_per_n",
        "sensitivity_error_f_per_n",
        "unknowns",
        "status",
    ];

    /// The values of the columns before `unknowns`, in order.
    pub fn numbers(&self) -> [Option<f64>; 28] {
        [
            self.compression,
            self.distance_m,
            self.force_n,
            self.force_error_estimate,
            self.force_x1_n,
            self.force_x3_n,
            self.top_displacement_m,
            self.gap_m,
            self.electrode_height_m,
            self.electrode_thickness_m,
            self.two_terminal_capacitance_f,
            self.capacitance_f,
            self.capacitance_lower_f,
            self.capacitance_upper_f,
            self.relative_error_estimate,
            self.mechanics_error_estimate,
            self.geometry_error_estimate,
            self.model_error_estimate,
            self.total_error_estimate,
            self.parallel_plate_f,
            self.fringe_ratio,
            self.change_f,
            self.change_lower_f,
            self.change_upper_f,
            self.change_relative,
            self.change_total_error_f,
            self.sensitivity_f_per_n,
            self.sensitivity_error_f_per_n,
        ]
    }

    /// The sum of the estimated relative errors of the capacitance that its bounds do not include: from the
    /// finite elements of the layer, from flat faces, and from the model of the layer.
    pub fn estimated_errors(&self) -> f64 {
        let errors = [self.mechanics_error_estimate, self.geometry_error_estimate, self.model_error_estimate];
        errors.into_iter().flatten().sum()
    }

    /// The relative error of the capacitance within the model of the layer: by its bounds, the layer's finite
    /// elements and flat faces.
    pub fn error_in_model(&self) -> Option<f64> {
        let estimated = [self.mechanics_error_estimate, self.geometry_error_estimate];
        Some(self.relative_error_estimate? + estimated.into_iter().flatten().sum::<f64>())
    }

    /// The relative error of the capacitance from all known sources. The error of the model is included once
    /// it is known.
    pub fn total_error(&self) -> Option<f64> {
        Some(self.error_in_model()? + self.model_error_estimate.unwrap_or(0.0))
    }

    /// The limits of the change from the first step, F: its bounds, widened by the estimated errors of both
    /// capacitances.
    pub fn change_limits(&self, first: &Self) -> Option<[f64; 2]> {
        let [lower, upper, change] = [self.change_lower_f?, self.change_upper_f?, self.change_f?];
        let error = |row: &Self| Some(row.estimated_errors() * row.capacitance_f?.abs());
        // Equal scenes have equal errors.
        let besides = if change == 0.0 && lower == upper { 0.0 } else { error(self)? + error(first)? };
        Some([lower - besides, upper + besides])
    }

    /// The limits of the capacitance, F: its bounds, widened by its estimated errors.
    pub fn capacitance_limits(&self) -> Option<[f64; 2]> {
        let besides = self.estimated_errors() * self.capacitance_f?.abs();
        Some([self.capacitance_lower_f? - besides, self.capacitance_upper_f? + besides])
    }

    /// Whether the indenter does not touch the layer yet.
    pub fn is_before_contact(&self) -> bool {
        self.distance_m.is_some_and(|distance| distance > 0.0)
    }

    /// Sets the measured capacitance, and the two-terminal one if it is known.
    pub(crate) fn set_capacitance(&mut self, capacitance: &Bounded, two_terminal: Option<Bounded>) {
        self.two_terminal_capacitance_f = two_terminal.map(|bounded| bounded.value);
        self.capacitance_f = Some(capacitance.value);
        self.capacitance_lower_f = Some(capacitance.lower);
        self.capacitance_upper_f = Some(capacitance.upper);
        self.relative_error_estimate = Some(capacitance.relative_error());
        self.fringe_ratio = self.parallel_plate_f.map(|plates| capacitance.value / plates);
    }
}
