//! `elastocap force`: the force that belongs to a measured capacitance, or the load that belongs to several.

mod several;

use std::path::PathBuf;

use clap::Args;
use elastocap_case::MeasuredCapacitance;
use elastocap_results::force_answer::{ForceAnswer, NoForce, read_curve};

use crate::exit::Exit;
use crate::output;
use crate::units::prefixed;
use several::Argument;

const EXAMPLES: &str = "\
Examples:
  elastocap run cases/in-plane-pair.toml
  elastocap force results/in-plane-pair --capacitance 41.2fF+-0.05fF
  elastocap force results/in-plane-pair --capacitance \"41.2 fF\"          an exact measurement
  elastocap force results/in-plane-pair --capacitance 41.2fF+-0.05fF --json | jq .force_upper_n

The error of the measurement is a limit, not a standard deviation. The limits of the force include
it, the bounds of the computed capacitances, the stated errors of forces and mechanics, and an
estimate of the error of interpolation between the steps of the run. More steps make it smaller.
docs/answers.md has the method, and how often the true force lay between the limits.

Several capacitances of one sensor tell force, shift and tilt, with their covariance, where the
steps of the run vary these. Name the terminal of each, or two for a mutual capacitance:
  elastocap force results/quadrants -c pad-1-1=2.31pF+-1fF -c pad-1-2=2.31pF+-1fF \\
      -c pad-2-1=2.35pF+-1fF -c pad-2-2=2.35pF+-1fF

Refused with exit status 2: a curve that is not monotonic, and a capacitance that is not on it.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The output folder of a run, or the result.json in it
    result: PathBuf,
    /// What was measured, with its error: 41.2fF+-0.05fF; if given several times, with terminals:
    /// A=2.3pF+-1fF, A/B=81fF+-1fF
    #[arg(long, short, value_name = "C+-ERROR", allow_hyphen_values = true, required = true)]
    capacitance: Vec<Argument>,
    /// Print the answer in JSON, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn execute(arguments: &Arguments) -> Exit {
    match arguments.capacitance.as_slice() {
        [Argument { terminals: None, capacitance }] => of_one(arguments, *capacitance),
        several => several::execute(&arguments.result, several, arguments.json),
    }
}

/// Prints the force that belongs to the measured capacitance of the result.
fn of_one(arguments: &Arguments, capacitance: MeasuredCapacitance) -> Exit {
    let read = match read_curve(&arguments.result) {
        Ok(read) => read,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::BadInput;
        }
    };
    let answer = match read.curve.force(capacitance) {
        Ok(answer) => answer,
        Err(error) => {
            output::error(&refusal(&error));
            return Exit::BadInput;
        }
    };
    read.warnings.iter().for_each(|text| output::warning(text));
    let text = if arguments.json {
        json(&read.title, capacitance, &answer, &read.warnings)
    } else {
        output::plain(&report(&read.title, capacitance, &answer))
    };
    match output::result(&text) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}

fn force(value: f64) -> String {
    prefixed(value, 4, "N")
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{} to {}", force(low), force(high))
}

fn json(title: &str, measured: MeasuredCapacitance, answer: &ForceAnswer, warnings: &[String]) -> String {
    let document = serde_json::json!({
        "title": title,
        "capacitance_f": measured.value,
        "capacitance_error_f": measured.error,
        "force_n": answer.force_n,
        "force_lower_n": answer.force_lower_n,
        "force_upper_n": answer.force_upper_n,
        "from_measurement_n": answer.from_measurement_n,
        "from_curve_n": answer.from_curve_n,
        "enclosure_n": answer.enclosure_n,
        "interpolation_error_f": answer.interpolation_error_f,
        "warnings": warnings,
    });
    format!("{document:#}\n")
}

fn report(title: &str, measured: MeasuredCapacitance, answer: &ForceAnswer) -> String {
    let capacitance = |value| prefixed(value, 5, "F");
    let interpolation = match answer.interpolation_error_f {
        Some(error) => format!("estimated at {}", prefixed(error, 2, "F")),
        None => "not known, as the steps show no more than a monotonic curve".to_owned(),
    };
    format!(
        "{title}\n\n\
         capacitance          {} +- {}\n\
         force                {}\n\
         with all errors      {}\n\
         of the measurement   {}\n\
         of the curve         {}\n\
         any monotonic curve  {}\n\
         interpolation error  {interpolation}\n",
        capacitance(measured.value),
        prefixed(measured.error, 2, "F"),
        force(answer.force_n),
        interval([answer.force_lower_n, answer.force_upper_n]),
        interval(answer.from_measurement_n),
        interval(answer.from_curve_n),
        interval(answer.enclosure_n),
    )
}

/// The reason why there is no force, with quantities in common units.
fn refusal(error: &NoForce) -> String {
    match error {
        NoForce::Outside { value, error, first_force, last_force, first, last } => format!(
            "no force on the curve gives {} +- {}: from {} to {} its capacitance goes from {} to {}; check unit and offset of the \
             measurement, or run the case with loads up to that capacitance",
            prefixed(*value, 5, "F"),
            prefixed(*error, 2, "F"),
            force(*first_force),
            force(*last_force),
            prefixed(*first, 5, "F"),
            prefixed(*last, 5, "F"),
        ),
        NoForce::BelowFirst(first) => format!(
            "the force may be smaller than {}, where the curve begins; add a step without load to the case (`compression` or `force` 0)",
            force(*first)
        ),
        NoForce::BeyondLast(last) => format!(
            "the force may be larger than {}, where the curve ends; add a step with a larger load to the case",
            force(*last)
        ),
        other => other.to_string(),
    }
}
