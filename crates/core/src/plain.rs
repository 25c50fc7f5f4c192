//! The characters that can make a text look like another: [`check`] refuses them in texts that come
//! in, [`escape`] shows them in texts that go out.
//!
//! A *hidden* character cannot be seen, ends a line, controls a terminal or reverses the order of
//! others: control characters (C0, DEL, C1), line and paragraph separators, marks of writing
//! direction, characters without width, fillers, annotations, tags and noncharacters.
//!
//! Two kinds are needed, and are hidden only in the wrong place:
//! - joiners (U+200C, U+200D), which hold emoji together and shape Persian and Indic scripts, may
//!   stand between two visible characters that are not ASCII;
//! - variation selectors may follow one visible character that is not ASCII, or a digit, `#` or
//!   `*`.
//!
//! Every other character is plain, in every script, and neither function changes it.

use std::borrow::Cow;
use std::fmt::Write;

/// A hidden character in a text that should be plain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "character {place} is U+{:04X}, which is invisible or changes how the text looks; leave it out",
    u32::from(*found)
)]
pub struct Hidden {
    /// The character.
    pub found: char,
    /// Counted in characters, from 1.
    pub place: usize,
}

/// Checks one line of text that comes from outside.
///
/// - errors: the first hidden character; a line feed and a tab count as hidden.
pub fn check(text: &str) -> Result<(), Hidden> {
    first_hidden(text, |_| false)
}

/// Checks a text of several lines, such as a scene file: line ends and tabs are allowed.
///
/// - errors: the first hidden character.
pub fn check_lines(text: &str) -> Result<(), Hidden> {
    first_hidden(text, |c| matches!(c, '\n' | '\r' | '\t'))
}

/// The text as one line that is safe to show: each hidden character is written as `\u{202e}`. A
/// plain text stays as it is.
pub fn escape(text: &str) -> Cow<'_, str> {
    escape_but(text, |_| false, rust_form)
}

/// As [`escape`], for a text of several lines: line feeds and tabs stay.
pub fn escape_lines(text: &str) -> Cow<'_, str> {
    escape_but(text, |c| matches!(c, '\n' | '\t'), rust_form)
}

/// As [`escape`], for a JSON text: hidden characters become `\u202e`, which every reader of JSON
/// takes for the same character. Line feeds and tabs between values stay.
pub fn escape_json(json: &str) -> Cow<'_, str> {
    escape_but(json, |c| matches!(c, '\n' | '\t'), json_form)
}

/// The text with U+FFFD in the place of each hidden character. It has as many words and clause
/// marks as before, and [`check`] accepts it.
pub fn replace(text: &str) -> Cow<'_, str> {
    escape_but(text, |_| false, |out, _| out.push('\u{fffd}'))
}

fn rust_form(out: &mut String, c: char) {
    out.extend(c.escape_unicode());
}

fn json_form(out: &mut String, c: char) {
    for unit in c.encode_utf16(&mut [0; 2]) {
        write!(out, "\\u{unit:04x}").expect("writing to a string succeeds");
    }
}

fn first_hidden(text: &str, welcome: impl Fn(char) -> bool) -> Result<(), Hidden> {
    let found = around(text)
        .enumerate()
        .find(|(_, (before, c, after))| !welcome(*c) && is_hidden(*before, *c, *after));
    match found {
        Some((index, (_, found, _))) => Err(Hidden { found, place: index + 1 }),
        None => Ok(()),
    }
}

fn escape_but(
    text: &str,
    stays: impl Fn(char) -> bool,
    form: impl Fn(&mut String, char),
) -> Cow<'_, str> {
    let hidden = |before, c, after| !stays(c) && is_hidden(before, c, after);
    // Most texts are plain, and many are long.
    if text.is_ascii() && !text.bytes().any(|byte| hidden(None, char::from(byte), None)) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    let mut changed = false;
    for (before, c, after) in around(text) {
        match hidden(before, c, after) {
            true => form(&mut out, c),
            false => out.push(c),
        }
        changed |= hidden(before, c, after);
    }
    if changed { Cow::Owned(out) } else { Cow::Borrowed(text) }
}

/// Each character with its neighbours.
fn around(text: &str) -> impl Iterator<Item = (Option<char>, char, Option<char>)> {
    let mut before = None;
    let mut chars = text.chars().peekable();
    std::iter::from_fn(move || {
        let c = chars.next()?;
        Some((before.replace(c), c, chars.peek().copied()))
    })
}

fn is_hidden(before: Option<char>, c: char, after: Option<char>) -> bool {
    if is_joiner(c) {
        let joins = |c: char| !c.is_ascii() && !c.is_whitespace() && !is_never_plain(c);
        return !(before.is_some_and(|c| joins(c) && !is_joiner(c))
            && after.is_some_and(|c| joins(c) && !is_joiner(c) && !is_selector(c)));
    }
    if is_selector(c) {
        let varies = |c: char| match c {
            '0'..='9' | '#' | '*' => true,
            c if c.is_ascii() || c.is_whitespace() => false,
            c => !is_joiner(c) && !is_selector(c) && !is_never_plain(c),
        };
        return !before.is_some_and(varies);
    }
    is_never_plain(c)
}

fn is_joiner(c: char) -> bool {
    matches!(c, '\u{200c}' | '\u{200d}')
}

fn is_selector(c: char) -> bool {
    matches!(c, '\u{180b}'..='\u{180d}' | '\u{180f}' | '\u{fe00}'..='\u{fe0f}')
        || matches!(c, '\u{e0100}'..='\u{e01ef}')
}

