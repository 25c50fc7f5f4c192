//! One person's records, turn by turn: what was answered, and what would have been.

use std::sync::Arc;

use apprentice::events::{Event, Interpreted, Record};
use apprentice::grounding::Moment;
use apprentice::ids::{Seq, StreamId, TenantId, UserId};
use apprentice::language::{Answer, Outcome, Symbol};
use apprentice::parallel::Progress;
use apprentice::session::Session;
use apprentice::store::{ReadError, Store};
use apprentice::world::Domain;

use super::configuration::{Other, Variant};
use super::minds::{BaseMinds, MindCounts, OtherMinds, RecordedMinds};

/// Everything that happened to one person, and what would have in each variant.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    pub tenant: TenantId,
    pub user: UserId,
    /// The recipe that was recorded.
    pub recipe: String,
    pub recipe_digest: apprentice::ids::Digest,
    pub episodes: Vec<Episode>,
    /// The lessons that were live at the end.
    pub live: Vec<Taught>,
    pub minds: MindCounts,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Episode {
    /// Counted from 1.
    pub number: u32,
    pub goal: String,
    /// The fewest primitives that reach the goal, where the planner found them.
    pub fewest: Option<u32>,
    pub turns: Vec<Turn>,
    /// For each variant the index of the first turn whose action differs. Up to it and including
    /// it, the moments are those that the variant would have met.
    pub ends: Vec<Option<usize>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    pub seq: Seq,
    pub utterance: String,
    pub recorded: Outcome,
    /// One for each variant.
    pub others: Vec<Outcome>,
}

/// A recorded lesson.
#[derive(Debug, Clone, PartialEq)]
pub struct Taught {
    pub explains: Seq,
    pub utterance: String,
    pub program: apprentice::language::Program,
}

impl Episode {
    /// Whether the turn is one that the variant would have met.
    pub fn is_closed(&self, variant: usize, turn: usize) -> bool {
        self.ends[variant].is_none_or(|end| turn <= end)
    }
}

/// Why a person's stream is left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gap {
    /// None when the first record cannot be read.
    pub user: Option<UserId>,
    /// A sentence.
    pub reason: String,
    /// Whether nothing is wrong: the person was erased, or has nothing that could be another.
    pub expected: bool,
}

/// One variant on its way through a stream.
struct Asked<D: Domain> {
    minds: Way<D>,
    /// What the variant would take "it" for, as long as the loop is closed; then what was recorded.
    mentioned: Option<Symbol>,
}

enum Way<D: Domain> {
    Threshold(f32),
    Recipe(Box<OtherMinds<D>>),
}

pub(super) struct Walker<'a, D: Domain> {
    pub domain: &'a Arc<D>,
    pub store: &'a Store,
    pub variants: &'a [Variant],
    pub bases: &'a BaseMinds,
    pub progress: &'a dyn Progress,
}

/// Where the walk stands.
struct Here<D: Domain> {
    session: Session<D>,
    asked: Vec<Asked<D>>,
    recorded: RecordedMinds,
    episodes: Vec<Episode>,
    taught: Vec<(Seq, Taught)>,
    minds: MindCounts,
}

