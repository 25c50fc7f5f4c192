//! How long each stage may take on two quiet cores, from `xtask/budget.toml`.

use std::collections::BTreeMap;
use std::fs;

use serde::Deserialize;

use crate::machine;

/// Seconds by stage, for a clean build tree and for a warm one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Budget {
    seconds: BTreeMap<String, u64>,
}

impl Budget {
    pub(crate) fn load() -> Result<Budget, String> {
        let path = machine::root().join("xtask/budget.toml");
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// - returns: a sentence, when the stage took longer than its budget.
    /// - errors: the stage has no budget.
    pub(crate) fn exceeded(&self, stage: &str, seconds: u64) -> Result<Option<String>, String> {
        let allowed = self.seconds.get(stage).copied();
        let allowed =
            allowed.ok_or_else(|| format!("stage {stage} has no line in xtask/budget.toml"))?;
        Ok((seconds > allowed).then(|| {
            format!("stage {stage} took {seconds} s, its budget is {allowed} s (xtask/budget.toml)")
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_over_its_budget_is_named_and_one_without_a_budget_is_an_error() {
        let budget: Budget = toml::from_str("[seconds]\ntest = 60\n").unwrap();
        assert_eq!(budget.exceeded("test", 60), Ok(None));
        let sentence = budget.exceeded("test", 61).unwrap().unwrap();
        assert_eq!(sentence, "stage test took 61 s, its budget is 60 s (xtask/budget.toml)");
        assert!(budget.exceeded("docs", 1).unwrap_err().contains("no line"));
    }
}
