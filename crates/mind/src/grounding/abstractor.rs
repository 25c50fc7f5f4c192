use unicode_normalization::UnicodeNormalization;

use super::frames::Framed;
use super::names::Names;
use super::settings::{Abstraction, Split};
use crate::language::{
    Clause, Grammar, Mention, Mood, Utterance, Word, WordLists, is_mark, tokens,
};
use crate::limits::{CLAUSES_MAX, MENTIONS_MAX};
use crate::world::Lexicon;

/// Words that may stand between "from" and a name.
const DETERMINERS: [&str; 9] = ["the", "a", "an", "its", "his", "her", "their", "your", "my"];
/// A name means a fixture if at least so many tenths of its uses do.
const FIXTURE_TENTHS: u32 = 3;
/// Between a name and its number: "mug NUMBER two".
const NUMBER: [&str; 3] = ["number", "no", "nr"];
const NUMBERS: [&str; 6] = ["one", "two", "three", "four", "five", "six"];
/// Begins a phrase that says where a thing is.
const LOCATION: &str = "from";

/// Entity abstraction: finds the mentions in an utterance and puts slots in their places (paper,
/// section 3.1.1).
pub struct Abstractor<'a> {
    lexicon: &'a Lexicon,
    names: Names<'a>,
    settings: &'a Abstraction,
    known: &'a dyn Fn(&str) -> bool,
}

/// An utterance with its mentions found, not yet cut into clauses.
#[derive(Debug, Clone, PartialEq)]
pub struct Abstracted {
    pieces: Vec<Piece>,
    /// The phrases around the request that were removed.
    pub frames: Vec<String>,
    /// Why it is not a request; none for a request.
    pub mood: Option<Mood>,
    /// Words of amount, which no single step can satisfy.
    pub amounts: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Word(String),
    /// `,` `.` or `;`.
    Mark,
    Named {
        mention: Mention,
        /// Dropped words before the name.
        attributes: Vec<String>,
        fixture: Option<String>,
        /// All words of this piece, as said.
        said: Vec<String>,
    },
}

