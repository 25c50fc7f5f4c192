//! Forgetting a lesson gives the same mind as never having taught it, and does not change the past.

use std::sync::Arc;
use std::time::Duration;

use apprentice::client::{ClientError, Command, OnClash, Phase, RejectionCode, Told};
use apprentice::events::Event;
use apprentice::ids::{Digest, Seq, UserId};
use apprentice::language::Outcome;
use apprentice::learning::Recipe;
use apprentice::service::{Data, Service};
use apprentice::session::Rejection;
use apprentice::store::open_memory;
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::diary::Diary;
use apprentice_testkit::toy::config;

/// Words without a meaning, and a request for the action that each is taught to mean.
const LESSONS: [(&str, &str); 4] = [
    ("boogie", "go to the fridge"),
    ("tidy up", "go to the sink"),
    ("do the dishes", "go to the microwave"),
    ("relax", "go to the garbage can"),
];

fn person() -> Diary<Household> {
    let domain = Arc::new(Household::new());
    Diary::new(&domain, &open_memory(), "ada", Recipe::builtin("default").unwrap())
}

/// An episode in which one lesson was taught.
fn teach(diary: &mut Diary<Household>, index: usize) -> Seq {
    let (words, request) = LESSONS[index];
    diary.start("free kitchen");
    diary.say(words);
    diary.say(request);
    diary.done();
    diary.teach(&[1])
}

/// Teaches these lessons, each in an episode of its own.
fn taught(diary: &mut Diary<Household>, lessons: &[usize]) -> Vec<Seq> {
    let teach_one = |index: &usize| {
        let lesson = teach(diary, *index);
        diary.learn();
        lesson
    };
    lessons.iter().map(teach_one).collect()
}

fn mind_of(lessons: &[usize]) -> Digest {
    let mut diary = person();
    taught(&mut diary, lessons);
    diary.session.state().mind.unwrap()
}

#[test]
fn whichever_lesson_is_forgotten_the_mind_is_that_of_the_others_in_their_order() {
    for gone in 0..LESSONS.len() {
        let mut diary = person();
        let lessons = taught(&mut diary, &[0, 1, 2, 3]);
        diary.accept(&Command::Forget { lesson: lessons[gone] });
        diary.learn();
        let left: Vec<usize> = (0..LESSONS.len()).filter(|index| *index != gone).collect();
        assert_eq!(diary.session.state().mind, Some(mind_of(&left)), "without lesson {gone}");
    }
}

#[test]
fn what_is_forgotten_while_teaching_is_gone_with_the_next_training() {
    let mut diary = person();
    let lessons = taught(&mut diary, &[0, 1]);
    teach(&mut diary, 2);
    let reply = diary.accept(&Command::Forget { lesson: lessons[0] });
    assert!(matches!(reply.told[..], [Told::Forgotten { .. }]), "it trains when teaching ends");
    assert_eq!(diary.session.phase(), Phase::Teaching);
    diary.learn();
    assert_eq!(diary.session.state().mind, Some(mind_of(&[1, 2])));
    // The same for a lesson that was taught just before.
    let lesson = teach(&mut diary, 3);
    diary.accept(&Command::Forget { lesson });
    diary.learn();
    assert_eq!(diary.session.state().mind, Some(mind_of(&[1, 2])));
}

#[test]
fn nothing_is_forgotten_during_an_episode_or_a_training_or_twice() {
    let mut diary = person();
    let lesson = taught(&mut diary, &[0])[0];
    let forget = Command::Forget { lesson };
    diary.start("free kitchen");
    let refused = diary.give(&forget).unwrap_err();
    assert!(matches!(refused, Rejection::WrongPhase { phase: Phase::Interacting, .. }));
    diary.done();
    diary.accept(&forget);
    assert_eq!(diary.give(&forget).unwrap_err().code(), RejectionCode::StillLearning);
    diary.learn();
    assert_eq!(diary.give(&forget).unwrap_err(), Rejection::NoSuchLesson { lesson });
}

