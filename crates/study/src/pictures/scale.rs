//! Round numbers for axes.

/// A linear axis: its ends, and the numbers written along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub from: f64,
    pub to: f64,
    pub ticks: Vec<f64>,
    /// Decimal places of the numbers.
    pub places: usize,
    pub percent: bool,
}

impl Scale {
    /// An axis for values between `low` and `high`, with about `count` round steps.
    pub fn around(low: f64, high: f64, count: usize) -> Scale {
        let span = if high > low { high - low } else { 1.0 };
        let step = round_step(span / count.max(1) as f64);
        let from = (low / step + 1e-9).floor() * step;
        let steps = ((high - from) / step - 1e-9).ceil().max(1.0) as usize;
        let ticks: Vec<f64> = (0..=steps).map(|n| from + n as f64 * step).collect();
        let places = (0..4).find(|places| is_whole(step * 10_f64.powi(*places))).unwrap_or(4);
        Scale {
            from,
            to: from + steps as f64 * step,
            ticks,
            places: places as usize,
            percent: false,
        }
    }

    /// From 0 to 100 %.
    pub fn percent() -> Scale {
        let ticks = (0..=5).map(|n| n as f64 / 5.0).collect();
        Scale { from: 0.0, to: 1.0, ticks, places: 0, percent: true }
    }

    pub fn label(&self, tick: f64) -> String {
        match self.percent {
            true => format!("{:.0} %", tick * 100.0),
            false => format!("{:.*}", self.places, tick),
        }
    }
}

/// The episodes that are written below an axis: all, or every fifth of many, the first always.
pub fn episode_ticks(last: u32) -> Vec<u32> {
    (1..=last).filter(|n| last <= 10 || *n == 1 || n % 5 == 0).collect()
}

fn is_whole(value: f64) -> bool {
    (value - value.round()).abs() < 1e-6
}

/// The smallest of 1, 2, 2.5, 5 and 10 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let mut power = 1e-6;
    while power * 10.0 < step {
        power *= 10.0;
    }
    let found = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|m| m * power >= step * (1.0 - 1e-9));
    found.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_on_round_numbers_and_hold_everything() {
        for (low, high) in [(0.0, 1.37), (44.0, 61.2), (0.0, 0.04), (0.0, 12.0), (3.0, 3.0)] {
            let scale = Scale::around(low, high, 5);
            assert!(scale.from <= low && scale.to >= high, "{low} to {high}: {scale:?}");
            assert!((2..=8).contains(&scale.ticks.len()), "{scale:?}");
            let labels: Vec<String> = scale.ticks.iter().map(|tick| scale.label(*tick)).collect();
            let mut distinct = labels.clone();
            distinct.dedup();
            assert_eq!(labels, distinct, "no number is written twice");
        }
        let scale = Scale::around(0.0, 1.37, 5);
        let labels: Vec<String> = scale.ticks.iter().map(|tick| scale.label(*tick)).collect();
        assert_eq!(labels, ["0.0", "0.5", "1.0", "1.5"]);
        assert_eq!(Scale::percent().label(0.4), "40 %");
    }

    #[test]
    fn few_episodes_are_all_written_and_of_many_some() {
        assert_eq!(episode_ticks(5), [1, 2, 3, 4, 5]);
        assert_eq!(episode_ticks(20), [1, 5, 10, 15, 20]);
    }
}