/// Source: the Unicode property Default_Ignorable_Code_Point, without joiners and selectors; the
/// categories Cc, Zl and Zp; the marks of UAX #9; interlinear annotation; noncharacters.
fn is_never_plain(c: char) -> bool {
    let ignorable = matches!(
        c,
        '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}'
            | '\u{180e}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{feff}' | '\u{ffa0}'
            | '\u{fff0}'..='\u{fffb}' | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}'
            | '\u{e0000}'..='\u{e00ff}' | '\u{e01f0}'..='\u{e0fff}'
    );
    let no_character = matches!(c, '\u{fdd0}'..='\u{fdef}') || u32::from(c) & 0xfffe == 0xfffe;
    c.is_control() || ignorable || no_character
}

/// `1 action`, `2 actions`.
pub fn count(number: impl Into<u64>, noun: &str) -> String {
    match number.into() {
        1 => format!("1 {noun}"),
        n => format!("{n} {noun}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One of each kind, with a name for the failure message.
    const HOSTILE: [(&str, char); 24] = [
        ("null", '\0'),
        ("tab", '\t'),
        ("line feed", '\n'),
        ("carriage return", '\r'),
        ("escape", '\u{1b}'),
        ("delete", '\u{7f}'),
        ("next line", '\u{85}'),
        ("control sequence introducer of C1", '\u{9b}'),
        ("soft hyphen", '\u{ad}'),
        ("Arabic letter mark", '\u{61c}'),
        ("zero width space", '\u{200b}'),
        ("left-to-right mark", '\u{200e}'),
        ("right-to-left mark", '\u{200f}'),
        ("line separator", '\u{2028}'),
        ("paragraph separator", '\u{2029}'),
        ("embedding", '\u{202a}'),
        ("override", '\u{202e}'),
        ("word joiner", '\u{2060}'),
        ("isolate", '\u{2066}'),
        ("end of isolate", '\u{2069}'),
        ("byte order mark", '\u{feff}'),
        ("annotation", '\u{fff9}'),
        ("noncharacter", '\u{1ffff}'),
        ("tag", '\u{e0041}'),
    ];

    #[test]
    fn what_forges_is_refused_with_its_place_and_shown_on_one_line() {
        for (name, c) in HOSTILE {
            let text = format!("pick é{c}up");
            assert_eq!(check(&text), Err(Hidden { found: c, place: 7 }), "{name}");
            let shown = escape(&text);
            assert_eq!(shown, format!("pick é\\u{{{:x}}}up", u32::from(c)), "{name}");
            assert_eq!(check(&shown), Ok(()), "{name}: {shown}");
            assert_eq!(check(&replace(&text)), Ok(()), "{name}");
        }
        let sentence = check("a\u{202e}b").unwrap_err().to_string();
        assert!(sentence.starts_with("character 2 is U+202E, "), "{sentence}");
    }

    #[test]
    fn plain_text_of_any_script_stays_as_it_is() {
        for text in [
            "",
            "put the mug in the fridge; don't \\u{202e} \"wash\" it",
            "Ünïcödé",
            "e\u{301}",
            "שטוף את הספל",
            "اغسل الكوب",
            "می\u{200c}خواهم",
            "क्\u{200d}ष",
            "洗杯子\u{3000}마그컵 แก้ว",
            "👩\u{200d}👩\u{200d}👧 🏳\u{fe0f}\u{200d}🌈 ❤\u{fe0f} 1\u{fe0f}\u{20e3} 👍🏽 🇩🇪",
            "葛\u{e0100}城",
            "a\u{a0}b",
            "U+FFFD \u{fffd}",
        ] {
            assert_eq!(check(text), Ok(()), "{text:?}");
            for shown in [escape(text), escape_lines(text), escape_json(text), replace(text)] {
                assert!(matches!(shown, Cow::Borrowed(same) if same == text), "{text:?}");
            }
        }
    }

    #[test]
    fn joiners_and_selectors_are_hidden_where_they_join_and_change_nothing() {
        for (text, place) in [
            ("mu\u{200d}g", 3),
            ("mug\u{200d}", 4),
            ("\u{200d}👧", 1),
            ("👧\u{200d}", 2),
            ("👧\u{200d}\u{200d}👧", 2),
            ("é\u{200c} é", 2),
            ("mug\u{fe0f}", 4),
            ("❤\u{fe0f}\u{fe0f}", 3),
            ("\u{fe0f}", 1),
            ("é\u{e0100}\u{e0101}", 3),
        ] {
            assert_eq!(check(text).unwrap_err().place, place, "{text:?}");
            assert_eq!(check(&escape(text)), Ok(()), "{text:?}");
        }
    }

    #[test]
    fn what_a_keyboard_types_is_plain_and_every_control_character_is_not() {
        for number in 0..=0xff_u32 {
            let c = char::from_u32(number).unwrap();
            let plain = !c.is_control() && number != 0xad;
            assert_eq!(check(&c.to_string()).is_ok(), plain, "U+{number:04X}");
        }
    }

    #[test]
    fn several_lines_keep_their_ends_and_nothing_else() {
        assert_eq!(escape_lines("a\n\tb\r\u{2028}c"), "a\n\tb\\u{d}\\u{2028}c");
        assert_eq!(check_lines("room = 1\r\n\tx = 2\n"), Ok(()));
        assert_eq!(check_lines("a\nb\u{1b}").unwrap_err().place, 4);
    }

    #[test]
    fn a_json_text_says_the_same_afterwards() {
        let value = serde_json::json!({"reason": "a\u{1b}\u{9b}8m\u{2028}\u{202e}\u{e0041}\n\"b"});
        for json in [value.to_string(), format!("{value:#}")] {
            let shown = escape_json(&json);
            assert_eq!(check_lines(&shown), Ok(()), "{shown}");
            assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
        }
    }
}
