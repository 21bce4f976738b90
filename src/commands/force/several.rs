//! The load that several measured capacitances belong to.

use std::path::Path;
use std::str::FromStr;

use elastocap_case::{MeasuredCapacitance, MeasuredCapacitanceError};
use elastocap_results::load_answer::{
    LoadAnswer, LoadQuantity, LoadTable, MeasuredEntry, NoLoad, read_table,
};
use thiserror::Error;

use crate::exit::Exit;
use crate::output;
use crate::units::prefixed;

/// A measured capacitance: of one terminal, between two, or the one that the result measures.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Argument {
    /// The terminals as the user wrote them, `a` or `a/b`; `None` without names.
    pub(super) terminals: Option<String>,
    /// The measured value with its error.
    pub(super) capacitance: MeasuredCapacitance,
}

impl FromStr for Argument {
    type Err = MeasuredCapacitanceError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (terminals, value) = match text.rsplit_once('=') {
            Some((terminals, value)) => (Some(terminals.trim().to_owned()), value),
            None => (None, text),
        };
        Ok(Self { terminals, capacitance: value.trim().parse()? })
    }
}

/// Prints the load, or the reason why there is none.
pub(super) fn execute(result: &Path, measured: &[Argument], as_json: bool) -> Exit {
    let table = match read_table(result) {
        Ok(table) => table,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::BadInput;
        }
    };
    let entries: Result<Vec<MeasuredEntry>, NoEntry> =
        measured.iter().map(|argument| entry(&table.terminals, argument)).collect();
    let entries = entries.map_err(|error| error.to_string());
    let answer = entries.and_then(|entries| table.load(&entries).map_err(|error| refusal(&error)));
    let answer = match answer {
        Ok(answer) => answer,
        Err(error) => {
            output::error(&error);
            return Exit::BadInput;
        }
    };
    let text = if as_json {
        json(&table, measured, &answer)
    } else {
        output::plain(&report(&table, measured, &answer))
    };
    match output::result(&text) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}

/// The reason why an argument names no entry of the matrix.
#[derive(Debug, Error)]
enum NoEntry {
    #[error(
        "with several capacitances each needs the name of its terminal, such as {example}=41.2fF+-0.05fF, or of two, such as A/B=2.3fF"
    )]
    Nameless { example: String },
    #[error("`{0}` names one terminal twice; write its name alone")]
    Twice(String),
    #[error("the result has no terminal `{written}`; it has {}, and pairs of them as A/B", quoted(known))]
    Unknown { written: String, known: Vec<String> },
}

/// Names in quotation marks, with commas.
fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// The entry of the matrix that an argument names.
fn entry(terminals: &[String], argument: &Argument) -> Result<MeasuredEntry, NoEntry> {
    let Some(written) = &argument.terminals else {
        let example = terminals.first().map_or("A", String::as_str).to_owned();
        return Err(NoEntry::Nameless { example });
    };
    let place = |name: &str| terminals.iter().position(|terminal| terminal == name.trim());
    let capacitance = argument.capacitance;
    if let Some(terminal) = place(written) {
        return Ok(MeasuredEntry { terminal, other: None, capacitance });
    }
    // A name may itself contain a slash.
    let cuts = written.match_indices('/');
    let pair = cuts.filter_map(|(at, _)| Some((place(&written[..at])?, place(&written[at + 1..])?))).next();
    match pair {
        Some((terminal, other)) if terminal != other => {
            Ok(MeasuredEntry { terminal, other: Some(other), capacitance })
        }
        Some(_) => Err(NoEntry::Twice(written.clone())),
        None => Err(NoEntry::Unknown { written: written.clone(), known: terminals.to_vec() }),
    }
}

/// A value in a common unit: angles in degrees.
fn shown(value: f64, unit: &str) -> String {
    match unit {
        "rad" => format!("{:.4} deg", value.to_degrees()),
        unit => prefixed(value, 4, unit),
    }
}

/// The reason why there is no load, with quantities in common units.
fn refusal(error: &NoLoad) -> String {
    match *error {
        NoLoad::Outside { name, unit, value, low, high } => format!(
            "the {name} would be {}, and the steps of the result reach from {} to {}; check units and offsets of the measurements, or add \
             steps there",
            shown(value, unit),
            shown(low, unit),
            shown(high, unit),
        ),
        ref other => other.to_string(),
    }
}

fn report(table: &LoadTable, measured: &[Argument], answer: &LoadAnswer) -> String {
    let lines = measured.iter().map(|argument| {
        let name = argument.terminals.as_deref().unwrap_or_default();
        let MeasuredCapacitance { value, error } = argument.capacitance;
        (name.to_owned(), format!("{} +- {}", prefixed(value, 5, "F"), prefixed(error, 2, "F")))
    });
    let quantity = |quantity: &LoadQuantity| {
        let value = format!(
            "{} +- {}",
            shown(quantity.value, quantity.unit),
            shown(quantity.deviation, quantity.unit)
        );
        (quantity.name.to_owned(), value)
    };
    let lines: Vec<(String, String)> = lines.chain(answer.quantities.iter().map(quantity)).collect();
    let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let mut out = format!("{}\n\n", table.title);
    for (k, (name, value)) in lines.iter().enumerate() {
        if k == measured.len() {
            out.push('\n');
        }
        out.push_str(&format!("{name:width$}  {value}\n"));
    }
    out.push_str("\nThe errors of what was measured are limits, those of what was found standard deviations.\nCorrelations:\n");
    for (i, row) in answer.covariance.iter().enumerate() {
        let cells = row.iter().enumerate().take(i + 1).map(|(j, covariance)| {
            let scale = answer.quantities[i].deviation * answer.quantities[j].deviation;
            format!("{:6.2}", if scale > 0.0 { covariance / scale } else { 0.0 })
        });
        out.push_str(&format!("{:width$}{}\n", answer.quantities[i].name, cells.collect::<String>()));
    }
    if answer.to_spare > 0 {
        out.push_str(&format!(
            "Sum of squared differences over their variances: {:.2}, of {} to spare.\n",
            answer.chi_squared, answer.to_spare
        ));
    }
    out
}

fn json(table: &LoadTable, measured: &[Argument], answer: &LoadAnswer) -> String {
    let capacitances = measured.iter().map(|argument| {
        serde_json::json!({
            "terminals": argument.terminals,
            "capacitance_f": argument.capacitance.value,
            "capacitance_error_f": argument.capacitance.error,
        })
    });
    let quantities = answer.quantities.iter().map(|quantity| {
        serde_json::json!({
            "name": quantity.name,
            "unit": quantity.unit,
            "value": quantity.value,
            "standard_deviation": quantity.deviation,
        })
    });
    let document = serde_json::json!({
        "title": table.title,
        "measured": capacitances.collect::<Vec<_>>(),
        "load": quantities.collect::<Vec<_>>(),
        "covariance": answer.covariance,
        "chi_squared": answer.chi_squared,
        "to_spare": answer.to_spare,
    });
    format!("{document:#}\n")
}
