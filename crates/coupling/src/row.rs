//! The line of curve.csv of a step.

use elastocap_electrostatics::Bounded;
use serde::{Deserialize, Serialize};

use crate::status::Status;

/// The columns of curve.csv, in their order. All in SI units; what a case does not have is empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The compression U/H.
    pub compression: Option<f64>,
    /// The distance of the indenter from the surface of the layer, m: zero from contact on; `None` in cases without `approach`.
    pub distance_m: Option<f64>,
    /// The compressive force, N; `None` in the closed form beyond the compression at which equation (50) of the paper has its largest
    /// force.
    pub force_n: Option<f64>,
    /// Relative error of the force at its compression, by the finite elements of the layer and by the model of the layer; an estimate. `None` where
    /// one of the two is not known.
    #[serde(default)]
    pub force_error_estimate: Option<f64>,
    /// The horizontal force along x1, N, that the shift of the attached bodies takes, by simple shear of a closed-form layer that is bonded to
    /// what is shifted. `None` under a tilt, and for layers by finite elements.
    pub force_x1_n: Option<f64>,
    /// The horizontal force along x3, N; see [`Row::force_x1_n`].
    pub force_x3_n: Option<f64>,
    /// The displacement U of the top of the layer, m.
    pub top_displacement_m: Option<f64>,
    /// The gap between the facing surfaces of the electrodes, m.
    pub gap_m: Option<f64>,
    /// The height above the substrate of the mid-plane of an in-plane pair, or of the middle of the gap of a stacked one, m.
    pub electrode_height_m: Option<f64>,
    /// The thickness of the electrodes, m; the mean of the two of a stacked pair.
    pub electrode_thickness_m: Option<f64>,
    /// The two-terminal capacitance where that is measured, F: of a pair (others at potential zero), or of the only terminal against ground.
    pub two_terminal_capacitance_f: Option<f64>,
    /// The capacitance that is measured, F: two-terminal, mutual, or against ground; of a whole matrix under load the mutual capacitance of its
    /// first two terminals.
    pub capacitance_f: Option<f64>,
    /// The lower bound of [`Row::capacitance_f`], F.
    pub capacitance_lower_f: Option<f64>,
    /// The upper bound of [`Row::capacitance_f`], F.
    pub capacitance_upper_f: Option<f64>,
    /// The relative error of the capacitance: half the spread of the bounds over the value, or the estimate. Without conductors, the relative
    /// error of the force, where finite elements give one.
    pub relative_error_estimate: Option<f64>,
    /// Relative error of the capacitance for the finite elements of the layer, which place the electrodes; an estimate, in
    /// addition to the one above.
    pub mechanics_error_estimate: Option<f64>,
    /// Relative error of the capacitances for flat faces in place of curved ones, or for cubics in place of the sides of several finite
    /// elements; an estimate, in addition to those above. Zero where all bodies are flat-faced or have their own curves.
    pub geometry_error_estimate: Option<f64>,
    /// Relative error of the capacitance for the model of the layer: how far the closed form, or plane strain, is from the next better
    /// model; an estimate, in addition to those above. Zero where there is no better model here, and without a load.
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
    /// How far the change may be from the true one, F: to the farther of its bounds, and by the estimated errors of both capacitances.
    pub change_total_error_f: Option<f64>,
    /// The sensitivity dC/dF by differences between the steps, F/N; `None` where forces are not known, and where it has no error that would
    /// say that its sign is not known.
    pub sensitivity_f_per_n: Option<f64>,
    /// The error of the sensitivity, F/N: what the bounds and all estimated errors of the capacitances leave open, and an estimate of the rest;
    /// `None` with two steps.
    pub sensitivity_error_f_per_n: Option<f64>,
    /// The number of unknowns of the largest problem solved, primal plus dual.
    pub unknowns: Option<usize>,
    /// How the step went. It is written down for people, and not read again.
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

    /// The numbers of the columns before `unknowns`, in their order.
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

    /// The estimated relative errors of the capacitance that its bounds do not hold: of the layer's finite elements, of flat faces, and of the
    /// model of the layer.
    pub fn estimated_errors(&self) -> f64 {
        let all = [self.mechanics_error_estimate, self.geometry_error_estimate, self.model_error_estimate];
        all.into_iter().flatten().sum()
    }

    /// The relative error of the capacitance within the model of the layer: by its bounds, the layer's finite elements and flat faces.
    pub fn error_in_model(&self) -> Option<f64> {
        let estimated = [self.mechanics_error_estimate, self.geometry_error_estimate];
        Some(self.relative_error_estimate? + estimated.into_iter().flatten().sum::<f64>())
    }

    /// The relative error of the capacitance by all that is known. The error of the model counts once it is known.
    pub fn total_error(&self) -> Option<f64> {
        Some(self.error_in_model()? + self.model_error_estimate.unwrap_or(0.0))
    }

    /// The limits of the change against the first step, F: its bounds, moved apart by the estimated errors of both capacitances.
    pub fn change_limits(&self, first: &Self) -> Option<[f64; 2]> {
        let [lower, upper, change] = [self.change_lower_f?, self.change_upper_f?, self.change_f?];
        let error = |row: &Self| Some(row.estimated_errors() * row.capacitance_f?.abs());
        // What is the same scene is wrong by the same.
        let besides = if change == 0.0 && lower == upper { 0.0 } else { error(self)? + error(first)? };
        Some([lower - besides, upper + besides])
    }

    /// The limits of the capacitance, F: its bounds, moved apart by its estimated errors.
    pub fn capacitance_limits(&self) -> Option<[f64; 2]> {
        let besides = self.estimated_errors() * self.capacitance_f?.abs();
        Some([self.capacitance_lower_f? - besides, self.capacitance_upper_f? + besides])
    }

    /// Whether the indenter does not touch the layer yet.
    pub fn is_before_contact(&self) -> bool {
        self.distance_m.is_some_and(|distance| distance > 0.0)
    }

    /// Notes the capacitance that is measured, and the two-terminal one if it is known too.
    pub(crate) fn set_capacitance(&mut self, capacitance: &Bounded, two_terminal: Option<Bounded>) {
        self.two_terminal_capacitance_f = two_terminal.map(|own| own.value);
        self.capacitance_f = Some(capacitance.value);
        self.capacitance_lower_f = Some(capacitance.lower);
        self.capacitance_upper_f = Some(capacitance.upper);
        self.relative_error_estimate = Some(capacitance.relative_error());
        self.fringe_ratio = self.parallel_plate_f.map(|plates| capacitance.value / plates);
    }
}
