//! The example client of `schema/examples/`, which knows nothing of this crate, against the real
//! service with the real household.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::Arc;

use apprentice::ids::UserId;
use apprentice::service::{Config, Data, Service};
use apprentice::world::household::Household;

/// An interpreter that has pyzmq and msgpack.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("APPRENTICE_PYTHON").map(PathBuf::from);
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python/bin/python");
    let candidates = match named {
        Some(named) => vec![named],
        None => vec![built, PathBuf::from("python3")],
    };
    candidates.into_iter().find(|python| {
        let imports = Process::new(python).args(["-c", "import zmq, msgpack"]).output();
        imports.is_ok_and(|output| output.status.success())
    })
}

#[test]
fn a_stranger_with_forty_lines_of_python_holds_a_conversation() {
    let Some(python) = python() else {
        assert!(std::env::var_os("CI").is_none(), "CI has no Python with pyzmq and msgpack");
        eprintln!("skipped: no Python with pyzmq and msgpack (cargo xtask test makes one)");
        return;
    };
    let mut config = Config::new(Arc::new(Household::new()), Data::Memory);
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    let service = Service::start(config).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("schema/examples/conversation.py");
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
