//! `apprentice serve` as a child process that is killed without warning.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How long anything may take before a test fails. Machines are sometimes busy.
pub const PATIENCE: Duration = Duration::from_secs(60);

pub struct Server {
    child: Child,
    first_line: Receiver<String>,
    is_ready: bool,
    errors: Option<JoinHandle<String>>,
    /// When a panic that a test wanted was seen.
    panicked: Arc<OnceLock<Instant>>,
}

/// How a server ended by itself.
#[derive(Debug)]
pub struct Ended {
    pub status: ExitStatus,
    pub errors: String,
    /// How long it ran after a panic that a test wanted.
    pub since_panic: Option<Duration>,
}

/// A recipe that trains in milliseconds.
pub fn tiny() -> PathBuf {
    apprentice_testkit::paths::root().join("crates/mind/data/recipes/tiny.toml")
}

impl Server {
    /// Starts serving `data` at the socket file `socket`, without waiting until it serves.
    pub fn spawn(data: &Path, socket: &Path, environment: &[(&str, String)]) -> Server {
        let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
        command
            .args(["serve", "--data"])
            .arg(data)
            .arg("--zmq")
            .arg(endpoint(socket))
            .arg("--recipe")
            .arg(tiny())
            .env("APPRENTICE_LOG", "error")
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary starts");
        let stdout = child.stdout.take().expect("it is piped");
        let stderr = child.stderr.take().expect("it is piped");
        let (sender, first_line) = mpsc::channel();
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let panicked = Arc::<OnceLock<Instant>>::default();
        let seen = panicked.clone();
        let errors = thread::spawn(move || {
            let mut errors = String::new();
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                if line.contains("a test wants a panic") {
                    seen.get_or_init(Instant::now);
                }
                errors.push_str(&line);
                errors.push('\n');
            }
            errors
        });
        Server { child, first_line, is_ready: false, errors: Some(errors), panicked }
    }

    /// The same as [`Server::ready`], for a service that may be ready already.
    #[track_caller]
    pub fn ready_once(&mut self) {
        if !std::mem::replace(&mut self.is_ready, true)
            && let Err(ended) = self.ready()
        {
            panic!("it does not start: {ended:?}");
        }
    }

    /// Waits until it serves.
    ///
    /// - errors: it ended instead.
    pub fn ready(&mut self) -> Result<(), Ended> {
        match self.first_line.recv_timeout(PATIENCE) {
            Ok(line) => {
                assert!(line.starts_with("serving at "), "{line}");
                Ok(())
            }
            Err(_) => Err(self.end(PATIENCE).expect("it neither serves nor ends")),
        }
    }

    /// Starts it and waits until it serves. Otherwise panics with what it said.
    #[track_caller]
    pub fn start(data: &Path, socket: &Path) -> Server {
        let mut server = Server::spawn(data, socket, &[]);
        if let Err(ended) = server.ready() {
            panic!("it does not start on {}: {ended:?}", data.display());
        }
        server
    }

    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it is our child").is_some()
    }

    pub fn has_panicked(&self) -> bool {
        self.panicked.get().is_some()
    }

    /// How it ended, if it did within `limit`.
    pub fn end(&mut self, limit: Duration) -> Option<Ended> {
        let until = Instant::now() + limit;
        loop {
            if let Some(status) = self.child.try_wait().expect("it is our child") {
                let now = Instant::now();
                let errors = self.errors.take().map(|errors| errors.join().unwrap());
                let since_panic = self.panicked.get().map(|then| now.duration_since(*then));
                return Some(Ended { status, errors: errors.unwrap_or_default(), since_panic });
            }
            if Instant::now() >= until {
                return None;
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// SIGSTOP and SIGCONT: between them the process does not run.
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &id]).status();
        assert!(sent.is_ok_and(|status| status.success()), "{name} for {id}");
    }

    /// SIGKILL. It must have run until then.
    #[track_caller]
    pub fn kill(mut self) {
        if let Some(ended) = self.end(Duration::ZERO) {
            panic!("it ended by itself: {ended:?}");
        }
        self.child.kill().expect("it is our child");
        self.child.wait().expect("it is our child");
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn endpoint(socket: &Path) -> String {
    format!("ipc://{}", socket.display())
}

/// Copies a directory with everything in it, except the copy that a start may have been checking.
/// Those files may disappear while they are read, and the next start makes another copy.
pub fn copy_tree(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_name() == "checking" {
            continue;
        }
        let target = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy_tree(&entry.path(), &target),
            false => {
                std::fs::copy(entry.path(), target).unwrap();
            }
        }
    }
}
