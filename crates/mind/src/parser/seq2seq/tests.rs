use super::*;
use crate::language::{Operator, Symbol};

pub(super) fn signature() -> Signature {
    let operator = |(name, args): (&str, usize)| Operator {
        name: Symbol::new(name),
        args: vec![Symbol::new("obj"); args],
    };
    Signature { operators: [("GOTO", 1), ("PICKUP", 1), ("PUT", 2)].map(operator).to_vec() }
}

fn exemplar((utterance, program): (&str, &str)) -> Exemplar {
    let utterance = LiftedUtterance::parse(utterance);
    Exemplar { utterance, program: program.parse().unwrap() }
}

const SEEDS: usize = 6;

/// Six seeds and two lessons.
pub(super) fn lessons() -> Vec<Exemplar> {
    [
        ("go to the <obj>", "GOTO <obj:1>"),
        ("walk over to the <obj>", "GOTO <obj:1>"),
        ("pick up the <obj>", "PICKUP <obj:1>"),
        ("grab the <obj> from the <obj>", "PICKUP <obj:1>"),
        ("put the <obj> in the <obj>", "PUT <obj:1> <obj:2>"),
        ("place the <obj> on the <obj>", "PUT <obj:1> <obj:2>"),
        ("wash <obj>", "GOTO Sink; PUT <obj:1> Sink; PICKUP <obj:1>"),
        ("on the <obj> set the <obj> down", "GOTO <obj:1>; PUT <obj:2> <obj:1>"),
    ]
    .map(exemplar)
    .to_vec()
}

pub(super) fn vocabulary(examples: &[Exemplar]) -> Vocabulary {
    Vocabulary::new(&signature(), &examples.iter().collect::<Vec<_>>())
}

fn settings() -> Seq2SeqSettings {
    Seq2SeqSettings { units: 16, token: 8, batch: 4, ..Seq2SeqSettings::default() }
}

fn train(examples: &[Exemplar]) -> (Seq2SeqParser, Figures) {
    let words = WordTable::builtin("paper").unwrap();
    let seed = Digest::of(b"a test");
    Seq2SeqParser::train(&settings(), words, &signature(), seed, examples, SEEDS).unwrap()
}

fn write(parser: &Seq2SeqParser, text: &str) -> String {
    let written = parser.write(&LiftedUtterance::parse(text));
    written.map_or("?".to_owned(), |(program, _)| program.to_string())
}

#[test]
fn what_it_was_shown_it_writes() {
    let examples = lessons();
    let (parser, figures) = train(&examples);
    println!("{figures:?}");
    for exemplar in &examples {
        let (program, probability) = parser.write(&exemplar.utterance).unwrap();
        assert_eq!(program, exemplar.program, "{}", exemplar.utterance);
        assert!(probability > 0.8, "{}: {probability}", exemplar.utterance);
        let parse = parser.parse(&Clause::of(&exemplar.utterance));
        assert_eq!(parse.exact, 1);
        assert_eq!(parser.exemplars()[parse.candidates[0].number as usize], *exemplar);
    }
    // Copied from where they stand, wherever that is.
    assert_eq!(write(&parser, "pick up a <obj>"), "PICKUP <obj:1>");
    assert_eq!(write(&parser, "put a <obj> in a <obj>"), "PUT <obj:1> <obj:2>");
}

#[test]
fn it_always_answers_with_a_program_of_the_signature() {
    let (parser, _) = train(&lessons());
    let signature = signature();
    for text in
        ["juggle the <obj>", "sing", "the of <obj> <obj> <obj> <obj> <obj> and so on", "<arm>"]
    {
        let parse = parser.parse(&Clause::of(&LiftedUtterance::parse(text)));
        let scored = &parse.candidates[0];
        assert!(scored.distance <= parse.threshold && scored.by == Some(Answerer::Seq2seq));
        assert!(scored.program.slots() <= LiftedUtterance::parse(text).slots(), "{text}");
        for step in &scored.program.steps {
            let operator = signature.operators.iter().find(|o| o.name == step.operator).unwrap();
            assert_eq!(operator.args.len(), step.args.len(), "{text}: {}", scored.program);
        }
    }
    // Before the first lesson no constant is known: there is nothing to fill an argument with.
    let (parser, _) = train(&lessons()[..SEEDS]);
    assert_eq!(write(&parser, "sing"), "?");
    assert_ne!(write(&parser, "juggle the <obj>"), "?");
}

#[test]
fn a_training_is_a_function_of_its_arguments() {
    let examples = lessons();
    let [(one, figures), (two, again)] = [train(&examples), train(&examples)];
    assert_eq!((one.weights(), figures), (two.weights(), again));
    let mut other = settings();
    other.salt = "other".to_owned();
    let words = WordTable::builtin("paper").unwrap();
    let seed = Digest::of(b"a test");
    let (salted, _) =
        Seq2SeqParser::train(&other, words, &signature(), seed, &examples, SEEDS).unwrap();
    assert_ne!(salted.weights(), one.weights());
}

#[test]
fn weights_that_do_not_fit_are_refused() {
    let examples = lessons();
    let (parser, _) = train(&examples);
    let words = WordTable::builtin("paper").unwrap();
    let restore = |examples: &[Exemplar], weights: Seq2SeqWeights| {
        Seq2SeqParser::restore(&settings(), words, &signature(), examples, SEEDS, weights)
    };
    let restored = restore(&examples, parser.weights().clone()).unwrap();
    assert_eq!(restored.weights(), parser.weights());
    let other = [&examples[..], &[exemplar(("dry <obj>", "PUT <obj:1> Rack"))]].concat();
    let error = restore(&other, parser.weights().clone()).unwrap_err().to_string();
    assert!(error.contains("parameters, expected"), "{error}");
    let mut broken = parser.weights().clone();
    broken.parameters[7] = f32::NAN;
    let error = restore(&examples, broken).unwrap_err().to_string();
    assert!(error.contains("not a finite number"), "{error}");
}

#[test]
fn a_lesson_with_the_words_of_a_seed_does_not_change_the_seed() {
    let against = exemplar(("go to the <obj>", "PICKUP <obj:1>"));
    let twice = [("tidy <obj>", "PUT <obj:1> Sink"), ("tidy <obj>", "GOTO <obj:1>")].map(exemplar);
    let examples = [&lessons()[..], &[against], &twice].concat();
    let (parser, figures) = train(&examples);
    assert_eq!(figures["learned"], (examples.len() - 1) as f64);
    assert_eq!(write(&parser, "go to the <obj>"), "GOTO <obj:1>");
    // Of two programs for the same words one is written, and the training ends all the same.
    assert!(twice.iter().any(|one| one.program.to_string() == write(&parser, "tidy <obj>")));
    assert!(figures["epochs"] < 300.0, "{figures:?}");
}
