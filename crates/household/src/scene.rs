use super::facts::{Kind, Room};
use crate::ids::Digest;
use crate::limits::SCENE_OBJECTS_MAX;

/// The state of a room at one moment: its things and the robot.
///
/// Flat and without pointers, so that a clone copies about ten bytes per thing. Lengths are
/// centimetres from the room's south-west corner. Serialised with names (`scene_text.rs`); reading
/// checks what it reads.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Scene {
    pub(super) room: Room,
    pub(super) robot: Robot,
    pub(super) objects: Vec<Object>,
}

/// Index of an object in its scene; the order of a scene's objects never changes.
pub(super) type Index = u16;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Robot {
    /// Centimetres to the east.
    pub x: i16,
    /// Centimetres to the north.
    pub y: i16,
    /// The free-standing thing it stands at. Everything in and on that thing is in reach.
    pub at: Option<Index>,
    /// What it holds.
    pub holds: Option<Index>,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Object {
    /// What it is.
    pub kind: Kind,
    /// Bits of [`State`].
    pub states: u8,
    /// Centimetres to the east. 0 for a thing in the hand and all that it contains: they are where
    /// the robot is ([`Scene::place`]).
    pub x: i16,
    /// Centimetres to the north; 0 where `x` is 0 for the hand.
    pub y: i16,
    /// What it is in or on; none for what stands on the floor or is in the hand.
    pub parent: Option<Index>,
}

/// A state that a thing can be in, with its bit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(super) enum State {
    /// Its door is open.
    Open = 1,
    /// It is turned on.
    On = 2,
    /// It needs washing.
    Dirty = 4,
    /// It was heated, and not cooled since.
    Hot = 8,
    /// It was cooled, and not heated since.
    Cold = 16,
}

impl State {
    /// In the order of their bits.
    pub(crate) const ALL: [State; 5] =
        [State::Open, State::On, State::Dirty, State::Hot, State::Cold];

    /// In sentences: `open`.
    pub(crate) fn word(self) -> &'static str {
        match self {
            State::Open => "open",
            State::On => "on",
            State::Dirty => "dirty",
            State::Hot => "hot",
            State::Cold => "cold",
        }
    }

    /// Whether a thing of this kind can be in this state. Anything that fits a fridge or a
    /// microwave may become cold or hot there.
    pub(crate) fn fits(self, kind: Kind) -> bool {
        match self {
            State::Open => kind.openable(),
            State::On => kind.toggleable(),
            State::Dirty => kind.cleanable(),
            State::Hot | State::Cold => kind.pickupable(),
        }
    }
}

impl Object {
    /// Whether it is in this state.
    pub(crate) fn is(&self, state: State) -> bool {
        self.states & state as u8 != 0
    }

    /// Brings it into this state, or out of it.
    pub(crate) fn set(&mut self, state: State, holds: bool) {
        match holds {
            true => self.states |= state as u8,
            false => self.states &= !(state as u8),
        }
    }

    /// Whether it is shut, so that nothing gets in or out.
    pub(crate) fn shut(&self) -> bool {
        self.kind.openable() && !self.is(State::Open)
    }
}

impl Scene {
    /// The kind of room.
    pub fn room(&self) -> Room {
        self.room
    }

    pub(super) fn object(&self, index: Index) -> &Object {
        &self.objects[usize::from(index)]
    }

    pub(super) fn object_mut(&mut self, index: Index) -> &mut Object {
        &mut self.objects[usize::from(index)]
    }

    /// All things of a kind, in order.
    pub(super) fn of(&self, kind: Kind) -> impl Iterator<Item = Index> {
        let numbered = self.objects.iter().enumerate();
        numbered.filter(move |(_, o)| o.kind == kind).map(|(index, _)| index as Index)
    }

    /// What the thing is in or on, what that is in or on, and so on.
    pub(super) fn ancestors(&self, index: Index) -> impl Iterator<Item = Index> {
        std::iter::successors(self.object(index).parent, |&i| self.object(i).parent)
    }

