//! Writes the files made from all records: table, plot, statistics and summary.

use serde::Serialize;

use elastocap_results::csv::number;

use crate::chart::chart;
use crate::error::SweepError;
use crate::files::{PLOT, STATISTICS, SUMMARY, TABLE};
use crate::folder::SweepFolder;
use crate::record::CaseRecord;
use crate::statistics::{PERCENTILES, StepStatistics, statistics};
use crate::table::{Column, table};

/// The summary of a sweep, as in `sweep.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The title of the case.
    pub title: String,
    /// The case file, as the user named it.
    pub case_file: String,
    /// The SHA-256 of everything that the results depend on.
    pub fingerprint: String,
    /// The shard of the sweep, such as `2/4`; `None` for the whole.
    pub shard: Option<String>,
    /// The varied keys.
    pub keys: Vec<String>,
    /// The number of cases of this folder.
    pub cases: usize,
    /// The number of cases with any result.
    pub finished: usize,
    /// The number of cases with complete results at every step.
    pub ok: usize,
    /// The cases that are refused, or in which a step failed.
    pub failed: Vec<usize>,
    /// The cases in which a step missed its tolerance or has no force.
    pub missed: Vec<usize>,
    /// The files, sorted.
    pub files: Vec<String>,
    /// The scatter of the results, for cases drawn at random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatter: Option<Scatter>,
}

/// The scatter of results with the values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scatter {
    /// The seed of the random generator.
    pub seed: u64,
    /// The distribution of each key, as the user wrote it.
    pub distributions: Vec<Option<String>>,
    /// The method by which `influence` is computed.
    pub influence_method: &'static str,
    /// The statistics of each step and quantity.
    pub statistics: Vec<StepStatistics>,
}

/// The method of [`crate::influence`], in words.
const METHOD: &str =
    "squared standardised rank regression coefficients; r_squared is what they account for together";

impl Summary {
    /// Whether every case has complete results.
    pub fn is_complete(&self) -> bool {
        self.ok == self.cases
    }
}

/// Writes table, plot, statistics and summary of the records, which are ordered by case. They do not depend
/// on the time or the order of the solves.
///
/// # Errors
/// [`SweepError`] if a file cannot be written.
pub fn write_results(folder: &SweepFolder, records: &[Option<CaseRecord>]) -> Result<Summary, SweepError> {
    let manifest = folder.manifest();
    let cases: Vec<usize> = manifest.cases_of_shard().collect();
    let record = |case: usize| records.get(case).and_then(Option::as_ref);
    let which = |is: fn(&CaseRecord) -> bool| -> Vec<usize> {
        cases.iter().copied().filter(|case| record(*case).is_some_and(is)).collect()
    };
    let scatter = manifest.seed.map(|seed| Scatter {
        seed,
        distributions: manifest.distributions.clone(),
        influence_method: METHOD,
        statistics: statistics(&Column::all(manifest), records),
    });
    let mut files = vec![TABLE.to_owned(), SUMMARY.to_owned()];
    folder.write(TABLE, table(manifest, records).as_bytes())?;
    if let Some(chart) = chart(manifest, records) {
        folder.write(PLOT, chart.to_svg().as_bytes())?;
        files.push(PLOT.to_owned());
    }
    if let Some(scatter) = &scatter {
        folder.write(STATISTICS, statistics_table(&scatter.statistics).as_bytes())?;
        files.push(STATISTICS.to_owned());
    }
    files.sort();
    let summary = Summary {
        title: manifest.title.clone(),
        case_file: manifest.case_file.clone(),
        fingerprint: manifest.digest.clone(),
        shard: (manifest.shard.of > 1).then(|| manifest.shard.to_string()),
        keys: manifest.keys.clone(),
        cases: cases.len(),
        finished: which(|_| true).len(),
        ok: which(CaseRecord::is_ok).len(),
        failed: which(CaseRecord::has_failed),
        missed: which(|record| !record.is_ok() && !record.has_failed()),
        files,
        scatter,
    };
    let text = serde_json::to_vec_pretty(&summary)
        .map_err(|error| SweepError::Write { file: folder.path().join(SUMMARY), source: error.into() })?;
    folder.write(SUMMARY, &text)?;
    folder.remove_others(&[summary.files.as_slice(), &[SUMMARY.to_owned()]].concat(), records)?;
    Ok(summary)
}

/// `statistics.csv`: a line for each step and quantity.
fn statistics_table(statistics: &[StepStatistics]) -> String {
    let percentiles = PERCENTILES.iter().map(|percent| format!("percentile_{percent}"));
    let mut header: Vec<String> =
        ["step", "quantity", "count", "mean", "deviation", "least"].map(str::to_owned).to_vec();
    header.extend(percentiles);
    header.extend(["greatest", "r_squared", "first_influence", "first_share"].map(str::to_owned));
    let mut out = header.join(",") + "\n";
    for line in statistics {
        let moments = &line.moments;
        let mut fields = vec![
            line.step.to_string(),
            line.quantity.to_owned(),
            moments.count.to_string(),
            number(moments.mean),
            moments.deviation.map_or_else(String::new, number),
            number(moments.least),
        ];
        fields.extend(moments.percentiles.iter().map(|(_, value)| number(*value)));
        fields.push(number(moments.greatest));
        let first = line.influence.as_ref().and_then(|influence| influence.shares.first());
        fields
            .push(line.influence.as_ref().map_or_else(String::new, |influence| number(influence.r_squared)));
        fields.push(first.map_or_else(String::new, |share| elastocap_results::csv::quoted(&share.key)));
        fields.push(first.map_or_else(String::new, |share| number(share.share)));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}
