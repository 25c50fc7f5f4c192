//! What the conversation shows, as text. Pure: every function here only builds strings.

use apprentice::client::{ActionView, KnownExemplar, Phase, Status, Teachable};
use apprentice::language::{
    Accounted, Answer, Answerer, Evidence, Mood, Near, Outcome, Program, Use,
};
use apprentice::plain::count;
use apprentice::world::View;
use apprentice::world::household::told;

/// Characters of an utterance that is quoted back. The person sees a longer one above the answer.
const QUOTED_CHARS_MAX: usize = 60;

/// The goal at the start of an episode.
pub fn goal(goal: &str, fewest: Option<u32>) -> String {
    match fewest {
        Some(1) => format!("Goal: {goal}. (1 action is enough.)"),
        Some(fewest) => format!("Goal: {goal}. ({fewest} actions are enough.)"),
        None => format!("Goal: {goal}."),
    }
}

/// An answer to an utterance: what was done, action by action, or why nothing was.
///
/// - `done`: the actions that this utterance led to.
pub fn answer(utterance: &str, answer: &Answer, done: &[ActionView]) -> Vec<String> {
    match &answer.outcome {
        Outcome::Understood { .. } => done.iter().map(action).collect(),
        Outcome::Impossible { program, step, reason } => vec![impossible(program, *step, reason)],
        Outcome::NotSure => vec![not_sure(utterance, &answer.evidence)],
    }
}

/// `  3  picks up the mug from the counter top`
pub fn action(action: &ActionView) -> String {
    format!("{:>3}  {}", action.number, action.sentence)
}

fn impossible(program: &Program, step: u32, reason: &str) -> String {
    let Some(failing) = program.steps.get(step as usize) else {
        return format!("I can't do that: {}. Nothing changed.", without_stop(reason));
    };
    let (request, reason) = (told::request(failing), told::reason(failing, reason));
    match program.steps.len() {
        1 => format!("I can't {request}: {reason}. Nothing changed."),
        of => format!(
            "I can't {request} (step {} of {of}): {reason}. Nothing changed. I took it to mean: \
             {program}.",
            step + 1
        ),
    }
}

fn not_sure(utterance: &str, evidence: &Evidence) -> String {
    if let Some(mood) = &evidence.mood {
        return no_request(mood);
    }
    let left_over = unique(evidence.left_over());
    if let [words @ .., _] = &left_over[..] {
        let these = if words.is_empty() { "this word" } else { "these words" };
        let words = quoted(&left_over);
        return format!(
            "I don't know what to do with {words}. Nothing changed. Say it without {these}, or do it \
             in small steps, then teach me."
        );
    }
    let that = match utterance.chars().count() {
        0..=QUOTED_CHARS_MAX => format!("\"{utterance}\""),
        _ => "that".to_owned(),
    };
    match evidence.nearest.first() {
        // Close enough, and still no program: a slot of it had no mention to fill it.
        Some(near) if near.distance <= evidence.threshold => format!(
            "I don't understand all of {that}. The closest request I know is \"{}\". Name every thing \
             in it, or do it in small steps, then teach me. (:why shows more.)",
            near.exemplar
        ),
        Some(_) => format!(
            "I don't understand {that}. Do it in small steps, then teach me. (:why shows what came \
             closest.)"
        ),
        None => format!("I don't understand {that}. Do it in small steps, then teach me."),
    }
}

/// The utterance was no request. Says which word shows it, and what to do instead.
fn no_request(mood: &Mood) -> String {
    match mood {
        Mood::Asked { word } => format!(
            "That sounds like a question (\"{word}\"). I can't answer questions. Nothing changed. \
             (:look shows where things are.)"
        ),
        Mood::Told { word } => format!(
            "That sounds like a statement (\"{word}\"). Nothing changed. Tell me what to do."
        ),
        Mood::Forbidden { word } => {
            format!("You told me not to do something (\"{word}\"). Nothing changed.")
        }
        Mood::Conditional { word } => format!(
            "I can't wait for something to happen (\"{word}\"). Nothing changed. Tell me when it is \
             time."
        ),
        Mood::Later { word } => format!(
            "I can only do things now (\"{word}\"). Nothing changed. Tell me when it is time."
        ),
        Mood::Reordered { word } => format!(
            "I do things in the order in which you say them (\"{word}\"). Nothing changed. Say first \
             what I must do first."
        ),
    }
}

