//! The same lessons give the same mind, bit for bit: in any build, with any kernel, on any
//! processor, with any number of threads, and after records in the log. A change of a pinned digest
//! (`crates/mind/data/pins.txt`) is a decision. Say why in the commit and in the changelog, because
//! old logs then name minds that training no longer gives.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use apprentice::client::OnClash;
use apprentice::ids::{Digest, StreamId, TenantId, UserId};
use apprentice::learning::{Mind, Recipe, pinned, train};
use apprentice::numerics::Kernel;
use apprentice::replay::{Minds, rebuild};
use apprentice::service::{Config, Data, Service};
use apprentice::store;
use apprentice::world::household::Household;
use apprentice_study::known_minds::{histories, lessons, stage, train_all};

const RECIPES: [&str; 6] = Recipe::BUILTIN;
/// One recipe of each kind of parser. The last one contains both of its parts.
const KINDS: [&str; 3] = ["paper", "default-2", "seq2seq-grammar"];

fn mind(recipe: &str, history: &str) -> Mind {
    let household = Household::new();
    let recipe = Recipe::parse(Recipe::builtin(recipe).unwrap()).unwrap();
    train(&household, &recipe, &lessons(&household, history)).unwrap()
}

fn digests(recipe: &str) -> Vec<Digest> {
    histories().map(|history| mind(recipe, history).digest()).collect()
}

#[test]
fn trained_minds_have_their_pinned_digests() {
    let mut wrong = Vec::new();
    for known in train_all() {
        let known = known.unwrap();
        if !known.agrees() {
            wrong.push(format!("mind {} {} {}", known.recipe, known.history, known.digest));
        }
    }
    assert!(
        wrong.is_empty(),
        "trained here, and not what crates/mind/data/pins.txt says:\n{}\nsee the head of this file before \
         changing a pin",
        wrong.join("\n")
    );
}

#[test]
fn kernels_and_threads_do_not_change_a_bit() {
    for recipe in ["paper", "seq2seq"] {
        let expected = digests(recipe);
        for kernel in Kernel::available() {
            Kernel::force(Some(kernel));
            assert_eq!(digests(recipe), expected, "{recipe} {kernel:?}");
        }
        Kernel::force(None);
    }
    let expected = digests("default-2");
    thread::scope(|scope| {
        let started: Vec<_> = (0..8).map(|_| scope.spawn(|| digests("default-2"))).collect();
        for one in started {
            assert_eq!(one.join().unwrap(), expected);
        }
    });
}

#[test]
fn a_mind_is_its_bytes_and_never_another_ones() {
    let household = Household::new();
    for (recipe, name) in KINDS.iter().flat_map(|r| histories().map(move |name| (*r, name))) {
        let trained = mind(recipe, name);
        let recipe = Recipe::parse(Recipe::builtin(recipe).unwrap()).unwrap();
        let bytes = trained.to_bytes();
        assert_eq!(Digest::of(&bytes), trained.digest(), "{name}");
        let read = Mind::from_bytes(&household, &recipe, &bytes).unwrap();
        assert_eq!(read.digest(), trained.digest(), "{name}");
        for cut in [0, 1, bytes.len() / 2, bytes.len() - 1] {
            assert!(Mind::from_bytes(&household, &recipe, &bytes[..cut]).is_err(), "{name} {cut}");
        }
    }
}

#[test]
fn what_was_forgotten_leaves_no_trace() {
    let household = Household::new();
    for recipe in RECIPES {
        let recipe = Recipe::parse(Recipe::builtin(recipe).unwrap()).unwrap();
        let mut forgotten = lessons(&household, "four");
        forgotten.truncate(2);
        let gone = forgotten.remove(1);
        assert_eq!(gone.utterance.as_str(), "chill the mug");
        // "one" is "four" of a person who was never taught the other three.
        let never = pinned("mind", recipe.name(), "one");
        let after = train(&household, &recipe, &forgotten).unwrap().digest();
        assert_eq!(Some(after), never, "{}", recipe.name());
    }
}

/// People who teach at the same time. The first says what the history `one` says.
const PEOPLE: [(&str, &str); 8] = [
    ("ada", "wash the coffee mug"),
    ("ben", "rinse the mug"),
    ("cleo", "scrub the mug"),
    ("dan", "clean off the mug"),
    ("eve", "soak the mug"),
    ("finn", "make the mug shiny"),
    ("gus", "give the mug a bath"),
    ("hal", "swish the mug around"),
];

/// One conversation with one lesson.
fn teach(service: &Service, user: &str, utterance: &str) {
    let robot = service.connect(UserId::new(user).unwrap()).unwrap();
    robot.start(stage()).unwrap();
    robot.say(utterance).unwrap();
    // A parser that always answers may have acted on a guess.
    let before = robot.status().unwrap().actions.len() as u32;
    let steps = ["go to the mug", "pick up the mug", "go to the sink", "put the mug in the sink"];
    let more = ["turn on the faucet", "turn off the faucet", "pick up the mug"];
    steps.iter().chain(&more).for_each(|step| drop(robot.say(step).unwrap()));
    robot.done().unwrap();
    let said = robot.status().unwrap().to_teach.into_iter().find(|u| u.utterance == utterance);
    let seq = said.unwrap_or_else(|| panic!("{utterance:?} was understood")).seq;
    robot.teach(seq, (before + 3..=before + 7).collect(), OnClash::Ask).unwrap();
    robot.finish_teaching().unwrap();
    robot.wait_until_learned(Duration::from_secs(120)).unwrap();
}

