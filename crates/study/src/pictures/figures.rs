//! The figures over episodes: in general, by task type, the paper's case, and sentences understood
//! at first try.

use std::collections::{BTreeMap, BTreeSet};

use super::about::About;
use super::canvas::{Canvas, Hand, Side, WIDTH, width_of};
use super::chart::{BARS_MAX, Chart, Curve, Frame, Point};
use super::scale::Scale;
use super::style::{INK, SOFT, look};
use super::svg::Picture;
use crate::measures::{ALL, FEW, Tables};

/// A measure as it is drawn.
pub(super) struct Measure {
    /// In the tables.
    pub key: &'static str,
    pub title: &'static str,
    pub unit: &'static str,
    /// Whether its axis begins at 0.
    from_zero: bool,
}

/// The paper's three.
pub(super) const MEASURES: [Measure; 3] = [
    Measure {
        key: "examples_taught",
        title: "Examples taught",
        unit: "seeds and what was taught",
        from_zero: false,
    },
    Measure {
        key: "complexity",
        title: "Program complexity per turn",
        unit: "primitives per utterance",
        from_zero: true,
    },
    Measure {
        key: "normalised_length",
        title: "Normalised episode length",
        unit: "utterances / fewest primitives",
        from_zero: true,
    },
];

const HEAD: Hand = Hand { size: 44, colour: INK, bold: true };
const SAID: Hand = Hand { size: 27, colour: SOFT, bold: false };
const NAME: Hand = Hand { size: 30, colour: INK, bold: false };
const ROW: Hand = Hand { size: 32, colour: INK, bold: true };
const LEFT: i32 = 110;

/// The paper's general figure.
pub(super) fn general(tables: &Tables, about: &About) -> Result<Option<Picture>, String> {
    three(tables, about, "general", "Three measures over the episodes", ALL)
}

/// The paper's case study: pick, cool and place.
pub(super) fn case_study(tables: &Tables, about: &About) -> Result<Option<Picture>, String> {
    let kinds = task_types(tables);
    match kinds.iter().find(|kind| kind.contains("cool")) {
        Some(kind) => {
            three(tables, about, "case-study", "The case study: pick, cool and place", kind)
        }
        None => Ok(None),
    }
}

fn three(
    tables: &Tables,
    about: &About,
    name: &str,
    title: &str,
    task_type: &str,
) -> Result<Option<Picture>, String> {
    let conditions = conditions(tables, about, &[task_type]);
    let last = last_episode(tables, &[task_type]);
    if conditions.is_empty() {
        return Ok(None);
    }
    let height = 920;
    let drawn = Canvas::draw(height, |canvas| {
        let note = spread_sentence(tables, &[task_type], &MEASURES.map(|m| m.key), last);
        head(canvas, title, about, &conditions, &note)?;
        for (column, measure) in MEASURES.iter().enumerate() {
            let curves = curves(tables, &conditions, task_type, measure.key);
            let scale = scale(measure, &[&curves]);
            let frame = column_frame(column, 400, 400);
            chart(measure, &scale, last, &curves, true, true).draw(canvas, frame)?;
        }
        Ok(())
    })?;
    let told = told(tables, about, &conditions, task_type);
    Ok(Some(Picture::finish(name, title, &told, &drawn)))
}

