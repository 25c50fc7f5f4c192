//! Questions about the scene and about the robot: how they are known, and what is answered.

use super::intent::{About, Named};
use crate::grounding::{Names, listed};
use crate::language::{Exemplar, LiftedUtterance, Mention, Symbol, Word, WordLists};
use crate::world::{Domain, Lexicon, Thing, View, Words};

/// Words by which a thing is in or on another one.
const WITHIN: [&str; 6] = ["in", "on", "inside", "into", "at", "within"];
/// Words that are left out before "something".
const ARTICLES: [&str; 3] = ["the", "a", "an"];

/// What an answer may draw on beside the scene.
#[derive(Debug, Clone, Copy)]
pub struct Known<'a> {
    /// The exemplars that came with the robot.
    pub seeds: &'a [Exemplar],
    /// The lessons, as the person said them, in the order they were taught.
    pub lessons: &'a [String],
    /// The task as a sentence.
    pub goal: &'a str,
    /// Why the last act was done, as a sentence; none when nothing was done yet.
    pub reason: Option<&'a str>,
    /// The names that the question was read with.
    pub lexicon: &'a Lexicon,
}

/// What an utterance asks about, if it is a question that can be answered.
///
/// - `words`: in lower case, without marks.
/// - `lists`: the recipe's.
pub(super) fn about<D: Words>(
    domain: &D,
    lexicon: &Lexicon,
    lists: &WordLists,
    words: &[&str],
) -> Option<About> {
    let words = without_openers(words);
    let words: Vec<&str> = words.iter().flat_map(|word| contraction(word)).collect();
    let reader = Reader { domain, names: Names::new(lexicon), lists, words: &words };
    let (first, second) = (*words.first()?, words.get(1).copied().unwrap_or_default());
    let has = |any: &[&str]| words.iter().any(|word| any.contains(word));
    let you = has(&["you", "your"]);
    match (first, second) {
        ("help", "") => Some(About::Abilities),
        ("why", _) => Some(About::Reason),
        ("how", "many") => reader.named_from(2).map(|(_, named)| About::Count(named)),
        ("where", "are" | "am") if has(&["you", "i"]) => Some(About::Robot),
        ("where", _) => reader.last_named().map(About::Place),
        ("what" | "which", _) if you && has(&["hold", "holding", "carrying", "hand", "have"]) => {
            Some(About::Hand(None))
        }
        ("what" | "which", _) if has(&["teach", "taught", "learned", "learnt"]) => {
            Some(About::Lessons)
        }
        ("what", _) if has(&["goal", "task"]) || words == ["what", "should", "i", "do"] => {
            Some(About::Goal)
        }
        ("what", "can") if has(&["say", "you"]) && !has(&["see"]) => Some(About::Abilities),
        ("what" | "which", _) => reader.contents().map(About::Contents).or_else(|| {
            let sees = has(&["see"]) || words == ["what", "is", "here"];
            let knows = you && has(&["know", "understand"]);
            match reader.named_from(1) {
                Some((_, named)) if knows => Some(About::Place(named)),
                _ if knows => Some(About::Lessons),
                _ => sees.then_some(About::Sight),
            }
        }),
        ("is" | "are", "there") => match reader.within_from(2) {
            Some((Some(thing), place)) => Some(About::Within(thing, place)),
            Some((None, place)) => Some(About::Contents(place)),
            None => reader.named_from(2).map(|(_, named)| About::Presence(named)),
        },
        ("do", "you") if has(&["see"]) => {
            reader.named_from(2).map(|(_, named)| About::Presence(named))
        }
        ("do" | "are", "you") if has(&["hold", "holding", "have", "carrying"]) => {
            reader.named_from(2).map(|(_, named)| About::Hand(Some(named)))
        }
        ("is" | "are", _) => reader.state(),
        _ => None,
    }
}

