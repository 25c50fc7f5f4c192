//! Pictures of small tables written by hand.

use resvg::usvg::roxmltree::{Document, Node};

use super::style::{CURVE_WIDTH, LOOKS, hex, look};
use super::*;
use crate::cells;

const TASK_TYPES: [&str; 2] = ["clean", "pick_cool_then_place"];
const CONDITIONS: [&str; 3] = ["paper", "default", "seq2seq-grammar"];

fn about() -> About {
    About {
        seed: 7,
        program: "apprentice 0.0.0".to_owned(),
        users: Users::SimulatedPerType {
            users: 3,
            task_types: TASK_TYPES.map(str::to_owned).to_vec(),
            episodes: 4,
        },
        conditions: CONDITIONS
            .map(|name| Condition { name: name.to_owned(), recipe: "ab".repeat(32) })
            .to_vec(),
    }
}

/// A value for each place, no two alike.
fn mean_of(condition: usize, task_type: usize, episode: u32, measure: &str) -> f64 {
    let bend = f64::from(episode) * (1.0 + condition as f64 / 3.0 + task_type as f64 / 11.0);
    match measure {
        "examples_taught" => 44.0 + 2.0 * bend,
        "complexity" => 0.8 + 0.3 * bend,
        "normalised_length" => 1.4 - 0.11 * bend,
        _ => (0.2 + 0.09 * bend).min(1.0),
    }
}

fn tables() -> Tables {
    let mut text = "condition,task_type,episode,measure,users,mean,sd\n".to_owned();
    for (condition, name) in CONDITIONS.iter().enumerate() {
        for (task_type, kind) in ["all"].iter().chain(&TASK_TYPES).enumerate() {
            for episode in 1..=4 {
                for measure in
                    ["examples_taught", "complexity", "normalised_length", "understood_first_try"]
                {
                    let mean = mean_of(condition, task_type, episode, measure);
                    text.push_str(&format!(
                        "{name},{kind},{episode},{measure},3,{mean:.4},0.1500\n"
                    ));
                }
            }
        }
    }
    Tables {
        summary: cells::read(&text).unwrap(),
        answered: cells::read(
            "condition,answered_by,parses,share\nseq2seq-grammar,grammar,30,0.7500\n\
             seq2seq-grammar,model,10,0.2500\npaper,exemplar,20,1.0000\n",
        )
        .unwrap(),
        ..Tables::default()
    }
}

fn picture(name: &str) -> Picture {
    let pictures = pictures(&tables(), &about()).unwrap();
    pictures.into_iter().find(|picture| picture.name == name).unwrap()
}

