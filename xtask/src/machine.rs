//! Installs what the tests need and the machine lacks.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The workspace's folder.
pub(crate) fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask lies in the workspace").to_owned()
}

/// True if a program runs with these arguments.
pub(crate) fn answers(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Runs a command in the workspace's folder.
///
/// - errors: a sentence with the command line and how it ended.
pub(crate) fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    run_with(&[], program, arguments)
}

/// The same as [`run`], with more environment variables.
pub(crate) fn run_with(
    environment: &[(&str, &str)],
    program: &str,
    arguments: &[&str],
) -> Result<(), String> {
    let line = format!("{program} {}", arguments.join(" "));
    let status = Command::new(program)
        .args(arguments)
        .envs(environment.iter().copied())
        .current_dir(root())
        .status()
        .map_err(|error| format!("cannot run `{line}`: {error}"))?;
    match status.success() {
        true => Ok(()),
        false => Err(format!("`{line}` failed: {status}")),
    }
}

/// The folder that cargo builds into.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The service in the release build.
///
/// - errors: it does not build.
pub(crate) fn release_binary() -> Result<PathBuf, String> {
    let what = ["--quiet", "--package", "apprentice-cli", "--bin", "apprentice"];
    run("cargo", &[&["build", "--release"], &what[..]].concat())?;
    Ok(target().join("release/apprentice"))
}

/// The service without any optimisation.
///
/// - errors: it does not build.
pub(crate) fn unoptimised_binary() -> Result<PathBuf, String> {
    built_otherwise("unoptimised", &["opt-level=0"])
}

/// The service with our own packages built as in a release.
///
/// - errors: it does not build.
pub(crate) fn optimised_binary() -> Result<PathBuf, String> {
    built_otherwise(
        "optimised",
        &["opt-level=3", "debug-assertions=false", "overflow-checks=false", "debug=false"],
    )
}

/// Our own packages that a binary is built from.
const OWN: [&str; 8] = [
    "apprentice",
    "apprentice-cli",
    "apprentice-client",
    "apprentice-core",
    "apprentice-household",
    "apprentice-migrations",
    "apprentice-mind",
    "apprentice-study",
];

/// The service with our own packages built with other settings. Its dependencies are those of the
/// development build, so that they are not all built again. A separate profile would build them
/// all.
fn built_otherwise(name: &str, settings: &[&str]) -> Result<PathBuf, String> {
    let mut arguments = vec!["build".to_owned()];
    for package in OWN {
        for setting in settings {
            let setting = format!("profile.dev.package.{package}.{setting}");
            arguments.extend(["--config".to_owned(), setting]);
        }
    }
    let what = ["--quiet", "--package", "apprentice-cli", "--bin", "apprentice"];
    arguments.extend(what.map(str::to_owned));
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    run("cargo", &arguments)?;
    // The next development build writes to the same place.
    let (built, kept) =
        (target().join("debug/apprentice"), target().join(format!("{name}-apprentice")));
    std::fs::copy(&built, &kept).map_err(|e| format!("cannot copy {}: {e}", built.display()))?;
    Ok(kept)
}

/// Installs the emulator of other processors unless it is there.
pub(crate) fn qemu() -> Result<(), String> {
    debian("qemu-user", || answers("qemu-x86_64", &["--version"]))
}

/// A Python with the packages of the wire's example and of the second reader of proofs, in `target/python`.
pub(crate) fn python() -> Result<PathBuf, String> {
    let folder = root().join("target/python");
    let python = folder.join("bin/python");
    let path = python.display().to_string();
    if answers(&path, &["-c", "import zmq, msgpack, cryptography"]) {
        return Ok(python);
    }
    say("a Python environment in target/python");
    let made = run("python3", &["-m", "venv", &folder.display().to_string()]);
    if made.is_err() {
        debian("python3-venv", || answers("python3", &["-c", "import ensurepip"]))?;
        run("python3", &["-m", "venv", &folder.display().to_string()])?;
    }
    let packages = ["pyzmq==27.1.0", "msgpack==1.1.2", "cryptography==46.0.3"];
    run(&path, &[&["-m", "pip", "install", "--quiet"], &packages[..]].concat())?;
    Ok(python)
}

/// Says what is being installed.
fn say(what: &str) {
    eprintln!("xtask: installing {what}");
}

/// Installs everything that [`crate::stage`] needs and this machine lacks.
///
/// - returns: sentences about what could not be installed, if not every machine needs it.
/// - errors: what could not be installed and is needed.
pub(crate) fn setup() -> Result<Vec<String>, String> {
    python()?;
    qemu()?;
    cargo_deny()?;
    let missing = disk_tools().err();
    Ok(missing.into_iter().map(|it| format!("power cuts cannot be tried: {it}")).collect())
}

/// Installs a Debian package unless `present` says that it is there.
pub(crate) fn debian(package: &str, present: impl Fn() -> bool) -> Result<(), String> {
    if present() {
        return Ok(());
    }
    say(package);
    run("apt-get", &["update", "--quiet"])?;
    run("apt-get", &["install", "--yes", "--quiet", "--no-install-recommends", package])
}

/// The programs that make and mount a file system in a file.
pub(crate) fn disk_tools() -> Result<(), String> {
    debian("e2fsprogs", || answers("mkfs.ext4", &["-V"]))?;
    debian("mount", || answers("losetup", &["--version"]))?;
    debian("util-linux", || answers("unshare", &["--version"]))
}

/// Installs the licence checker unless it is there.
pub(crate) fn cargo_deny() -> Result<(), String> {
    if answers("cargo", &["deny", "--version"]) {
        return Ok(());
    }
    say("cargo-deny 0.20.2");
    // It runs only once, and a build without optimisation is faster.
    let install = ["install", "cargo-deny", "--version", "0.20.2", "--locked", "--debug"];
    run("cargo", &[&install[..], &["--quiet"]].concat())
}
