use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

use serde::Deserialize;

use super::words::nearest_word;
use crate::language::Symbol;

/// A kind of thing: `Mug`, `Fridge`. An index into the table of kinds, in the order of the numbers
/// of `data/types.toml`. The number of a kind never changes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Kind(pub(super) u8);

/// What is true of a kind. See `data/types.toml`.
#[derive(Debug)]
pub(super) struct KindFacts {
    /// The name: `Mug`.
    pub symbol: Symbol,
    /// In a sentence: `coffee table`.
    pub said: String,
    flags: u16,
    /// Bit `n` is set when the kind with index `n` usually holds this kind.
    goes_in: u128,
    /// Bit `n` is set when this fixed kind may stand on or at the kind with index `n`.
    stands_on: u128,
}

/// What can be true of a kind; the number is the bit.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Flag {
    Pickupable,
    Receptacle,
    Surface,
    Inside,
    Central,
    Openable,
    UsuallyOpen,
    Toggleable,
    Light,
    Heatable,
    Coolable,
    Cleanable,
}

/// One of the four kinds of rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Room {
    /// Food is kept, heated and cooled here.
    Kitchen,
    /// People sit here.
    LivingRoom,
    /// People sleep here.
    Bedroom,
    /// People wash here.
    Bathroom,
}

/// What stands where in a room, from the recorded scenes of that room.
#[derive(Debug)]
pub(super) struct RoomFacts {
    /// Centimetres: east, north.
    pub size: (i16, i16),
    /// How many scenes were recorded.
    pub scenes: u32,
    /// In the order of their names.
    pub things: Vec<RoomThing>,
    /// Tasks that make sense here, by form.
    pub tasks: BTreeMap<String, Vec<String>>,
}

#[derive(Debug)]
pub(super) struct RoomThing {
    /// What it is.
    pub kind: Kind,
    /// Recorded scenes that have it.
    pub in_scenes: u32,
    /// How many there are: from, to.
    pub count: (u32, u32),
    /// Where they were recorded, each with the number of times.
    pub places: Vec<(Kind, u32)>,
}

/// All facts of the household.
#[derive(Debug)]
pub(super) struct Facts {
    /// In the order of their numbers.
    pub kinds: Vec<KindFacts>,
    by_name: BTreeMap<String, Kind>,
    rooms: [RoomFacts; 4],
    /// What heats.
    pub microwave: Kind,
    /// What cools.
    pub fridge: Kind,
    /// Where water washes.
    pub sink: Kind,
    /// What makes water run.
    pub faucet: Kind,
}

/// The facts, read once per process from the embedded tables.
pub(super) fn facts() -> &'static Facts {
    static FACTS: LazyLock<Facts> = LazyLock::new(Facts::read);
    &FACTS
}

#[derive(Deserialize)]
struct TypeEntry {
    number: u8,
    flags: Vec<Flag>,
    #[serde(default)]
    goes_in: Vec<String>,
    #[serde(default)]
    stands_on: Vec<String>,
}

#[derive(Deserialize)]
struct RoomEntry {
    scenes: u32,
    size_cm: (i16, i16),
    things: BTreeMap<String, ThingEntry>,
}

#[derive(Deserialize)]
struct ThingEntry {
    in_scenes: u32,
    count: (u32, u32),
    #[serde(default)]
    places: BTreeMap<String, u32>,
}

#[derive(Deserialize)]
struct TaskEntry {
    tasks: Vec<String>,
}

