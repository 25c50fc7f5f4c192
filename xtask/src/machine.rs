//! What the tests need from the machine, installed when it is missing.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The workspace's folder.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask lies in the workspace").to_owned()
}

/// Whether a program answers to these arguments.
pub fn answers(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Runs a command in the workspace's folder.
///
/// - errors: a sentence with the command line and how it ended.
pub fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    run_with(&[], program, arguments)
}

/// As [`run`], with more environment variables.
pub fn run_with(
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

/// The service as released.
///
/// - errors: it does not build.
pub fn release_binary() -> Result<PathBuf, String> {
    run(
        "cargo",
        &["build", "--release", "--quiet", "--package", "apprentice", "--bin", "apprentice"],
    )?;
    Ok(target().join("release/apprentice"))
}

/// The service without any optimisation. The packages it depends on are those of the development
/// build: only our own are built once more, which a profile of its own would not allow.
///
/// - errors: it does not build.
pub fn unoptimised_binary() -> Result<PathBuf, String> {
    let own = "profile.dev.package.apprentice.opt-level=0";
    let migrations = "profile.dev.package.apprentice-migrations.opt-level=0";
    let what = ["--quiet", "--package", "apprentice", "--bin", "apprentice"];
    run("cargo", &[&["build", "--config", own, "--config", migrations], &what[..]].concat())?;
    // The next development build takes that place again.
    let (built, kept) =
        (target().join("debug/apprentice"), target().join("unoptimised-apprentice"));
    std::fs::copy(&built, &kept).map_err(|e| format!("cannot copy {}: {e}", built.display()))?;
    Ok(kept)
}

/// Installs the emulator of other processors unless it is there.
pub fn qemu() -> Result<(), String> {
    debian("qemu-user", || answers("qemu-x86_64", &["--version"]))
}

/// A Python with the packages of the wire's example and of the second reader of proofs, in `target/python`.
pub fn python() -> Result<PathBuf, String> {
    let folder = root().join("target/python");
    let python = folder.join("bin/python");
    let path = python.display().to_string();
    if answers(&path, &["-c", "import zmq, msgpack, cryptography"]) {
        return Ok(python);
    }
    let made = run("python3", &["-m", "venv", &folder.display().to_string()]);
    if made.is_err() {
        debian("python3-venv", || answers("python3", &["-c", "import ensurepip"]))?;
        run("python3", &["-m", "venv", &folder.display().to_string()])?;
    }
    let packages = ["pyzmq==27.1.0", "msgpack==1.1.2", "cryptography==46.0.3"];
    run(&path, &[&["-m", "pip", "install", "--quiet"], &packages[..]].concat())?;
    Ok(python)
}

/// Installs a Debian package unless `present` says that it is there.
pub fn debian(package: &str, present: impl Fn() -> bool) -> Result<(), String> {
    if present() {
        return Ok(());
    }
    run("apt-get", &["update", "--quiet"])?;
    run("apt-get", &["install", "--yes", "--quiet", "--no-install-recommends", package])
}

/// What makes and mounts a file system in a file.
pub fn disk_tools() -> Result<(), String> {
    debian("e2fsprogs", || answers("mkfs.ext4", &["-V"]))?;
    debian("mount", || answers("losetup", &["--version"]))?;
    debian("util-linux", || answers("unshare", &["--version"]))
}

/// Installs the licence checker unless it is there.
pub fn cargo_deny() -> Result<(), String> {
    if answers("cargo", &["deny", "--version"]) {
        return Ok(());
    }
    run("cargo", &["install", "cargo-deny", "--version", "0.20.2", "--locked", "--quiet"])
}
