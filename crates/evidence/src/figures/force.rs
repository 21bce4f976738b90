//! Fig. 16: the force over the compression.
//!
//! The paper gives neither its length `L_c` nor its choice of `B`. Two contacts are shown: a punch of
//! half-length `H` (a), and the whole top of the layer of section 3.2 (b). Each has the force of eq. (50)
//! with `L = L_c` in both (45) and (50), which needs no finite elements, and with the `L` of the balance (43)
//! from finite elements.

use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::{ClosedFormSettings, LayerState, MechanicsError};

use super::panel::{cell, figure};
use super::{Drawn, FigureError, RUBBER, Run, Session, left_out};
use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};

/// The last compression at which the closed form is drawn, in hundredths; it is drawn at every hundredth.
const LAST: u32 = 40;

/// `F/(mu H w)` of (50) on a contact of half-length `contact` over `H` with the shear length `length` over
/// `H`.
pub(super) fn closed_form_force(compression: f64, contact: f64, length: f64) -> Result<f64, MechanicsError> {
    let settings =
        ClosedFormSettings { contact_half_length: contact, contact_width: 1.0, shear_length: length };
    Ok(LayerState::new(1.0, RUBBER, compression, settings)?.force() / RUBBER.shear_modulus())
}

/// Draws Fig. 16 for both contacts.
pub(super) fn over_compression(session: &mut Session) -> Result<Drawn, FigureError> {
    let mut drawn = Drawn::default();
    let contacts = [
        ("16a", "a held patch of half-length H", Run::punch(1.0)),
        ("16b", "the whole top of half-length 4H", Run::layer(End::FreeOnSubstrate)),
    ];
    for (file, what, run) in contacts {
        let found = session.run(run)?;
        let contact = run.contact.half_length();
        let mut with_half_length = Vec::new();
        let mut csv = "compression,closed_form_force,closed_form_force_with_balance_shear_length,finite_element_force\n"
            .to_owned();
        let (mut balanced, mut points) = (vec![(0.0, 0.0)], Vec::new());
        let row = |csv: &mut String, cells: [f64; 4]| {
            csv.push_str(&cells.map(cell).join(","));
            csv.push('\n');
        };
        for k in 0..=LAST {
            let compression = f64::from(k) / 100.0;
            let force = closed_form_force(compression, contact, contact)?;
            with_half_length.push((compression, force));
            let Some(point) = found.at(compression) else {
                row(&mut csv, [compression, force, f64::NAN, f64::NAN]);
                continue;
            };
            let length = point.shear.from_balance.unwrap_or(contact);
            let with_balance = closed_form_force(compression, contact, length)?;
            balanced.push((compression, with_balance));
            points.push((compression, point.shear.force));
            row(&mut csv, [compression, force, with_balance, point.shear.force]);
        }
        let series = vec![
            line("closed form, L the half-length", with_half_length.clone(), Style::Line),
            line(
                "closed form, L by the balance (43) of finite elements",
                balanced.clone(),
                Style::DashedLine,
            ),
            line("finite elements", points.clone(), Style::Markers),
        ];
        let axis = |label: &str| Axis { label: label.into(), unit: String::new(), scale: Scale::Linear };
        let chart = Chart {
            title: format!("Fig. {file}: force on {what}"),
            x: axis("compression U/H"),
            y: axis("force F/(μHw)"),
            series,
        };
        drawn.files.push((format!("figure-{file}.svg"), chart.to_svg()));
        drawn.files.push((format!("figure-{file}.csv"), csv));
        for ((compression, force), (_, balanced)) in points.iter().zip(&balanced[1..]) {
            if [0.05, 0.1, 0.2, 0.4].contains(compression) {
                let with_half_length = closed_form_force(*compression, contact, contact)?;
                drawn.findings.push(format!(
                    "{what}, U/H = {compression}: F/(μHw) = {} by finite elements, {} in closed form with the half-length for L, {} with L by \
                     the balance",
                    figure(*force),
                    figure(with_half_length),
                    figure(*balanced)
                ));
            }
        }
        drawn.missing.extend(left_out(what, &found));
    }
    Ok(drawn)
}

fn line(name: &str, points: Vec<(f64, f64)>, style: Style) -> Series {
    Series { name: name.into(), points, band: None, style }
}

#[cfg(test)]
mod tests {
    use super::super::HALF_LENGTH;
    use super::*;

    #[test]
    fn the_force_is_the_audited_one() {
        // L = L_c in both (45) and (50).
        let known = [
            (1.0, [0.6089434352, 1.362952126, 3.543717402, 14.58933039]),
            (HALF_LENGTH, [9.430809956, 21.88108564, 60.61180643, 267.4482963]),
        ];
        for (contact, forces) in known {
            for (compression, force) in [0.05, 0.1, 0.2, 0.4].into_iter().zip(forces) {
                let found = closed_form_force(compression, contact, contact).unwrap();
                assert!((found / force - 1.0f64).abs() < 1e-9, "{contact} {compression}: {found}");
            }
        }
    }
}
