//! Rows as comma-separated values (RFC 4180, lines end with LF) in which a spreadsheet finds no
//! formula.
//!
//! A spreadsheet computes a cell that begins with `=`, `+`, `-`, `@`, their full-width forms, a tab or
//! a line end (CWE-1236). A text that begins so gets an apostrophe in front, as OWASP advises; numbers
//! are no texts and stay. A text that has apostrophes before such a beginning gets one more, so that
//! the text is always found again.

use csv::{DeserializeErrorKind, ErrorKind, Reader, StringRecord, Terminator, WriterBuilder};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What is wrong with a table: the line, counted from 1, and a sentence.
pub type Wrong = (u64, String);

/// A table with a first line that names the columns: the fields of a row, in their order.
pub fn written<R: Serialize + Default>(rows: &[R]) -> String {
    match rows {
        [] => columns::<R>() + "\n",
        rows => lines(rows),
    }
}

/// The rows of a table. Columns that a later version adds are passed over, wherever they stand.
pub fn read<R: Serialize + DeserializeOwned + Default>(text: &str) -> Result<Vec<R>, Wrong> {
    let mut reader = Reader::from_reader(text.as_bytes());
    let head = reader.headers().map_err(|error| (1, error.to_string()))?.clone();
    let columns = columns::<R>();
    if head.is_empty() {
        return Err((1, format!("the table is empty; expected the columns {columns}")));
    }
    if let Some(missing) = columns.split(',').find(|column| !head.iter().any(|h| h == *column)) {
        return Err((1, format!("there is no column {missing}; expected {columns}")));
    }
    reader.records().map(|record| record.map_err(uneven).and_then(|it| row(&head, &it))).collect()
}

fn row<R: DeserializeOwned>(head: &StringRecord, record: &StringRecord) -> Result<R, Wrong> {
    record.deserialize(Some(head)).map_err(|error| {
        let line = record.position().map_or(0, |position| position.line());
        let ErrorKind::Deserialize { err, .. } = error.kind() else {
            return (line, error.to_string());
        };
        let expected = match err.kind() {
            DeserializeErrorKind::ParseInt(_) => "a whole number",
            DeserializeErrorKind::ParseFloat(_) => "a number",
            kind => return (line, kind.to_string()),
        };
        let at = err.field().map_or(0, |at| at as usize);
        (line, format!("{} is {:?}; expected {expected}", &head[at], &record[at]))
    })
}

fn uneven(error: csv::Error) -> Wrong {
    let line = error.position().map_or(0, |position| position.line());
    match error.kind() {
        ErrorKind::UnequalLengths { expected_len, len, .. } => {
            (line, format!("it has {len} fields; expected {expected_len}"))
        }
        _ => (line, error.to_string()),
    }
}

fn columns<R: Serialize + Default>() -> String {
    lines(&[R::default()]).lines().next().map_or(String::new(), str::to_owned)
}

fn lines<R: Serialize>(rows: &[R]) -> String {
    let line_feed = Terminator::Any(b'\n');
    let mut writer = WriterBuilder::new().terminator(line_feed).from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).expect("a row has texts and numbers only");
    }
    let bytes = writer.into_inner().expect("writing to memory succeeds");
    String::from_utf8(bytes).expect("texts and numbers are UTF-8")
}

/// A text that somebody else chose: escaped as [`apprentice::plain::escape`] has it, no formula.
pub mod text {
    use apprentice::plain;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(text: &impl AsRef<str>, to: S) -> Result<S::Ok, S::Error> {
        let shown = plain::escape(text.as_ref());
        match begins_a_formula(&shown) {
            true => to.collect_str(&format_args!("'{shown}")),
            false => to.serialize_str(&shown),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
        let cell = String::deserialize(from)?;
        match cell.strip_prefix('\'') {
            Some(rest) if begins_a_formula(rest) => Ok(rest.to_owned()),
            _ => Ok(cell),
        }
    }

    /// Whether a text begins, after any apostrophes, as a formula does.
    fn begins_a_formula(text: &str) -> bool {
        let formula =
            ['=', '+', '-', '@', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}', '\t', '\n', '\r'];
        text.trim_start_matches('\'').starts_with(formula)
    }
}

/// 1 or 0.
pub mod bit {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(bit: &bool, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u8(u8::from(*bit))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<bool, D::Error> {
        known(u8::deserialize(from)?)
    }

    pub fn known<E: Error>(number: u8) -> Result<bool, E> {
        match number {
            0 | 1 => Ok(number == 1),
            other => Err(E::custom(format!("{other} is neither 1 nor 0"))),
        }
    }
}

/// 1, 0 or nothing.
pub mod maybe_bit {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::bit::known;

