//! Who answered: the grammar or the model behind it, next to what the paper published.

use std::collections::BTreeSet;

use plotters::style::RGBColor;

use super::about::About;
use super::canvas::{Canvas, Hand, Side, WIDTH, width_of};
use super::style::{INK, LOOKS, SOFT};
use super::svg::Picture;
use crate::measures::Tables;

/// Parses of the paper's baseline that its grammar answered, and all of them (the paper, section 4).
pub(super) const PUBLISHED: (u32, u32) = (713, 793);
/// The name of the grammar in the tables.
pub(super) const GRAMMAR: &str = "grammar";

const HEAD: Hand = Hand { size: 44, colour: INK, bold: true };
const SAID: Hand = Hand { size: 27, colour: SOFT, bold: false };
const NAME: Hand = Hand { size: 30, colour: INK, bold: false };
const INSIDE: Hand = Hand { size: 28, colour: RGBColor(255, 255, 255), bold: true };
const OTHERS: RGBColor = RGBColor(0xC4, 0xC4, 0xC4);

/// Parses of one condition that the grammar answered, and all of them.
pub(super) fn by_grammar(tables: &Tables, about: &About) -> Vec<(String, u32, u32)> {
    let with_grammar = tables.answered.iter().filter(|row| row.answered_by == GRAMMAR);
    let names: BTreeSet<&String> = with_grammar.map(|row| &row.condition).collect();
    let mut names: Vec<&String> = names.into_iter().collect();
    names.sort_by_key(|name| about.rank(name));
    let of = |name: &String| {
        let rows = || tables.answered.iter().filter(|row| row.condition == *name);
        let grammar = rows().filter(|row| row.answered_by == GRAMMAR);
        let grammar = grammar.map(|row| row.parses).sum();
        (name.clone(), grammar, rows().map(|row| row.parses).sum())
    };
    names.into_iter().map(of).collect()
}

/// One bar for the paper and one for each condition that has a grammar.
pub(super) fn answered(tables: &Tables, about: &About) -> Result<Option<Picture>, String> {
    let found = by_grammar(tables, about);
    if found.is_empty() {
        return Ok(None);
    }
    let title = "Parses that the grammar answered";
    let published = ("the paper, people".to_owned(), PUBLISHED.0, PUBLISHED.1);
    let who = if about.is_simulated() { "simulated users" } else { "recorded people" };
    let ours = found.into_iter().map(|(name, by, all)| (format!("{name}, {who}"), by, all));
    let bars: Vec<(String, u32, u32)> = std::iter::once(published).chain(ours).collect();
    let widest = bars.iter().map(|(name, ..)| width_of(name, NAME.size)).max().unwrap_or(0);
    let (left, top, row) = (40 + widest + 30, 270, 110);
    let right = WIDTH - 60;
    let height = top + row * bars.len() as i32 + 40;
    let drawn = Canvas::draw(height, |canvas| {
        canvas.text(title, (40, 74), Side::Start, HEAD)?;
        canvas.text(&about.participants(), (40, 124), Side::Start, SAID)?;
        let note =
            "All parses that led to a program; the rest were the model's behind the grammar.";
        canvas.text(note, (40, 162), Side::Start, SAID)?;
        for (x, name, colour) in
            [(40, "the grammar", LOOKS[0].colour), (300, "the model behind it", OTHERS)]
        {
            canvas.rectangle((x, 204), (x + 34, 238), colour)?;
            canvas.text(name, (x + 48, 232), Side::Start, NAME)?;
        }
        for (place, (name, by, all)) in bars.iter().enumerate() {
            let y = top + row * place as i32;
            let share = f64::from(*by) / f64::from((*all).max(1));
            let end = left + (f64::from(right - left) * share).round() as i32;
            canvas.text(name, (left - 24, y + 45), Side::End, NAME)?;
            canvas.rectangle((left, y), (right, y + 70), OTHERS)?;
            canvas.rectangle((left, y), (end, y + 70), LOOKS[0].colour)?;
            let label = label(*by, *all);
            let fits = end - left > width_of(&label, INSIDE.size) + 40;
            match fits {
                true => canvas.text(&label, (left + 20, y + 45), Side::Start, INSIDE)?,
                false => {
                    let dark = Hand { colour: INK, ..INSIDE };
                    canvas.text(&label, (end + 20, y + 45), Side::Start, dark)?;
                }
            }
        }
        Ok(())
    })?;
    let parts: Vec<String> =
        bars.iter().map(|(name, by, all)| format!("{name}: {}.", label(*by, *all))).collect();
    let told = format!("{} {}", about.participants(), parts.join(" "));
    Ok(Some(Picture::finish("answered-by", title, &told, &drawn)))
}

/// `713 of 793 (89.9 %)`.
pub(super) fn label(by: u32, all: u32) -> String {
    let share = 100.0 * f64::from(by) / f64::from(all.max(1));
    format!("{by} of {all} ({share:.1} %)")
}
