//! From what is to be asked for to words.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use apprentice::language::Symbol;
use apprentice::numerics::Rng;
use apprentice::world::household::{Household, Kind};
use apprentice::world::{Edition, Lexicon, Words as _};

use super::parts::Unit;
use super::teacher::{Share, Teacher};

/// Letters of a word that a slip of the fingers is noticed in.
const TYPO_LETTERS_MIN: usize = 4;

/// What things are called.
pub struct Names<'a> {
    lexicon: &'a Lexicon,
    /// All names that mean a kind before any other, with how often people used them, most used
    /// first.
    all: BTreeMap<Symbol, Vec<(&'a str, u32)>>,
}

/// Names that led the robot to something else.
pub type Shunned = BTreeSet<(Symbol, String)>;

impl<'a> Names<'a> {
    pub fn of(household: &'a Household) -> Names<'a> {
        let lexicon = household.lexicon(Edition::First);
        let mut all: BTreeMap<Symbol, Vec<(&str, u32)>> = BTreeMap::new();
        for (name, meanings) in &lexicon.names {
            if let Some(first) = meanings.first() {
                all.entry(first.kind.clone()).or_default().push((name, first.count));
            }
        }
        all.values_mut().for_each(|names| names.sort_by_key(|(_, count)| Reverse(*count)));
        Names { lexicon, all }
    }

    /// The name that people use most among those that mean this kind first and are not shunned; a
    /// kind without one is called as the robot calls it: `counter top`.
    pub fn plain(&self, kind: &Symbol, shunned: &Shunned) -> String {
        let names = self.all.get(kind).into_iter().flatten();
        let mut good = names.filter(|(name, _)| !is_shunned(shunned, kind, name));
        good.next().map_or_else(|| apart(kind.as_str()), |(name, _)| (*name).to_owned())
    }

    /// Any of its names that is not shunned, each as likely as people use it.
    fn any(&self, kind: &Symbol, shunned: &Shunned, rng: &mut Rng) -> String {
        let names = self.all.get(kind).into_iter().flatten();
        let names = names.filter(|(name, _)| !is_shunned(shunned, kind, name));
        let names: Vec<&(&str, u32)> = names.collect();
        let total: usize = names.iter().map(|(_, count)| *count as usize).sum();
        if total > 0 {
            let mut left = rng.below(total);
            for (name, count) in names {
                match left.checked_sub(*count as usize) {
                    Some(rest) => left = rest,
                    None => return (*name).to_owned(),
                }
            }
        }
        self.plain(kind, shunned)
    }

    fn plural(&self, name: &str) -> String {
        let (before, last) = name.rsplit_once(' ').map_or(("", name), |(b, last)| (b, last));
        // The lexicon also has plurals that people write though they are none: "knifes".
        let regular = format!("{last}s");
        let irregular = self
            .lexicon
            .plurals
            .iter()
            .find(|(plural, singular)| *singular == last && **plural != regular);
        let plural = match irregular {
            Some((plural, _)) => plural.clone(),
            None if ["s", "x", "ch", "sh"].iter().any(|end| last.ends_with(end)) => {
                format!("{last}es")
            }
            None => regular,
        };
        format!("{before} {plural}").trim().to_owned()
    }
}

/// `CounterTop` as words.
fn apart(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

fn is_shunned(shunned: &Shunned, kind: &Symbol, name: &str) -> bool {
    shunned.iter().any(|(k, n)| k == kind && n == name)
}

/// Words, and what they call each thing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    pub text: String,
    pub names: Vec<(Symbol, String)>,
}

/// How things are told apart from others of their type: from the type to words for "the" and its
/// name, with `{name}` where the name stands.
pub type Apart = BTreeMap<Symbol, String>;

/// A wording with names in it.
fn fill(
    wording: &str,
    unit: &Unit,
    apart: &Apart,
    mut name: impl FnMut(&Symbol) -> String,
    plural: impl Fn(&str) -> String,
) -> Words {
    let told = |wording: &str, slot: &str, kind: &Symbol, name: &str| match apart.get(kind) {
        Some(words) => wording.replace(&format!("the {slot}"), &words.replace("{name}", name)),
        None => wording.to_owned(),
    };
    let thing = name(&unit.thing);
    let text = told(wording, "{thing}", &unit.thing, &thing);
    let mut text = text.replace("{things}", &plural(&thing)).replace("{thing}", &thing);
    let mut names = vec![(unit.thing.clone(), thing)];
    if let Some(place) = &unit.place {
        let inside = Kind::named(place.as_str()).is_some_and(Kind::inside);
        let said = name(place);
        text = told(&text, "{place}", place, &said);
        text = text.replace("{place}", &said).replace("{light}", &said);
        text = text.replace("{prep}", if inside { "in" } else { "on" });
        names.push((place.clone(), said));
    }
    if let Some(carrier) = &unit.carrier {
        let said = name(carrier);
        text = text.replace("{carrier}", &said);
        names.push((carrier.clone(), said));
    }
    Words { text, names }
}

/// The words for a unit: a wording of the teacher with names, and perhaps a slip of the fingers.
pub fn say(
    names: &Names<'_>,
    shunned: &Shunned,
    teacher: &Teacher,
    wording: &str,
    unit: &Unit,
    apart: &Apart,
    rng: &mut Rng,
) -> Words {
    let name = |kind: &Symbol| match chance(rng, teacher.other_names) {
        true => names.any(kind, shunned, rng),
        false => names.plain(kind, shunned),
    };
    let mut words = fill(wording, unit, apart, name, |name| names.plural(name));
    if chance(rng, teacher.typos) {
        words.text = slip(&words.text, rng);
    }
    words
}

/// The plainest way to say it.
pub fn say_plainly(names: &Names<'_>, shunned: &Shunned, wording: &str, unit: &Unit) -> Words {
    let name = |kind: &Symbol| names.plain(kind, shunned);
    fill(wording, unit, &Apart::new(), name, |name| names.plural(name))
}

/// Two letters swapped inside one word that is long enough.
fn slip(words: &str, rng: &mut Rng) -> String {
    let mut words: Vec<String> = words.split(' ').map(str::to_owned).collect();
    let long: Vec<usize> =
        (0..words.len()).filter(|at| words[*at].chars().count() >= TYPO_LETTERS_MIN).collect();
    if !long.is_empty() {
        let at = long[rng.below(long.len())];
        let mut letters: Vec<char> = words[at].chars().collect();
        let first = 1 + rng.below(letters.len() - 2);
        letters.swap(first, first + 1);
        words[at] = letters.into_iter().collect();
    }
    words.join(" ")
}

pub fn chance(rng: &mut Rng, share: Share) -> bool {
    rng.below(Share::ONE.0 as usize) < share.0 as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw;
    use crate::participant::parts::{primitive, whole};

    #[test]
    fn names_and_prepositions_are_filled_in() {
        let household = Household::new();
        let names = Names::of(&household);
        let check = |wording: &str, unit: &Unit, expected: &str| {
            assert_eq!(say_plainly(&names, &Shunned::new(), wording, unit).text, expected);
        };
        let put = primitive(&"PUT Mug Fridge".parse().unwrap());
        check("put the {thing} {prep} the {place}", &put, "put the mug in the fridge");
        let two = whole("two ButterKnife CounterTop", &[]).unwrap();
        check("{things} {prep} {place}", &two, "butter knives on counter");
        let nested = whole("nested Egg Bowl DiningTable", &[]).unwrap();
        check("a {carrier} with a {thing}", &nested, "a bowl with a egg");
    }

    #[test]
    fn a_thing_is_told_apart_where_the_wording_has_room() {
        let household = Household::new();
        let names = Names::of(&household);
        let teacher = Teacher::parse(&Teacher::TEXT.replace("typos = 0.01", "typos = 0.0"));
        let put = primitive(&"PUT Mug Cabinet".parse().unwrap());
        let apart = [("Mug", "the other {name}"), ("Cabinet", "{name} 2")];
        let apart: Apart =
            apart.iter().map(|(kind, words)| (Symbol::new(kind), (*words).to_owned())).collect();
        let mut teacher = teacher.unwrap();
        teacher.other_names = Share(0);
        let mut rng = draw::rng(1, &["apart"]);
        let mut check = |wording: &str, expected: &str| {
            let shunned = Shunned::new();
            let words = say(&names, &shunned, &teacher, wording, &put, &apart, &mut rng);
            assert_eq!(words.text, expected);
            assert_eq!(words.names[0].1, "mug");
        };
        check("put the {thing} {prep} the {place}", "put the other mug in cabinet 2");
        check("a {thing}", "a mug");
    }

    #[test]
    fn a_name_that_led_elsewhere_is_not_used_again() {
        let household = Household::new();
        let names = Names::of(&household);
        let put = primitive(&"PUT Mug Shelf".parse().unwrap());
        let mut shunned = Shunned::new();
        let mut used = BTreeSet::new();
        for _ in 0..3 {
            let words = say_plainly(&names, &shunned, "{place}", &put);
            assert_eq!(words.names[1].1, words.text);
            assert!(used.insert(words.text.clone()), "{words:?}");
            shunned.insert((Symbol::new("Shelf"), words.text));
        }
    }

    #[test]
    fn a_slip_swaps_two_letters_inside_a_word() {
        for seed in 0..50 {
            let slipped = slip("go to the counter", &mut draw::rng(seed, &["slip"]));
            assert_ne!(slipped, "go to the counter", "seed {seed}");
            let (mut a, mut b): (Vec<char>, Vec<char>) =
                (slipped.chars().collect(), "go to the counter".chars().collect());
            assert!(slipped.starts_with("go to the c"), "{slipped}");
            a.sort_unstable();
            b.sort_unstable();
            assert_eq!(a, b);
        }
    }
}
