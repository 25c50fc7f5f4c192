//! Carrying a reading out on a copy of the scene, step by step. Missing steps are added before a
//! step, and steps whose effect holds already are skipped.

use super::chosen::Chosen;
use super::combine::{Ground, Offer, Verdict};
use crate::language::{Program, Step};
use crate::limits::PROGRAM_STEPS_MAX;
use crate::world::Words;

/// The most missing steps that are added before one step.
const UNASKED_STEPS_MAX: usize = 3;

/// What was carried out so far.
pub(super) struct Done {
    /// Those that were carried out.
    pub steps: Vec<Step>,
    /// Per step the names of the things it acted on.
    pub bindings: Vec<Vec<String>>,
    /// Per step and argument the thing that words chose.
    pub chosen: Vec<Vec<Option<String>>>,
}

impl Done {
    pub(super) fn push(&mut self, step: Step, bound: Vec<String>, on: Vec<Option<String>>) {
        self.steps.push(step);
        self.bindings.push(bound);
        self.chosen.push(on);
    }
}

impl<D: Words> Ground<'_, D> {
    /// Carries the steps out on the copy of the scene.
    ///
    /// - `after_lesson`: whether a clause before this one was read as a lesson.
    /// - errors: [`Verdict::Forbidden`], its step counted over the whole program.
    pub(super) fn run(
        &self,
        scene: &mut D::Scene,
        done: &mut Done,
        offer: &Offer<'_>,
        after_lesson: bool,
        program: &Program,
        chosen: &Chosen,
    ) -> Result<(), Verdict> {
        let (domain, task) = (self.moment.domain, self.moment.task);
        let before = done.steps.len();
        let contradicted = |scene: &D::Scene, from: usize| {
            let rest = Program { steps: program.steps[from..].to_vec() };
            if !self.context.execution.polarity {
                return None;
            }
            let (step, reason) = domain.contradiction(scene, &offer.clause.words, &rest)?;
            let step = (before + from + step) as u32;
            Some(Verdict::Forbidden { step, reason, mendable: false })
        };
        if let Some(contradiction) = contradicted(scene, 0) {
            return Err(contradiction);
        }
        // A lesson is taught for its effect, so steps whose effect holds already are skipped.
        let by_effect = self.context.execution.effects && !offer.seed;
        let mut held_already = None;
        if let (true, Some(reason)) = (by_effect, self.is_done(scene, program, chosen)) {
            let step = (before + program.steps.len() - 1) as u32;
            return Err(Verdict::Forbidden { step, reason, mendable: false });
        }
        for (index, step) in program.steps.iter().enumerate() {
            let refused = |reason, mendable| Verdict::Forbidden {
                step: (before + index) as u32,
                reason,
                mendable,
            };
            if done.steps.len() >= PROGRAM_STEPS_MAX {
                return Err(refused("the program is too long".to_owned(), false));
            }
            domain.signature().check(step).map_err(|reason| refused(reason, false))?;
            // A thing that a lesson turns on and off again may be on at its beginning.
            if by_effect && self.starts_on(scene, program, index) {
                held_already = Some(refused("it is on already".to_owned(), false));
                continue;
            }
            let mut unasked = 0;
            let mut opened = None;
            let on = chosen.on(step);
            let bound = loop {
                let refusal = match domain.step_on(scene, task, step, &on) {
                    Ok(bound) => break Some(bound),
                    Err(refusal) => refusal,
                };
                // "Wash the apple and pick it up": the lesson has already picked it up.
                if after_lesson && self.context.execution.effects && refusal.done {
                    break None;
                }
                if by_effect && refusal.done {
                    held_already = Some(refused(refusal.reason, false));
                    break None;
                }
                // A thing in a fridge across the room needs two steps: going there and opening it.
                let roles = &domain.lexicon(self.context.edition).roles;
                let means = roles.goes(&step.operator) || roles.is_door(&step.operator);
                // The way of the lesson may not be the way in this scene.
                let accounts = self.context.execution.accounting.is_some();
                let near = (offer.open && !(accounts && offer.seed)) || by_effect;
                if near && program.steps.len() > 1 && means && refusal.first.is_none() {
                    break None;
                }
                let mendable = refusal.first.is_some();
                let first = refusal.first.filter(|_| self.context.execution.approach);
                let Some(first) = first.filter(|_| unasked < UNASKED_STEPS_MAX) else {
                    return Err(refused(refusal.reason, mendable));
                };
                let bound = domain
                    .step_on(scene, task, &first, &refusal.first_on)
                    .map_err(|e| refused(e.reason, false))?;
                if by_effect && roles.is_door(&first.operator) {
                    opened = Some((first.clone(), refusal.first_on.clone()));
                }
                done.push(first, bound, refusal.first_on);
                unasked += 1;
                // The thing was too far away to contradict the words; it is near now.
                if let Some(contradiction) = contradicted(scene, index) {
                    return Err(contradiction);
                }
            };
            if let Some(bound) = bound {
                done.push(step.clone(), bound, on);
            }
            if let Some((opened, on)) = opened {
                self.shut_again(scene, done, &program.steps[index + 1..], &opened, on);
            }
        }
        // Going there was not its purpose.
        let roles = &domain.lexicon(self.context.edition).roles;
        let only_went = done.steps[before..].iter().all(|step| roles.goes(&step.operator))
            && !program.steps.iter().all(|step| roles.goes(&step.operator));
        match held_already.filter(|_| only_went) {
            Some(nothing_left) => Err(nothing_left),
            None => Ok(()),
        }
    }

    /// Shuts a door that was opened as a missing step of a lesson, unless a later step shuts it or
    /// needs it open.
    fn shut_again(
        &self,
        scene: &mut D::Scene,
        done: &mut Done,
        rest: &[Step],
        opened: &Step,
        on: Vec<Option<String>>,
    ) {
        let (domain, task) = (self.moment.domain, self.moment.task);
        let doors = &domain.lexicon(self.context.edition).roles.doors;
        let Some(operator) = doors.iter().find(|door| **door != opened.operator) else { return };
        let shut = Step { operator: operator.clone(), args: opened.args.clone() };
        if rest.contains(&shut) || done.steps.len() >= PROGRAM_STEPS_MAX {
            return;
        }
        let mut after = scene.clone();
        let Ok(bound) = domain.step_on(&mut after, task, &shut, &on) else { return };
        let needs_it = rest.first().is_some_and(|next| {
            let on = vec![None; next.args.len()];
            let refusal = domain.step_on(&mut after.clone(), task, next, &on).err();
            refusal.and_then(|refusal| refusal.first).as_ref() == Some(opened)
        });
        if !needs_it {
            *scene = after;
            done.push(shut, bound, on);
        }
    }

    /// Whether a step of a lesson is the first of an even number that work one thing, and it is on.
    fn starts_on(&self, scene: &D::Scene, program: &Program, index: usize) -> bool {
        let roles = &self.moment.domain.lexicon(self.context.edition).roles;
        let step = &program.steps[index];
        let same = program.steps.iter().filter(|other| *other == step).count();
        let first = program.steps.iter().position(|other| other == step) == Some(index);
        roles.works(&step.operator)
            && first
            && same % 2 == 0
            && self.moment.domain.is_on(scene, step)
    }

    /// Why a lesson that only takes something somewhere has nothing left to do: the thing is there.
    fn is_done(&self, scene: &D::Scene, program: &Program, chosen: &Chosen) -> Option<String> {
        let domain = self.moment.domain;
        let roles = &domain.lexicon(self.context.edition).roles;
        let moves = |step: &Step| !roles.works(&step.operator);
        let mut puts = program.steps.iter().filter(|step| roles.puts(&step.operator));
        let last = puts.next_back()?;
        let taken_after =
            program.steps.iter().rev().take_while(|s| *s != last).any(|s| roles.takes(&s.operator));
        if !program.steps.iter().all(moves) || puts.next().is_some() || taken_after {
            return None;
        }
        let on = chosen.on(last);
        let refusal = domain.step_on(&mut scene.clone(), self.moment.task, last, &on).err()?;
        let goal = last.args.last()?;
        refusal
            .done
            .then(|| format!("nothing is left to do: the {} is at the {goal}", last.args[0]))
    }
}
