use std::str::FromStr;

/// What one typed line asks for during an episode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line {
    Empty,
    /// For the robot, as typed.
    Utterance(String),
    Command(Command),
    /// No command: a sentence that says what would be one.
    Bad(String),
}

/// What a person may ask of the conversation itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Command {
    Look,
    Why,
    Known,
    Status,
    Help,
    Done,
    /// The lesson's number, as `:known` shows it.
    Forget(u64),
    /// The last act is not what was meant.
    Wrong,
    /// What the next episode is about, in the domain's words.
    Task(String),
    Quit,
}

/// What one typed line says about the utterance being taught.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TeachLine {
    /// These actions of the episode; whether they fit is for the service to say.
    Actions(Vec<u32>),
    /// Everything from the first action that may be chosen to the last.
    All,
    Nothing,
    Skip,
    /// In one move, whichever utterance is being asked about; none for nothing.
    OneMove {
        utterance: String,
        actions: Option<Vec<u32>>,
    },
    Command(Command),
    Bad(String),
}

/// What to do about a lesson that collides with an old one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClashLine {
    Replace,
    Keep,
    Cancel,
}

const TEACH_HELP: &str = "type the first and the last action, such as 3-7, or all, none or skip";

/// Reads a line typed during an episode. Plain `done`, `help`, `quit` and `exit` are commands too:
/// they are the first things a newcomer tries, and no requests to a robot.
pub fn line(text: &str) -> Line {
    let text = text.trim();
    match text {
        "" => Line::Empty,
        "done" => Line::Command(Command::Done),
        "help" => Line::Command(Command::Help),
        "quit" | "exit" => Line::Command(Command::Quit),
        _ => match text.strip_prefix(':') {
            Some(command) => command.parse().map_or_else(Line::Bad, Line::Command),
            None => Line::Utterance(text.to_owned()),
        },
    }
}

/// Reads an answer to a teaching question.
pub fn teach_line(text: &str) -> TeachLine {
    let text = text.trim();
    match text {
        "" => return TeachLine::Bad(format!("you typed nothing; {TEACH_HELP}")),
        "all" => return TeachLine::All,
        "none" | "nothing" => return TeachLine::Nothing,
        "skip" => return TeachLine::Skip,
        _ => {}
    }
    if let Some(one_move) = text.strip_prefix("teach ").map(str::trim) {
        return one_move_line(one_move).unwrap_or_else(TeachLine::Bad);
    }
    match line(text) {
        Line::Command(command) => TeachLine::Command(command),
        Line::Bad(sentence) => TeachLine::Bad(sentence),
        _ => actions(text).map_or_else(TeachLine::Bad, TeachLine::Actions),
    }
}

pub fn clash_line(text: &str) -> Result<ClashLine, String> {
    match text.trim() {
        "replace" | "r" => Ok(ClashLine::Replace),
        "keep" | "k" => Ok(ClashLine::Keep),
        "cancel" | "c" => Ok(ClashLine::Cancel),
        found => Err(format!("{found:?} is not an answer; type replace, keep or cancel")),
    }
}

impl FromStr for Command {
    type Err = String;

    /// Reads what follows the colon.
    fn from_str(text: &str) -> Result<Command, String> {
        let (name, argument) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let argument = argument.trim();
        let command = match name {
            "look" | "l" => Command::Look,
            "why" | "w" => Command::Why,
            "known" | "k" => Command::Known,
            "status" | "s" => Command::Status,
            "help" | "h" | "?" => Command::Help,
            "done" => Command::Done,
            "wrong" => Command::Wrong,
            "quit" | "q" => Command::Quit,
            "forget" => {
                let number = argument.trim_start_matches('#').parse().ok().filter(|&n| n > 0);
                return number.map(Command::Forget).ok_or_else(|| {
                    "which lesson? type :forget N, with a number that :known shows".to_owned()
                });
            }
            "task" if argument.is_empty() => {
                return Err("which task? type for example :task clean Mug CounterTop".to_owned());
            }
            "task" => return Ok(Command::Task(argument.to_owned())),
            _ => return Err(format!("there is no command :{name}; :help lists them")),
        };
        match argument.is_empty() {
            true => Ok(command),
            false => Err(format!(":{name} takes no argument, but you typed {argument:?} after it")),
        }
    }
}

