use super::*;

/// `utterance := program` lines.
fn exemplars(text: &str) -> Vec<Exemplar> {
    let line = |line: &str| {
        let (utterance, program) = line.split_once(":=").unwrap();
        Exemplar {
            utterance: LiftedUtterance::parse(utterance),
            program: program.trim().parse().unwrap(),
        }
    };
    text.lines().map(str::trim).filter(|l| !l.is_empty()).map(line).collect()
}

const SEEDS: &str = "
    go to the <obj> := GOTO <obj:1>
    walk to the <obj> := GOTO <obj:1>
    move to the <obj> := GOTO <obj:1>
    head over to the <obj> := GOTO <obj:1>
    find the <obj> := GOTO <obj:1>
    pick up the <obj> := PICKUP <obj:1>
    pick up the <obj> from the <obj> := PICKUP <obj:1>
    grab the <obj> := PICKUP <obj:1>
    take the <obj> from the <obj> := PICKUP <obj:1>
    get the <obj> := PICKUP <obj:1>
    put the <obj> on the <obj> := PUT <obj:1> <obj:2>
    place the <obj> in the <obj> := PUT <obj:1> <obj:2>
    set the <obj> down on the <obj> := PUT <obj:1> <obj:2>
    drop the <obj> in the <obj> := PUT <obj:1> <obj:2>
    open the <obj> := OPEN <obj:1>
    open up the <obj> := OPEN <obj:1>
    pull the <obj> open := OPEN <obj:1>
    close the <obj> := CLOSE <obj:1>
    shut the <obj> := CLOSE <obj:1>
    push the <obj> closed := CLOSE <obj:1>
    turn on the <obj> := TOGGLE <obj:1>
    switch off the <obj> := TOGGLE <obj:1>
    toggle the <obj> := TOGGLE <obj:1>
    flip the <obj> := TOGGLE <obj:1>
";

const VARIANTS: &str = "
    please go to the <obj> := GOTO <obj:1>
    go over to the <obj> := GOTO <obj:1>
    grab the <obj> from the <obj> := PICKUP <obj:1>
    pick the <obj> up := PICKUP <obj:1>
    get the <obj> from the <obj> := PICKUP <obj:1>
    put the <obj> down on the <obj> := PUT <obj:1> <obj:2>
    place the <obj> on top of the <obj> := PUT <obj:1> <obj:2>
    open the <obj> now := OPEN <obj:1>
    close the <obj> again := CLOSE <obj:1>
    turn the <obj> off := TOGGLE <obj:1>
";

const UNKNOWN: [&str; 6] = [
    "wash the <obj>",
    "chill the <obj>",
    "heat the <obj>",
    "slice the <obj> with the <obj>",
    "examine the <obj>",
    "zonk the <obj>",
];

fn trained_with(settings: &ExemplarSettings, text: &str) -> (ExemplarParser, Figures) {
    let unknown = UNKNOWN.map(LiftedUtterance::parse);
    let calibration = Calibration { variants: &exemplars(VARIANTS), unknown: &unknown };
    let words = WordTable::builtin("paper").unwrap();
    let seed = Digest::of(b"test");
    ExemplarParser::train(settings, words, seed, &exemplars(text), calibration).unwrap()
}

fn trained(text: &str) -> (ExemplarParser, Figures) {
    trained_with(&ExemplarSettings::default(), text)
}

fn answer(parser: &ExemplarParser, text: &str) -> Option<String> {
    let parse = parser.parse(&Clause::of(&LiftedUtterance::parse(text)));
    parse.candidates.first().map(|candidate| candidate.program.to_string())
}

#[test]
fn other_wordings_of_the_seeds_are_understood() {
    let (parser, figures) = trained(SEEDS);
    println!("{figures:#?}");
    assert_eq!(answer(&parser, "please walk over to the <obj>").unwrap(), "GOTO <obj:1>");
    assert!(figures["variants_right_forced"] >= 0.8, "{figures:#?}");
    assert!(figures["accepted_precision"] >= 0.9, "{figures:#?}");
    assert!(parser.threshold() >= 0.15);
}
