use super::{LiftedUtterance, Mention, Word};

/// One clause as the parser gets it: its lifted form, and what lifting took away.
///
/// Parsers that compare lifted forms alone read only [`Clause::lifted`]; the rest is for those
/// that judge by more (the swallowed words of "the *red* mug", the objects' own names).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Clause {
    pub lifted: LiftedUtterance,
    /// Per slot, the words before its name that lifting swallowed, in order; often empty.
    pub attributes: Vec<Vec<String>>,
    /// The words as said, lower-cased, without clause marks.
    pub words: Vec<String>,
    /// What the slots stand for, in order.
    pub mentions: Vec<Mention>,
    /// Before which of the lifted words a clause mark stood, in order.
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
    /// - `places`: in rising order; what was said for a slot is its attributes and its name.
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
