//! `elastocap fit`: fits parameters of a case to its measured points.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::Args;
use elastocap_case::{Case, Load, value_at, with_value};
use elastocap_fitting::curves::CurveError;
use elastocap_fitting::fit::{Fit, FitError, fit, fitted_case};
use elastocap_fitting::parameter::{Free, Parameter, parameters};
use elastocap_fitting::picture::picture;

use super::stop::{end_in_time, left_a_solve, stop_without_files};
use super::summary::table;
use super::written::{check_free, write_all};
use crate::common::Common;
use crate::exit::Exit;
use crate::output;
use crate::units::{prefixed, seconds};

const EXAMPLES: &str = "\
Examples:
  elastocap fit cases/fits/pair.toml --free layer.material.neo_hookean.shear_modulus=10kPa..1MPa \\
      --free parasitic -o fitted.toml
  elastocap fit cases/fits/orthosis.toml --free layer.foam.solid_permittivity=1.5..12 \\
      --free layer.foam.solid_fraction=0.05..0.9 --free parasitic --free offset=0mm..4mm
  elastocap fit sensor.toml --free layer.relative_permittivity=2..4@2.8 --json | jq .parameters

The case names its measured points in [measurement]: docs/fits.md. Free is any key of the case that
holds a number, by its path, with its range and its start if need be (KEY=a..b@start), or
  offset      the measured load at which the layer's load begins (play, or the zero of a scale)
  parasitic   a capacitance that is added: cables, and what the case does not have
  gain        what the meter shows over what there is
Without a range a key may be a hundredth to a hundred times what the case has. Intervals are of 95 %
by a linearised model; what the errors of the computed curve may add is said beside them.

Exit status 3: the search was stopped or did not converge, points lie beyond the curve, or the data do
not determine a parameter.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file, with [measurement]
    case: PathBuf,
    /// What is fitted: a key by its path, or offset, parasitic or gain; with a range, and a start:
    /// KEY=a..b@start
    #[arg(long, short, value_name = "KEY=a..b", required = true)]
    free: Vec<Free>,
    /// Solve this many even load steps in place of those of the case
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(3..=1000))]
    steps: Option<u16>,
    /// Write the case with its fitted values, comments kept, and beside it the picture of the fit (.svg)
    #[arg(long, short, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Replace files that are there already
    #[arg(long, requires = "output")]
    overwrite: bool,
    /// Print the result in JSON, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let started = Instant::now();
    match run(arguments, common, started) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn run(arguments: &Arguments, common: &Common, started: Instant) -> Result<Exit, Exit> {
    let picture_file = arguments.output.as_deref().map(|file| file.with_extension("svg"));
    if let (Some(file), Some(picture)) = (arguments.output.as_deref(), picture_file.as_deref()) {
        if file.extension().is_none_or(|ending| ending != "toml") {
            output::error("the fitted case needs a name that ends in .toml");
            return Err(Exit::BadInput);
        }
        check_free(&[file, picture], arguments.overwrite)?;
    }
    let (source, case) = super::load_with_text(&arguments.case)?;
    let (solved_source, case) = match arguments.steps {
        None => (source.clone(), case),
        Some(steps) => with_steps(&source, &case, steps, &arguments.case)?,
    };
    let refused = |error: &FitError| {
        output::error(&error.to_string());
        match error {
            FitError::Library(_) => Exit::Failure,
            FitError::Curve(CurveError::Stopped) => Exit::Incomplete,
            _ => Exit::BadInput,
        }
    };
    if case.measured_points.is_none() {
        return Err(refused(&FitError::NoPoints));
    }
    let parameters = parameters(&arguments.free, &source, case.measured_points.as_ref())
        .map_err(|error| refused(&error.into()))?;
    let cancel = Arc::new(AtomicBool::new(false));
    stop_without_files(&cancel);
    let work = || fit(&solved_source, &case, &arguments.case, &arguments.free, &cancel);
    let found = end_in_time(&cancel, work, left_a_solve)?.map_err(|error| refused(&error))?;
    found.findings.iter().for_each(|text| output::warning(text));
    if let (Some(file), Some(picture_file)) = (arguments.output.as_deref(), picture_file.as_deref()) {
        write(file, picture_file, &source, arguments, &case, &parameters, &found)?;
    }
    if arguments.json {
        output::result(&json(&case, &found, started)?)?;
    } else if !common.quiet {
        let mut text = report(&case, &parameters, &found, started.elapsed().as_secs_f64());
        if let (Some(file), Some(picture)) = (&arguments.output, &picture_file) {
            text.push_str(&format!("\n{}, {}\n", file.display(), picture.display()));
        }
        output::result(&text)?;
    }
    let missed = found.stopped || !found.converged || found.measured_points.beyond_curve > 0;
    let undetermined = found
        .parameters
        .iter()
        .any(|parameter| parameter.interval_95.is_none() && parameter.at_limit.is_none());
    Ok(if missed || undetermined { Exit::Incomplete } else { Exit::Done })
}

