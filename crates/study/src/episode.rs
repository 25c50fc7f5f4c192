//! One episode: teach one sentence of one person, then ask.

use std::collections::BTreeSet;
use std::sync::Arc;

use apprentice::language::{Answer, Program, Symbol, tokens};
use apprentice::learning::{Lesson, Mind, Recipe, train};
use apprentice::world::household::{Household, Kind, Scene, Task};
use apprentice::world::{Edition, Words};

use super::corpus::Row;
use super::draw;
use super::failures::{Explain, Failure};
use super::figures::share;
use super::primitives::answer;
use super::renaming::{plain_names, rename, replace};
use super::report::Teachers;
use super::scenes::{Clashes, Stages};
use super::score::{self, Verdict};

/// Other things that the taught sentence is said about.
const THINGS: usize = 3;
/// The teacher's other sentences, at most.
const SAME_PERSON: usize = 20;
/// Other people's sentences.
const OTHERS: usize = 100;
/// Sentences of each other group.
const DISTRACTORS: usize = 25;
/// Sentences for a primitive.
const PRIMITIVES: usize = 40;
/// Words of a short sentence, at most.
const SHORT_WORDS_MAX: usize = 10;
/// What joins two requests in one sentence.
const CONJUNCTIONS: [&str; 4] = ["and", "then", "but", "or"];

/// What every episode of a seed shares.
pub(super) struct Tests<'a> {
    pub household: &'a Household,
    pub stages: &'a Stages<'a>,
    pub recipe: &'a Recipe,
    /// The mind without lessons: what is left when a training fails.
    pub before: &'a Mind,
    pub groups: &'a [(&'a str, Vec<&'a Row>)],
    pub primitives: &'a [&'a Row],
    pub seed: u64,
    /// Sentences that are taught.
    pub lessons: usize,
    pub teachers: Teachers,
}

/// What one episode found.
pub(super) struct Episode {
    pub group: String,
    pub training_failed: Option<String>,
    pub same_sentence: Asked,
    pub same_person: Asked,
    pub others: Asked,
    pub distractors: Asked,
    pub primitives: Asked,
    /// Why rows had to be left out.
    pub unstaged: Vec<String>,
}

type Figure = (&'static str, fn(&Episode) -> &Asked);

impl Episode {
    pub const FIGURES: [Figure; 5] = [
        ("same_sentence", |episode| &episode.same_sentence),
        ("same_person", |episode| &episode.same_person),
        ("others", |episode| &episode.others),
        ("distractors", |episode| &episode.distractors),
        ("primitives", |episode| &episode.primitives),
    ];

    /// The share of right answers among all that were carried out as the lesson; none when nothing
    /// was.
    pub fn lesson_precision(&self) -> Option<f64> {
        let asked = [&self.same_person, &self.others, &self.distractors, &self.primitives];
        let judged = asked.iter().flat_map(|asked| &asked.0);
        let done =
            |one: &&Judged| one.accepted && matches!(one.verdict, Verdict::Right | Verdict::Wrong);
        let done: Vec<&Judged> = judged.filter(done).collect();
        let right = done.iter().filter(|one| one.verdict == Verdict::Right).count();
        (!done.is_empty()).then(|| share(right, done.len()))
    }
}

/// The sentences of one figure, judged.
#[derive(Default)]
pub(super) struct Asked(Vec<Judged>);

#[derive(Clone)]
struct Judged {
    verdict: Verdict,
    /// Taken for the lesson.
    accepted: bool,
    short: bool,
    failure: Option<Failure>,
}

impl Asked {
    fn part(&self, wanted: impl Fn(&Judged) -> bool) -> Option<f64> {
        let count = self.0.iter().filter(|one| wanted(one)).count();
        (!self.0.is_empty()).then(|| share(count, self.0.len()))
    }

    pub fn right(&self) -> Option<f64> {
        self.part(|one| one.verdict == Verdict::Right)
    }

    pub fn wrong(&self) -> Option<f64> {
        self.part(|one| one.verdict == Verdict::Wrong)
    }

    pub fn accepted(&self) -> Option<f64> {
        self.part(|one| one.accepted)
    }

    pub fn short(&self) -> Asked {
        Asked(self.0.iter().filter(|one| one.short).cloned().collect())
    }

    pub fn failures(&self) -> impl Iterator<Item = &Failure> {
        self.0.iter().filter_map(|one| one.failure.as_ref())
    }
}

/// - returns: `None` when nobody has enough sentences for anything that could be taught.
pub(super) fn run<'a>(tests: &Tests<'a>, number: usize) -> Option<Episode> {
    let (group, rows) = &tests.groups[number % tests.groups.len()];
    let mut unstaged = Vec::new();
    let taught = choose_lessons(tests, number, rows, &mut unstaged)?;
    let lessons: Vec<_> = taught.iter().map(|(row, scene)| lesson(row, scene.clone())).collect();
    let (row, _) = taught[0];
    let trained = train(tests.household, tests.recipe, &lessons);
    let training_failed = trained.as_ref().err().map(ToString::to_string);
    let mind = trained.as_ref().unwrap_or(tests.before);

    let number_text = number.to_string();
    let draw = |what: &str, rows: Vec<&'a Row>, count| {
        draw::some(&mut draw::rng(tests.seed, &[what, &number_text]), &rows, count)
    };
    let (own, others): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|r| r.user == row.user);
    let teaches = |user: &str| taught.iter().any(|(row, _)| row.user == user);
    let others = others.into_iter().filter(|other| !teaches(&other.user)).collect();
    let own = own.into_iter().filter(|other| taught.iter().all(|(row, _)| other.id != row.id));
    let own = own.collect();
    let same_person = draw("same person", own, SAME_PERSON);
    let others = draw("others", others, OTHERS);
    let other_groups = tests.groups.iter().filter(|(other, _)| other != group);
    let distractors: Vec<&Row> = other_groups
        .flat_map(|(other, rows)| draw(&format!("taken for {other}"), rows.clone(), DISTRACTORS))
        .collect();
    let primitives = draw("primitives", tests.primitives.to_vec(), PRIMITIVES);

    let programs: Vec<&Program> = taught.iter().map(|(row, _)| &row.program).collect();
    let mut ask = Ask { tests, mind, lesson: row, programs: &programs, unstaged };
    let retold: Vec<Row> = retold(tests, number, row);
    Some(Episode {
        group: (*group).to_owned(),
        training_failed,
        same_sentence: ask.taught(&retold.iter().collect::<Vec<_>>()),
        same_person: ask.taught(&same_person),
        others: ask.taught(&others),
        distractors: ask.distractors(&distractors),
        primitives: ask.primitives(&primitives),
        unstaged: ask.unstaged,
    })
}