impl Facts {
    fn read() -> Facts {
        let types: BTreeMap<String, TypeEntry> =
            embedded("types.toml", include_str!("../data/types.toml"));
        let rooms: BTreeMap<String, RoomEntry> =
            embedded("rooms.toml", include_str!("../data/rooms.toml"));
        let mut tasks: BTreeMap<String, BTreeMap<String, TaskEntry>> =
            embedded("tasks.toml", include_str!("../data/tasks.toml"));

        let mut ordered: Vec<(&String, &TypeEntry)> = types.iter().collect();
        ordered.sort_by_key(|(_, entry)| entry.number);
        let dense = ordered.iter().enumerate().all(|(i, (_, e))| usize::from(e.number) == i + 1);
        assert!(dense && ordered.len() <= 128, "types.toml numbers its kinds 1, 2, 3, …, 128");
        let by_name: BTreeMap<String, Kind> =
            ordered.iter().map(|(name, entry)| ((*name).clone(), Kind(entry.number - 1))).collect();
        let kind = |name: &str| *by_name.get(name).expect("tables name only kinds of types.toml");
        let set = |names: &[String]| names.iter().fold(0, |set, name| set | 1 << kind(name).0);
        let kinds = ordered.iter().map(|(name, entry)| KindFacts {
            symbol: Symbol::new(name),
            said: said(name),
            flags: entry.flags.iter().fold(0, |flags, flag| flags | 1 << *flag as u16),
            goes_in: set(&entry.goes_in),
            stands_on: set(&entry.stands_on),
        });
        let room = |room: Room| {
            let entry = rooms.get(room.key()).expect("rooms.toml has the four rooms");
            let things = entry.things.iter().map(|(name, thing)| RoomThing {
                kind: kind(name),
                in_scenes: thing.in_scenes,
                count: thing.count,
                places: thing.places.iter().map(|(place, n)| (kind(place), *n)).collect(),
            });
            (entry.scenes, entry.size_cm, things.collect())
        };
        let rooms = Room::ALL.map(|each| {
            let (scenes, size, things) = room(each);
            let forms = tasks.remove(each.key()).expect("tasks.toml has the four rooms");
            let tasks = forms.into_iter().map(|(form, entry)| (form, entry.tasks)).collect();
            RoomFacts { size, scenes, things, tasks }
        });
        Facts {
            kinds: kinds.collect(),
            rooms,
            microwave: kind("Microwave"),
            fridge: kind("Fridge"),
            sink: kind("SinkBasin"),
            faucet: kind("Faucet"),
            by_name,
        }
    }

    /// The kind with exactly this name.
    pub(crate) fn kind(&self, name: &str) -> Option<Kind> {
        self.by_name.get(name).copied()
    }

    /// The kind with this name in whatever case.
    ///
    /// - errors: a sentence that names the nearest known kind.
    pub(crate) fn find(&self, name: &str) -> Result<Kind, String> {
        if let Some(kind) = self.kind(name) {
            return Ok(kind);
        }
        let found =
            self.kinds.iter().position(|facts| facts.symbol.as_str().eq_ignore_ascii_case(name));
        match found {
            Some(index) => Ok(Kind(index as u8)),
            None => {
                let known = self.kinds.iter().map(|facts| facts.symbol.as_str());
                let near = nearest_word(name, known).expect("there are kinds");
                let short: String = name.chars().take(40).collect();
                Err(format!("there is no kind of thing called {short:?}; the nearest is {near}"))
            }
        }
    }

    /// The facts of a kind of room.
    pub(crate) fn room(&self, room: Room) -> &RoomFacts {
        &self.rooms[room as usize]
    }

    /// All kinds, in the order of their numbers.
    pub(crate) fn all(&self) -> impl Iterator<Item = Kind> {
        (0..self.kinds.len()).map(|index| Kind(index as u8))
    }
}

/// - panics: when an embedded table is broken; the tests read all of them.
pub(super) fn embedded<T: serde::de::DeserializeOwned>(name: &str, text: &str) -> T {
    toml::from_str(text).unwrap_or_else(|error| panic!("crates/household/data/{name}: {error}"))
}

