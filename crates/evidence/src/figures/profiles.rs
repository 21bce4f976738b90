//! Figs. 9 to 13: stress and displacement of the layer of section 3.2 along lines of fixed `x2` and of fixed
//! `x1`.
//!
//! The text of the paper does not say which lines it shows. Here they are at quarters and halves of `x2/H`
//! and `x1/H`, over the range of the paper's axes, `x1/H` from 0 to 2. At 5 % the end is free, as in the
//! paper; at 40 % the substrate continues beyond it, since the forces at a folded free end depend on the
//! mesh.

use elastocap_mechanics::LayerStress;
use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::shear_length::ShearLengths;
use elastocap_mechanics::solid::stress::{Fields, Sample};

use super::panel::{Curve, Named, Panel, figure};
use super::{C1, Drawn, FigureError, RUBBER, Run, Session, closed_form, left_out};

/// `x2/H` of the rows that are shown.
const ROWS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// `x1/H` of the columns that are shown.
const COLUMNS: [f64; 5] = [0.0, 0.5, 1.0, 1.5, 2.0];
/// The number of abscissae of a curve; every second one gets a point.
const ABSCISSAE: usize = 33;

/// The quantity on the vertical axis.
#[derive(Clone, Copy)]
enum Quantity {
    S11,
    S22,
    S12,
    U1,
    U2,
}

impl Quantity {
    const STRESS: [Self; 3] = [Self::S11, Self::S22, Self::S12];

    fn named(self) -> Named {
        match self {
            Self::S11 => Named("σ₁₁/C₁", "sigma_11_over_c1"),
            Self::S22 => Named("σ₂₂/C₁", "sigma_22_over_c1"),
            Self::S12 => Named("σ₁₂/C₁", "sigma_12_over_c1"),
            Self::U1 => Named("u₁/H", "u_1_over_h"),
            Self::U2 => Named("u₂/H", "u_2_over_h"),
        }
    }

    fn of_closed_form(self, stress: &LayerStress, x: [f64; 2]) -> f64 {
        let x = [x[0], x[1], 0.0];
        match self {
            Self::S11 => stress.cauchy(x)[(0, 0)] / C1,
            Self::S22 => stress.cauchy(x)[(1, 1)] / C1,
            Self::S12 => stress.cauchy(x)[(0, 1)] / C1,
            Self::U1 => stress.map().displacement(x)[0],
            Self::U2 => stress.map().displacement(x)[1],
        }
    }

    /// The quantity at a sample of finite elements with the shear modulus 1.
    fn of_sample(self, sample: &Sample) -> f64 {
        let unit = RUBBER.shear_modulus() / C1;
        match self {
            Self::S11 => unit * sample.stress.s11,
            Self::S22 => unit * sample.stress.s22,
            Self::S12 => unit * sample.stress.s12,
            Self::U1 => sample.displacement[0],
            Self::U2 => sample.displacement[1],
        }
    }
}

/// Lines of fixed `x2` or of fixed `x1`.
#[derive(Clone, Copy, PartialEq)]
enum Along {
    Rows,
    Columns,
}

impl Along {
    /// The places of the lines, the range of the other coordinate, and the names of abscissa and parameter.
    fn lines(self) -> ([f64; 5], f64, Named, Named) {
        let (x1, x2) = (Named("x₁/H", "x_1_over_h"), Named("x₂/H", "x_2_over_h"));
        match self {
            Self::Rows => (ROWS, 2.0, x1, x2),
            Self::Columns => (COLUMNS, 1.0, x2, x1),
        }
    }

    /// The point of a line at the abscissa `t`.
    fn point(self, line: f64, t: f64) -> [f64; 2] {
        match self {
            Self::Rows => [t, line],
            Self::Columns => [line, t],
        }
    }
}

/// The state of a figure: finite elements if they converged there, and the closed form with their shear
/// length.
struct Shown<'a> {
    fields: Option<Fields<'a>>,
    closed: LayerStress,
}

impl<'a> Shown<'a> {
    /// Without finite elements the shear length is the half-length of the layer.
    fn new(found: &'a ShearLengths, compression: f64) -> Result<Self, FigureError> {
        let point = found.at(compression);
        let length = point.and_then(|p| p.shear.from_balance).unwrap_or(super::HALF_LENGTH);
        Ok(Self { fields: point.map(|p| found.fields(p)), closed: closed_form(compression, length)? })
    }

