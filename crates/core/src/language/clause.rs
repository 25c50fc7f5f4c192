use super::{LiftedUtterance, Mention, Word};

/// One clause as the parser gets it: its lifted form, and what lifting removed.
///
/// Some parsers read only [`Clause::lifted`]. Others also look at what was removed: the dropped
/// words of "the *red* mug", and the names of the objects.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Clause {
    /// The words, with a slot for each mention.
    pub lifted: LiftedUtterance,
    /// Per slot, the words before its name that lifting dropped, in order; often empty.
    pub attributes: Vec<Vec<String>>,
    /// The words as said, lower-cased, without clause marks.
    pub words: Vec<String>,
    /// What the slots stand for, in order.
    pub mentions: Vec<Mention>,
    /// The places of the lifted words that had a clause mark before them; 0-based, in order.
    pub marks: Vec<usize>,
}

impl Clause {
    /// A clause of which only the lifted form is known: a seed.
    pub fn of(lifted: &LiftedUtterance) -> Clause {
        let attributes = vec![Vec::new(); lifted.slots()];
        Clause { lifted: lifted.clone(), attributes, ..Clause::default() }
    }

    /// A clause of some of this one's lifted words.
    ///
    /// - `places`: 0-based, in rising order. A slot brings its attributes, its mention and its
    ///   name.
    pub fn pick(&self, places: &[usize]) -> Clause {
        let mut out = Clause::default();
        let mut slot = 0;
        for (place, word) in self.lifted.words.iter().enumerate() {
            let kept = places.contains(&place);
            if kept {
                if self.marks.contains(&place) && !out.lifted.words.is_empty() {
                    out.marks.push(out.lifted.words.len());
                }
                out.lifted.words.push(word.clone());
            }
            match word {
                Word::Text(text) if kept => out.words.push(text.clone()),
                Word::Text(_) => {}
                Word::Slot { .. } => {
                    if kept {
                        let attributes = self.attributes.get(slot).cloned().unwrap_or_default();
                        out.words.extend(attributes.iter().cloned());
                        out.attributes.push(attributes);
                        out.words.extend(self.mentions.get(slot).map(|m| m.surface.clone()));
                        out.mentions.extend(self.mentions.get(slot).cloned());
                    }
                    slot += 1;
                }
            }
        }
        out
    }
}
