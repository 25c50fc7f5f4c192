use std::ops::Range;

/// The place of each part of the learned parameters in their flat list. One optimiser steps all of
/// them, and one digest covers them.
///
/// In order: `transform` `[dims × hidden]`, its bias `[hidden]`; the first layer of the MLP
/// `[hidden × hidden]`, its bias; the second `[hidden × embedding]`, its bias; a vector of `[dims]`
/// for each sort; the classifier's a and b.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    pub dims: usize,
    pub hidden: usize,
    pub embedding: usize,
    pub sorts: usize,
}

impl Layout {
    fn sizes(&self) -> [usize; 8] {
        let Layout { dims, hidden, embedding, sorts } = *self;
        [
            dims * hidden,
            hidden,
            hidden * hidden,
            hidden,
            hidden * embedding,
            embedding,
            sorts * dims,
            2,
        ]
    }

    fn part(&self, index: usize) -> Range<usize> {
        let sizes = self.sizes();
        let start = sizes[..index].iter().sum();
        start..start + sizes[index]
    }

    pub(super) fn transform(&self) -> Range<usize> {
        self.part(0)
    }
    pub(super) fn transform_bias(&self) -> Range<usize> {
        self.part(1)
    }
    pub(super) fn first(&self) -> Range<usize> {
        self.part(2)
    }
    pub(super) fn first_bias(&self) -> Range<usize> {
        self.part(3)
    }
    pub(super) fn second(&self) -> Range<usize> {
        self.part(4)
    }
    pub(super) fn second_bias(&self) -> Range<usize> {
        self.part(5)
    }
    pub(super) fn sorts(&self) -> Range<usize> {
        self.part(6)
    }
    pub(super) fn sort(&self, sort: usize) -> Range<usize> {
        let start = self.sorts().start + sort * self.dims;
        start..start + self.dims
    }
    /// The places of a and b.
    pub(super) fn classifier(&self) -> [usize; 2] {
        let start = self.part(7).start;
        [start, start + 1]
    }
    pub(super) fn total(&self) -> usize {
        self.sizes().iter().sum()
    }
}
