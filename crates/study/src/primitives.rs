//! The protocol *primitives*: does it understand how people ask for one primitive, and does it
//! keep its hands off what nobody taught it?

use std::collections::BTreeMap;

use apprentice::grounding::Moment;
use apprentice::language::Answer;
use apprentice::learning::{Mind, TrainError, train};
use apprentice::parallel::in_order;
use apprentice::world::Words;
use apprentice::world::household::{Household, Scene, Task};
use serde::Serialize;

use super::corpus::Row;
use super::draw;
use super::failures::{Explain, Failure};
use super::figures::{Reasons, Shares, Spread, share};
use super::promise::{Kept, Promise, surety};
use super::report::{Base, Setting};
use super::scenes::{Clashes, Stages, Staging};
use super::score::{self, Verdict};

/// The actions that stand for one primitive.
pub const PRIMITIVES: [&str; 4] = ["PickupObject", "PutObject", "ToggleObject", "GotoLocation"];
/// The actions that nobody has taught yet.
pub const UNTAUGHT: [&str; 3] = ["CleanObject", "HeatObject", "CoolObject"];

/// What the protocol found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PrimitivesReport {
    #[serde(flatten)]
    pub base: Base,
    /// Over the primitives of all seeds together.
    #[serde(flatten)]
    pub shares: Shares,
    pub untaught_n: usize,
    /// Untaught sentences that were taken for something, carried out or not.
    pub untaught_accepted: f64,
    /// Of all untaught ones, those that came to what was meant, said in primitives.
    pub untaught_right: f64,
    pub by_action: BTreeMap<String, Shares>,
    /// The same figures once for each person, and then their mean: few people wrote most rows.
    pub by_person: ByPerson,
    /// The precision that the threshold promises, and the one that people meet.
    pub promise: Promise,
    /// The same sentences with other things of the same name in the scene.
    pub clashes: Shares,
    /// What staging what people held comes to; none unless it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held: Option<Held>,
    /// Per seed, the shares of that seed alone.
    pub by_seed: Vec<Shares>,
    /// What the training of the last seed measured about itself.
    pub training: BTreeMap<String, f64>,
    /// Why not right, by verdict.
    pub reasons: Reasons,
    #[serde(skip)]
    pub failures: Vec<Failure>,
    /// Failures without their sentences, by what was asked.
    #[serde(skip)]
    pub cases: BTreeMap<&'static str, Vec<Failure>>,
}

/// Sentences said with what they carry in the hand.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Held {
    /// Walks that were asked for with something in the hand.
    pub walks: usize,
    /// Of all primitives, those that are right for doing the next recorded step as well.
    pub ahead: f64,
}

/// Shares of single people, averaged. Nobody is named.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ByPerson {
    pub right: Spread,
    pub wrong: Spread,
    pub untaught_accepted: Spread,
    /// The largest shares, largest first.
    pub worst_wrong: Vec<f64>,
    pub worst_untaught_accepted: Vec<f64>,
}

/// How many of the worst people are reported.
pub(super) const WORST: usize = 5;

impl ByPerson {
    fn of(judged: &[Judged]) -> ByPerson {
        let mut people: BTreeMap<&str, [Vec<Verdict>; 2]> = BTreeMap::new();
        for one in judged {
            let [primitives, untaught] = people.entry(&one.user).or_default();
            if one.untaught { untaught } else { primitives }.push(one.verdict);
        }
        let shares = |which: usize, counts: &dyn Fn(&Verdict) -> bool| -> Vec<f64> {
            let said = people.values().map(|of| &of[which]).filter(|said| !said.is_empty());
            said.map(|said| share(said.iter().filter(|v| counts(v)).count(), said.len())).collect()
        };
        let worst = |mut shares: Vec<f64>| {
            shares.sort_by(|a, b| b.total_cmp(a));
            shares.truncate(WORST);
            shares
        };
        let right = shares(0, &|verdict| *verdict == Verdict::Right);
        let wrong = shares(0, &|verdict| *verdict == Verdict::Wrong);
        let untaught = shares(1, &|verdict| *verdict != Verdict::NotSure);
        ByPerson {
            right: Spread::of(&right),
            wrong: Spread::of(&wrong),
            untaught_accepted: Spread::of(&untaught),
            worst_wrong: worst(wrong),
            worst_untaught_accepted: worst(untaught),
        }
    }
}

