use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::thread;
use std::time::Duration;

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

/// How long the end of a pipe may take to show itself when nothing is left to read. A file's end
/// is known at once; a program at the other end that waits for us waits this much longer.
const END_SHOWS: Duration = Duration::from_millis(250);
/// Bytes of one read, and reads that wait to be used: a fast writer waits for us, not in memory.
const CHUNK_BYTES: usize = 16 * 1024;
const CHUNKS_WAITING: usize = 4;

/// Lines from a file or a pipe, read ahead on a thread of their own: whether the input has ended
/// can then be asked without waiting for a writer that waits for us.
pub struct PipedLines {
    chunks: Receiver<io::Result<Vec<u8>>>,
    /// What was received and not yet used.
    chunk: Vec<u8>,
    used: usize,
    ended: bool,
}

impl PipedLines {
    pub fn new(input: impl Read + Send + 'static) -> PipedLines {
        let (sender, chunks) = mpsc::sync_channel(CHUNKS_WAITING);
        // Never joined: it ends with the input, or with the process.
        thread::spawn(move || read_ahead(input, &sender));
        PipedLines { chunks, chunk: Vec::new(), used: 0, ended: false }
    }

    /// The bytes received and not yet used; waits for some until `limit`, or as long as it takes.
    ///
    /// - returns: none at the end of input, and when there was nothing within `limit`.
    fn available(&mut self, limit: Option<Duration>) -> io::Result<Option<&[u8]>> {
        while self.used == self.chunk.len() {
            if self.ended {
                return Ok(None);
            }
            let received = match limit {
                None => self.chunks.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(limit) => self.chunks.recv_timeout(limit),
            };
            match received {
                Ok(chunk) => (self.chunk, self.used) = (chunk?, 0),
                Err(RecvTimeoutError::Disconnected) => self.ended = true,
                Err(RecvTimeoutError::Timeout) => return Ok(None),
            }
        }
        Ok(Some(&self.chunk[self.used..]))
    }
}

/// Sends what it reads until the input ends, fails, or nobody listens.
fn read_ahead(mut input: impl Read, sender: &SyncSender<io::Result<Vec<u8>>>) {
    let mut buffer = vec![0; CHUNK_BYTES];
    loop {
        let read = match input.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => Ok(buffer[..count].to_vec()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => Err(error),
        };
        let failed = read.is_err();
        if sender.send(read).is_err() || failed {
            return;
        }
    }
}

impl Lines for PipedLines {
    fn read(&mut self, _prompt: &str) -> io::Result<Typed> {
        let mut bytes = Vec::new();
        let (mut found, mut started) = (0, false);
        while let Some(available) = self.available(None)? {
            started = true;
            let newline = available.iter().position(|&byte| byte == b'\n');
            let taken = newline.unwrap_or(available.len());
            let kept = taken.min(LINE_BYTES_MAX - bytes.len());
            bytes.extend_from_slice(&available[..kept]);
            found += taken;
            self.used += taken + usize::from(newline.is_some());
            if newline.is_some() {
                break;
            }
        }
        if !started {
            return Ok(Typed::End);
        }
        if found > bytes.len() {
            let max = apprentice::limits::UTTERANCE_BYTES_MAX;
            return Ok(Typed::Unreadable(format!(
                "That line has {found} bytes. The limit is {max}. Say it in parts."
            )));
        }
        Ok(match String::from_utf8(bytes) {
            Ok(text) => Typed::Line(text),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let byte = error.as_bytes()[at];
                Typed::Unreadable(format!(
                    "That line is not UTF-8 text: byte 0x{byte:02x} at position {}. Type plain text.",
                    at + 1
                ))
            }
        })
    }

    fn at_end(&mut self) -> io::Result<bool> {
        let nothing = self.available(Some(END_SHOWS))?.is_none();
        Ok(nothing && self.ended)
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

    fn read_all(bytes: &'static [u8]) -> Vec<Typed> {
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
        let read = read_all(bytes.leak());
        let Typed::Unreadable(sentence) = &read[0] else { panic!("{:?}", read[0]) };
        assert!(sentence.contains("3000000 bytes"), "{sentence}");
        assert_eq!(read[1], Typed::Line("next".into()));
    }

    #[test]
    fn a_writer_that_waits_for_us_is_not_waited_for() {
        let (reader, mut writer) = io::pipe().unwrap();
        let mut lines = PipedLines::new(reader);
        assert!(!lines.at_end().unwrap());
        io::Write::write_all(&mut writer, b"go\n").unwrap();
        assert!(!lines.at_end().unwrap());
        assert_eq!(lines.read("").unwrap(), Typed::Line("go".into()));
        drop(writer);
        assert_eq!(lines.read("").unwrap(), Typed::End);
        assert!(lines.at_end().unwrap());
    }
}
