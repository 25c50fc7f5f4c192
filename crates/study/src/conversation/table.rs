//! The report for people.

use std::fmt::{self, Display};

use super::{Case, Class, ConversationReport, Counts, Shares};

/// Width of a transcript's name.
const NAME: usize = 28;

impl Display for ConversationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let transcripts = self.transcripts.len();
        write!(f, "conversation · recipe {} ({})", self.recipe, self.recipe_digest)?;
        if let Some(seed) = self.seed {
            write!(f, " · seed {seed}")?;
        }
        writeln!(f, " · {transcripts} transcripts")?;
        if self.trainings_failed > 0 {
            writeln!(f, "{} trainings after lessons failed", self.trainings_failed)?;
        }
        writeln!(
            f,
            "\n{:<NAME$}{:>6}{:>7}{:>7}{:>6}{:>9}{:>9}{:>9}{:>7} | {:>6}{:>7}",
            "",
            "asked",
            "right",
            "ahead",
            "else",
            "misread",
            "imposs.",
            "unsure",
            "spared",
            "left",
            "acted"
        )?;
        for of in &self.transcripts {
            row(f, &of.name, &of.counts)?;
        }
        row(f, "all", &self.total)?;
        writeln!(
            f,
            "\n{:<NAME$}{:>6}{:>16}{:>9}{:>10}",
            "", "n", "something else", "misread", "as meant"
        )?;
        let Shares { something_else, misread, as_meant, .. } = self.shares;
        shares(f, "all utterances", self.total.asked, [something_else, misread, as_meant])?;
        let Shares { requests_something_else, requests_misread, requests_as_meant, .. } =
            self.shares;
        let of_requests = [requests_something_else, requests_misread, requests_as_meant];
        shares(f, "  those that asked for a thing", self.shares.requests, of_requests)?;
        let mut cases: Vec<&Case> = self.cases.iter().collect();
        cases.sort_by_key(|case| case.class);
        for of_class in cases.chunk_by(|one, next| one.class == next.class) {
            writeln!(f, "\nCases: {}\n", said(of_class[0].class))?;
            writeln!(f, "| line | said | meant | answered |\n|---|---|---|---|")?;
            for Case { file, line, utterance, meant, answered, .. } in of_class {
                writeln!(f, "| {file}:{line} | {utterance} | {meant} | {answered} |")?;
            }
        }
        Ok(())
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, counts: &Counts) -> fmt::Result {
    let Counts { asked, right, ahead, something_else, misread, impossible, not_sure, .. } = counts;
    let Counts { spared, rightly_left, wrongly_acted, .. } = counts;
    writeln!(
        f,
        "{name:<NAME$}{asked:>6}{right:>7}{ahead:>7}{something_else:>6}{misread:>9}\
         {impossible:>9}{not_sure:>9}{spared:>7} | {rightly_left:>6}{wrongly_acted:>7}"
    )
}

fn shares(f: &mut fmt::Formatter<'_>, name: &str, n: usize, of: [f64; 3]) -> fmt::Result {
    let [something_else, misread, as_meant] = of.map(|share| format!("{:.1} %", share * 100.0));
    writeln!(f, "{name:<NAME$}{n:>6}{something_else:>16}{misread:>9}{as_meant:>10}")
}

fn said(class: Class) -> &'static str {
    match class {
        Class::Right => "right",
        Class::Ahead(_) => "ahead",
        Class::SomethingElse => "something else",
        Class::Misread => "misread",
        Class::Impossible => "impossible, as meant",
        Class::NotSure => "not sure",
        Class::RightlyLeft => "rightly left",
        Class::WronglyActed => "meant nothing, and was carried out",
    }
}
