//! What another configuration would have answered. If nothing is changed, the answers are the
//! recorded ones. Otherwise they are what anybody can compute from the log.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use apprentice::client::Command;
use apprentice::events::Event;
use apprentice::grounding::Moment;
use apprentice::language::Outcome;
use apprentice::learning::{Mind, Recipe, train};
use apprentice::replay::{keep_mind, streams_of};
use apprentice::session::{Outstanding, Session};
use apprentice::store::{Store, copy_private, open, open_memory};
use apprentice::world::Domain;
use apprentice::world::household::Household;
use apprentice_study::rerun::{Change, Rerun, Variant, rerun, table};
use apprentice_testkit::diary::Diary;
use apprentice_testkit::ran::run;
use apprentice_testkit::toy::Bells;
use serde_json::Value;

fn tiny() -> &'static str {
    Recipe::builtin("tiny").unwrap()
}

/// `tiny` with other numbers: minds with other embeddings and another threshold.
fn other_recipe() -> Recipe {
    let text = tiny().replace("\"tiny\"", "\"other\"").replace("steps_max = 30", "steps_max = 3");
    let recipe = Recipe::parse(&text).unwrap();
    assert_ne!(recipe.digest(), Recipe::parse(tiny()).unwrap().digest());
    recipe
}

/// Understood exactly and nearly, not sure, impossible, taught, declined, forgotten, trained.
fn life(domain: &Arc<Bells>, store: &Store, user: &str) -> Diary<Bells> {
    let mut diary = Diary::new(domain, store, user, tiny());
    diary.start("Brass Silver Glass");
    diary.say("polish the brass bell");
    diary.say("ring the brass bell");
    diary.say("ring the brass bell");
    diary.say("kindly ring the silver bell");
    diary.say("mute it");
    diary.done();
    diary.teach(&[1]);
    let teachable = |diary: &Diary<Bells>| diary.session.status().to_teach.first().map(|t| t.seq);
    while let Some(explains) = teachable(&diary) {
        let (actions, on_clash) = (Vec::new(), Default::default());
        diary.accept(&Command::Teach { explains, actions, on_clash });
    }
    diary.learn();
    diary.start("Brass Silver Glass");
    diary.say("polish the silver bell");
    diary.say("please polish the glass bell");
    diary.say("strike the glass bell");
    diary.done();
    diary.learn();
    let lesson = diary.session.state().lessons[0].seq;
    diary.accept(&Command::Forget { lesson });
    diary.learn();
    diary.start("Silver");
    diary.say("polish the silver bell");
    diary
}

fn asked<D: Domain>(domain: &Arc<D>, store: &Store, variants: &[Variant], threads: usize) -> Rerun {
    rerun(domain, store, &streams_of(store, None).unwrap(), variants, threads, &())
}

fn outcomes(found: &Rerun, variant: usize) -> Vec<(u64, Outcome, Outcome)> {
    let turns = found.lives.iter().flat_map(|life| &life.episodes).flat_map(|e| &e.turns);
    turns.map(|t| (t.seq.get(), t.recorded.clone(), t.others[variant].clone())).collect()
}

/// The same computation written a second time, without `study`: the answers come from a mind that
/// is trained on the lessons of the newest scheduled training.
fn recomputed<D: Domain>(diary: &Diary<D>, recipe: &Recipe) -> Vec<(u64, Outcome)> {
    let domain = diary.session.domain();
    let mut session = Session::new(domain.clone());
    let mut mind: Mind = train(&**domain, recipe, &[]).unwrap();
    let mut found = Vec::new();
    // What the other mind would read as "it", until its actions differ from the recorded ones.
    let (mut mentioned, mut parted) = (None, false);
    for record in diary.records() {
        if let Event::EpisodeStarted(_) = &record.event {
            (mentioned, parted) = (None, false);
        }
        if let Event::Interpreted(event) = &record.event {
            let episode = session.state().episode.as_ref().unwrap();
            let it = if parted { episode.mentioned.clone() } else { mentioned.clone() };
            let moment = Moment {
                domain: &**domain,
                scene: &*episode.scene,
                task: &*episode.task,
                mentioned: it.as_ref(),
                handled: &episode.handled(),
            };
            let answer = mind.interpret(moment, &event.utterance);
            let done = |outcome: &Outcome| match outcome {
                Outcome::Understood { program, .. } => program.steps.clone(),
                _ => Vec::new(),
            };
            parted |= done(&answer.outcome) != done(&event.answer.outcome);
            mentioned = answer.mentioned.or(mentioned);
            found.push((record.seq.get(), answer.outcome));
        }
        session.apply(&record).unwrap();
        if let Event::RetrainScheduled(_) = &record.event {
            let Some(Outstanding::Retrain { lessons, .. }) = session.outstanding() else {
                panic!("a training was scheduled");
            };
            mind = train(&**domain, recipe, &lessons).unwrap();
        }
    }
    found
}