/// The parts of the goal: `[x] the mug is clean  [ ] it is on the counter top`.
pub fn progress(progress: &[(String, bool)]) -> String {
    let part = |(words, holds): &(String, bool)| {
        let mark = if *holds { 'x' } else { ' ' };
        format!("[{mark}] {words}")
    };
    progress.iter().map(part).collect::<Vec<_>>().join("  ")
}

/// What the robot holds, from what it sees.
pub fn holding(view: &View) -> String {
    let held = |thing: &&apprentice::world::Thing| thing.states.iter().any(|state| state == "held");
    match view.things.iter().find(held) {
        Some(thing) => format!("holding {}", thing.name),
        None => "holding nothing".to_owned(),
    }
}

/// The room, where the robot is and what it holds, as one sentence.
pub fn summary(view: &View) -> String {
    sentence(&one_line(&view.summary))
}

/// `:look`: the room in a sentence, then what stands where.
pub fn look(view: &View) -> Vec<String> {
    let mut lines = vec![summary(view)];
    let mut places: Vec<&str> = Vec::new();
    for place in view.things.iter().filter_map(|thing| thing.place.as_deref()) {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    for thing in &view.things {
        let is_place = places.contains(&thing.name.as_str());
        if thing.place.is_some() && !is_place {
            continue;
        }
        let on_it: Vec<String> = view
            .things
            .iter()
            .filter(|other| other.place.as_deref() == Some(thing.name.as_str()))
            .map(|other| with_states(&other.name, &other.states))
            .collect();
        let name = with_states(&thing.name, &thing.states);
        lines.push(match on_it.is_empty() {
            true => format!("  {name}"),
            false => format!("  {name}: {}", on_it.join(", ")),
        });
    }
    lines
}

fn with_states(name: &str, states: &[String]) -> String {
    match states.is_empty() {
        true => name.to_owned(),
        false => format!("{name} ({})", states.join(", ")),
    }
}

/// `:why`: the evidence of an answer.
pub fn why(utterance: &str, answer: &Answer) -> Vec<String> {
    let evidence = &answer.evidence;
    let mut lines = vec![format!("You said \"{utterance}\".")];
    if !evidence.lifted.is_empty() {
        let clauses: Vec<String> =
            evidence.lifted.iter().map(|clause| format!("\"{clause}\"")).collect();
        lines.push(format!("I read it as {}.", clauses.join(" and ")));
    }
    lines.extend(uses(&evidence.accounting));
    let chosen = unique(answer.chosen.iter().flatten().flatten().map(String::as_str));
    if !chosen.is_empty() {
        lines.push(format!("I took your words to mean {}.", listed(&chosen)));
    }
    let mut answered: Vec<Answerer> = evidence.answered_by.clone();
    answered.dedup();
    for answerer in &answered {
        lines.push(sentence(&format!("{answerer} answered")));
    }
    if !evidence.nearest.is_empty() {
        lines.push(format!(
            "What came closest (a distance of up to {:.2} is close enough):",
            evidence.threshold
        ));
        lines.extend(evidence.nearest.iter().map(|near| nearest(near, evidence.threshold)));
    } else if answered.is_empty() && evidence.mood.is_none() {
        lines.push("I know nothing to compare it with.".to_owned());
    }
    for discarded in &evidence.discarded {
        let reason = without_stop(&discarded.reason);
        lines.push(format!("I ruled out {}: {reason}.", discarded.program));
    }
    if evidence.reranked > 1 {
        lines.push(format!(
            "{} readings were possible. I chose one by what you taught me before.",
            evidence.reranked
        ));
    }
    lines.push(match &answer.outcome {
        Outcome::Understood { program, .. } => format!("So I did {program}."),
        Outcome::Impossible { program, step, .. } => {
            format!("So I took it to mean {program}, but I can't do step {} here.", step + 1)
        }
        Outcome::NotSure => match &evidence.mood {
            Some(mood) => no_request(mood),
            None => "So I was not sure. Nothing changed.".to_owned(),
        },
    });
    lines
}

/// `I used "pick up" for what to do, and "mug" for a thing. I did not use "banana".`
///
/// - returns: none where words are not accounted for.
fn uses(accounting: &[Accounted]) -> Option<String> {
    let of = |used: Use| {
        let words = accounting.iter().filter(|word| word.used == used);
        let words = unique(words.map(|word| word.word.as_str()));
        (!words.is_empty()).then(|| (quoted(&words), words.len()))
    };
    let group = |used: Use| {
        let (words, count) = of(used)?;
        let what = match used {
            Use::Verb => "for what to do",
            Use::Thing if count == 1 => "for a thing",
            Use::Thing => "for things",
            Use::Attribute => "for which one",
            Use::Landmark => "for where it is",
            Use::Frame => "as courtesy",
            Use::Harmless => "as small words",
            Use::Nothing => return None,
        };
        Some(format!("{words} {what}"))
    };
    let groups = [Use::Verb, Use::Thing, Use::Attribute, Use::Landmark, Use::Frame, Use::Harmless];
    let groups: Vec<String> = groups.into_iter().filter_map(group).collect();
    let used = match &groups[..] {
        [] => None,
        [one] => Some(format!("I used {one}.")),
        // The groups hold an "and" of their own.
        [first @ .., last] => Some(format!("I used {}, and {last}.", first.join(", "))),
    };
    let unused = of(Use::Nothing).map(|(words, _)| format!("I did not use {words}."));
    let sentences: Vec<String> = used.into_iter().chain(unused).collect();
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

/// The same words without repetitions, each where it stood first.
fn unique<'w>(words: impl Iterator<Item = &'w str>) -> Vec<&'w str> {
    let mut found: Vec<&str> = Vec::new();
    for word in words {
        if !found.contains(&word) {
            found.push(word);
        }
    }
    found
}

