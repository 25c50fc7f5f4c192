//! Histories of teaching that every build trains on every machine, and the digests that their minds
//! have: whether this machine computes the bits that all others do.

use std::sync::Arc;

use apprentice::ids::Digest;
use apprentice::language::{Program, Utterance};
use apprentice::learning::{Lesson, Recipe, TrainError, pinned, train};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Stage, World};

const WASH: &str = "GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet; TOGGLE Faucet; PICKUP Mug";
const COOL: &str =
    "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug";
const SHELVE: &str = "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge";
const SINK: &str = "GOTO SinkBasin; PUT Mug SinkBasin";

/// What somebody taught, in order: a name and pairs of an utterance and its program. All in one
/// kitchen. The words of `clash` stand for two programs, which only a reranker can tell apart.
const HISTORIES: [(&str, &[(&str, &str)]); 4] = [
    ("nothing", &[]),
    ("one", &[("wash the coffee mug", WASH)]),
    (
        "four",
        &[
            ("wash the coffee mug", WASH),
            ("chill the mug", COOL),
            ("rinse off the mug, please", WASH),
            ("cool it down", COOL),
        ],
    ),
    (
        "clash",
        &[
            ("wash the coffee mug", WASH),
            ("tidy the mug", SHELVE),
            ("chill the mug", COOL),
            ("tidy the mug", SINK),
            ("rinse off the mug, please", WASH),
            ("tidy up the mug", SHELVE),
        ],
    ),
];

/// The scene and the task of all lessons, as `apprentice --task 'free kitchen' --seed 11` has them.
pub fn stage() -> Stage {
    Stage::Task { task: "free kitchen".to_owned(), seed: 11 }
}

/// The names of the histories.
pub fn histories() -> impl Iterator<Item = &'static str> {
    HISTORIES.iter().map(|(name, _)| *name)
}

/// The lessons of a history.
///
/// - panics: when there is no history of that name.
pub fn lessons(household: &Household, history: &str) -> Vec<Lesson<Scene, Task>> {
    let (scene, task) = household.stage(&stage()).expect("the kitchen can always be built");
    let (scene, task) = (Arc::new(scene), Arc::new(task));
    let known = HISTORIES.iter().find(|(name, _)| *name == history);
    let (_, taught) = known.expect("a history is named by those that list them");
    let lesson = |(utterance, program): &(&str, &str)| Lesson {
        utterance: Utterance::new(utterance).expect("short text"),
        program: program.parse::<Program>().expect("programs of the household"),
        scene: scene.clone(),
        task: task.clone(),
        mentioned: None,
    };
    taught.iter().map(lesson).collect()
}

/// A known mind, trained here.
pub struct Trained {
    pub recipe: &'static str,
    pub history: &'static str,
    pub digest: Digest,
    /// None when nobody has pinned it.
    pub pinned: Option<Digest>,
}

impl Trained {
    pub fn agrees(&self) -> bool {
        self.pinned == Some(self.digest)
    }
}

/// Trains every history with every recipe that ships, one after the other.
pub fn train_all() -> impl Iterator<Item = Result<Trained, TrainError>> {
    let household = Household::new();
    let cases = Recipe::BUILTIN
        .into_iter()
        .flat_map(|recipe| histories().map(move |history| (recipe, history)));
    cases.map(move |(recipe, history)| {
        let text = Recipe::builtin(recipe).expect("its name is on the list");
        let settings = Recipe::parse(text).expect("recipes that ship are read by a test");
        let mind = train(&household, &settings, &lessons(&household, history))?;
        let pinned = pinned("mind", recipe, history);
        Ok(Trained { recipe, history, digest: mind.digest(), pinned })
    })
}
