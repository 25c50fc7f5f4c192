//! Rebuilding and auditing, as ratios of one run. `cargo bench --bench replay`
//!
//! The real household and the recipe `default`. The log is sled's, on the disk of `target/`.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use apprentice::events::{Batch, Event, Head, Record};
use apprentice::grounding::Moment;
use apprentice::ids::{Seq, StreamId, TenantId, UserId};
use apprentice::learning::{Recipe, train};
use apprentice::replay::{Minds, Scrutiny, audit, keep_mind, rebuild_at, streams_of};
use apprentice::session::{Outstanding, Session};
use apprentice::store::{Store, open, open_memory};
use apprentice::world::household::Household;
use apprentice_testkit::diary::Diary;

/// Episodes of one history.
const EPISODES: usize = 5;
/// How many people have that history.
const PEOPLE: usize = 400;
const RUNS: usize = 15;
const AUDITS: usize = 4;

/// Five episodes of a kitchen, twenty utterances each; two lessons.
fn life(domain: &Arc<Household>) -> Diary<Household> {
    let recipe = Recipe::builtin("default").expect("it ships");
    let mut diary = Diary::new(domain, &open_memory(), "ada", recipe);
    for episode in 0..EPISODES {
        diary.start("free kitchen");
        let teaches = episode % 2 == 0 && episode < 4;
        if teaches {
            diary.say(["boogie", "", "do the dishes"][episode]);
        }
        for number in 0..10 {
            diary.say(["go to the fridge", "go to the sink and turn on the faucet"][number % 2]);
            diary.say(["open the fridge", "turn off the faucet"][number % 2]);
        }
        diary.done();
        if diary.session.status().to_teach.is_empty() {
            continue;
        }
        if teaches {
            diary.teach(&[1, 2]);
        }
        diary.learn();
    }
    diary
}

/// Gives each of these people that history, with appends in groups.
fn populate(store: &Store, records: &[Record]) -> u64 {
    let person = |number: usize| UserId::new(&format!("person {number}")).expect("a good name");
    let mut people: Vec<(UserId, StreamId, Head)> = (0..PEOPLE)
        .map(|number| {
            let user = person(number);
            let stream = store.keys.stream_id(&TenantId::local(), &user).expect("the tenant is");
            (user, stream, Head::EMPTY)
        })
        .collect();
    for record in records {
        let waiting: Vec<_> = people
            .iter()
            .map(|(user, stream, head)| {
                let mut event = record.event.clone();
                if let Event::SessionOpened(opened) = &mut event {
                    opened.user = user.clone();
                }
                let (request, at) = (record.request, record.at);
                store.log.append(stream, *head, Batch { request, at, events: vec![event] })
            })
            .collect();
        for ((_, _, head), pending) in people.iter_mut().zip(waiting) {
            *head = pending.wait().expect("the disk works").head();
        }
    }
    (records.len() * PEOPLE) as u64
}

/// CPU time of this process in seconds, which the load of the machine does not change.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux tells");
    let after_name = stat.rsplit(')').next().expect("a name in brackets");
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    let ticks: u64 = [11, 12].map(|at| fields[at].parse::<u64>().expect("ticks")).iter().sum();
    ticks as f64 / 100.0
}

fn median(mut work: impl FnMut()) -> Duration {
    let mut times: Vec<Duration> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed()
        })
        .collect();
    times.sort();
    times[RUNS / 2]
}

