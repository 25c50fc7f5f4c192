//! How long each stage may take on two quiet cores, from `xtask/budget.toml`.

use std::collections::BTreeMap;
use std::fs;

use serde::Deserialize;

use crate::machine;

/// Seconds by stage, for a clean build tree and for a warm one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    seconds: BTreeMap<String, u64>,
}

impl Budget {
    pub fn load() -> Result<Budget, String> {
        let path = machine::root().join("xtask/budget.toml");
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// - errors: the stage has no budget, or took longer than it.
    pub fn check(&self, stage: &str, seconds: u64) -> Result<(), String> {
        let allowed = self.seconds.get(stage).copied();
        let allowed =
            allowed.ok_or_else(|| format!("stage {stage} has no line in xtask/budget.toml"))?;
        match seconds <= allowed {
            true => Ok(()),
            false => Err(format!(
                "stage {stage} took {seconds} s, its budget is {allowed} s (xtask/budget.toml)"
            )),
        }
    }
}
