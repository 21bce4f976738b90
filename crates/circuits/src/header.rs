//! The head of every file: its source, units, range and errors, as lines of plain text.

use crate::model::Model;

/// The distance beyond the range at which the node `outside` reaches 1 V, as a share of the range.
pub(crate) const FLAG_RAMP: f64 = 1e-6;

/// Printable ASCII without comment marks, so that no text of a case ends a comment or a line.
pub(crate) fn plain(text: &str) -> String {
    let printable = text.chars().map(|c| match c {
        '\t' => ' ',
        // A backslash at the end of a line would join the next line to a comment.
        '\\' => '/',
        ' '..='~' => c,
        _ => '?',
    });
    printable.collect::<String>().replace("*/", "* /").replace("/*", "/ *")
}

/// Lines of plain text for the head of a file: source, units, range, errors, and notes for the user.
pub(crate) fn lines(model: &Model) -> Vec<String> {
    let [first, last] = model.range();
    let kind = if model.has_ground_band() { "mutual capacitance" } else { "capacitance" };
    let bounds = if model.is_proved { "proved bounds of the field" } else { "estimated errors" };
    let mut out = vec![
        plain(&model.title),
        format!(
            "Made by elastocap {} from a result of elastocap {}",
            env!("CARGO_PKG_VERSION"),
            plain(&model.solved_by)
        ),
        format!("Case: {}", plain(&model.case)),
        String::new(),
        format!("What it is: {}", plain(&model.quantity)),
        format!("Range of the force: {first} N to {last} N, {} load steps", model.forces.len()),
        format!(
            "Largest error at a step: {:.2e} of the largest value of the {kind}, {bounds}",
            model.largest_relative_error()
        ),
        match model.interpolation_error() {
            Some(error) => {
                format!(
                    "Largest error by interpolation between steps: {error:.1e} of a capacitance's largest value, estimated"
                )
            }
            None => "Error by interpolation between steps: not known; more steps tell it".to_owned(),
        },
        "Between steps a capacitance is a monotone cubic in the force with a continuous derivative."
            .to_owned(),
        "band = -1, 0, 1 gives the lower bound, the value and the upper bound; values between are allowed."
            .to_owned(),
    ];
    if model.has_ground_band() {
        out.push(
            "band is that of the mutual capacitances, band_ground that of the capacitances to common."
                .to_owned(),
        );
    }
    out.push("The electrostatic force on the layer is neglected: the force is an input, and nothing acts back on it.".to_owned());
    out.extend(model.notes.iter().map(|note| plain(note)));
    out.push(String::new());
    for terminal in &model.terminals {
        out.push(format!("{} is \"{}\"", terminal.identifier, plain(&terminal.name)));
    }
    if model.has_common {
        out.push(
            "common is everything at zero potential: grounded terminals, grounded walls, infinity".to_owned(),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_text_of_a_case_cannot_leave_its_comment() {
        assert_eq!(plain("a\n.include x\r\u{2028}b\\"), "a?.include x??b/");
        assert_eq!(plain("*/ x /*/"), "* / x / * /");
    }
}
