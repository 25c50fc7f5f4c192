//! What a participant notes: one line of JSON for each finished episode. A line that a kill cut
//! short is no line: its episode is asked for again, under the same request ids.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::measures::Entry;
use crate::participant::Person;

/// A finished episode, and the person as it left them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    #[serde(flatten)]
    pub entry: Entry,
    /// None for recorded people, who take nothing along.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<Person>,
}

/// One participant's journal in one condition.
pub struct Journal {
    path: PathBuf,
    lines: Vec<Line>,
}

impl Journal {
    /// Opens the journal of a participant, by number, and drops what a kill cut short.
    pub fn open(out: &Path, condition: &str, number: usize) -> io::Result<Journal> {
        let folder = out.join("journal").join(condition);
        fs::create_dir_all(&folder)?;
        let path = folder.join(format!("{number:05}.jsonl"));
        let text = match fs::read(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(error),
        };
        let mut lines: Vec<Line> = Vec::new();
        let mut kept = 0;
        for line in text.split_inclusive(|byte| *byte == b'\n') {
            let whole = line.ends_with(b"\n");
            match serde_json::from_slice::<Line>(line) {
                Ok(read) if whole && read.entry.episode as usize == lines.len() + 1 => {
                    lines.push(read);
                    kept += line.len();
                }
                _ => break,
            }
        }
        if kept < text.len() {
            OpenOptions::new().write(true).open(&path)?.set_len(kept as u64)?;
        }
        Ok(Journal { path, lines })
    }

    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Notes a finished episode; it is on the disk when this returns.
    pub fn note(&mut self, line: Line) -> io::Result<()> {
        let mut text = serde_json::to_vec(&line).expect("journal lines have text keys");
        text.push(b'\n');
        let mut file: File = OpenOptions::new().create(true).append(true).open(&self.path)?;
        file.write_all(&text)?;
        file.sync_data()?;
        self.lines.push(line);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(episode: u32) -> Line {
        let entry = Entry { episode, task_type: "cool".into(), recorded: None, turns: Vec::new() };
        Line { entry, person: None }
    }

    #[test]
    fn a_line_cut_short_is_dropped_and_written_anew() {
        let out = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(out.path(), "paper", 3).unwrap();
        journal.note(line(1)).unwrap();
        journal.note(line(2)).unwrap();
        let whole = fs::read(&journal.path).unwrap();
        for length in 0..whole.len() {
            fs::write(&journal.path, &whole[..length]).unwrap();
            let mut again = Journal::open(out.path(), "paper", 3).unwrap();
            let kept = again.lines().len() as u32;
            assert!(kept < 2, "{length} bytes");
            for episode in kept + 1..=2 {
                again.note(line(episode)).unwrap();
            }
            assert_eq!(fs::read(&journal.path).unwrap(), whole, "{length} bytes");
        }
    }
}