/// `"a", "b" and "c"`.
fn quoted(words: &[&str]) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
    listed(&words)
}

/// `a, b and c`.
fn listed<S: AsRef<str>>(parts: &[S]) -> String {
    let mut out = String::new();
    for (index, part) in parts.iter().enumerate() {
        out.push_str(match index {
            0 => "",
            _ if index + 1 == parts.len() => " and ",
            _ => ", ",
        });
        out.push_str(part.as_ref());
    }
    out
}

fn nearest(near: &Near, threshold: f32) -> String {
    let verdict = if near.distance <= threshold { "close enough" } else { "too far" };
    format!("  {:.2}  {:<12}  \"{}\" = {}", near.distance, verdict, near.exemplar, near.program)
}

/// `:known`: what was taught, with the numbers that `:forget` takes, then the seeds.
pub fn known(known: &[KnownExemplar]) -> Vec<String> {
    let line = |known: &KnownExemplar| {
        let number = known.lesson.map(|seq| format!("#{seq}")).unwrap_or_default();
        format!("  {number:>5}  \"{}\" = {}", known.exemplar.utterance, known.exemplar.program)
    };
    let (taught, seeds): (Vec<_>, Vec<_>) = known.iter().partition(|known| known.lesson.is_some());
    let mut lines = Vec::new();
    lines.push(match taught.len() {
        0 => "You have taught me nothing yet.".to_owned(),
        n => format!("You taught me {}:", count(n as u32, "request")),
    });
    lines.extend(taught.into_iter().map(line));
    lines.push(format!("I came with {}:", count(seeds.len() as u32, "request")));
    lines.extend(seeds.into_iter().map(line));
    lines
}

/// `:status`.
pub fn status(status: &Status) -> Vec<String> {
    let mut lines = Vec::new();
    let phase = match status.phase {
        Phase::Idle => "between two tasks",
        Phase::Interacting => "in a task",
        Phase::Teaching => "being taught",
        Phase::Learning => "learning",
        Phase::Closed => "closed",
    };
    lines.push(format!(
        "I am {phase}: task {}, {}, {}.",
        status.episodes,
        count(status.utterances, "utterance"),
        count(status.actions.len() as u32, "action")
    ));
    if let Some(goal) = &status.goal {
        lines.push(format!("Goal: {goal}. {}", progress(&status.progress)));
    }
    lines.extend(status.actions.iter().map(action));
    lines.push(format!(
        "I know {}, {} from you (recipe {}, mind {}).",
        count(status.exemplars, "example"),
        status.lessons,
        status.recipe,
        status.mind.short()
    ));
    lines
}

