//! The examples run: `examples/embed.rs`, and `crates/client/examples/talk.rs` with a service.

use std::sync::Arc;

use apprentice::service::{Config, Data, Service};
use apprentice::world::household::Household;

#[path = "../../examples/embed.rs"]
mod embed;
#[allow(dead_code, reason = "its `main` reads the arguments of the program")]
#[path = "../../crates/client/examples/talk.rs"]
mod talk;

#[test]
fn the_embedded_service_runs_from_start_to_stop() {
    embed::main().unwrap();
}

#[test]
fn another_program_talks_to_a_running_service() {
    let mut config = Config::new(Arc::new(Household::new()), Data::Memory);
    config.listen = vec![apprentice_testkit::lab::FREE_PORT.to_owned()];
    let service = Service::start(config).unwrap();
    let answer = talk::answer(service.endpoint().unwrap(), "go to the mug").unwrap();
    assert_eq!(answer, "done: GOTO Mug");
    service.stop().unwrap();
}
