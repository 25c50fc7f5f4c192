use std::ops::Range;

/// The place of each part of the learned parameters in their flat list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Numbers per word.
    pub dims: usize,
    pub units: usize,
    /// Numbers per token of the program.
    pub token: usize,
    /// Tokens that can be written: operators, the end, constants.
    pub writes: usize,
    /// Tokens in the input of the decoder: those that can be written, and a slot of each number.
    pub tokens: usize,
}

/// A parameter matrix, or a bias.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// `[dims × 4·units]`, of a direction: 0 reads from the left, 1 from the right.
    ReadWord(usize),
    /// `[units × 4·units]`.
    ReadState(usize),
    /// `[4·units]`.
    ReadBias(usize),
    /// From the encoder's states to the decoder's first cells, `[2·units × units]` and `[units]`.
    Bridge,
    BridgeBias,
    /// From the encoder's states to the keys of attention, `[2·units × units]`.
    Keys,
    /// `[tokens × token]`.
    Tokens,
    /// Of the last token and the context, `[(token + 2·units) × 4·units]`.
    WriteInput,
    /// `[units × 4·units]`.
    WriteState,
    WriteBias,
    /// From state and context to the scores of tokens, `[3·units × writes]` and `[writes]`.
    Output,
    OutputBias,
}

impl Part {
    pub(super) const ALL: [Part; 15] = [
        Part::ReadWord(0),
        Part::ReadState(0),
        Part::ReadBias(0),
        Part::ReadWord(1),
        Part::ReadState(1),
        Part::ReadBias(1),
        Part::Bridge,
        Part::BridgeBias,
        Part::Keys,
        Part::WriteInput,
        Part::WriteState,
        Part::WriteBias,
        Part::Output,
        Part::OutputBias,
        Part::Tokens,
    ];
}

impl Layout {
    /// Rows and columns; a bias has one row.
    pub(super) fn shape(&self, part: Part) -> (usize, usize) {
        let Layout { dims, units, token, writes, tokens } = *self;
        match part {
            Part::ReadWord(_) => (dims, 4 * units),
            Part::ReadState(_) | Part::WriteState => (units, 4 * units),
            Part::ReadBias(_) | Part::WriteBias => (1, 4 * units),
            Part::Bridge | Part::Keys => (2 * units, units),
            Part::BridgeBias => (1, units),
            Part::Tokens => (tokens, token),
            Part::WriteInput => (token + 2 * units, 4 * units),
            Part::Output => (3 * units, writes),
            Part::OutputBias => (1, writes),
        }
    }

    pub(super) fn at(&self, part: Part) -> Range<usize> {
        let size = |part: Part| {
            let (rows, columns) = self.shape(part);
            rows * columns
        };
        let before = Part::ALL.iter().take_while(|other| **other != part);
        let start = before.map(|other| size(*other)).sum();
        start..start + size(part)
    }

    pub(super) fn total(&self) -> usize {
        self.at(Part::Tokens).end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_lie_side_by_side_and_fill_the_list() {
        let layout = Layout { dims: 5, units: 3, token: 2, writes: 7, tokens: 9 };
        let mut end = 0;
        for part in Part::ALL {
            let range = layout.at(part);
            assert_eq!(range.start, end, "{part:?}");
            end = range.end;
        }
        assert_eq!(end, layout.total());
    }
}
