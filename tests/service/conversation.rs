//! The example client of `schema/examples/`, which knows nothing of this crate, talks to the real
//! service with the real household.

use std::process::Command as Process;
use std::sync::Arc;

use apprentice::ids::UserId;
use apprentice::service::{Config, Data, Service};
use apprentice::world::household::Household;

use apprentice_testkit::python::python;

#[test]
fn a_stranger_with_forty_lines_of_python_holds_a_conversation() {
    let Some(python) = python("zmq, msgpack") else { return };
    let mut config = Config::new(Arc::new(Household::new()), Data::Memory);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).unwrap();
    let script = apprentice_testkit::paths::root().join("schema/examples/conversation.py");
    let text = std::fs::read_to_string(&script).unwrap();
    assert!(text.lines().count() <= 40, "forty lines are promised");
    let output =
        Process::new(python).arg(&script).arg(service.endpoint().unwrap()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{complaint}");
    println!("{said}");
    let answer = said.lines().last().unwrap();
    assert_eq!(answer, "= GOTO Apple; PICKUP Apple; GOTO SinkBasin", "{said}");
    let ada = service.connect(UserId::new("ada").unwrap()).unwrap();
    assert_eq!(ada.status().unwrap().lessons, 1);
    service.stop().unwrap();
}