    /// The free-standing (or held) thing that this one is in or on, directly or through others; the
    /// thing itself when it stands free.
    pub(super) fn root(&self, index: Index) -> Index {
        self.ancestors(index).last().unwrap_or(index)
    }

    /// Whether the robot can touch it without walking.
    pub(super) fn in_reach(&self, index: Index) -> bool {
        let root = Some(self.root(index));
        root == self.robot.at || root == self.robot.holds
    }

    /// The shut thing nearest around it, if any.
    pub(super) fn shut_in(&self, index: Index) -> Option<Index> {
        self.ancestors(index).find(|&i| self.object(i).shut())
    }

    pub(super) fn is_held(&self, index: Index) -> bool {
        self.robot.holds == Some(index)
    }

    /// Where the thing is; in or on what the robot holds, that is where the robot is.
    pub(super) fn place(&self, index: Index) -> (i16, i16) {
        match Some(self.root(index)) == self.robot.holds {
            true => (self.robot.x, self.robot.y),
            false => (self.object(index).x, self.object(index).y),
        }
    }

    /// How far the thing is, in square centimetres: to its [`Scene::root`] (0 for what is in
    /// reach), then to the thing itself. Integers, so equal on every machine.
    pub(super) fn distance(&self, index: Index) -> (i64, i64) {
        let square = |(x, y): (i16, i16)| {
            let dx = i64::from(x) - i64::from(self.robot.x);
            let dy = i64::from(y) - i64::from(self.robot.y);
            dx * dx + dy * dy
        };
        match self.in_reach(index) {
            true => (0, square(self.place(index))),
            false => (square(self.place(self.root(index))), square(self.place(index))),
        }
    }

    /// `Mug`, or `Mug 2` when the scene has several.
    pub(super) fn name(&self, index: Index) -> String {
        let kind = self.object(index).kind;
        match self.of(kind).count() {
            1 => kind.name().to_owned(),
            _ => {
                let number = self.of(kind).take_while(|&i| i <= index).count();
                format!("{kind} {number}")
            }
        }
    }

    /// The thing with exactly the name that [`Scene::name`] gives it.
    pub(super) fn named(&self, name: &str) -> Option<Index> {
        let (kind, number) = match name.split_once(' ') {
            Some((kind, number)) => (kind, number.parse::<usize>().ok()?),
            None => (name, 1),
        };
        let index = self.of(Kind::named(kind)?).nth(number.checked_sub(1)?)?;
        // With several mugs, "Mug" names none of them. With one, "Mug 1" and "Mug 02" do not name
        // it.
        (self.name(index) == name).then_some(index)
    }

    /// BLAKE3 over a fixed binary form: room, robot, number of things, eight bytes per thing.
    /// Absent indices are 0xffff; integers are big-endian.
    pub fn digest(&self) -> Digest {
        const HEAD: usize = 12;
        const EACH: usize = 8;
        let mut bytes = [0; HEAD + EACH * SCENE_OBJECTS_MAX];
        let index = |index: Option<Index>| index.unwrap_or(Index::MAX).to_be_bytes();
        bytes[0] = 1;
        bytes[1] = self.room as u8;
        bytes[2..4].copy_from_slice(&self.robot.x.to_be_bytes());
        bytes[4..6].copy_from_slice(&self.robot.y.to_be_bytes());
        bytes[6..8].copy_from_slice(&index(self.robot.at));
        bytes[8..10].copy_from_slice(&index(self.robot.holds));
        bytes[10..12].copy_from_slice(&(self.objects.len() as u16).to_be_bytes());
        let length = HEAD + EACH * self.objects.len();
        for (object, out) in self.objects.iter().zip(bytes[HEAD..].chunks_exact_mut(EACH)) {
            out[0] = object.kind.0;
            out[1] = object.states;
            out[2..4].copy_from_slice(&object.x.to_be_bytes());
            out[4..6].copy_from_slice(&object.y.to_be_bytes());
            out[6..8].copy_from_slice(&index(object.parent));
        }
        Digest::of(&bytes[..length])
    }
}
