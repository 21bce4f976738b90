//! Fig. 7, the shear stress along the bonded edge, and the shear length that comes from it.
//!
//! The paper's punch is "a fourth of the layer thickness" and its peak lies at 2 to 3 times `L`, which
//! suggests the half-length `L = H/4`. The layer extends six thicknesses beyond the punch.

use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::shear_length::{Contact, FANS, ShearLengths};
use elastocap_mechanics::solid::stress::Sample;

use super::force::closed_form_force;
use super::panel::{Curve, Named, Panel, cell};
use super::{COMPRESSIONS, Drawn, FigureError, RUBBER, Run, Session, closed_form, left_out};
use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};

/// Half-length of the punch of Fig. 7 over `H`.
const QUARTER: f64 = 0.25;
/// Half-lengths of the punches of the table over `H`; the sixth is the probe of the paper's sensor, 500 um on
/// 450 um.
const PUNCHES: [f64; 7] = [QUARTER, 0.5, 1.0, 500.0 / 450.0, 2.0, 3.0, 4.0];

/// The place along the bonded edge where the shear stress is largest, and the place beyond it where the
/// stress has fallen to a tenth; over `H`.
pub(super) fn peak_and_end(edge: &[Sample]) -> Option<(f64, f64)> {
    let (place, peak) = edge.iter().enumerate().max_by(|a, b| a.1.stress.s12.total_cmp(&b.1.stress.s12))?;
    let end = edge[place..].iter().find(|s| s.stress.s12 < 0.1 * peak.stress.s12)?;
    Some((peak.reference[0], end.reference[0]))
}

/// Draws Fig. 7.
pub(super) fn bonded_edge(session: &mut Session) -> Result<Drawn, FigureError> {
    const COUNT: usize = 121;
    let found = session.run(Run::punch(QUARTER))?;
    let mut drawn = Drawn::default();
    let mut curves = Vec::new();
    for compression in COMPRESSIONS {
        let Some(point) = found.at(compression) else { continue };
        let Some(length) = point.shear.from_balance else { continue };
        let closed = closed_form(compression, length)?;
        let edge = found.fields(point).along([0.0, 0.0], [6.0, 0.0], COUNT);
        let rows = edge.iter().map(|s| {
            let x = s.reference[0];
            let line = closed.cauchy([x, 0.0, 0.0])[(0, 1)] / RUBBER.shear_modulus();
            [x, if x <= length { line } else { f64::NAN }, s.stress.s12]
        });
        curves.push(Curve { parameter: compression, rows: rows.collect() });
        if let Some((peak, end)) = peak_and_end(&edge) {
            drawn.findings.push(format!(
                "figure-7: U/H = {compression}: largest at x₁ = {peak:.2} H ({:.1} L), below a tenth of that from {end:.2} H; \
                 L/H of the balance (43) {length:.3}",
                peak / QUARTER
            ));
        }
    }
    let panel = Panel {
        file: "figure-7".into(),
        title: "Fig. 7: shear stress along the bonded edge under a held patch of half-length H/4: finite elements (points), \
                closed form up to the L of the balance (43)"
            .into(),
        x: Named("x₁/H", "x_1_over_h"),
        y: Named("σ₁₂/μ", "sigma_12_over_mu"),
        parameter: Named("U/H", "compression"),
        curves,
        x_is_x1: true,
        stride: 2,
    };
    drawn.files.extend(panel.files());
    drawn.missing.extend(left_out("the held patch of half-length H/4", &found));
    Ok(drawn)
}

/// The name of a contact in the legend, and its contact and layer end in the CSV file.
fn named(run: &Run) -> (String, &'static str, &'static str) {
    match (run.contact, run.end) {
        (Contact::Punch(a), _) => (format!("held patch, a/H = {}", figure_short(a)), "punch", "far away"),
        (Contact::WholeTop(a), End::Free) => {
            (format!("whole top, a/H = {}, free end", figure_short(a)), "whole top", "free")
        }
        (Contact::WholeTop(a), End::FreeOnSubstrate) => (
            format!("whole top, a/H = {}, end on substrate", figure_short(a)),
            "whole top",
            "free-on-substrate",
        ),
        (Contact::WholeTop(a), End::Far) => {
            (format!("whole top, a/H = {}, held end", figure_short(a)), "whole top", "far")
        }
    }
}

