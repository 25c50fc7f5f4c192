use super::*;
use crate::language::{Habits, Symbol, WordLists};
use std::collections::BTreeSet;
use std::sync::Arc;

const SEEDS: [(&str, &str); 6] = [
    ("take the <obj>", "TAKE <obj:1>"),
    ("pick up the <obj>", "TAKE <obj:1>"),
    ("put the <obj> on the <obj>", "PUT <obj:1> <obj:2>"),
    ("place the <obj> in the <obj>", "PUT <obj:1> <obj:2>"),
    ("go to the <obj>", "GO <obj:1>"),
    ("walk to the <obj>", "GO <obj:1>"),
];

fn exemplar((utterance, program): &(&str, &str)) -> Exemplar {
    Exemplar { utterance: LiftedUtterance::parse(utterance), program: program.parse().unwrap() }
}

fn clause(text: &str) -> Clause {
    Clause::of(&LiftedUtterance::parse(text))
}

/// The recipe that ships, on a world of its own.
struct World {
    settings: FeaturesSettings,
    lists: WordLists,
    adjectives: Vec<String>,
    fixtures: BTreeMap<Symbol, String>,
    habits: Arc<Habits>,
    roles: Roles,
}

impl World {
    fn new() -> World {
        let text = include_str!("../../../data/recipes/default-1.toml");
        let recipe: toml::Table = toml::from_str(text).unwrap();
        let lists = recipe["abstraction"]["lists"].clone();
        let settings = recipe["parser"]["features"].clone();
        let counts = [("take", [90, 1, 0]), ("put", [0, 90, 0]), ("go", [0, 0, 90])];
        let habits = Habits {
            order: ["TAKE", "PUT", "GO"].map(Symbol::new).to_vec(),
            clauses: vec![100, 100, 100],
            words: counts.map(|(verb, row)| (format!("V:{verb}"), row.to_vec())).into(),
        };
        World {
            settings: settings.try_into().unwrap(),
            lists: lists.try_into().unwrap(),
            adjectives: vec!["red".to_owned()],
            fixtures: BTreeMap::from([(Symbol::new("SinkBasin"), "sink".to_owned())]),
            habits: Arc::new(habits),
            roles: Roles {
                going: Some(Symbol::new("GO")),
                taking: Some(Symbol::new("TAKE")),
                putting: Some(Symbol::new("PUT")),
                doors: Vec::new(),
            },
        }
    }

    fn background(&self) -> Background<'_> {
        Background {
            lists: &self.lists,
            adjectives: &self.adjectives,
            fixtures: &self.fixtures,
            roles: &self.roles,
            habits: Some(&self.habits),
        }
    }

    fn taught(&self, lessons: &[(&str, &str)]) -> FeaturesParser {
        let words = WordTable::builtin("default").unwrap();
        let examples: Vec<Exemplar> = SEEDS.iter().chain(lessons).map(exemplar).collect();
        let unknown = ["juggle the <obj>", "polish the <obj>"].map(LiftedUtterance::parse);
        let calibration = Calibration { variants: &[], unknown: &unknown };
        let (settings, background) = (&self.settings, self.background());
        FeaturesParser::train(settings, words, background, &examples, SEEDS.len(), calibration)
            .unwrap()
            .0
    }
}

const WASH: (&str, &str) = ("wash the <obj>", "PUT <obj:1> SinkBasin; TOGGLE Faucet; TAKE <obj:1>");

#[test]
fn every_seed_keeps_its_own_program_with_and_without_lessons() {
    let world = World::new();
    for lessons in [&[][..], &[WASH][..]] {
        let parser = world.taught(lessons);
        for seed in SEEDS.iter().map(exemplar) {
            let parse = parser.parse(&Clause::of(&seed.utterance));
            assert_eq!(parse.candidates[0].program, seed.program, "{}", seed.utterance);
            assert_eq!((parse.candidates[0].distance, parse.candidates[0].open), (0.0, false));
        }
    }
}

#[test]
fn an_unknown_verb_is_near_nothing_until_it_is_taught_once() {
    let world = World::new();
    let parse = world.taught(&[]).parse(&clause("wash the <obj>"));
    assert!(parse.candidates.is_empty(), "{:?}", parse.candidates);
    assert!(!parse.nearest.is_empty() && parse.nearest[0].distance > parse.threshold);
    let parse = world.taught(&[WASH]).parse(&clause("wash the <obj>"));
    assert_eq!(parse.candidates[0].program, WASH.1.parse().unwrap());
    assert_eq!((parse.candidates[0].number, parse.exact), (SEEDS.len() as u32, 1));
}