    fn panel(&self, file: &str, quantity: Quantity, along: Along, compression: f64) -> Panel {
        let (lines, range, x, parameter) = along.lines();
        let curve = |line: f64| Curve {
            parameter: line,
            rows: (0..ABSCISSAE)
                .map(|k| {
                    let t = range * k as f64 / (ABSCISSAE - 1) as f64;
                    let place = along.point(line, t);
                    let sample = self.fields.as_ref().and_then(|f| f.at(place));
                    let found = sample.map_or(f64::NAN, |s| quantity.of_sample(&s));
                    [t, quantity.of_closed_form(&self.closed, place), found]
                })
                .collect(),
        };
        let y = quantity.named();
        Panel {
            file: format!("figure-{file}"),
            title: format!("Fig. {file}: {} at U/H = {compression}: closed form; points: FE", y.0),
            x,
            y,
            parameter,
            curves: lines.map(curve).into(),
            x_is_x1: along == Along::Rows,
            stride: 2,
        }
    }
}

/// Draws panels of one state: each is the part of the figure, the quantity and the direction of the lines.
fn draw(
    found: &ShearLengths,
    compression: f64,
    panels: &[(&str, Quantity, Along)],
) -> Result<Drawn, FigureError> {
    let shown = Shown::new(found, compression)?;
    let mut drawn = Drawn::default();
    for (file, quantity, along) in panels {
        let panel = shown.panel(file, *quantity, *along, compression);
        drawn.files.extend(panel.files());
        if shown.fields.is_some() {
            drawn.findings.push(panel.finding());
        }
    }
    if let Some(fields) = &shown.fields
        && let (Some(sample), Some(point)) = (fields.at([0.0, 0.0]), found.at(compression))
    {
        let length = point.shear.from_balance.unwrap_or(f64::NAN);
        drawn.findings.push(format!(
            "bottom of the axis: σ₁₁/C₁ = {} by finite elements, {} in closed form with the L/H = {length:.4} of their balance \
             (43), {} with L = 4H",
            figure(Quantity::S11.of_sample(&sample)),
            figure(Quantity::S11.of_closed_form(&shown.closed, [0.0; 2])),
            figure(Quantity::S11.of_closed_form(&closed_form(compression, super::HALF_LENGTH)?, [0.0; 2]))
        ));
    } else {
        drawn.missing.extend(left_out("the layer pressed all over", found));
    }
    Ok(drawn)
}

pub(super) fn stress_along_rows(session: &mut Session) -> Result<Drawn, FigureError> {
    let [a, b, c] = Quantity::STRESS;
    let found = session.run(Run::layer(End::Free))?;
    draw(&found, 0.05, &[("9a", a, Along::Rows), ("9b", b, Along::Rows), ("9c", c, Along::Rows)])
}

pub(super) fn stress_along_columns(session: &mut Session) -> Result<Drawn, FigureError> {
    let [a, b, c] = Quantity::STRESS;
    let found = session.run(Run::layer(End::Free))?;
    draw(&found, 0.05, &[("10a", a, Along::Columns), ("10b", b, Along::Columns), ("10c", c, Along::Columns)])
}

pub(super) fn displacement_at_five_per_cent(session: &mut Session) -> Result<Drawn, FigureError> {
    let found = session.run(Run::layer(End::Free))?;
    let panels = [
        ("11a", Quantity::U1, Along::Rows),
        ("11b", Quantity::U1, Along::Columns),
        ("11c", Quantity::U2, Along::Rows),
        ("11d", Quantity::U2, Along::Columns),
    ];
    draw(&found, 0.05, &panels)
}

pub(super) fn rows_at_forty_per_cent(session: &mut Session) -> Result<Drawn, FigureError> {
    let found = session.run(Run::layer(End::FreeOnSubstrate))?;
    let panels = [
        ("12a", Quantity::S11, Along::Rows),
        ("12b", Quantity::S22, Along::Rows),
        ("12c", Quantity::S12, Along::Rows),
        ("12d", Quantity::U1, Along::Rows),
        ("12e", Quantity::U2, Along::Rows),
    ];
    draw(&found, 0.4, &panels)
}

pub(super) fn columns_at_forty_per_cent(session: &mut Session) -> Result<Drawn, FigureError> {
    let found = session.run(Run::layer(End::FreeOnSubstrate))?;
    draw(&found, 0.4, &[("13a", Quantity::U1, Along::Columns), ("13b", Quantity::U2, Along::Columns)])
}
