//! The report: one file with everything in it, readable without scripts and on paper.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::about::{About, Users};
use super::figures::{MEASURES, task_types};
use super::shares::{PUBLISHED, by_grammar, label};
use super::svg::{Picture, escaped, font_faces};
use crate::measures::{SummaryRow, Tables};

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
    let mut out = String::new();
    let title = match about.is_simulated() {
        true => "A study with simulated users",
        false => "A study with recorded people",
    };
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{}\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n",
        font_faces()
    );
    out.push_str(&who(about));
    out.push_str(&what_was_run(tables, about));
    out.push_str("<h2 id=\"figures\">Figures</h2>\n");
    for picture in pictures {
        let _ = write!(
            out,
            "<figure id=\"{}\">\n{}<figcaption>{}. {}</figcaption>\n</figure>\n",
            picture.name,
            picture.inline(),
            escaped(&picture.title),
            escaped(&about.participants())
        );
    }
    out.push_str("<h2 id=\"tables\">Tables</h2>\n");
    out.push_str(&measures(tables, about));
    out.push_str(&grammar(tables, about));
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

fn who(about: &About) -> String {
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
    format!("<p class=\"{class}\"><strong>{}</strong> {more}</p>\n", escaped(&about.participants()))
}

fn what_was_run(tables: &Tables, about: &About) -> String {
    let mut out = String::from("<h2 id=\"run\">What was run</h2>\n<dl>\n");
    let mut line = |name: &str, value: &str| {
        let _ = writeln!(out, "<dt>{name}</dt><dd>{}</dd>", escaped(value));
    };
    line("Program", &about.program);
    line("Seed", &about.seed.to_string());
    for condition in &about.conditions {
        line("Condition", &format!("{}, recipe {}", condition.name, condition.recipe));
    }
    match &about.users {
        Users::SimulatedPerType { task_types, .. } | Users::Simulated { task_types, .. } => {
            line("Task types", &task_types.join(", "));
        }
        Users::Recorded { corpus, people, .. } => {
            line("Corpus", &format!("SHA-256 or digest {corpus}; people: {people}"));
        }
    }
    let people: BTreeSet<(&str, &str)> =
        tables.episodes.iter().map(|row| (row.condition.as_str(), row.user.as_str())).collect();
    let finished = tables.episodes.iter().filter(|row| row.finished).count();
    line(
        "Size",
        &format!(
            "{} people × conditions, {} episodes ({finished} reached their goal), {} utterances",
            people.len(),
            tables.episodes.len(),
            tables.utterances.len()
        ),
    );
    let _ = write!(
        out,
        "</dl>\n<p>The command that made it:</p>\n<pre>{}</pre>\n",
        escaped(&about.command())
    );
    out
}

/// A table for each measure over all types, and one for each task type below it.
fn measures(tables: &Tables, about: &About) -> String {
    let mut out = String::new();
    let few = "under_5_episodes";
    for measure in &MEASURES {
        let caption = format!("{}: {}; mean ± standard deviation", measure.title, measure.unit);
        let all = table(tables, about, "all", measure.key, &caption, 2);
        let kinds: Vec<String> = task_types(tables)
            .iter()
            .map(|kind| {
                let caption = format!("{}: task type {kind}", measure.title);
                table(tables, about, kind, measure.key, &caption, 2)
            })
            .collect();
        let _ = write!(out, "<h3>{}</h3>\n{all}", escaped(measure.title));
        if kinds.iter().any(|table| !table.is_empty()) {
            let _ = write!(
                out,
                "<details>\n<summary>By task type</summary>\n{}</details>\n",
                kinds.concat()
            );
        }
    }
    for (key, title) in RATES {
        let all = table(tables, about, "all", key, &format!("{title}; shares"), 3);
        if !all.is_empty() {
            let _ = write!(out, "<h3>{title}</h3>\n{all}");
        }
    }
    let apart: Vec<String> = MEASURES
        .iter()
        .map(|measure| (measure.key, measure.title))
        .chain(RATES)
        .map(|(key, title)| table(tables, about, few, key, title, 3))
        .collect();
    if apart.iter().any(|table| !table.is_empty()) {
        let _ = write!(
            out,
            "<h3>People with fewer than 5 episodes</h3>\n<p>They are in no figure and no table \
             above.</p>\n{}",
            apart.concat()
        );
    }
    out
}

/// Conditions by episodes; empty where there is no row.
fn table(
    tables: &Tables,
    about: &About,
    task_type: &str,
    measure: &str,
    caption: &str,
    places: usize,
) -> String {
    let rows = tables.summary.iter();
    let rows: Vec<&SummaryRow> =
        rows.filter(|row| row.task_type == task_type && row.measure == measure).collect();
    let episodes: BTreeSet<u32> = rows.iter().map(|row| row.episode).collect();
    let mut conditions: BTreeMap<(usize, &str), BTreeMap<u32, &SummaryRow>> = BTreeMap::new();
    for row in &rows {
        let key = (about.rank(&row.condition), row.condition.as_str());
        conditions.entry(key).or_default().insert(row.episode, row);
    }
    if rows.is_empty() {
        return String::new();
    }
    let mut out = format!(
        "<div class=\"wide\"><table>\n<caption>{}</caption>\n<thead><tr>\
         <th scope=\"col\">condition</th><th scope=\"col\">users</th>",
        escaped(caption)
    );
    for episode in &episodes {
        let _ = write!(out, "<th scope=\"col\">episode {episode}</th>");
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for ((_, condition), by_episode) in &conditions {
        let users: BTreeSet<u32> = by_episode.values().map(|row| row.users).collect();
        let users = match (users.first(), users.last()) {
            (Some(low), Some(high)) if low != high => format!("{low}–{high}"),
            (Some(one), _) => one.to_string(),
            _ => String::new(),
        };
        let _ = write!(out, "<tr><th scope=\"row\">{}</th><td>{users}</td>", escaped(condition));
        for episode in &episodes {
            match by_episode.get(episode) {
                Some(SummaryRow { mean, sd: Some(sd), .. }) => {
                    let _ = write!(
                        out,
                        "<td>{mean:.places$} <span class=\"soft\">± {sd:.places$}</span></td>"
                    );
                }
                Some(SummaryRow { mean, sd: None, .. }) => {
                    let _ = write!(out, "<td>{mean:.places$}</td>");
                }
                None => out.push_str("<td>–</td>"),
            }
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
    out
}

fn grammar(tables: &Tables, about: &About) -> String {
    let found = by_grammar(tables, about);
    if found.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<h3>Parses that the grammar answered</h3>\n<div class=\"wide\"><table>\n\
         <caption>Of all parses that led to a program</caption>\n<thead><tr>\
         <th scope=\"col\">who</th><th scope=\"col\">by the grammar</th></tr></thead>\n<tbody>\n",
    );
    let published = ("the paper, people (published)".to_owned(), PUBLISHED.0, PUBLISHED.1);
    for (name, by, all) in std::iter::once(published).chain(found) {
        let _ = writeln!(
            out,
            "<tr><th scope=\"row\">{}</th><td>{}</td></tr>",
            escaped(&name),
            label(by, all)
        );
    }
    out.push_str("</tbody>\n</table></div>\n");
    out
}
