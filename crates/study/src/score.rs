//! Judging an answer against what was recorded.

use apprentice::language::{Evidence, Outcome, Program, Step, Symbol};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Show, World};
use serde::Serialize;

use super::corpus::Row;
use super::scenes::Staging;

/// What became of one sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Right,
    Wrong,
    /// Understood as something that the world forbids; nothing was done.
    Impossible,
    NotSure,
}

/// The one primitive that a program is about: the one that is neither GOTO nor the opening or
/// closing of the container. Of a program that only walks it is the last GOTO, of one that works
/// nothing but one door that OPEN or CLOSE. `None` when several are left.
pub fn core(program: &Program) -> Option<&Step> {
    let only = |wanted: fn(&Step) -> bool| {
        let mut steps = program.steps.iter().filter(|step| wanted(step));
        (steps.next(), steps.next())
    };
    match (only(|step| !walks(step) && !is_door(step)), only(is_door)) {
        ((Some(core), None), _) | ((None, _), (Some(core), None)) => Some(core),
        ((None, _), (None, _)) => program.steps.last(),
        _ => None,
    }
}

/// - `gold`: a program with a [`core()`].
/// - returns: right when the answer is the core primitive with the right arguments and no other
///   manipulation; GOTO, and OPEN and CLOSE of the container, are free. Of a walk, the last
///   destination counts.
pub fn judge_primitive(gold: &Program, outcome: &Outcome) -> Verdict {
    let answer = match outcome {
        Outcome::Understood { program, .. } => program,
        Outcome::Impossible { .. } => return Verdict::Impossible,
        Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => {
            return Verdict::NotSure;
        }
    };
    match says_core(gold, answer) {
        true => Verdict::Right,
        false => Verdict::Wrong,
    }
}

/// Judges an answer to a recorded step for one primitive.
///
/// - returns: the verdict, and whether it is right for being ahead: with the thing in the hand that
///   the words carry along, the answer to a walk also puts it down as the next recorded step does.
pub fn judge_step(row: &Row, staging: Staging, outcome: &Outcome) -> (Verdict, bool) {
    match (judge_primitive(&row.program, outcome), outcome) {
        (Verdict::Wrong, Outcome::Understood { program, .. })
            if staging == Staging::Held && is_ahead(row, program) =>
        {
            (Verdict::Right, true)
        }
        (verdict, _) => (verdict, false),
    }
}

fn is_ahead(row: &Row, answer: &Program) -> bool {
    let (Some(walk), Some(next)) = (core(&row.program).filter(|step| walks(step)), &row.next)
    else {
        return false;
    };
    core(next).is_some_and(|step| step.operator == "PUT")
        && says_core(next, answer)
        && answer.steps.iter().rev().find(|step| walks(step)) == Some(walk)
}

/// Whether a program is the core primitive of another and no other manipulation.
pub fn says_core(gold: &Program, answer: &Program) -> bool {
    let Some(core) = core(gold) else { return false };
    let counted = counted(gold, answer);
    match walks(core) {
        true => counted.is_empty() && answer.steps.iter().rev().find(|s| walks(s)) == Some(core),
        false => counted == [core],
    }
}

/// The steps of an answer that are not free: no GOTO, and no OPEN or CLOSE of the container.
pub fn counted<'a>(gold: &Program, answer: &'a Program) -> Vec<&'a Step> {
    // The container is what the recorded program opens or closes, or an argument of its core.
    let doors = gold.steps.iter().filter(|step| is_door(step));
    let core = core(gold).filter(|core| !walks(core));
    if core.is_some_and(is_door) {
        return answer.steps.iter().filter(|step| !walks(step)).collect();
    }
    let containers: Vec<&Symbol> = doors.chain(core).flat_map(|step| &step.args).collect();
    let free = |step: &&Step| {
        walks(step) || (is_door(step) && step.args.iter().all(|arg| containers.contains(&arg)))
    };
    answer.steps.iter().filter(|step| !free(step)).collect()
}

/// For what is taught: right when the answer picks up, puts and toggles the same things in the
/// same order, and every thing ends as hot, cold, clean and lit as it would have. GOTO is free, and
/// so are doors, as far as they make no difference to that.
pub fn judge_taught(
    household: &Household,
    scene: &Scene,
    gold: &Program,
    outcome: &Outcome,
) -> Verdict {
    match outcome {
        Outcome::Understood { program, .. } => {
            let same = handled(program) == handled(gold)
                && effects(household, scene, program) == effects(household, scene, gold);
            if same { Verdict::Right } else { Verdict::Wrong }
        }
        Outcome::Impossible { .. } => Verdict::Impossible,
        Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => Verdict::NotSure,
    }
}

