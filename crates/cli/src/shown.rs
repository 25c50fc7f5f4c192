//! Texts as they are shown. What was recorded, or came from elsewhere, may hold characters that end a
//! line or drive a terminal; no command writes them as they are (`plain`).

use apprentice::plain;

/// Lines for a person, each with its end: whatever they hold, there are as many as were given.
pub fn lines(lines: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    lines.into_iter().map(|line| plain::escape(line.as_ref()).into_owned() + "\n").collect()
}

/// A value as one line of JSON, without its end.
pub fn json(value: &serde_json::Value) -> String {
    plain::escape_json(&value.to_string()).into_owned()
}

/// A value as JSON of several lines, without the last one's end.
pub fn json_pretty(value: &impl serde::Serialize) -> String {
    let text = serde_json::to_string_pretty(value);
    let text = text.expect("a report has text keys and finite numbers");
    plain::escape_json(&text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_lines_are_shown_as_were_given() {
        assert_eq!(lines(["a\nb", "c\u{1b}[2J"]), "a\\u{a}b\nc\\u{1b}[2J\n");
        assert_eq!(json(&"\u{202e}\n".into()), "\"\\u202e\\n\"");
        assert_eq!(json_pretty(&["\u{9b}"]), "[\n  \"\\u009b\"\n]");
    }
}
