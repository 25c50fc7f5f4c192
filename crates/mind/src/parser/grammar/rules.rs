use std::collections::BTreeMap;

use super::GrammarSettings;
use crate::language::{LiftedArg, LiftedProgram, LiftedStep, LiftedUtterance, Symbol, Word};

/// A grammar prepared for reading.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    silent: Vec<String>,
    classes: Vec<Vec<Vec<Item>>>,
    requests: Vec<(Vec<Item>, LiftedProgram)>,
}

/// One place of a pattern.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Item {
    Word(String),
    /// A mention of this sort.
    Mention(Symbol),
    /// Anything of a class.
    Class(usize),
    /// Anything of a class, whose first mention is the argument of this number.
    Argument(usize, u8),
}

/// The words that are not silent. A mention has its number, from 1.
struct Tokens<'u> {
    words: Vec<(&'u Word, u8)>,
}

/// Where a phrase may end, and its first mention.
type End = (usize, Option<u8>);

impl Rules {
    pub(super) fn compile(settings: &GrammarSettings) -> Result<Rules, (&'static str, String)> {
        let names: Vec<&String> = settings.classes.keys().collect();
        let mut classes = Vec::new();
        for (name, phrases) in &settings.classes {
            let read = |phrase: &String| items(&names, phrase);
            let phrases: Result<Vec<_>, String> = phrases.iter().map(read).collect();
            let phrases =
                phrases.map_err(|reason| ("classes", format!("the class {name}: {reason}")))?;
            let argument = |item: &Item| matches!(item, Item::Argument(..));
            if phrases.iter().flatten().any(argument) {
                let reason = format!("the class {name} numbers an argument; only requests do");
                return Err(("classes", reason));
            }
            classes.push(phrases);
        }
        if let Some(own) = begins_with_itself(&classes) {
            let reason = format!("the class {} may begin with itself", names[own]);
            return Err(("classes", reason));
        }
        let mut requests = Vec::new();
        for (pattern, program) in &settings.requests {
            let fault = |reason| ("requests", format!("the request {pattern:?}: {reason}"));
            let pattern = items(&names, pattern).map_err(fault)?;
            let numbers = |number: u8| pattern.iter().filter(move |item| is(item, number)).count();
            let count = pattern.iter().filter(|item| matches!(item, Item::Argument(..))).count();
            // So every slot of the program is filled for all words.
            if let Some(odd) = (1..=count as u8).find(|&number| numbers(number) != 1) {
                return Err(fault(format!("expected the argument {odd} once")));
            }
            if program.slots() > count {
                let reason = format!("{program} needs an argument that it does not say");
                return Err(fault(reason));
            }
            requests.push((pattern, program.clone()));
        }
        if requests.is_empty() {
            return Err(("requests", "expected at least one request".to_owned()));
        }
        let silent = settings.silent.iter().cloned().collect();
        Ok(Rules { silent, classes, requests })
    }

    /// The meaning of the first request that reads the whole utterance.
    pub(super) fn read(&self, utterance: &LiftedUtterance) -> Option<LiftedProgram> {
        let mut mentions = 0;
        let numbered = utterance.words.iter().map(|word| {
            mentions += u8::from(matches!(word, Word::Slot { .. }));
            (word, mentions)
        });
        let silent = |word: &Word| matches!(word, Word::Text(text) if self.silent.contains(text));
        let words = numbered.filter(|(word, _)| !silent(word)).collect();
        let mut reading = Reading { rules: self, tokens: Tokens { words }, known: BTreeMap::new() };
        self.requests.iter().find_map(|(pattern, program)| {
            let mut arguments = BTreeMap::new();
            reading.whole(pattern, 0, &mut arguments).then(|| renumber(program, &arguments))
        })
    }
}

fn is(item: &Item, number: u8) -> bool {
    matches!(item, Item::Argument(_, found) if *found == number)
}

/// An utterance that is being read, with what is known about its places so far.
struct Reading<'r, 'u> {
    rules: &'r Rules,
    tokens: Tokens<'u>,
    /// Where each class that begins at a place may end.
    known: BTreeMap<(usize, usize), Vec<End>>,
}

impl Reading<'_, '_> {
    /// Whether the pattern reads everything from `at` on. Of several ways, the one with the
    /// shortest first phrases counts: "put it in the pot on the stove" puts it in the pot.
    fn whole(&mut self, pattern: &[Item], at: usize, arguments: &mut BTreeMap<u8, u8>) -> bool {
        let Some((first, rest)) = pattern.split_first() else {
            return at == self.tokens.words.len();
        };
        for (end, mention) in self.item(first, at) {
            if let Item::Argument(_, number) = first {
                let Some(mention) = mention else { continue };
                arguments.insert(*number, mention);
            }
            if self.whole(rest, end, arguments) {
                return true;
            }
        }
        false
    }