/// Takes away what people put before a question.
fn without_openers<'a>(words: &'a [&'a str]) -> &'a [&'a str] {
    const OPENERS: [&[&str]; 9] = [
        &["can", "you", "tell", "me"],
        &["could", "you", "tell", "me"],
        &["please", "tell", "me"],
        &["tell", "me"],
        &["do", "you", "know"],
        &["please"],
        &["robot"],
        &["hey"],
        &["ok"],
    ];
    let opener = OPENERS.into_iter().find(|opener| {
        words.starts_with(opener) && words.get(opener.len()).is_some_and(|next| asks(next))
    });
    opener.map_or(words, |opener| without_openers(&words[opener.len()..]))
}

fn asks(word: &str) -> bool {
    let first = contraction(word).next().unwrap_or_default();
    let question = ["where", "what", "which", "why", "how", "is", "are", "do", "if", "whether"];
    question.contains(&first) || ["please", "robot", "hey", "tell", "can", "could"].contains(&first)
}

/// `what's` → `what`, `is`.
fn contraction(word: &str) -> impl Iterator<Item = &str> {
    let (word, rest) = match word.split_once('\'') {
        Some((word, "s")) => (word, Some("is")),
        Some((word, "re")) => (word, Some("are")),
        _ => (word, None),
    };
    [Some(word), rest].into_iter().flatten()
}

struct Reader<'a, D> {
    domain: &'a D,
    names: Names<'a>,
    lists: &'a WordLists,
    words: &'a [&'a str],
}

impl<D: Words> Reader<'_, D> {
    /// The thing that is named at a place, and where the words behind it begin. What has no name that
    /// is known is the words up to the next one that says where or how.
    fn named_at(&self, at: usize) -> Option<(usize, Named)> {
        let determiners = self.words[at..]
            .iter()
            .take_while(|&&word| self.lists.determiners.contains(word))
            .count();
        let at = at + determiners;
        if let Some((count, mention)) = self.names.starting(&self.words[at..])
            && !mention.pronoun
        {
            return Some((at + count, Named::Known(mention)));
        }
        let ends = |word: &&str| WITHIN.contains(word) || *word == "here" || *word == "there";
        let rest = &self.words[at..];
        let count = rest.iter().position(ends).unwrap_or(rest.len());
        // An article says that a thing is named; without one any word might be meant.
        (determiners > 0 && count > 0)
            .then(|| (at + count, Named::Unknown(rest[..count].join(" "))))
    }

    /// The first thing that is named at or behind a place: one that is known, else one that is not.
    fn named_from(&self, from: usize) -> Option<(usize, Named)> {
        let named: Vec<_> = (from..self.words.len()).filter_map(|at| self.named_at(at)).collect();
        let known = named.iter().find(|(_, named)| matches!(named, Named::Known(_)));
        known.or(named.first()).cloned()
    }

    fn last_named(&self) -> Option<Named> {
        let known = self.named_from(1);
        let word = self.words.last().filter(|_| self.words.len() > 2);
        known.map(|(_, named)| named).or_else(|| {
            word.filter(|word| !["you", "it", "they", "that"].contains(word))
                .map(|word| Named::Unknown((*word).to_owned()))
        })
    }

    /// The thing behind the last "in" or "on".
    fn contents(&self) -> Option<Named> {
        let at = self.words.iter().rposition(|word| WITHIN.contains(word))?;
        self.named_at(at + 1).map(|(_, named)| named)
    }

    /// "…the mug in the sink": the thing, if one is named first, and where.
    fn within_from(&self, from: usize) -> Option<(Option<Named>, Named)> {
        let at = from + self.words[from..].iter().position(|word| WITHIN.contains(word))?;
        let (_, place) = self.named_at(at + 1)?;
        let thing = (from..at).find_map(|start| {
            self.named_at(start).filter(|(end, _)| *end <= at).map(|(_, named)| named)
        });
        Some((thing, place))
    }

    /// "Is the fridge open", "is the mug in the sink".
    fn state(&self) -> Option<About> {
        let (end, named) = self.named_at(1)?;
        match &self.words[end..] {
            [word] if self.domain.is_instance_word(word) => {
                Some(About::State(named, (*word).to_owned()))
            }
            [word, ..] if WITHIN.contains(word) => {
                let (_, place) = self.named_at(end + 1)?;
                Some(About::Within(named, place))
            }
            ["here" | "there"] => Some(About::Presence(named)),
            _ => match named {
                // "Is the dirty light bulb …": the words behind an unknown name are part of it.
                Named::Unknown(words) => {
                    let (thing, word) = words.rsplit_once(' ')?;
                    let is_state = self.domain.is_instance_word(word);
                    is_state
                        .then(|| About::State(Named::Unknown(thing.to_owned()), word.to_owned()))
                }
                Named::Known(_) => None,
            },
        }
    }
}

