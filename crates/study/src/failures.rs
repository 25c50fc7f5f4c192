//! Why an answer was not right, in words that name where it would be mended.

use std::fmt;

use apprentice::grounding::Abstractor;
use apprentice::language::{Answer, Evidence, Mention, Outcome, Program, Step, Symbol, Utterance};
use apprentice::learning::Recipe;
use apprentice::world::Words;
use apprentice::world::household::{Household, Kind, Scene};

use super::corpus::Row;
use super::draw;
use super::score::{self, Verdict};

/// An answer that was not right.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    pub verdict: Verdict,
    pub reason: String,
    /// The row of the corpus.
    pub id: String,
    pub sentence: String,
    /// The row that was taught, and its sentence.
    pub taught: Option<(String, String)>,
    pub meant: String,
    pub got: String,
    /// Which of the sentence's words were used for nothing, or make it no request.
    pub passed_over: Option<String>,
    /// The nearest exemplar.
    pub nearest: String,
    /// Whether that is one of the system's own sentences; otherwise it is somebody's.
    pub seed: bool,
    /// How far the nearest exemplar is, and how far it might be.
    pub distance: String,
    pub lifted: String,
}

impl Failure {
    /// The first `count` of each verdict and reason, reason by reason.
    pub fn choose(all: impl Iterator<Item = Failure>, count: usize) -> Vec<Failure> {
        let mut kept: Vec<Failure> = Vec::new();
        if count == 0 {
            return kept;
        }
        for failure in all {
            let alike =
                |old: &&Failure| (old.verdict, &old.reason) == (failure.verdict, &failure.reason);
            if kept.iter().filter(alike).count() < count {
                kept.push(failure);
            }
        }
        kept.sort_by(|a, b| (a.verdict, &a.reason).cmp(&(b.verdict, &b.reason)));
        kept
    }

    /// `count` of each verdict, whatever the reason, each equally likely.
    ///
    /// - `purpose`: names the draw.
    pub fn draw<'f>(
        all: impl Iterator<Item = &'f Failure>,
        purpose: &str,
        count: usize,
    ) -> Vec<Failure> {
        let all: Vec<&Failure> = all.collect();
        let of = |verdict: &Verdict| {
            let of: Vec<&Failure> =
                all.iter().filter(|failure| failure.verdict == *verdict).copied().collect();
            let mut rng = draw::rng(0, &["cases", purpose, &format!("{verdict:?}")]);
            draw::some(&mut rng, &of, count)
        };
        let verdicts = [Verdict::Right, Verdict::Wrong, Verdict::Impossible, Verdict::NotSure];
        verdicts.iter().flat_map(of).cloned().collect()
    }

    /// A row of a table in Markdown without any recorded sentence, for a page that may not show
    /// them: row, what was meant, what came of it, why, and what was nearest.
    pub fn case(&self) -> String {
        let Failure { id, meant, got, reason, distance, .. } = self;
        let nearest = if self.seed { &self.nearest } else { "a lesson" };
        let taught = self.taught.iter().map(|(id, _)| format!(" after `{id}`"));
        let taught: String = taught.collect();
        format!("| `{id}`{taught} | {meant} | {got} | {reason} | {nearest} {distance} |")
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  {:?} ({})", self.sentence, self.id)?;
        if let Some((id, sentence)) = &self.taught {
            writeln!(f, "    taught   {sentence:?} ({id})")?;
        }
        writeln!(f, "    meant    {}", self.meant)?;
        writeln!(f, "    got      {}", self.got)?;
        if let Some(words) = &self.passed_over {
            writeln!(f, "    unused   {words}")?;
        }
        write!(f, "    nearest  {} {}; lifted {:?}", self.nearest, self.distance, self.lifted)
    }
}

/// Finds reasons. Lifts a sentence as the recipe does, to see what was named.
pub struct Explain<'a> {
    household: &'a Household,
    recipe: &'a Recipe,
    /// What was taught, where something was.
    lesson: Option<&'a Row>,
}

