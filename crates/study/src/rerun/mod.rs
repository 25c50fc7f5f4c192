//! Counterfactual replay: what recorded people would have been answered by another configuration.
//!
//! The loop is open: what people said next is what they said to the recorded answers. From the
//! first turn of an episode whose action differs, the recorded scenes are no longer those that the
//! other configuration would have met, and figures say which turns they count.

mod configuration;
mod minds;
mod report;
#[cfg(test)]
mod tests;
mod text;
mod turns;
mod walk;

use std::sync::Arc;

pub use configuration::{Other, SWEEP_MAX, Variant, With, WithError};
pub use minds::MindCounts;
pub use report::{
    Change, Difference, EpisodeFigures, EpisodeReport, Examples, Figures, LeftOut, PersonReport,
    Report, Side, VariantReport,
};
pub use turns::table;
pub use walk::{Episode, Life, Taught, Turn};

use apprentice::ids::StreamId;
use apprentice::parallel::{Progress, in_order};
use apprentice::store::Store;
use apprentice::world::Domain;
use minds::BaseMinds;
use walk::Walker;

/// What a rerun gives: the report, and every turn behind it, in the order of `streams`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rerun {
    pub report: Report,
    pub lives: Vec<Life>,
}

/// Asks each of `variants` every utterance that was recorded in `streams`, at its own moment.
///
/// The log decides the moment: the scene, the task and the lessons. A variant with a threshold asks
/// the mind that was recorded, as kept or made again from the log; a variant with a recipe trains
/// minds of its own, one for each list of lessons that answered anything. Streams are walked on
/// `threads` threads, and what is found does not depend on how many.
pub fn rerun<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    streams: &[StreamId],
    variants: &[Variant],
    threads: usize,
    progress: &dyn Progress,
) -> Rerun {
    let people: Vec<&StreamId> = streams.iter().filter(|stream| !stream.is_tenants()).collect();
    let heads = people.iter().map(|stream| store.log.head(stream).map_or(0, |head| head.seq));
    progress.expect(heads.sum());
    let bases = BaseMinds::default();
    let walker = Walker { domain, store, variants, bases: &bases, progress };
    let walked = in_order(threads, &(), &people, |stream| walker.walk(stream));
    let (mut lives, mut left_out) = (Vec::new(), Vec::new());
    for (stream, walked) in people.iter().zip(walked) {
        match walked {
            Ok(life) => lives.push(life),
            Err(gap) => left_out.push(LeftOut {
                tenant: stream.tenant.clone(),
                user: gap.user,
                why: gap.reason,
                is_fault: !gap.expected,
            }),
        }
    }
    let report = Report::of(variants, &lives, left_out, domain.seeds().exemplars.len());
    Rerun { report, lives }
}