/// The answer, as one sentence or a few.
pub fn answer<D: Domain>(domain: &D, scene: &D::Scene, about: &About, known: Known<'_>) -> String {
    let view = domain.look(scene);
    let teller = Teller { domain, view: &view, lexicon: known.lexicon };
    match about {
        About::Place(named) => teller.all_of(named, |thing| teller.where_is(thing)),
        About::Presence(named) => teller.presence(named),
        About::Count(named) => teller.count(named),
        About::Contents(named) => teller.all_of(named, |thing| teller.contents(thing)),
        About::State(named, word) => {
            let is = |thing: &Thing| domain.is_as(scene, &thing.name, word).unwrap_or(false);
            teller.all_of(named, |thing| teller.state(thing, word, is(thing)))
        }
        About::Within(thing, place) => teller.within(thing, place),
        About::Hand(named) => teller.hand(named.as_ref()),
        About::Robot => teller.robot(),
        About::Sight => teller.sight(),
        About::Goal => format!("The task is: {}.", known.goal),
        About::Abilities => abilities(known.seeds),
        About::Lessons => lessons(known.lessons),
        About::Reason => match known.reason {
            Some(reason) => reason.to_owned(),
            None => "I have done nothing in this task yet.".to_owned(),
        },
    }
}

struct Teller<'a, D> {
    domain: &'a D,
    view: &'a View,
    lexicon: &'a Lexicon,
}