/// Whether a row belongs to the primitives of this protocol.
pub fn is_primitive(row: &Row) -> bool {
    PRIMITIVES.contains(&row.label.as_str())
        && !(row.label == "GotoLocation" && row.egocentric)
        && score::core(&row.program).is_some()
}

pub fn is_untaught(row: &Row) -> bool {
    UNTAUGHT.contains(&row.label.as_str())
}

/// Runs the protocol.
///
/// - errors: a training that fails.
pub fn primitives(setting: &Setting<'_>, rows: &[Row]) -> Result<PrimitivesReport, TrainError> {
    let household = Household::new();
    let stages = Stages::new(&household).staged(setting.staging);
    let all: Vec<&Row> = rows.iter().filter(|row| is_primitive(row)).collect();
    let untaught: Vec<&Row> = rows.iter().filter(|row| is_untaught(row)).collect();

    let mut base = Base::new("primitives", setting);
    let mut judged: Vec<Judged> = Vec::new();
    let mut by_seed = Vec::new();
    let mut training = BTreeMap::new();
    for &seed in setting.seeds {
        let recipe = setting.recipe.reseeded(seed);
        let mind = train(&household, &recipe, &[])?;
        training = mind.report().figures.clone();
        let count = setting.limit.unwrap_or(all.len());
        let mut drawn = draw::some(&mut draw::rng(seed, &["primitives"]), &all, count);
        // The untaught are drawn in the proportion in which they stand in the corpus.
        let part = (untaught.len() * drawn.len()).div_ceil(all.len().max(1));
        drawn.extend(draw::some(&mut draw::rng(seed, &["untaught"]), &untaught, part));
        let explain = Explain::new(&household, &recipe);
        let judge = |row: &&Row| judge(&household, &stages, &mind, &explain, row, seed);
        let of_seed = in_order(setting.threads, setting.progress, &drawn, judge);
        let mut plain = Vec::new();
        for result in of_seed {
            match result {
                Ok(one) => {
                    if !one.untaught {
                        plain.push((one.verdict, one.distance));
                    }
                    judged.push(one);
                }
                Err(reason) => base.unstaged.add(reason),
            }
        }
        by_seed.push(Shares::of(&plain));
    }
    Ok(summarise(setting, base, judged, by_seed, training))
}

/// One sentence, judged.
struct Judged {
    label: String,
    user: String,
    untaught: bool,
    verdict: Verdict,
    /// Right, and the next recorded step was done as well.
    ahead: bool,
    /// A walk with something in the hand.
    carries: bool,
    distance: f32,
    sure: f64,
    /// With things of the same name about; none for the untaught, and where no such scene exists.
    clashing: Option<(Verdict, f32)>,
    failure: Option<Failure>,
}

/// - errors: why there is no scene in which what was meant can be done.
fn judge(
    household: &Household,
    stages: &Stages<'_>,
    mind: &Mind,
    explain: &Explain<'_>,
    row: &Row,
    seed: u64,
) -> Result<Judged, String> {
    let set = |clashes, purpose| {
        let mut rng = draw::rng(seed, &[purpose, &row.id]);
        stages.set(row, clashes, &mut rng)
    };
    let scene = set(Clashes::Avoided, "scene")?;
    let answer = answer(household, mind, &scene, row);
    let untaught = is_untaught(row);
    let (verdict, ahead) = match untaught {
        true => {
            let taught = score::judge_taught(household, &scene, &row.program, &answer.outcome);
            (taught, false)
        }
        false => score::judge_step(row, stages.staging, &answer.outcome),
    };
    let walks = score::core(&row.program).is_some_and(score::walks);
    let carries = walks && household.held(&scene).is_some();
    let clashing = match set(Clashes::Allowed, "clashing scene") {
        Ok(scene) if !untaught => {
            let answer = self::answer(household, mind, &scene, row);
            let (verdict, _) = score::judge_step(row, stages.staging, &answer.outcome);
            Some((verdict, score::distance(&answer.evidence)))
        }
        _ => None,
    };
    let failed = if untaught { verdict != Verdict::NotSure } else { verdict != Verdict::Right };
    let failure = failed.then(|| match untaught {
        true => explain.untaught(row, verdict, &answer),
        false => explain.primitive(row, &scene, verdict, &answer),
    });
    let distance = score::distance(&answer.evidence);
    let sure = surety(explain.recipe(), distance, answer.evidence.threshold);
    let (label, user) = (row.label.clone(), row.user.clone());
    Ok(Judged { label, user, untaught, verdict, ahead, carries, distance, sure, clashing, failure })
}