impl<'a> Explain<'a> {
    pub fn new(household: &'a Household, recipe: &'a Recipe) -> Explain<'a> {
        Explain { household, recipe, lesson: None }
    }

    /// Of a mind that was taught this.
    pub fn after(self, lesson: &'a Row) -> Explain<'a> {
        Explain { lesson: Some(lesson), ..self }
    }

    pub(super) fn recipe(&self) -> &Recipe {
        self.recipe
    }

    /// Why a sentence for one primitive was not understood.
    pub fn primitive(
        &self,
        row: &Row,
        scene: &Scene,
        verdict: Verdict,
        answer: &Answer,
    ) -> Failure {
        let core = score::core(&row.program).expect("rows of the primitives have a core");
        let mentions = self.mentions(&row.sentence);
        let held = self.household.held(scene);
        let reason = match &answer.outcome {
            Outcome::Understood { program, .. } => {
                let counted = score::counted(&row.program, program);
                self.misunderstood(core, program, &counted, &mentions)
            }
            Outcome::Impossible { program, reason, .. } => {
                let counted = score::counted(&row.program, program);
                let what = match score::says_core(&row.program, program) {
                    true => "the right program".to_owned(),
                    false => self.misunderstood(core, program, &counted, &mentions),
                };
                format!("{what}; the world says: {}", pattern(reason))
            }
            Outcome::Asked { question } => format!("asked: {}", question.text),
            Outcome::Told { .. } => "taken for a question".to_owned(),
            Outcome::NotSure => self.unsure(core, &mentions, held.as_ref(), answer),
        };
        self.failure(row, verdict, reason, answer)
    }

    /// Why a sentence that nobody taught was taken for something.
    pub fn untaught(&self, row: &Row, verdict: Verdict, answer: &Answer) -> Failure {
        let reason = match &answer.outcome {
            Outcome::Understood { .. } if verdict == Verdict::Right => {
                "untaught, and rightly composed of primitives".to_owned()
            }
            Outcome::Understood { program, .. } | Outcome::Impossible { program, .. } => {
                format!(
                    "untaught, taken for {}",
                    operators(&program.steps.iter().collect::<Vec<_>>())
                )
            }
            Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
                "untaught".to_owned()
            }
        };
        self.failure(row, verdict, reason, answer)
    }

    /// Why a sentence for something taught was not recognised.
    pub fn taught(
        &self,
        row: &Row,
        lesson: &Program,
        verdict: Verdict,
        answer: &Answer,
    ) -> Failure {
        let reason = match &answer.outcome {
            Outcome::Asked { question } => format!("asked: {}", question.text),
            Outcome::Told { .. } => "taken for a question".to_owned(),
            Outcome::NotSure => match (&answer.evidence, answer.evidence.discarded.first()) {
                (Evidence { mood: Some(_), .. }, _) => "taken for no request".to_owned(),
                (evidence, _) if evidence.left_over().next().is_some() => {
                    "words that nothing used".to_owned()
                }
                (_, Some(discarded)) => format!("dropped: {}", pattern(&discarded.reason)),
                (_, None) => "nothing near enough".to_owned(),
            },
            outcome if score::accepted_as(lesson, outcome) => match outcome {
                Outcome::Impossible { reason, .. } => {
                    format!("the lesson; the world says: {}", pattern(reason))
                }
                _ => "the lesson with the wrong things in it".to_owned(),
            },
            Outcome::Understood { program, .. } => {
                format!("taken for {}", operators(&program.steps.iter().collect::<Vec<_>>()))
            }
            Outcome::Impossible { program, reason, .. } => {
                let operators = operators(&program.steps.iter().collect::<Vec<_>>());
                format!("taken for {operators}; the world says: {}", pattern(reason))
            }
        };
        self.failure(row, verdict, reason, answer)
    }

    fn mentions(&self, sentence: &Utterance) -> Vec<Mention> {
        let known = |word: &str| self.recipe.words().lookup(word).is_some();
        let settings = self.recipe.settings();
        let lexicon = self.household.lexicon(settings.words.edition);
        let abstractor = Abstractor::new(lexicon, &settings.abstraction, &known);
        abstractor.read(sentence).whole().mentions
    }

    fn misunderstood(
        &self,
        core: &Step,
        program: &Program,
        counted: &[&Step],
        mentions: &[Mention],
    ) -> String {
        if score::walks(core) {
            let last = program.steps.iter().rev().find(|step| score::walks(step));
            return match (counted.is_empty(), last) {
                (false, _) => format!("GOTO taken for {}", operators(counted)),
                (true, Some(last)) => argument(core, last, mentions),
                (true, None) => "GOTO taken for nothing".to_owned(),
            };
        }
        match counted {
            [] => format!("{} taken for GOTO", core.operator),
            [one] if one.operator == core.operator => argument(core, one, mentions),
            many if many.contains(&core) => {
                let rest: Vec<&Step> = many.iter().filter(|step| **step != core).copied().collect();
                format!("{} and besides {}", core.operator, operators(&rest))
            }
            many => format!("{} taken for {}", core.operator, operators(many)),
        }
    }

    fn unsure(
        &self,
        core: &Step,
        mentions: &[Mention],
        held: Option<&Symbol>,
        answer: &Answer,
    ) -> String {
        let named = |arg: &Symbol| mentions.iter().any(|mention| mention.types.contains(arg));
        let unnamed = core.args.iter().filter(|arg| !named(arg));
        let in_hand = unnamed.clone().filter(|arg| held == Some(arg)).count();
        let pronouns = mentions.iter().filter(|mention| mention.pronoun).count();
        if unnamed.count() > pronouns.max(in_hand) {
            return "a needed thing is not named by a known name".to_owned();
        }
        let Some(nearest) = answer.evidence.nearest.first() else {
            return "nothing to compare with".to_owned();
        };
        let means = nearest.program.steps.iter().any(|step| step.operator == core.operator);
        let near = score::distance(&answer.evidence) <= 1.0;
        match (means, near) {
            (true, true) => "the right exemplar is near enough, and was dropped",
            (true, false) => "the right exemplar is nearest, and too far",
            (false, true) => "a wrong exemplar is near enough, and was dropped",
            (false, false) => "a wrong exemplar is nearest, and too far",
        }
        .to_owned()
    }

    fn failure(&self, row: &Row, verdict: Verdict, reason: String, answer: &Answer) -> Failure {
        let got = match &answer.outcome {
            Outcome::Understood { program, .. } => program.to_string(),
            Outcome::Impossible { program, reason, .. } => {
                format!("impossible: {program} ({reason})")
            }
            Outcome::Asked { question } => format!("asked: {}", question.text),
            Outcome::Told { text } => format!("told: {text}"),
            Outcome::NotSure => match answer.evidence.discarded.first() {
                Some(discarded) => {
                    format!("not sure: dropped {} ({})", discarded.program, discarded.reason)
                }
                None => "not sure".to_owned(),
            },
        };
        let Evidence { lifted, nearest, threshold, .. } = &answer.evidence;
        let nearest = nearest.first();
        let lifted: Vec<String> = lifted.iter().map(ToString::to_string).collect();
        let seeds = self.household.seeds().exemplars.len();
        let taught = |lesson: &Row| (lesson.id.clone(), lesson.sentence.to_string());
        Failure {
            verdict,
            reason,
            id: row.id.clone(),
            sentence: row.sentence.to_string(),
            taught: self.lesson.map(taught),
            meant: row.program.to_string(),
            got,
            passed_over: answer.evidence.passed_over(),
            nearest: nearest.map_or("nothing".to_owned(), |near| near.exemplar.to_string()),
            seed: nearest.is_none_or(|near| (near.number as usize) < seeds),
            distance: nearest
                .map_or(String::new(), |near| format!("at {:.3} of {threshold:.3}", near.distance)),
            lifted: lifted.join(" | "),
        }
    }
}

