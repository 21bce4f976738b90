//! The design of a sweep: the values of its keys in each case, with permanent case numbers.

use chacha20::ChaCha12Rng;
use rand::SeedableRng as _;

use crate::settings::{MAX_CASES, Setting, Values};

/// The values of one case, in the order of the keys, as a case file has them; `None` keeps the value of the
/// file.
pub type CaseValues = Vec<Option<String>>;

/// The cases of a sweep. The index of a case does not depend on the order of the solves.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The paths of the varied keys.
    keys: Vec<String>,
    /// The values of each case, by its index.
    cases: Vec<CaseValues>,
    /// The origin of the cases.
    kind: DesignKind,
}

/// The origin of the cases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DesignKind {
    /// Every combination of values.
    Grid,
    /// The rows of a table, each combined with every value of the grid, if there is one.
    List,
    /// Cases drawn at random.
    Random {
        /// The seed of the random generator.
        seed: u64,
        /// The distribution of each key as the user wrote it; `None` for a constant value.
        distributions: Vec<Option<String>>,
    },
}

/// The reason why settings or a list give no cases.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// Nothing is varied.
    #[error(
        "nothing is varied; say what with --set KEY=VALUES, such as layer.thickness=400um,450um, or with --list"
    )]
    Nothing,
    /// A key is set twice.
    #[error("`{0}` is set twice; put all its values in one place")]
    Twice(String),
    /// A value of a grid is a distribution.
    #[error("`{key}={distribution}` is a distribution; say how many cases to draw with --random N")]
    DrawnInGrid {
        /// The key.
        key: String,
        /// The distribution.
        distribution: String,
    },
    /// A key has several values where cases are drawn at random.
    #[error(
        "`{0}` has several values beside --random; give it a distribution, such as uniform(1um, 2um), or one value"
    )]
    ListedAmongDrawn(String),
    /// Cases are drawn at random, and no key has a distribution.
    #[error(
        "--random draws nothing: no key has a distribution; write for example --set layer.thickness=normal(450um, 5um)"
    )]
    NothingDrawn,
    /// More cases than a sweep may have.
    #[error("these are {0} cases; a sweep has at most 1,000,000")]
    TooMany(String),
    /// The sweep has no cases.
    #[error("the list has no rows below its header, so there are no cases")]
    NoRows,
    /// A column of the list has no name.
    #[error("column {0} of the list has no name; the first line of a list holds the paths of the keys")]
    NoName(usize),
    /// A row of the list is shorter or longer than the header.
    #[error(
        "line {line} of the list has {found} fields, and its header {header}; an empty field leaves what the case file has, and quotation marks stand right after a comma"
    )]
    RowLength {
        /// The line, counted from 1.
        line: u64,
        /// The number of fields of the row.
        found: usize,
        /// The number of fields of the header.
        header: usize,
    },
}

impl Design {
    /// A design of given cases; `keys` are paths, and each case has a value for each of them.
    ///
    /// # Errors
    /// A repeated key, no cases or too many, or a case with more or fewer values than there are keys (its
    /// position counts as line).
    pub fn of_cases(keys: Vec<String>, cases: Vec<CaseValues>) -> Result<Self, DesignError> {
        check_keys(&keys)?;
        if cases.is_empty() {
            return Err(DesignError::NoRows);
        }
        if let Some((at, case)) = cases.iter().enumerate().find(|(_, case)| case.len() != keys.len()) {
            return Err(DesignError::RowLength { line: at as u64, found: case.len(), header: keys.len() });
        }
        check_count(Some(cases.len()))?;
        Ok(Self { keys, cases, kind: DesignKind::List })
    }

    /// The design of all combinations: the values of the last setting change fastest.
    ///
    /// # Errors
    /// No settings, a key that is set twice, a distribution, or too many cases.
    pub fn grid(settings: &[Setting]) -> Result<Self, DesignError> {
        if settings.is_empty() {
            return Err(DesignError::Nothing);
        }
        let (keys, cases) = product(settings, Vec::new(), vec![Vec::new()])?;
        Ok(Self { keys, cases, kind: DesignKind::Grid })
    }

    /// The rows of a table of comma-separated values, whose header has the paths of keys; with settings, each
    /// row is combined with all of their values, which change fastest.
    ///
    /// # Errors
    /// A table that cannot be read or has no rows, a key that is set twice, a distribution, or too many
    /// cases.
    pub fn list(table: &str, settings: &[Setting]) -> Result<Self, DesignError> {
        let (keys, rows) = read_list(table)?;
        let (keys, cases) = product(settings, keys, rows)?;
        Ok(Self { keys, cases, kind: DesignKind::List })
    }