#[test]
fn a_determiner_does_not_make_another_sentence() {
    let parse = World::new().taught(&[WASH]).parse(&clause("wash this <obj>"));
    assert_eq!((parse.exact, parse.candidates[0].distance), (1, 0.0));
}

#[test]
fn another_wording_that_names_the_programs_fixture_recalls_the_lesson() {
    let parser = World::new().taught(&[WASH]);
    let parse = parser.parse(&clause("rinse the <obj> off in the <obj=sink>"));
    let first = &parse.candidates[0];
    assert_eq!(first.number, SEEDS.len() as u32, "{parse:?}");
    assert!(first.open && first.distance <= parse.threshold);
    let parse = parser.parse(&clause("juggle the <obj>"));
    assert!(parse.candidates.is_empty(), "{parse:?}");
}

#[test]
fn several_clauses_are_no_primitive_and_a_chain_is_less_sure_than_its_links() {
    let parser = World::new().taught(&[]);
    let parse = parser.parse(&clause("take the <obj> and go to the <obj>"));
    assert!(parse.candidates.is_empty(), "{parse:?}");
    let chain = parser.chain(0.2, 0.3);
    assert!(chain > 0.3 && chain < 0.5, "{chain}");
}

#[test]
fn turning_around_asks_for_nothing() {
    let parse = World::new().taught(&[]).parse(&clause("turn around"));
    assert!(parse.candidates[0].program.steps.is_empty(), "{parse:?}");
}

#[test]
fn the_parser_is_restored_from_its_weights_and_refuses_those_of_another() {
    let world = World::new();
    let parser = world.taught(&[WASH]);
    let words = WordTable::builtin("default").unwrap();
    let restore = |weights| {
        let (settings, background) = (&world.settings, world.background());
        let (examples, seeds) = (parser.exemplars(), SEEDS.len());
        FeaturesParser::restore(settings, words, background, examples, seeds, weights)
    };
    let again = restore(parser.weights().clone()).unwrap();
    for text in ["rinse the <obj> off in the <obj=sink>", "grab the <obj>", "take it"] {
        assert_eq!(again.parse(&clause(text)), parser.parse(&clause(text)), "{text}");
    }
    let lessons = Vec::new();
    assert!(restore(FeaturesWeights { lessons, ..parser.weights().clone() }).is_err());
    let threshold = f32::NAN;
    assert!(restore(FeaturesWeights { threshold, ..parser.weights().clone() }).is_err());
}

#[test]
fn clauses_are_cut_only_where_a_verb_follows() {
    let world = World::new();
    let grammar = crate::language::Grammar { lists: &world.lists, adjectives: &world.adjectives };
    let cut = |text: &str| -> Vec<String> {
        grammar.cut(&clause(text)).iter().map(|c| c.lifted.to_string()).collect()
    };
    assert_eq!(cut("take the <obj> and the <obj>"), ["take the <obj> and the <obj>"]);
    assert_eq!(
        cut("take the <obj> and then go to the <obj>"),
        ["take the <obj>", "go to the <obj>"]
    );
    let mut marked = clause("take the <obj> put it on the <obj>");
    assert_eq!(grammar.cut(&marked).len(), 1);
    marked.marks = vec![3];
    assert_eq!(grammar.cut(&marked).len(), 2);
    assert_eq!(cut("turn on the <obj> while holding the <obj>"), ["turn on the <obj>"]);
    let silent: BTreeSet<&str> = world.lists.silent.iter().map(String::as_str).collect();
    assert!(silent.contains("the"));
}

#[test]
fn words_that_ask_for_more_than_the_verb_make_a_primitive_unlikely() {
    let parser = World::new().taught(&[]);
    for text in ["put the <obj> on the <obj>", "put the wet <obj> on the <obj>"] {
        assert!(!parser.parse(&clause(text)).candidates.is_empty(), "{text}");
    }
    for text in [
        "put the <obj> on the <obj> to chill",
        "put the <obj> on the <obj> to cool <obj> off",
        "put the <obj> on the <obj> for a few minutes",
        "take the <obj> put the <obj> on the <obj>",
    ] {
        assert!(parser.parse(&clause(text)).candidates.is_empty(), "{text}");
    }
}
