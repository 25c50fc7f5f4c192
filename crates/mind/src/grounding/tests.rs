use super::bench::{Bench, Overlap, Scene, exemplars, say};
use super::*;
use crate::language::{Answer, Outcome, Symbol};
use crate::world::{Edition, Words};

/// As in the recipe `paper`.
fn plain() -> (Abstraction, Execution) {
    let abstraction = Abstraction {
        adjectives: false,
        compounds: false,
        locations: false,
        fixtures: false,
        spelling: false,
        split: Split::And,
        lists: None,
        ..Abstraction::default()
    };
    (abstraction, Execution::default())
}

/// As in the recipe `default`, and fixtures.
fn rich() -> (Abstraction, Execution) {
    let abstraction = Abstraction {
        adjectives: true,
        compounds: true,
        locations: true,
        fixtures: true,
        spelling: true,
        split: Split::Clauses,
        lists: None,
        ..Abstraction::default()
    };
    (abstraction, Execution { polarity: true, approach: true, ..Execution::default() })
}

fn known(word: &str) -> bool {
    !["blokc", "toolbox", "tabl", "lampp"].contains(&word)
}

fn lifted(settings: &(Abstraction, Execution), text: &str) -> String {
    let bench = Bench::new();
    let whole = Abstractor::new(bench.lexicon(Edition::First), &settings.0, &known)
        .read(&say(text))
        .whole();
    whole.lifted.to_string()
}

struct Talk {
    settings: (Abstraction, Execution),
    taught: Vec<(&'static str, &'static str)>,
    scene: Scene,
    mentioned: Option<Symbol>,
}

impl Talk {
    fn new(things: &str) -> Talk {
        let scene = Scene::with(things);
        Talk { settings: plain(), taught: Vec::new(), scene, mentioned: None }
    }

    fn answer(&self, text: &str) -> Answer {
        let bench = Bench::new();
        let mut known_exemplars = bench.seeds().exemplars.clone();
        let seeds = known_exemplars.len() as u32;
        known_exemplars.extend(exemplars(&self.taught));
        let parser = Overlap { exemplars: known_exemplars, threshold: 0.4 };
        let interpreter = Interpreter {
            abstraction: &self.settings.0,
            execution: &self.settings.1,
            parser: &parser,
            known: &known,
            reranker: None,
            seeds,
            edition: Edition::First,
            ask_below: 0,
        };
        let mentioned = self.mentioned.as_ref();
        let moment =
            Moment { domain: &bench, scene: &self.scene, task: &(), mentioned, handled: &[] };
        interpreter.interpret(&moment, &say(text))
    }

    /// `TAKE Block`, `! TAKE Brick @0: reason` or `?`.
    fn check(&self, text: &str, expected: &str) {
        let found = match self.answer(text).outcome {
            Outcome::Understood { program, .. } => program.to_string(),
            Outcome::Impossible { program, step, reason } => {
                format!("! {program} @{step}: {reason}")
            }
            Outcome::Asked { question } => format!("~ {}", question.text),
            Outcome::Told { text } => format!("i {text}"),
            Outcome::NotSure => "?".to_owned(),
        };
        assert_eq!(found, expected, "{text:?}");
    }
}

#[test]
fn the_longest_name_wins_and_plurals_count() {
    let check = |text, expected: &str| assert_eq!(lifted(&plain(), text), expected);
    check("Take the TOOL box!", "take the <thing>");
    check("take the box", "take the <thing>");
    check(
        "take the boxes, the knives and the blocks",
        "take the <thing> the <thing> and the <thing>",
    );
    check("take the red box", "take the red <thing>");
    check("take the tool, box", "take the tool <thing>");
    check("pick it up", "pick <thing> up");
    check("frobnicate", "frobnicate");
}

#[test]
fn the_options_of_abstraction_do_what_they_say() {
    let check = |text, expected: &str| assert_eq!(lifted(&rich(), text), expected);
    check("take the small wooden box", "take the <thing>");
    check("take the table box", "take the <thing>");
    check("red box", "red <thing>");
    check("take the blokc", "take the <thing>");
    check("take the toolbox", "take the <thing>");
    check("take the tabl", "take the <thing>");
    check("take the black", "take the black");
    check("turn off the lamp", "turn off the <thing=lamp>");
    check("turn off the lampp", "turn off the lampp");
}

#[test]
fn swallowed_words_are_kept_beside_their_slot() {
    let bench = Bench::new();
    let settings = rich().0;
    let clause = Abstractor::new(bench.lexicon(Edition::First), &settings, &known)
        .read(&say("put the small wooden box in the red tool box"))
        .whole();
    assert_eq!(clause.attributes, [vec!["small", "wooden"], vec!["red"]]);
    assert_eq!(clause.words.join(" "), "put the small wooden box in the red tool box");
    let surfaces: Vec<&str> = clause.mentions.iter().map(|m| m.surface.as_str()).collect();
    assert_eq!(surfaces, ["box", "tool box"]);
}