fn number(node: Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

/// A curve as drawn: its colour and its points.
fn curves(svg: &Document<'_>) -> Vec<(String, Vec<(f64, f64)>)> {
    let is_curve = |node: &Node<'_, '_>| {
        node.has_tag_name("polyline")
            && node.attribute("stroke-width") == Some(&CURVE_WIDTH.to_string())
    };
    let point = |pair: &str| {
        let (x, y) = pair.split_once(',').unwrap();
        (x.parse().unwrap(), y.parse().unwrap())
    };
    let read = |node: Node<'_, '_>| {
        let points = node.attribute("points").unwrap().split_whitespace();
        (node.attribute("stroke").unwrap().to_owned(), points.map(point).collect())
    };
    svg.descendants().filter(is_curve).map(read).collect()
}

/// The vertical axes from the left: each a line through two of its written numbers, as
/// (left end of the rules, value at y = 0, value per unit).
fn axes(svg: &Document<'_>) -> Vec<(f64, f64, f64)> {
    let rules = svg.descendants().filter(|node| {
        node.has_tag_name("polyline") && node.attribute("stroke") == Some(&hex(style::RULE))
    });
    let mut found: Vec<(f64, Vec<(f64, f64)>)> = Vec::new();
    for rule in rules {
        let points = rule.attribute("points").unwrap().split_whitespace().next().unwrap();
        let (x, y) = points.split_once(',').unwrap();
        let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
        // The number stands to the left of its rule, its baseline a little below.
        let label = svg.descendants().find(|node| {
            node.has_tag_name("text")
                && node.attribute("text-anchor") == Some("end")
                && (number(*node, "x") - (x - 16.0)).abs() < 1.0
                && (number(*node, "y") + 21.0 - (y + 10.0)).abs() < 2.0
        });
        let text = label.unwrap().text().unwrap().trim().to_owned();
        let value: f64 = match text.strip_suffix(" %") {
            Some(percent) => percent.parse::<f64>().unwrap() / 100.0,
            None => text.parse().unwrap(),
        };
        match found.iter_mut().find(|(left, _)| *left == x) {
            Some((_, ticks)) => ticks.push((y, value)),
            None => found.push((x, vec![(y, value)])),
        }
    }
    let line = |(left, ticks): (f64, Vec<(f64, f64)>)| {
        let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
        let slope = (last.1 - first.1) / (last.0 - first.0);
        (left, first.1 - slope * first.0, slope)
    };
    found.into_iter().map(line).collect()
}

/// Reads the values out of the drawing by the numbers on its axes.
fn check_values(picture: &Picture, task_type: usize, measures: &[&str]) {
    let text = picture.alone();
    let svg = Document::parse(&text).unwrap();
    let axes = axes(&svg);
    assert_eq!(axes.len(), measures.len(), "{}", picture.name);
    // The curves of the legend have two points and stand above every axis.
    let curves: Vec<_> = curves(&svg).into_iter().filter(|(_, points)| points.len() == 4).collect();
    assert_eq!(curves.len(), measures.len() * CONDITIONS.len());
    for (place, (stroke, points)) in curves.iter().enumerate() {
        let (measure, condition) = (place / CONDITIONS.len(), place % CONDITIONS.len());
        assert_eq!(*stroke, hex(look(condition).colour));
        let (left, zero, slope) = axes[measure];
        for (episode, (x, y)) in (1..).zip(points) {
            assert!(*x > left, "{x} stands right of its axis at {left}");
            let drawn = zero + slope * y;
            let meant = mean_of(condition, task_type, episode, measures[measure]);
            // Half a unit of the sheet, and the four places of the table.
            let close = slope.abs() * 0.51 + 0.0001;
            assert!((drawn - meant).abs() <= close, "{}: {drawn} for {meant}", measures[measure]);
        }
    }
}

#[test]
fn every_value_stands_in_the_picture_where_its_axis_says() {
    let three = ["examples_taught", "complexity", "normalised_length"];
    check_values(&picture("general"), 0, &three);
    check_values(&picture("case-study"), 2, &three);
    check_values(&picture("first-try"), 0, &["understood_first_try"]);
    let text = picture("task-types").alone();
    let all = curves(&Document::parse(&text).unwrap());
    let drawn = all.iter().filter(|(_, points)| points.len() == 4).count();
    assert_eq!(drawn, TASK_TYPES.len() * three.len() * CONDITIONS.len());
}

#[test]
fn spreads_are_one_standard_deviation_up_and_down() {
    let text = picture("general").alone();
    let svg = Document::parse(&text).unwrap();
    let (_, _, slope) = axes(&svg)[1];
    let width = style::BAR_WIDTH.to_string();
    let bars = svg.descendants().filter(|node| {
        node.has_tag_name("polyline")
            && node.attribute("stroke-width") == Some(&width)
            && node.attribute("stroke") == Some(&hex(LOOKS[0].colour))
    });
    let heights: Vec<f64> = bars
        .filter_map(|node| {
            let mut ends = node.attribute("points").unwrap().split_whitespace();
            let mut end = || ends.next()?.split_once(',');
            let (one, other) = (end()?, end()?);
            let y = |end: (&str, &str)| end.1.parse::<f64>().unwrap();
            (one.0 == other.0).then(|| (y(one) - y(other)) * slope.abs())
        })
        .collect();
    // Four of the complexity among the twelve bars of the first condition.
    let right = heights.iter().filter(|height| (**height - 0.3).abs() < slope.abs() * 1.1).count();
    assert_eq!((heights.len(), right), (12, 4), "{heights:?}");
}

#[test]
fn the_same_tables_give_the_same_bytes_and_every_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let read = |paths: &[PathBuf]| -> Vec<(String, Vec<u8>)> {
        let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        paths.iter().map(|path| (name(path), std::fs::read(path).unwrap())).collect()
    };
    let once = read(&draw(&tables(), &about(), folder.path()).unwrap());
    let twice = read(&draw(&tables(), &about(), folder.path()).unwrap());
    assert!(once == twice, "drawn twice, other bytes");
    let names: Vec<&str> = once.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        [
            "general.svg",
            "general.png",
            "case-study.svg",
            "case-study.png",
            "task-types.svg",
            "task-types.png",
            "first-try.svg",
            "first-try.png",
            "answered-by.svg",
            "answered-by.png",
            "report.html"
        ]
    );
    for (name, bytes) in &once {
        if name.ends_with(".png") {
            assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 10_000, "{name}");
        }
    }
    let missing = draw(&tables(), &about(), &folder.path().join("nowhere"));
    assert!(missing.unwrap_err().to_string().contains("general.svg cannot be written"));
}

#[test]
fn every_picture_says_who_took_part_and_is_told_to_those_who_do_not_see_it() {
    let recorded = About {
        users: Users::Recorded {
            people: "all".to_owned(),
            corpus: "cd".repeat(32),
            episodes_max: 20,
        },
        ..about()
    };
    for about in [about(), recorded] {
        for picture in pictures(&tables(), &about).unwrap() {
            let text = picture.alone();
            let svg = Document::parse(&text).unwrap();
            let written = |tag: &str| {
                let node = svg.descendants().find(|node| node.has_tag_name(tag));
                node.unwrap().text().unwrap().to_owned()
            };
            assert_eq!(written("title"), picture.title);
            assert!(written("desc").starts_with(&about.participants()), "{}", picture.name);
            let texts = svg.descendants().filter(|node| node.has_tag_name("text"));
            let drawn: Vec<&str> = texts.map(|node| node.text().unwrap().trim()).collect();
            assert!(drawn.contains(&&*about.participants()), "{}: {drawn:?}", picture.name);
            assert!(written("style").contains("@font-face"));
            let over = "Means over 3 users of each condition; bars are one standard";
            let has_note = drawn.iter().any(|text| text.starts_with(over));
            assert!(has_note || picture.name == "answered-by", "{}: {drawn:?}", picture.name);
        }
    }
}

