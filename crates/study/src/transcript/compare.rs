use similar::TextDiff;

use super::play::{Played, RealAct};
use super::{Act, Answer, Kind, Transcript};

/// Lines of context around each difference.
const CONTEXT_LINES: usize = 3;

impl Transcript {
    /// The transcript with its real answers. Lines whose answer agrees keep their own text when
    /// `keep_agreeing`, so that what differs from the written text is what really differs.
    pub fn with_answers(&self, played: &[(usize, Played)], keep_agreeing: bool) -> String {
        let mut out: Vec<String> = Vec::new();
        let first_act = played.first().map_or(self.lines.len(), |(index, _)| *index);
        out.extend(self.lines[..first_act].iter().map(|line| line.text.clone()));
        for (place, (index, played_act)) in played.iter().enumerate() {
            let next_act = played.get(place + 1).map_or(self.lines.len(), |(index, _)| *index);
            out.push(self.act_line(*index, played_act.act.as_ref(), keep_agreeing));
            self.answer_lines(*index + 1..next_act, &played_act.answers, keep_agreeing, &mut out);
        }
        let mut text = out.join("\n");
        text.push('\n');
        text
    }

    fn act_line(&self, index: usize, real: Option<&RealAct>, keep_agreeing: bool) -> String {
        let line = &self.lines[index];
        let Kind::Act(act) = &line.kind else {
            unreachable!("only acts are played");
        };
        let agrees = match (act, real) {
            (Act::Episode { goal: Some(written) }, Some(RealAct::Episode { goal, .. })) => {
                written == goal
            }
            (Act::Learn { examples: Some(written) }, Some(RealAct::Learn { examples, .. })) => {
                written == examples
            }
            // Nothing was expected, so nothing disagrees.
            _ => true,
        };
        if keep_agreeing && agrees {
            return line.text.clone();
        }
        match real {
            Some(RealAct::Episode { line, .. } | RealAct::Learn { line, .. }) => line.clone(),
            Some(RealAct::Teach { line: meaning }) => {
                format!("{} {meaning}", without_bracket(&line.text))
            }
            Some(RealAct::AsWritten) | None => line.text.clone(),
        }
    }

    /// Real answers take the place of the written ones; remarks and settings stay.
    fn answer_lines(
        &self,
        range: std::ops::Range<usize>,
        answers: &[(Answer, String)],
        keep_agreeing: bool,
        out: &mut Vec<String>,
    ) {
        let lines = &self.lines[range];
        let written: Vec<_> = lines
            .iter()
            .filter_map(|line| match &line.kind {
                Kind::Answer(answer) => Some((answer, &line.text)),
                _ => None,
            })
            .collect();
        let mut real =
            answers.iter().enumerate().map(|(place, (answer, text))| match written.get(place) {
                Some((expected, own)) if keep_agreeing && expected.expects(answer) => {
                    (*own).clone()
                }
                _ => text.clone(),
            });
        if written.is_empty() {
            out.extend(&mut real);
        }
        for line in lines {
            match &line.kind {
                // All of them stand where the first was expected.
                Kind::Answer(_) => out.extend(&mut real),
                _ => out.push(line.text.clone()),
            }
        }
    }

    /// The differences between what was written and what was answered, as a unified diff; none
    /// when all answers agree.
    pub fn differences(&self, name: &str, played: &[(usize, Played)]) -> Option<String> {
        let written: String = self.lines.iter().map(|line| format!("{}\n", line.text)).collect();
        let answered = self.with_answers(played, true);
        if written == answered {
            return None;
        }
        let diff = TextDiff::from_lines(&written, &answered);
        let header = format!("{name} with the real answers");
        let mut unified = diff.unified_diff();
        Some(unified.context_radius(CONTEXT_LINES).header(name, &header).to_string())
    }
}

/// A teach line up to its bracket. A bracket inside the quoted utterance is none.
fn without_bracket(text: &str) -> &str {
    let after_quote = text.rfind('"').map_or(0, |at| at + 1);
    // The quote may stand in the bracket; then the bracket opens after `:=`.
    let from = text.find("\" :=").map_or(after_quote, |at| at + 1);
    match text[from..].find('(') {
        Some(at) => text[..from + at].trim_end(),
        None => text.trim_end(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WRITTEN: &str = "\
# a story
task clean Mug CounterTop
episode put a clean mug on the counter top
> go to the mug
# the nearest one
= GOTO Mug (action 9)

> wash it
teach \"wash it\" := actions 2..3
learn 45 examples
";

    fn played(program: &str, examples: u32) -> (Transcript, Vec<(usize, Played)>) {
        let transcript = Transcript::parse(WRITTEN).unwrap();
        let goal = "put a clean mug on the counter top".to_owned();
        let line = format!("episode {goal} (fewest actions: 8)");
        let act = |act| Played { act: Some(act), answers: vec![] };
        let understood = Answer::Understood(program.parse().unwrap());
        let said = |answer, text: String| Played {
            act: Some(RealAct::AsWritten),
            answers: vec![(answer, text)],
        };
        let learn = format!("learn {examples} examples");
        let played = vec![
            (2, act(RealAct::Episode { goal, line })),
            (3, said(understood, format!("= {program} (action 1)"))),
            (7, said(Answer::NotSure, "? not sure".to_owned())),
            (8, act(RealAct::Teach { line: "(GOTO SinkBasin)".to_owned() })),
            (9, act(RealAct::Learn { examples, line: learn })),
        ];
        (transcript, played)
    }

    #[test]
    fn running_fills_in_the_real_answers_and_keeps_remarks() {
        let (transcript, played) = played("GOTO Mug", 45);
        assert_eq!(
            transcript.with_answers(&played, false),
            "\
# a story
task clean Mug CounterTop
episode put a clean mug on the counter top (fewest actions: 8)
> go to the mug
# the nearest one
= GOTO Mug (action 1)

> wash it
? not sure

teach \"wash it\" := actions 2..3 (GOTO SinkBasin)
learn 45 examples
"
            .replace("? not sure\n\n", "? not sure\n")
        );
    }

    #[test]
    fn what_was_run_has_no_differences_from_itself() {
        let (transcript, played) = played("GOTO Mug", 45);
        let text = transcript.with_answers(&played, false);
        let again = Transcript::parse(&text).unwrap();
        let moved: Vec<_> = played
            .iter()
            .map(|(index, played)| (if *index > 7 { index + 1 } else { *index }, played.clone()))
            .collect();
        assert_eq!(again.differences("wash.txt", &moved), None);
    }

    #[test]
    fn only_what_differs_is_shown_and_brackets_do_not_differ() {
        let (transcript, played) = played("GOTO Cup", 46);
        let diff = transcript.differences("wash.txt", &played).unwrap();
        for line in ["-= GOTO Mug (action 9)", "+= GOTO Cup (action 1)", "+? not sure"] {
            assert!(diff.lines().any(|found| found == line), "{line} is missing in\n{diff}");
        }
        assert!(diff.contains("-learn 45 examples\n+learn 46 examples"), "{diff}");
        let changed = diff.lines().skip(2).filter(|line| line.starts_with(['+', '-'])).count();
        assert_eq!(changed, 5, "{diff}");
    }

    #[test]
    fn a_bracket_in_a_taught_utterance_stays() {
        let line = r#"teach "wash (the) mug" := actions 2..3 (PUT "x")"#;
        assert_eq!(without_bracket(line), r#"teach "wash (the) mug" := actions 2..3"#);
    }
}
