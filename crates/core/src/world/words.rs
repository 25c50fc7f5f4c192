use std::collections::BTreeSet;

use super::{Edition, Lexicon, Pointing, SeedSet, World};
use crate::language::{Mention, Program, Step, Symbol};

/// What the words of people mean in a world, and what they say about a scene.
///
/// No method has a default. A recipe may ask any of them, and an answer such as `true` or `None`
/// says something about the world, so each world gives it itself.
pub trait Words: World {
    /// What things are called in an edition. A world with one edition gives it for all.
    fn lexicon(&self, edition: Edition) -> &Lexicon;

    /// What every user starts with.
    fn seeds(&self) -> &SeedSet;

    /// The types that a mention (no pronoun) may mean in this scene, best first: of the types that
    /// share the name, the one with the closest instance. When none of them is in the scene, the
    /// mention's own order, so that the answer can be "there is no … here".
    ///
    /// - `edition`: of the lexicon that the mention was found with.
    fn resolve(&self, edition: Edition, scene: &Self::Scene, mention: &Mention) -> Vec<Symbol>;

    /// The types of which the scene has at least one thing.
    fn present(&self, scene: &Self::Scene) -> BTreeSet<Symbol>;

    /// The type of what the robot holds; none in a world without a hand.
    fn held(&self, scene: &Self::Scene) -> Option<Symbol>;

    /// The type of what the robot stands at; none in a world without places.
    fn here(&self, scene: &Self::Scene) -> Option<Symbol>;

    /// Whether things of a type can ever be the `place`-th (0-based) argument of the operator,
    /// whatever the scene. Where this is always true, words are never refused for their kind.
    fn fits(&self, operator: &Symbol, place: usize, kind: &Symbol) -> bool;

    /// Whether the words ask for a state change that the scene contradicts ("turn off" what is
    /// off): the 0-based step and a sentence. Asked before the program is run, by recipes that
    /// want it.
    fn contradiction(
        &self,
        scene: &Self::Scene,
        words: &[String],
        program: &Program,
    ) -> Option<(usize, String)>;

    /// Whether the thing that a step would switch is on already; false where the step switches
    /// nothing.
    fn is_on(&self, scene: &Self::Scene, step: &Step) -> bool;

    /// Whether a word names a state, and all things of the type are in the opposite one: "the clean
    /// mug" where all mugs are dirty. False for a word that names no state, without such a thing,
    /// and where nothing is known of one of them.
    fn unlike(&self, scene: &Self::Scene, kind: &Symbol, word: &str) -> bool;

    /// The instance of a type that words choose, by the name that [`Thing::name`] shows: the
    /// nearest of those that fit.
    ///
    /// - returns: none when the words choose nothing: nothing in them is about instances, all
    ///   instances fit, or the world does not know what they say.
    /// - errors: a sentence, when no instance is as the words say: "no Mug here is dirty".
    ///
    /// [`Thing::name`]: super::Thing::name
    fn choose(
        &self,
        scene: &Self::Scene,
        kind: &Symbol,
        pointing: &Pointing,
    ) -> Result<Option<String>, String>;

    /// Whether a word before a name says a state that [`Words::choose`] looks at: "dirty". Some
    /// of these words are also verbs and prepositions ("open", "clean", "on"); ask only about a
    /// word that stands between an article and the name.
    fn is_instance_word(&self, word: &str) -> bool;

    /// Whether a thing is as a word says: "open", "clean".
    ///
    /// - `thing`: its name, as a [`Thing`](super::Thing) shows it.
    /// - returns: none when that is not known, as of a shelf that is to be open, and for a word that
    ///   names no state.
    fn is_as(&self, scene: &Self::Scene, thing: &str, word: &str) -> Option<bool>;

    /// A thing's or a type's name in a person's words: `CounterTop 2` → `counter top 2`.
    fn called(&self, name: &str) -> String;

    /// Whether things are put `in` or `on` things of a type.
    fn preposition(&self, kind: &Symbol) -> &'static str;
}
