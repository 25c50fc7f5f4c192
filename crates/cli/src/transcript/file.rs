use std::path::{Path, PathBuf};

use apprentice::client::Client;
use apprentice::ids::UserId;
use apprentice_study::transcript::{FILE_BYTES_MAX, PlayError, Player, Transcript};

use crate::failure::Failure;
use crate::recipe;

/// A transcript with its place, which other files are named relative to.
#[derive(Debug, Clone, PartialEq)]
pub struct TranscriptFile {
    path: PathBuf,
    transcript: Transcript,
}

/// What came of playing a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlayedFile {
    /// The whole file with its real answers.
    pub text: String,
    /// A unified diff of the answers that differ; none when all agree.
    pub differences: Option<String>,
}

impl TranscriptFile {
    /// - errors: with code 2: no such file, too large, not UTF-8, or no transcript (line, column,
    ///   what was expected).
    pub fn read(path: &Path) -> Result<TranscriptFile, Failure> {
        let name = path.display();
        let unreadable = |error| Failure::bad_input(format!("{name} cannot be read: {error}"));
        let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
        if bytes > FILE_BYTES_MAX {
            return Err(Failure::bad_input(format!(
                "{name} has {bytes} bytes; the limit is {FILE_BYTES_MAX}"
            )));
        }
        let text = std::fs::read_to_string(path).map_err(unreadable)?;
        let transcript = Transcript::parse(&text)
            .map_err(|error| Failure::bad_input(format!("{name}: {error}")))?;
        Ok(TranscriptFile { path: path.to_owned(), transcript })
    }

    /// The name of the file's person, who is nobody of another file: `number` tells them apart.
    pub fn person(&self, number: usize) -> Result<UserId, Failure> {
        let name = self.transcript.user().unwrap_or("person");
        UserId::new(&format!("{name} {number}")).map_err(Failure::bad_input)
    }

    /// The text of the recipe that the file is for; `default` when it names none.
    pub fn recipe_text(&self) -> Result<String, Failure> {
        let name = self.transcript.recipe().unwrap_or("default");
        let beside = self.directory().join(name);
        match beside.is_file() {
            true => recipe::load(&beside.display().to_string()),
            false => recipe::load(name),
        }
    }

    /// Plays the file as the person of `client`, who should be new.
    ///
    /// - errors: with code 2 when the file asks for what cannot be asked, with code 1 when the
    ///   service is gone.
    pub fn play(&self, client: &Client) -> Result<PlayedFile, Failure> {
        let name = self.path.display().to_string();
        let played = Player::new(client, self.directory()).play(&self.transcript);
        let played = played.map_err(|error| {
            let sentence = format!("{name}: {error}");
            match error {
                PlayError::Line { .. } => Failure::bad_input(sentence),
                PlayError::Broken { .. } => Failure::failed(sentence),
            }
        })?;
        Ok(PlayedFile {
            text: self.transcript.with_answers(&played, false),
            differences: self.transcript.differences(&name, &played),
        })
    }

    fn directory(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}
