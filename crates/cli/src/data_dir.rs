use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::failure::Failure;

/// The directory that `--data` names, else the one where this system keeps a person's data:
/// `$XDG_DATA_HOME/apprentice`, or `~/.local/share/apprentice`.
///
/// - errors: no flag and no home directory.
pub fn choose(flag: Option<PathBuf>) -> Result<PathBuf, Failure> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    match flag {
        Some(directory) if directory.as_os_str().is_empty() => {
            Err(Failure::bad_input("--data is empty; name a directory"))
        }
        Some(directory) => Ok(directory),
        None => default(variable("XDG_DATA_HOME"), variable("HOME")).ok_or_else(|| {
            Failure::bad_input(
                "there is no home directory to keep data in; choose a directory with --data DIR",
            )
        }),
    }
}

/// For commands that change a directory and must not make a new one because of a typing error.
pub fn must_hold_data(directory: &Path) -> Result<(), Failure> {
    match directory.join("LAYOUT").exists() {
        true => Ok(()),
        false => Err(Failure::bad_input(format!(
            "there is no data directory of apprentice at {}; name the right one with --data",
            directory.display()
        ))),
    }
}

fn default(data_home: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    // The XDG base directory specification says to ignore relative paths.
    let data_home = data_home.map(PathBuf::from).filter(|path| path.is_absolute());
    let base = data_home.or_else(|| home.map(|home| PathBuf::from(home).join(".local/share")));
    base.map(|base| base.join("apprentice"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_directory_follows_the_system() {
        let chosen = |data: Option<&str>, home: Option<&str>| {
            default(data.map(OsString::from), home.map(OsString::from))
        };
        assert_eq!(chosen(Some("/d"), Some("/h")), Some("/d/apprentice".into()));
        assert_eq!(chosen(Some("d"), Some("/h")), Some("/h/.local/share/apprentice".into()));
        assert_eq!(chosen(None, Some("/h")), Some("/h/.local/share/apprentice".into()));
        assert_eq!(chosen(None, None), None);
    }
}
