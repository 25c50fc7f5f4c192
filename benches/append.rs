//! Durable appends per second with 1, 16 and 256 writers. Each writer waits for its own record. The
//! same run measures a raw file on the same disk, with appends and syncs in the same groups.
//!
//! `cargo bench --bench append`

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

use apprentice::events::{Head, Header};
use apprentice::limits::COMMIT_GROUP_MAX;
use apprentice::store::conformance::{batch, stream};
use apprentice::store::open;

/// Bytes of an event's text.
const EVENT_BYTES: usize = 200;
/// Bytes that header, nonce, salt and seal add.
const RECORD_BYTES: usize = EVENT_BYTES + Header::BYTES + 24 + 32 + 16;
const MEASURE: Duration = Duration::from_secs(4);

fn main() {
    let dir = std::env::var_os("APPRENTICE_BENCH_DIR").map_or_else(std::env::temp_dir, Into::into);
    println!("| writers | raw file /s | log /s | log / raw | log p50 | log p99 |");
    println!("|---|---|---|---|---|---|");
    for writers in [1, 16, 256] {
        // In turns, so that a slow minute of the disk affects both.
        let runs = [(); 2].map(|()| (raw(&dir, writers), log(&dir, writers)));
        let [raw, log] = runs.into_iter().fold([vec![], vec![]], |[mut raws, mut logs], run| {
            raws.extend(run.0);
            logs.extend(run.1);
            [raws, logs]
        });
        let per_second = |times: &[Duration]| times.len() as f64 / (2.0 * MEASURE.as_secs_f64());
        let (raw_rate, log_rate) = (per_second(&raw), per_second(&log));
        let mut sorted = log;
        sorted.sort();
        let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
        println!(
            "| {writers} | {raw_rate:.0} | {log_rate:.0} | {:.2} | {:.1?} | {:.1?} |",
            log_rate / raw_rate,
            at(0.5),
            at(0.99),
        );
    }
}

/// Runs `append` on one thread for each writer, and collects how long each call took.
fn measure<F: FnMut()>(writers: usize, make: impl Fn(usize) -> F + Sync) -> Vec<Duration> {
    let deadline = Instant::now() + MEASURE;
    std::thread::scope(|scope| {
        let writer = |number| {
            let make = &make;
            scope.spawn(move || {
                let mut append = make(number);
                let mut times = Vec::new();
                while Instant::now() < deadline {
                    let start = Instant::now();
                    append();
                    times.push(start.elapsed());
                }
                times
            })
        };
        let writers: Vec<_> = (0..writers).map(writer).collect();
        writers
            .into_iter()
            .flat_map(|writer| writer.join().expect("writers do not panic"))
            .collect()
    })
}

fn log(dir: &Path, writers: usize) -> Vec<Duration> {
    let dir = tempfile::tempdir_in(dir).expect("the bench directory can be written");
    let store = open(dir.path()).expect("a fresh directory opens");
    let text = "e".repeat(EVENT_BYTES);
    measure(writers, |number| {
        let who = stream(&store.keys, "local", &format!("writer {number}"));
        let mut head = store.log.head(&who).expect("the stream is new");
        assert_eq!(head, Head::EMPTY);
        let (log, text) = (&store.log, &text);
        move || {
            let durable = log.append(&who, head, batch([text.as_str()])).wait();
            head = durable.expect("the append succeeds").head();
        }
    })
}

fn raw(dir: &Path, writers: usize) -> Vec<Duration> {
    let dir = tempfile::tempdir_in(dir).expect("the bench directory can be written");
    let path = dir.path().join("raw");
    let mut file = OpenOptions::new().create(true).append(true).open(path).expect("a fresh file");
    let (sender, receiver) = sync_channel::<SyncSender<()>>(4_096);
    let committer = std::thread::spawn(move || {
        while let Ok(first) = receiver.recv() {
            let mut group = vec![first];
            while group.len() < COMMIT_GROUP_MAX {
                let Ok(next) = receiver.try_recv() else { break };
                group.push(next);
            }
            file.write_all(&vec![7; RECORD_BYTES * group.len()]).expect("the disk has room");
            file.sync_data().expect("the disk works");
            group.iter().for_each(|answer| answer.send(()).expect("the writer waits"));
        }
    });
    let times = measure(writers, |_| {
        let sender = sender.clone();
        let (answer, answered) = sync_channel(1);
        move || {
            sender.send(answer.clone()).expect("the committer lives");
            answered.recv().expect("the committer answers");
        }
    });
    drop(sender);
    committer.join().expect("the committer ends");
    times
}
