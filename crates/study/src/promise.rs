//! What a threshold promises and what it keeps.

use apprentice::learning::Recipe;
use apprentice::learning::recipe::ParserKind;
use serde::Serialize;

use super::figures::{Spread, share};
use super::score::Verdict;

/// The lower ends of the bands of surety; the last ends at 1, which belongs to it.
const BANDS: [f64; 8] = [0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];

/// Precision as a parser promises it at its own threshold, and as people meet it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Promise {
    /// The share of right answers among those carried out that the parser claims. Of `features`
    /// the mean surety of these answers; of `exemplar` the precision that its threshold is
    /// calibrated to.
    pub promised: f64,
    /// The same share as judged.
    pub achieved: f64,
    /// As judged, once for each person who had anything carried out.
    pub by_person: Spread,
    /// The smallest of these, smallest first.
    pub worst: Vec<f64>,
    /// The share of those people whose answers were right less often than promised.
    pub people_below: f64,
    /// The share of calibration requests for something unknown that the threshold lets in; what
    /// people meet is `untaught_accepted`.
    pub unknown_accepted: f64,
    pub bands: Vec<Band>,
}

/// Answers carried out that were about equally sure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    pub from: f64,
    pub n: usize,
    /// Mean surety.
    pub sure: f64,
    pub right: f64,
}

/// A sentence whose answer was judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept<'a> {
    pub user: &'a str,
    pub verdict: Verdict,
    /// Between 0 and 1. Of `features` the probability that it states; of `exemplar`, which states
    /// none, how far within the threshold the nearest exemplar was, as a share of it.
    pub sure: f64,
}

impl Promise {
    /// - `unknown_accepted`: what the calibration found.
    pub fn of(recipe: &Recipe, unknown_accepted: f64, judged: &[Kept<'_>]) -> Promise {
        let carried_out =
            |kept: &&Kept<'_>| matches!(kept.verdict, Verdict::Right | Verdict::Wrong);
        let kept: Vec<Kept<'_>> = judged.iter().filter(carried_out).copied().collect();
        let promised = match &recipe.settings().parser {
            parser if parser.kind == ParserKind::Features => mean_surety(&kept),
            parser => parser.exemplar.as_ref().map_or(0.0, |exemplar| exemplar.precision),
        };
        let mut users: Vec<&str> = kept.iter().map(|one| one.user).collect();
        users.sort_unstable();
        users.dedup();
        let of_person = |user: &&str| {
            let own: Vec<Kept<'_>> = kept.iter().filter(|one| one.user == *user).copied().collect();
            right(&own)
        };
        let mut people: Vec<f64> = users.iter().map(of_person).collect();
        people.sort_by(f64::total_cmp);
        let below = people.iter().filter(|precision| **precision < promised).count();
        let band = |(place, from): (usize, &f64)| {
            let to = BANDS.get(place + 1).copied().unwrap_or(f64::INFINITY);
            let within = kept.iter().filter(|one| (*from..to).contains(&one.sure));
            let within: Vec<Kept<'_>> = within.copied().collect();
            let (sure, right) = (mean_surety(&within), right(&within));
            Band { from: *from, n: within.len(), sure, right }
        };
        Promise {
            promised,
            achieved: right(&kept),
            by_person: Spread::of(&people),
            people_below: share(below, people.len()),
            worst: people.into_iter().take(super::primitives::WORST).collect(),
            unknown_accepted,
            bands: BANDS.iter().enumerate().map(band).filter(|band| band.n > 0).collect(),
        }
    }
}

/// See [`Kept::sure`].
///
/// - `distance`: of the nearest exemplar, as a share of the threshold.
pub fn surety(recipe: &Recipe, distance: f32, threshold: f32) -> f64 {
    let unsure = match recipe.settings().parser.kind {
        ParserKind::Features => f64::from(distance) * f64::from(threshold),
        ParserKind::Exemplar | ParserKind::Grammar | ParserKind::Seq2seq | ParserKind::Backed => {
            f64::from(distance)
        }
    };
    (1.0 - unsure).clamp(0.0, 1.0)
}

fn mean_surety(kept: &[Kept<'_>]) -> f64 {
    kept.iter().map(|one| one.sure).sum::<f64>() / kept.len().max(1) as f64
}

fn right(kept: &[Kept<'_>]) -> f64 {
    share(kept.iter().filter(|one| one.verdict == Verdict::Right).count(), kept.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recipe(name: &str) -> Recipe {
        Recipe::parse(Recipe::builtin(name).unwrap()).unwrap()
    }

    fn kept(user: &'static str, verdict: Verdict, sure: f64) -> Kept<'static> {
        Kept { user, verdict, sure }
    }

    #[test]
    fn a_promise_is_held_against_every_person() {
        use Verdict::{Impossible, NotSure, Right, Wrong};
        let judged = [
            kept("ann", Right, 1.0),
            kept("ann", Right, 0.9),
            kept("ann", NotSure, 0.1),
            kept("bob", Wrong, 0.9),
            kept("bob", Right, 0.8),
            kept("cyd", Impossible, 0.9),
        ];
        let promise = Promise::of(&recipe("default"), 0.02, &judged);
        assert!((promise.promised - 0.9).abs() < 1e-12);
        assert_eq!(promise.achieved, 0.75);
        // Nothing of cyd's was carried out.
        assert_eq!((promise.by_person.mean, promise.by_person.n), (0.75, 2));
        assert_eq!((promise.people_below, promise.worst), (0.5, vec![0.5, 1.0]));
        let bands: Vec<_> = promise.bands.iter().map(|b| (b.from, b.n, b.right)).collect();
        assert_eq!(bands, [(0.8, 1, 1.0), (0.9, 2, 0.5), (0.99, 1, 1.0)]);
        // The paper's parser states no probability, but what its threshold is calibrated to.
        assert_eq!(Promise::of(&recipe("paper"), 0.0, &judged).promised, 0.9);
        assert_eq!(Promise::of(&recipe("paper"), 0.0, &[]).by_person.n, 0);
    }

    #[test]
    fn surety_is_a_probability_where_the_parser_states_one() {
        assert!((surety(&recipe("default"), 0.5, 0.4) - 0.8).abs() < 1e-6);
        assert!((surety(&recipe("paper"), 0.5, 0.4) - 0.5).abs() < 1e-6);
        assert_eq!(surety(&recipe("paper"), 1.5, 0.4), 0.0);
    }
}