/// The mind that each person's log names and gives back, and how many had to be trained for it.
fn minds_in(dir: &Path) -> (Vec<Digest>, u64) {
    let (store, household) = (store::open(dir).unwrap(), Arc::new(Household::new()));
    let minds = Minds::default();
    let found = PEOPLE.map(|(user, _)| {
        let user = UserId::new(user).unwrap();
        let stream: StreamId = store.keys.stream_id(&TenantId::local(), &user).unwrap();
        let session = rebuild(&household, &store, &stream, &minds).unwrap();
        let recorded = session.state().mind.unwrap();
        assert_eq!(session.mind().unwrap().digest(), recorded);
        recorded
    });
    (found.to_vec(), minds.work().trainings)
}

#[test]
fn any_number_of_trainers_a_replay_and_a_life_without_caches_give_the_same_minds() {
    for recipe in KINDS {
        let mut first: Option<Vec<Digest>> = None;
        for trainers in [1, 2, 8] {
            let dir = tempfile::tempdir().unwrap();
            let data = Data::Directory(dir.path().to_owned());
            let mut config = Config::new(Arc::new(Household::new()), data);
            config.recipe_text = Recipe::builtin(recipe).unwrap().to_owned();
            config.trainers = trainers;
            let service = Service::start(config).unwrap();
            thread::scope(|scope| {
                PEOPLE.iter().for_each(|(user, utterance)| {
                    scope.spawn(|| teach(&service, user, utterance));
                });
            });
            service.stop().unwrap();

            let (found, trained) = minds_in(dir.path());
            assert_eq!(trained, 0, "{recipe}: the minds were kept");
            assert_eq!(
                Some(found[0]),
                pinned("mind", recipe, "one"),
                "{recipe}: taught by talking"
            );
            let expected = first.get_or_insert_with(|| found.clone());
            assert_eq!(found, *expected, "{recipe}: {trainers} trainers");
            fs::remove_dir_all(dir.path().join("cache")).unwrap();
            let (again, trained) = minds_in(dir.path());
            assert_eq!(again, *expected, "{recipe}: without snapshots and minds");
            assert_eq!(trained, PEOPLE.len() as u64, "{recipe}: nothing else to take them from");
        }
    }
}

/// A binary from `cargo xtask test`, or a reason to skip. With `CI=true` a skip is a failure.
fn handed_over(variable: &str) -> Option<PathBuf> {
    let path = env::var_os(variable).map(PathBuf::from);
    if path.is_none() {
        skip(&format!("{variable} names no binary; `cargo xtask test` builds one"));
    }
    path
}

fn skip(reason: &str) {
    assert!(env::var("CI").as_deref() != Ok("true"), "{reason}");
    println!("skipped: {reason}");
}

/// Runs `self-test` of a binary. `before` are the words of the command line before its name.
fn self_test(before: &[&str], binary: &Path) -> String {
    let words: Vec<&str> = before.iter().copied().chain([binary.to_str().unwrap()]).collect();
    let output = Command::new(words[0]).args(&words[1..]).arg("self-test").output();
    let output = output.unwrap_or_else(|error| panic!("{words:?}: {error}"));
    let text = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words:?}\n{text}{errors}");
    assert!(
        text.contains(&format!("{} minds trained, 0 differ", RECIPES.len() * histories().count())),
        "{text}"
    );
    text
}

#[test]
fn builds_with_and_without_optimisation_train_the_same_minds() {
    for variable in ["APPRENTICE_UNOPTIMISED_BINARY", "APPRENTICE_OPTIMISED_BINARY"] {
        if let Some(binary) = handed_over(variable) {
            self_test(&[], &binary);
        }
    }
}

#[test]
fn other_processors_train_the_same_minds() {
    let Some(binary) = handed_over("APPRENTICE_OPTIMISED_BINARY") else { return };
    if Command::new("qemu-x86_64").arg("--version").output().is_err() {
        return skip("there is no qemu-x86_64; on Debian: apt-get install qemu-user");
    }
    let mut kernels = Vec::new();
    for processor in ["Nehalem", "Haswell", "max"] {
        let printed = self_test(&["qemu-x86_64", "-cpu", processor], &binary);
        kernels.push(printed.split("kernel ").nth(1).unwrap().trim().to_owned());
    }
    // Otherwise the emulation shows nothing that this machine does not show.
    assert_eq!(kernels[0], "Sse2", "Nehalem has no AVX2");
    assert!(kernels.contains(&"Avx2".to_owned()), "{kernels:?}");
}
