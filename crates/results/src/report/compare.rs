//! The page that compares several results.

use serde_json::json;

use super::charts::chart_data;
use super::html::{Table, escape};
use super::shell::{Page, Part};
use crate::plot::Chart;

/// A table of words: its caption, its head, and its rows, whose first cell is their head.
pub type WordTable = (String, Vec<String>, Vec<Vec<String>>);

/// The page of a comparison: a sentence, a chart of the curves where there is one, and tables.
pub fn comparison_page(
    title: &str,
    sentence: &str,
    chart: Option<&Chart>,
    tables: &[(String, Vec<WordTable>)],
) -> String {
    let mut page = Page::new(title);
    page.lead(format!("<p class=\"lead\">{}</p>\n", escape(sentence)));
    let mut charts = Vec::new();
    if let Some(chart) = chart {
        let place = "<div class=\"charts\"><figure><div class=\"chart\" id=\"curves\" role=\"group\" tabindex=\"0\" aria-label=\"Chart: the curves \
                     of all results. The arrow keys go from point to point; the table has the numbers.\"></div>\
                     <figcaption>Curves of all results, with their bounds.</figcaption></figure></div>\n";
        page.section("chart", "Curves", place);
        charts.push(chart_data("curves", chart));
    }
    for (k, (heading, tables)) in tables.iter().enumerate() {
        let body: String = tables.iter().map(table).collect();
        page.section(&format!("part-{k}"), heading, &body);
    }
    page.finish(&json!({ "charts": charts }), &[Part::Charts])
}

fn table((caption, head, rows): &WordTable) -> String {
    let mut table = Table::new(caption);
    for (k, name) in head.iter().enumerate() {
        let cells: Vec<String> = rows.iter().map(|row| row.get(k).cloned().unwrap_or_default()).collect();
        let is_number = |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
        if k > 0 && cells.iter().all(is_number) {
            table.numbers(name, cells)
        } else {
            table.words(name, cells)
        }
    }
    table.html()
}
