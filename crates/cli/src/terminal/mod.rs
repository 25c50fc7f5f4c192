//! The conversation in a terminal: read a line, act on it, print what came of it.

mod conversation;
mod input;
mod lines;
mod print;
mod screen;
mod stages;
mod teaching;

use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::SystemTime;

use apprentice::client::Client;

use super::failure::Failure;
use conversation::Conversation;
use lines::{EditedLines, Lines, PipedLines};
use screen::{Screen, Style};
use stages::Stages;

/// Seeds that are made up for whoever names none stay below this, so that they can be typed again.
const MADE_UP_SEEDS: u128 = 1_000_000;

/// Lets the person at standard input talk through `client` until they leave.
///
/// - `tasks`: what the first episodes are about; then tasks are drawn from the seed.
/// - `history`: the file that remembers what was typed at a keyboard.
pub fn talk(
    client: &Client,
    seed: Option<u64>,
    tasks: Vec<String>,
    history: Option<&Path>,
) -> Result<(), Failure> {
    let stages = Stages::new(seed.unwrap_or_else(made_up_seed), tasks);
    let mut stdout = io::stdout();
    if !io::stdin().is_terminal() {
        let mut lines = PipedLines::new(io::stdin());
        let screen = Screen::new(&mut stdout, Style::Lines);
        return converse(client, &mut lines, screen, stages);
    }
    let mut lines = EditedLines::new(history)
        .map_err(|error| Failure::failed(format!("this terminal cannot be used: {error}")))?;
    let screen = Screen::new(&mut stdout, Style::Screen);
    converse(client, &mut lines, screen, stages)
}

fn converse<'a>(
    client: &'a Client,
    lines: &'a mut dyn Lines,
    screen: Screen<'a>,
    stages: Stages,
) -> Result<(), Failure> {
    let user = client.user().as_str();
    Conversation::new(client, lines, screen, stages).run(user)
}

fn made_up_seed() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    (now.as_micros() % MADE_UP_SEEDS) as u64
}
