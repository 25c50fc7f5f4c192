use super::facts::{Kind, Room, facts};
use super::primitives::spot_on;
use super::refusal::does_not_go;
use super::scene::{Index, Object, Robot, Scene, State};
use super::words::a;
use crate::limits::SCENE_OBJECTS_MAX;

/// Builds a scene thing by thing, checking each against the facts. The generator, the scene file
/// and evaluations all build with it.
///
/// ```
/// use apprentice_household::{Room, SceneBuilder};
/// let mut builder = SceneBuilder::new(Room::Kitchen);
/// let counter = builder.stand("CounterTop")?;
/// let mug = builder.put("Mug", counter)?;
/// builder.soil(mug)?.stand_at(counter);
/// let scene = builder.build();
/// # Ok::<(), apprentice_household::BuildError>(())
/// ```
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    scene: Scene,
    /// Free spots along the walls and in the middle, in the order they are given out.
    along_walls: Vec<(i16, i16)>,
    in_middle: Vec<(i16, i16)>,
    walls_used: usize,
    middle_used: usize,
}

/// A thing of the scene being built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObjectId(pub(super) Index);

/// Why a thing cannot be built: a sentence that names it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BuildError(pub(super) String);

/// Centimetres between neighbours along the walls.
const SPACING: i16 = 60;
/// Centimetres of what stands along a wall from that wall.
const FROM_WALL: i16 = 40;

impl SceneBuilder {
    /// An empty room; the robot stands in its middle with an empty hand.
    pub fn new(room: Room) -> SceneBuilder {
        let (width, depth) = facts().room(room).size;
        let robot = Robot { x: width / 2, y: depth / 2, at: None, holds: None };
        SceneBuilder {
            scene: Scene { room, robot, objects: Vec::new() },
            along_walls: ring(width, depth, FROM_WALL),
            in_middle: ring(width, depth, width.min(depth) / 3),
            walls_used: 0,
            middle_used: 0,
        }
    }

    /// Adds a thing that stands on the floor, at the next free spot.
    ///
    /// - errors: no such kind, or the scene is full.
    pub fn stand(&mut self, kind: &str) -> Result<ObjectId, BuildError> {
        let kind = facts().find(kind).map_err(BuildError)?;
        self.stand_kind(kind)
    }

    pub(super) fn stand_kind(&mut self, kind: Kind) -> Result<ObjectId, BuildError> {
        let (spots, used) = match kind.central() {
            true => (&self.in_middle, &mut self.middle_used),
            false => (&self.along_walls, &mut self.walls_used),
        };
        let (x, y) = spots[*used % spots.len()];
        // Things of a second round are moved by 25 cm, so that no two are at one spot.
        let aside = 25 * (*used / spots.len()) as i16;
        *used += 1;
        self.stand_kind_at(kind, (x.saturating_add(aside), y.saturating_add(aside)))
    }

    pub(super) fn stand_kind_at(
        &mut self,
        kind: Kind,
        (x, y): (i16, i16),
    ) -> Result<ObjectId, BuildError> {
        if self.scene.objects.len() == SCENE_OBJECTS_MAX {
            return Err(BuildError(format!("a scene has at most {SCENE_OBJECTS_MAX} things")));
        }
        let mut object = Object { kind, states: 0, x, y, parent: None };
        object.set(State::Open, kind.usually_open());
        self.scene.objects.push(object);
        Ok(ObjectId(self.scene.objects.len() as Index - 1))
    }

    /// Adds a thing in or on another.
    ///
    /// - errors: no such kind, the scene is full, or it does not go there.
    pub fn put(&mut self, kind: &str, place: ObjectId) -> Result<ObjectId, BuildError> {
        let kind = facts().find(kind).map_err(BuildError)?;
        self.put_kind(kind, place)
    }

    pub(super) fn put_kind(&mut self, kind: Kind, place: ObjectId) -> Result<ObjectId, BuildError> {
        let under = self.scene.object(place.0).kind;
        if !under.may_hold(kind) && !kind.may_stand_on(under) {
            return Err(BuildError(does_not_go(kind, under)));
        }
        let id = self.stand_kind_at(kind, (0, 0))?;
        let (x, y) = spot_on(&self.scene, place.0, id.0);
        let object = self.scene.object_mut(id.0);
        (object.x, object.y, object.parent) = (x, y, Some(place.0));
        Ok(id)
    }

