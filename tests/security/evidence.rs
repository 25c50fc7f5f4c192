//! The library, the command and a second program in Python give the same verdict on every proof.
//! The proofs are committed files, good and bad. `UPDATE_GOLDEN=1` writes the files again.

mod vectors;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use apprentice::evidence::{Proof, VerifierKey, verify};
use apprentice_testkit::paths::root;
use apprentice_testkit::python::python;
use vectors::{Vector, key, vectors};

fn folder() -> PathBuf {
    root().join("schema/golden/proofs")
}

/// The meaning of the commands' exit codes.
fn judged(proof: &[u8], since: Option<&[u8]>) -> u8 {
    let key: VerifierKey = key().parse().unwrap();
    let since = since.map(String::from_utf8_lossy);
    match Proof::parse(proof) {
        Err(_) => 2,
        Ok(proof) => u8::from(verify(&proof, &key, since.as_deref()).is_err()),
    }
}

#[test]
fn the_committed_proofs_are_what_todays_code_writes_and_mean_what_their_names_say() {
    let update = std::env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1");
    let mut written = vec![("key.txt".to_owned(), format!("{}\n", key()).into_bytes())];
    for Vector { name, proof, since } in vectors() {
        let wanted = match name.split('-').next().unwrap() {
            "good" => 0,
            "refused" => 1,
            "unreadable" => 2,
            other => panic!("a name that begins with {other} promises nothing"),
        };
        assert_eq!(judged(&proof, since.as_deref()), wanted, "{name}");
        written.extend(since.map(|since| (format!("{name}.since"), since)));
        written.push((format!("{name}.proof"), proof));
    }
    if update {
        let _ = fs::remove_dir_all(folder());
        fs::create_dir_all(folder()).unwrap();
        for (name, bytes) in &written {
            fs::write(folder().join(name), bytes).unwrap();
        }
    }
    let mut found: Vec<(String, Vec<u8>)> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    found.sort();
    written.sort();
    let names = |files: &[(String, Vec<u8>)]| -> Vec<String> {
        files.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&found), names(&written), "written by UPDATE_GOLDEN=1");
    for ((name, found), (_, written)) in found.iter().zip(&written) {
        assert!(found == written, "{name} is not what today's code writes: released bytes stay");
    }
}

#[test]
fn the_command_ends_with_the_code_that_the_library_gives() {
    let binary = env!("CARGO_BIN_EXE_apprentice");
    for Vector { name, proof, since } in vectors() {
        let mut command = Command::new(binary);
        command.arg("verify").arg(folder().join(format!("{name}.proof")));
        command.arg("--key").arg(folder().join("key.txt"));
        if since.is_some() {
            command.arg("--since").arg(folder().join(format!("{name}.since")));
        }
        let output = command.stdin(Stdio::null()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let code = i32::from(judged(&proof, since.as_deref()));
        assert_eq!(output.status.code(), Some(code), "{name}: {said}");
        assert_eq!(said.is_empty(), code == 0, "{name}: {said}");
        assert!(said.lines().count() <= 1, "{name}: {said}");
    }
}

#[test]
fn the_command_shows_what_was_revealed_and_says_the_same_as_json() {
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_apprentice"))
            .current_dir(folder())
            .args(["verify", "--key", &key()])
            .args(arguments)
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (code, said) = run(&["good-revealed.proof"]);
    assert_eq!(code, Some(0));
    assert!(said.contains("SessionClosed") && said.contains("reason 3"), "{said}");
    let (code, said) = run(&["good-revealed.proof", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, &json["verified"]), (Some(0), &true.into()));
    assert_eq!(json["record"]["event"]["reason"], "reason 3");
    let (code, said) = run(&["good-sealed.proof"]);
    assert_eq!(code, Some(0));
    assert!(said.contains("sealed and was not revealed") && !said.contains("reason"), "{said}");
    let (code, said) = run(&["refused-changed-record.proof", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, &json["verified"]), (Some(1), &false.into()));
}

/// Checks every pair of files named on standard input, one pair on a line, in one process.
const JUDGE: &str = "
import sys
sys.path.insert(0, 'tools')
import verify
key = sys.argv[1]
for line in sys.stdin:
    proof, since = (line.rstrip('\\n').split('\\t') + [''])[:2]
    read = lambda path: open(path, 'rb').read()
    try:
        verify.check(read(proof), key, read(since) if since else None)
        print(0)
    except verify.Refused:
        print(1)
    except (verify.Unreadable, ValueError):
        print(2)
";

#[test]
fn the_reader_in_python_judges_every_vector_and_every_damaged_one_alike() {
    use std::io::Write;
    let Some(python) = python("cryptography") else { return };
    let work = tempfile::tempdir().unwrap();
    let (mut lines, mut wanted) = (String::new(), Vec::new());
    let mut ask = |name: String, proof: &[u8], since: Option<&[u8]>| {
        let path = work.path().join(&name);
        fs::write(&path, proof).unwrap();
        lines += path.to_str().unwrap();
        if let Some(since) = since {
            let path = path.with_extension("since");
            fs::write(&path, since).unwrap();
            lines += &format!("\t{}", path.display());
        }
        lines += "\n";
        wanted.push((name, judged(proof, since)));
    };
    let mut drawn = vectors::Draws::new("judged alike");
    for Vector { name, proof, since } in vectors() {
        ask(format!("{name}.proof"), &proof, since.as_deref());
        for round in 0..12 {
            let damaged = drawn.damaged(&proof);
            ask(format!("{name}-{round}.proof"), &damaged, since.as_deref());
            if let Some(since) = &since {
                let damaged = drawn.damaged(since);
                ask(format!("{name}-{round}-older.proof"), &proof, Some(&damaged));
            }
        }
    }
    let mut child = Command::new(python)
        .current_dir(root())
        .args(["-B", "-c", JUDGE, &key()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || stdin.write_all(lines.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stdout).unwrap();
    let said: Vec<u8> = said.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(said.len(), wanted.len());
    for ((name, wanted), said) in wanted.iter().zip(&said) {
        assert_eq!(
            said,
            wanted,
            "{name}: {}",
            fs::read(work.path().join(name)).unwrap().escape_ascii()
        );
    }
    let counts = [0, 1, 2].map(|code| said.iter().filter(|said| **said == code).count());
    println!("judged alike: {counts:?} hold, do not hold, cannot be read");
    assert!(counts.iter().all(|count| *count > 4), "{counts:?}");
}

#[test]
fn the_reader_in_python_runs_by_itself() {
    let Some(python) = python("cryptography") else { return };
    let run = |name: &str, key: &str| {
        let mut command = Command::new(&python);
        command.arg("-B").arg(root().join("tools/verify.py")).current_dir(folder());
        command.args([&format!("{name}.proof"), "--key", key]);
        if folder().join(format!("{name}.since")).exists() {
            command.args(["--since", &format!("{name}.since")]);
        }
        let output = command.output().unwrap();
        (output.status.code().unwrap(), String::from_utf8(output.stdout).unwrap())
    };
    let (code, said) = run("good-grown", "key.txt");
    assert_eq!(code, 0);
    assert!(said.contains("record 3 of stream") && said.contains("only grew, from 2"), "{said}");
    assert_eq!(run("good-sealed", &key()).0, 0);
    assert_eq!(run("refused-changed-record", "key.txt"), (1, String::new()));
    assert_eq!(run("unreadable-title", "key.txt"), (2, String::new()));
    assert_eq!(run("good-sealed", "no-such-key"), (2, String::new()));
    assert_eq!(run("no-such-proof", "key.txt"), (2, String::new()));
}