/// The answer to a row's sentence, said in a scene at the start of an episode.
pub(super) fn answer(household: &Household, mind: &Mind, scene: &Scene, row: &Row) -> Answer {
    let task = Task::free();
    let moment = Moment { domain: household, scene, task: &task, mentioned: None, handled: &[] };
    mind.interpret(moment, &row.sentence)
}

fn summarise(
    setting: &Setting<'_>,
    base: Base,
    judged: Vec<Judged>,
    by_seed: Vec<Shares>,
    training: BTreeMap<String, f64>,
) -> PrimitivesReport {
    let by_person = ByPerson::of(&judged);
    let (untaught, primitives): (Vec<&Judged>, Vec<&Judged>) =
        judged.iter().partition(|one| one.untaught);
    let scored = |rows: &[&Judged]| -> Vec<(Verdict, f32)> {
        rows.iter().map(|one| (one.verdict, one.distance)).collect()
    };
    let mut by_action = BTreeMap::new();
    for label in PRIMITIVES.iter().chain(&UNTAUGHT) {
        let rows: Vec<&Judged> = judged.iter().filter(|one| one.label == **label).collect();
        by_action.insert((*label).to_owned(), Shares::of(&scored(&rows)));
    }
    let of = |verdicts: &[Verdict]| {
        untaught.iter().filter(|one| verdicts.contains(&one.verdict)).count()
    };
    let accepted = of(&[Verdict::Right, Verdict::Wrong, Verdict::Impossible]);
    let clashing: Vec<(Verdict, f32)> = primitives.iter().filter_map(|one| one.clashing).collect();
    let kept: Vec<Kept<'_>> = primitives
        .iter()
        .map(|one| Kept { user: &one.user, verdict: one.verdict, sure: one.sure })
        .collect();
    let unknown_accepted = training.get("unknown_accepted").copied().unwrap_or(0.0);
    let promise = Promise::of(setting.recipe, unknown_accepted, &kept);
    let cases = [("primitives", &primitives), ("untaught", &untaught)].map(|(name, judged)| {
        let failed = judged.iter().filter_map(|one| one.failure.as_ref());
        (name, Failure::draw(failed, name, setting.cases))
    });
    let held = (setting.staging == Staging::Held).then(|| Held {
        walks: primitives.iter().filter(|one| one.carries).count(),
        ahead: share(primitives.iter().filter(|one| one.ahead).count(), primitives.len()),
    });
    let mut reasons = Reasons::default();
    for failure in judged.iter().filter_map(|one| one.failure.as_ref()) {
        reasons.add(failure.verdict, &failure.reason);
    }
    PrimitivesReport {
        base,
        shares: Shares::of(&scored(&primitives)),
        untaught_n: untaught.len(),
        untaught_accepted: share(accepted, untaught.len()),
        untaught_right: share(of(&[Verdict::Right]), untaught.len()),
        by_action,
        by_person,
        promise,
        clashes: Shares::of(&clashing),
        held,
        by_seed,
        training,
        reasons,
        cases: cases.into(),
        failures: Failure::choose(
            judged.into_iter().filter_map(|one| one.failure),
            setting.failures,
        ),
    }
}