    /// Moves a thing that stands free into or onto another.
    ///
    /// - errors: it does not go there.
    pub(super) fn place_in(&mut self, id: ObjectId, place: ObjectId) -> Result<(), BuildError> {
        let (kind, under) = (self.scene.object(id.0).kind, self.scene.object(place.0).kind);
        let around = self.scene.ancestors(place.0).any(|index| index == id.0);
        if id == place || around || (!under.may_hold(kind) && !kind.may_stand_on(under)) {
            return Err(BuildError(does_not_go(kind, under)));
        }
        self.scene.object_mut(id.0).parent = Some(place.0);
        // Everything in or on it moves too. Things may have been put together in any order.
        for index in 0..self.scene.objects.len() as Index {
            if let Some(parent) = self.scene.object(index).parent {
                let spot = spot_on(&self.scene, parent, index);
                let object = self.scene.object_mut(index);
                (object.x, object.y) = spot;
            }
        }
        Ok(())
    }

    /// Opens it.
    ///
    /// - errors: it does not open.
    pub fn open(&mut self, id: ObjectId) -> Result<&mut SceneBuilder, BuildError> {
        self.set(id, State::Open, true)
    }

    /// Closes it.
    ///
    /// - errors: it does not close.
    pub fn close(&mut self, id: ObjectId) -> Result<&mut SceneBuilder, BuildError> {
        self.set(id, State::Open, false)
    }

    /// Turns it on.
    ///
    /// - errors: it does not turn on.
    pub fn turn_on(&mut self, id: ObjectId) -> Result<&mut SceneBuilder, BuildError> {
        self.set(id, State::On, true)
    }

    /// Makes it dirty.
    ///
    /// - errors: it cannot be washed.
    pub fn soil(&mut self, id: ObjectId) -> Result<&mut SceneBuilder, BuildError> {
        self.set(id, State::Dirty, true)
    }

    pub(super) fn set(
        &mut self,
        id: ObjectId,
        state: State,
        holds: bool,
    ) -> Result<&mut SceneBuilder, BuildError> {
        let object = self.scene.object_mut(id.0);
        if !state.fits(object.kind) {
            let kind = a(object.kind.name());
            return Err(BuildError(format!("{kind} cannot be {}", state.word())));
        }
        object.set(state, holds);
        Ok(self)
    }

    /// Makes the robot stand at a thing, or at the furniture that the thing is in or on.
    pub fn stand_at(&mut self, id: ObjectId) -> &mut SceneBuilder {
        let root = self.scene.root(id.0);
        (self.scene.robot.x, self.scene.robot.y) = self.scene.place(root);
        self.scene.robot.at = Some(root).filter(|root| !self.scene.is_held(*root));
        self
    }

    /// Puts a new thing into the robot's hand.
    ///
    /// - errors: no such kind, the scene is full, it cannot be carried, or the hand is full.
    pub fn hold(&mut self, kind: &str) -> Result<ObjectId, BuildError> {
        let kind = facts().find(kind).map_err(BuildError)?;
        if !kind.pickupable() {
            return Err(BuildError(format!("{} cannot be picked up", a(kind.name()))));
        }
        if let Some(held) = self.scene.robot.holds {
            let (kind, held) = (a(kind.name()), self.scene.name(held));
            return Err(BuildError(format!("the robot cannot hold {kind}: it holds the {held}")));
        }
        let id = self.stand_kind_at(kind, (0, 0))?;
        self.scene.robot.holds = Some(id.0);
        Ok(id)
    }

    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene, with the states that follow from its places (what is in a closed fridge is cold).
    pub fn build(mut self) -> Scene {
        self.scene.settle();
        debug_assert_eq!(self.scene.check(), Ok(()));
        self.scene
    }
}

/// Spots on a rectangle `margin` away from the walls, starting at the south-west corner.
///
/// - lengths: centimetres.
fn ring(width: i16, depth: i16, margin: i16) -> Vec<(i16, i16)> {
    let (east, north) = ((width - margin).max(margin + 1), (depth - margin).max(margin + 1));
    let along = |from: i16, to: i16| (from..to).step_by(SPACING as usize);
    let mut spots: Vec<(i16, i16)> = along(margin, east).map(|x| (x, margin)).collect();
    spots.extend(along(margin, north).map(|y| (east, y)));
    spots.extend(along(margin, east).map(|x| (width - x, north)));
    spots.extend(along(margin, north).map(|y| (margin, depth - y)));
    spots
}
