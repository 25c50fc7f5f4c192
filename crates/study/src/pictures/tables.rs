//! The tables of a study, read back.

use std::collections::VecDeque;
use std::fs;
use std::path::Path;

use crate::cells;

/// The four tables of a study's directory; `docs/study.md` describes their columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tables {
    pub utterances: Vec<UtteranceRow>,
    pub episodes: Vec<EpisodeRow>,
    pub summary: Vec<SummaryRow>,
    pub answered: Vec<AnsweredRow>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UtteranceRow {
    pub condition: String,
    pub task_type: String,
    pub user: String,
    pub episode: u32,
    pub turn: u32,
    pub utterance: String,
    /// understood, impossible or not_sure.
    pub outcome: String,
    pub answered_by: String,
    pub guessed: bool,
    pub meant: String,
    pub right: Option<bool>,
    pub primitives: u32,
    pub taught: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeRow {
    pub condition: String,
    pub task_type: String,
    pub user: String,
    pub episode: u32,
    pub goal: String,
    pub utterances: u32,
    pub understood: u32,
    pub not_sure: u32,
    pub impossible: u32,
    pub wrong: u32,
    pub primitives: u32,
    pub fewest_actions: Option<u32>,
    pub normalised_length: Option<f64>,
    pub complexity: Option<f64>,
    pub examples_taught: u32,
    pub finished: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    pub condition: String,
    /// `all` over all types.
    pub task_type: String,
    pub episode: u32,
    pub measure: String,
    pub users: u32,
    pub mean: f64,
    /// Of the sample; none for one user.
    pub sd: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct AnsweredRow {
    pub condition: String,
    pub answered_by: String,
    pub parses: u32,
    pub share: f64,
}

/// What is wrong with a table, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TablesError {
    #[error(
        "the table {file} cannot be read: {reason}; is this the directory of a finished study?"
    )]
    File { file: String, reason: String },
    #[error("{file}, line {line}: {reason}")]
    Line { file: String, line: usize, reason: String },
}

impl Tables {
    /// Reads `utterances.csv`, `episodes.csv`, `summary.csv` and `answered.csv` of a directory.
    ///
    /// - errors: the first thing that is wrong, with file and line.
    pub fn read(directory: &Path) -> Result<Tables, TablesError> {
        let text = |name: &str| {
            fs::read_to_string(directory.join(name)).map_err(|error| TablesError::File {
                file: name.to_owned(),
                reason: error.to_string(),
            })
        };
        Ok(Tables {
            utterances: rows("utterances.csv", &text("utterances.csv")?)?,
            episodes: rows("episodes.csv", &text("episodes.csv")?)?,
            summary: rows("summary.csv", &text("summary.csv")?)?,
            answered: rows("answered.csv", &text("answered.csv")?)?,
        })
    }
}

/// A row of a table with known columns.
pub(super) trait Row: Sized {
    const COLUMNS: &'static [&'static str];
    /// - errors: a column, and what is wrong with it.
    fn read(fields: &mut Fields) -> Result<Self, String>;
}

/// The fields of one line, taken from the left.
pub(super) struct Fields {
    columns: &'static [&'static str],
    fields: VecDeque<String>,
}

impl Fields {
    fn next(&mut self) -> (&'static str, String) {
        let column = self.columns[self.columns.len() - self.fields.len()];
        (column, self.fields.pop_front().expect("a line has as many fields as columns"))
    }

    fn text(&mut self) -> String {
        cells::read(self.next().1)
    }

    fn number(&mut self) -> Result<u32, String> {
        let (column, field) = self.next();
        field.parse().map_err(|_| format!("{column} is {field:?}; expected a whole number"))
    }

    fn maybe_number(&mut self) -> Result<Option<u32>, String> {
        let is_empty = self.fields.front().is_some_and(String::is_empty);
        if is_empty { Ok(self.next()).map(|_| None) } else { self.number().map(Some) }
    }

    fn real(&mut self) -> Result<f64, String> {
        let (column, field) = self.next();
        let value = field.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("{column} is {field:?}; expected a number"))
    }

    fn maybe_real(&mut self) -> Result<Option<f64>, String> {
        let is_empty = self.fields.front().is_some_and(String::is_empty);
        if is_empty { Ok(self.next()).map(|_| None) } else { self.real().map(Some) }
    }

    fn bit(&mut self) -> Result<bool, String> {
        let (column, field) = self.next();
        match field.as_str() {
            "1" => Ok(true),
            "0" => Ok(false),
            _ => Err(format!("{column} is {field:?}; expected 1 or 0")),
        }
    }

    fn maybe_bit(&mut self) -> Result<Option<bool>, String> {
        let is_empty = self.fields.front().is_some_and(String::is_empty);
        if is_empty { Ok(self.next()).map(|_| None) } else { self.bit().map(Some) }
    }

    fn one_of(&mut self, known: &[&str]) -> Result<String, String> {
        let (column, field) = self.next();
        match known.contains(&field.as_str()) {
            true => Ok(field),
            false => Err(format!("{column} is {field:?}; expected {}", known.join(", "))),
        }
    }
}