/// The case with even steps from its smallest to its largest load, and its text.
fn with_steps(source: &str, case: &Case, steps: u16, origin: &Path) -> Result<(String, Case), Exit> {
    let (path, loads, unit) = match &case.load {
        Some(Load::Compression(loads)) => ("load.compression", loads, ""),
        Some(Load::Force(loads)) => ("load.force", loads, " N"),
        None => {
            output::error("--steps needs a case with [load]");
            return Err(Exit::BadInput);
        }
    };
    let refused = |reason: String| {
        output::error(&format!("--steps cannot be used with this case: {reason}"));
        Exit::BadInput
    };
    if value_at(source, path).map_err(|error| refused(error.to_string()))?.is_none() {
        return Err(refused(format!("its [load] has no `{}`", path.trim_start_matches("load."))));
    }
    let ends =
        [loads.iter().copied().fold(f64::INFINITY, f64::min), loads.iter().copied().fold(0.0, f64::max)];
    let in_toml =
        |value: f64| if unit.is_empty() { format!("{value:?}") } else { format!("\"{value}{unit}\"") };
    let value = format!("{{ from = {}, to = {}, points = {steps} }}", in_toml(ends[0]), in_toml(ends[1]));
    let text = with_value(source, path, &value).map_err(|error| refused(error.to_string()))?;
    let case = elastocap_case::parse(&text, origin).map_err(|error| refused(error.to_string()))?;
    Ok((text, case))
}

/// Writes the fitted case and its picture.
fn write(
    file: &Path,
    picture_file: &Path,
    source: &str,
    arguments: &Arguments,
    case: &Case,
    parameters: &[Parameter],
    found: &Fit,
) -> Result<(), Exit> {
    let failed = |reason: String| {
        output::error(&format!("cannot write the fitted case: {reason}"));
        Exit::Failure
    };
    let text = fitted_case(source, parameters, found).map_err(|error| failed(error.to_string()))?;
    let text = super::moved_to(&text, &arguments.case, file).map_err(|error| failed(error.to_string()))?;
    let drawn = case.measured_points.as_ref().map(|measured| picture(&case.title, measured, found).to_svg());
    write_all(&[(file, text), (picture_file, drawn.unwrap_or_default())], arguments.overwrite)
}

/// The fit as JSON.
fn json(case: &Case, found: &Fit, started: Instant) -> Result<String, Exit> {
    let document = serde_json::json!({
        "title": case.title,
        "case": case.source.display().to_string(),
        "status": if found.stopped { "stopped" } else if found.converged { "converged" } else { "not converged" },
        "fit": found,
        "seconds": started.elapsed().as_secs_f64(),
        "versions": { "elastocap": env!("CARGO_PKG_VERSION"), "case_format": 1 },
    });
    Ok(format!("{document:#}\n"))
}

/// The fit for a terminal; `taken` is the time of the command, s.
fn report(case: &Case, parameters: &[Parameter], found: &Fit, taken: f64) -> String {
    let mut lines =
        vec![["", "value", "95 % interval", "curve's error", "start"].map(str::to_owned).to_vec()];
    for (parameter, fitted) in parameters.iter().zip(&found.parameters) {
        // The value has as many digits as its error determines.
        let digits = fitted.standard_error.map_or(5, |error| digits(fitted.value, error));
        let interval = match (fitted.interval_95, fitted.at_limit) {
            (Some([low, high]), _) => {
                format!("{} to {}", parameter.show(low, digits), parameter.show(high, digits))
            }
            (None, Some(side)) => format!("at its {side} limit"),
            (None, None) => "not known".to_owned(),
        };
        let shift = fitted
            .shift_by_curve
            .map_or_else(|| "-".to_owned(), |shift| format!("+- {}", parameter.show(shift, 2)));
        lines.push(vec![
            parameter.name.clone(),
            parameter.show(fitted.value, digits),
            interval,
            shift,
            parameter.show(parameter.start, 5),
        ]);
    }
    let mut out = format!(
        "{}: fitted to {} points of {}\n\n{}",
        case.title,
        found.points,
        found.measured_points.file,
        table(lines)
    );
    if found.correlated.len() > 1 && !found.correlations.is_empty() {
        out.push_str("\n  correlations\n");
        for (name, row) in found.correlated.iter().zip(&found.correlations).skip(1) {
            let place = found.correlated.iter().position(|other| other == name).unwrap_or(0);
            let cells: Vec<String> = row.iter().take(place).map(|value| format!("{value:7.3}")).collect();
            out.push_str(&format!("  {name}: {}\n", cells.join(" ").trim_start()));
        }
    }
    let noise = if found.noise_is_given { "given" } else { "estimated from the residuals" };
    out.push_str(&format!(
        "\n  residuals: {} root mean square ({} where the fit began)\n  noise of a point: {} ({noise}); error of the curve: {} by its \
         bounds, {} by interpolation\n",
        prefixed(found.rms_residual_f, 3, "F"),
        prefixed(found.rms_residual_at_start_f, 3, "F"),
        found.noise_f.map_or_else(|| "not known".to_owned(), |noise| prefixed(noise, 3, "F")),
        prefixed(found.curve_error_f, 2, "F"),
        found.interpolation_error_f.map_or_else(|| "an unknown one (counted as that of any monotonic curve)".to_owned(), |error| prefixed(error, 2, "F")),
    ));
    let comparison = &found.measured_points;
    if let Some(share) = comparison.fraction_within_error {
        out.push_str(&format!(
            "  {} of {} points ({:.0} %) are within the error of curve and deviation\n",
            comparison.within_error,
            comparison.compared(),
            100.0 * share
        ));
    }
    out.push_str(&format!(
        "  {} iterations, {} curves solved and {} without a field solve, in {}\n",
        found.iterations,
        found.effort.curves_solved,
        found.effort.curves_shared,
        seconds(taken)
    ));
    out
}

/// The number of digits of a value whose error has two.
fn digits(value: f64, error: f64) -> usize {
    let ratio = (value.abs() / error).log10().ceil();
    if ratio.is_finite() { (ratio.max(0.0) as usize + 2).clamp(2, 8) } else { 5 }
}
