//! A durable answer through the real socket: DEALER → ROUTER → actor → log with fdatasync → back,
//! beside a raw file with `fdatasync` in the same run.

use std::fs::File;
use std::io::Write;
use std::sync::Arc;

use apprentice::frontends::Client;
use apprentice::ids::UserId;
use apprentice::service::{Config, Data, Service};
use apprentice::world::Stage;
use apprentice::world::household::Household;
use criterion::{Criterion, criterion_group, criterion_main};

fn answers(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder for data");
    let data = Data::Directory(folder.path().join("data"));
    let mut config = Config::new(Arc::new(Household::new()), data);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).expect("the service starts");
    let endpoint = service.endpoint().expect("it listens").to_owned();
    let user = UserId::new("bench").expect("a name");
    let robot = Client::connect(&endpoint, user).expect("it connects");

    let mut group = criterion.benchmark_group("durable");
    let mut said = 0;
    let mut seed = 0;
    group.bench_function("answer through tcp", |bench| {
        bench.iter(|| {
            // An episode holds a bounded number of utterances.
            if said % 400 == 0 {
                if said > 0 {
                    robot.done().expect("done");
                    robot.finish_teaching().ok();
                    robot.wait_until_learned(std::time::Duration::from_secs(60)).ok();
                }
                seed += 1;
                let task = "free kitchen".to_owned();
                robot.start(Stage::Task { task, seed }).expect("a free kitchen");
            }
            said += 1;
            robot.say("go to the fridge").expect("an answer")
        });
    });
    let mut raw = File::create(folder.path().join("raw")).expect("a file");
    group.bench_function("raw file with fdatasync", |bench| {
        bench.iter(|| {
            raw.write_all(&[7; 700]).expect("written");
            raw.sync_data().expect("synced");
        });
    });
    group.finish();
    service.stop().expect("it stops");
}

criterion_group!(benches, answers);
criterion_main!(benches);
