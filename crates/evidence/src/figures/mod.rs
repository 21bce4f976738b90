//! Computes the figures and tables of the paper that the closed form comes from: the closed form as lines,
//! finite elements as points, and the data as CSV beside each picture.
//!
//! All quantities are dimensionless: lengths over the thickness `H`, stresses over `C1` or the shear modulus
//! `mu`. The finite elements are those of [`elastocap_mechanics::solid`] with a neo-Hookean rubber: in plane
//! strain, with volume kept, the stresses `sigma_11`, `sigma_12`, `sigma_22` of the paper's Mooney-Rivlin
//! rubber are the same for the same `mu`.
//!
//! Finite-element runs that several figures need are computed once, in a [`Session`].

mod contours;
mod force;
mod panel;
mod profiles;
mod shear;
mod tables;

use std::collections::HashMap;
use std::rc::Rc;

use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::model::ModelError;
use elastocap_mechanics::solid::shear_length::{Contact, ShearLengths, shear_lengths};
use elastocap_mechanics::{LayerMap, LayerStress, MechanicsError, MooneyRivlin};

/// The paper's rubber, in Pa: `C1 = 1364.3`, `C2 = -87863.8`.
const RUBBER: MooneyRivlin = MooneyRivlin { c10: 682.15, c01: 43931.9 };
/// `C1` of the paper in Pa, the unit of its stresses.
const C1: f64 = 1364.3;
/// Half-length over thickness of the paper's finite-element model (section 3.2).
const HALF_LENGTH: f64 = 4.0;
/// The compressions of the finite-element runs.
const COMPRESSIONS: [f64; 8] = [0.01, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4];

/// A figure or a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Item {
    /// Table 1: the phase angle over the compression.
    Table1,
    /// Table 2: Poisson's ratio over the ratio of the moduli.
    Table2,
    /// Deformed mesh and stress under a held patch.
    Figure4,
    /// Shear stress under held patches of three lengths, small strain.
    Figure6,
    /// Shear stress along the bonded edge.
    Figure7,
    /// Stress along horizontal lines at 5 %.
    Figure9,
    /// Stress along vertical lines at 5 %.
    Figure10,
    /// Displacement at 5 %.
    Figure11,
    /// Stress and displacement along horizontal lines at 40 %.
    Figure12,
    /// Displacement along vertical lines at 40 %.
    Figure13,
    /// Force over compression.
    Figure16,
    /// The shear length over compression and contact length, which the paper leaves to finite elements.
    ShearLength,
}

impl Item {
    /// All items, in the order of the paper; the shear length last.
    pub const ALL: [Self; 12] = [
        Self::Table1,
        Self::Table2,
        Self::Figure4,
        Self::Figure6,
        Self::Figure7,
        Self::Figure9,
        Self::Figure10,
        Self::Figure11,
        Self::Figure12,
        Self::Figure13,
        Self::Figure16,
        Self::ShearLength,
    ];

    /// The name of the item on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table1 => "table-1",
            Self::Table2 => "table-2",
            Self::Figure4 => "4",
            Self::Figure6 => "6",
            Self::Figure7 => "7",
            Self::Figure9 => "9",
            Self::Figure10 => "10",
            Self::Figure11 => "11",
            Self::Figure12 => "12",
            Self::Figure13 => "13",
            Self::Figure16 => "16",
            Self::ShearLength => "shear-length",
        }
    }

    /// The item of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|item| item.name() == name)
    }

    /// The title of the item.
    pub fn title(self) -> &'static str {
        match self {
            Self::Table1 => "the phase angle over the compression",
            Self::Table2 => "Poisson's ratio over the ratio of the moduli",
            Self::Figure4 => "deformed mesh and stress under a held patch, U/H = 0.05",
            Self::Figure6 => "shear stress under held patches of three lengths, small strain",
            Self::Figure7 => "shear stress along the bonded edge under a held patch of half-length H/4",
            Self::Figure9 => "stress along horizontal lines, U/H = 0.05",
            Self::Figure10 => "stress along vertical lines, U/H = 0.05",
            Self::Figure11 => "displacement, U/H = 0.05",
            Self::Figure12 => "stress and displacement along horizontal lines, U/H = 0.40",
            Self::Figure13 => "displacement along vertical lines, U/H = 0.40",
            Self::Figure16 => "force over compression",
            Self::ShearLength => "the shear length L over compression and contact length",
        }
    }
}

