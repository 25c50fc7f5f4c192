//! The report for people.

use std::fmt::{self, Display};

use apprentice::language::Outcome;
use apprentice::plain;

use super::report::{EpisodeReport, Figures, LeftOut, Report, VariantReport};

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.variants.iter().map(|variant| &*variant.name).collect();
        writeln!(
            f,
            "rerun with {}: {}, {}, {}",
            names.join(", "),
            count(self.people, "person", "people"),
            count(self.episodes, "episode", "episodes"),
            count(self.turns, "turn", "turns")
        )?;
        writeln!(f, "held fixed: {}", self.holds)?;
        let minds = &self.minds;
        if minds.trained + minds.trainings_failed > 0 {
            let trained = count(minds.trained as usize, "mind", "minds");
            write!(f, "trained for this: {trained} with lessons")?;
            match minds.trainings_failed {
                0 => writeln!(f)?,
                failed => {
                    writeln!(f, "; {failed} trainings failed, so the minds before them were used")?
                }
            }
        }
        if minds.recorded > 0 {
            let (all, again) = (minds.recorded, minds.recorded_rebuilt);
            let minds = count(all as usize, "mind", "minds");
            writeln!(
                f,
                "recorded: {minds} with lessons; {again} of them rebuilt from the log, with the same \
                 digest"
            )?;
        }
        for LeftOut { tenant, user, why, is_fault } in &self.left_out {
            let who = user.as_ref().map_or("unknown user", |user| user.as_str());
            let mark = if *is_fault { "LEFT OUT BECAUSE OF A FAULT" } else { "left out" };
            let left_out = format!("{mark}: {tenant}/{who}: {why}");
            writeln!(f, "{}", plain::escape(&left_out))?;
        }
        match &self.variants[..] {
            [only] => {
                people(f, only)?;
                alone(f, only)
            }
            several => sweep(f, several),
        }
    }
}

fn people(f: &mut fmt::Formatter<'_>, variant: &VariantReport) -> fmt::Result {
    for person in variant.people.iter().filter(|person| !person.episodes.is_empty()) {
        let (tenant, user, recipe) = (&person.tenant, &person.user, &person.recorded_recipe);
        let head = format!("{tenant}/{user} (recorded with {recipe})");
        writeln!(f, "\n{}", plain::escape(&head))?;
        for episode in &person.episodes {
            of_episode(f, episode)?;
        }
    }
    Ok(())
}

fn of_episode(f: &mut fmt::Formatter<'_>, episode: &EpisodeReport) -> fmt::Result {
    let EpisodeReport { episode: number, goal, turns, loop_ends_at_turn, differences } = episode;
    let goal = plain::escape(goal.trim_end_matches('.'));
    let ends = match loop_ends_at_turn {
        Some(turn) => format!("the open loop ends at turn {turn}"),
        None => "no action differs".to_owned(),
    };
    writeln!(
        f,
        "  episode {number}, {goal}: {} of {} differ; {ends}",
        differences.len(),
        count(*turns, "turn", "turns")
    )?;
    for difference in differences {
        let mark = if difference.before_the_loop_ended { "" } else { " (after the end)" };
        writeln!(f, "    turn {}{mark}: {:?}", difference.turn, difference.utterance)?;
        writeln!(f, "      recorded  {}", plain::escape(&said(&difference.recorded)))?;
        writeln!(f, "      other     {}", plain::escape(&said(&difference.other)))?;
    }
    Ok(())
}

