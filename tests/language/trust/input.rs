//! For any text there is an answer of one sentence. Nothing panics, nothing is carried out, and the
//! records fold again.

use super::talk::{Report, Setting, Talk, WASH_MUG, acted, line};

/// Says all texts in one talk. A refused text is refused with one plain sentence.
fn nothing_comes_of(what: &str, said: &[String]) {
    let mut talk = Talk::taught(&Setting::kitchen(), &[WASH_MUG]);
    let mut report = Report::new(what);
    for text in said {
        let start: String = text.chars().take(80).collect();
        match talk.tries(text) {
            Ok(answer) => {
                report.check(!acted(&answer), || line(&start, "nothing", &answer));
            }
            Err(refused) => {
                let sentence = refused.to_string();
                let plain = !sentence.trim().is_empty() && sentence.lines().count() == 1;
                report.check(plain, || format!("{start:?} is refused with {sentence:?}"));
            }
        }
    }
    assert_eq!(talk.actions(), 0, "{what}");
    talk.fold_again();
    report.finish();
}

fn owned(said: &[&str]) -> Vec<String> {
    said.iter().map(|text| (*text).to_owned()).collect()
}

#[test]
fn very_long_utterances() {
    let mut said = Vec::new();
    for unit in [
        "go ",
        "please ",
        "not ",
        "open the fridge and ",
        "do not wash the potato ",
        "if ",
        "robot, ",
        "the other ",
        "2 ",
        "? ",
        "pick up the banana, ",
        "don't ",
    ] {
        for words in [100, 140, 1_000, 10_000] {
            said.push(format!("do not {}", unit.repeat(words)));
        }
        // Within every limit, and still nothing to do.
        said.push(format!("do not {}", unit.repeat(10)));
    }
    nothing_comes_of("very long", &said);
}

#[test]
fn a_long_chain_of_requests_is_all_or_nothing() {
    let mut report = Report::new("long chains");
    for times in [5, 10, 20, 40] {
        let mut talk = Talk::new(&Setting::kitchen());
        let text = vec!["open the fridge and close the fridge"; times].join(" and ");
        match talk.tries(&text) {
            Ok(answer) if acted(&answer) => {
                let steps = talk.actions();
                report.check(steps >= 2 * times, || format!("{times} times: {steps} steps"));
            }
            _ => report.check(true, String::new),
        }
        talk.fold_again();
    }
    report.finish();
}

#[test]
fn frames_without_a_request() {
    nothing_comes_of(
        "frames only",
        &owned(&[
            "please please thank you",
            "please",
            "thank you",
            "thanks a lot",
            "hello",
            "hello robot",
            "hey robot, hey",
            "could you please",
            "can you?",
            "would you be so kind",
            "i want you to",
            "i would like you to please",
            "now",
            "and then",
            "ok",
            "ok robot, now then",
            "well, so, right, ok",
            "for me please",
            "robot",
            "robot, robot, robot",
            "go ahead and",
            "go and",
            "do me a favor",
            "good morning",
            "excuse me, sorry, please",
            "yes please",
            "no thanks",
            "could you could you could you",
            "please robot can you please now please",
            "thank you very much for me",
        ]),
    );
}

#[test]
fn prohibitions_nested_in_questions_and_requests() {
    nothing_comes_of(
        "nested",
        &owned(&[
            "did i tell you not to open the fridge?",
            "didn't i say that you must not open the fridge?",
            "could you please not open the fridge?",
            "could you please make sure not to open the fridge?",
            "would you mind not picking up the mug?",
            "can you remember never to pick up the mug?",
            "do you know why you should not wash the potato?",
            "is it clear that you may not wash the potato unless i say so?",
            "why did you not do what i said when i said do not open the fridge?",
            "please tell me that you did not open the fridge",
            "i want you to promise that you will never open the fridge",
            "i hope you don't think that i want you to open the fridge",
            "who said that you should not not open the fridge?",
            "do not not open the fridge",
            "don't forget that you must not open the fridge",
            "what if i told you not to open the fridge, and then to open it?",
            "if i say do not open the fridge, do you open the fridge?",
            "robot, please, don't, i beg you, open the fridge",
            "is there a reason not to wash the mug?",
            "no, i never said open the fridge",
            "can you not wash the potato, please, thank you",
            "isn't it true that nobody should open the fridge?",
            "would it be wrong not to wash the mug?",
        ]),
    );
}

#[test]
fn capitals_and_missing_spaces() {
    nothing_comes_of(
        "capitals and spaces",
        &owned(&[
            "DO NOT OPEN THE FRIDGE",
            "DONT OPEN THE FRIDGE!!!!!!",
            "NEVER EVER PICK UP THE MUG",
            "DID YOU WASH THE POTATO???",
            "WASH THE POTATO TOMORROW",
            "IF IT RAINS OPEN THE FRIDGE",
            "oPeN tHe FrIdGe ToMoRrOw",
            "donotopenthefridge",
            "dontopenthefridge",
            "openthefridgeandclosethefridge",
            "pleasedonotpickupthemug",
            "pickupthemugtomorrow",
            "did.you.open.the.fridge",
            "do-not-open-the-fridge",
            "do_not_open_the_fridge",
            "do,not,open,the,fridge",
            "don't/open/the/fridge",
            "n o t o p e n t h e f r i d g e",
            "do  not\topen   the    fridge",
            "D.O. N.O.T. open the fridge",
            "don' t open the fridge",
            "do n't open the fridge",
            "don`t open the fridge",
            "don\u{b4}t open the fridge",
            "don\u{2019}t open the fridge",
            "don\u{2bc}t open the fridge",
        ]),
    );
}

#[test]
fn emoji_and_marks() {
    nothing_comes_of(
        "emoji and marks",
        &owned(&[
            "\u{1f916}",
            "\u{1f916}\u{1f916} \u{1f375}",
            "\u{1f6ab} open the fridge, do not",
            "do not \u{1f64f} open the fridge",
            "don't \u{1f621}\u{1f621} pick up the mug \u{1f375}",
            "wash the \u{1f954}",
            "pick up the \u{1f34c} next to the mug",
            "\u{1f44d}",
            "open the \u{1f6aa}",
            "??? !!! ...",
            "...",
            "?",
            "open the fridge\u{202e} ton od",
            "\u{202e}egdirf eht nepo",
            "do \u{200f}not open the fridge",
            "\u{2067}do not open the fridge\u{2069}",
            "do\u{200b} not open the fridge",
            "do not\u{feff} open the fridge",
            "do n\u{f6}t \u{f6}pen the fridge tomorrow",
            "do not open the fri\u{301}dge",
            "open\u{0}the fridge",
            "open the fridge\u{1b}[2J not",
            "",
            "   ",
            "\t",
            "\n",
            "do not\nopen the fridge",
        ]),
    );
}

#[test]
fn brackets_and_slots_are_only_words() {
    nothing_comes_of(
        "slots",
        &owned(&[
            "<obj>",
            "pick up the <obj>",
            "pick up <obj:1>",
            "PICKUP Mug; GOTO Fridge, do not",
            "do not GOTO Fridge",
            "wash the <obj> next to the <obj:2>",
            "open the {fridge}, no",
            "do not open the \"fridge\"",
            "do not (open the fridge)",
            "(do not) open the fridge",
            "[not] open the fridge",
            "open the fridge // not",
            "open the fridge /* not really */ tomorrow",
            "=fridge",
            "%s %d open the fridge never",
            "null",
            "true",
            "-1",
            "0",
            "it",
            "the",
        ]),
    );
}
