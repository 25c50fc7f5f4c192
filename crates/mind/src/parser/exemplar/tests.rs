use super::*;
use crate::numerics::Kernel;

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

#[test]
fn unknown_verbs_get_not_sure_with_the_nearest_exemplars_as_evidence() {
    let (parser, _) = trained(SEEDS);
    let parse = parser.parse(&Clause::of(&LiftedUtterance::parse("refrigerate the <obj>")));
    assert_eq!(parse.candidates, []);
    assert_eq!(parse.exact, 0);
    assert_eq!(parse.nearest.len(), 3);
    assert_eq!(parse.threshold, parser.threshold());
    assert!(parse.nearest[0].distance > parse.threshold);
    assert!(parse.nearest.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
    let first = &parse.nearest[0];
    assert_eq!(parser.exemplars()[first.number as usize].utterance, first.exemplar);
}

#[test]
fn one_example_is_enough_for_its_own_wording() {
    let lesson = "wash the <obj> := GOTO SinkBasin; PUT <obj:1> SinkBasin; TOGGLE Faucet";
    let (before, _) = trained(SEEDS);
    assert_eq!(answer(&before, "wash the <obj>"), None);
    let settings = ExemplarSettings { nearest: 25, ..ExemplarSettings::default() };
    let (after, figures) = trained_with(&settings, &format!("{SEEDS}\n{lesson}"));
    let parse = after.parse(&Clause::of(&LiftedUtterance::parse("wash the <obj>")));
    assert!(parse.exact > 0);
    assert_eq!(parse.candidates[0].number, 24);
    assert_eq!(parse.candidates[0].distance, 0.0);
    assert_eq!(parse.nearest[0].number, 24);
    // "wash the <obj>" was an unknown request; now it is neither right nor wrong, and so is
    // whatever else would be taken for the lesson.
    let answers = UNKNOWN.map(|text| {
        let lifted = LiftedUtterance::parse(text);
        let fits = |near: &Near| near.program.slots() <= lifted.slots();
        after.parse(&Clause::of(&lifted)).nearest.into_iter().find(fits).unwrap().number
    });
    assert_eq!(answers[0], 24);
    let counted = answers.iter().filter(|&&number| number != 24).count();
    assert_eq!(figures["unknown"], counted as f64);
}

#[test]
fn every_exemplar_gets_its_own_program_even_where_stop_words_hide_the_difference() {
    let twins = "
        turn on the <obj> := TOGGLE <obj:1>
        turn to the <obj> := GOTO <obj:1>
        turn from the <obj> := GOTO <obj:1>; TOGGLE <obj:1>
    ";
    let (parser, figures) = trained(twins);
    for exemplar in parser.exemplars() {
        let parse = parser.parse(&Clause::of(&exemplar.utterance));
        assert!(parse.exact > 0);
        assert_eq!(parse.candidates[0].program, exemplar.program);
        assert_eq!(parse.candidates.len(), 3, "the others are as near");
    }
    assert!((figures["self_recall"] - 1.0 / 3.0).abs() < 1e-9);
    // Nobody's wording: the oldest of the three comes first.
    let parse = parser.parse(&Clause::of(&LiftedUtterance::parse("turn off the <obj>")));
    assert_eq!(parse.candidates[0].number, 0);
    assert_eq!(parse.exact, 0);
}

#[test]
fn candidates_are_distinct_and_can_be_filled() {
    let (parser, _) = trained_with(
        &ExemplarSettings { beta: 2.0, ..ExemplarSettings::default() },
        &format!("{SEEDS}\n place the <obj> left of <obj> on <obj> := PUT <obj:1> <obj:3>"),
    );
    let parse = parser.parse(&Clause::of(&LiftedUtterance::parse("fetch the <obj>")));
    let programs: Vec<_> = parse.candidates.iter().map(|c| c.program.to_string()).collect();
    // Everything is near enough, and one mention fills one slot.
    assert_eq!(programs.len(), 5, "{programs:?}");
    assert!(programs.iter().all(|program| !program.contains("<obj:2>")), "{programs:?}");
    assert!(parse.candidates.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
}

/// A table of these words with vectors drawn at random: it never changes, unlike those that ship.
fn drawn_table(words: &str) -> &'static WordTable {
    let words: std::collections::BTreeSet<&str> = words.split_whitespace().collect();
    let mut rng = crate::numerics::Rng::from_u64(1);
    let mut bytes = b"APWT".to_vec();
    for number in [1, 20, words.len() as u32] {
        bytes.extend(number.to_le_bytes());
    }
    for word in &words {
        bytes.push(word.len() as u8);
        bytes.extend(word.as_bytes());
    }
    for number in [0.01f32, 0.001] {
        words.iter().for_each(|_| bytes.extend(number.to_le_bytes()));
    }
    (0..words.len() * 20).for_each(|_| bytes.push(rng.next_u64() as u8));
    Box::leak(Box::new(WordTable::parse(&bytes).unwrap()))
}

#[test]
fn trained_bits_are_these_in_every_build_and_on_every_machine() {
    let words = drawn_table("go walk move find pick grab take put place set open object");
    // Named here, so that a better default is no other arithmetic.
    let settings = ExemplarSettings {
        hidden: 100,
        embedding: 50,
        learning_rate: 3e-3,
        weight_decay: 0.01,
        steps_max: 40,
        stop_loss: 0.0,
        a_start: 5.0,
        b_start: -2.5,
        word_scale: 1.0,
        position_scale: 0.5,
        ..ExemplarSettings::default()
    };
    let seed = Digest::of(b"pinned");
    let (variants, unknown) = (exemplars(VARIANTS), UNKNOWN.map(LiftedUtterance::parse));
    let calibration = Calibration { variants: &variants, unknown: &unknown };
    let (parser, _) =
        ExemplarParser::train(&settings, words, seed, &exemplars(SEEDS), calibration).unwrap();
    // Another value means other arithmetic or another algorithm: every recorded mind is then of
    // another numerics version.
    assert_eq!(Digest::of(&bits(&parser)).short(), "8ae5c55698c7");
}

fn bits(parser: &ExemplarParser) -> Vec<u8> {
    serde_json::to_vec(parser.weights()).unwrap()
}

#[test]
fn the_same_arguments_give_the_same_bits_with_every_kernel() {
    let short = ExemplarSettings { steps_max: 12, ..ExemplarSettings::default() };
    let train = || bits(&trained_with(&short, SEEDS).0);
    let expected = Kernel::Plain.run(train);
    for kernel in Kernel::available() {
        assert_eq!(kernel.run(train), expected, "{kernel:?}");
    }
    assert_eq!(train(), expected);
    let salted = ExemplarSettings { salt: "another".to_owned(), ..short.clone() };
    assert_ne!(bits(&trained_with(&salted, SEEDS).0), expected);
}

#[test]
fn a_restored_parser_answers_like_the_trained_one() {
    let (parser, _) = trained(SEEDS);
    let weights: ExemplarWeights = serde_json::from_slice(&bits(&parser)).unwrap();
    let words = WordTable::builtin("paper").unwrap();
    let settings = ExemplarSettings::default();
    let restored =
        ExemplarParser::restore(&settings, words, &exemplars(SEEDS), weights.clone()).unwrap();
    for text in ["fetch the <obj>", "put the <obj> on the <obj>", "", "zonk", "<color> <obj=sink>"]
    {
        let lifted = LiftedUtterance::parse(text);
        assert_eq!(
            restored.parse(&Clause::of(&lifted)),
            parser.parse(&Clause::of(&lifted)),
            "{text}"
        );
    }
    let refuse = |weights: ExemplarWeights| {
        let examples = exemplars(SEEDS);
        ExemplarParser::restore(&settings, words, &examples, weights).unwrap_err().to_string()
    };
    let mut short = weights.clone();
    short.parameters.0.pop();
    assert!(refuse(short).contains("parameters, expected"));
    let mut broken = weights.clone();
    broken.parameters[7] = f32::NAN;
    assert!(refuse(broken).contains("not a finite number"));
    let mut broken = weights;
    broken.threshold = -1.0;
    assert!(refuse(broken).contains("threshold"));
}

#[test]
fn nothing_is_learned_from_nothing() {
    let train = |text| {
        let words = WordTable::builtin("paper").unwrap();
        let settings = ExemplarSettings::default();
        let calibration = Calibration::default();
        ExemplarParser::train(&settings, words, Digest::ZERO, &exemplars(text), calibration)
    };
    assert_eq!(train("").unwrap_err(), TrainFault::NoExemplars);
    assert_eq!(train("a := GOTO A\n := GOTO A").unwrap_err(), TrainFault::NoWords { number: 1 });
    // One exemplar alone has no pair, and yet is known.
    let (parser, figures) = train("wash the <obj> := GOTO <obj:1>").unwrap();
    assert_eq!(figures["steps"], 0.0);
    assert_eq!(parser.threshold(), 0.15);
    assert_eq!(answer(&parser, "wash the <obj>").unwrap(), "GOTO <obj:1>");
}

#[test]
fn an_embedding_does_not_depend_on_what_is_embedded_beside_it() {
    let (parser, _) = trained(SEEDS);
    let long = "go <obj> ".repeat(75);
    let texts = ["put the <obj> on the <obj>", long.as_str(), "zonk", "the"];
    let lifted = texts.map(LiftedUtterance::parse);
    let together = parser.embed_all(&lifted.each_ref());
    for (text, row) in texts.iter().zip(together.chunks_exact(64)) {
        let alone = parser.embed(&LiftedUtterance::parse(text));
        assert_eq!(alone, row, "{text}");
        assert!((crate::numerics::norm(&alone) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn no_utterance_upsets_the_parser() {
    let (parser, _) = trained(SEEDS);
    let seed = 53;
    println!("seed {seed}");
    let mut rng = crate::numerics::Rng::from_u64(seed);
    let words =
        ["go", "<obj>", "<color=red>", "🍵", "the", "ÄÖ", "<>", "<=>", ",", "a\u{301}", "put"];
    for _ in 0..300 {
        let length = rng.below(200);
        let text: Vec<&str> = (0..length).map(|_| words[rng.below(words.len())]).collect();
        let parse = parser.parse(&Clause::of(&LiftedUtterance::parse(&text.join(" "))));
        assert!(parse.candidates.iter().all(|c| c.distance <= parse.threshold), "{text:?}");
        assert!(parse.nearest.iter().all(|near| near.distance.is_finite()), "{text:?}");
        assert_eq!(parse.nearest.is_empty(), text.is_empty());
    }
}
