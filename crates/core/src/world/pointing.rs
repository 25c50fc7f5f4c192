use crate::language::Symbol;

/// What words say about which instance of a type is meant. Read from an utterance; every value is
/// legal, whatever the scene.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pointing {
    /// 1-based, as the view numbers them: "mug 2".
    pub number: Option<u32>,
    /// 1-based, of "the second mug". Where there is only one such thing and it cannot be carried,
    /// as in "the second shelf", the word may count parts of it and chooses nothing.
    pub ordinal: Option<u32>,
    /// How to choose where the scene does not tell. If true, a state word of which the scene says
    /// nothing fits no thing, and a place chooses even where there is only one thing of the type.
    pub strictly: bool,
    /// "the last mug".
    pub last_of_all: bool,
    /// The words before the name, in order: "dirty", "red", "big". Those that the world does not
    /// know ([`crate::world::Words::is_instance_word`]) choose nothing.
    pub words: Vec<String>,
    /// The types that the thing may be in or on, for "the mug ON THE TABLE", "FROM the counter",
    /// "in the fridge". None when no place was said.
    pub place: Option<Vec<Symbol>>,
    /// "the mug here": what the robot can reach without walking.
    pub here: bool,
    /// Names of the instances that the robot handled, newest first, of any type. "other" leaves
    /// them out, and "same" means the newest. Names that are not in the scene are ignored.
    pub handled: Vec<String>,
    /// "the other mug", "another mug".
    pub other: bool,
    /// "the same mug".
    pub same: bool,
}
