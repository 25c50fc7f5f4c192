//! Reports for people.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Write};

use super::failures::Failure;
use super::figures::{Reasons, Shares, Spread};
use super::lessons::{Figures, LessonsReport};
use super::primitives::{Held, PrimitivesReport};
use super::promise::{Band, Promise};
use super::report::Base;

/// Reasons shown of each verdict; the rest is added up.
const REASONS_MAX: usize = 12;

impl Display for Base {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seeds: Vec<String> = self.seeds.iter().map(u64::to_string).collect();
        writeln!(
            f,
            "{} · recipe {} ({}) · people: {} · seeds {}",
            self.protocol,
            self.recipe,
            self.recipe_digest,
            self.people,
            seeds.join(", ")
        )?;
        if let Some(staging) = &self.staging {
            writeln!(f, "staging: {staging}")?;
        }
        if self.unstaged.n > 0 {
            writeln!(f, "{} rows left out: no scene in which they can be done", self.unstaged.n)?;
        }
        Ok(())
    }
}

impl Display for PrimitivesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.base)?;
        let head = ["n", "right", "wrong", "imposs.", "not sure", "precision", "coverage", "area"];
        write!(f, "\n{:<22}{:>7}", "", head[0])?;
        head[1..].iter().try_for_each(|name| write!(f, "{name:>10}"))?;
        writeln!(f)?;
        shares(f, "all primitives", &self.shares)?;
        for (action, of_action) in &self.by_action {
            shares(f, &format!("  {action}"), of_action)?;
        }
        shares(f, "with name clashes", &self.clashes)?;
        for (seed, of_seed) in self.base.seeds.iter().zip(&self.by_seed) {
            shares(f, &format!("  seed {seed} alone"), of_seed)?;
        }
        if let Some(Held { walks, ahead }) = self.held {
            let ahead = percent(ahead);
            writeln!(f, "\n{walks} walks with a thing in the hand; {ahead} right and ahead")?;
        }
        writeln!(
            f,
            "\nuntaught actions accepted: {} of {} ({} rightly, composed of primitives)",
            percent(self.untaught_accepted),
            self.untaught_n,
            percent(self.untaught_right)
        )?;
        let people = &self.by_person;
        writeln!(
            f,
            "\n{:<22}{:>10}{:>9}{:>9}   worst",
            "averaged over people", "mean", "sd", "people"
        )?;
        let rows = [
            ("  right", people.right, &[][..]),
            ("  wrong", people.wrong, &people.worst_wrong[..]),
            ("  untaught accepted", people.untaught_accepted, &people.worst_untaught_accepted[..]),
        ];
        for (name, Spread { mean, sd, n }, worst) in rows {
            let worst: Vec<String> = worst.iter().map(|share| percent(*share)).collect();
            let worst = worst.join(", ");
            writeln!(f, "{name:<22}{:>10}{:>9}{n:>9}   {worst}", percent(mean), percent(sd))?;
        }
        write!(f, "{}", self.promise)?;
        reasons(f, "Why not right", &self.reasons)?;
        failures(f, "Failures", &self.failures)?;
        cases(f, &self.cases)
    }
}

impl Display for LessonsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.base)?;
        write!(f, "{} episodes", self.episodes)?;
        if self.lessons > 1 {
            write!(f, ", {} lessons each (teachers: {})", self.lessons, self.teachers)?;
        }
        match self.trainings_failed.values().sum::<usize>() {
            0 => writeln!(f)?,
            failed => writeln!(f, ", {failed} with a training that failed")?,
        }
        for (reason, count) in &self.trainings_failed {
            writeln!(f, "  {count} × {reason}")?;
        }
        writeln!(f, "\n{:<28}{:>10}{:>9}{:>9}", "", "mean", "sd", "episodes")?;
        figures(f, &self.figures, "")?;
        for (action, of_action) in &self.by_action {
            writeln!(f, "{action}")?;
            figures(f, of_action, "  ")?;
        }
        for (figure, of_figure) in &self.reasons {
            reasons(f, &format!("Why not right: {figure}"), of_figure)?;
        }
        for (figure, of_figure) in &self.failures {
            failures(f, &format!("Failures: {figure}"), of_figure)?;
        }
        cases(f, &self.cases)?;
        Ok(())
    }
}