/// Both scopes of one variant beside each other.
fn alone(f: &mut fmt::Formatter<'_>, variant: &VariantReport) -> fmt::Result {
    let VariantReport { up_to_the_end: near, over_all_turns: all, episodes, .. } = variant;
    writeln!(f, "\n{:<34}{:>18}{:>18}", "", "up to the end of", "over all")?;
    writeln!(f, "{:<34}{:>18}{:>18}", "", "the open loop", "recorded turns")?;
    let mut row = |name: &str, of: &dyn Fn(&Figures) -> String| {
        writeln!(f, "{name:<34}{:>18}{:>18}", of(near), of(all))
    };
    row("turns", &|figures| figures.turns.to_string())?;
    row("  same answer", &|figures| figures.same.to_string())?;
    row("  different", &|figures| figures.different.to_string())?;
    row("    became understood", &|figures| figures.became_understood.to_string())?;
    row("    became not sure", &|figures| figures.became_not_sure.to_string())?;
    row("    became impossible", &|figures| figures.became_impossible.to_string())?;
    row("    became another program", &|figures| figures.another_program.to_string())?;
    let arrow = |was: f64, would: f64, places: usize| format!("{was:.places$} → {would:.places$}");
    row("understood, %", &|figures| {
        let share = |understood: usize| 100.0 * understood as f64 / figures.turns.max(1) as f64;
        arrow(share(figures.recorded.understood), share(figures.other.understood), 1)
    })?;
    row("program complexity per turn", &|figures| {
        arrow(figures.recorded.complexity, figures.other.complexity, 2)
    })?;
    row("examples taught, per person", &|figures| {
        arrow(figures.examples_taught.recorded, figures.examples_taught.other, 1)
    })?;
    row("  lessons that were needless", &|f| f.examples_taught.needless.to_string())?;
    row("  newly open to teaching", &|f| f.examples_taught.newly_open.to_string())?;
    writeln!(f)?;
    match episodes.loop_end_turn {
        None => writeln!(
            f,
            "No action differs in any of the {}, so every user would have seen the same scenes.",
            count(episodes.episodes, "episode", "episodes")
        )?,
        Some(turn) => writeln!(
            f,
            "The open loop ends in {} of {}, at turn {turn:.1} on average.",
            episodes.loop_ends,
            count(episodes.episodes, "episode", "episodes")
        )?,
    }
    if let Some(recorded) = episodes.normalised_length_recorded {
        write!(f, "Normalised episode length: {recorded:.3} recorded; ")?;
        match (episodes.loop_ends, episodes.normalised_length_unchanged) {
            (0, _) => writeln!(f, "the other is the same.")?,
            (_, Some(unchanged)) => writeln!(
                f,
                "{unchanged:.3} for both in episodes where the loop never ends; unknown for the other \
                 in the rest."
            )?,
            (_, None) => writeln!(f, "the other is unknown, because every loop ends.")?,
        }
    }
    Ok(())
}

/// One line for each variant, twice.
fn sweep(f: &mut fmt::Formatter<'_>, variants: &[VariantReport]) -> fmt::Result {
    type Of = fn(&VariantReport) -> &Figures;
    let scopes: [(&str, Of); 2] = [
        ("Up to the end of the open loop in each episode", |variant| &variant.up_to_the_end),
        ("Over all recorded turns", |variant| &variant.over_all_turns),
    ];
    let width = variants.iter().map(|variant| variant.name.chars().count()).max().unwrap_or(0);
    let width = width.max("recorded".len()) + 2;
    for (title, of) in scopes {
        writeln!(f, "\n{title}")?;
        writeln!(
            f,
            "{:<width$}{:>7}{:>7} │{:^39}│{:>12}{:>12}{:>13}",
            "", "", "same", "became", "understood,", "primitives", "loop ends,"
        )?;
        writeln!(
            f,
            "{:<width$}{:>7}{:>7} │{:>11}{:>10}{:>9}{:>9}│{:>12}{:>12}{:>13}",
            "",
            "turns",
            "answer",
            "understood",
            "not sure",
            "imposs.",
            "another",
            "%",
            "per turn",
            "episodes"
        )?;
        for variant in variants {
            let figures = of(variant);
            let share = |n: usize| 100.0 * n as f64 / figures.turns.max(1) as f64;
            writeln!(
                f,
                "{:<width$}{:>7}{:>7} │{:>11}{:>10}{:>9}{:>9}│{:>12.1}{:>12.2}{:>13}",
                variant.name,
                figures.turns,
                figures.same,
                figures.became_understood,
                figures.became_not_sure,
                figures.became_impossible,
                figures.another_program,
                share(figures.other.understood),
                figures.other.complexity,
                format!("{}/{}", variant.episodes.loop_ends, variant.episodes.episodes)
            )?;
        }
    }
    if let Some(first) = variants.first() {
        let figures = &first.over_all_turns;
        writeln!(
            f,
            "\nRecorded, over all {}: {} understood, {} not sure, {} impossible; complexity {:.2}.",
            count(figures.turns, "turn", "turns"),
            figures.recorded.understood,
            figures.recorded.not_sure,
            figures.recorded.impossible,
            figures.recorded.complexity
        )?;
    }
    writeln!(f, "--json and --out FILE.csv give every turn.")
}

fn said(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Understood { program, .. } if program.steps.is_empty() => {
            "understood, with nothing to do".to_owned()
        }
        Outcome::Understood { program, .. } => program.to_string(),
        Outcome::Impossible { program, step, reason } => {
            let reason = reason.trim_end_matches('.');
            format!("impossible at step {} of {program}: {reason}", step + 1)
        }
        Outcome::NotSure => "not sure".to_owned(),
        Outcome::Asked { question } => question.text.clone(),
        Outcome::Told { text } => text.clone(),
    }
}

fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}