    /// `count` cases drawn at random, by ChaCha with 12 rounds. Each case has a separate stream, so that a
    /// larger count begins with the same cases.
    ///
    /// # Errors
    /// No distribution, a key that is set twice or has several values, or too many cases.
    pub fn random(settings: &[Setting], count: usize, seed: u64) -> Result<Self, DesignError> {
        let keys: Vec<String> = settings.iter().map(|setting| setting.key.clone()).collect();
        check_keys(&keys)?;
        check_count(Some(count))?;
        let mut distributions = Vec::new();
        for setting in settings {
            distributions.push(match &setting.values {
                Values::Drawn(distribution) => Some(distribution.text().to_owned()),
                Values::Listed(values) if values.len() == 1 => None,
                Values::Listed(_) => return Err(DesignError::ListedAmongDrawn(setting.key.clone())),
            });
        }
        if distributions.iter().all(Option::is_none) {
            return Err(DesignError::NothingDrawn);
        }
        let case = |index: usize| {
            let mut random = ChaCha12Rng::seed_from_u64(seed);
            random.set_stream(index as u64);
            let value = |setting: &Setting| match &setting.values {
                Values::Drawn(distribution) => Some(distribution.draw(&mut random)),
                Values::Listed(values) => values.first().cloned(),
            };
            settings.iter().map(value).collect()
        };
        let cases = (0..count).map(case).collect();
        Ok(Self { keys, cases, kind: DesignKind::Random { seed, distributions } })
    }

    /// The same cases as another kind of design, for designs read from a manifest.
    pub(crate) fn with_kind(self, kind: DesignKind) -> Self {
        Self { kind, ..self }
    }

    /// The paths of the varied keys.
    pub fn keys(&self) -> &[String] {
        &self.keys
    }

    /// The values of each case, by its index.
    pub fn cases(&self) -> &[CaseValues] {
        &self.cases
    }

    /// The origin of the cases.
    pub fn kind(&self) -> &DesignKind {
        &self.kind
    }
}

/// Checks that there are keys, and that none is set twice.
fn check_keys(keys: &[String]) -> Result<(), DesignError> {
    if keys.is_empty() {
        return Err(DesignError::Nothing);
    }
    match keys.iter().enumerate().find(|(k, key)| keys[..*k].contains(key)) {
        Some((_, key)) => Err(DesignError::Twice(key.clone())),
        None => Ok(()),
    }
}

/// Checks the number of cases; `None` is a number that overflows.
fn check_count(count: Option<usize>) -> Result<(), DesignError> {
    match count {
        Some(count) if count <= MAX_CASES => Ok(()),
        Some(count) => Err(DesignError::TooMany(count.to_string())),
        None => Err(DesignError::TooMany("far too many".to_owned())),
    }
}

/// Each row combined with all values of the settings.
fn product(
    settings: &[Setting],
    mut keys: Vec<String>,
    mut rows: Vec<CaseValues>,
) -> Result<(Vec<String>, Vec<CaseValues>), DesignError> {
    let mut count = Some(rows.len());
    for setting in settings {
        let Values::Listed(values) = &setting.values else {
            let Values::Drawn(drawn) = &setting.values else { continue };
            let (key, distribution) = (setting.key.clone(), drawn.text().to_owned());
            return Err(DesignError::DrawnInGrid { key, distribution });
        };
        keys.push(setting.key.clone());
        count = count.and_then(|count| count.checked_mul(values.len()));
        check_count(count)?;
        let extended = |row: &CaseValues, value: &String| {
            let mut row = row.clone();
            row.push(Some(value.clone()));
            row
        };
        rows = rows.iter().flat_map(|row| values.iter().map(move |value| extended(row, value))).collect();
    }
    check_keys(&keys)?;
    check_count(count)?;
    Ok((keys, rows))
}

/// The header and the rows of a list. Lines that begin with `#` are comments.
fn read_list(table: &str) -> Result<(Vec<String>, Vec<CaseValues>), DesignError> {
    let mut lines = Lines::new(table.strip_prefix('\u{feff}').unwrap_or(table));
    let (_, keys) = lines.next().unwrap_or_default();
    if let Some(at) = keys.iter().position(String::is_empty) {
        return Err(DesignError::NoName(at + 1));
    }
    let mut rows = Vec::new();
    for (line, fields) in lines {
        if fields.len() != keys.len() {
            return Err(DesignError::RowLength { line, found: fields.len(), header: keys.len() });
        }
        rows.push(fields.into_iter().map(|field| (!field.is_empty()).then_some(field)).collect());
        check_count(Some(rows.len()))?;
    }
    if rows.is_empty() {
        return Err(DesignError::NoRows);
    }
    Ok((keys, rows))
}

/// The rows of a table of comma-separated values, each with the line where it begins.
struct Lines<'a> {
    reader: csv_core::Reader,
    /// The text that is not yet read.
    rest: &'a [u8],
    /// Room for the fields of a row, one after the other. It grows as needed.
    bytes: Vec<u8>,
    /// Room for the ends of the fields in `bytes`. It grows as needed.
    ends: Vec<usize>,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        let reader = csv_core::ReaderBuilder::new().comment(Some(b'#')).build();
        Self { reader, rest: text.as_bytes(), bytes: vec![0; 256], ends: vec![0; 16] }
    }
}