impl<D: Domain> Teller<'_, D> {
    fn the(&self, name: &str) -> String {
        format!("the {}", self.domain.called(name))
    }

    /// What a name may mean, of the things that are here.
    fn things(&self, mention: &Mention) -> Vec<&Thing> {
        let kinds = mention.types.iter();
        // Some people call a counter top a sink. A question is not about it.
        let kinds = kinds.filter(|kind| !self.lexicon.rarely_means(&mention.surface, kind));
        let of = |kind: &Symbol| {
            let things = self.view.things.iter();
            things.filter(|thing| thing.kind == *kind).collect::<Vec<_>>()
        };
        kinds.flat_map(of).collect()
    }

    /// What is said of each thing that a name fits.
    fn all_of(&self, named: &Named, say: impl Fn(&Thing) -> String) -> String {
        let mention = match named {
            Named::Unknown(word) => return unknown(word),
            Named::Known(mention) => mention,
        };
        let things = self.things(mention);
        if things.is_empty() {
            return format!("There is no {} here.", mention.surface);
        }
        things.into_iter().map(|thing| sentence(&say(thing))).collect::<Vec<_>>().join(" ")
    }

    fn where_is(&self, thing: &Thing) -> String {
        let name = self.the(&thing.name);
        if is(thing, "held") {
            return format!("I hold {name}");
        }
        match &thing.place {
            Some(place) => format!("{name} is {}", self.at(place)),
            None if is(thing, "here") => format!("{name} is here: I stand at it"),
            None => format!("{name} is in the room"),
        }
    }

    /// `in the sink basin`.
    fn at(&self, place: &str) -> String {
        let kind = self.view.things.iter().find(|thing| thing.name == place);
        let preposition = kind.map_or("on", |thing| self.domain.preposition(&thing.kind));
        format!("{preposition} {}", self.the(place))
    }

    fn contents(&self, thing: &Thing) -> String {
        let inside = self.view.things.iter().filter(|it| it.place.as_ref() == Some(&thing.name));
        let names: Vec<String> = inside.map(|it| self.the(&it.name)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let place = self.at(&thing.name);
        match names.len() {
            0 => format!("nothing is {place}"),
            1 => format!("{} is {place}", names[0]),
            _ => format!("{} are {place}", listed(&names, "and")),
        }
    }

    fn state(&self, thing: &Thing, word: &str, holds: bool) -> String {
        let name = self.the(&thing.name);
        match holds {
            true => format!("yes, {name} is {word}"),
            false => format!("no, {name} is not {word}"),
        }
    }

    fn presence(&self, named: &Named) -> String {
        match named {
            Named::Known(mention) if !self.things(mention).is_empty() => {
                format!("Yes. {}", self.all_of(named, |thing| self.where_is(thing)))
            }
            Named::Known(mention) => format!("No, there is no {} here.", mention.surface),
            Named::Unknown(word) => unknown(word),
        }
    }

    fn count(&self, named: &Named) -> String {
        match named {
            Named::Known(mention) => match self.things(mention).len() {
                0 => format!("There is no {} here.", mention.surface),
                1 => format!("There is one. {}", self.all_of(named, |it| self.where_is(it))),
                n => format!("There are {n}. {}", self.all_of(named, |it| self.where_is(it))),
            },
            Named::Unknown(word) => unknown(word),
        }
    }

    fn within(&self, thing: &Named, place: &Named) -> String {
        let (thing, place) = match (thing, place) {
            (Named::Known(thing), Named::Known(place)) => (thing, place),
            (Named::Unknown(word), _) | (_, Named::Unknown(word)) => return unknown(word),
        };
        let (things, places) = (self.things(thing), self.things(place));
        if things.is_empty() || places.is_empty() {
            let missing = if things.is_empty() { thing } else { place };
            return format!("There is no {} here.", missing.surface);
        }
        let inside =
            |it: &&&Thing| places.iter().any(|place| it.place.as_ref() == Some(&place.name));
        match things.iter().find(inside) {
            Some(it) => sentence(&format!("yes, {}", self.where_is(it))),
            None => {
                let told = things.iter().map(|it| sentence(&self.where_is(it)));
                format!("No. {}", told.collect::<Vec<_>>().join(" "))
            }
        }
    }

    fn hand(&self, asked: Option<&Named>) -> String {
        let held = self.view.things.iter().find(|thing| is(thing, "held"));
        let told = match held {
            Some(thing) => format!("I hold {}.", self.the(&thing.name)),
            None => "My hand is empty.".to_owned(),
        };
        match asked {
            None => told,
            Some(Named::Unknown(word)) => unknown(word),
            Some(Named::Known(mention)) => {
                let yes = held.is_some_and(|thing| mention.types.contains(&thing.kind));
                format!("{}. {told}", if yes { "Yes" } else { "No" })
            }
        }
    }

    fn robot(&self) -> String {
        let here = self.view.things.iter().find(|it| is(it, "here") && it.place.is_none());
        match here {
            Some(thing) => format!("I stand at {}.", self.the(&thing.name)),
            None => "I stand in the room.".to_owned(),
        }
    }

    fn sight(&self) -> String {
        let names: Vec<String> =
            self.view.things.iter().map(|thing| self.domain.called(&thing.name)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        format!("I see: {}.", listed(&names, "and"))
    }
}

fn is(thing: &Thing, state: &str) -> bool {
    thing.states.iter().any(|it| it == state)
}

fn unknown(word: &str) -> String {
    format!("I don't know \"{word}\".")
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first: String = letters.next().iter().flat_map(|first| first.to_uppercase()).collect();
    format!("{first}{}.", letters.as_str())
}

/// One request for each operator, of those that the robot came with.
fn abilities(seeds: &[Exemplar]) -> String {
    let mut operators: Vec<&Symbol> = Vec::new();
    let mut shown: Vec<String> = Vec::new();
    for seed in seeds {
        let [step] = &seed.program.steps[..] else { continue };
        if !operators.contains(&&step.operator) {
            operators.push(&step.operator);
            shown.push(format!("\"{}\"", in_words(&seed.utterance)));
        }
    }
    let shown: Vec<&str> = shown.iter().map(String::as_str).collect();
    format!(
        "I understand {}. When I don't understand something, do it in small steps, then teach me.",
        listed(&shown, "and")
    )
}

fn lessons(lessons: &[String]) -> String {
    let shown: Vec<String> = lessons.iter().map(|said| format!("\"{said}\"")).collect();
    let shown: Vec<&str> = shown.iter().map(String::as_str).collect();
    match shown.len() {
        0 => "You taught me nothing yet.".to_owned(),
        _ => format!("You taught me {}.", listed(&shown, "and")),
    }
}

/// `put <obj> in <obj=sink>` → `put something in something`.
pub fn in_words(lifted: &LiftedUtterance) -> String {
    let mut words: Vec<&str> = Vec::new();
    for word in &lifted.words {
        match word {
            Word::Text(text) => words.push(text),
            Word::Slot { .. } => {
                words.pop_if(|before| ARTICLES.contains(before));
                words.push("something");
            }
        }
    }
    words.join(" ")
}
