//! Cells of comma-separated values that a spreadsheet takes for what they are.
//!
//! A spreadsheet computes a cell that begins with `=`, `+`, `-`, `@`, their full-width forms, a tab or
//! a line end (CWE-1236). Such a cell gets an apostrophe in front, as OWASP advises; a negative number
//! is no formula and stays. A text that has apostrophes before such a beginning gets one more, so that
//! [`read`] always finds the text again.

use std::borrow::Cow;

use apprentice::plain;

/// A cell as it stands in a table (RFC 4180): escaped as [`plain::escape`] has it, without a formula,
/// and in quotes where it must be.
pub fn written(text: &str) -> String {
    let shown = plain::escape(text);
    let cell = match begins_a_formula(&shown) && !is_number(&shown) {
        true => Cow::Owned(format!("'{shown}")),
        false => shown,
    };
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into_owned(),
    }
}

/// The text of a cell, once its quotes are taken away.
pub fn read(cell: String) -> String {
    match cell.strip_prefix('\'') {
        Some(rest) if begins_a_formula(rest) => rest.to_owned(),
        _ => cell,
    }
}

/// Whether a text begins, after any apostrophes, as a formula does.
fn begins_a_formula(text: &str) -> bool {
    let formula =
        ['=', '+', '-', '@', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}', '\t', '\n', '\r'];
    text.trim_start_matches('\'').starts_with(formula)
}

/// `-12` or `-0.5000`.
fn is_number(text: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (whole, part) =
        text.strip_prefix('-').map_or(("", None), |rest| match rest.split_once('.') {
            None => (rest, None),
            Some((whole, part)) => (whole, Some(part)),
        });
    digits(whole) && part.is_none_or(digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_is_a_formula_and_each_is_read_as_it_was() {
        for (text, cell) in [
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
            ("-12", "-12"),
            ("-0.5000", "-0.5000"),
            ("-1.", "'-1."),
            ("-1-1", "'-1-1"),
            ("-", "'-"),
            ("", ""),
            ("a,b \"c\"", "\"a,b \"\"c\"\"\""),
        ] {
            let found = written(text);
            assert_eq!(found, cell, "{text:?}");
            let unquoted = match found.strip_prefix('"').and_then(|it| it.strip_suffix('"')) {
                Some(inner) => inner.replace("\"\"", "\""),
                None => found,
            };
            assert_eq!(read(unquoted), text, "{cell:?}");
        }
        assert_eq!(written("\t=1\u{202e}"), "\\u{9}=1\\u{202e}");
    }
}