impl<D: Domain> Walker<'_, D> {
    pub fn walk(&self, stream: &StreamId) -> Result<Life, Gap> {
        let way = |variant: &Variant| match &variant.other {
            Other::Threshold(tau) => Way::Threshold(*tau),
            Other::Recipe(recipe) => Way::Recipe(Box::new(OtherMinds::new((**recipe).clone()))),
        };
        let asked = |variant| Asked { minds: way(variant), mentioned: None };
        let mut here = Here {
            session: Session::new(self.domain.clone()),
            asked: self.variants.iter().map(asked).collect(),
            recorded: RecordedMinds::default(),
            episodes: Vec::new(),
            taught: Vec::new(),
            minds: MindCounts::default(),
        };
        let mut read = 0;
        let walked = self.records(stream, &mut here, &mut read);
        let total = self.store.log.head(stream).map_or(read, |head| head.seq);
        self.progress.advance(total.saturating_sub(read));
        let opened = here.session.state().opened.as_ref();
        let user = opened.map(|opened| opened.user.clone());
        if let Err((reason, expected)) = walked {
            return Err(Gap { user, reason, expected });
        }
        let Some(opened) = opened else {
            let reason = "the stream has no record".to_owned();
            return Err(Gap { user, reason, expected: true });
        };
        let is_live = |seq: &Seq| here.session.state().lessons.iter().any(|live| live.seq == *seq);
        let live = here.taught.iter().filter(|(seq, _)| is_live(seq));
        Ok(Life {
            tenant: stream.tenant.clone(),
            user: opened.user.clone(),
            recipe: opened.recipe.clone(),
            recipe_digest: opened.recipe_digest,
            live: live.map(|(_, taught)| taught.clone()).collect(),
            episodes: here.episodes,
            minds: here.minds,
        })
    }

    /// - errors: a sentence, and whether it is no more than to be expected.
    fn records(
        &self,
        stream: &StreamId,
        here: &mut Here<D>,
        read: &mut u64,
    ) -> Result<(), (String, bool)> {
        let unreadable = |error: ReadError| match error {
            ReadError::Erased => ("the person was erased".to_owned(), true),
            other => (other.to_string(), false),
        };
        for record in self.store.log.read(stream, Seq::FIRST).map_err(unreadable)? {
            let record = record.map_err(unreadable)?;
            if let Event::Interpreted(event) = &record.event {
                self.ask(stream, here, &record, event)?;
            }
            here.session.apply(&record).map_err(|error| {
                let reason = format!("{error}; was it recorded by another version of apprentice?");
                (reason, false)
            })?;
            self.note(here, &record)?;
            *read += 1;
            self.progress.advance(1);
        }
        Ok(())
    }

    /// What a record that was applied means for the walk.
    fn note(&self, here: &mut Here<D>, record: &Record) -> Result<(), (String, bool)> {
        for asked in &mut here.asked {
            if let Way::Recipe(minds) = &mut asked.minds {
                minds.note(&here.session, record);
            }
        }
        match &record.event {
            Event::SessionOpened(event) if !here.session.knows_its_recipe() => {
                let reason = format!("its recipe {:?} cannot be read", event.recipe);
                Err((reason, false))
            }
            Event::EpisodeStarted(event) => {
                here.asked.iter_mut().for_each(|asked| asked.mentioned = None);
                here.episodes.push(Episode {
                    number: here.session.state().episodes,
                    goal: event.goal.clone(),
                    fewest: event.fewest,
                    turns: Vec::new(),
                    ends: vec![None; self.variants.len()],
                });
                Ok(())
            }
            Event::DecompositionTaught(event) => {
                let taught = Taught {
                    explains: event.explains,
                    utterance: event.utterance.to_string(),
                    program: event.program.clone(),
                };
                here.taught.push((record.seq, taught));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Asks every variant what was said, at the moment at which it was said.
    fn ask(
        &self,
        stream: &StreamId,
        here: &mut Here<D>,
        record: &Record,
        event: &Interpreted,
    ) -> Result<(), (String, bool)> {
        let misplaced = || ("an utterance stands outside every episode".to_owned(), false);
        let state = here.session.state();
        let scene = state.episode.as_ref().ok_or_else(misplaced)?;
        let told = here.episodes.last_mut().ok_or_else(misplaced)?;
        let place = told.turns.len();
        let mut others = Vec::with_capacity(here.asked.len());
        for (variant, asked) in here.asked.iter_mut().enumerate() {
            let closed = told.ends[variant].is_none();
            let mentioned = if closed { &asked.mentioned } else { &scene.mentioned };
            let handled = scene.handled();
            let moment = Moment {
                domain: &**self.domain,
                scene: &*scene.scene,
                task: &*scene.task,
                mentioned: mentioned.as_ref(),
                handled: &handled,
            };
            let said = &event.utterance;
            let answer = match &mut asked.minds {
                Way::Threshold(tau) => {
                    let mind = here.recorded.get(
                        &here.session,
                        self.store,
                        stream,
                        self.bases,
                        &mut here.minds,
                    );
                    let mind = mind.map_err(|reason| (reason, false))?;
                    mind.interpret_within(moment, said, *tau).ok_or_else(|| {
                        let name = here.session.recipe().name();
                        (format!("minds of the recipe {name} have no threshold"), true)
                    })?
                }
                Way::Recipe(minds) => {
                    let mind = minds.get(&**self.domain, self.bases, &mut here.minds);
                    mind.map_err(|reason| (reason, false))?.interpret(moment, said)
                }
            };
            if closed && action(&answer.outcome) != action(&event.answer.outcome) {
                told.ends[variant] = Some(place);
            }
            let Answer { outcome, mentioned, .. } = answer;
            if mentioned.is_some() {
                asked.mentioned = mentioned;
            }
            others.push(outcome);
        }
        told.turns.push(Turn {
            seq: record.seq,
            utterance: event.utterance.to_string(),
            recorded: event.answer.outcome.clone(),
            others,
        });
        Ok(())
    }
}

/// What an answer does to the world: the program that is carried out, with what it acts on.
fn action(outcome: &Outcome) -> Option<(&apprentice::language::Program, &[Vec<String>])> {
    match outcome {
        // A program without a step does nothing, as no program does.
        Outcome::Understood { program, bindings } if !program.steps.is_empty() => {
            Some((program, bindings))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_carried_out_is_an_action() {
        let understood = |program: &str| Outcome::Understood {
            program: program.parse().unwrap(),
            bindings: vec![vec!["mug 1".to_owned()]],
        };
        let impossible = Outcome::Impossible {
            program: "GOTO Mug".parse().unwrap(),
            step: 0,
            reason: "there is none".to_owned(),
        };
        let idle = Outcome::Understood {
            program: apprentice::language::Program { steps: Vec::new() },
            bindings: Vec::new(),
        };
        assert_eq!(action(&impossible), action(&Outcome::NotSure));
        assert_eq!(action(&idle), action(&Outcome::NotSure));
        assert_ne!(action(&understood("GOTO Mug")), action(&Outcome::NotSure));
        assert_ne!(action(&understood("GOTO Mug")), action(&understood("OPEN Mug")));
    }

    #[test]
    fn the_turn_that_differs_is_the_last_of_the_closed_loop() {
        let episode = Episode {
            number: 1,
            goal: String::new(),
            fewest: None,
            turns: Vec::new(),
            ends: vec![Some(2), None],
        };
        let closed = |variant| (0..5).map(|turn| episode.is_closed(variant, turn)).collect();
        let (first, second): (Vec<bool>, Vec<bool>) = (closed(0), closed(1));
        assert_eq!(first, [true, true, true, false, false]);
        assert_eq!(second, [true; 5]);
    }
}