/// The question about one utterance, with the actions that it may stand for.
pub fn teaching_question(said: &Teachable, actions: &[ActionView]) -> Vec<String> {
    let why = match (said.not_sure, said.guessed) {
        (true, _) => "I did not understand it",
        (false, true) => "I guessed what it means",
        (false, false) => "I understood it, but it could not be done",
    };
    let after = after(said, actions);
    let mut lines = vec![format!("You said \"{}\" and {why}.", said.utterance)];
    match (after.first(), after.last()) {
        (Some(first), Some(last)) => {
            lines.push("What I did after that:".to_owned());
            lines.extend(after.iter().map(|done| action(done)));
            lines.push(format!(
                "Which of these actions did you mean by \"{}\"? Type the first and the last, such as \
                 {}-{}. Or type all, none or skip (help explains them).",
                said.utterance, first.number, last.number
            ));
        }
        _ => lines.push("I did nothing after that. Type none or skip.".to_owned()),
    }
    lines
}

/// The actions that came after an utterance.
pub fn after<'a>(said: &Teachable, actions: &'a [ActionView]) -> Vec<&'a ActionView> {
    actions.iter().filter(|action| action.number > said.actions_before).collect()
}

/// What a person is told when training is over.
pub fn learned(examples: u32) -> String {
    format!("Learned. I now know {}.", count(examples, "example"))
}

pub fn help() -> Vec<String> {
    let text = "\
Say what the robot should do, in your own words: \"go to the mug and pick it up\".
If it does not understand you, do the task in small steps. You can teach it when the task is over.
  :look      show what the robot sees and holds
  :why       show the reason for the last answer
  :known     list every request it knows; your lessons have numbers
  :status    show the task, its goal and the actions so far
  :done      end this task now (done works too)
  :task T    choose the next task, for example :task clean Mug CounterTop
  :forget N  forget the lesson that :known shows as #N
  :quit      leave; everything is saved";
    text.lines().map(str::to_owned).collect()
}

pub fn teaching_help() -> Vec<String> {
    let text = "\
Say which actions your words meant:
  3-7        actions 3 to 7 (for one action: 3)
  all        all the actions shown
  none       none of them
  skip       do not teach this
  done       skip the rest and learn
  teach \"wash the mug\" 3-7   teach another of your sentences";
    text.lines().map(str::to_owned).collect()
}

/// Several lines as one, for a program that reads line by line.
pub fn one_line(lines: &[String]) -> String {
    let mut joined = String::new();
    for line in lines.iter().map(|line| line.trim()) {
        let starts_sentence = line.starts_with(char::is_uppercase);
        let gap = match joined.chars().last() {
            None => "",
            Some('.' | ':' | '!' | '?') => " ",
            Some(_) if starts_sentence => ". ",
            Some(_) => "; ",
        };
        joined.push_str(gap);
        joined.push_str(line);
    }
    joined
}

/// What a person who comes back hears: where they are and what the robot has learned from them.
pub fn welcome(user: &str, status: &Status) -> String {
    if status.episodes == 0 {
        return format!(
            "Hello, {user}! I know {}. You teach me the rest. Type :help to see how.",
            count(status.exemplars, "example")
        );
    }
    let lessons = match status.lessons {
        0 => "no lesson yet".to_owned(),
        n => count(n, "lesson"),
    };
    let now = match status.phase {
        Phase::Interacting => " You are in the middle of a task.",
        Phase::Teaching => " You were teaching me.",
        Phase::Learning => " I am still learning from your lessons.",
        Phase::Idle | Phase::Closed => "",
    };
    format!("Welcome back, {user}: {} so far, {lessons}.{now}", count(status.episodes, "task"))
}