fn lesson(row: &Row, scene: Scene) -> Lesson<Scene, Task> {
    Lesson {
        utterance: row.sentence.clone(),
        program: row.program.clone(),
        scene: Arc::new(scene),
        task: Arc::new(Task::free()),
        mentioned: None,
    }
}

/// The wanted number of sentences. The first is of a person who has another for the same; people
/// are equally likely, whether they wrote much or little. It does not depend on how many are
/// wanted, as long as its person has enough. The others are of the same person, or each of another.
fn choose_lessons<'a>(
    tests: &Tests<'_>,
    number: usize,
    rows: &[&'a Row],
    unstaged: &mut Vec<String>,
) -> Option<Vec<(&'a Row, Scene)>> {
    let mut rng = draw::rng(tests.seed, &["lesson", &number.to_string()]);
    let count = |user: &str| rows.iter().filter(|row| row.user == user).count();
    let users: BTreeSet<&str> = rows.iter().map(|row| row.user.as_str()).collect();
    let (of_each, people) = match tests.teachers {
        Teachers::One => (tests.lessons, 1),
        Teachers::Several => (1, tests.lessons),
    };
    let mut users: Vec<&str> = users.into_iter().filter(|user| count(user) > of_each).collect();
    rng.shuffle(&mut users);
    let mut taught = Vec::new();
    for user in users {
        let mut own: Vec<&Row> = rows.iter().filter(|row| row.user == user).copied().collect();
        rng.shuffle(&mut own);
        let mut found = Vec::new();
        for row in own {
            match stage(tests, row) {
                Ok(scene) => found.push((row, scene)),
                Err(reason) => unstaged.push(reason),
            }
            if found.len() == of_each {
                taught.append(&mut found);
                break;
            }
        }
        if taught.len() == of_each * people {
            return Some(taught);
        }
    }
    None
}

fn stage(tests: &Tests<'_>, row: &Row) -> Result<Scene, String> {
    let mut rng = draw::rng(tests.seed, &["scene", &row.id]);
    tests.stages.set(row, Clashes::Avoided, &mut rng)
}