fn figure_short(value: f64) -> String {
    format!("{}", (100.0 * value).round() / 100.0)
}

/// Draws the shear lengths of several contacts over the compression, by the balance and by the force.
pub(super) fn lengths(session: &mut Session) -> Result<Drawn, FigureError> {
    let mut drawn = Drawn::default();
    let mut csv = "contact,contact_half_length_over_h,layer_end,compression,shear_length_from_balance_over_h,\
                   shear_length_from_force_over_h,axial_force,force,closed_form_force_with_l_of_contact,fan_ratio,fan_rings,\
                   length_difference_of_fans,force_difference_of_fans\n"
        .to_owned();
    let (mut balance, mut force) = (Vec::new(), Vec::new());
    let ends = [Run::layer(End::Free), Run::layer(End::FreeOnSubstrate)];
    for run in PUNCHES.map(Run::punch).into_iter().chain(ends) {
        let found = session.run(run)?;
        let (name, kind, end) = named(&run);
        let contact = run.contact.half_length();
        rows(&mut csv, &found, kind, end)?;
        let series = |pick: fn(&ShearLengths, usize) -> Option<f64>| Series {
            name: name.clone(),
            points: (0..found.points.len())
                .filter_map(|k| {
                    Some((found.points[k].shear.compression, pick(&found, k)? - found.contact.half_length()))
                })
                .collect(),
            band: None,
            style: Style::LineAndMarkers,
        };
        balance.push(series(|f, k| f.points[k].shear.from_balance));
        force.push(series(|f, k| f.points[k].shear.from_force));
        if let Some(point) = found.at(0.05) {
            let differences = found.disagreement.unwrap_or([f64::NAN; 2]);
            drawn.findings.push(format!(
                "{name}: at U/H = 0.05 L/H = {:.3} by the balance, {:.3} by the force (fans differ by {:.1} %, in force by {:.1} %); L = {}H gives \
                 {:.2} of the force",
                point.shear.from_balance.unwrap_or(f64::NAN),
                point.shear.from_force.unwrap_or(f64::NAN),
                100.0 * differences[0],
                100.0 * differences[1],
                figure_short(contact),
                closed_form_force(0.05, contact, contact)? / point.shear.force
            ));
        }
        drawn.missing.extend(left_out(&name, &found));
    }
    for (file, by, series) in [("balance", "balance (43)", balance), ("force", "force (50)", force)] {
        let chart = Chart {
            title: format!(
                "Shear length L of finite elements by the {by}, less the half-length a of the contact"
            ),
            x: Axis { label: "compression U/H".into(), unit: String::new(), scale: Scale::Linear },
            y: Axis { label: "(L − a)/H".into(), unit: String::new(), scale: Scale::Linear },
            series,
        };
        drawn.files.push((format!("shear-length-{file}.svg"), chart.to_svg()));
    }
    drawn.files.push(("shear-length.csv".into(), csv));
    Ok(drawn)
}

/// Appends the rows of one run to the table.
fn rows(csv: &mut String, found: &ShearLengths, kind: &str, end: &str) -> Result<(), FigureError> {
    let contact = found.contact.half_length();
    let [length_difference, force_difference] = found.disagreement.unwrap_or([f64::NAN; 2]);
    for point in &found.points {
        let shear = &point.shear;
        let or_nothing = |value: Option<f64>| cell(value.unwrap_or(f64::NAN));
        let (ratio, rings) = FANS[point.fan];
        let closed = closed_form_force(shear.compression, contact, contact)?;
        let cells = [
            kind.to_owned(),
            cell(contact),
            end.to_owned(),
            cell(shear.compression),
            or_nothing(shear.from_balance),
            or_nothing(shear.from_force),
            cell(shear.axial_force),
            cell(shear.force),
            cell(closed),
            cell(ratio),
            rings.to_string(),
            cell(length_difference),
            cell(force_difference),
        ];
        csv.push_str(&cells.join(","));
        csv.push('\n');
    }
    Ok(())
}