#[test]
fn the_same_configuration_answers_the_same() {
    let (domain, dir) = (Arc::new(Bells::new()), tempfile::tempdir().unwrap());
    let store = open(dir.path()).unwrap();
    let diary = life(&domain, &store, "ada");
    let same = Variant::recipe(Recipe::parse(tiny()).unwrap());
    let found = asked(&domain, &store, &[same], 2);
    let [variant] = &found.report.variants[..] else { panic!("{:?}", found.report) };
    assert_eq!(variant.over_all_turns.different, 0, "{}", found.report);
    assert_eq!(variant.over_all_turns.turns, 9);
    assert_eq!(variant.up_to_the_end, variant.over_all_turns);
    assert_eq!(variant.episodes.loop_ends, 0);
    assert!(variant.people[0].episodes.is_empty());
    assert_eq!(found.report.left_out, []);
    // Two lists of lessons were used for answers: the second person has no lesson left.
    assert_eq!(found.report.minds.trained, 1);
    assert_eq!(outcomes(&found, 0).len(), diary.session.state().head.seq as usize - 17);
}

#[test]
fn another_recipe_answers_what_a_mind_of_the_lessons_of_the_moment_answers() {
    let (domain, dir) = (Arc::new(Bells::new()), tempfile::tempdir().unwrap());
    let store = open(dir.path()).unwrap();
    let diary = life(&domain, &store, "ada");
    let recipe = other_recipe();
    let found = asked(&domain, &store, &[Variant::recipe(recipe.clone())], 1);
    let theirs: Vec<(u64, Outcome)> =
        outcomes(&found, 0).into_iter().map(|(seq, _, other)| (seq, other)).collect();
    assert_eq!(theirs, recomputed(&diary, &recipe));
    // And the differences are exactly where the answers differ from the recorded ones.
    let differing: Vec<u64> = outcomes(&found, 0)
        .into_iter()
        .filter_map(|(seq, recorded, other)| (recorded != other).then_some(seq))
        .collect();
    let variant = &found.report.variants[0];
    let reported = variant.people[0].episodes.iter().flat_map(|episode| &episode.differences);
    assert_eq!(reported.map(|difference| difference.seq).collect::<Vec<_>>(), differing);
    assert!(!differing.is_empty(), "the recipe was chosen to differ:\n{}", found.report);
    assert_eq!(variant.over_all_turns.different, differing.len());
}

#[test]
fn at_a_threshold_of_nothing_only_exact_words_are_understood() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &store, "ada");
    let found = asked(&domain, &store, &[Variant::threshold(0.0)], 1);
    let mut inexact = 0;
    for record in diary.records() {
        let Event::Interpreted(event) = &record.event else { continue };
        let seq = record.seq.get();
        let (_, recorded, other) =
            outcomes(&found, 0).into_iter().find(|(s, ..)| *s == seq).unwrap();
        let nearest = event.answer.evidence.nearest.first();
        match nearest.is_some_and(|near| near.distance == 0.0) {
            true => assert_eq!(other, recorded, "{}", event.utterance),
            false => {
                inexact += usize::from(recorded != Outcome::NotSure);
                assert_eq!(other, Outcome::NotSure, "{}", event.utterance);
            }
        }
    }
    assert!(inexact > 0, "the life has something that was nearly understood\n{}", found.report);
    assert_eq!(found.report.variants[0].over_all_turns.became_not_sure, inexact);
}

