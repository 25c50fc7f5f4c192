//! A plan in the parts that people speak of: fetching, washing, putting away, lighting.

use apprentice::language::{Step, Symbol};
use apprentice::world::household::Task;

use super::teacher::Size;

/// Something that can be asked for at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    pub size: Size,
    /// What the words are chosen by: `fetch`, `cool`, `goto`. None for what nobody has words for:
    /// its parts are asked for at once.
    pub key: Option<&'static str>,
    pub thing: Symbol,
    /// Where to, with what; none where only one thing is named.
    pub place: Option<Symbol>,
    pub carrier: Option<Symbol>,
    pub steps: Vec<Step>,
    /// What it is broken into when it is not understood; empty for a primitive.
    pub parts: Vec<Unit>,
    /// Its two parts are asked for in one utterance, each in its own words.
    pub joined: bool,
}

/// The whole task, in its parts.
///
/// - `task`: in the domain's words: `cool Mug CounterTop`.
pub fn whole(task: &str, plan: &[Step]) -> Option<Unit> {
    let words: Vec<&str> = task.split_whitespace().filter(|word| *word != "closed").collect();
    let form = Task::KINDS.into_iter().find(|form| words.first() == Some(form))?;
    let thing = Symbol::new(words.get(1)?);
    let (carrier, place) = match words.len() {
        4 => (Some(Symbol::new(words[2])), words[3]),
        _ => (None, *words.get(2)?),
    };
    Some(Unit {
        size: Size::Whole,
        key: Some(form),
        thing,
        place: Some(Symbol::new(place)),
        carrier,
        steps: plan.to_vec(),
        parts: parts(form, plan),
        joined: false,
    })
}

/// Cuts the rest of a plan into parts. Together they are the plan.
pub fn parts(form: &str, plan: &[Step]) -> Vec<Unit> {
    let appliance = match form {
        "clean" => Some(("SinkBasin", "clean")),
        "heat" => Some(("Microwave", "heat")),
        "cool" => Some(("Fridge", "cool")),
        _ => None,
    };
    let mut units = Vec::new();
    let mut start = 0;
    let mut held: Option<Symbol> = None;
    for index in 0..plan.len() {
        if index < start {
            continue;
        }
        let step = &plan[index];
        let first = |step: &Step| step.args.first().cloned();
        let again = |thing: &Symbol| {
            let picks = |step: &Step| step.operator == "PICKUP" && step.args.first() == Some(thing);
            plan[index..].iter().position(picks).map(|after| index + after)
        };
        let found = match (step.operator.as_str(), step.args.as_slice()) {
            ("PICKUP", [thing]) => {
                held = Some(thing.clone());
                Some((index, "fetch", thing.clone(), None))
            }
            ("PUT", [thing, place]) => {
                let treats = appliance.filter(|(name, _)| place.as_str() == *name);
                match treats.and_then(|(_, key)| Some((again(thing)?, key))) {
                    Some((end, key)) => Some((end, key, thing.clone(), None)),
                    None => {
                        held = None;
                        Some((index, "deliver", thing.clone(), Some(place.clone())))
                    }
                }
            }
            ("TOGGLE", [light]) if form == "look" => {
                let thing = held.clone().or_else(|| plan.iter().rev().find_map(first));
                Some((index, "light", thing.unwrap_or(light.clone()), Some(light.clone())))
            }
            _ => None,
        };
        let Some((mut end, key, thing, place)) = found else { continue };
        while plan.get(end + 1).is_some_and(|next| next.operator == "CLOSE") {
            end += 1;
        }
        units.push(part(Some(key), thing, place, &plan[start..=end]));
        start = end + 1;
    }
    if let Some(rest) = plan.get(start..).filter(|rest| !rest.is_empty()) {
        let thing = rest[0].args.first().cloned().unwrap_or_else(|| rest[0].operator.clone());
        units.push(part(None, thing, None, rest));
    }
    units
}

fn part(key: Option<&'static str>, thing: Symbol, place: Option<Symbol>, steps: &[Step]) -> Unit {
    let parts = steps.iter().map(primitive).collect();
    let steps = steps.to_vec();
    Unit { size: Size::Part, key, thing, place, carrier: None, steps, parts, joined: false }
}

/// Two requests at once; none where one has no words or both would say the same of a switch.
///
/// - `rest`: the plan after the first.
pub fn joined(form: &str, first: &Unit, rest: &[Step]) -> Option<Unit> {
    let next = parts(form, rest).into_iter().next()?;
    let second = match first.size {
        Size::Primitive => primitives(&next.steps, || false).into_iter().next()?,
        Size::Part => next,
        Size::Whole => return None,
    };
    // Words for a switch depend on its state, which the first request may change.
    let switches = |unit: &Unit| unit.key == Some("on");
    if first.key.is_none() || second.key.is_none() || switches(first) || switches(&second) {
        return None;
    }
    Some(Unit {
        size: Size::Part,
        key: None,
        thing: first.thing.clone(),
        place: None,
        carrier: None,
        steps: [&first.steps[..], &second.steps[..]].concat(),
        parts: vec![first.clone(), second],
        joined: true,
    })
}