/// One row of three charts for each task type; a measure has one axis throughout.
pub(super) fn by_task_type(tables: &Tables, about: &About) -> Result<Option<Picture>, String> {
    let kinds = task_types(tables);
    let names: Vec<&str> = kinds.iter().map(String::as_str).collect();
    let conditions = conditions(tables, about, &names);
    if conditions.is_empty() || kinds.len() < 2 {
        return Ok(None);
    }
    let (last, title) = (last_episode(tables, &names), "Three measures by task type");
    // Below the names of the measures each row begins with its own name.
    let (row, above) = (360, 400);
    let height = above + row * kinds.len() as i32 + 130;
    let drawn = Canvas::draw(height, |canvas| {
        let note = spread_sentence(tables, &names, &MEASURES.map(|m| m.key), last);
        head(canvas, title, about, &conditions, &note)?;
        for (column, measure) in MEASURES.iter().enumerate() {
            let of_kind = |kind: &String| curves(tables, &conditions, kind, measure.key);
            let all: Vec<Vec<Curve>> = kinds.iter().map(of_kind).collect();
            let scale = scale(measure, &all.iter().collect::<Vec<_>>());
            let names = chart(measure, &scale, last, &[], true, false);
            names.draw_names(canvas, column_frame(column, above, 0))?;
            for (place, (kind, curves)) in kinds.iter().zip(&all).enumerate() {
                let top = above + 60 + row * place as i32;
                let frame = column_frame(column, top, row - 130);
                let is_last = place + 1 == kinds.len();
                chart(measure, &scale, last, curves, false, is_last).draw(canvas, frame)?;
                if column == 0 {
                    canvas.text(kind, (LEFT - 70, top - 30), Side::Start, ROW)?;
                }
            }
        }
        Ok(())
    })?;
    let parts: Vec<String> = kinds
        .iter()
        .map(|kind| format!("{kind}: {}", told_values(tables, &conditions, kind)))
        .collect();
    let told = format!("{} {}", about.participants(), parts.join(" "));
    Ok(Some(Picture::finish("task-types", title, &told, &drawn)))
}

/// The share of sentences that were understood at first try.
pub(super) fn first_try(tables: &Tables, about: &About) -> Result<Option<Picture>, String> {
    const KEY: &str = "understood_first_try";
    let has_any = tables.summary.iter().any(|row| row.measure == KEY && row.task_type == ALL);
    let conditions = conditions(tables, about, &[ALL]);
    if !has_any || conditions.is_empty() {
        return Ok(None);
    }
    let (last, title) = (last_episode(tables, &[ALL]), "Understood at first try");
    let curves = curves(tables, &conditions, ALL, KEY);
    let drawn = Canvas::draw(980, |canvas| {
        let note = spread_sentence(tables, &[ALL], &[KEY], last);
        head(canvas, title, about, &conditions, &note)?;
        let frame = Frame { left: LEFT + 40, top: 380, width: WIDTH - LEFT - 110, height: 480 };
        let scale = Scale::percent();
        let unit = "of the requests that were said for the first time, right at once";
        Chart {
            title: "Share of requests",
            unit,
            scale: &scale,
            last_episode: last,
            curves: &curves,
            names_episodes: true,
        }
        .draw(canvas, frame)
    })?;
    let told =
        format!("{} {}", about.participants(), sentence(tables, &conditions, ALL, KEY, title));
    Ok(Some(Picture::finish("first-try", title, &told, &drawn)))
}

/// Title, what was run, and which line is which.
pub(super) fn head(
    canvas: &Canvas<'_>,
    title: &str,
    about: &About,
    conditions: &[String],
    note: &str,
) -> Result<(), String> {
    let left = LEFT - 70;
    canvas.text(title, (left, 74), Side::Start, HEAD)?;
    canvas.text(&about.participants(), (left, 124), Side::Start, SAID)?;
    canvas.text(note, (left, 162), Side::Start, SAID)?;
    let mut x = left;
    for (number, condition) in conditions.iter().enumerate() {
        canvas.curve(&[(x, 226), (x + 96, 226)], look(number))?;
        canvas.marker((x + 48, 226), look(number))?;
        canvas.text(condition, (x + 114, 236), Side::Start, NAME)?;
        x += 114 + width_of(condition, NAME.size) + 60;
    }
    Ok(())
}

/// Over how many users, and what the bars or bands are.
fn spread_sentence(
    tables: &Tables,
    task_types: &[&str],
    drawn: &[&str],
    last_episode: u32,
) -> String {
    let rows = tables.summary.iter().filter(|row| {
        task_types.contains(&row.task_type.as_str()) && drawn.contains(&row.measure.as_str())
    });
    let users: BTreeSet<u32> = rows.map(|row| row.users).collect();
    let users = match (users.first(), users.last()) {
        (Some(1), Some(1)) => "1 user".to_owned(),
        (Some(low), Some(high)) if low != high => format!("{low} to {high} users"),
        (Some(one), _) => format!("{one} users"),
        (None, _) => "users".to_owned(),
    };
    let mark = if last_episode > BARS_MAX { "bands" } else { "bars" };
    format!(
        "Means over {users} of each condition; {mark} are one standard deviation of the sample up \
         and down."
    )
}

