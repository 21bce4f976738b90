//! The plan, the case, the files, and how to repeat the run.

use std::fmt::Write as _;

use elastocap_case::Case;
use elastocap_coupling::plan::{Decision, Plan};
use elastocap_coupling::words::{counted, grouped, seconds};

use super::Report;
use super::html::{Table, escape};
use crate::output_files::REPORT;

/// The plan: which parts are solved, which are left out, and the savings.
pub(super) fn plan(plan: &Plan) -> String {
    let mut out = "<dl class=\"plan\">\n".to_owned();
    for planned in &plan.solved {
        let _ =
            writeln!(out, "<div><dt>{}</dt><dd>{}</dd></div>", escape(planned.part), escape(&planned.what));
    }
    out.push_str("</dl>\n");
    if plan.left_out.is_empty() {
        out.push_str("<p>Nothing was left out.</p>\n");
    } else {
        let mut table = Table::new("What was left out, and what that saved");
        let column = |value: fn(&elastocap_coupling::plan::LeftOut) -> String| {
            plan.left_out.iter().map(value).collect()
        };
        table.words("left out", column(|part| part.what.clone()));
        table.words("because", column(|part| part.why.clone()));
        table.words("saving", column(|part| part.saving.clone()));
        table.words("decided by", column(|part| decision(part.by).to_owned()));
        out.push_str(&table.html());
    }
    if plan.unknowns > 0 {
        let _ = writeln!(
            out,
            "<p>Planned: {} in the largest problem, {} of memory at most, and {} for all fields on two cores.</p>",
            counted(plan.unknowns, "unknown"),
            memory(plan.memory_bytes),
            seconds(plan.seconds)
        );
    }
    out
}

fn decision(by: Decision) -> &'static str {
    match by {
        Decision::Plan => "the plan",
        Decision::Case => "the case",
        Decision::Caller => "the caller",
    }
}

fn memory(bytes: u64) -> String {
    let mib = bytes as f64 / f64::from(1 << 20);
    if mib < 1024.0 {
        format!("{} MiB", grouped(mib.ceil() as usize))
    } else {
        format!("{:.1} GiB", mib / 1024.0)
    }
}

/// The text of the case file.
pub(super) fn case_text(case: &Case, text: &str) -> String {
    let name = escape(&case.source.display().to_string());
    format!(
        "<p><code>{name}</code>, as it was read. <button type=\"button\" class=\"copy\" data-copy=\"case-text\">Copy</button></p>\n\
         <pre id=\"case-text\" tabindex=\"0\" role=\"region\" aria-label=\"Text of the case file\"><code>{}</code></pre>\n",
        escape(text)
    )
}

/// The files beside the page, and the command.
pub(super) fn repeat(report: &Report<'_>) -> String {
    let mut out = String::new();
    if let Some(command) = report.command {
        let _ = writeln!(
            out,
            "<p>This command repeats the run: <button type=\"button\" class=\"copy\" data-copy=\"command\">Copy</button></p>\n\
             <pre id=\"command\" tabindex=\"0\" role=\"region\" aria-label=\"Command\"><code>{}</code></pre>",
            escape(command)
        );
    }
    let _ = writeln!(
        out,
        "<p>elastocap {} on {}-{}. The numbers of curve.csv are the same at any number of threads.</p>",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS
    );
    let links: Vec<String> = (report.files.iter())
        .filter(|name| *name != REPORT)
        // Names of files of a run are plain words: see `is_result_name`.
        .map(|name| format!("<li><a href=\"{0}\">{0}</a></li>", escape(name)))
        .collect();
    if !links.is_empty() {
        let _ = writeln!(
            out,
            "<p>Files of the run, in the same folder:</p>\n<ul class=\"files\">{}</ul>",
            links.concat()
        );
    }
    out
}
