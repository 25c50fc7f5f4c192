//! Where a person is: when they come, and when they ask.

use apprentice::client::{Phase, Status};
use apprentice::plain::count;

use super::answer::action;
use super::goal::progress;

/// What a person who comes back hears: where they are and what the robot has learned from them.
pub fn welcome(user: &str, status: &Status) -> String {
    if status.episodes == 0 {
        return format!(
            "Hello, {user}! I know {}. You teach me the rest. Type :help to see how.",
            count(status.exemplars, "example")
        );
    }
    let lessons = match status.lessons {
        0 => "no lesson yet".to_owned(),
        n => count(n, "lesson"),
    };
    let now = match status.phase {
        Phase::Interacting => " You are in the middle of a task.",
        Phase::Teaching => " You were teaching me.",
        Phase::Learning => " I am still learning from your lessons.",
        Phase::Idle | Phase::Closed => "",
    };
    format!("Welcome back, {user}: {} so far, {lessons}.{now}", count(status.episodes, "task"))
}

/// `:status`.
pub fn status(status: &Status) -> Vec<String> {
    let mut lines = Vec::new();
    let phase = match status.phase {
        Phase::Idle => "between two tasks",
        Phase::Interacting => "in a task",
        Phase::Teaching => "being taught",
        Phase::Learning => "learning",
        Phase::Closed => "closed",
    };
    lines.push(format!(
        "I am {phase}: task {}, {}, {}.",
        status.episodes,
        count(status.utterances, "utterance"),
        count(status.actions.len() as u32, "action")
    ));
    if let Some(goal) = &status.goal {
        lines.push(format!("Goal: {goal}. {}", progress(&status.progress)));
    }
    lines.extend(status.actions.iter().map(action));
    lines.push(format!(
        "I know {}, {} from you (recipe {}, mind {}).",
        count(status.exemplars, "example"),
        status.lessons,
        status.recipe,
        status.mind.short()
    ));
    lines
}