/// Only interprets every utterance and trains every mind: the least that an audit of them must do.
fn bare(domain: &Arc<Household>, records: &[Record]) -> (Duration, Duration) {
    let (mut interpreting, mut training) = (Duration::ZERO, Duration::ZERO);
    let mut session = Session::new(domain.clone());
    for record in records {
        match &record.event {
            Event::SessionOpened(event) => {
                let recipe = Recipe::parse(&event.recipe_text).expect("it was recorded");
                let start = Instant::now();
                let mind = train(&**domain, &recipe, &[]).expect("it trains");
                training += start.elapsed();
                session.apply(record).expect("it was recorded");
                session.install(Arc::new(mind));
                continue;
            }
            Event::Interpreted(event) => {
                let episode = session.state().episode.as_ref().expect("an episode");
                let mind = session.mind().expect("it was installed");
                let start = Instant::now();
                let moment = Moment {
                    domain: &**domain,
                    scene: &*episode.scene,
                    task: &*episode.task,
                    mentioned: episode.mentioned.as_ref(),
                    handled: &[],
                };
                std::hint::black_box(mind.interpret(moment, &event.utterance));
                interpreting += start.elapsed();
            }
            Event::RetrainCompleted(_) => {
                let Some(Outstanding::Retrain { recipe, lessons }) = session.outstanding() else {
                    unreachable!("it was recorded while a training was due");
                };
                let start = Instant::now();
                let mind = train(&**domain, &recipe, &lessons).expect("it trains");
                training += start.elapsed();
                session.apply(record).expect("it was recorded");
                if session.mind_wanted().is_some() {
                    session.install(Arc::new(mind));
                }
                continue;
            }
            _ => {}
        }
        session.apply(record).expect("it was recorded");
    }
    (interpreting, training)
}

fn main() {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("replay");
    let _ = std::fs::remove_dir_all(&dir);
    let domain = Arc::new(Household::new());
    let diary = life(&domain);
    let records = diary.records();
    let store = open(&dir).expect("a fresh directory opens");
    let start = Instant::now();
    let total = populate(&store, &records);
    println!("{PEOPLE} people, {total} records, written in {:.1} s", start.elapsed().as_secs_f64());

    let streams = streams_of(&store, None).expect("the store lists its streams");
    let one = &streams[0];
    let minds = Minds::default();
    let head = Seq::new(records.len() as u64).expect("there are records");
    minds.put(&one.tenant, diary.session.mind().expect("it was installed").clone());
    let read = median(|| {
        let records = store.log.read(one, Seq::FIRST).expect("it reads");
        let last = records.map(|record| record.expect("it decodes").seq).last();
        assert_eq!(last, Some(head));
    });
    let rebuilt = median(|| {
        let session = rebuild_at(&domain, &store, one, &minds, head).expect("it rebuilds");
        assert_eq!(session.mind_wanted(), None);
    });
    println!(
        "{EPISODES} episodes, {head} records: read and decoded in {read:.1?}, rebuilt with the mind \
         cached in {rebuilt:.1?}: {:.2} times that",
        rebuilt.as_secs_f64() / read.as_secs_f64()
    );

    for threads in [1, 2] {
        let (start, cpu) = (Instant::now(), cpu_seconds());
        for _ in 0..AUDITS {
            let report = audit(&domain, &store, &streams, Scrutiny::default(), threads, &());
            assert_eq!((report.counts.records, report.counts.streams_differ), (total, 0));
        }
        let records = total as f64 * AUDITS as f64;
        let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        println!(
            "plain audit, {threads} threads: {:.0} records/s by the clock, {:.0} a second of CPU",
            records / wall,
            records / cpu
        );
    }

    let few = &streams[..20];
    let (interpreting, training) = bare(&domain, &records);
    let (interpreting, training) = (interpreting * 20, training * 20);
    let timed = |scrutiny| {
        let start = Instant::now();
        let report = audit(&domain, &store, few, scrutiny, 1, &());
        assert_eq!(report.counts.streams_differ, 0);
        (start.elapsed(), report.counts)
    };
    let (retrained, counts) = timed(Scrutiny { retrain: true, repropose: false });
    println!(
        "audit --retrain of 20 people: {retrained:.1?} for {} trainings and one base mind; training \
         alone takes {training:.1?} with a base mind for each: {:.2} times that",
        counts.retrained,
        retrained.as_secs_f64() / training.as_secs_f64()
    );
    for (stream, mind) in
        few.iter().flat_map(|stream| diary.minds.iter().map(move |mind| (stream, mind)))
    {
        keep_mind(&store, stream, mind).expect("the cache takes it");
    }
    let (reproposed, counts) = timed(Scrutiny { retrain: false, repropose: true });
    println!(
        "audit --repropose of 20 people, minds cached: {reproposed:.1?} for {} utterances; \
         interpreting alone takes {interpreting:.1?}: {:.2} times that",
        counts.reproposed_utterances,
        reproposed.as_secs_f64() / interpreting.as_secs_f64()
    );
}
