//! A catalogue of stiff and extreme cases for which something about the result is known independently of the
//! program.
//!
//! An entry is one or more case files, solved as `elastocap run` solves them, and claims about the numbers: a
//! closed form, a scaling law, a limit with a known remainder, a reference value, or an inequality between
//! proved bounds. A result is wrong if a number misses its stated error and nothing says so; a tolerance that
//! the program reports as missed is not.

mod answer;
mod catalogue;
mod claim;
mod text;
mod truths;
mod verdict;

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

pub use catalogue::catalogue;
pub use claim::{Claim, ClaimError, ROUNDING, Truth};
pub use verdict::{Expect, Verdict};

use claim::Claims;
use elastocap_coupling::outcome::Outcome;
use elastocap_results::csv::{number, quoted};
use elastocap_results::{OutputError, OutputFolder, Placed};

/// The claims on the outcomes of an entry's cases.
type ClaimsOf = Box<dyn Fn(&[Outcome]) -> Claims + Send + Sync>;

/// One extreme case.
pub struct Entry {
    /// The extreme property of the case.
    pub subject: &'static str,
    /// The name of the case.
    pub name: String,
    /// The expected answer.
    pub expect: Expect,
    /// Whether the entry belongs to the quick selection.
    pub quick: bool,
    /// The case files to be solved.
    pub cases: Vec<String>,
    /// The claims on the outcomes of the cases.
    claims: ClaimsOf,
}

impl std::fmt::Debug for Entry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Entry")
            .field("subject", &self.subject)
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

/// The verdict on an entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The extreme property that the entry is about.
    pub subject: &'static str,
    /// The entry's name.
    pub name: String,
    /// The checked numbers; the first is the one to show.
    pub claims: Vec<Claim>,
    /// The verdict.
    pub verdict: Verdict,
    /// Wall-clock seconds.
    pub seconds: f64,
}

impl Entry {
    /// An entry whose numbers must be right; `claims` makes the claims from the outcomes of its cases.
    fn new(
        subject: &'static str,
        name: impl Into<String>,
        cases: impl IntoIterator<Item = String>,
        claims: impl Fn(&[Outcome]) -> Claims + Send + Sync + 'static,
    ) -> Self {
        let cases = cases.into_iter().collect();
        let claims = Box::new(claims);
        Self { subject, name: name.into(), expect: Expect::Number, quick: false, cases, claims }
    }

    /// An entry of one case that must be refused; it belongs to the quick selection.
    fn refused(subject: &'static str, name: impl Into<String>, case: String) -> Self {
        let entry = Self::new(subject, name, [case], |_| Ok(Vec::new()));
        Self { expect: Expect::Refusal, quick: true, ..entry }
    }

    /// The same entry in the quick selection.
    fn quick(self) -> Self {
        Self { quick: true, ..self }
    }

    /// Solves the entry's cases on `threads` threads and judges the answers. A case that takes longer than
    /// `limit` is abandoned; `stop` ends it early.
    pub fn run(&self, threads: usize, limit: Duration, stop: &AtomicBool) -> Report {
        let begin = Instant::now();
        let mut answers = Vec::new();
        for case in &self.cases {
            let answer = answer::answer(case, threads, limit, stop);
            let is_last = !matches!(answer, answer::Answer::Run(..));
            answers.push(answer);
            if is_last {
                break;
            }
        }
        let (verdict, claims) = verdict::judge(self.expect, answers, &*self.claims);
        let seconds = begin.elapsed().as_secs_f64();
        Report { subject: self.subject, name: self.name.clone(), claims, verdict, seconds }
    }
}

/// `stability.csv`: one line for each claim, or for an entry without one.
pub fn csv(reports: &[Report]) -> String {
    let mut out =
        "subject,case,quantity,unit,value,lower,upper,truth_low,truth_high,verdict,reason,seconds\n"
            .to_owned();
    for report in reports {
        let tail = [
            report.verdict.to_string(),
            quoted(report.verdict.reason().unwrap_or_default()),
            format!("{:.3}", report.seconds),
        ]
        .join(",");
        let head = format!("{},{}", quoted(report.subject), quoted(&report.name));
        if report.claims.is_empty() {
            let _ = writeln!(out, "{head},,,,,,,,{tail}");
        }
        for claim in &report.claims {
            let Claim { what, unit, value, lower, upper, truth } = claim;
            let side = |x: f64| if x.is_finite() { number(x) } else { String::new() };
            let numbers = [number(*value), side(*lower), side(*upper), side(truth.low), side(truth.high)];
            let _ = writeln!(out, "{head},{},{unit},{},{tail}", quoted(what), numbers.join(","));
        }
    }
    out
}

/// Writes `stability.csv` into a folder, as a whole or not at all.
///
/// # Errors
/// [`OutputError`] if it cannot be written.
pub fn save(reports: &[Report], folder: &Path) -> Result<Placed, OutputError> {
    let folder = OutputFolder::open(folder)?;
    folder.stage("stability.csv", csv(reports).as_bytes())?;
    folder.commit_beside()
}

#[cfg(test)]
mod tests;
