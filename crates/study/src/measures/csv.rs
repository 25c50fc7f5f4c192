//! Rows as comma-separated values (RFC 4180, lines end with LF, fixed decimal places).

use super::rows::{EpisodeRow, UtteranceRow};
use super::summary::{AnsweredRow, SummaryRow};
use crate::cells;

pub fn utterances_csv(rows: &[UtteranceRow]) -> String {
    let mut table = Table::new(
        "condition,task_type,user,episode,turn,utterance,outcome,answered_by,guessed,meant,right,\
         primitives,taught",
    );
    for row in rows {
        table.line(&[
            &row.condition,
            &row.task_type,
            &row.user,
            &row.episode.to_string(),
            &row.turn.to_string(),
            &row.utterance,
            row.outcome,
            &row.answered_by,
            bit(row.guessed),
            &row.meant,
            row.right.map_or("", bit),
            &row.primitives.to_string(),
            bit(row.taught),
        ]);
    }
    table.0
}

pub fn episodes_csv(rows: &[EpisodeRow]) -> String {
    let mut table = Table::new(
        "condition,task_type,user,episode,goal,utterances,understood,not_sure,impossible,wrong,\
         primitives,fewest_actions,normalised_length,complexity,examples_taught,finished",
    );
    for row in rows {
        table.line(&[
            &row.condition,
            &row.task_type,
            &row.user,
            &row.episode.to_string(),
            &row.goal,
            &row.utterances.to_string(),
            &row.understood.to_string(),
            &row.not_sure.to_string(),
            &row.impossible.to_string(),
            &row.wrong.to_string(),
            &row.primitives.to_string(),
            &row.fewest_actions.map_or(String::new(), |fewest| fewest.to_string()),
            &decimal(row.normalised_length),
            &decimal(row.complexity),
            &row.examples_taught.to_string(),
            bit(row.finished),
        ]);
    }
    table.0
}

pub fn summary_csv(rows: &[SummaryRow]) -> String {
    let mut table = Table::new("condition,task_type,episode,measure,users,mean,sd");
    for row in rows {
        table.line(&[
            &row.condition,
            &row.task_type,
            &row.episode.to_string(),
            row.measure,
            &row.users.to_string(),
            &decimal(Some(row.mean)),
            &decimal(row.sd),
        ]);
    }
    table.0
}

pub fn answered_csv(rows: &[AnsweredRow]) -> String {
    let mut table = Table::new("condition,answered_by,parses,share");
    for row in rows {
        let parses = row.parses.to_string();
        table.line(&[&row.condition, &row.answered_by, &parses, &decimal(Some(row.share))]);
    }
    table.0
}

fn bit(holds: bool) -> &'static str {
    if holds { "1" } else { "0" }
}

fn decimal(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{value:.4}"))
}

struct Table(String);

impl Table {
    fn new(head: &str) -> Table {
        Table(format!("{head}\n"))
    }

    fn line(&mut self, fields: &[&str]) {
        for (index, field) in fields.iter().enumerate() {
            if index > 0 {
                self.0.push(',');
            }
            self.0.push_str(&cells::written(field));
        }
        self.0.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_break_a_line_is_quoted() {
        let mut table = Table::new("a,b");
        table.line(&["put it, then \"go\"", ""]);
        table.line(&["=1+1", "-1.5000"]);
        assert_eq!(table.0, "a,b\n\"put it, then \"\"go\"\"\",\n'=1+1,-1.5000\n");
    }
}