#[test]
fn a_place_that_is_no_argument_can_be_left_out() {
    let bench = Bench::new();
    let settings = rich().0;
    let read = |text| {
        Abstractor::new(bench.lexicon(Edition::First), &settings, &known).read(&say(text)).whole()
    };
    let clause = without_locations(&read("take the box from the table to the lamp")).unwrap();
    assert_eq!(clause.lifted.to_string(), "take the <thing> to the <thing=lamp>");
    assert_eq!(clause.mentions[1].surface, "lamp");
    assert_eq!(without_locations(&read("from the table take the box")), None);
    let mut talk = Talk::new("Box Table");
    talk.check("take the box from the table", "?");
    talk.settings = rich();
    talk.check("take the box from the table", "TAKE Box");
}

#[test]
fn mentions_beyond_the_limit_stay_words() {
    let text = "take the box ".repeat(20);
    let found = lifted(&plain(), &text);
    assert_eq!(found.matches("<thing>").count(), crate::limits::MENTIONS_MAX);
    assert!(found.ends_with("take the box"));
}

#[test]
fn an_utterance_is_split_at_and_and_it_follows_the_hand() {
    let talk = Talk::new("Box ToolBox Table");
    talk.check("take the box and put it in the tool box", "TAKE Box; PUT Box ToolBox");
    talk.check(
        "take the box and put it in the tool box and take the tool box",
        "TAKE Box; PUT Box ToolBox; TAKE ToolBox",
    );
    let talk = Talk { settings: rich(), ..talk };
    talk.check("take the box, then place it on the table", "TAKE Box; PUT Box Table");
    talk.check("take the box. and put it in the tool box", "TAKE Box; PUT Box ToolBox");
}

#[test]
fn and_between_nouns_breaks_nothing() {
    let mut talk = Talk::new("Box Knife Table");
    talk.check(
        "take the box and the knife",
        "! TAKE Box; TAKE Knife @1: the hand already holds the Box",
    );
    talk.taught = vec![(
        "take the <thing> and the <thing>",
        "TAKE <thing:1>; PUT <thing:1> Table; TAKE <thing:2>",
    )];
    talk.check("take the box and the knife", "TAKE Box; PUT Box Table; TAKE Knife");
    talk.check("take the knife and the box", "TAKE Knife; PUT Knife Table; TAKE Box");
}

#[test]
fn it_is_what_the_hand_holds_else_what_was_named_last() {
    let mut talk = Talk::new("Box Knife Table");
    talk.taught = vec![("pick <thing> up", "TAKE <thing:1>")];
    talk.check(
        "pick it up",
        "! TAKE it @0: nothing was named before that \"it\" could mean, and the robot holds nothing",
    );
    talk.mentioned = Some(Symbol::new("Knife"));
    talk.check("pick it up", "TAKE Knife");
    talk.scene = talk.scene.clone().holding("Box");
    talk.check("place it on the table", "PUT Box Table");
    talk.check("put down", "PUT Box Table");
    assert_eq!(talk.answer("pick it up").mentioned, Some(Symbol::new("Box")));
}

#[test]
fn held_in_a_program_needs_something_in_the_hand() {
    let talk = Talk::new("Table");
    talk.check("put down", "! PUT <held> Table @0: the robot holds nothing");
}

#[test]
fn understood_but_impossible_is_not_not_sure() {
    let talk = Talk::new("Lamp Box Table");
    talk.check("take the lamp", "! TAKE Lamp @0: the Lamp is too heavy");
    talk.check("frobnicate the lamp", "?");
    talk.check(
        "take the box and take the lamp",
        "! TAKE Box; TAKE Lamp @1: the hand already holds the Box",
    );
    talk.check(
        "take the lamp and put it in the box",
        "! TAKE Lamp; PUT Lamp Box @0: the Lamp is too heavy",
    );
}

#[test]
fn a_name_of_several_types_means_the_one_that_works() {
    let talk = Talk::new("Block Brick Table");
    talk.check("take the block", "TAKE Block");
    let talk = Talk::new("Brick *Block Table");
    talk.check("take the block", "! TAKE Brick @0: the Brick is too heavy");
    let talk = Talk::new("Brick Table").with_order("Brick Block");
    talk.check("take the block", "TAKE Block");
}

impl Talk {
    /// Puts the last of `things` within reach, though names are tried in alphabetical order.
    fn with_order(mut self, things: &str) -> Talk {
        self.scene.here.extend(things.split(' ').map(Symbol::new));
        self
    }
}

