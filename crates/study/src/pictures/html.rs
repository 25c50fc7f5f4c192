//! The report: one file with everything in it, readable without scripts and on paper.

use std::collections::{BTreeMap, BTreeSet};

use apprentice::plain;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::about::{About, Users};
use super::figures::{MEASURES, task_types};
use super::shares::{PUBLISHED, by_grammar, label};
use super::svg::{Picture, font_faces};
use crate::measures::{ALL, FEW, SummaryRow, Tables};

/// The other measures of a summary, with the names that people read.
const RATES: [(&str, &str); 4] = [
    ("understood_first_try", "Understood at first try"),
    ("reuse_rate", "Taught requests understood when they came again"),
    ("wrong_rate", "Wrong actions, of all utterances"),
    ("not_sure_rate", "Not sure, of all utterances"),
];

const STYLE: &str = "\
:root{color-scheme:light}
body{font-family:Roboto,system-ui,sans-serif;color:#222;background:#fff;line-height:1.5;\
max-width:66rem;margin:0 auto;padding:2rem 1.25rem 4rem}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 .5rem}
h2{font-size:1.35rem;margin:2.75rem 0 .75rem;border-top:1px solid #ddd;padding-top:1.25rem}
h3{font-size:1.05rem;margin:1.75rem 0 .4rem}
.who{border-left:.4rem solid #D55E00;background:#fdf3ea;padding:.75rem 1rem;margin:1.25rem 0}
.who.recorded{border-color:#0072B2;background:#eef5fa}
figure{margin:1.5rem 0}
figure svg{display:block;width:100%;height:auto;border:1px solid #e6e6e6}
figcaption{color:#444;font-size:.95rem;margin-top:.5rem}
pre{background:#f5f5f5;padding:.75rem 1rem;overflow-x:auto;white-space:pre-wrap;font-size:.9rem}
.wide{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.93rem}
caption{text-align:left;color:#444;padding-bottom:.35rem}
th,td{padding:.3rem .8rem;text-align:right;border-bottom:1px solid #e2e2e2;white-space:nowrap}
th:first-child,td:first-child{text-align:left;padding-left:0}
thead th{border-bottom:2px solid #888}
.soft{color:#595959}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1.25rem}
dt{color:#595959}dd{margin:0;overflow-wrap:anywhere}
@media print{body{max-width:none;padding:0}figure,table{break-inside:avoid}}
";

pub(super) fn page(tables: &Tables, about: &About, pictures: &[Picture]) -> String {
    let title = match about.is_simulated() {
        true => "A study with simulated users",
        false => "A study with recorded people",
    };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(font_faces())) (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (title) }
                    (who(about))
                    (what_was_run(tables, about))
                    h2 id="figures" { "Figures" }
                    @for picture in pictures { (figure(picture, about)) }
                    h2 id="tables" { "Tables" }
                    (measures(tables, about))
                    (grammar(tables, about))
                }
            }
        }
    };
    page.into_string() + "\n"
}

/// A text that somebody else chose: no character of it is hidden.
fn shown(text: &str) -> Markup {
    html! { (plain::escape_lines(text)) }
}

fn figure(picture: &Picture, about: &About) -> Markup {
    html! {
        figure id=(picture.name) {
            (PreEscaped(picture.inline()))
            figcaption { (shown(&picture.title)) ". " (shown(&about.participants())) }
        }
    }
}

fn who(about: &About) -> Markup {
    let (class, more) = match about.is_simulated() {
        true => (
            "who",
            "Nobody was asked: a program with stated habits took the part of each person. What it \
             shows is how the system behaves, and not what people would do.",
        ),
        false => (
            "who recorded",
            "The sentences are those that people wrote; when they were not understood, the \
             fallback to primitives was played by a program.",
        ),
    };
    html! { p class=(class) { strong { (shown(&about.participants())) } " " (more) } }
}

fn what_was_run(tables: &Tables, about: &About) -> Markup {
    let mut lines = vec![("Program", about.program.clone()), ("Seed", about.seed.to_string())];
    for condition in &about.conditions {
        lines.push(("Condition", format!("{}, recipe {}", condition.name, condition.recipe)));
    }
    lines.push(match &about.users {
        Users::SimulatedPerType { task_types, .. } | Users::Simulated { task_types, .. } => {
            ("Task types", task_types.join(", "))
        }
        Users::Recorded { corpus, people, .. } => {
            ("Corpus", format!("SHA-256 or digest {corpus}; people: {people}"))
        }
    });
    let people: BTreeSet<(&str, &str)> =
        tables.episodes.iter().map(|row| (row.condition.as_str(), row.user.as_str())).collect();
    let finished = tables.episodes.iter().filter(|row| row.finished).count();
    let size = format!(
        "{} people × conditions, {} episodes ({finished} reached their goal), {} utterances",
        people.len(),
        tables.episodes.len(),
        tables.utterances.len()
    );
    lines.push(("Size", size));
    html! {
        h2 id="run" { "What was run" }
        dl {
            @for (name, value) in &lines { dt { (name) } dd { (shown(value)) } }
        }
        p { "The command that made it:" }
        pre { (shown(&about.command())) }
    }
}

/// A table for each measure over all types, and one for each task type below it.
fn measures(tables: &Tables, about: &About) -> Markup {
    let of = |task_type: &str, key: &str, caption: &str, places: usize| {
        table(tables, about, task_type, key, caption, places)
    };
    let kinds = task_types(tables);
    let names = MEASURES.iter().map(|measure| (measure.key, measure.title)).chain(RATES);
    let apart: Vec<Markup> = names.filter_map(|(key, title)| of(FEW, key, title, 3)).collect();
    html! {
        @for measure in &MEASURES {
            @let caption = format!("{}: {}; mean ± standard deviation", measure.title, measure.unit);
            @let kinds: Vec<Markup> = kinds.iter().filter_map(|kind| {
                of(kind, measure.key, &format!("{}: task type {kind}", measure.title), 2)
            }).collect();
            h3 { (measure.title) }
            @if let Some(all) = of(ALL, measure.key, &caption, 2) { (all) }
            @if !kinds.is_empty() {
                details { summary { "By task type" } @for table in kinds { (table) } }
            }
        }
        @for (key, title) in RATES {
            @if let Some(all) = of(ALL, key, &format!("{title}; shares"), 3) {
                h3 { (title) }
                (all)
            }
        }
        @if !apart.is_empty() {
            h3 { "People with fewer than 5 episodes" }
            p { "They are in no figure and no table above." }
            @for table in apart { (table) }
        }
    }
}

/// Conditions by episodes; none where there is no row.
fn table(
    tables: &Tables,
    about: &About,
    task_type: &str,
    measure: &str,
    caption: &str,
    places: usize,
) -> Option<Markup> {
    let rows = tables.summary.iter();
    let rows: Vec<&SummaryRow> =
        rows.filter(|row| row.task_type == task_type && row.measure == measure).collect();
    let episodes: BTreeSet<u32> = rows.iter().map(|row| row.episode).collect();
    let mut conditions: BTreeMap<(usize, &str), BTreeMap<u32, &SummaryRow>> = BTreeMap::new();
    for row in &rows {
        let key = (about.rank(&row.condition), row.condition.as_str());
        conditions.entry(key).or_default().insert(row.episode, row);
    }
    let table = html! {
        div class="wide" {
            table {
                caption { (shown(caption)) }
                thead {
                    tr {
                        th scope="col" { "condition" }
                        th scope="col" { "users" }
                        @for episode in &episodes { th scope="col" { "episode " (episode) } }
                    }
                }
                tbody {
                    @for ((_, condition), by_episode) in &conditions {
                        tr {
                            th scope="row" { (shown(condition)) }
                            td { (users(by_episode)) }
                            @for episode in &episodes {
                                td { (cell(by_episode.get(episode).copied(), places)) }
                            }
                        }
                    }
                }
            }
        }
    };
    (!rows.is_empty()).then_some(table)
}

fn users(by_episode: &BTreeMap<u32, &SummaryRow>) -> String {
    let users: BTreeSet<u32> = by_episode.values().map(|row| row.users).collect();
    match (users.first(), users.last()) {
        (Some(low), Some(high)) if low != high => format!("{low}–{high}"),
        (Some(one), _) => one.to_string(),
        _ => String::new(),
    }
}

fn cell(row: Option<&SummaryRow>, places: usize) -> Markup {
    let Some(SummaryRow { mean, sd, .. }) = row else { return html! { "–" } };
    html! {
        (format!("{mean:.places$}"))
        @if let Some(sd) = sd { " " span class="soft" { (format!("± {sd:.places$}")) } }
    }
}

fn grammar(tables: &Tables, about: &About) -> Markup {
    let found = by_grammar(tables, about);
    if found.is_empty() {
        return html! {};
    }
    let published = ("the paper, people (published)".to_owned(), PUBLISHED.0, PUBLISHED.1);
    html! {
        h3 { "Parses that the grammar answered" }
        div class="wide" {
            table {
                caption { "Of all parses that led to a program" }
                thead { tr { th scope="col" { "who" } th scope="col" { "by the grammar" } } }
                tbody {
                    @for (name, by, all) in std::iter::once(published).chain(found) {
                        tr { th scope="row" { (shown(&name)) } td { (label(by, all)) } }
                    }
                }
            }
        }
    }
}
