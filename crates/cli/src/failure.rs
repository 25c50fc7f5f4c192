use std::fmt;
use std::process::ExitCode;

use apprentice::plain;

/// Why the program ends with another code than 0: the code and, where one is left to say, one
/// sentence for standard error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    code: u8,
    sentence: Option<String>,
}

impl Failure {
    /// Code 1: it was tried and went wrong.
    pub fn failed(sentence: impl fmt::Display) -> Failure {
        Failure { code: 1, sentence: Some(sentence.to_string()) }
    }

    /// Code 1 with nothing more to say: the differences were printed already.
    pub fn differences() -> Failure {
        Failure { code: 1, sentence: None }
    }

    /// Code 2: the arguments, a file or a directory that they name cannot be used.
    pub fn bad_input(sentence: impl fmt::Display) -> Failure {
        Failure { code: 2, sentence: Some(sentence.to_string()) }
    }

    /// Prints the sentence and gives the code.
    pub fn report(self) -> ExitCode {
        if let Some(sentence) = &self.sentence {
            // Further lines are indented: none of them looks like another message.
            let sentence = plain::escape_lines(sentence).replace('\n', "\n  ");
            eprintln!("apprentice: {sentence}");
        }
        ExitCode::from(self.code)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.sentence.as_deref().unwrap_or("differences were found"))
    }
}
