//! Where programs lead.

use apprentice::language::{Program, Step};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Infeasible, World};

use crate::score;
use crate::transcript::Request;

/// Steps that may come before one that was meant, unsaid: going there, opening what is shut.
const APPROACH_MAX: usize = 3;

/// Carries out one step of a request, with the steps that have to come first.
///
/// - errors: the step's own, when they do not make it possible. The scene may have changed.
pub(super) fn carry_out(
    household: &Household,
    scene: &mut Scene,
    task: &Task,
    request: &Request,
    step: &Step,
) -> Result<(), Infeasible> {
    let on = request.chosen(step);
    for _ in 0..APPROACH_MAX {
        let Err(infeasible) = household.step_on(scene, task, step, &on) else { return Ok(()) };
        let Some(first) = &infeasible.first else { return Err(infeasible) };
        let first_on = match infeasible.first_on.is_empty() {
            true => request.chosen(first),
            false => infeasible.first_on.clone(),
        };
        if household.step_on(scene, task, first, &first_on).is_err() {
            return Err(infeasible);
        }
    }
    household.step_on(scene, task, step, &on).map(|_| ())
}

/// Where some steps of a request lead.
///
/// - errors: the place of the step that cannot be carried out, and why.
pub(super) fn after(
    household: &Household,
    scene: &Scene,
    task: &Task,
    request: &Request,
    steps: &[Step],
) -> Result<Scene, (usize, Infeasible)> {
    let mut scene = scene.clone();
    for (place, step) in steps.iter().enumerate() {
        carry_out(household, &mut scene, task, request, step)
            .map_err(|infeasible| (place, infeasible))?;
    }
    Ok(scene)
}

/// The scenes that an answer leads through: the one it starts from, then one for each step.
///
/// - `bindings`: the things that each step acted on.
pub(super) fn path(
    household: &Household,
    scene: &Scene,
    task: &Task,
    program: &Program,
    bindings: &[Vec<String>],
) -> Vec<Scene> {
    let mut path = vec![scene.clone()];
    for (place, step) in program.steps.iter().enumerate() {
        let names = bindings.get(place).map_or(&[][..], Vec::as_slice);
        let on: Vec<Option<String>> = names.iter().cloned().map(Some).collect();
        let mut next = path[place].clone();
        // What was understood runs; a defect that makes it stop leads elsewhere.
        let _ = household.step_on(&mut next, task, step, &on);
        path.push(next);
    }
    path
}

/// Whether two programs ask for the same: the same manipulations, or the same place to go to.
pub(super) fn same_request(meant: &[Step], answer: &Program) -> bool {
    fn manipulations(steps: &[Step]) -> Vec<&Step> {
        steps.iter().filter(|step| !score::walks(step)).collect()
    }
    let (ours, theirs) = (manipulations(meant), manipulations(&answer.steps));
    match ours.is_empty() && theirs.is_empty() {
        true => meant.last() == answer.steps.last(),
        false => ours == theirs,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_do_not_make_another_request_unless_there_is_nothing_else() {
        let check = |meant: &str, answer: &str, expected: bool| {
            let meant: Program = meant.parse().unwrap();
            let same = same_request(&meant.steps, &answer.parse().unwrap());
            assert_eq!(same, expected, "{meant} ~ {answer}");
        };
        check("GOTO Mug; PICKUP Mug", "PICKUP Mug", true);
        check("GOTO Mug; PICKUP Mug", "GOTO Mug; PICKUP Cup", false);
        check("GOTO Mug; PICKUP Mug", "GOTO Mug", false);
        check("GOTO Mug", "GOTO Mug", true);
        check("GOTO Mug", "GOTO Cup", false);
    }
}
