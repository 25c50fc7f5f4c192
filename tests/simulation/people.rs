//! What people ask, how often they repeat it, and which answers they got.

use apprentice::client::{Command, OnClash, Phase, Reply};
use apprentice::ids::{RequestId, StreamId, TenantId, UserId};
use apprentice::session::Session;
use apprentice::world::Stage;

use apprentice_testkit::dice::Dice;
use apprentice_testkit::toy::Bells;

/// One person and all their requests, oldest first.
pub struct Person {
    pub tenant: TenantId,
    pub user: UserId,
    pub stream: StreamId,
    /// How often the name was erased.
    pub era: u64,
    pub asked: Vec<Asked>,
}

pub struct Asked {
    pub request: RequestId,
    pub command: Command,
    pub heard: Heard,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Heard {
    Nothing,
    /// An acknowledgement. Nothing may undo it.
    Reply(Reply),
    /// Declined. A refusal is not remembered, so asking again may have another result.
    Rejected,
}

/// The most requests that a person may have under way.
const UNDER_WAY: usize = 3;

const SAYINGS: [&str; 12] = [
    "ring the brass bell",
    "strike the silver bell",
    "mute the glass bell",
    "silence the brass bell",
    "ring it",
    "ring the glass bell and mute the brass bell",
    "polish the brass bell",
    "polish the silver bell",
    "wake everybody with the glass bell",
    "wake everybody with the silver bell",
    "make some noise",
    "",
];

impl Person {
    /// The person was erased. A new person has the name now.
    pub fn start_over(&mut self, stream: StreamId) {
        self.era += 1;
        self.stream = stream;
        self.asked.clear();
    }

    pub fn unanswered(&self) -> Vec<usize> {
        let open = |index: &usize| self.asked[*index].heard == Heard::Nothing;
        (0..self.asked.len()).filter(open).collect()
    }

    /// Asks something. Mostly it fits the state of `session`, which may be old.
    pub fn ask(&mut self, dice: &mut Dice, session: Option<&Session<Bells>>) {
        if self.unanswered().len() >= UNDER_WAY {
            return;
        }
        let mut phase = session.map_or(Phase::Idle, Session::phase);
        if dice.chance(10) {
            phase = *dice.of(&[Phase::Idle, Phase::Interacting, Phase::Teaching]);
        }
        let command = match phase {
            Phase::Idle | Phase::Closed => between(dice, session),
            Phase::Interacting | Phase::Learning => {
                let utterance = (*dice.of(&SAYINGS)).to_owned();
                let done = dice.chance(15);
                if done { Command::Done } else { Command::Say { utterance } }
            }
            Phase::Teaching => teaching(dice, session),
        };
        let mut request = [0; 16];
        request[..8].copy_from_slice(&dice.number().to_be_bytes());
        let request = RequestId(request);
        self.asked.push(Asked { request, command, heard: Heard::Nothing });
    }
}

fn between(dice: &mut Dice, session: Option<&Session<Bells>>) -> Command {
    match dice.below(100) {
        0 => Command::Close { reason: "withdrew".to_owned() },
        1..15 => forget(dice, session),
        15..20 => {
            let task = "Copper".to_owned();
            Command::StartEpisode { stage: Stage::Task { task, seed: 1 } }
        }
        seed => Command::StartEpisode { stage: Stage::Seed { seed: seed as u64 } },
    }
}

fn teaching(dice: &mut Dice, session: Option<&Session<Bells>>) -> Command {
    let status = session.map(Session::status);
    let teachable = status.iter().flat_map(|status| &status.to_teach).collect::<Vec<_>>();
    if teachable.is_empty() || dice.chance(25) {
        return Command::FinishTeaching;
    }
    if dice.chance(10) {
        return forget(dice, session);
    }
    let said = *dice.of(&teachable);
    let have = status.as_ref().map_or(0, |status| status.actions.len() as u32);
    let first = said.actions_before + 1;
    // Sometimes a run that does not exist, or an empty one: nothing that was done.
    let last = first + dice.below(2) as u32;
    let actions =
        if have < first && dice.chance(80) { Vec::new() } else { (first..=last).collect() };
    let on_clash = *dice.of(&[OnClash::Ask, OnClash::Replace, OnClash::Keep]);
    Command::Teach { explains: said.seq, actions, on_clash }
}

fn forget(dice: &mut Dice, session: Option<&Session<Bells>>) -> Command {
    let lessons = session.map_or(&[][..], |session| &session.state().lessons);
    let lesson = match lessons.is_empty() {
        true => apprentice::ids::Seq::FIRST,
        false => dice.of(lessons).seq,
    };
    Command::Forget { lesson }
}