/// Whether an answer is a lesson's program with other things in it: the same operators, and the
/// same thing wherever the lesson has one and the same. GOTO is not compared. An impossible
/// program counts like any other.
pub fn accepted_as(lesson: &Program, outcome: &Outcome) -> bool {
    let answer = match outcome {
        Outcome::Understood { program, .. } | Outcome::Impossible { program, .. } => program,
        Outcome::NotSure | Outcome::Asked { .. } | Outcome::Told { .. } => return false,
    };
    let without_walks = |program: &'_ Program| -> Vec<Step> {
        program.steps.iter().filter(|s| !walks(s)).cloned().collect()
    };
    let (lesson, answer) = (without_walks(lesson), without_walks(answer));
    let mut pairs: Vec<(&Symbol, &Symbol)> = Vec::new();
    lesson.len() == answer.len()
        && lesson.iter().zip(&answer).all(|(one, other)| {
            one.operator == other.operator
                && one.args.len() == other.args.len()
                && one.args.iter().zip(&other.args).all(|(from, to)| {
                    match pairs.iter().find(|(known, _)| *known == from) {
                        Some((_, meant)) => *meant == to,
                        None => {
                            pairs.push((from, to));
                            true
                        }
                    }
                })
        })
}

/// How sure an answer was: its distance as a share of the threshold. Smaller is surer; 0 when
/// there was nothing to compare with.
pub fn distance(evidence: &Evidence) -> f32 {
    let nearest = evidence.nearest.first().map_or(0.0, |near| near.distance);
    if evidence.threshold > 0.0 { nearest / evidence.threshold } else { nearest }
}

pub fn walks(step: &Step) -> bool {
    step.operator == "GOTO"
}

fn is_door(step: &Step) -> bool {
    step.operator == "OPEN" || step.operator == "CLOSE"
}

fn handled(program: &Program) -> Vec<&Step> {
    program.steps.iter().filter(|step| !walks(step) && !is_door(step)).collect()
}