fn column_frame(column: usize, top: i32, height: i32) -> Frame {
    let step = (WIDTH - 40) / 3;
    Frame { left: LEFT + column as i32 * step, top, width: step - 130, height }
}

fn chart<'a>(
    measure: &'a Measure,
    scale: &'a Scale,
    last_episode: u32,
    curves: &'a [Curve],
    has_title: bool,
    names_episodes: bool,
) -> Chart<'a> {
    let title = if has_title { measure.title } else { "" };
    Chart { title, unit: measure.unit, scale, last_episode, curves, names_episodes }
}

/// An axis that holds the means and spreads of all these curves.
fn scale(measure: &Measure, charts: &[&Vec<Curve>]) -> Scale {
    let points = || charts.iter().flat_map(|curves| curves.iter()).flat_map(|c| &c.points);
    let ends = |point: &Point| {
        let sd = point.sd.unwrap_or(0.0);
        (point.mean - sd, point.mean + sd)
    };
    let high = points().map(|point| ends(point).1).fold(0.0, f64::max);
    let low = points().map(|point| ends(point).0.max(0.0)).fold(high, f64::min);
    Scale::around(if measure.from_zero { 0.0 } else { low }, high, 5)
}

pub(super) fn task_types(tables: &Tables) -> Vec<String> {
    let kinds: BTreeSet<&String> = tables.summary.iter().map(|row| &row.task_type).collect();
    kinds.into_iter().filter(|kind| *kind != ALL && *kind != FEW).cloned().collect()
}

/// The conditions that have rows of these task types, in the order of the study.
fn conditions(tables: &Tables, about: &About, task_types: &[&str]) -> Vec<String> {
    let rows = tables.summary.iter().filter(|row| task_types.contains(&row.task_type.as_str()));
    let names: BTreeSet<&String> = rows.map(|row| &row.condition).collect();
    let mut names: Vec<String> = names.into_iter().cloned().collect();
    names.sort_by_key(|name| about.rank(name));
    names
}

fn last_episode(tables: &Tables, task_types: &[&str]) -> u32 {
    let rows = tables.summary.iter().filter(|row| task_types.contains(&row.task_type.as_str()));
    rows.map(|row| row.episode).max().unwrap_or(1)
}

fn curves(tables: &Tables, conditions: &[String], task_type: &str, measure: &str) -> Vec<Curve> {
    let points = |condition: &String| -> Vec<Point> {
        let rows = tables.summary.iter().filter(|row| {
            row.condition == *condition && row.task_type == task_type && row.measure == measure
        });
        let by_episode: BTreeMap<u32, Point> = rows
            .map(|row| {
                let point = Point { episode: row.episode, mean: row.mean, sd: row.sd };
                (row.episode, point)
            })
            .collect();
        by_episode.into_values().collect()
    };
    let numbered = conditions.iter().enumerate();
    numbered.map(|(look, condition)| Curve { look, points: points(condition) }).collect()
}

/// What a chart of three shows, for those who do not see it.
fn told(tables: &Tables, about: &About, conditions: &[String], task_type: &str) -> String {
    format!("{} {}", about.participants(), told_values(tables, conditions, task_type))
}

fn told_values(tables: &Tables, conditions: &[String], task_type: &str) -> String {
    let sentence = |m: &Measure| sentence(tables, conditions, task_type, m.key, m.title);
    MEASURES.iter().map(sentence).collect::<Vec<_>>().join(" ")
}

/// First and last value of each condition.
fn sentence(
    tables: &Tables,
    conditions: &[String],
    task_type: &str,
    measure: &str,
    title: &str,
) -> String {
    let curves = curves(tables, conditions, task_type, measure);
    let parts: Vec<String> = conditions
        .iter()
        .zip(&curves)
        .filter_map(|(condition, curve)| {
            let (first, last) = (curve.points.first()?, curve.points.last()?);
            Some(format!(
                "{condition} from {:.2} in episode {} to {:.2} in episode {}",
                first.mean, first.episode, last.mean, last.episode
            ))
        })
        .collect();
    format!("{title}: {}.", parts.join("; "))
}