#[test]
fn the_threshold_that_was_recorded_changes_nothing_and_a_wider_one_understands_more() {
    let (domain, store) = (Arc::new(Bells::sturdy()), open_memory());
    let mut diary = Diary::new(&domain, &store, "ada", tiny());
    diary.start("Brass Silver");
    for said in ["polish the brass bell", "ring the brass bell", "kindly ring the silver bell"] {
        diary.say(said);
    }
    let own = diary.minds[0].report().threshold;
    let variants = [own, 2.0].map(Variant::threshold);
    let found = asked(&domain, &store, &variants, 1);
    let [same, wide] = &found.report.variants[..] else { panic!("{:?}", found.report) };
    assert_eq!(same.over_all_turns.different, 0, "{}", found.report);
    assert_eq!(wide.over_all_turns.other.not_sure, 0, "{}", found.report);
    let first = &wide.people[0].episodes[0];
    assert_eq!(first.loop_ends_at_turn, Some(1));
    assert_eq!(first.differences[0].change, Change::BecameUnderstood);
    assert_eq!(wide.up_to_the_end.turns, 1, "after that turn the bells are others");
}

#[test]
fn a_sweep_trains_nothing_where_the_minds_are_kept_and_only_those_of_the_log_where_not() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let diary = life(&domain, &store, "ada");
    let sweep: Vec<Variant> = [0.1, 0.3, 0.9].map(Variant::threshold).to_vec();
    let rebuilt = asked(&domain, &store, &sweep, 1);
    let minds = rebuilt.report.minds;
    assert_eq!((minds.trained, minds.trainings_failed), (0, 0));
    // One list of lessons was used for answers, for any number of thresholds.
    assert_eq!((minds.recorded, minds.recorded_rebuilt), (1, 1));
    let kept = open_memory();
    let copied = diary.doctored(kept, |_, _| {});
    let stream = streams_of(&copied, None).unwrap().remove(0);
    for mind in &diary.minds {
        keep_mind(&copied, &stream, mind).unwrap();
    }
    let found = asked(&domain, &copied, &sweep, 1);
    let minds = found.report.minds;
    assert_eq!((minds.trained, minds.recorded, minds.recorded_rebuilt), (0, 1, 0));
    assert_eq!(found.report.variants, rebuilt.report.variants);
    assert_eq!(copied.models.counts().absent, 0, "no mind had to be made");
}

#[test]
fn the_report_is_the_same_on_any_number_of_threads_and_for_a_copy() {
    let (domain, dir) = (Arc::new(Bells::new()), tempfile::tempdir().unwrap());
    let store = open(dir.path()).unwrap();
    for user in ["ada", "grace", "mary", "joan"] {
        life(&domain, &store, user);
    }
    let variants = [Variant::threshold(0.1), Variant::recipe(other_recipe())];
    let told = |store: &Store, threads| {
        let found = asked(&domain, store, &variants, threads);
        let report = serde_json::to_string(&found.report).unwrap();
        (report, table(&variants, &found.lives))
    };
    let one = told(&store, 1);
    assert_eq!(told(&store, 3), one);
    drop(store);
    let copy = copy_private(dir.path()).unwrap();
    assert_eq!(told(&copy.open().unwrap(), 2), one);
}

#[test]
fn who_was_erased_is_left_out_and_what_cannot_be_read_is_a_fault() {
    let (domain, store) = (Arc::new(Bells::new()), open_memory());
    let gone = life(&domain, &store, "ada");
    life(&domain, &store, "grace");
    store.erase(&gone.stream).unwrap();
    let found = asked(&domain, &store, &[Variant::threshold(0.2)], 1);
    assert_eq!(found.report.people, 1);
    let [left] = &found.report.left_out[..] else { panic!("{:?}", found.report.left_out) };
    assert_eq!((left.why.as_str(), left.is_fault), ("the person was erased", false));

    let broken = life(&domain, &open_memory(), "mary").doctored(open_memory(), |seq, event| {
        if let (Event::Interpreted(said), 4) = (event, seq.get()) {
            said.scene_after = apprentice::ids::Digest::of(b"another room");
        }
    });
    let found = asked(&domain, &broken, &[Variant::threshold(0.2)], 1);
    let [left] = &found.report.left_out[..] else { panic!("{:?}", found.report.left_out) };
    assert!(left.is_fault && left.why.starts_with("record 4: scene digest"), "{}", left.why);
}

