use super::sentence::Knowledge;
use crate::language::{Verb, Word};

impl Knowledge {
    /// How many words of a clause ask for more than its main verb: another verb that was never
    /// recorded for a primitive ("to chill it", "get it wet"), a second clause without a mark, or a
    /// time to wait.
    ///
    /// A verb counts only where a verb can stand, so "the rinsed mug" and "the wet cloth" do not.
    pub(super) fn unread(&self, words: &[Word], verb: Option<&Verb>) -> usize {
        let text = |at: usize| match words.get(at) {
            Some(Word::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        let slot = |at: usize| matches!(words.get(at), Some(Word::Slot { .. }));
        let lists = &self.lists;
        let counts = |at: &usize| {
            let Some(word) = text(*at) else { return false };
            if lists.lasting.contains(word) {
                return true;
            }
            let noun_too = lists.noun_verbs.contains(word);
            if verb.is_some_and(|verb| verb.at == *at) || *at == 0 {
                return false;
            }
            let before = text(at - 1);
            let described = before.is_some_and(|before| {
                lists.determiners.contains(before) || self.grammar().is_adjective(before)
            });
            if described || !(noun_too || lists.verbs.contains(word)) {
                return false;
            }
            let object =
                slot(at + 1) || text(at + 1).is_some_and(|t| lists.determiners.contains(t));
            let after_thing = slot(at - 1);
            if self.habits.counts(&format!("V:{word}")).is_some() {
                return after_thing && object;
            }
            if self.habits.counts(word).is_some() || lists.moving.contains(word) {
                return false;
            }
            let meant = before.is_some_and(|t| lists.purposes.contains(t));
            let joined = before.is_some_and(|t| lists.joints.contains(t));
            match noun_too {
                true => meant || (object && joined),
                false => meant || joined || object || after_thing,
            }
        };
        (0..words.len()).filter(counts).count()
    }
}