#[test]
fn an_exact_form_decides_even_when_the_world_forbids_it() {
    let mut talk = Talk::new("Lamp Table");
    talk.taught = vec![("grab off the <thing>", "SWITCH <thing:1>")];
    talk.check("grab the lamp", "! TAKE Lamp @0: the Lamp is too heavy");
    talk.check("grab off the lamp", "SWITCH Lamp");
}

#[test]
fn a_seed_keeps_its_program_beside_a_lesson_with_the_same_words() {
    let mut talk = Talk::new("Box Table *Knife");
    talk.taught = vec![("grab the <thing>", "GO <thing:1>; TAKE <thing:1>")];
    talk.check("grab the box", "TAKE Box");
    talk.check("grab the knife", "GO Knife; TAKE Knife");
}

#[test]
fn turning_off_what_is_off_is_impossible_where_the_recipe_minds() {
    let mut talk = Talk::new("Lamp");
    talk.check("turn off the lamp", "SWITCH Lamp");
    talk.settings = (plain().0, rich().1);
    talk.check("turn off the lamp", "! SWITCH Lamp @0: the Lamp is already off");
    talk.check("turn on the lamp", "SWITCH Lamp");
}

#[test]
fn the_way_to_a_far_thing_is_taken_unasked_where_the_recipe_says_so() {
    let mut talk = Talk::new("*Box *Lamp Table");
    talk.check("take the box", "! TAKE Box @0: the Box is too far away");
    talk.settings = (plain().0, rich().1);
    talk.check("take the box", "GO Box; TAKE Box");
    talk.check("turn off the lamp", "! SWITCH Lamp @0: the Lamp is already off");
    talk.check("take the lamp", "! TAKE Lamp @0: the Lamp is too heavy");
}

#[test]
fn the_evidence_says_what_was_near_and_what_was_dropped() {
    let talk = Talk::new("Box Lamp Table");
    let unsure = talk.answer("juggle the box");
    assert_eq!(unsure.outcome, Outcome::NotSure);
    assert_eq!(unsure.evidence.nearest.len(), 3);
    assert!(unsure.evidence.nearest.iter().all(|near| near.distance > unsure.evidence.threshold));
    assert_eq!(unsure.mentioned, Some(Symbol::new("Box")));
    let half = talk.answer("take the box and juggle the lamp");
    assert_eq!(half.outcome, Outcome::NotSure);
    let lifted: Vec<String> = half.evidence.lifted.iter().map(ToString::to_string).collect();
    assert_eq!(lifted, ["take the <thing>", "juggle the <thing>"]);
    let wordy = talk.answer("place the on the box");
    assert_eq!(wordy.outcome, Outcome::NotSure);
    let dropped = &wordy.evidence.discarded[0];
    assert_eq!(dropped.program.to_string(), "PUT Box <thing:2>");
    assert_eq!(dropped.reason, "it takes 2 named things, and 1 were named");
}

#[test]
fn a_reranker_learns_which_program_fits_the_scene() {
    let bench = Bench::new();
    let near = Scene::with("Box Table");
    let far = Scene::with("*Box Table");
    let choice = |scene: &Scene, right: usize| {
        let moment = Moment { domain: &bench, scene, task: &(), mentioned: None, handled: &[] };
        let programs = ["TAKE Box", "GO Box; TAKE Box"].map(|text| text.parse().unwrap());
        let candidates = programs.iter().map(|program| featured(&moment, program)).collect();
        Choice { words: vec!["grab".to_owned(), "box".to_owned()], candidates, right }
    };
    let history = [choice(&near, 0), choice(&far, 1)];
    let settings = RerankerSettings {
        hidden: 8,
        symbol: 8,
        steps_max: 200,
        learning_rate: 0.03,
        stop_below: 0.05,
    };
    let words = crate::parser::WordTable::builtin("paper").unwrap();
    let symbols = ["TAKE", "GO", "Box"].map(Symbol::new).to_vec();
    let seed = crate::ids::Digest::of(b"a seed");
    let train = || Reranker::train(&settings, words, symbols.clone(), 2, seed, &history);
    let (reranker, figures) = train();
    assert_eq!(reranker.share_right(&history), 1.0, "{figures:?}");
    assert_eq!(train().0.weights(), reranker.weights());
    let restored = Reranker::restore(words, reranker.weights().clone(), 2).unwrap();
    let scores = |r: &Reranker| r.scores(&history[0].words, &history[0].candidates);
    assert_eq!(scores(&restored), scores(&reranker));
    assert!(Reranker::restore(words, reranker.weights().clone(), 3).is_err());
}
