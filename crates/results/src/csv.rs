//! `curve.csv` and `capacitance.csv`: plain numbers in SI units that read back as they were.

use elastocap_electrostatics::Bounded;

use elastocap_coupling::outcome::{Outcome, Row, StepResult};

/// A number in the shortest form that reads back as the same one.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e15).contains(&magnitude) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// A number, or an empty cell.
pub fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, number)
}

/// A text as one field: in quotes where it holds what would end the field.
pub fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) || text != text.trim() {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// One line for each load step: see [`Row`].
pub fn curve(outcome: &Outcome) -> String {
    let mut out = Row::COLUMNS.join(",");
    out.push('\n');
    for step in &outcome.steps {
        let row = &step.row;
        let mut fields: Vec<_> = row.numbers().into_iter().map(optional).collect();
        fields.push(row.unknowns.map_or_else(String::new, |n| n.to_string()));
        fields.push(quoted(&row.status.to_string()));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}

/// One line for each entry of the Maxwell matrix, for each pair's mutual capacitance, and for the two-terminal one.
///
/// `row` and `column` name conductors; a two-terminal capacitance of one conductor is against `ground`.
pub fn capacitance(conductors: &[String], step: &StepResult) -> String {
    let mut out =
        "quantity,row,column,value_f,lower_f,upper_f,relative_error_estimate,unknowns,status\n".to_owned();
    let unknowns = step.row.unknowns.map_or_else(String::new, |n| n.to_string());
    let status = quoted(&step.row.status.to_string());
    let mut line = |quantity: &str, names: [&str; 2], c: Option<Bounded>| {
        let fields = [
            quantity.to_owned(),
            quoted(names[0]),
            quoted(names[1]),
            optional(c.map(|c| c.value)),
            optional(c.map(|c| c.lower)),
            optional(c.map(|c| c.upper)),
            optional(c.map(|c| c.relative_error())),
            unknowns.clone(),
            status.clone(),
        ];
        out.push_str(&fields.join(","));
        out.push('\n');
    };
    let entry = |i: usize, j: usize| step.maxwell.as_ref()?.get(i)?.get(j).copied();
    for (i, row) in conductors.iter().enumerate() {
        for (j, column) in conductors.iter().enumerate() {
            line("maxwell", [row, column], entry(i, j));
        }
    }
    for (i, row) in conductors.iter().enumerate() {
        for (j, column) in conductors.iter().enumerate().skip(i + 1) {
            line("mutual", [row, column], entry(i, j).map(negative));
        }
    }
    if let Some(first) = conductors.first()
        && (step.two_terminal.is_some() || conductors.len() <= 2)
    {
        let other = conductors.get(1).map_or("ground", String::as_str);
        line("two_terminal", [first, other], step.two_terminal);
    }
    out
}

fn negative(c: Bounded) -> Bounded {
    Bounded { value: -c.value, lower: -c.upper, upper: -c.lower }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_were() {
        for value in [0.0, 0.05, 43.965_9e-15, 1.0 / 3.0, -2.5e-300, 1e22, 5e-324, f64::MAX, 450e-6] {
            assert_eq!(number(value).parse::<f64>(), Ok(value), "{}", number(value));
        }
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(43.965_9e-15), "4.39659e-14");
    }

    #[test]
    fn a_field_with_a_comma_or_a_quote_is_quoted() {
        assert_eq!(quoted("failed: no, \"never\""), "\"failed: no, \"\"never\"\"\"");
        assert_eq!(quoted("tolerance not reached"), "tolerance not reached");
    }
}