    pub fn serialize<S: Serializer>(bit: &Option<bool>, to: S) -> Result<S::Ok, S::Error> {
        bit.map(u8::from).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<bool>, D::Error> {
        Option::<u8>::deserialize(from)?.map(known).transpose()
    }
}

/// A number with four decimal places.
pub mod decimal {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(&format_args!("{value:.4}"))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        finite(f64::deserialize(from)?)
    }

    pub fn finite<E: Error>(value: f64) -> Result<f64, E> {
        let found = value.is_finite().then_some(value);
        found.ok_or_else(|| E::custom(format!("a number is {value}; expected a finite one")))
    }
}

/// A number with four decimal places, or nothing.
pub mod maybe_decimal {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::decimal::finite;

    pub fn serialize<S: Serializer>(value: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
        value.map(|value| format!("{value:.4}")).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
        Option::<f64>::deserialize(from)?.map(finite).transpose()
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
    struct Row {
        #[serde(with = "text")]
        said: String,
        #[serde(with = "decimal")]
        mean: f64,
        #[serde(with = "maybe_decimal")]
        sd: Option<f64>,
        #[serde(with = "maybe_bit")]
        right: Option<bool>,
        count: u32,
    }

    fn row(said: &str) -> Row {
        Row { said: said.to_owned(), mean: -1.5, sd: None, right: Some(true), count: 7 }
    }

    #[test]
    fn no_text_is_a_formula_and_each_is_read_as_it_was() {
        for (said, cell) in [
            ("put it in the sink", "put it in the sink"),
            ("=1+1", "'=1+1"),
            (
                "=HYPERLINK(\"http://x.example\",\"open\")",
                "\"'=HYPERLINK(\"\"http://x.example\"\",\"\"open\"\")\"",
            ),
            ("+pick up the mug", "'+pick up the mug"),
            ("-put it down", "'-put it down"),
            ("@pick it", "'@pick it"),
            ("\u{ff1d}1+1", "'\u{ff1d}1+1"),
            ("'=1+1", "''=1+1"),
            ("''@", "'''@"),
            ("'tis the mug", "'tis the mug"),
            ("-12", "'-12"),
            ("-", "'-"),
            ("", ""),
            ("a,b \"c\"", "\"a,b \"\"c\"\"\""),
        ] {
            let table = written(&[row(said)]);
            assert_eq!(table, format!("said,mean,sd,right,count\n{cell},-1.5000,,1,7\n"));
            assert_eq!(read(&table), Ok(vec![row(said)]));
        }
        let hidden = written(&[row("\t=1\u{202e}\n")]);
        assert!(hidden.contains("\n\\u{9}=1\\u{202e}\\u{a},"), "{hidden}");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let head = "said,mean,sd,right,count\n";
        let good = format!("{head}\"go,\nnow\",1.5000,0.2500,,3\n");
        let found = read::<Row>(&good.replace('\n', "\r\n")).unwrap();
        assert_eq!((&*found[0].said, found[0].sd), ("go,\r\nnow", Some(0.25)));
        let more = read::<Row>("said,mean,later,sd,right,count\ngo,1,x,2,0,3\n").unwrap();
        assert_eq!((more[0].sd, more[0].right), (Some(2.0), Some(false)));
        assert_eq!(read::<Row>(&written::<Row>(&[])), Ok(vec![]));
        for (text, line, expected) in [
            (String::new(), 1, "the table is empty; expected the columns said,mean,"),
            (good.replace("mean", "average"), 1, "there is no column mean; expected said,mean,"),
            (good.replace("1.5000", "about 2"), 2, "mean is \"about 2\"; expected a number"),
            (good.clone() + "go,1,x,,3\n", 4, "sd is \"x\"; expected a number"),
            (good.clone() + "go,1,,,-3\n", 4, "count is \"-3\"; expected a whole number"),
            (good.replace("1.5000", "NaN"), 2, "a number is NaN; expected a finite one"),
            (good.clone() + "go,1,,2,3\n", 4, "2 is neither 1 nor 0"),
            (good.replace(",0.2500", ""), 2, "it has 4 fields; expected 5"),
        ] {
            let (at, reason) = read::<Row>(&text).unwrap_err();
            assert!(at == line && reason.starts_with(expected), "{at}: {reason}");
        }
    }
}