impl<'a> Abstractor<'a> {
    /// - `known`: whether a word is in ordinary use (in the word table); such a word is never read
    ///   as a misspelt name.
    pub fn new(
        lexicon: &'a Lexicon,
        settings: &'a Abstraction,
        known: &'a dyn Fn(&str) -> bool,
    ) -> Abstractor<'a> {
        Abstractor { lexicon, names: Names::new(lexicon), settings, known }
    }

    /// Finds the mentions. From the [`MENTIONS_MAX`]-th on, names stay plain words.
    pub fn read(&self, utterance: &Utterance) -> Abstracted {
        let said = match self.settings.composed {
            true => tokens(&utterance.as_str().nfc().collect::<String>()),
            false => utterance.tokens(),
        };
        let (lists, settings) = (self.settings.lists.as_ref(), self.settings);
        let framed = match &settings.frames {
            Some(frames) => {
                let moods = settings.moods.as_ref();
                let says = |word: &str| moods.is_some_and(|moods| moods.has(word));
                frames.strip(said, lists, &says)
            }
            None => Framed::bare(said),
        };
        let mut framed = framed;
        if let (Some(moods), true) = (&settings.moods, settings.frames.is_some()) {
            moods.strip_reason(&mut framed);
            if let Some(lists) = lists {
                moods.strip_order(&mut framed, lists);
            }
        }
        let judged = settings.moods.as_ref().zip(lists);
        let mood = judged.and_then(|(moods, lists)| moods.of(utterance.as_str(), &framed, lists));
        let amounts =
            judged.map(|(moods, lists)| moods.amounts(&framed.tokens, lists)).unwrap_or_default();
        let Framed { tokens, frames } = framed;
        let tokens = match lists.filter(|_| !settings.verbs.is_empty()) {
            Some(lists) => settings.verbs.rewrite(tokens, lists, self.known),
            None => tokens,
        };
        let pieces = self.pieces(&tokens);
        Abstracted { pieces, frames, mood, amounts }
    }

    fn pieces(&self, tokens: &[String]) -> Vec<Piece> {
        let tokens: Vec<&str> = tokens.iter().map(String::as_str).collect();
        let mut pieces = Vec::with_capacity(tokens.len());
        let mut mentions = 0;
        let mut at = 0;
        while at < tokens.len() {
            let token = tokens[at];
            if is_mark(token) {
                pieces.push(Piece::Mark);
                at += 1;
                continue;
            }
            let ahead = &tokens[at..];
            if self.settings.lists.as_ref().is_some_and(|lists| self.is_verb(lists, &pieces, ahead))
            {
                pieces.push(Piece::Word(token.to_owned()));
                at += 1;
                continue;
            }
            let end = ahead.iter().position(|token| is_mark(token)).unwrap_or(ahead.len());
            match self.mention(&ahead[..end]) {
                Some((count, mention)) if mentions < MENTIONS_MAX => {
                    mentions += 1;
                    let said = ahead[..count].iter().map(|word| (*word).to_owned()).collect();
                    mentions -= self.push_named(&mut pieces, mention, said);
                    at += count;
                    at += self.portions(&tokens[at..]);
                    at += self.number(&tokens[at..], &mut pieces);
                }
                _ => {
                    pieces.push(Piece::Word(token.to_owned()));
                    at += 1;
                }
            }
        }
        pieces
    }

    /// "Mug 2": the number after a name becomes an attribute.
    fn number(&self, behind: &[&str], pieces: &mut [Piece]) -> usize {
        let Some(Piece::Named { mention, attributes, said, .. }) = pieces.last_mut() else {
            return 0;
        };
        let before = usize::from(behind.first().is_some_and(|word| NUMBER.contains(word)));
        let Some(word) = behind.get(before) else { return 0 };
        let spelt =
            (before > 0).then(|| NUMBERS.iter().position(|number| number == word)).flatten();
        let digits = word.bytes().all(|byte| byte.is_ascii_digit()).then(|| (*word).to_owned());
        let number = digits.or(spelt.map(|place| (place + 1).to_string()));
        let Some(number) = number.filter(|_| self.settings.numbers && !mention.pronoun) else {
            return 0;
        };
        attributes.push(number);
        said.extend(behind[..=before].iter().map(|word| (*word).to_owned()));
        before + 1
    }

    /// Whether a name is a verb here: at the beginning of a clause, before an object.
    fn is_verb(&self, lists: &WordLists, pieces: &[Piece], ahead: &[&str]) -> bool {
        let [word, after, ..] = ahead else { return false };
        if !lists.noun_verbs.contains(*word) && !lists.verbs.contains(*word) {
            return false;
        }
        // The longer name counts: "plate" is not a verb in "plate rack".
        if self.names.starting(ahead).is_none_or(|(count, _)| count > 1) {
            return false;
        }
        let determined = lists.determiners.contains(*after)
            || self.lexicon.pronouns.iter().any(|pronoun| pronoun == after);
        match pieces.last() {
            None | Some(Piece::Mark) => determined || self.names.starting(&ahead[1..]).is_some(),
            Some(Piece::Word(before)) => match before.as_str() {
                "and" | "then" | "or" => determined || self.names.starting(&ahead[1..]).is_some(),
                "to" => determined,
                _ => false,
            },
            Some(Piece::Named { .. }) => false,
        }
    }

    /// How many words after a name only say that it is a part: "apple slices".
    fn portions(&self, behind: &[&str]) -> usize {
        let Some(lists) = &self.settings.lists else { return 0 };
        behind.iter().take_while(|word| lists.is_portion(word)).count()
    }

    fn mention(&self, words: &[&str]) -> Option<(usize, Mention)> {
        self.names.starting(words).or_else(|| {
            self.settings.spelling.then(|| self.names.misspelt(words, self.known)).flatten()
        })
    }

    /// - returns: how many mentions before this one were merged into it.
    fn push_named(
        &self,
        pieces: &mut Vec<Piece>,
        mention: Mention,
        mut said: Vec<String>,
    ) -> usize {
        let mut attributes = Vec::new();
        let mut folded = 0;
        let mut take = |words: Vec<String>, attributes: &mut Vec<String>| {
            attributes.splice(0..0, words.iter().cloned());
            said.splice(0..0, words);
        };
        // The first word of a clause is never dropped: it is the verb ("clear table").
        while !mention.pronoun && pieces.len() >= 2 && !opens_clause(&pieces[pieces.len() - 2]) {
            match pieces.last() {
                Some(Piece::Word(word))
                    if self.settings.adjectives && self.lexicon.adjectives.contains(word) =>
                {
                    let word = word.clone();
                    pieces.pop();
                    take(vec![word], &mut attributes);
                }
                Some(Piece::Named { mention: before, said: words, .. })
                    if self.settings.compounds && !before.pronoun =>
                {
                    let words = words.clone();
                    pieces.pop();
                    folded += 1;
                    take(words, &mut attributes);
                }
                _ => break,
            }
        }
        if let Some(part) = self.part_of(pieces).filter(|_| !mention.pronoun) {
            let words = pieces.split_off(part).into_iter().filter_map(|piece| match piece {
                Piece::Word(word) => Some(word),
                _ => None,
            });
            said.splice(0..0, words);
        }
        let fixture = self.fixture(&mention);
        pieces.push(Piece::Named { mention, attributes, fixture, said });
        folded
    }

    /// Where "slice of the" begins, if the pieces end with such words.
    fn part_of(&self, pieces: &[Piece]) -> Option<usize> {
        let lists = self.settings.lists.as_ref()?;
        let word = |at: usize| match pieces.get(at) {
            Some(Piece::Word(word)) => word.as_str(),
            _ => "",
        };
        let determined =
            (0..pieces.len()).rev().take_while(|&at| lists.determiners.contains(word(at))).count();
        let of = (pieces.len() - determined).checked_sub(1)?;
        let part = of.checked_sub(1)?;
        (word(of) == "of" && lists.is_portion(word(part))).then_some(part)
    }

    fn fixture(&self, mention: &Mention) -> Option<String> {
        if !self.settings.fixtures {
            return None;
        }
        let word = |kind| self.lexicon.fixtures.get(kind);
        if self.settings.lists.is_some() {
            return self.usual_fixture(mention);
        }
        let all_fixtures = mention.types.iter().all(|kind| word(kind).is_some());
        mention.types.first().filter(|_| all_fixtures).and_then(word).cloned()
    }

    /// The word of the fixture that a name often means: "sink" is the sink, though some people use
    /// it for other things.
    fn usual_fixture(&self, mention: &Mention) -> Option<String> {
        let meanings = self.lexicon.names.get(&mention.surface)?;
        let all: u32 = meanings.iter().map(|meaning| meaning.count).sum();
        let usual = meanings.iter().filter(|m| m.count * 10 >= all * FIXTURE_TENTHS);
        usual.filter_map(|meaning| self.lexicon.fixtures.get(&meaning.kind)).min().cloned()
    }
}