/// The files and findings of a drawn item.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drawn {
    /// Names and contents of its files.
    pub files: Vec<(String, String)>,
    /// The findings in numbers, a sentence each.
    pub findings: Vec<String>,
    /// The parts that are missing because the solver stopped.
    pub missing: Vec<String>,
}

/// The reason why an item cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// The finite-element model cannot be built.
    #[error("the finite-element model cannot be built: {0}")]
    Model(#[from] ModelError),
    /// The closed form has no solution.
    #[error("the closed form has no answer: {0}")]
    ClosedForm(#[from] MechanicsError),
}

/// A finite-element run.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    contact: Contact,
    /// The condition at the end of the layer.
    end: End,
    compressions: &'static [f64],
    /// The number of elements over the thickness.
    elements: usize,
}

impl Run {
    /// The layer of section 3.2, pressed over its whole top.
    const fn layer(end: End) -> Self {
        Self { contact: Contact::WholeTop(HALF_LENGTH), end, compressions: &COMPRESSIONS, elements: 12 }
    }

    /// A held patch of this half-length over `H`, as the paper models a punch.
    const fn punch(half_length: f64) -> Self {
        Self {
            contact: Contact::Punch(half_length),
            end: End::Free,
            compressions: &COMPRESSIONS,
            elements: 8,
        }
    }

    /// A held patch as for [`Run::punch`], at small strain.
    const fn small_strain(half_length: f64) -> Self {
        Self { compressions: &[SMALL], ..Self::punch(half_length) }
    }
}

/// The compression that stands for small strain.
const SMALL: f64 = 1e-4;

/// Draws items and keeps the finite-element runs that they share.
#[derive(Debug, Default)]
pub struct Session {
    /// The results of the runs, by the text of their settings.
    runs: HashMap<String, Rc<ShearLengths>>,
}

impl Session {
    /// Draws one item.
    ///
    /// # Errors
    /// [`FigureError`]; points that the solver does not reach are no error but listed in [`Drawn::missing`].
    pub fn draw(&mut self, item: Item) -> Result<Drawn, FigureError> {
        match item {
            Item::Table1 => tables::phase_angles(),
            Item::Table2 => Ok(tables::poisson_ratios()),
            Item::Figure4 => contours::under_a_patch(self),
            Item::Figure6 => contours::three_patches(self),
            Item::Figure7 => shear::bonded_edge(self),
            Item::Figure9 => profiles::stress_along_rows(self),
            Item::Figure10 => profiles::stress_along_columns(self),
            Item::Figure11 => profiles::displacement_at_five_per_cent(self),
            Item::Figure12 => profiles::rows_at_forty_per_cent(self),
            Item::Figure13 => profiles::columns_at_forty_per_cent(self),
            Item::Figure16 => force::over_compression(self),
            Item::ShearLength => shear::lengths(self),
        }
    }

    /// The result of a run, which is computed when it is first asked for.
    fn run(&mut self, run: Run) -> Result<Rc<ShearLengths>, FigureError> {
        let key = format!("{run:?}");
        if let Some(found) = self.runs.get(&key) {
            return Ok(Rc::clone(found));
        }
        let found = Rc::new(shear_lengths(run.contact, run.end, run.compressions, run.elements, None)?);
        self.runs.insert(key, Rc::clone(&found));
        Ok(found)
    }
}

/// The closed form on `H = 1` with the paper's rubber and the shear length `L/H`.
fn closed_form(compression: f64, shear_length: f64) -> Result<LayerStress, MechanicsError> {
    LayerStress::new(LayerMap::new(1.0, compression)?, RUBBER, shear_length)
}

/// The part that a run does not reach, if any, in words.
fn left_out(what: &str, found: &ShearLengths) -> Option<String> {
    let stopped = found.stopped.as_ref()?;
    let last = found.points.last().map_or(0.0, |p| p.shear.compression);
    Some(format!("{what}: no finite elements beyond U/H = {last}: {}", stopped.reason))
}
