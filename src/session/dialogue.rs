//! What an utterance is in a conversation, before it is taken for a request: an answer to the open
//! question, "that was wrong", or a question of the person.

use super::Session;
use super::state::{Act, Episode};
use crate::dialogue::{self, About, Intent, Known};
use crate::ids::Seq;
use crate::language::{Answer, AnswerOption, Discarded, Evidence, Outcome, Utterance};
use crate::world::Domain;

/// Why a reading is not taken that the person called wrong, in [`Evidence::discarded`].
pub const CALLED_WRONG: &str = "you said that this was wrong";

/// What is to come of an utterance.
pub(super) enum Decided {
    /// The mind is asked what it means.
    Interpret,
    /// The last act is marked as wrong.
    MarkWrong,
    /// This answer, whatever the mind would say.
    Answer(Box<Answer>),
}

/// Reads an utterance as a part of the conversation, where the recipe has one.
pub(super) fn decide<D: Domain>(
    session: &Session<D>,
    episode: &Episode<D::Scene, D::Task>,
    utterance: &Utterance,
) -> Decided {
    let settings = session.recipe().settings();
    let Some(dialogue) = &settings.dialogue else { return Decided::Interpret };
    let domain = &*session.domain;
    let lexicon = domain.lexicon(settings.words.edition);
    let lists = settings.abstraction.lists.as_ref();
    let open = episode.question.as_deref();
    let question = open.map(|open| &open.question);
    let replies_to = open.map(|open| open.seq);
    match dialogue.read(domain, lexicon, lists, utterance, question) {
        Intent::Request => Decided::Interpret,
        Intent::Chose(option) => chosen(option, replies_to),
        Intent::Refused => told("All right. Do it in small steps, then teach me.", replies_to),
        Intent::NothingAsked => told("I did not ask anything.", None),
        Intent::Wrong => match episode.last_act.as_deref() {
            None => told("I have done nothing in this task yet.", None),
            Some(act) if episode.is_wrong(act) => told(
                &format!("What I did for \"{}\" is marked as wrong.", act.said.utterance),
                None,
            ),
            Some(_) => Decided::MarkWrong,
        },
        Intent::Question(about) => told(&answer(session, episode, &about), None),
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
        .any(|act| act.program == *program && act.said.utterance.tokens() == words);
    if !is_wrong {
        return answer;
    }
    let reason = CALLED_WRONG.to_owned();
    let discarded = vec![Discarded { program: program.clone(), reason }];
    let evidence = Evidence { discarded, answered_by: Vec::new(), ..answer.evidence };
    Answer { outcome: Outcome::NotSure, evidence, chosen: Vec::new(), ..answer }
}

/// What the person chose. The scene is that in which it was offered: an open question is answered by
/// the next utterance alone.
fn chosen(option: AnswerOption, replies_to: Option<Seq>) -> Decided {
    let AnswerOption { program, bindings, chosen, mentioned, .. } = option;
    let outcome = Outcome::Understood { program, bindings };
    let evidence = Evidence { replies_to, ..Evidence::default() };
    Decided::Answer(Box::new(Answer { outcome, evidence, mentioned, chosen }))
}

fn told(text: &str, replies_to: Option<Seq>) -> Decided {
    let outcome = Outcome::Told { text: text.to_owned() };
    let evidence = Evidence { replies_to, ..Evidence::default() };
    Decided::Answer(Box::new(Answer { outcome, evidence, mentioned: None, chosen: Vec::new() }))
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
