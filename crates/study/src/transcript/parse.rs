use apprentice::client::OnClash;
use apprentice::language::Program;
use apprentice::plain;

use super::line::{Act, Answer, Kind, Line, Request, Setting, Transcript};

/// Why a text is no transcript: where, and what was expected there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {reason}")]
pub struct SyntaxError {
    /// Both counted from 1; columns count characters.
    pub line: usize,
    pub column: usize,
    pub reason: String,
}

const FIRST_WORDS: &str = "a line starts with user, recipe, scene, task, seed, episode, >, =, ?, \
     !, ~, i, w, x, ~~, achieved, teach, learn, forget, wrong, done or #";

impl Transcript {
    /// Reads the notation of `docs/transcripts.md`.
    ///
    /// - errors: the first line that is no line of a transcript, or stands where it cannot.
    pub fn parse(text: &str) -> Result<Transcript, SyntaxError> {
        let mut lines = Vec::new();
        for (index, text) in text.lines().enumerate() {
            let number = index + 1;
            // A transcript is read by people, too; what is refused is played by nobody.
            plain::check(&text.replace('\t', " ")).map_err(|hidden| SyntaxError {
                line: number,
                column: hidden.place,
                reason: format!("U+{:04X} is not a plain character", u32::from(hidden.found)),
            })?;
            let mut cursor = Cursor { line: number, text, rest: text };
            let kind = cursor.line()?;
            lines.push(Line { number, text: text.to_owned(), kind });
        }
        check_places(&lines)?;
        Ok(Transcript { lines })
    }
}

