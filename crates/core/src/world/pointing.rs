use crate::language::Symbol;

/// What words say about which instance of a type is meant. Read from an utterance; every value is
/// legal, whatever the scene.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pointing {
    /// 1-based, as the view numbers them: "mug 2".
    pub number: Option<u32>,
    /// The same of "the second mug". Of one thing that cannot be carried away it may count parts, as
    /// in "the second shelf", and says nothing.
    pub ordinal: Option<u32>,
    /// Whether a state that nothing is known of is one that nothing is in, and whether a place counts
    /// for one thing alone.
    pub strictly: bool,
    /// "the last mug".
    pub last_of_all: bool,
    /// The words before the name, in order: "dirty", "red", "big". Those that the world does not
    /// know ([`crate::world::Domain::is_instance_word`]) choose nothing.
    pub words: Vec<String>,
    /// The types that the thing may be in or on, for "the mug ON THE TABLE", "FROM the counter",
    /// "in the fridge". Without any, as if nothing was said.
    pub place: Option<Vec<Symbol>>,
    /// "the mug here": what the robot can reach without walking.
    pub here: bool,
    /// Names of the instances that the robot handled, newest first, of any type. "other" leaves
    /// them out and "same" means the newest. Names that the scene does not have are not looked at.
    pub handled: Vec<String>,
    /// "the other mug", "another mug".
    pub other: bool,
    /// "the same mug".
    pub same: bool,
}
