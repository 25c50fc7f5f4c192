//! One chart: a measure over the episodes, one curve for each condition.

use super::canvas::{Canvas, Hand, Side};
use super::scale::{Scale, episode_ticks};
use super::style::{AXIS, INK, RULE, SOFT, look};

/// Up to so many episodes spreads are bars, beyond it bands: bars would stand too close.
pub const BARS_MAX: u32 = 10;
/// Units between the bars of two conditions, at most, so that they do not hide each other.
const DODGE_MAX: f64 = 16.0;

/// The curve of one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The number of its look.
    pub look: usize,
    /// By episode.
    pub points: Vec<Point>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub episode: u32,
    pub mean: f64,
    pub sd: Option<f64>,
}

pub struct Chart<'a> {
    /// Empty for none.
    pub title: &'a str,
    pub unit: &'a str,
    pub scale: &'a Scale,
    pub last_episode: u32,
    pub curves: &'a [Curve],
    /// Whether "episode" stands below.
    pub names_episodes: bool,
}

/// The inside of the axes.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub left: i32,
    pub top: i32,
    pub width: i32,
    pub height: i32,
}

pub const TICK: Hand = Hand { size: 28, colour: SOFT, bold: false };
const UNIT: Hand = Hand { size: 28, colour: SOFT, bold: false };
const TITLE: Hand = Hand { size: 34, colour: INK, bold: true };

impl Chart<'_> {
    pub fn draw(&self, canvas: &Canvas<'_>, frame: Frame) -> Result<(), String> {
        let Frame { left, top, width, height } = frame;
        if !self.title.is_empty() {
            self.draw_names(canvas, frame)?;
        }
        for tick in &self.scale.ticks {
            let y = self.y(frame, *tick);
            canvas.line(&[(left, y), (left + width, y)], RULE, 2)?;
            canvas.text(&self.scale.label(*tick), (left - 16, y + 10), Side::End, TICK)?;
        }
        let floor = top + height;
        canvas.line(&[(left, floor), (left + width, floor)], AXIS, 3)?;
        for episode in episode_ticks(self.last_episode) {
            let x = self.x(frame, episode).round() as i32;
            canvas.line(&[(x, floor), (x, floor + 10)], AXIS, 3)?;
            canvas.text(&episode.to_string(), (x, floor + 42), Side::Middle, TICK)?;
        }
        if self.names_episodes {
            canvas.text("episode", (left + width / 2, floor + 84), Side::Middle, UNIT)?;
        }
        for spreads in [true, false] {
            for curve in self.curves {
                match spreads {
                    true => self.draw_spread(canvas, frame, curve)?,
                    false => self.draw_curve(canvas, frame, curve)?,
                }
            }
        }
        Ok(())
    }

    /// The measure and its unit, above the frame.
    pub fn draw_names(&self, canvas: &Canvas<'_>, frame: Frame) -> Result<(), String> {
        let Frame { left, top, .. } = frame;
        canvas.text(self.title, (left, top - 70), Side::Start, TITLE)?;
        canvas.text(self.unit, (left, top - 32), Side::Start, UNIT)
    }

    fn draw_spread(&self, canvas: &Canvas<'_>, frame: Frame, curve: &Curve) -> Result<(), String> {
        let colour = look(curve.look).colour;
        // Nothing that is measured can be negative, and no share above 1: what would stand outside
        // the axis is cut.
        let ends = |point: &Point| {
            let sd = point.sd?;
            let Scale { from, to, .. } = *self.scale;
            let (low, high) = (point.mean - sd, point.mean + sd);
            let whole = (low >= from, high <= to + 1e-9);
            Some((self.y(frame, low.max(from)), self.y(frame, high.min(to)), whole))
        };
        if self.last_episode > BARS_MAX {
            let spread = curve.points.iter().filter_map(|point| Some((point, ends(point)?)));
            let spread: Vec<_> = spread.collect();
            let x = |point: &Point| self.x(frame, point.episode).round() as i32;
            let upper = spread.iter().map(|(point, (_, high, _))| (x(point), *high));
            let lower = spread.iter().rev().map(|(point, (low, _, _))| (x(point), *low));
            let outline: Vec<(i32, i32)> = upper.chain(lower).collect();
            return if outline.len() > 2 { canvas.band(&outline, colour) } else { Ok(()) };
        }
        for point in &curve.points {
            if let Some((low, high, whole)) = ends(point) {
                canvas.spread(self.dodged(frame, curve, point), (low, high), whole, colour)?;
            }
        }
        Ok(())
    }

    fn draw_curve(&self, canvas: &Canvas<'_>, frame: Frame, curve: &Curve) -> Result<(), String> {
        let at = |point: &Point| (self.dodged(frame, curve, point), self.y(frame, point.mean));
        let points: Vec<(i32, i32)> = curve.points.iter().map(at).collect();
        if points.len() > 1 {
            canvas.curve(&points, look(curve.look))?;
        }
        points.iter().try_for_each(|point| canvas.marker(*point, look(curve.look)))
    }

    fn x(&self, frame: Frame, episode: u32) -> f64 {
        // Half a step of room at both sides.
        let steps = f64::from(self.last_episode.max(1));
        f64::from(frame.left) + f64::from(frame.width) * (f64::from(episode) - 0.5) / steps
    }

    fn dodged(&self, frame: Frame, curve: &Curve, point: &Point) -> i32 {
        let place = self.curves.iter().position(|other| other.look == curve.look).unwrap_or(0);
        let middle = (self.curves.len() as f64 - 1.0) / 2.0;
        // All of them within the middle half of the episode.
        let step = f64::from(frame.width) / f64::from(self.last_episode.max(1));
        let room = match self.last_episode > BARS_MAX {
            true => 0.0,
            false => DODGE_MAX.min(0.5 * step / self.curves.len() as f64),
        };
        (self.x(frame, point.episode) + (place as f64 - middle) * room).round() as i32
    }

    fn y(&self, frame: Frame, value: f64) -> i32 {
        let Scale { from, to, .. } = self.scale;
        let share = (value - from) / (to - from);
        (f64::from(frame.top) + f64::from(frame.height) * (1.0 - share)).round() as i32
    }
}