/// Every thing with the states a program leaves it in; doors and reach do not count.
fn effects(household: &Household, scene: &Scene, program: &Program) -> Vec<(String, Vec<String>)> {
    let mut scene = scene.clone();
    for step in &program.steps {
        // What was understood runs, and so does what was recorded; a refusal changes nothing.
        let _ = household.step(&mut scene, &Task::free(), step);
    }
    let lasting = |state: &String| ["on", "dirty", "hot", "cold", "held"].contains(&state.as_str());
    let things = household.look(&scene).things.into_iter();
    things.map(|t| (t.name, t.states.into_iter().filter(lasting).collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corpus::Row;
    use crate::draw;
    use crate::scenes::{Clashes, Stages};
    use apprentice::world::household::Room;

    fn understood(program: &str) -> Outcome {
        Outcome::Understood { program: program.parse().unwrap(), bindings: Vec::new() }
    }

    fn impossible(program: &str) -> Outcome {
        let (program, reason) = (program.parse().unwrap(), "it cannot be".to_owned());
        Outcome::Impossible { program, step: 0, reason }
    }

    #[test]
    fn the_core_is_neither_walk_nor_door() {
        let check = |program: &str, expected: Option<&str>| {
            let program: Program = program.parse().unwrap();
            assert_eq!(core(&program).map(Step::to_string).as_deref(), expected, "{program}");
        };
        check("PICKUP Mug", Some("PICKUP Mug"));
        check("OPEN Fridge; PUT Mug Fridge; CLOSE Fridge", Some("PUT Mug Fridge"));
        check("CLOSE Laptop; PICKUP Laptop", Some("PICKUP Laptop"));
        check("GOTO Bed; GOTO Sofa", Some("GOTO Sofa"));
        check("PICKUP Mug; PUT Mug Shelf", None);
        check("GOTO Fridge; OPEN Fridge", Some("OPEN Fridge"));
        check("OPEN Fridge; CLOSE Fridge", None);
    }

    #[test]
    fn right_is_the_core_with_its_arguments_and_nothing_else() {
        let check = |gold: &str, answer: &str, expected: Verdict| {
            let gold: Program = gold.parse().unwrap();
            assert_eq!(judge_primitive(&gold, &understood(answer)), expected, "{gold} ~ {answer}");
        };
        use Verdict::{Right, Wrong};
        check("PICKUP Mug", "PICKUP Mug", Right);
        check("PICKUP Mug", "GOTO Shelf; PICKUP Mug", Right);
        check("PICKUP Mug", "PICKUP Cup", Wrong);
        check("PICKUP Mug", "PUT Mug Shelf", Wrong);
        check("PICKUP Mug", "GOTO Mug", Wrong);
        check("PICKUP Mug", "PICKUP Mug; PUT Mug Shelf", Wrong);
        check("PICKUP Mug", "PICKUP Mug; PICKUP Mug", Wrong);
        check("PICKUP Mug", "OPEN Fridge; PICKUP Mug", Wrong);
        check("OPEN Fridge; PICKUP Mug; CLOSE Fridge", "OPEN Fridge; PICKUP Mug", Right);
        check("OPEN Fridge; PICKUP Mug; CLOSE Fridge", "OPEN Safe; PICKUP Mug", Wrong);
        check("PUT Mug Shelf", "PUT Mug Shelf", Right);
        check("PUT Mug Shelf", "PUT Shelf Mug", Wrong);
        check("PUT Mug Cabinet", "PUT Mug Cabinet; CLOSE Cabinet", Right);
        check("OPEN Fridge", "GOTO Fridge; OPEN Fridge", Right);
        check("OPEN Fridge", "OPEN Fridge; CLOSE Fridge", Wrong);
        check("OPEN Fridge", "CLOSE Fridge", Wrong);
        check("GOTO Sofa", "GOTO Sofa", Right);
        check("GOTO Sofa", "GOTO Bed; GOTO Sofa", Right);
        check("GOTO Sofa", "GOTO Sofa; GOTO Bed", Wrong);
        check("GOTO Sofa", "GOTO Sofa; PICKUP Book", Wrong);
        let gold: Program = "PICKUP Mug".parse().unwrap();
        assert_eq!(judge_primitive(&gold, &impossible("PICKUP Mug")), Verdict::Impossible);
        assert_eq!(judge_primitive(&gold, &Outcome::NotSure), Verdict::NotSure);
    }

    #[test]
    fn an_answer_may_be_one_step_ahead() {
        let row = Row::about(Room::Kitchen, "take the mug to the fridge", "GOTO Fridge");
        let next = "OPEN Fridge; PUT Mug Fridge; CLOSE Fridge".parse().unwrap();
        let row = Row { next: Some(next), ..row };
        let check = |answer: &str, expected: (Verdict, bool)| {
            assert_eq!(judge_step(&row, Staging::Held, &understood(answer)), expected, "{answer}");
        };
        check("GOTO Fridge", (Verdict::Right, false));
        check("GOTO Fridge; OPEN Fridge; PUT Mug Fridge", (Verdict::Right, true));
        check("GOTO Fridge; PUT Cup Fridge", (Verdict::Wrong, false));
        check("GOTO Shelf; PUT Mug Fridge", (Verdict::Wrong, false));
        check("PICKUP Mug; GOTO Fridge; PUT Mug Fridge", (Verdict::Wrong, false));
        let ahead = understood("GOTO Fridge; PUT Mug Fridge");
        assert_eq!(judge_step(&row, Staging::Plain, &ahead), (Verdict::Wrong, false));
        let alone = Row { next: None, ..row.clone() };
        assert_eq!(judge_step(&alone, Staging::Held, &ahead), (Verdict::Wrong, false));
    }

    #[test]
    fn a_lesson_is_recognised_with_other_things_in_it() {
        let lesson: Program = "PUT Mug SinkBasin; TOGGLE Faucet; PICKUP Mug".parse().unwrap();
        let check = |answer: &str, expected: bool| {
            assert_eq!(accepted_as(&lesson, &understood(answer)), expected, "{answer}");
            assert_eq!(accepted_as(&lesson, &impossible(answer)), expected, "{answer}");
        };
        check("PUT Pan SinkBasin; TOGGLE Faucet; PICKUP Pan", true);
        check("GOTO SinkBasin; PUT Pan BathtubBasin; TOGGLE Faucet; PICKUP Pan", true);
        check("PUT Pan SinkBasin; TOGGLE Faucet; PICKUP Cup", false);
        check("PUT Pan SinkBasin; TOGGLE Faucet", false);
        check("PUT Pan SinkBasin; OPEN Faucet; PICKUP Pan", false);
        assert!(!accepted_as(&lesson, &Outcome::NotSure));
    }

    #[test]
    fn a_taught_answer_must_come_to_the_same() {
        let household = Household::new();
        let stages = Stages::new(&household);
        let row = Row::about(
            Room::Kitchen,
            "chill the mug",
            "OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug; CLOSE Fridge",
        );
        let gold = &row.program;
        let scene = stages.set(&row, Clashes::Avoided, &mut draw::rng(1, &["test"])).unwrap();
        let check = |answer: &str, expected: Verdict| {
            let verdict = judge_taught(&household, &scene, gold, &understood(answer));
            assert_eq!(verdict, expected, "{answer}");
        };
        check(&gold.to_string(), Verdict::Right);
        let walk_and_leave_open =
            "GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; PICKUP Mug";
        check(walk_and_leave_open, Verdict::Right);
        // Never closed, so it is not cold.
        check("OPEN Fridge; PUT Mug Fridge; PICKUP Mug; CLOSE Fridge", Verdict::Wrong);
        check("OPEN Fridge; PUT Mug Fridge; CLOSE Fridge", Verdict::Wrong);
        assert_eq!(judge_taught(&household, &scene, gold, &Outcome::NotSure), Verdict::NotSure);
    }
}