impl Row for UtteranceRow {
    const COLUMNS: &'static [&'static str] = &[
        "condition",
        "task_type",
        "user",
        "episode",
        "turn",
        "utterance",
        "outcome",
        "answered_by",
        "guessed",
        "meant",
        "right",
        "primitives",
        "taught",
    ];

    fn read(fields: &mut Fields) -> Result<UtteranceRow, String> {
        Ok(UtteranceRow {
            condition: fields.text(),
            task_type: fields.text(),
            user: fields.text(),
            episode: fields.number()?,
            turn: fields.number()?,
            utterance: fields.text(),
            outcome: fields.one_of(&["understood", "impossible", "not_sure"])?,
            answered_by: fields.text(),
            guessed: fields.bit()?,
            meant: fields.text(),
            right: fields.maybe_bit()?,
            primitives: fields.number()?,
            taught: fields.bit()?,
        })
    }
}

impl Row for EpisodeRow {
    const COLUMNS: &'static [&'static str] = &[
        "condition",
        "task_type",
        "user",
        "episode",
        "goal",
        "utterances",
        "understood",
        "not_sure",
        "impossible",
        "wrong",
        "primitives",
        "fewest_actions",
        "normalised_length",
        "complexity",
        "examples_taught",
        "finished",
    ];

    fn read(fields: &mut Fields) -> Result<EpisodeRow, String> {
        Ok(EpisodeRow {
            condition: fields.text(),
            task_type: fields.text(),
            user: fields.text(),
            episode: fields.number()?,
            goal: fields.text(),
            utterances: fields.number()?,
            understood: fields.number()?,
            not_sure: fields.number()?,
            impossible: fields.number()?,
            wrong: fields.number()?,
            primitives: fields.number()?,
            fewest_actions: fields.maybe_number()?,
            normalised_length: fields.maybe_real()?,
            complexity: fields.maybe_real()?,
            examples_taught: fields.number()?,
            finished: fields.bit()?,
        })
    }
}

impl Row for SummaryRow {
    const COLUMNS: &'static [&'static str] =
        &["condition", "task_type", "episode", "measure", "users", "mean", "sd"];

    fn read(fields: &mut Fields) -> Result<SummaryRow, String> {
        Ok(SummaryRow {
            condition: fields.text(),
            task_type: fields.text(),
            episode: fields.number()?,
            measure: fields.text(),
            users: fields.number()?,
            mean: fields.real()?,
            sd: fields.maybe_real()?,
        })
    }
}

impl Row for AnsweredRow {
    const COLUMNS: &'static [&'static str] = &["condition", "answered_by", "parses", "share"];

    fn read(fields: &mut Fields) -> Result<AnsweredRow, String> {
        Ok(AnsweredRow {
            condition: fields.text(),
            answered_by: fields.text(),
            parses: fields.number()?,
            share: fields.real()?,
        })
    }
}

/// The rows of a table.
pub(super) fn rows<R: Row>(file: &str, text: &str) -> Result<Vec<R>, TablesError> {
    let wrong =
        |line: usize, reason: String| TablesError::Line { file: file.to_owned(), line, reason };
    let mut lines = records(text).map_err(|(line, reason)| wrong(line, reason))?.into_iter();
    let (_, head) = lines.next().ok_or_else(|| {
        wrong(1, format!("the table is empty; expected the columns {}", R::COLUMNS.join(",")))
    })?;
    if let Some(missing) = R::COLUMNS.iter().find(|column| !head.iter().any(|h| h == *column)) {
        return Err(wrong(
            1,
            format!("there is no column {missing}; expected {}", R::COLUMNS.join(",")),
        ));
    }
    // Columns that a later version adds are passed over, wherever they stand.
    let places: Vec<usize> = R::COLUMNS
        .iter()
        .map(|column| head.iter().position(|h| h == column).expect("none is missing"))
        .collect();
    lines
        .map(|(line, mut fields)| {
            if fields.len() != head.len() {
                let (found, expected) = (fields.len(), head.len());
                return Err(wrong(line, format!("it has {found} fields; expected {expected}")));
            }
            let fields = places.iter().map(|place| std::mem::take(&mut fields[*place])).collect();
            R::read(&mut Fields { columns: R::COLUMNS, fields })
                .map_err(|reason| wrong(line, reason))
        })
        .collect()
}

