use std::collections::VecDeque;

use apprentice::world::Stage;

/// What the next episodes are about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stages {
    /// The seed of a person's first episode; each later one has the next number.
    seed: u64,
    /// Tasks still to come, from the command line or `:task`; then tasks are drawn.
    tasks: VecDeque<String>,
}

impl Stages {
    pub fn new(seed: u64, tasks: Vec<String>) -> Stages {
        Stages { seed, tasks: tasks.into() }
    }

    /// Puts a task before all others.
    pub fn put_first(&mut self, task: String) {
        self.tasks.push_front(task);
    }

    /// The stage for the episode after `episodes` others. A task is taken only once, even when its
    /// stage then turns out to be impossible.
    pub fn next(&mut self, episodes: u32) -> Stage {
        let seed = self.seed.wrapping_add(u64::from(episodes));
        match self.tasks.pop_front() {
            Some(task) => Stage::Task { task, seed },
            None => Stage::Seed { seed },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_fixes_every_episode_and_a_restart_goes_on_with_the_next() {
        let mut stages = Stages::new(7, vec!["clean Mug CounterTop".into()]);
        let task = "clean Mug CounterTop".to_owned();
        assert_eq!(stages.next(0), Stage::Task { task, seed: 7 });
        assert_eq!(stages.next(1), Stage::Seed { seed: 8 });
        stages.put_first("heat Apple Fridge".into());
        assert!(matches!(stages.next(2), Stage::Task { seed: 9, .. }));
        assert_eq!(Stages::new(7, vec![]).next(1), Stage::Seed { seed: 8 });
    }
}