impl Abstracted {
    /// The utterance as one clause.
    pub fn whole(&self) -> Clause {
        clause(self.pieces.iter())
    }

    /// The clauses between the places where `split` cuts; `None` when there is nothing to cut or
    /// when there would be more than [`CLAUSES_MAX`].
    ///
    /// With [`Split::Verbs`], a single clause is returned too if words were left out: "holding the
    /// card, turn on the lamp".
    pub fn clauses(&self, split: Split, grammar: Option<Grammar<'_>>) -> Option<Vec<Clause>> {
        if let (Split::Verbs, Some(grammar)) = (split, grammar) {
            let whole = self.whole();
            let clauses = grammar.cut(&whole);
            let shorter = clauses.first()?.lifted.words.len() < whole.lifted.words.len();
            return (shorter && clauses.len() <= CLAUSES_MAX).then_some(clauses);
        }
        let parts = self.pieces.split(|piece| cuts(piece, split));
        let clauses: Vec<Clause> = parts
            .filter(|part| part.iter().any(|piece| !matches!(piece, Piece::Mark)))
            .map(|part| clause(part.iter()))
            .collect();
        (2..=CLAUSES_MAX).contains(&clauses.len()).then_some(clauses)
    }
}

/// The clause without `from the <obj>` phrases that come after another mention: "pick up the mug
/// from the table". `None` when it has none.
pub fn without_locations(whole: &Clause) -> Option<Clause> {
    let words = &whole.lifted.words;
    let is_slot = |word: &Word| matches!(word, Word::Slot { .. });
    let mut kept = Clause { words: whole.words.clone(), ..Clause::default() };
    let mut slot = 0;
    let mut at = 0;
    while at < words.len() {
        let opens = |word: &Word| matches!(word, Word::Text(text) if text == LOCATION);
        let determines =
            |word: &&Word| matches!(word, Word::Text(text) if DETERMINERS.contains(&text.as_str()));
        if opens(&words[at]) && !kept.attributes.is_empty() {
            let skipped = words[at + 1..].iter().take_while(determines).count();
            let after = at + 1 + skipped;
            if words.get(after).is_some_and(is_slot) {
                slot += 1;
                at = after + 1;
                continue;
            }
        }
        if is_slot(&words[at]) {
            kept.attributes.push(whole.attributes[slot].clone());
            kept.mentions.extend(whole.mentions.get(slot).cloned());
            slot += 1;
        }
        kept.lifted.words.push(words[at].clone());
        at += 1;
    }
    (kept.lifted.words.len() < words.len()).then_some(kept)
}

fn clause<'p>(pieces: impl Iterator<Item = &'p Piece>) -> Clause {
    let mut out = Clause::default();
    for piece in pieces {
        match piece {
            Piece::Mark => out.marks.push(out.lifted.words.len()),
            Piece::Word(word) => {
                out.lifted.words.push(Word::Text(word.clone()));
                out.words.push(word.clone());
            }
            Piece::Named { mention, attributes, fixture, said } => {
                let (sort, fixture) = (mention.sort.clone(), fixture.clone());
                out.lifted.words.push(Word::Slot { sort, fixture });
                out.words.extend(said.iter().cloned());
                out.attributes.push(attributes.clone());
                out.mentions.push(mention.clone());
            }
        }
    }
    out
}

fn cuts(piece: &Piece, split: Split) -> bool {
    match piece {
        Piece::Word(word) => word == "and" || (split != Split::And && word == "then"),
        Piece::Mark => split != Split::And,
        Piece::Named { .. } => false,
    }
}

/// Whether the next word begins a clause, for every way of cutting.
fn opens_clause(before: &Piece) -> bool {
    cuts(before, Split::Clauses)
}
