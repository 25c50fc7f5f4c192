//! From what is to be asked for to words.

use std::collections::BTreeMap;

use super::parts::Unit;
use super::teacher::{Share, Teacher};
use crate::language::Symbol;
use crate::numerics::Rng;
use crate::study::renaming::plain_names;
use crate::world::Domain;
use crate::world::Lexicon;
use crate::world::household::{Household, Kind};

/// Letters of a word that a slip of the fingers is noticed in.
const TYPO_LETTERS_MIN: usize = 4;

/// What things are called.
pub struct Names<'a> {
    lexicon: &'a Lexicon,
    plain: BTreeMap<Symbol, &'a str>,
    /// All names that mean a kind before any other, with how often people used them.
    all: BTreeMap<Symbol, Vec<(&'a str, u32)>>,
}

impl<'a> Names<'a> {
    pub fn of(household: &'a Household) -> Names<'a> {
        let lexicon = household.lexicon();
        let mut all: BTreeMap<Symbol, Vec<(&str, u32)>> = BTreeMap::new();
        for (name, meanings) in &lexicon.names {
            if let Some(first) = meanings.first() {
                all.entry(first.kind.clone()).or_default().push((name, first.count));
            }
        }
        Names { lexicon, plain: plain_names(lexicon), all }
    }

    /// The name that people use most among those that mean this kind first; a kind without one is
    /// called as the robot calls it: `counter top`.
    pub fn plain(&self, kind: &Symbol) -> String {
        match self.plain.get(kind) {
            Some(name) => (*name).to_owned(),
            None => apart(kind.as_str()),
        }
    }

    /// Any of its names, each as likely as people use it.
    fn any(&self, kind: &Symbol, rng: &mut Rng) -> String {
        let Some(names) = self.all.get(kind) else { return self.plain(kind) };
        let total: usize = names.iter().map(|(_, count)| *count as usize).sum();
        if total == 0 {
            return self.plain(kind);
        }
        let mut left = rng.below(total);
        for (name, count) in names {
            match left.checked_sub(*count as usize) {
                Some(rest) => left = rest,
                None => return (*name).to_owned(),
            }
        }
        self.plain(kind)
    }

    fn plural(&self, name: &str) -> String {
        let (before, last) = name.rsplit_once(' ').map_or(("", name), |(b, last)| (b, last));
        let irregular = self.lexicon.plurals.iter().find(|(_, singular)| *singular == last);
        let plural = match irregular {
            Some((plural, _)) => plural.clone(),
            None if ["s", "x", "ch", "sh"].iter().any(|end| last.ends_with(end)) => {
                format!("{last}es")
            }
            None => format!("{last}s"),
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

/// A wording with names in it.
pub fn fill(
    wording: &str,
    unit: &Unit,
    mut name: impl FnMut(&Symbol) -> String,
    plural: impl Fn(&str) -> String,
) -> String {
    let thing = name(&unit.thing);
    let mut words = wording.replace("{things}", &plural(&thing)).replace("{thing}", &thing);
    if let Some(place) = &unit.place {
        let inside = Kind::named(place.as_str()).is_some_and(Kind::inside);
        let said = name(place);
        words = words.replace("{place}", &said).replace("{light}", &said);
        words = words.replace("{prep}", if inside { "in" } else { "on" });
    }
    if let Some(carrier) = &unit.carrier {
        words = words.replace("{carrier}", &name(carrier));
    }
    words
}

/// The words for a unit: a wording of the teacher with names, and perhaps a slip of the fingers.
pub fn say(
    names: &Names<'_>,
    teacher: &Teacher,
    wording: &str,
    unit: &Unit,
    rng: &mut Rng,
) -> String {
    let words = fill(
        wording,
        unit,
        |kind| match chance(rng, teacher.other_names) {
            true => names.any(kind, rng),
            false => names.plain(kind),
        },
        |name| names.plural(name),
    );
    match chance(rng, teacher.typos) {
        true => slip(&words, rng),
        false => words,
    }
}

/// The plainest way to say it.
pub fn say_plainly(names: &Names<'_>, wording: &str, unit: &Unit) -> String {
    fill(wording, unit, |kind| names.plain(kind), |name| names.plural(name))
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
    use crate::study::draw;
    use crate::study::participant::parts::{primitive, whole};

    #[test]
    fn names_and_prepositions_are_filled_in() {
        let household = Household::new();
        let names = Names::of(&household);
        let put = primitive(&"PUT Mug Fridge".parse().unwrap());
        assert_eq!(
            say_plainly(&names, "put the {thing} {prep} the {place}", &put),
            "put the mug in the fridge"
        );
        let two = whole("two ButterKnife CounterTop", &[]).unwrap();
        assert_eq!(
            say_plainly(&names, "{things} {prep} {place}", &two),
            "butter knives on counter"
        );
        let nested = whole("nested Egg Bowl DiningTable", &[]).unwrap();
        assert!(
            say_plainly(&names, "a {carrier} with a {thing}", &nested)
                .starts_with("a bowl with an egg")
                || say_plainly(&names, "a {carrier} with a {thing}", &nested)
                    == "a bowl with a egg"
        );
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
