use super::{Clause, Word, WordLists};

/// Finds where clauses begin and which word is a clause's verb, by single words alone.
#[derive(Debug, Clone, Copy)]
pub struct Grammar<'a> {
    /// The recipe's lists.
    pub lists: &'a WordLists,
    /// The lexicon's adjectives. None of them is ever a verb.
    pub adjectives: &'a [String],
}

/// The main verb of a clause.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Verb {
    /// Its base form.
    pub word: String,
    /// The particle that belongs to it; empty for none.
    pub particle: String,
    /// Its place among the clause's lifted words; 0-based.
    pub at: usize,
}

/// How far behind its verb a particle may stand.
const PARTICLE_WITHIN: usize = 5;

impl Grammar<'_> {
    /// Whether the word is an adjective of the lexicon.
    pub fn is_adjective(&self, word: &str) -> bool {
        self.adjectives.iter().any(|adjective| adjective == word)
    }

    /// The first word that may be a verb; none in a clause of names and function words.
    pub fn main_verb(&self, words: &[Word]) -> Option<Verb> {
        let lists = self.lists;
        let passed = |word: &str| {
            [&lists.silent, &lists.adverbs, &lists.particles, &lists.stop]
                .iter()
                .any(|list| list.contains(word))
                || self.is_adjective(word)
                || word.bytes().all(|byte| byte.is_ascii_digit())
        };
        let (at, verb) = words.iter().enumerate().find_map(|(at, word)| match word {
            Word::Text(text) if !passed(text) => Some((at, text)),
            _ => None,
        })?;
        let mut particle = String::new();
        for word in words[at + 1..].iter().take(PARTICLE_WITHIN) {
            let Word::Text(text) = word else { continue };
            if lists.verb_particles.contains(text) {
                particle.clone_from(text);
                break;
            }
            let function = lists.stop.contains(text);
            if function && !lists.silent.contains(text) && !lists.determiners.contains(text) {
                break;
            }
        }
        Some(Verb { word: lists.base(verb), particle, at })
    }

    /// The clauses of an utterance. It is cut at marks and joining words where a verb follows, so
    /// "on the left" and "and the spoon" never begin a clause. Phrases that only describe a state
    /// ("while holding the card") are left out.
    pub fn cut(&self, whole: &Clause) -> Vec<Clause> {
        let lists = self.lists;
        let words = &whole.lifted.words;
        let text = |at: usize| match words.get(at) {
            Some(Word::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        let mut parts: Vec<Vec<usize>> = vec![Vec::new()];
        let mut at = 0;
        while at < words.len() {
            let marked = whole.marks.contains(&at);
            let joined = text(at).is_some_and(|word| lists.cuts.contains(word));
            if marked || joined {
                let joins =
                    |word: &str| lists.joints.contains(word) || lists.adverbs.contains(word);
                let skipped = (at..words.len()).take_while(|&i| text(i).is_some_and(joins)).count();
                let ahead = at + skipped;
                if ahead >= words.len() {
                    break;
                }
                if self.is_verb(whole, ahead) {
                    if parts.last().is_some_and(|part| !part.is_empty()) {
                        parts.push(Vec::new());
                    }
                    at = ahead;
                }
            }
            parts.last_mut().expect("there is a first part").push(at);
            at += 1;
        }
        parts.retain(|part| !part.is_empty());
        let stands = |part: &Vec<usize>| {
            part.first().and_then(|&at| text(at)).is_some_and(|word| lists.standing.contains(word))
        };
        if parts.iter().any(|part| !stands(part)) {
            parts.retain(|part| !stands(part));
        }
        parts.iter().map(|part| whole.pick(part)).collect()
    }

    fn is_verb(&self, clause: &Clause, at: usize) -> bool {
        let lists = self.lists;
        let words = &clause.lifted.words;
        let Some(Word::Text(word)) = words.get(at) else { return false };
        if !word.chars().all(char::is_alphabetic) {
            return false;
        }
        let after = words.get(at + 1);
        let determined =
            matches!(after, Some(Word::Text(next)) if lists.determiners.contains(next));
        let named = matches!(after, Some(Word::Slot { .. }));
        if lists.noun_verbs.contains(word) {
            let goes_on =
                matches!(after, Some(Word::Text(next)) if lists.carrying_on.contains(next));
            return named || determined || goes_on;
        }
        if lists.verbs.contains(word) || (word.ends_with("ing") && word.len() > 5) {
            return true;
        }
        let unknown = !lists.stop.contains(word)
            && !lists.determiners.contains(word)
            && !self.is_adjective(word);
        let slots_before = words[..=at].iter().filter(|w| matches!(w, Word::Slot { .. })).count();
        let pronoun =
            named && clause.mentions.get(slots_before).is_some_and(|mention| mention.pronoun);
        unknown && (determined || pronoun)
    }
}
