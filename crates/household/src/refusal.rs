use super::facts::Kind;
use super::primitives::{Action, Chosen};
use super::scene::{Index, Scene};
use super::words::a;

/// Why a primitive cannot be carried out. Small and without text: the planner and the feasibility
/// filter get thousands of them, and only a person needs the sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The scene has no thing of this kind.
    NoneHere(Kind),
    /// The robot holds the only one.
    InHand(Index),
    HandFull(Index),
    NotPickupable(Kind),
    OutOfReach(Index),
    /// The first is shut in the second.
    ShutIn(Index, Index),
    NotOpenable(Kind),
    AlreadyOpen(Index),
    AlreadyClosed(Index),
    /// It runs, so its door stays shut.
    Running(Index),
    /// Its door is open, so it does not start.
    DoorOpen(Index),
    NotToggleable(Kind),
    /// The robot holds something else, or nothing.
    NotHeld(Kind),
    /// The robot holds something else than this thing, or nothing.
    OtherHeld(Index),
    NoReceptacle(Kind),
    /// The first kind does not go in or on the second.
    DoesNotGo(Kind, Kind),
    IntoItself(Index),
    Shut(Index),
}

impl Refusal {
    /// One sentence that names the thing, the reason, and what to do about it if anything helps.
    pub(crate) fn sentence(self, scene: &Scene) -> String {
        let the = |index: Index| format!("the {}", scene.name(index));
        let hand = match scene.robot.holds {
            Some(held) => format!("it holds {}", the(held)),
            None => "its hand is empty".to_owned(),
        };
        match self {
            Refusal::NoneHere(kind) => format!("there is no {kind} here"),
            Refusal::InHand(index) => format!("the robot already holds {}", the(index)),
            Refusal::HandFull(held) => {
                format!("the robot's hand is full: it holds {}; put that down first", the(held))
            }
            Refusal::NotPickupable(kind) => format!("{} cannot be picked up", a(kind.name())),
            Refusal::OutOfReach(index) => {
                let whereabouts = match scene.object(index).parent {
                    Some(place) => {
                        let on = preposition(scene.object(place).kind);
                        format!(" (it is {on} {})", the(place))
                    }
                    None => String::new(),
                };
                format!("{} is out of reach{whereabouts}; go there first", the(index))
            }
            Refusal::ShutIn(index, around) => {
                let around = the(around);
                format!("{} is in {around}, which is closed; open it first", the(index))
            }
            Refusal::NotOpenable(kind) => format!("{} cannot be opened or closed", a(kind.name())),
            Refusal::AlreadyOpen(index) => format!("{} is already open", the(index)),
            Refusal::AlreadyClosed(index) => format!("{} is already closed", the(index)),
            Refusal::Running(index) => format!("{} is running; turn it off first", the(index)),
            Refusal::DoorOpen(index) => {
                format!("{} does not start while it is open; close it first", the(index))
            }
            Refusal::NotToggleable(kind) => {
                format!("{} cannot be turned on or off", a(kind.name()))
            }
            Refusal::NotHeld(kind) => format!("the robot does not hold {}: {hand}", a(kind.name())),
            Refusal::OtherHeld(index) => {
                format!("the robot does not hold {}: {hand}", the(index))
            }
            Refusal::NoReceptacle(kind) => {
                format!("nothing can be put in or on {}", a(kind.name()))
            }
            Refusal::DoesNotGo(thing, place) => does_not_go(thing, place),
            Refusal::IntoItself(index) => {
                format!("{} cannot be put into itself; the robot holds it", the(index))
            }
            Refusal::Shut(index) => format!("{} is closed; open it first", the(index)),
        }
    }
}

impl Refusal {
    /// Whether what `action` is for holds already.
    pub(crate) fn holds_already(self, scene: &Scene, action: Action) -> bool {
        match (self, action) {
            (Refusal::AlreadyOpen(_) | Refusal::AlreadyClosed(_), _) => true,
            (Refusal::InHand(held), Action::Pickup(kind) | Action::Goto(kind)) => {
                scene.object(held).kind == kind
            }
            // It was put there before, and is not in the hand any more.
            (Refusal::NotHeld(thing), Action::Put(_, place)) => {
                scene.robot.holds.is_none()
                    && scene.of(thing).all(|index| {
                        let around = scene.object(index).parent;
                        around.is_some_and(|around| scene.object(around).kind == place)
                    })
            }
            _ => false,
        }
    }

    /// The one action that is missing before this one, where one is enough, and the instance for
    /// it: none unless the refused thing was chosen.
    pub(crate) fn first(self, scene: &Scene, chosen: Chosen) -> Option<(Action, Option<Index>)> {
        let kind = |index: Index| scene.object(index).kind;
        let (action, refused, target) = match self {
            Refusal::OutOfReach(index) => (Action::Goto(kind(index)), index, index),
            Refusal::ShutIn(index, around) => (Action::Open(kind(around)), index, around),
            Refusal::Shut(index) => (Action::Open(kind(index)), index, index),
            _ => return None,
        };
        // A free argument stays free, so that the step binds as it does without chosen things.
        Some((action, chosen.contains(&Some(refused)).then_some(target)))
    }
}

/// "in" the fridge, "on" the table.
pub(super) fn preposition(place: Kind) -> &'static str {
    if place.inside() { "in" } else { "on" }
}

/// "a Mug does not go on a Sofa".
pub(super) fn does_not_go(thing: Kind, place: Kind) -> String {
    format!("{} does not go {} {}", a(thing.name()), preposition(place), a(place.name()))
}