/// The taught sentence about other things: those of the room for which the program can be done,
/// that have a plain name which the recipe's edition of names knows too, and that cannot be mistaken
/// for anything else in it. Empty when the sentence does not name its thing: there is nothing to
/// replace.
fn retold(tests: &Tests<'_>, number: usize, lesson: &Row) -> Vec<Row> {
    let handles = |operator: &str| operator == "PICKUP" || operator == "PUT";
    let handled = lesson.program.steps.iter().find(|step| handles(step.operator.as_str()));
    let Some(thing) = handled.and_then(|step| step.args.first()) else { return Vec::new() };
    let lexicon = tests.household.lexicon(Edition::First);
    let names = plain_names(lexicon);
    let args: BTreeSet<&Symbol> = lesson.program.steps.iter().flat_map(|step| &step.args).collect();
    let mistakable =
        |kind: &Symbol| args.iter().any(|arg| *arg == kind || tests.stages.share_a_name(arg, kind));
    let known = &tests.household.lexicon(tests.recipe.settings().words.edition).names;
    let is_known = |kind: &Symbol, name: &str| {
        known
            .get(name)
            .and_then(|meanings| meanings.first())
            .is_some_and(|first| first.kind == *kind)
    };
    let fits = |kind: &&Symbol| {
        names.get(*kind).is_some_and(|name| is_known(kind, name)) && !mistakable(kind)
    };
    let carried = lesson.room.kinds().filter(|kind| kind.pickupable());
    let mut others: Vec<&Symbol> = carried.map(Kind::symbol).filter(fits).collect();
    let mut rng = draw::rng(tests.seed, &["other things", &number.to_string()]);
    rng.shuffle(&mut others);
    let retell = |other: &Symbol| {
        let row = Row {
            id: format!("{} about {other}", lesson.id),
            sentence: rename(lexicon, &lesson.sentence, thing, names[other])?,
            program: replace(&lesson.program, thing, other),
            ..lesson.clone()
        };
        stage(tests, &row).is_ok().then_some(row)
    };
    others.into_iter().filter_map(retell).take(THINGS).collect()
}

/// Asks sentences and judges the answers.
struct Ask<'a> {
    tests: &'a Tests<'a>,
    mind: &'a Mind,
    lesson: &'a Row,
    /// What all lessons mean.
    programs: &'a [&'a Program],
    unstaged: Vec<String>,
}

impl Ask<'_> {
    fn accepted(&self, answer: &Answer) -> bool {
        self.programs.iter().any(|program| score::accepted_as(program, &answer.outcome))
    }

    fn each(
        &mut self,
        rows: &[&Row],
        judge: impl Fn(&Row, &Scene, &Answer, &Explain<'_>) -> (Verdict, Option<Failure>),
    ) -> Asked {
        let explain = Explain::new(self.tests.household, self.tests.recipe).after(self.lesson);
        let mut asked = Asked::default();
        for row in rows {
            let scene = match stage(self.tests, row) {
                Ok(scene) => scene,
                Err(reason) => {
                    self.unstaged.push(reason);
                    continue;
                }
            };
            let answer = answer(self.tests.household, self.mind, &scene, row);
            let (verdict, failure) = judge(row, &scene, &answer, &explain);
            let accepted = self.accepted(&answer);
            asked.0.push(Judged { verdict, accepted, short: is_short(row), failure });
        }
        asked
    }

    fn taught(&mut self, rows: &[&Row]) -> Asked {
        let (household, lesson) = (self.tests.household, self.lesson);
        self.each(rows, |row, scene, answer, explain| {
            let verdict = score::judge_taught(household, scene, &row.program, &answer.outcome);
            let failed = verdict != Verdict::Right;
            let failure = failed.then(|| explain.taught(row, &lesson.program, verdict, answer));
            (verdict, failure)
        })
    }

    fn distractors(&mut self, rows: &[&Row]) -> Asked {
        let (household, lesson, programs) = (self.tests.household, self.lesson, self.programs);
        self.each(rows, |row, scene, answer, explain| {
            let verdict = score::judge_taught(household, scene, &row.program, &answer.outcome);
            let accepted =
                programs.iter().any(|program| score::accepted_as(program, &answer.outcome));
            let failure = accepted.then(|| {
                let mut failure = explain.taught(row, &lesson.program, verdict, answer);
                failure.reason = format!("{} taken for {}", row.label, lesson.label);
                failure
            });
            (verdict, failure)
        })
    }

    fn primitives(&mut self, rows: &[&Row]) -> Asked {
        let (programs, staging) = (self.programs, self.tests.stages.staging);
        self.each(rows, |row, scene, answer, explain| {
            let (verdict, _) = score::judge_step(row, staging, &answer.outcome);
            let failed = verdict != Verdict::Right;
            let failure = failed.then(|| {
                let mut failure = explain.primitive(row, scene, verdict, answer);
                if programs.iter().any(|program| score::accepted_as(program, &answer.outcome)) {
                    failure.reason = "taken for the lesson".to_owned();
                }
                failure
            });
            (verdict, failure)
        })
    }
}

/// At most ten words and no conjunction.
fn is_short(row: &Row) -> bool {
    let tokens = tokens(row.sentence.as_str());
    let words = tokens.iter().filter(|token| token.chars().any(char::is_alphanumeric));
    words.count() <= SHORT_WORDS_MAX
        && !tokens.iter().any(|token| CONJUNCTIONS.contains(&token.as_str()))
}