/// One primitive.
pub fn primitive(step: &Step) -> Unit {
    let key = match step.operator.as_str() {
        "GOTO" => "goto",
        "PICKUP" => "pickup",
        "PUT" => "put",
        "OPEN" => "open",
        "CLOSE" => "close",
        // Whether that is on or off shows only when it is said.
        _ => "on",
    };
    Unit {
        size: Size::Primitive,
        key: Some(key),
        thing: step.args.first().cloned().unwrap_or_else(|| step.operator.clone()),
        place: step.args.get(1).cloned(),
        carrier: None,
        steps: vec![step.clone()],
        parts: Vec::new(),
        joined: false,
    }
}

/// The primitives of a part; walks are left to the primitive that follows where `join` says so.
pub fn primitives(steps: &[Step], mut join: impl FnMut() -> bool) -> Vec<Unit> {
    let mut units: Vec<Unit> = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let mut unit = primitive(step);
        let walk = index.checked_sub(1).map(|before| &steps[before]);
        let before = walk.filter(|walk| walk.operator == "GOTO" && step.operator != "GOTO");
        if let Some(walk) = before.filter(|_| join()) {
            units.pop();
            unit.steps = vec![walk.clone(), step.clone()];
            unit.parts = vec![primitive(walk), primitive(step)];
        }
        units.push(unit);
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::language::Program;

    fn cut(form: &str, plan: &str) -> Vec<String> {
        let plan: Program = plan.parse().unwrap();
        let said = |unit: Unit| {
            let steps = Program { steps: unit.steps };
            format!("{} {}: {steps}", unit.key.unwrap_or("rest"), unit.thing)
        };
        parts(form, &plan.steps).into_iter().map(said).collect()
    }

    #[test]
    fn a_plan_is_cut_where_people_cut_it() {
        assert_eq!(
            cut(
                "cool",
                "GOTO Mug; PICKUP Mug; GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; \
                 OPEN Fridge; PICKUP Mug; CLOSE Fridge; GOTO CounterTop; PUT Mug CounterTop"
            ),
            [
                "fetch Mug: GOTO Mug; PICKUP Mug",
                "cool Mug: GOTO Fridge; OPEN Fridge; PUT Mug Fridge; CLOSE Fridge; OPEN Fridge; \
                 PICKUP Mug; CLOSE Fridge",
                "deliver Mug: GOTO CounterTop; PUT Mug CounterTop",
            ]
        );
        assert_eq!(
            cut(
                "place",
                "GOTO Fridge; OPEN Fridge; PICKUP Egg; CLOSE Fridge; PUT Egg Bowl; GOTO X"
            ),
            [
                "fetch Egg: GOTO Fridge; OPEN Fridge; PICKUP Egg; CLOSE Fridge",
                "deliver Egg: PUT Egg Bowl",
                "rest X: GOTO X",
            ]
        );
        assert_eq!(
            cut("look", "GOTO Book; PICKUP Book; GOTO DeskLamp; TOGGLE DeskLamp"),
            ["fetch Book: GOTO Book; PICKUP Book", "light Book: GOTO DeskLamp; TOGGLE DeskLamp"]
        );
    }

    #[test]
    fn two_requests_are_made_at_once_in_the_order_of_the_plan() {
        let plan: Program =
            "GOTO Mug; PICKUP Mug; GOTO Shelf; PUT Mug Shelf; TOGGLE Lamp".parse().unwrap();
        let check = |first: usize, size: Size, rest: usize, expected: Option<&str>| {
            let unit = match size {
                Size::Primitive => primitive(&plan.steps[first]),
                _ => parts("place", &plan.steps).swap_remove(first),
            };
            let both = joined("place", &unit, &plan.steps[rest..]);
            let said = both.map(|both| Program { steps: both.steps }.to_string());
            assert_eq!(said.as_deref(), expected);
        };
        check(0, Size::Primitive, 1, Some("GOTO Mug; PICKUP Mug"));
        check(0, Size::Part, 2, Some("GOTO Mug; PICKUP Mug; GOTO Shelf; PUT Mug Shelf"));
        // What is left has no words as a part, and a switch none for later.
        check(1, Size::Part, 4, None);
        check(3, Size::Primitive, 4, None);
        check(4, Size::Primitive, 5, None);
    }

    #[test]
    fn a_walk_is_left_to_what_follows_it() {
        let plan: Program = "GOTO Mug; PICKUP Mug; OPEN Fridge".parse().unwrap();
        let joined = primitives(&plan.steps, || true);
        assert_eq!(joined.len(), 2);
        assert_eq!((joined[0].key, joined[0].steps.len()), (Some("pickup"), 2));
        assert_eq!(joined[0].parts.len(), 2);
        assert_eq!(primitives(&plan.steps, || false).len(), 3);
    }
}