/// A clause as a sentence of its own: with a capital and a full stop.
pub fn sentence(clause: &str) -> String {
    let mut chars = clause.chars();
    let first = chars.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    let stop = if clause.ends_with('.') { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}

fn without_stop(sentence: &str) -> &str {
    sentence.trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::ids::Seq;
    use apprentice::language::{Discarded, Exemplar, LiftedUtterance};
    use apprentice::world::Thing;

    fn done(number: u32, sentence: &str) -> ActionView {
        ActionView { number, step: "GOTO Mug".into(), sentence: sentence.into() }
    }

    fn evidence() -> Evidence {
        Evidence {
            lifted: vec![LiftedUtterance::parse("wash the <obj>")],
            nearest: vec![Near {
                exemplar: LiftedUtterance::parse("pick up the <obj>"),
                program: "PICKUP <obj:1>".parse().unwrap(),
                distance: 0.914,
                number: 3,
            }],
            threshold: 0.42,
            discarded: vec![Discarded {
                program: "PICKUP Mug".parse().unwrap(),
                reason: "the hand is full.".into(),
            }],
            reranked: 2,
            ..Evidence::default()
        }
    }

    fn answered(outcome: Outcome) -> Answer {
        Answer { outcome, evidence: evidence(), mentioned: None, chosen: Vec::new() }
    }

    #[test]
    fn what_was_done_is_numbered() {
        let program = "GOTO Mug; PICKUP Mug".parse().unwrap();
        let outcome = Outcome::Understood { program, bindings: vec![] };
        let done = [done(3, "goes to the mug"), done(12, "waits")];
        let lines = answer("go", &answered(outcome), &done);
        assert_eq!(lines, ["  3  goes to the mug", " 12  waits"]);
    }

    #[test]
    fn not_sure_quotes_the_words_and_says_what_to_do_next() {
        let lines = answer("boogie", &answered(Outcome::NotSure), &[]);
        assert_eq!(
            lines,
            [
                "I don't understand \"boogie\". Do it in small steps, then teach me. (:why shows what \
              came closest.)"
            ]
        );
        let lines = answer(&"boogie ".repeat(20), &answered(Outcome::NotSure), &[]);
        assert!(lines[0].starts_with("I don't understand that. Do it"), "{lines:?}");
    }

    #[test]
    fn a_near_request_that_names_too_little_says_so() {
        let mut told = answered(Outcome::NotSure);
        told.evidence.nearest[0].distance = 0.2;
        let lines = answer("pick up", &told, &[]);
        assert_eq!(
            lines,
            ["I don't understand all of \"pick up\". The closest request I know is \"pick up the \
              <obj>\". Name every thing in it, or do it in small steps, then teach me. (:why shows \
              more.)"]
        );
    }

    fn accounting(words: &[(&str, Use)]) -> Vec<Accounted> {
        let accounted = |&(word, used): &(&str, Use)| Accounted { word: word.to_owned(), used };
        words.iter().map(accounted).collect()
    }

    #[test]
    fn what_is_no_request_is_told_by_the_word_that_says_so() {
        let word = |word: &str| word.to_owned();
        for (mood, sentence) in [
            (
                Mood::Asked { word: word("did") },
                "That sounds like a question (\"did\"). I can't answer questions. Nothing changed. \
                 (:look shows where things are.)",
            ),
            (
                Mood::Told { word: word("i") },
                "That sounds like a statement (\"i\"). Nothing changed. Tell me what to do.",
            ),
            (
                Mood::Forbidden { word: word("not") },
                "You told me not to do something (\"not\"). Nothing changed.",
            ),
            (
                Mood::Conditional { word: word("until") },
                "I can't wait for something to happen (\"until\"). Nothing changed. Tell me when it \
                 is time.",
            ),
            (
                Mood::Later { word: word("tomorrow") },
                "I can only do things now (\"tomorrow\"). Nothing changed. Tell me when it is time.",
            ),
            (
                Mood::Reordered { word: word("before") },
                "I do things in the order in which you say them (\"before\"). Nothing changed. Say \
                 first what I must do first.",
            ),
        ] {
            let mut told = answered(Outcome::NotSure);
            told.evidence.nearest.clear();
            told.evidence.mood = Some(mood);
            assert_eq!(answer("did you wash it?", &told, &[]), [sentence]);
            let lines = why("did you wash it?", &told);
            assert_eq!(lines.last().map(String::as_str), Some(sentence));
            assert!(!lines.join("\n").contains("nothing to compare"), "{lines:?}");
        }
    }

    #[test]
    fn words_that_were_used_for_nothing_are_named() {
        let mut told = answered(Outcome::NotSure);
        let mut sentence = |words: &[(&str, Use)]| {
            told.evidence.accounting = accounting(words);
            answer("get it", &told, &[]).remove(0)
        };
        let (banana, kiwi, fig) =
            (("banana", Use::Nothing), ("kiwi", Use::Nothing), ("fig", Use::Nothing));
        assert_eq!(
            sentence(&[("get", Use::Verb), banana, ("the", Use::Harmless), banana]),
            "I don't know what to do with \"banana\". Nothing changed. Say it without this word, or \
             do it in small steps, then teach me."
        );
        assert_eq!(
            sentence(&[banana, kiwi, fig]),
            "I don't know what to do with \"banana\", \"kiwi\" and \"fig\". Nothing changed. Say it \
             without these words, or do it in small steps, then teach me."
        );
        // Every word was used, so none is to blame.
        assert!(sentence(&[("get", Use::Verb)]).starts_with("I don't understand \"get it\"."));
    }

    #[test]
    fn why_lists_what_each_word_was_used_for() {
        let mut told = answered(Outcome::NotSure);
        let text = |told: &Answer| why("please pick up the mug", told).join("\n");
        assert!(!text(&told).contains("I used"), "{}", text(&told));
        told.evidence.accounting = accounting(&[
            ("please", Use::Frame),
            ("pick up", Use::Verb),
            ("the", Use::Harmless),
            ("dirty", Use::Attribute),
            ("mug", Use::Thing),
            ("and", Use::Harmless),
            ("the", Use::Harmless),
            ("plate", Use::Thing),
            ("table", Use::Landmark),
            ("banana", Use::Nothing),
        ]);
        let line = "I used \"pick up\" for what to do, \"mug\" and \"plate\" for things, \"dirty\" \
                    for which one, \"table\" for where it is, \"please\" as courtesy, and \"the\" \
                    and \"and\" as small words. I did not use \"banana\".";
        assert!(text(&told).contains(line), "{}", text(&told));
        told.evidence.accounting = accounting(&[("open", Use::Verb), ("fridge", Use::Thing)]);
        let line = "I used \"open\" for what to do, and \"fridge\" for a thing.\n";
        assert!(text(&told).contains(line), "{}", text(&told));
    }

    #[test]
    fn why_names_the_things_that_words_chose_once_each() {
        let program = "GOTO Mug; PUT Mug Table".parse().unwrap();
        let mut told = answered(Outcome::Understood { program, bindings: vec![] });
        let text = |told: &Answer| why("put the other mug there", told).join("\n");
        assert!(!text(&told).contains("your words to mean"), "{}", text(&told));
        let mug = Some("Mug 2".to_owned());
        told.chosen = vec![vec![mug.clone()], vec![mug, None]];
        assert!(text(&told).contains("\nI took your words to mean Mug 2.\n"), "{}", text(&told));
        told.chosen[1][1] = Some("Table 3".to_owned());
        assert!(
            text(&told).contains("I took your words to mean Mug 2 and Table 3."),
            "{}",
            text(&told)
        );
    }

    #[test]
    fn an_impossible_request_names_the_step_the_reason_and_that_nothing_was_done() {
        let outcome = |program: &str, step| Outcome::Impossible {
            program: program.parse().unwrap(),
            step,
            reason: "the fridge is closed".into(),
        };
        let told = |program, step| answer("do", &answered(outcome(program, step)), &[]).remove(0);
        assert_eq!(
            told("GOTO Fridge; PUT Mug Fridge", 1),
            "I can't put the mug in the fridge (step 2 of 2): the fridge is closed. Nothing changed. \
             I took it to mean: GOTO Fridge; PUT Mug Fridge."
        );
        assert_eq!(
            told("PUT Mug Fridge", 0),
            "I can't put the mug in the fridge: the fridge is closed. Nothing changed."
        );
        assert_eq!(
            told("OPEN Fridge", 0),
            "I can't open the fridge: it is closed. Nothing changed."
        );
        assert_eq!(
            told("OPEN Fridge", 7),
            "I can't do that: the fridge is closed. Nothing changed."
        );
    }

    #[test]
    fn why_shows_the_distance_against_the_threshold_and_what_was_dropped() {
        let lines = why("wash the mug", &answered(Outcome::NotSure));
        let text = lines.join("\n");
        for part in [
            "I read it as \"wash the <obj>\".",
            "a distance of up to 0.42 is close enough",
            "0.91  too far       \"pick up the <obj>\" = PICKUP <obj:1>",
            "I ruled out PICKUP Mug: the hand is full.",
            "2 readings were possible.",
            "So I was not sure. Nothing changed.",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }

    #[test]
    fn why_names_the_part_that_answered_instead_of_what_is_nearest() {
        let mut told = answered(Outcome::NotSure);
        told.evidence.nearest.clear();
        told.evidence.answered_by = vec![Answerer::Grammar, Answerer::Grammar, Answerer::Seq2seq];
        let text = why("go to the mug and wash it", &told).join("\n");
        assert_eq!(text.matches("The grammar answered.").count(), 1, "{text}");
        assert!(text.contains("The sequence-to-sequence model answered."), "{text}");
        assert!(!text.contains("nothing to compare"), "{text}");
    }

    #[test]
    fn what_stands_where_is_grouped_by_place() {
        let thing = |name: &str, place: Option<&str>, states: &[&str]| Thing {
            name: name.into(),
            kind: name.into(),
            place: place.map(str::to_owned),
            at: (0, 0),
            states: states.iter().map(|state| (*state).to_owned()).collect(),
        };
        let view = View {
            summary: vec!["this is a kitchen".into(), "its hand is empty".into()],
            things: vec![
                thing("CounterTop", None, &[]),
                thing("Mug", Some("CounterTop"), &["dirty"]),
                thing("SinkBasin", Some("CounterTop"), &[]),
                thing("Fork", Some("SinkBasin"), &[]),
                thing("Apple", None, &["held"]),
            ],
        };
        assert_eq!(
            look(&view),
            [
                "This is a kitchen; its hand is empty.",
                "  CounterTop: Mug (dirty), SinkBasin",
                "  SinkBasin: Fork",
                "  Apple (held)"
            ]
        );
        assert_eq!(holding(&view), "holding Apple");
    }

    #[test]
    fn lessons_come_before_seeds_and_have_numbers() {
        let exemplar = |utterance: &str, lesson| KnownExemplar {
            exemplar: Exemplar {
                utterance: LiftedUtterance::parse(utterance),
                program: "GOTO <obj:1>".parse().unwrap(),
            },
            lesson,
        };
        let lines = known(&[exemplar("go to <obj>", None), exemplar("visit <obj>", Seq::new(23))]);
        assert_eq!(
            lines,
            [
                "You taught me 1 request:",
                "    #23  \"visit <obj>\" = GOTO <obj:1>",
                "I came with 1 request:",
                "         \"go to <obj>\" = GOTO <obj:1>"
            ]
        );
    }

    #[test]
    fn a_teaching_question_shows_only_what_came_after() {
        let said = Teachable {
            seq: Seq::FIRST,
            utterance: "wash it".into(),
            actions_before: 1,
            not_sure: true,
            guessed: false,
        };
        let lines = teaching_question(&said, &[done(1, "a"), done(2, "b"), done(3, "c")]);
        assert_eq!(lines[2..4], ["  2  b", "  3  c"]);
        assert!(lines[4].contains("such as 2-3."), "{lines:?}");
        let nothing = teaching_question(&said, &[done(1, "a")]);
        assert!(nothing[1].contains("Type none or skip"), "{nothing:?}");
    }

    #[test]
    fn several_lines_become_one_without_losing_their_ends() {
        let lines = ["What I did:", "  1  a", "  2  b", "Which was it?"].map(str::to_owned);
        assert_eq!(one_line(&lines), "What I did: 1  a; 2  b. Which was it?");
    }

    #[test]
    fn progress_marks_what_holds() {
        let parts = [("the mug is clean".to_owned(), true), ("it is away".to_owned(), false)];
        assert_eq!(progress(&parts), "[x] the mug is clean  [ ] it is away");
        assert_eq!(goal("wash the mug", Some(8)), "Goal: wash the mug. (8 actions are enough.)");
        assert_eq!(learned(45), "Learned. I now know 45 examples.");
    }
}