/// A record's first line, counted from 1, and its fields.
type Numbered = (usize, Vec<String>);

/// The records of a text of comma-separated values (RFC 4180; lines may end with LF alone), each
/// with the line on which it begins.
///
/// - errors: the line, and what is wrong there.
fn records(text: &str) -> Result<Vec<Numbered>, (usize, String)> {
    let mut records = Vec::new();
    let (mut line, mut begun) = (1, 1);
    let mut fields: Vec<String> = Vec::new();
    let mut field = String::new();
    let (mut quoted, mut closed) = (false, false);
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        line += usize::from(c == '\n');
        match c {
            '"' if quoted && chars.next_if_eq(&'"').is_some() => field.push('"'),
            '"' if quoted => (quoted, closed) = (false, true),
            c if quoted => field.push(c),
            '"' if field.is_empty() && !closed => quoted = true,
            ',' => {
                fields.push(std::mem::take(&mut field));
                closed = false;
            }
            '\r' if chars.peek() == Some(&'\n') => {}
            '\n' => {
                fields.push(std::mem::take(&mut field));
                records.push((begun, std::mem::take(&mut fields)));
                (closed, begun) = (false, line);
            }
            c if closed || c == '"' => {
                return Err((line, format!("expected a comma, found {c:?}")));
            }
            c => field.push(c),
        }
    }
    if quoted {
        return Err((begun, "a quoted field does not end".to_owned()));
    }
    if closed || !field.is_empty() || !fields.is_empty() {
        fields.push(field);
        records.push((begun, fields));
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_commas_and_line_ends_are_read_as_the_rfc_has_them() {
        let read = |text| records(text).unwrap();
        assert_eq!(
            read("a,\"b, \"\"c\"\"\"\n\"two\nlines\",\r\nlast,x"),
            [
                (1, vec!["a".to_owned(), "b, \"c\"".to_owned()]),
                (2, vec!["two\nlines".to_owned(), String::new()]),
                (4, vec!["last".to_owned(), "x".to_owned()]),
            ]
        );
        assert_eq!(read(""), []);
        assert_eq!(records("a\n\"b").unwrap_err().0, 2);
        assert_eq!(
            records("a\n\"b\"c").unwrap_err(),
            (2, "expected a comma, found 'c'".to_owned())
        );
    }

    #[test]
    fn what_is_wrong_is_named_with_file_and_line() {
        let summary =
            |text: &str| rows::<SummaryRow>("summary.csv", text).map_err(|error| error.to_string());
        let head = "condition,task_type,episode,measure,users,mean,sd\n";
        let good = format!("{head}paper,all,1,complexity,20,1.5000,0.2500\n");
        assert_eq!(summary(&good).unwrap()[0].sd, Some(0.25));
        let more = "condition,task_type,episode,measure,users,median,mean,sd\n\
                    paper,all,1,complexity,20,7,1.5000,\n";
        let row = &summary(more).unwrap()[0];
        assert_eq!((row.mean, row.sd), (1.5, None));
        for (text, expected) in [
            (String::new(), "summary.csv, line 1: the table is empty; expected the columns"),
            (
                good.replace("mean", "average"),
                "summary.csv, line 1: there is no column mean; expected condition,task_type",
            ),
            (
                good.replace("1.5000", "about 2"),
                "summary.csv, line 2: mean is \"about 2\"; expected a number",
            ),
            (good.replace("1.5000", "NaN"), "summary.csv, line 2: mean is \"NaN\"; expected"),
            (good.replace(",20,", ",-1,"), "users is \"-1\"; expected a whole number"),
            (good.replace(",0.2500", ""), "summary.csv, line 2: it has 6 fields; expected 7"),
        ] {
            let found = summary(&text).unwrap_err();
            assert!(found.contains(expected), "{found}");
        }
        let answered = "condition,answered_by,parses,share\n'=1+1,'tis,3,1.0000\n";
        let row = &rows::<AnsweredRow>("answered.csv", answered).unwrap()[0];
        assert_eq!((&*row.condition, &*row.answered_by), ("=1+1", "'tis"));
        let said = "condition,task_type,user,episode,turn,utterance,outcome,answered_by,guessed,\
                    meant,right,primitives,taught\np,clean,u1,1,1,\"go, now\",heard,,0,,,0,0\n";
        assert_eq!(
            rows::<UtteranceRow>("utterances.csv", said).unwrap_err().to_string(),
            "utterances.csv, line 2: outcome is \"heard\"; expected understood, impossible, \
             not_sure"
        );
    }
}