/// Headers of the whole file come before the first act, and an answer needs something to answer.
fn check_places(lines: &[Line]) -> Result<(), SyntaxError> {
    let mut acted = false;
    let mut said = false;
    let mut recipe = None;
    let mut user = None;
    for line in lines {
        let wrong = |reason: String| Err(SyntaxError { line: line.number, column: 1, reason });
        match &line.kind {
            Kind::Act(act) => {
                acted = true;
                said = matches!(act, Act::Say(_));
            }
            Kind::Meant(_) if !said => {
                return wrong(
                    "~~ says what the utterance above it meant, and there is none".into(),
                );
            }
            Kind::Answer(_) if !acted => {
                return wrong("there is no line above this answer that it could answer".to_owned());
            }
            Kind::Setting(setting @ (Setting::User(_) | Setting::Recipe(_))) => {
                let (name, seen) = match setting {
                    Setting::User(_) => ("user", &mut user),
                    _ => ("recipe", &mut recipe),
                };
                if acted {
                    return wrong(format!(
                        "{name} is a header line; put it above the first episode"
                    ));
                }
                if let Some(first) = seen.replace(line.number) {
                    return wrong(format!("{name} was already given at line {first}"));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Every name is of a type of the program, and no type has two.
fn check_names(program: &Program, on: &[String]) -> Result<(), String> {
    let kinds: Vec<&str> = on.iter().map(|name| Request::kind(name)).collect();
    for (place, (name, kind)) in on.iter().zip(&kinds).enumerate() {
        if !program.steps.iter().any(|step| step.args.iter().any(|arg| arg == *kind)) {
            return Err(format!("{program} has no thing that {name:?} could be"));
        }
        if kinds[..place].contains(kind) {
            return Err(format!("{name:?} is the second {kind}; name only one"));
        }
    }
    Ok(())
}

/// A place in a line.
struct Cursor<'a> {
    line: usize,
    text: &'a str,
    rest: &'a str,
}

impl<'a> Cursor<'a> {
    fn line(&mut self) -> Result<Kind, SyntaxError> {
        self.skip_blanks();
        if self.rest.is_empty() || self.rest.starts_with('#') {
            return Ok(Kind::Remark);
        }
        if let Some(utterance) = self.rest.strip_prefix('>') {
            // Verbatim but for one blank: brackets and # are words a person may type.
            let utterance = utterance.strip_prefix(' ').unwrap_or(utterance);
            return Ok(Kind::Act(Act::Say(utterance.to_owned())));
        }
        let start = self.rest;
        match self.word() {
            "=" => self.program().map(|program| Kind::Answer(Answer::Understood(program))),
            "?" => {
                self.expect("not")?;
                self.expect("sure")?;
                self.end(Kind::Answer(Answer::NotSure))
            }
            "~" => {
                self.expect("asked")?;
                let labels = self.until_bracket().split(',').map(|it| it.trim().to_owned());
                Ok(Kind::Answer(Answer::Asked(labels.collect())))
            }
            "i" => {
                self.expect("told")?;
                self.end(Kind::Answer(Answer::Told))
            }
            "w" => {
                self.expect("marked")?;
                self.end(Kind::Answer(Answer::Marked))
            }
            "wrong" => self.end(Kind::Act(Act::Wrong)),
            "!" => self.impossible(),
            "x" => {
                let code = self.name("the code of a rejection, such as wrong_phase")?;
                self.end(Kind::Answer(Answer::Refused(code)))
            }
            "~~" => self.meant().map(Kind::Meant),
            "achieved" => self.end(Kind::Answer(Answer::Achieved)),
            "user" => self.setting("the person's name", Setting::User),
            "recipe" => self.setting("the recipe's name", Setting::Recipe),
            "scene" => self.setting("the scene's file", Setting::Scene),
            "task" => self.setting("the task, such as clean Mug CounterTop", Setting::Task),
            "seed" => {
                let seed = self.number("a seed, such as 7")?;
                self.end(Kind::Setting(Setting::Seed(seed)))
            }
            "episode" => {
                let goal = self.until_bracket();
                let goal = (!goal.is_empty()).then(|| goal.to_owned());
                Ok(Kind::Act(Act::Episode { goal }))
            }
            "done" => self.end(Kind::Act(Act::Done)),
            "teach" => self.teach(),
            "learn" => self.learn(),
            "forget" => {
                let utterance = self.quoted()?;
                self.end(Kind::Act(Act::Forget(utterance)))
            }
            found => {
                self.rest = start;
                Err(self.error(format!("found {found:?}, but {FIRST_WORDS}")))
            }
        }
    }

    /// `nothing`, or a program, perhaps with the things that were meant: `PICKUP Mug on Mug 2`.
    fn meant(&mut self) -> Result<Option<Request>, SyntaxError> {
        self.skip_blanks();
        let start = self.rest;
        let text = self.until_bracket();
        if text == "nothing" {
            return Ok(None);
        }
        let (program, on) = match text.split_once(" on ") {
            Some((program, names)) => (program, names.split(',').map(str::trim).collect()),
            None => (text, Vec::new()),
        };
        let request = program.parse::<Program>().map_err(|error| {
            let what = "expected nothing, or a program such as PICKUP Mug on Mug 2";
            format!("{error}; {what}")
        });
        let request = request.and_then(|program| {
            let on: Vec<String> = on.into_iter().map(str::to_owned).collect();
            check_names(&program, &on).map(|()| Request { program, on })
        });
        request.map(Some).map_err(|reason| {
            self.rest = start;
            self.error(reason)
        })
    }

    fn impossible(&mut self) -> Result<Kind, SyntaxError> {
        self.expect("impossible")?;
        let answer = |what| Ok(Kind::Answer(Answer::Impossible(what)));
        self.skip_blanks();
        if self.rest.is_empty() || self.rest.starts_with('(') {
            return answer(None);
        }
        let Some(at) = self.rest.find(" step ") else {
            return Err(self.error("expected PROGRAM step N, or nothing more".to_owned()));
        };
        let program = self.rest[..at].parse().map_err(|error| self.error(format!("{error}")))?;
        self.rest = &self.rest[at..];
        self.expect("step")?;
        let step = self.number("the failing step's number, counted from 1")?;
        self.end(())?;
        answer(Some((program, step)))
    }

    fn teach(&mut self) -> Result<Kind, SyntaxError> {
        let utterance = self.quoted()?;
        self.expect(":=")?;
        let before = self.rest;
        let actions = match self.word() {
            "nothing" => None,
            "actions" => Some(self.range()?),
            found => {
                let reason = format!("found {found:?}, expected actions A..B or nothing");
                self.rest = before;
                self.skip_blanks();
                return Err(self.error(reason));
            }
        };
        let before = self.rest;
        let on_clash = match self.word() {
            "replace" if actions.is_some() => OnClash::Replace,
            "keep" if actions.is_some() => OnClash::Keep,
            _ => {
                self.rest = before;
                OnClash::Ask
            }
        };
        self.end(Kind::Act(Act::Teach { utterance, actions, on_clash }))
    }

    fn learn(&mut self) -> Result<Kind, SyntaxError> {
        self.skip_blanks();
        if self.rest.is_empty() || self.rest.starts_with('(') {
            return Ok(Kind::Act(Act::Learn { examples: None }));
        }
        let examples = self.number("the number of examples, seeds and lessons together")?;
        self.expect("examples")?;
        self.end(Kind::Act(Act::Learn { examples: Some(examples) }))
    }

    /// `A..B`, or one number.
    fn range(&mut self) -> Result<(u32, u32), SyntaxError> {
        self.skip_blanks();
        let start = self.rest;
        let word = self.word();
        let (first, last) = word.split_once("..").unwrap_or((word, word));
        match (first.parse(), last.parse()) {
            (Ok(first), Ok(last)) => Ok((first, last)),
            _ => {
                self.rest = start;
                Err(self.error(format!("found {word:?}, expected actions such as 3..7")))
            }
        }
    }

    fn program(&mut self) -> Result<Program, SyntaxError> {
        self.skip_blanks();
        let start = self.rest;
        let text = self.until_bracket();
        text.parse().map_err(|error| {
            self.rest = start;
            self.error(format!("{error}; expected a program such as GOTO Mug; PICKUP Mug"))
        })
    }

    /// A text in double quotes; `\"` and `\\` stand for a quote and a backslash.
    fn quoted(&mut self) -> Result<String, SyntaxError> {
        self.skip_blanks();
        if !self.rest.starts_with('"') {
            return Err(self.error("expected the utterance in double quotes".to_owned()));
        }
        let mut text = String::new();
        let mut chars = self.rest.char_indices().skip(1);
        while let Some((at, c)) = chars.next() {
            match c {
                '"' => {
                    self.rest = &self.rest[at + 1..];
                    return Ok(text);
                }
                '\\' => match chars.next() {
                    Some((_, c @ ('"' | '\\'))) => text.push(c),
                    _ => {
                        self.rest = &self.rest[at..];
                        return Err(self.error("expected \\\" or \\\\ here".to_owned()));
                    }
                },
                c => text.push(c),
            }
        }
        Err(self.error("the quote that opens here is never closed".to_owned()))
    }

    fn setting(
        &mut self,
        what: &str,
        make: impl Fn(String) -> Setting,
    ) -> Result<Kind, SyntaxError> {
        let value = self.until_bracket();
        if value.is_empty() {
            return Err(self.error(format!("expected {what}")));
        }
        Ok(Kind::Setting(make(value.to_owned())))
    }

    fn name(&mut self, what: &str) -> Result<String, SyntaxError> {
        match self.word() {
            "" => Err(self.error(format!("expected {what}"))),
            word => Ok(word.to_owned()),
        }
    }

    fn number<N: std::str::FromStr>(&mut self, what: &str) -> Result<N, SyntaxError> {
        self.skip_blanks();
        let start = self.rest;
        let word = self.word();
        word.parse().map_err(|_| {
            self.rest = start;
            self.error(format!("found {word:?}, expected {what}"))
        })
    }

    fn expect(&mut self, word: &str) -> Result<(), SyntaxError> {
        self.skip_blanks();
        let start = self.rest;
        let found = self.word();
        if found == word {
            return Ok(());
        }
        self.rest = start;
        Err(self.error(format!("found {found:?}, expected {word}")))
    }

    /// Nothing more but a text in brackets, which is never compared.
    fn end<T>(&mut self, value: T) -> Result<T, SyntaxError> {
        self.skip_blanks();
        if self.rest.is_empty() || self.rest.starts_with('(') {
            return Ok(value);
        }
        Err(self.error(format!("found {:?}, expected the end of the line", self.rest)))
    }

    /// Takes everything before a bracket that opens after a blank.
    fn until_bracket(&mut self) -> &'a str {
        let end = match self.rest.starts_with('(') {
            true => 0,
            false => self.rest.find(" (").unwrap_or(self.rest.len()),
        };
        let (taken, rest) = self.rest.split_at(end);
        self.rest = rest;
        taken.trim()
    }

    fn word(&mut self) -> &'a str {
        self.skip_blanks();
        let end = self.rest.find(char::is_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word
    }

    fn skip_blanks(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn error(&self, reason: String) -> SyntaxError {
        let read = self.text.len() - self.rest.len();
        let column = self.text[..read].chars().count() + 1;
        SyntaxError { line: self.line, column, reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<Kind> {
        Transcript::parse(text).unwrap().lines.into_iter().map(|line| line.kind).collect()
    }

    fn act(text: &str) -> Act {
        match kinds(text).pop().unwrap() {
            Kind::Act(act) => act,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_example_of_the_design_is_read() {
        let text = "\
# cooling
episode  cool the apple and put it on the table
> go to the apple and pick it up
= GOTO Apple; PICKUP Apple
> chill the apple
? not sure (nearest \"pick up <obj>\", 0.91 ≥ 0.42)

teach    \"chill the apple\" := actions 3..7
learn    45 examples
";
        let kinds = kinds(text);
        assert_eq!(kinds[0], Kind::Remark);
        let goal = Some("cool the apple and put it on the table".to_owned());
        assert_eq!(kinds[1], Kind::Act(Act::Episode { goal }));
        assert_eq!(kinds[2], Kind::Act(Act::Say("go to the apple and pick it up".to_owned())));
        let program = "GOTO Apple; PICKUP Apple".parse().unwrap();
        assert_eq!(kinds[3], Kind::Answer(Answer::Understood(program)));
        assert_eq!(kinds[5], Kind::Answer(Answer::NotSure));
        assert_eq!(
            kinds[7],
            Kind::Act(Act::Teach {
                utterance: "chill the apple".to_owned(),
                actions: Some((3, 7)),
                on_clash: OnClash::Ask
            })
        );
        assert_eq!(kinds[8], Kind::Act(Act::Learn { examples: Some(45) }));
    }

    #[test]
    fn what_was_meant_is_read_with_its_things() {
        let meant = |text: &str| match kinds(&format!("> a\n{text}")).pop().unwrap() {
            Kind::Meant(request) => request,
            other => panic!("{other:?}"),
        };
        assert_eq!(meant("~~ nothing"), None);
        let request = meant("~~ PICKUP Mug; PUT Mug Cabinet on Mug 2, Cabinet 1 (why)").unwrap();
        assert_eq!(request.program, "PICKUP Mug; PUT Mug Cabinet".parse().unwrap());
        assert_eq!(request.on, ["Mug 2", "Cabinet 1"]);
        let chosen = request.chosen(&request.program.steps[1]);
        assert_eq!(chosen, [Some("Mug 2".to_owned()), Some("Cabinet 1".to_owned())]);
        assert_eq!(request.to_string(), "PICKUP Mug; PUT Mug Cabinet on Mug 2, Cabinet 1");
        assert_eq!(meant("~~ GOTO Mug").unwrap().on, [""; 0]);
    }

    #[test]
    fn an_utterance_is_taken_as_it_stands() {
        assert_eq!(act("> wash (the) \"mug\" # now"), Act::Say("wash (the) \"mug\" # now".into()));
        assert_eq!(act(">"), Act::Say(String::new()));
        assert_eq!(act(">  two blanks"), Act::Say(" two blanks".into()));
    }

    #[test]
    fn what_stands_in_brackets_is_dropped() {
        let kinds = kinds("> go\n= GOTO Mug (actions 1..1)\n! impossible GOTO Mug step 1 (why)\n");
        assert_eq!(kinds[1], Kind::Answer(Answer::Understood("GOTO Mug".parse().unwrap())));
        let program = "GOTO Mug".parse().unwrap();
        assert_eq!(kinds[2], Kind::Answer(Answer::Impossible(Some((program, 1)))));
    }

    #[test]
    fn quotes_in_an_utterance_are_escaped() {
        let teach = act(r#"teach "say \"hi\" \\o/" := nothing (none of it)"#);
        let utterance = r#"say "hi" \o/"#.to_owned();
        assert_eq!(teach, Act::Teach { utterance, actions: None, on_clash: OnClash::Ask });
        let teach = act(r#"teach "wash it" := actions 2..3 keep"#);
        assert!(matches!(teach, Act::Teach { on_clash: OnClash::Keep, .. }));
    }

    #[test]
    fn an_error_names_the_line_the_column_and_what_was_expected() {
        let cases = [
            ("\nfoo bar", 2, 1, "found \"foo\", but a line starts with"),
            ("seed seven", 1, 6, "found \"seven\", expected a seed"),
            ("task", 1, 5, "expected the task"),
            ("teach wash := nothing", 1, 7, "double quotes"),
            ("teach \"wash := nothing", 1, 7, "never closed"),
            ("teach \"ä\" actions 3..4", 1, 11, "found \"actions\", expected :="),
            ("teach \"wash\" := 3..4", 1, 17, "found \"3..4\", expected actions A..B or nothing"),
            ("teach \"wash\" := actions 3-4", 1, 25, "such as 3..7"),
            ("> a\n= GOTO Mug; ; PICKUP Mug", 2, 3, "step 2 of the program is empty"),
            ("> a\n! impossible GOTO Mug", 2, 14, "expected PROGRAM step N"),
            ("> a\n? not certain", 2, 7, "found \"certain\", expected sure"),
            ("~~ nothing", 1, 1, "meant, and there is none"),
            ("> a\ndone\n~~ nothing", 3, 1, "meant, and there is none"),
            ("> a\n~~ ", 2, 4, "expected nothing, or a program"),
            ("> a\n~~ PICKUP Mug on Cup 2", 2, 4, "has no thing that \"Cup 2\" could be"),
            ("> a\n~~ PICKUP Mug on Mug 2, Mug 1", 2, 4, "the second Mug"),
            ("learn 45", 1, 9, "found \"\", expected examples"),
            ("> a\ndone now", 2, 6, "expected the end of the line"),
            ("= GOTO Mug", 1, 1, "no line above this answer"),
            ("> a\nrecipe paper", 2, 1, "recipe is a header"),
            ("user a\nuser b", 2, 1, "already given at line 1"),
        ];
        for (text, line, column, reason) in cases {
            let error = Transcript::parse(text).unwrap_err();
            assert_eq!((error.line, error.column), (line, column), "{text:?}: {error}");
            assert!(error.reason.contains(reason), "{text:?}: {error}");
        }
    }
}