fn shares(f: &mut fmt::Formatter<'_>, name: &str, shares: &Shares) -> fmt::Result {
    let Shares { n, right, wrong, impossible, not_sure, precision, coverage, area } = *shares;
    write!(f, "{name:<22}{n:>7}")?;
    for value in [right, wrong, impossible, not_sure, precision, coverage, area] {
        write!(f, "{:>10}", percent(value))?;
    }
    writeln!(f)
}

fn figures(f: &mut fmt::Formatter<'_>, figures: &Figures, indent: &str) -> fmt::Result {
    let rows: [(&str, Spread); 9] = [
        ("same sentence, other thing", figures.same_sentence),
        ("same person", figures.same_person),
        ("others, short", figures.others_short),
        ("others", figures.others),
        ("others, wrongly done", figures.others_wrong),
        ("distractors accepted", figures.distractors_accepted),
        ("  of them short", figures.distractors_short_accepted),
        ("primitives right", figures.primitives_right),
        ("precision as the lesson", figures.lesson_precision),
    ];
    for (name, Spread { mean, sd, n }) in rows {
        let name = format!("{indent}{name}");
        writeln!(f, "{name:<28}{:>10}{:>9}{n:>9}", percent(mean), percent(sd))?;
    }
    Ok(())
}

fn reasons(f: &mut fmt::Formatter<'_>, title: &str, reasons: &Reasons) -> fmt::Result {
    for (verdict, counts) in &reasons.0 {
        let total: usize = counts.values().sum();
        writeln!(f, "\n{title}: {verdict:?} ({total})")?;
        let mut counts: Vec<(&String, &usize)> = counts.iter().collect();
        counts.sort_by(|a, b| b.1.cmp(a.1).then(a.0.cmp(b.0)));
        for (reason, count) in counts.iter().take(REASONS_MAX) {
            writeln!(f, "  {count:>6}  {reason}")?;
        }
        let rest: usize = counts.iter().skip(REASONS_MAX).map(|(_, count)| **count).sum();
        if rest > 0 {
            writeln!(f, "  {rest:>6}  others")?;
        }
    }
    Ok(())
}

fn failures(f: &mut fmt::Formatter<'_>, title: &str, failures: &[Failure]) -> fmt::Result {
    let mut kind = String::new();
    for failure in failures {
        let this = format!("{:?}: {}", failure.verdict, failure.reason);
        if this != kind {
            writeln!(f, "\n{title}, {this}")?;
            kind = this;
        }
        writeln!(f, "{failure}")?;
    }
    Ok(())
}

/// Tables in Markdown, one for each verdict.
fn cases(f: &mut fmt::Formatter<'_>, cases: &BTreeMap<&'static str, Vec<Failure>>) -> fmt::Result {
    for (asked, failures) in cases {
        for of_verdict in failures.chunk_by(|one, next| one.verdict == next.verdict) {
            writeln!(f, "\nCases: {asked}, {:?}\n", of_verdict[0].verdict)?;
            writeln!(f, "| row | meant | got | why | nearest |\n|---|---|---|---|---|")?;
            of_verdict.iter().try_for_each(|failure| writeln!(f, "{}", failure.case()))?;
        }
    }
    Ok(())
}

impl Display for Promise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Promise { promised, achieved, by_person, people_below, unknown_accepted, .. } = self;
        writeln!(
            f,
            "\nprecision: {} promised, {} achieved; {} ± {} over {} people, {} of them below",
            percent(*promised),
            percent(*achieved),
            percent(by_person.mean),
            percent(by_person.sd),
            by_person.n,
            percent(*people_below)
        )?;
        writeln!(f, "unknown requests accepted when calibrated: {}", percent(*unknown_accepted))?;
        writeln!(f, "  {:<10}{:>8}{:>10}{:>10}", "surety", "n", "mean", "right")?;
        for Band { from, n, sure, right } in &self.bands {
            let from = format!("{:.2} on", from);
            writeln!(f, "  {from:<10}{n:>8}{:>10}{:>10}", percent(*sure), percent(*right))?;
        }
        Ok(())
    }
}

fn percent(share: f64) -> String {
    let mut text = String::new();
    write!(text, "{:.1} %", share * 100.0).expect("writing to a string succeeds");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_shown_in_percent() {
        assert_eq!(percent(0.5), "50.0 %");
        assert_eq!(percent(1.0), "100.0 %");
    }
}