impl Kind {
    pub(super) fn facts(self) -> &'static KindFacts {
        &facts().kinds[usize::from(self.0)]
    }

    /// The kind with exactly this name: `Mug`.
    pub fn named(name: &str) -> Option<Kind> {
        facts().kind(name)
    }

    /// The name as a symbol.
    pub fn symbol(self) -> &'static Symbol {
        &self.facts().symbol
    }

    /// The name: `Mug`.
    pub fn name(self) -> &'static str {
        self.facts().symbol.as_str()
    }

    pub(super) fn said(self) -> &'static str {
        &self.facts().said
    }

    fn has(self, flag: Flag) -> bool {
        self.facts().flags & (1 << flag as u16) != 0
    }

    /// Whether the robot can carry it.
    pub fn pickupable(self) -> bool {
        self.has(Flag::Pickupable)
    }
    /// Whether something can be put in or on it.
    pub fn receptacle(self) -> bool {
        self.has(Flag::Receptacle)
    }
    /// Whether everything that can be carried may be put on it.
    pub fn surface(self) -> bool {
        self.has(Flag::Surface)
    }
    /// Whether things are *in* it, and not *on* it.
    pub fn inside(self) -> bool {
        self.has(Flag::Inside)
    }
    /// Whether it stands in the middle of a room, and not along its walls.
    pub fn central(self) -> bool {
        self.has(Flag::Central)
    }
    /// Whether it opens and closes.
    pub fn openable(self) -> bool {
        self.has(Flag::Openable)
    }
    /// Whether it is open until it is closed.
    pub fn usually_open(self) -> bool {
        self.has(Flag::UsuallyOpen)
    }
    /// Whether it turns on and off.
    pub fn toggleable(self) -> bool {
        self.has(Flag::Toggleable)
    }
    /// Whether it is a lamp that a thing can be looked at under.
    pub fn light(self) -> bool {
        self.has(Flag::Light)
    }
    /// Whether a task may ask for it hot.
    pub fn heatable(self) -> bool {
        self.has(Flag::Heatable)
    }
    /// Whether a task may ask for it cold.
    pub fn coolable(self) -> bool {
        self.has(Flag::Coolable)
    }
    /// Whether it can be dirty, and be washed.
    pub fn cleanable(self) -> bool {
        self.has(Flag::Cleanable)
    }
    /// Whether it is a fixed container with a door. The task word `closed` is about these.
    pub fn has_door(self) -> bool {
        self.openable() && self.receptacle() && !self.pickupable()
    }

    /// Whether it is furniture of which some recorded room has several: drawers, cabinets, shelves.
    pub(super) fn comes_several(self) -> bool {
        let several = |room: &Room| {
            facts().room(*room).things.iter().any(|thing| thing.kind == self && thing.count.1 > 1)
        };
        !self.pickupable() && Room::ALL.iter().any(several)
    }

    /// Whether `item` usually goes in or on this kind.
    pub fn usual_for(self, item: Kind) -> bool {
        item.facts().goes_in & (1 << self.0) != 0
    }

    /// Whether `item` may be put in or on this kind: the usual places and every surface.
    pub fn may_hold(self, item: Kind) -> bool {
        self.usual_for(item) || (self.surface() && item.pickupable())
    }

    /// Whether this fixed kind may stand on or at `other` (a lamp on a desk, a faucet at a sink).
    pub fn may_stand_on(self, other: Kind) -> bool {
        self.facts().stands_on & (1 << other.0) != 0
    }
}

impl fmt::Debug for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Room {
    /// In the order of the tables.
    pub const ALL: [Room; 4] = [Room::Kitchen, Room::LivingRoom, Room::Bedroom, Room::Bathroom];

    /// In files: `living_room`.
    pub fn key(self) -> &'static str {
        match self {
            Room::Kitchen => "kitchen",
            Room::LivingRoom => "living_room",
            Room::Bedroom => "bedroom",
            Room::Bathroom => "bathroom",
        }
    }

    /// In sentences: `living room`.
    pub fn said(self) -> &'static str {
        match self {
            Room::LivingRoom => "living room",
            other => other.key(),
        }
    }

    /// The kinds of things that recorded rooms of this kind have, in a fixed order.
    pub fn kinds(self) -> impl Iterator<Item = Kind> {
        facts().room(self).things.iter().map(|thing| thing.kind)
    }

    /// Reads the key; a blank, a hyphen or nothing may stand for the underscore.
    pub fn read(text: &str) -> Option<Room> {
        let bare = |text: &str| text.to_lowercase().replace(['_', ' ', '-'], "");
        Room::ALL.into_iter().find(|room| bare(room.key()) == bare(text))
    }
}

/// `CoffeeTable` → `coffee table`, with the few names that people say otherwise.
fn said(name: &str) -> String {
    let other = match name {
        "SinkBasin" => "sink",
        "BathtubBasin" => "bathtub",
        "CD" => "CD",
        "TVStand" => "TV stand",
        "KeyChain" => "key chain",
        "BasketBall" => "basketball",
        "Glassbottle" => "glass bottle",
        _ => "",
    };
    if !other.is_empty() {
        return other.to_owned();
    }
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}