#[test]
fn minds_without_a_threshold_are_left_out_of_a_sweep() {
    let (domain, store) = (Arc::new(Household::new()), open_memory());
    let mut diary = Diary::new(&domain, &store, "ada", Recipe::builtin("grammar").unwrap());
    diary.start("free kitchen");
    diary.say("go to the fridge");
    let found = asked(&domain, &store, &[Variant::threshold(0.2)], 1);
    let [left] = &found.report.left_out[..] else { panic!("{:?}", found.report.left_out) };
    assert_eq!(left.why, "minds of the recipe grammar have no threshold");
    assert!(!left.is_fault);
}

/// A directory that the service wrote: ada taught "wash the mug" and used the lesson.
fn recorded(folder: &Path) -> String {
    let data = folder.join("data").display().to_string();
    let wash = "wash the mug\ngo to the fridge\nopen the fridge\ndone\n1-2\n";
    for input in [wash, "wash the mug\ngo to the bed\ndone\n"] {
        let arguments = ["--data", &data, "--user", "ada", "--seed", "3", "--recipe", "tiny"];
        let ran = run(&[&arguments[..], &["--task", "clean Mug CounterTop"]].concat(), input);
        assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    }
    data
}

#[test]
fn a_person_reads_a_report_a_program_reads_json_and_the_directory_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let data = recorded(folder.path());
    let before = fs::read(Path::new(&data).join("LAYOUT")).unwrap();
    let known = ["study", "rerun", "--data", &data];
    let ask = |more: &[&str]| run(&[&known[..], more].concat(), "");
    let same = ask(&["--with", "condition=tiny"]);
    assert_eq!((same.code, same.err.as_str()), (Some(0), ""), "{}", same.out);
    assert!(same.out.contains("No action differs in any of the 2 episodes"), "{}", same.out);

    let table = folder.path().join("turns.csv");
    let table = table.to_str().unwrap();
    let grammar = ask(&["--with", "condition=grammar", "--out", table]);
    assert_eq!(grammar.code, Some(0), "{}", grammar.err);
    for part in [
        "rerun with condition=grammar: 1 person, 2 episodes",
        "held fixed: the recorded lessons",
        "local/ada (recorded with tiny)",
        "turn 1: \"wash the mug\"",
        "other     not sure",
        "the open loop ends at turn 1",
        "turns",
        "program complexity per turn",
        "Normalised episode length",
    ] {
        assert!(grammar.out.contains(part), "{part:?} is missing in\n{}", grammar.out);
    }
    let rows = fs::read_to_string(table).unwrap();
    assert!(rows.starts_with("with,tenant,user,"), "{rows}");
    assert_eq!(rows.lines().count(), 1 + 5, "{rows}");
    assert!(rows.contains(",GOTO Fridge; OPEN Fridge,not_sure,,became_not_sure,1\n"), "{rows}");

    let json = ask(&["--with", "tau=0..0.2/0.1", "--user", "ada", "--json"]);
    assert_eq!(json.out, ask(&["--with", "tau=0,0.1,0.2", "--user", "ada", "--json"]).out);
    let value: Value = serde_json::from_str(&json.out).unwrap();
    let names: Vec<&str> =
        value["variants"].as_array().unwrap().iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["tau=0", "tau=0.1", "tau=0.2"]);
    assert_eq!(value["minds"]["trained"], 0);
    assert!(!json.out.contains(folder.path().to_str().unwrap()), "no path is in it");
    assert_eq!(fs::read(Path::new(&data).join("LAYOUT")).unwrap(), before);
}

#[test]
fn what_cannot_be_is_refused_with_what_can() {
    let folder = tempfile::tempdir().unwrap();
    let data = recorded(folder.path());
    let refused = |more: &[&str], part: &str| {
        let ran = run(&[&["study", "rerun", "--data", &data][..], more].concat(), "");
        assert_eq!(ran.code, Some(2), "{more:?} {}{}", ran.out, ran.err);
        assert!(ran.err.contains(part), "{more:?}: {}", ran.err);
    };
    refused(&["--with", "condition=papr"], "there are default-1, default-2, paper, grammar");
    refused(&["--with", "speed=3"], "possible are tau=0.3");
    refused(&["--with", "tau=3"], "tau is 3; it is between 0 and 2");
    refused(&["--with", "recipe=/nowhere.toml"], "cannot be read as a file");
    refused(&["--with", "tau=0.2", "--user", "grace"], "holds no records of user \"grace\"");
    refused(&["--with", "tau=0.2", "--tenant", "other"], "its tenants are local");
    refused(&[], "--with");
}