    fn item(&mut self, item: &Item, at: usize) -> Vec<End> {
        match item {
            Item::Class(class) | Item::Argument(class, _) => self.class(*class, at),
            Item::Word(_) | Item::Mention(_) => {
                let Some((word, number)) = self.tokens.words.get(at) else { return Vec::new() };
                match (item, word) {
                    (Item::Word(wanted), Word::Text(found)) if wanted == found => {
                        vec![(at + 1, None)]
                    }
                    (Item::Mention(wanted), Word::Slot { sort, .. }) if wanted == sort => {
                        vec![(at + 1, Some(*number))]
                    }
                    _ => Vec::new(),
                }
            }
        }
    }

    /// Where phrases of a class that begin at `at` may end, likeliest first. Ends: no class begins
    /// with itself, so it meets itself only further on.
    fn class(&mut self, class: usize, at: usize) -> Vec<End> {
        if let Some(known) = self.known.get(&(class, at)) {
            return known.clone();
        }
        let rules = self.rules;
        let mut found: Vec<End> = Vec::new();
        for phrase in &rules.classes[class] {
            let mut ends: Vec<End> = vec![(at, None)];
            for item in phrase {
                let mut longer: Vec<End> = Vec::new();
                for (place, mention) in ends {
                    for (end, next) in self.item(item, place) {
                        let end = (end, mention.or(next));
                        if !longer.contains(&end) {
                            longer.push(end);
                        }
                    }
                }
                ends = longer;
            }
            for end in ends {
                if !found.contains(&end) {
                    found.push(end);
                }
            }
        }
        self.known.insert((class, at), found.clone());
        found
    }
}

/// The program about the mentions that its arguments are.
fn renumber(program: &LiftedProgram, arguments: &BTreeMap<u8, u8>) -> LiftedProgram {
    let arg = |arg: &LiftedArg| match arg {
        LiftedArg::Slot { sort, number } => {
            LiftedArg::Slot { sort: sort.clone(), number: arguments[number] }
        }
        other => other.clone(),
    };
    let steps = program.steps.iter().map(|step| LiftedStep {
        operator: step.operator.clone(),
        args: step.args.iter().map(arg).collect(),
    });
    LiftedProgram { steps: steps.collect() }
}

fn items(names: &[&String], pattern: &str) -> Result<Vec<Item>, String> {
    let class = |wanted: &str| {
        names.iter().position(|name| *name == wanted).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
            format!("there is no class {wanted:?}; expected one of {}", known.join(", "))
        })
    };
    let between =
        |word: &str, open, close| word.strip_prefix(open)?.strip_suffix(close).map(str::to_owned);
    let item = |word: &str| match (between(word, '{', '}'), between(word, '<', '>')) {
        (Some(name), _) => Ok(Item::Class(class(&name)?)),
        (None, None) => Ok(Item::Word(word.to_owned())),
        (None, Some(slot)) => match slot.split_once(':') {
            None => Ok(Item::Mention(Symbol::new(&slot))),
            Some((sort, number)) => {
                let number = number.parse().ok().filter(|number| *number >= 1);
                let number = number.ok_or_else(|| format!("{word:?} has no number from 1 on"))?;
                Ok(Item::Argument(class(sort)?, number))
            }
        },
    };
    pattern.split_whitespace().map(item).collect()
}

/// A class that can be reached from itself without reading a word.
fn begins_with_itself(classes: &[Vec<Vec<Item>>]) -> Option<usize> {
    let class_of = |item: &Item| match item {
        Item::Class(class) | Item::Argument(class, _) => Some(*class),
        _ => None,
    };
    let mut empty = vec![false; classes.len()];
    loop {
        let may = |phrase: &Vec<Item>| {
            phrase.iter().all(|item| class_of(item).is_some_and(|class| empty[class]))
        };
        let next: Vec<bool> = classes.iter().map(|phrases| phrases.iter().any(may)).collect();
        if next == empty {
            break;
        }
        empty = next;
    }
    let mut first = vec![vec![false; classes.len()]; classes.len()];
    for (class, phrases) in classes.iter().enumerate() {
        for phrase in phrases {
            for item in phrase {
                let Some(next) = class_of(item) else { break };
                first[class][next] = true;
                if !empty[next] {
                    break;
                }
            }
        }
    }
    for middle in 0..classes.len() {
        for from in 0..classes.len() {
            if first[from][middle] {
                let onward = first[middle].clone();
                first[from].iter_mut().zip(onward).for_each(|(one, other)| *one |= other);
            }
        }
    }
    (0..classes.len()).find(|&class| first[class][class])
}
