//! `:why`: the reasons for an answer.

use apprentice::language::{Accounted, Answer, Answerer, Evidence, Near, Outcome, Use};

use super::answer::no_request;
use super::words::{listed, quoted, sentence, unique, without_stop};

/// The evidence of an answer, in the order in which the robot came to it.
pub fn why(utterance: &str, answer: &Answer) -> Vec<String> {
    let evidence = &answer.evidence;
    let mut lines = vec![format!("You said \"{utterance}\".")];
    lines.extend(read_as(evidence));
    lines.extend(uses(&evidence.accounting));
    lines.extend(things(answer));
    lines.extend(compared(evidence));
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
    lines.push(so(answer));
    lines
}

/// The clauses, lifted.
fn read_as(evidence: &Evidence) -> Option<String> {
    let clauses: Vec<String> =
        evidence.lifted.iter().map(|clause| format!("\"{clause}\"")).collect();
    (!clauses.is_empty()).then(|| format!("I read it as {}.", clauses.join(" and ")))
}

/// The things that the words chose, each once.
fn things(answer: &Answer) -> Option<String> {
    let chosen = unique(answer.chosen.iter().flatten().flatten().map(String::as_str));
    (!chosen.is_empty()).then(|| format!("I took your words to mean {}.", listed(&chosen)))
}

/// Which part answered, and which exemplars came closest.
fn compared(evidence: &Evidence) -> Vec<String> {
    let mut answered: Vec<Answerer> = evidence.answered_by.clone();
    answered.dedup();
    let mut lines: Vec<String> =
        answered.iter().map(|answerer| sentence(&format!("{answerer} answered"))).collect();
    if !evidence.nearest.is_empty() {
        lines.push(format!(
            "What came closest (a distance of up to {:.2} is close enough):",
            evidence.threshold
        ));
        lines.extend(evidence.nearest.iter().map(|near| nearest(near, evidence.threshold)));
    } else if answered.is_empty() && evidence.mood.is_none() {
        lines.push("I know nothing to compare it with.".to_owned());
    }
    lines
}

fn nearest(near: &Near, threshold: f32) -> String {
    let verdict = if near.distance <= threshold { "close enough" } else { "too far" };
    format!("  {:.2}  {:<12}  \"{}\" = {}", near.distance, verdict, near.exemplar, near.program)
}

/// What followed from it.
fn so(answer: &Answer) -> String {
    match &answer.outcome {
        Outcome::Understood { program, .. } => format!("So I did {program}."),
        Outcome::Impossible { program, step, .. } => {
            format!("So I took it to mean {program}, but I can't do step {} here.", step + 1)
        }
        Outcome::Asked { .. } => "So I asked. Nothing changed.".to_owned(),
        Outcome::Told { .. } => "So I answered. Nothing changed.".to_owned(),
        Outcome::NotSure => match &answer.evidence.mood {
            Some(mood) => no_request(mood),
            None => "So I was not sure. Nothing changed.".to_owned(),
        },
    }
}

/// `I used "pick up" for what to do, and "mug" for a thing. I did not use "banana".`
///
/// - returns: none if the recipe does not account for words.
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
        // A group may contain an "and" of its own.
        [first @ .., last] => Some(format!("I used {}, and {last}.", first.join(", "))),
    };
    let unused = of(Use::Nothing).map(|(words, _)| format!("I did not use {words}."));
    let sentences: Vec<String> = used.into_iter().chain(unused).collect();
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

#[cfg(test)]
mod tests {
    use super::super::samples::{accounting, answered};
    use super::*;

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
}
