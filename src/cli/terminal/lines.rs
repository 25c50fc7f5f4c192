use std::io::{self, BufRead};
use std::path::{Path, PathBuf};

use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{Config, Editor};

/// Bytes kept of one line; the rest is read and dropped. Far above what an utterance may have, so
/// that the person hears about their own limit and not about this one.
const LINE_BYTES_MAX: usize = 64 * 1024;
/// Lines remembered in the history file.
const HISTORY_LINES_MAX: usize = 1_000;

/// What came from the person.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Typed {
    Line(String),
    /// A sentence that says why the line cannot be used.
    Unreadable(String),
    End,
}

/// Where lines come from: a person at a keyboard, or a file.
pub trait Lines {
    fn read(&mut self, prompt: &str) -> io::Result<Typed>;

    /// Whether the end is known to have come. A keyboard never knows.
    fn at_end(&mut self) -> io::Result<bool> {
        Ok(false)
    }
}

/// Lines from a file or a pipe.
pub struct PipedLines<R> {
    input: R,
}

impl<R: BufRead> PipedLines<R> {
    pub fn new(input: R) -> PipedLines<R> {
        PipedLines { input }
    }
}

impl<R: BufRead> Lines for PipedLines<R> {
    fn read(&mut self, _prompt: &str) -> io::Result<Typed> {
        let mut bytes = Vec::new();
        let mut dropped = 0;
        loop {
            let chunk = self.input.fill_buf()?;
            if chunk.is_empty() {
                if bytes.is_empty() {
                    return Ok(Typed::End);
                }
                break;
            }
            let newline = chunk.iter().position(|&byte| byte == b'\n');
            let taken = newline.unwrap_or(chunk.len());
            let kept = taken.min(LINE_BYTES_MAX - bytes.len());
            bytes.extend_from_slice(&chunk[..kept]);
            dropped += taken - kept;
            self.input.consume(taken + usize::from(newline.is_some()));
            if newline.is_some() {
                break;
            }
        }
        if dropped > 0 {
            let found = bytes.len() + dropped;
            let max = crate::limits::UTTERANCE_BYTES_MAX;
            return Ok(Typed::Unreadable(format!(
                "that line has {found} bytes; at most {max} are read, so say it in parts"
            )));
        }
        Ok(match String::from_utf8(bytes) {
            Ok(text) => Typed::Line(text),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let byte = error.as_bytes()[at];
                Typed::Unreadable(format!(
                    "that line is not UTF-8 text: byte 0x{byte:02x} at position {}; type plain text",
                    at + 1
                ))
            }
        })
    }

    fn at_end(&mut self) -> io::Result<bool> {
        Ok(self.input.fill_buf()?.is_empty())
    }
}

/// Lines from a keyboard, with editing and a history that outlives the program.
pub struct EditedLines {
    editor: Editor<(), FileHistory>,
    history: Option<PathBuf>,
}

impl EditedLines {
    /// - `history`: the file that remembers; none when there is no place for one.
    pub fn new(history: Option<&Path>) -> Result<EditedLines, ReadlineError> {
        let config = Config::builder().max_history_size(HISTORY_LINES_MAX)?.build();
        let remembered = FileHistory::with_config(&config);
        let mut editor = Editor::with_history(config, remembered)?;
        if let Some(path) = history {
            // A first start has no file yet, and a damaged one is no reason not to talk.
            let _ = editor.load_history(path);
        }
        Ok(EditedLines { editor, history: history.map(Path::to_owned) })
    }
}

impl Lines for EditedLines {
    fn read(&mut self, prompt: &str) -> io::Result<Typed> {
        match self.editor.readline(prompt) {
            Ok(line) => {
                // Losing the history must not lose the conversation.
                let _ = self.editor.add_history_entry(line.as_str());
                if let Some(path) = &self.history {
                    let _ = self.editor.save_history(path);
                }
                Ok(Typed::Line(line))
            }
            // Ctrl-C drops the line being typed, as in a shell; Ctrl-D ends the conversation.
            Err(ReadlineError::Interrupted) => Ok(Typed::Line(String::new())),
            Err(ReadlineError::Eof) => Ok(Typed::End),
            Err(ReadlineError::Io(error)) => Err(error),
            Err(error) => Err(io::Error::other(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(bytes: &[u8]) -> Vec<Typed> {
        let mut lines = PipedLines::new(bytes);
        let mut read = Vec::new();
        loop {
            match lines.read("").unwrap() {
                Typed::End => return read,
                typed => read.push(typed),
            }
        }
    }

    #[test]
    fn piped_lines_are_read_one_by_one_with_or_without_a_last_newline() {
        let line = |text: &str| Typed::Line(text.to_owned());
        assert_eq!(read_all(b"a\n\nb"), [line("a"), line(""), line("b")]);
        assert_eq!(read_all(b"a\n"), [line("a")]);
        assert!(PipedLines::new(&b""[..]).at_end().unwrap());
        assert!(!PipedLines::new(&b"x"[..]).at_end().unwrap());
    }

    #[test]
    fn a_line_that_is_no_text_says_where_and_the_next_one_is_read() {
        let read = read_all(b"go \xff\nnext\n");
        let Typed::Unreadable(sentence) = &read[0] else { panic!("{read:?}") };
        assert!(sentence.contains("byte 0xff at position 4"), "{sentence}");
        assert_eq!(read[1], Typed::Line("next".into()));
    }

    #[test]
    fn an_enormous_line_is_counted_and_not_kept() {
        let mut bytes = vec![b'a'; 3_000_000];
        bytes.extend_from_slice(b"\nnext\n");
        let read = read_all(&bytes);
        let Typed::Unreadable(sentence) = &read[0] else { panic!("{:?}", read[0]) };
        assert!(sentence.contains("3000000 bytes"), "{sentence}");
        assert_eq!(read[1], Typed::Line("next".into()));
    }
}
