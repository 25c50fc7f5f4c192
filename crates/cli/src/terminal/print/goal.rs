//! The goal of a task, and how much of it is reached.

/// The goal at the start of an episode.
pub fn goal(goal: &str, fewest: Option<u32>) -> String {
    match fewest {
        Some(1) => format!("Goal: {goal}. (1 action is enough.)"),
        Some(fewest) => format!("Goal: {goal}. ({fewest} actions are enough.)"),
        None => format!("Goal: {goal}."),
    }
}

/// The parts of the goal: `[x] the mug is clean  [ ] it is on the counter top`.
pub fn progress(progress: &[(String, bool)]) -> String {
    let part = |(words, holds): &(String, bool)| {
        let mark = if *holds { 'x' } else { ' ' };
        format!("[{mark}] {words}")
    };
    progress.iter().map(part).collect::<Vec<_>>().join("  ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_marks_what_holds() {
        let parts = [("the mug is clean".to_owned(), true), ("it is away".to_owned(), false)];
        assert_eq!(progress(&parts), "[x] the mug is clean  [ ] it is away");
        assert_eq!(goal("wash the mug", Some(8)), "Goal: wash the mug. (8 actions are enough.)");
    }
}