#[test]
fn conditions_have_their_dashes_in_the_order_of_the_study() {
    let text = picture("general").alone();
    let svg = Document::parse(&text).unwrap();
    for (number, colour) in LOOKS.iter().take(3).map(|look| hex(look.colour)).enumerate() {
        let curve = svg.descendants().find(|node| {
            node.attribute("stroke") == Some(&colour)
                && node.attribute("stroke-width") == Some(&CURVE_WIDTH.to_string())
        });
        let dashes = curve.unwrap().attribute("stroke-dasharray").unwrap_or("");
        assert_eq!(dashes, look(number).dashes);
    }
    let legend: Vec<&str> = svg
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .filter_map(|node| node.text())
        .map(str::trim)
        .filter(|text| CONDITIONS.contains(text))
        .collect();
    assert_eq!(legend, CONDITIONS);
}

#[test]
fn the_share_of_the_grammar_stands_next_to_the_published_one() {
    let text = picture("answered-by").alone();
    for part in ["713 of 793 (89.9 %)", "30 of 40 (75.0 %)", "seq2seq-grammar, simulated users"] {
        assert!(text.contains(part), "{part} is missing");
    }
    assert!(!text.contains("paper, simulated users"), "no grammar stands before that parser");
}

#[test]
fn figures_without_numbers_are_not_drawn() {
    let mut tables = tables();
    tables.answered.clear();
    tables.summary.retain(|row| {
        row.task_type != "pick_cool_then_place" && row.measure != "understood_first_try"
    });
    let names = |tables: &Tables| -> Vec<String> {
        pictures(tables, &about()).unwrap().into_iter().map(|picture| picture.name).collect()
    };
    assert_eq!(names(&tables), ["general"]);
    assert_eq!(names(&Tables::default()), [""; 0]);
    let page = html::page(&Tables::default(), &about(), &[]);
    assert!(page.ends_with("</html>\n"));
}

#[test]
fn the_report_holds_everything_and_needs_nothing() {
    let pictures = pictures(&tables(), &about()).unwrap();
    let page = html::page(&tables(), &about(), &pictures);
    for part in [
        &*about().participants(),
        "Nobody was asked",
        "apprentice study run --conditions paper,default,seq2seq-grammar --users-per-type 3",
        "role=\"img\" aria-labelledby=\"general-title general-text\"",
        "<h3>Program complexity per turn</h3>",
        "task type clean",
        "713 of 793 (89.9 %)",
        // The default's second episode of the general table.
        "<td>1.60 <span class=\"soft\">± 0.15</span></td>",
    ] {
        assert!(page.contains(part), "{part:?} is missing");
    }
    for outside in ["<script", "http://www.w3.org/1999", "src=\"", "href=\"", "@import"] {
        assert!(!page.contains(outside), "{outside:?} leads outside");
    }
    assert_eq!(page.matches("@font-face").count(), 2, "the font is there once");
    let hostile = About {
        conditions: vec![Condition { name: "<b>&\"".to_owned(), recipe: "ab".to_owned() }],
        ..about()
    };
    let page = html::page(&tables(), &hostile, &[]);
    assert!(page.contains("&lt;b&gt;&amp;&quot;") && !page.contains("<b>"));
}

#[test]
fn a_directory_is_read_back_and_what_is_missing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let read = || Tables::read(folder.path()).map_err(|error| error.to_string());
    let found = read().unwrap_err();
    assert!(found.starts_with("the table utterances.csv cannot be read: "), "{found}");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "utterances.csv",
        "condition,task_type,user,episode,turn,utterance,outcome,answered_by,guessed,meant,right,\
         primitives,taught\npaper,cool,u1,1,1,\"go, \"\"now\"\"\",understood,exemplar,0,GOTO Mug,1,\
         1,0\n",
    );
    write(
        "episodes.csv",
        "condition,task_type,user,episode,goal,utterances,understood,not_sure,impossible,wrong,\
         primitives,fewest_actions,normalised_length,complexity,examples_taught,finished\n\
         paper,cool,u1,1,chill a mug,4,3,1,0,0,9,,,2.2500,45,1\n",
    );
    write("summary.csv", "condition,task_type,episode,measure,users,mean,sd\n");
    write("answered.csv", "condition,answered_by,parses,share\npaper,exemplar,3,1.0000\n");
    let tables = read().unwrap();
    assert_eq!(tables.utterances[0].utterance, "go, \"now\"");
    assert_eq!(
        (tables.episodes[0].fewest_actions, tables.episodes[0].complexity),
        (None, Some(2.25))
    );
    write("answered.csv", "condition,answered_by,parses,share\npaper,exemplar,three,1.0000\n");
    assert_eq!(
        read().unwrap_err(),
        "answered.csv, line 2: parses is \"three\"; expected a whole number"
    );
}
