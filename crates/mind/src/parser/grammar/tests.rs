use super::*;

fn settings(classes: &[(&str, &[&str])], requests: &[(&str, &str)]) -> GrammarSettings {
    let owned = |phrases: &[&str]| phrases.iter().map(|phrase| (*phrase).to_owned()).collect();
    GrammarSettings {
        silent: ["please".to_owned()].into(),
        classes: classes.iter().map(|(name, all)| ((*name).to_owned(), owned(all))).collect(),
        requests: requests
            .iter()
            .map(|(says, means)| ((*says).to_owned(), means.parse().unwrap()))
            .collect(),
    }
}

const CLASSES: [(&str, &[&str]); 4] = [
    ("obj", &["{the} <obj>", "{the} <obj> {near} {obj}"]),
    ("the", &["the", "a", ""]),
    ("near", &["on", "next to"]),
    ("down", &["", "down"]),
];

const REQUESTS: [(&str, &str); 3] = [
    ("take <obj:1>", "TAKE <obj:1>"),
    ("put <obj:1> {down} on <obj:2>", "PUT <obj:1> <obj:2>"),
    ("on <obj:2> put <obj:1>", "PUT <obj:1> <obj:2>"),
];

fn parser() -> GrammarParser {
    let exemplar = Exemplar {
        utterance: LiftedUtterance::parse("take the <obj>"),
        program: "TAKE <obj:1>".parse().unwrap(),
    };
    GrammarParser::new(&settings(&CLASSES, &REQUESTS), &[exemplar]).unwrap()
}

fn read(text: &str) -> String {
    let program = parser().read(&LiftedUtterance::parse(text));
    program.map_or("?".to_owned(), |program| program.to_string())
}

#[test]
fn an_utterance_means_what_its_request_means_about_its_own_mentions() {
    assert_eq!(read("take the <obj>"), "TAKE <obj:1>");
    assert_eq!(read("please take <obj> please"), "TAKE <obj:1>");
    assert_eq!(read("put a <obj> down on the <obj>"), "PUT <obj:1> <obj:2>");
    assert_eq!(read("on the <obj> put <obj>"), "PUT <obj:2> <obj:1>");
    assert_eq!(read("take the <obj> next to the <obj> on the <obj>"), "TAKE <obj:1>");
    assert_eq!(read("put the <obj> next to the <obj> on the <obj>"), "PUT <obj:1> <obj:3>");
}

#[test]
fn of_two_ways_to_read_it_the_first_phrases_are_the_shortest() {
    assert_eq!(read("put the <obj> on the <obj> on the <obj>"), "PUT <obj:1> <obj:2>");
}

#[test]
fn what_is_not_in_the_grammar_is_not_understood() {
    for text in
        ["", "take", "take the", "take the <obj> away", "the <obj>", "take <arm>", "wash the <obj>"]
    {
        assert_eq!(read(text), "?", "{text:?}");
    }
}

#[test]
fn a_long_sentence_is_read_in_a_moment() {
    let chain = " on the <obj>".repeat(48);
    assert_eq!(read(&format!("take the <obj>{chain}")), "TAKE <obj:1>");
    assert_eq!(read(&format!("put the <obj>{chain} away")), "?");
}

#[test]
fn an_answer_says_that_the_grammar_gave_it_and_is_certain() {
    let parse = parser().parse(&Clause::of(&LiftedUtterance::parse("take the <obj>")));
    assert_eq!((parse.candidates.len(), parse.exact, parse.threshold), (1, 1, 0.0));
    let scored = &parse.candidates[0];
    assert_eq!((scored.by, scored.distance), (Some(Answerer::Grammar), 0.0));
    assert_eq!((scored.number, parse.nearest[0].number), (0, 0));
    let parse = parser().parse(&Clause::of(&LiftedUtterance::parse("take a <obj>")));
    assert_eq!((parse.candidates[0].number, parse.nearest.len()), (0, 0));
    let other = parser().parse(&Clause::of(&LiftedUtterance::parse("put <obj> on <obj>")));
    assert_eq!(other.candidates[0].number, Scored::OF_NONE);
}

#[test]
fn a_grammar_that_cannot_be_read_says_why() {
    let check = |classes: &[(&str, &[&str])], requests: &[(&str, &str)], reason: &str| {
        let (_, found) = settings(classes, requests).check().unwrap_err();
        assert!(found.contains(reason), "{found}");
    };
    check(&CLASSES, &[("take {it}", "TAKE <obj:1>")], "there is no class \"it\"");
    check(&CLASSES, &[("take <arm:1>", "TAKE <arm:1>")], "there is no class \"arm\"");
    check(&CLASSES, &[("take <obj:0>", "TAKE Arm")], "has no number from 1 on");
    check(&CLASSES, &[("take <obj:1>", "PUT <obj:1> <obj:2>")], "needs an argument");
    check(&CLASSES, &[("take <obj:2>", "TAKE <obj:2>")], "expected the argument 1 once");
    check(&CLASSES, &[], "at least one request");
    check(&[("a", &["<b:1>"]), ("b", &[])], &[("a", "A X")], "numbers an argument");
    let around: [(&str, &[&str]); 3] =
        [("a", &["{c} {b} x"]), ("b", &["{a}"]), ("c", &["", "please"])];
    check(&around, &[("{a}", "A X")], "may begin with itself");
}