/// The first argument that differs, and whose fault it is.
fn argument(meant: &Step, got: &Step, mentions: &[Mention]) -> String {
    let differing = meant.args.iter().zip(&got.args).find(|(one, other)| one != other);
    let Some((meant_arg, got_arg)) = differing else {
        return format!("{} otherwise than meant", meant.operator);
    };
    let mut named = mentions.iter().filter(|mention| mention.types.contains(meant_arg)).peekable();
    let is_named = named.peek().is_some();
    let why = if named.any(|mention| mention.types.contains(got_arg)) {
        "its name may mean either"
    } else if is_named {
        "another mention was taken"
    } else if mentions.iter().any(|mention| mention.pronoun) {
        "a pronoun meant something else"
    } else {
        "it is not named by a known name"
    };
    format!("{} with a wrong argument: {why}", meant.operator)
}

fn operators(steps: &[&Step]) -> String {
    let names: Vec<&str> = steps.iter().map(|step| step.operator.as_str()).collect();
    if names.len() > 4 {
        return format!("{} and {} more", names[..4].join(" "), names.len() - 4);
    }
    names.join(" ")
}

/// A reason of the world without the things it names, so that equal reasons count as one.
fn pattern(reason: &str) -> String {
    let plain = |word: &str| word.trim_matches(|c: char| !c.is_alphanumeric()).to_owned();
    let is_thing = |word: &str| {
        Kind::named(&plain(word)).is_some() || word.starts_with('"') || word.ends_with('"')
    };
    let words = reason.split(' ').filter(|word| *word != "an" && *word != "a");
    let mut out: Vec<&str> = Vec::new();
    for word in words {
        match is_thing(word) {
            true if out.last() == Some(&"…") => {}
            true => out.push("…"),
            false => out.push(word),
        }
    }
    out.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives::answer;
    use crate::scenes::{Clashes, Stages};
    use apprentice::learning::train;
    use apprentice::world::household::Room;

    #[test]
    fn reasons_of_the_world_are_counted_without_their_things() {
        let one = pattern("the robot does not hold a Mug: its hand is empty");
        let two = pattern("the robot does not hold an Apple: its hand is empty");
        assert_eq!(one, two);
        assert!(!one.contains("Mug"), "{one}");
    }

    #[test]
    fn a_case_shows_no_recorded_sentence() {
        let household = Household::new();
        let recipe = Recipe::parse(Recipe::builtin("paper").unwrap()).unwrap();
        let row = |words: &str| Row::about(Room::Kitchen, words, "PICKUP Mug");
        let (row, lesson) = (row("quaffle the zibber"), row("wuzzle my dax"));
        let mind = train(&household, &recipe, &[]).unwrap();
        let stages = Stages::new(&household);
        let scene = stages.set(&row, Clashes::Avoided, &mut draw::rng(1, &["test"])).unwrap();
        let answer = answer(&household, &mind, &scene, &row);
        let explain = Explain::new(&household, &recipe).after(&lesson);
        let failure = explain.taught(&row, &lesson.program, Verdict::NotSure, &answer);
        let (case, shown) = (failure.case(), failure.to_string());
        for word in ["quaffle", "zibber", "wuzzle", "dax"] {
            assert!(!case.contains(word) && shown.contains(word), "{word}: {case}\n{shown}");
        }
        assert!(case.contains("PICKUP Mug") && case.contains(&row.id), "{case}");
    }

    #[test]
    fn cases_are_drawn_from_each_verdict_whatever_the_reason() {
        let household = Household::new();
        let recipe = Recipe::parse(Recipe::builtin("tiny").unwrap()).unwrap();
        let explain = Explain::new(&household, &recipe);
        let row = Row::about(Room::Kitchen, "wuzzle the mug", "PICKUP Mug");
        let not_sure = Answer {
            outcome: Outcome::NotSure,
            evidence: Evidence::default(),
            mentioned: None,
            chosen: Vec::new(),
        };
        let failed = |number: usize| {
            let verdict = [Verdict::Wrong, Verdict::NotSure][number % 2];
            let row = Row { id: number.to_string(), ..row.clone() };
            explain.failure(&row, verdict, format!("reason {}", number % 7), &not_sure)
        };
        let all: Vec<Failure> = (0..100).map(failed).collect();
        let drawn = Failure::draw(all.iter(), "test", 10);
        let verdicts: Vec<Verdict> = drawn.iter().map(|failure| failure.verdict).collect();
        assert_eq!(verdicts, [[Verdict::Wrong; 10], [Verdict::NotSure; 10]].concat());
        let beyond_the_first = drawn.iter().any(|failure| failure.id.len() > 1);
        assert!(beyond_the_first, "{drawn:?}");
        assert_eq!(drawn, Failure::draw(all.iter(), "test", 10));
    }

    #[test]
    fn an_argument_is_blamed_on_its_name_or_on_another_mention() {
        let mention = |types: &[&str]| Mention {
            surface: "cup".to_owned(),
            sort: Symbol::new("obj"),
            types: types.iter().map(|kind| Symbol::new(kind)).collect(),
            pronoun: false,
            plural: false,
        };
        let (meant, got): (Step, Step) =
            ("PICKUP Mug".parse().unwrap(), "PICKUP Cup".parse().unwrap());
        let blame = |mentions: &[Mention]| argument(&meant, &got, mentions);
        assert!(blame(&[mention(&["Cup", "Mug"])]).contains("either"));
        assert!(blame(&[mention(&["Mug"]), mention(&["Cup"])]).contains("another mention"));
        assert!(blame(&[mention(&["Cup"])]).contains("not named"));
    }
}
