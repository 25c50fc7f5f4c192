//! The same sentence about another thing.

use std::collections::BTreeMap;

use apprentice::language::{Program, Symbol, Utterance};
use apprentice::world::Lexicon;

/// Words of the longest name that is looked for.
pub(super) const NAME_WORDS_MAX: usize = 5;

/// The name that people use most for a kind and that means this kind before any other: what to
/// call it without being misunderstood. Not every kind has one.
pub fn plain_names(lexicon: &Lexicon) -> BTreeMap<Symbol, &str> {
    let mut names: BTreeMap<Symbol, (u32, &str)> = BTreeMap::new();
    for (name, meanings) in &lexicon.names {
        let Some(first) = meanings.first() else { continue };
        let known = names.get(&first.kind);
        if known.is_none_or(|(count, _)| first.count > *count) {
            names.insert(first.kind.clone(), (first.count, name));
        }
    }
    names.into_iter().map(|(kind, (_, name))| (kind, name)).collect()
}

/// The sentence with each name of `from` replaced by `name`; `None` when it never names it.
///
/// Punctuation that marks clauses stays; letters become small, as they are for every parser here.
pub fn rename(
    lexicon: &Lexicon,
    sentence: &Utterance,
    from: &Symbol,
    name: &str,
) -> Option<Utterance> {
    let tokens = sentence.tokens();
    let mut out: Vec<&str> = Vec::new();
    let mut renamed = false;
    let mut at = 0;
    while at < tokens.len() {
        let longest = NAME_WORDS_MAX.min(tokens.len() - at);
        let found = (1..=longest).rev().find_map(|count| {
            let name = singular(lexicon, &tokens[at..at + count]);
            name.map(|name| (count, &lexicon.names[&name]))
        });
        match found {
            Some((count, meanings)) => {
                if meanings.iter().any(|meaning| meaning.kind == *from) {
                    out.push(name);
                    renamed = true;
                } else {
                    out.extend(tokens[at..at + count].iter().map(String::as_str));
                }
                at += count;
            }
            None => {
                out.push(&tokens[at]);
                at += 1;
            }
        }
    }
    let text = out.join(" ");
    renamed.then(|| Utterance::new(&text).expect("a sentence stays one with another name in it"))
}

/// The name that the words are, as the lexicon writes it, in the singular or the plural.
pub(super) fn singular(lexicon: &Lexicon, words: &[String]) -> Option<String> {
    let (last, first) = words.split_last()?;
    let with = |last: &str| {
        let mut name = first.to_vec();
        name.push(last.to_owned());
        let name = name.join(" ");
        lexicon.names.contains_key(&name).then_some(name)
    };
    let irregular = lexicon.plurals.get(last).map(String::as_str);
    let regular = [last.strip_suffix('s'), last.strip_suffix("es")];
    with(last).or_else(|| [irregular].into_iter().chain(regular).flatten().find_map(with))
}

/// The program with one kind in place of another.
pub fn replace(program: &Program, from: &Symbol, to: &Symbol) -> Program {
    let mut program = program.clone();
    for arg in program.steps.iter_mut().flat_map(|step| &mut step.args) {
        if arg == from {
            *arg = to.clone();
        }
    }
    program
}

#[cfg(test)]
mod tests {
    use super::*;
    use apprentice::world::household::Household;
    use apprentice::world::{Edition, Words};

    fn check(sentence: &str, from: &str, name: &str, expected: Option<&str>) {
        let household = Household::new();
        let sentence = Utterance::new(sentence).unwrap();
        let renamed =
            rename(household.lexicon(Edition::First), &sentence, &Symbol::new(from), name);
        assert_eq!(renamed.as_ref().map(Utterance::as_str), expected, "{sentence}");
    }

    #[test]
    fn a_thing_gets_another_name_wherever_it_is_named() {
        check(
            "Rinse the Tomato, then put the tomato down.",
            "Tomato",
            "egg",
            Some("rinse the egg , then put the egg down ."),
        );
        check("heat two potatoes", "Potato", "apple", Some("heat two apple"));
        check("warm the coffee mug", "Mug", "plate", Some("warm the plate"));
        check("warm it up", "Mug", "plate", None);
    }

    #[test]
    fn a_plain_name_means_its_kind_first() {
        let household = Household::new();
        let lexicon = household.lexicon(Edition::First);
        let names = plain_names(lexicon);
        assert!(names.len() > 60, "{}", names.len());
        for (kind, name) in names {
            assert_eq!(lexicon.names[name][0].kind, kind, "{name}");
        }
    }

    #[test]
    fn a_program_is_about_another_thing() {
        let program: Program = "PUT Mug SinkBasin; PICKUP Mug".parse().unwrap();
        let other = replace(&program, &Symbol::new("Mug"), &Symbol::new("Pan"));
        assert_eq!(other.to_string(), "PUT Pan SinkBasin; PICKUP Pan");
    }
}