#[test]
fn past_answers_stay_and_lessons_built_with_it_keep_working() {
    let mut diary = person();
    let boogie = taught(&mut diary, &[0])[0];
    // The second lesson is taught with the words of the first. It contains what was done, not what
    // was said.
    diary.start("free kitchen");
    diary.say("have a party");
    diary.say("boogie");
    diary.done();
    diary.teach(&[1]);
    diary.learn();
    let before = diary.records();
    diary.accept(&Command::Forget { lesson: boogie });
    diary.learn();
    assert_eq!(diary.records()[..before.len()], before[..], "the past is data");
    let understood = before.iter().any(|record| match &record.event {
        Event::Interpreted(said) => {
            said.utterance.as_str() == "boogie"
                && matches!(said.answer.outcome, Outcome::Understood { .. })
        }
        _ => false,
    });
    assert!(understood, "it was understood once, and that stays recorded");
    diary.start("free kitchen");
    let outcome = |diary: &mut Diary<Household>, words| match &diary.say(words).told[0] {
        Told::Answered { answer, .. } => answer.outcome.clone(),
        told => panic!("{told:?}"),
    };
    assert_eq!(outcome(&mut diary, "boogie"), Outcome::NotSure);
    let built = outcome(&mut diary, "have a party");
    let Outcome::Understood { program, .. } = built else { panic!("{built:?}") };
    assert_eq!(program.to_string(), "GOTO Fridge");
}

#[test]
fn a_failed_training_after_forgetting_leaves_a_mind_that_can_be_rebuilt() {
    let mut diary = person();
    let lessons = taught(&mut diary, &[0, 1]);
    let mind = diary.session.state().mind;
    diary.accept(&Command::Forget { lesson: lessons[0] });
    let recipe = diary.session.recipe().digest();
    diary.perform(&apprentice::session::Command::FinishRetrain {
        recipe,
        outcome: Err("no room".to_owned()),
    });
    assert_eq!(diary.session.state().mind, mind, "the former mind stays");
    // Its lessons are still there for a later training.
    let minds = apprentice::replay::Minds::default();
    let domain = diary.session.domain().clone();
    let woken = apprentice::replay::rebuild(&domain, &diary.store, &diary.stream, &minds).unwrap();
    assert_eq!(woken.mind().map(|mind| mind.digest()), mind);
    assert_eq!(woken.state_digest(), diary.session.state_digest());
}

#[test]
fn forgetting_works_through_the_wire_and_is_refused_there_in_an_episode() {
    let service = Service::start(config(Data::Memory)).unwrap();
    let client = service.connect(UserId::new("ada").unwrap()).unwrap();
    let learned = Duration::from_secs(60);
    let start = || client.start(Stage::Task { task: "Brass Silver".to_owned(), seed: 1 }).unwrap();
    let base = client.status().unwrap().mind;
    start();
    let seq = match &client.say("polish the brass bell").unwrap().told[0] {
        Told::Answered { seq, .. } => *seq,
        told => panic!("{told:?}"),
    };
    client.say("ring the brass bell").unwrap();
    client.done().unwrap();
    let taught = client.teach(seq, vec![1], OnClash::Ask).unwrap();
    let Told::Taught { lesson, .. } = taught.told[0] else { panic!("{taught:?}") };
    client.finish_teaching().unwrap();
    assert_ne!(client.wait_until_learned(learned).unwrap().status.mind, base);
    start();
    match client.forget(lesson) {
        Err(ClientError::Rejected { code, .. }) => assert_eq!(code, RejectionCode::WrongPhase),
        other => panic!("{other:?}"),
    }
    client.done().unwrap();
    let forgotten = client.forget(lesson).unwrap();
    assert!(matches!(forgotten.told[..], [Told::Forgotten { .. }, Told::Learning { lessons: 0 }]));
    assert_eq!(client.wait_until_learned(learned).unwrap().status.mind, base);
    drop(client);
    service.stop().unwrap();
}
