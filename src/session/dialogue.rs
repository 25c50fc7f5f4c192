//! What an utterance is in a conversation, before it is taken for a request: an answer to the open
//! question, "that was wrong", or a question of the person.

use super::Session;
use super::state::{Act, Episode, OpenQuestion};
use crate::dialogue::{self, About, Heard, Known};
use crate::ids::Seq;
use crate::language::{Answer, Choice, Discarded, Evidence, Outcome, Utterance};
use crate::world::Domain;

/// Why a reading is not taken that the person called wrong, in [`Evidence::discarded`].
pub const CALLED_WRONG: &str = "you said that this was wrong";

/// What is to come of an utterance.
pub(super) enum Said {
    /// The mind is asked.
    Request,
    /// The last act is marked as wrong.
    Wrong,
    /// This answer, whatever the mind would say.
    Answer(Box<Answer>),
}

/// Reads an utterance as a part of the conversation, where the recipe has one.
pub(super) fn hear<D: Domain>(
    session: &Session<D>,
    episode: &Episode<D::Scene, D::Task>,
    utterance: &Utterance,
) -> Said {
    let settings = session.recipe().settings();
    let Some(dialogue) = &settings.dialogue else { return Said::Request };
    let lexicon = session.domain.lexicon(settings.words.edition);
    let open = episode.question.as_deref();
    match dialogue.hear(utterance, open.map(|open| &open.question), lexicon) {
        Heard::Request => Said::Request,
        Heard::Chose(place) => match open {
            Some(open) => Said::Answer(Box::new(carry_out(session, episode, open, place))),
            None => Said::Request,
        },
        Heard::Refused => {
            let text = "All right. Do it in small steps, then teach me.";
            told(text, open.map(|open| open.seq))
        }
        Heard::NothingAsked => told("I did not ask anything.", None),
        Heard::Wrong => match episode.last_act.as_deref() {
            None => told("I have done nothing in this task yet.", None),
            Some(last) if last.wrong => {
                let text =
                    format!("What I did for \"{}\" is marked as wrong.", last.said.utterance);
                told(&text, None)
            }
            Some(_) => Said::Wrong,
        },
        Heard::Question(about) => told(&answer(session, episode, &about), None),
    }
}

/// The answer of the mind, unless the person has called this reading of these words wrong.
pub(super) fn unless_wrong<S, T>(
    episode: &Episode<S, T>,
    utterance: &Utterance,
    answer: Answer,
) -> Answer {
    let Outcome::Understood { program, .. } = &answer.outcome else { return answer };
    let words = utterance.tokens();
    let is_wrong = episode
        .wrong
        .iter()
        .any(|wrong| wrong.program == *program && wrong.utterance.tokens() == words);
    if !is_wrong {
        return answer;
    }
    let reason = CALLED_WRONG.to_owned();
    let discarded = vec![Discarded { program: program.clone(), reason }];
    let evidence = Evidence { discarded, answered_by: Vec::new(), ..answer.evidence };
    Answer { outcome: Outcome::NotSure, evidence, chosen: Vec::new(), ..answer }
}

/// Carries out what the person chose.
fn carry_out<D: Domain>(
    session: &Session<D>,
    episode: &Episode<D::Scene, D::Task>,
    open: &OpenQuestion,
    place: usize,
) -> Answer {
    let Choice { program, chosen, mentioned, .. } = open.question.choices[place].clone();
    let mut scene = D::Scene::clone(&episode.scene);
    let mut bindings = Vec::new();
    let mut outcome = None;
    for (index, step) in program.steps.iter().enumerate() {
        let on = chosen.get(index).map_or(&[][..], Vec::as_slice);
        match session.domain.step_on(&mut scene, &episode.task, step, on) {
            Ok(bound) => bindings.push(bound),
            Err(error) => {
                let (program, step) = (program.clone(), index as u32);
                let reason = error.reason;
                outcome = Some(Outcome::Impossible { program, step, reason });
                break;
            }
        }
    }
    let outcome = outcome.unwrap_or(Outcome::Understood { program, bindings });
    let evidence = Evidence { replies_to: Some(open.seq), ..Evidence::default() };
    Answer { outcome, evidence, mentioned, chosen }
}

fn told(text: &str, replies_to: Option<Seq>) -> Said {
    let outcome = Outcome::Told { text: text.to_owned() };
    let evidence = Evidence { replies_to, ..Evidence::default() };
    Said::Answer(Box::new(Answer { outcome, evidence, mentioned: None, chosen: Vec::new() }))
}

fn answer<D: Domain>(
    session: &Session<D>,
    episode: &Episode<D::Scene, D::Task>,
    about: &About,
) -> String {
    let lessons = session.state.lessons.iter();
    let lessons: Vec<String> = lessons.map(|live| live.lesson.utterance.to_string()).collect();
    let reason = episode.last_act.as_deref().map(why);
    let known = Known {
        seeds: &session.domain.seeds().exemplars,
        lessons: &lessons,
        goal: &episode.goal,
        reason: reason.as_deref(),
        lexicon: session.domain.lexicon(session.recipe().settings().words.edition),
    };
    dialogue::answer(&*session.domain, &episode.scene, about, known)
}

/// Why an act was done, for the person.
fn why<S>(act: &Act<S>) -> String {
    let said = &act.said.utterance;
    match &act.taken_for {
        Some(lifted) => format!(
            "You said \"{said}\", and I took it for \"{}\". If that was wrong, say \"that was wrong\".",
            dialogue::in_words(lifted)
        ),
        None => format!("You said \"{said}\"."),
    }
}