impl Iterator for Lines<'_> {
    type Item = (u64, Vec<String>);

    fn next(&mut self) -> Option<Self::Item> {
        let (mut written, mut ended) = (0, 0);
        loop {
            let (bytes, ends) = (&mut self.bytes[written..], &mut self.ends[ended..]);
            let (result, read, wrote, ends_found) = self.reader.read_record(self.rest, bytes, ends);
            self.rest = self.rest.get(read..).unwrap_or_default();
            (written, ended) = (written + wrote, ended + ends_found);
            match result {
                csv_core::ReadRecordResult::Record => break,
                csv_core::ReadRecordResult::End => return None,
                // Called again without input, the reader ends the last row.
                csv_core::ReadRecordResult::InputEmpty => {}
                csv_core::ReadRecordResult::OutputFull => self.bytes.resize(2 * self.bytes.len(), 0),
                csv_core::ReadRecordResult::OutputEndsFull => self.ends.resize(2 * self.ends.len(), 0),
            }
        }
        let mut from = 0;
        let field = |end: &usize| {
            let field = String::from_utf8_lossy(self.bytes.get(from..*end).unwrap_or_default());
            from = *end;
            field.trim().to_owned()
        };
        let fields = self.ends.iter().take(ended).map(field).collect();
        Some((self.reader.line().saturating_sub(1), fields))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(texts: &[&str]) -> Vec<Setting> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    }

    fn shown(design: &Design) -> Vec<String> {
        let case = |case: &CaseValues| {
            case.iter().map(|value| value.as_deref().unwrap_or("-")).collect::<Vec<_>>().join(" ")
        };
        design.cases().iter().map(case).collect()
    }

    #[test]
    fn a_grid_has_every_value_with_every_other_and_the_last_key_changes_fastest() {
        let design = Design::grid(&settings(&["a=1,2", "b=x,y,z"])).unwrap();
        assert_eq!(design.keys(), ["a", "b"]);
        assert_eq!(shown(&design), ["1 x", "1 y", "1 z", "2 x", "2 y", "2 z"]);
    }

    #[test]
    fn a_list_has_one_case_for_each_row_and_empty_fields_leave_the_value_of_the_file() {
        let text =
            "layer.thickness, electrodes.in_plane_pair.gap\n400um, 10um\n# comment\n450um,\n\"[1, 2]\",5\n";
        let design = Design::list(text, &[]).unwrap();
        assert_eq!(design.keys(), ["layer.thickness", "electrodes.in_plane_pair.gap"]);
        assert_eq!(shown(&design), ["400um 10um", "450um -", "[1, 2] 5"]);
        let long = "x".repeat(5000);
        let wide = (0..100).map(|k| format!("k{k}")).collect::<Vec<_>>().join(",");
        let values = vec![long.as_str(); 100].join(",");
        let design = Design::list(&format!("{wide}\n{values}"), &[]).unwrap();
        assert!(design.cases()[0].iter().all(|value| value.as_ref() == Some(&long)));
        let with_grid = Design::list("a\n1\n2\n", &settings(&["b=x,y"])).unwrap();
        assert_eq!(shown(&with_grid), ["1 x", "1 y", "2 x", "2 y"]);
    }

    #[test]
    fn the_same_seed_draws_the_same_cases_and_more_cases_begin_with_them() {
        let settings = settings(&["a=normal(50um, 2um)", "b=uniform(1, 2)", "c=7"]);
        let few = Design::random(&settings, 5, 1).unwrap();
        let many = Design::random(&settings, 9, 1).unwrap();
        assert_eq!(few.cases(), &many.cases()[..5]);
        assert_ne!(few.cases(), Design::random(&settings, 5, 2).unwrap().cases());
        assert!(few.cases().iter().all(|case| case[2].as_deref() == Some("7")));
        // Fixed values, which reveal a change of machine or of the generator's version.
        assert_eq!(shown(&few)[0], "\"49.4458732 um\" 1.25455176 7");
    }

    #[test]
    fn settings_that_make_no_design_are_refused() {
        let refused = |design: Result<Design, DesignError>, words: &str| {
            let message = design.unwrap_err().to_string();
            assert!(message.contains(words), "{message}\nlacks: {words}");
        };
        refused(Design::grid(&[]), "nothing is varied");
        refused(Design::grid(&settings(&["a=1", "a=2"])), "`a` is set twice");
        refused(Design::grid(&settings(&["a=normal(1,2)"])), "--random N");
        refused(Design::grid(&settings(&["a=1..2:2000", "b=1..2:2000"])), "4000000 cases");
        refused(Design::random(&settings(&["a=1,2", "b=uniform(1,2)"]), 5, 1), "`a` has several values");
        refused(Design::random(&settings(&["a=1"]), 5, 1), "no key has a distribution");
        refused(Design::random(&settings(&["a=uniform(1,2)"]), MAX_CASES + 1, 1), "at most 1,000,000");
        refused(Design::list("a,b\n", &[]), "no rows");
        refused(Design::list("a,\n1,2\n", &[]), "column 2 of the list has no name");
        refused(Design::list("a,b\n1,2\n3\n", &[]), "line 3 of the list has 1 fields");
        refused(Design::list("a,a\n1,2\n", &[]), "set twice");
    }
}
