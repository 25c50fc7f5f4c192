//! Shares and spreads.

use std::collections::BTreeMap;

use serde::Serialize;

use super::score::Verdict;

/// What became of some sentences, as shares of all of them: right + wrong + impossible + not sure
/// is 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Shares {
    pub n: usize,
    pub right: f64,
    pub wrong: f64,
    pub impossible: f64,
    pub not_sure: f64,
    /// Right of those that were carried out; 0 when none was.
    pub precision: f64,
    /// Those that were carried out, of all.
    pub coverage: f64,
    /// Area under precision against coverage; see [`area`].
    pub area: f64,
}

impl Shares {
    /// - `judged`: each sentence's verdict with the distance of its answer ([`super::score::distance`]).
    pub fn of(judged: &[(Verdict, f32)]) -> Shares {
        let n = judged.len();
        let count = |verdict| judged.iter().filter(|(v, _)| *v == verdict).count();
        let (right, wrong) = (count(Verdict::Right), count(Verdict::Wrong));
        Shares {
            n,
            right: share(right, n),
            wrong: share(wrong, n),
            impossible: share(count(Verdict::Impossible), n),
            not_sure: share(count(Verdict::NotSure), n),
            precision: share(right, right + wrong),
            coverage: share(right + wrong, n),
            area: area(judged),
        }
    }
}

/// `part` of `whole`; 0 of nothing.
pub fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

/// The area under the curve of precision against coverage that a narrowing threshold draws: the
/// answers carried out are taken surest first, and each adds its share of all sentences times the
/// precision up to there. What was not carried out at the parser's own threshold adds nothing, so
/// the area is at most the coverage. Answers at one distance are taken together.
pub fn area(judged: &[(Verdict, f32)]) -> f64 {
    let carried_out = judged.iter().filter(|(v, _)| matches!(v, Verdict::Right | Verdict::Wrong));
    let mut answers: Vec<(f32, bool)> =
        carried_out.map(|(verdict, distance)| (*distance, *verdict == Verdict::Right)).collect();
    answers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut taken, mut right, mut area) = (0, 0, 0.0);
    for group in answers.chunk_by(|a, b| a.0 == b.0) {
        taken += group.len();
        right += group.iter().filter(|(_, right)| *right).count();
        area += share(right, taken) * share(group.len(), judged.len());
    }
    area
}

/// A figure over several episodes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spread {
    pub mean: f64,
    /// Of the sample: divided by n - 1; 0 for fewer than two.
    pub sd: f64,
    /// Episodes that had anything to count.
    pub n: usize,
}

impl Spread {
    pub fn of(values: &[f64]) -> Spread {
        let n = values.len();
        if n == 0 {
            return Spread::default();
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        let sd = if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 };
        Spread { mean, sd, n }
    }
}

/// How often each reason was given, by verdict.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(transparent)]
pub struct Reasons(pub BTreeMap<Verdict, BTreeMap<String, usize>>);

impl Reasons {
    pub fn add(&mut self, verdict: Verdict, reason: &str) {
        *self.0.entry(verdict).or_default().entry(reason.to_owned()).or_default() += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{Impossible, NotSure, Right, Wrong};

    #[test]
    fn shares_add_up_to_one() {
        let judged = [(Right, 0.1), (Right, 0.2), (Wrong, 0.3), (Impossible, 0.1), (NotSure, 2.0)];
        let shares = Shares::of(&judged);
        let sum = shares.right + shares.wrong + shares.impossible + shares.not_sure;
        assert!((sum - 1.0).abs() < 1e-12);
        assert_eq!((shares.n, shares.right, shares.wrong), (5, 0.4, 0.2));
        assert_eq!((shares.precision, shares.coverage), (2.0 / 3.0, 0.6));
        assert_eq!(Shares::of(&[]), Shares::default());
    }

    #[test]
    fn the_area_rewards_being_surer_of_what_is_right() {
        let surer_of_right = area(&[(Right, 0.1), (Wrong, 0.9)]);
        let surer_of_wrong = area(&[(Wrong, 0.1), (Right, 0.9)]);
        assert_eq!(surer_of_right, 1.0 * 0.5 + 0.5 * 0.5);
        assert_eq!(surer_of_wrong, 0.0 * 0.5 + 0.5 * 0.5);
        assert_eq!(area(&[(Right, 0.1), (Right, 0.5)]), 1.0);
        assert_eq!(area(&[(Right, 0.1), (NotSure, 0.5), (Impossible, 0.0)]), 1.0 / 3.0);
        // The order of equals must not matter.
        assert_eq!(area(&[(Right, 0.1), (Wrong, 0.1)]), area(&[(Wrong, 0.1), (Right, 0.1)]));
    }

    #[test]
    fn a_spread_is_over_episodes() {
        assert_eq!(Spread::of(&[0.5, 1.0, 0.0]), Spread { mean: 0.5, sd: 0.5, n: 3 });
        assert_eq!(Spread::of(&[0.25]), Spread { mean: 0.25, sd: 0.0, n: 1 });
        assert_eq!(Spread::of(&[]), Spread::default());
    }
}