/// `"wash the mug" 3-7`, with `:=` and `actions` welcome between them as in a transcript.
fn one_move_line(text: &str) -> Result<TeachLine, String> {
    let form = || "type it like this: teach \"wash the mug\" 3-7".to_owned();
    let (utterance, rest) =
        text.strip_prefix('"').and_then(|text| text.rsplit_once('"')).ok_or_else(form)?;
    let rest = rest.trim();
    let rest = rest.strip_prefix(":=").unwrap_or(rest).trim();
    let rest = rest.strip_prefix("actions").unwrap_or(rest).trim();
    let actions = match rest {
        "" => return Err(form()),
        "none" | "nothing" => None,
        range => Some(actions(range)?),
    };
    Ok(TeachLine::OneMove { utterance: utterance.trim().to_owned(), actions })
}

/// `3-7`, `3..7`, `3 to 7`, `5`, `3 4 5` or `3,4,5`.
fn actions(text: &str) -> Result<Vec<u32>, String> {
    let bad = || format!("{text:?} is not a list of actions; {TEACH_HELP}");
    let number = |word: &str| word.trim().trim_start_matches('#').parse::<u32>().map_err(|_| bad());
    for between in ["..", "-", "–", " to "] {
        let Some((first, last)) = text.split_once(between) else { continue };
        let (first, last) = (number(first)?, number(last)?);
        if first > last {
            return Err(format!("in {text} the first action comes after the last; {TEACH_HELP}"));
        }
        // No episode is that long, and a list of a thousand million numbers helps nobody.
        if last - first >= apprentice::limits::EPISODE_ACTIONS_MAX as u32 {
            return Err(format!("{text} has more actions than a task can have; {TEACH_HELP}"));
        }
        return Ok((first..=last).collect());
    }
    let words = text.split([',', ' ']).filter(|word| !word.is_empty());
    words.map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_for_the_robot_unless_it_is_a_command() {
        assert_eq!(line("  wash the mug "), Line::Utterance("wash the mug".into()));
        assert_eq!(line("done"), Line::Command(Command::Done));
        assert_eq!(line("done with the mug"), Line::Utterance("done with the mug".into()));
        assert_eq!(line(":why"), Line::Command(Command::Why));
        assert_eq!(line(":forget #23"), Line::Command(Command::Forget(23)));
        let task = Command::Task("clean Mug CounterTop".into());
        assert_eq!(line(":task clean Mug CounterTop"), Line::Command(task));
        assert_eq!(line(" "), Line::Empty);
    }

    #[test]
    fn a_bad_command_gets_a_sentence_that_says_what_would_be_one() {
        for (text, part) in [
            (":dance", "there is no command :dance; :help"),
            (":forget", "a number that :known shows"),
            (":forget zero", "a number that :known shows"),
            (":forget 0", "a number that :known shows"),
            (":why not", "takes no argument, but you typed \"not\" after it"),
            (":task", "clean Mug CounterTop"),
        ] {
            let Line::Bad(sentence) = line(text) else { panic!("{text} was read") };
            assert!(sentence.contains(part), "{text}: {sentence}");
        }
    }

    #[test]
    fn actions_are_chosen_in_the_ways_people_write_them() {
        for text in ["3-5", "3..5", "3 to 5", "3 – 5", "3 4 5", "3,4, 5", "#3-5"] {
            assert_eq!(teach_line(text), TeachLine::Actions(vec![3, 4, 5]), "{text}");
        }
        assert_eq!(teach_line("4"), TeachLine::Actions(vec![4]));
        assert_eq!(teach_line("none"), TeachLine::Nothing);
        assert_eq!(teach_line("skip"), TeachLine::Skip);
        assert_eq!(teach_line("all"), TeachLine::All);
        assert_eq!(teach_line(":help"), TeachLine::Command(Command::Help));
        assert_eq!(teach_line("done"), TeachLine::Command(Command::Done));
    }

    #[test]
    fn teaching_takes_one_move() {
        let washed = |actions| TeachLine::OneMove { utterance: "wash the mug".into(), actions };
        for text in [
            r#"teach "wash the mug" 3-4"#,
            r#"teach "wash the mug" := 3..4"#,
            r#"teach "wash the mug" := actions 3..4"#,
        ] {
            assert_eq!(teach_line(text), washed(Some(vec![3, 4])), "{text}");
        }
        assert_eq!(teach_line(r#"teach "wash the mug" := nothing"#), washed(None));
    }

    #[test]
    fn a_bad_answer_is_asked_again_with_the_ways_to_answer() {
        for text in ["", "the first three", "7-3", "3-", "teach wash 3", "1-4000000000"] {
            let TeachLine::Bad(sentence) = teach_line(text) else { panic!("{text:?} was read") };
            assert!(sentence.contains("3-7"), "{text:?}: {sentence}");
        }
        assert!(clash_line("maybe").unwrap_err().contains("replace, keep or cancel"));
        assert_eq!(clash_line(" keep "), Ok(ClashLine::Keep));
    }
}
