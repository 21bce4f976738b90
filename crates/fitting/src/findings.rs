//! Findings of a fit for its user, in words.

use elastocap_coupling::words::listed;
use elastocap_results::measured::Comparison;

use crate::parameter::{Parameter, Quantity};
use crate::uncertainty::Uncertainty;

/// The correlation above which the data do not distinguish two parameters. Not tuned: a choice of what is
/// worth saying.
const INDISTINGUISHABLE: f64 = 0.99;
/// The condition number of the scaled Jacobian above which a combination of parameters is not determined. Not
/// tuned: a choice of what is worth saying.
const ILL_CONDITIONED: f64 = 1e3;

/// The results of a fit that findings may be about.
pub(crate) struct FitResults<'a> {
    /// The parameters, in the order of the user.
    pub(crate) parameters: &'a [Parameter],
    /// "lower" or "upper" for each parameter that ended at a limit.
    pub(crate) at_limit: &'a [Option<&'static str>],
    /// Whether the curve hardly changes with each parameter.
    pub(crate) weak: &'a [bool],
    /// Names of the parameters that did not end at a limit.
    pub(crate) inner: &'a [&'a str],
    /// The uncertainty of these parameters.
    pub(crate) known: Option<&'a Uncertainty>,
    /// The reason why there is no uncertainty: the condition number, and the combination of parameters that
    /// changes nothing.
    pub(crate) undetermined: Option<&'a (f64, Vec<f64>)>,
    /// The number of steps of the case that are not on the curve.
    pub(crate) missing_steps: usize,
    /// The points compared with the fitted curve.
    pub(crate) comparison: &'a Comparison,
    /// The name of the load of the points.
    pub(crate) load: &'static str,
    /// Whether the points have deviations.
    pub(crate) noise_is_given: bool,
    /// Whether the search was stopped on request.
    pub(crate) stopped: bool,
    /// Whether the search converged.
    pub(crate) converged: bool,
}

/// One or two sentences for each finding.
pub(crate) fn findings(results: &FitResults<'_>) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some((condition, weakest)) = results.undetermined {
        sentences.push(not_determined(results.inner, weakest, *condition));
    }
    if let Some(known) = results.known {
        sentences.extend(indistinguishable(results.inner, known));
    }
    for (parameter, weak) in results.parameters.iter().zip(results.weak) {
        if *weak && parameter.quantity == Quantity::Key {
            sentences.push(format!(
                "{} changes the curve by hardly more than its error, even over a quarter of the range: its interval is not reliable; lower \
                 `relative_tolerance` in [electrostatics], or leave it fixed",
                parameter.name
            ));
        }
    }
    for (parameter, at_limit) in results.parameters.iter().zip(results.at_limit) {
        if let Some(side) = at_limit {
            sentences.push(format!(
                "{} ended at its {side} limit and is taken as fixed there: the data ask for a value beyond it, or do not depend on it",
                parameter.name
            ));
        }
    }
    if results.missing_steps > 0 {
        sentences.push(format!(
            "{} of the steps of the case have no place on the fitted curve: they failed or have no {}",
            results.missing_steps, results.load
        ));
    }
    let comparison = results.comparison;
    if comparison.beyond_curve > 0 {
        sentences.push(format!(
            "{} of {} points have a {} beyond the last step of the case: there the curve was continued along its tangent; give `[load]` \
             larger steps",
            comparison.beyond_curve,
            comparison.points.len(),
            results.load
        ));
    }
    sentences.extend(results.known.filter(|_| results.noise_is_given).and_then(too_large));
    if results.stopped {
        sentences
            .push("the search was stopped: these are the best values by then, without intervals".to_owned());
    } else if !results.converged {
        sentences.push("the search did not converge: these are the best values that it found".to_owned());
    }
    sentences
}

/// The sentence on residuals that are larger than the given deviations allow, by three standard deviations of
/// their mean square.
fn too_large(known: &Uncertainty) -> Option<String> {
    let most = 1.0 + 3.0 * (2.0 / known.freedom as f64).sqrt();
    (known.reduced > most).then(|| {
        format!(
            "the residuals are {:.1} times as large as the deviations of the points allow: the curve does not describe these points, or \
             the deviations are too small; the intervals do not include that",
            known.reduced.sqrt()
        )
    })
}

/// Sentences on parameters that the data do not distinguish.
fn indistinguishable(names: &[&str], known: &Uncertainty) -> Vec<String> {
    let mut sentences = Vec::new();
    for i in 0..names.len() {
        for j in 0..i {
            let correlation = known.correlations[i][j];
            if correlation.abs() > INDISTINGUISHABLE {
                sentences.push(format!(
                    "the data can hardly tell {} and {} apart (correlation {correlation:.4}): another pair of values fits nearly as well; fix \
                     one of them, or measure something else besides",
                    names[j], names[i]
                ));
            }
        }
    }
    if sentences.is_empty() && known.condition > ILL_CONDITIONED {
        sentences.push(not_determined(names, &known.weakest, known.condition));
    }
    sentences
}

/// The sentence on a combination of parameters that the data do not determine; `weakest` are the shares of
/// the parameters in it.
fn not_determined(names: &[&str], weakest: &[f64], condition: f64) -> String {
    let taking_part: Vec<String> = names
        .iter()
        .zip(weakest)
        .filter(|(_, share)| share.abs() > 0.2)
        .map(|(name, _)| (*name).to_owned())
        .collect();
    if let [alone] = taking_part.as_slice() {
        return format!("the data do not depend on {alone}: leave it fixed");
    }
    format!(
        "the data do not tell {} apart (condition {condition:.1e} of the scaled Jacobian): fix one of them",
        listed(&taking_part)
    )
}
