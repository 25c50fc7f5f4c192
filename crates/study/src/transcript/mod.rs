//! The notation of transcripts: conversations written down, with their answers or with what was
//! meant. `docs/transcripts.md` is the grammar.

mod compare;
mod line;
mod parse;
mod play;

pub use line::{Act, Answer, Kind, Line, Request, Setting, Transcript};
pub use parse::SyntaxError;
pub use play::{PlayError, Played, Player, show};

/// Bytes of a transcript file. A story of five hundred utterances has under 100 kB.
pub const FILE_BYTES_MAX: u64 = 4 * 1024 * 1024;
