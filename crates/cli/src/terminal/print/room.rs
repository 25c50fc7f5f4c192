//! The room: what stands where, and what the robot holds.

use apprentice::world::{Thing, View};

use super::words::{one_line, sentence};

/// What the robot holds, from what it sees.
pub fn holding(view: &View) -> String {
    let held = |thing: &&Thing| thing.states.iter().any(|state| state == "held");
    match view.things.iter().find(held) {
        Some(thing) => format!("holding {}", thing.name),
        None => "holding nothing".to_owned(),
    }
}

/// The room, where the robot is and what it holds, as one sentence.
pub fn summary(view: &View) -> String {
    sentence(&one_line(&view.summary))
}

/// `:look`: the room in a sentence, then what stands where.
pub fn look(view: &View) -> Vec<String> {
    let mut lines = vec![summary(view)];
    let mut places: Vec<&str> = Vec::new();
    for place in view.things.iter().filter_map(|thing| thing.place.as_deref()) {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    for thing in &view.things {
        let is_place = places.contains(&thing.name.as_str());
        if thing.place.is_some() && !is_place {
            continue;
        }
        let on_it: Vec<String> = view
            .things
            .iter()
            .filter(|other| other.place.as_deref() == Some(thing.name.as_str()))
            .map(|other| with_states(&other.name, &other.states))
            .collect();
        let name = with_states(&thing.name, &thing.states);
        lines.push(match on_it.is_empty() {
            true => format!("  {name}"),
            false => format!("  {name}: {}", on_it.join(", ")),
        });
    }
    lines
}

fn with_states(name: &str, states: &[String]) -> String {
    match states.is_empty() {
        true => name.to_owned(),
        false => format!("{name} ({})", states.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_where_is_grouped_by_place() {
        let thing = |name: &str, place: Option<&str>, states: &[&str]| Thing {
            name: name.into(),
            kind: name.into(),
            place: place.map(str::to_owned),
            at: (0, 0),
            states: states.iter().map(|state| (*state).to_owned()).collect(),
        };
        let view = View {
            summary: vec!["this is a kitchen".into(), "its hand is empty".into()],
            things: vec![
                thing("CounterTop", None, &[]),
                thing("Mug", Some("CounterTop"), &["dirty"]),
                thing("SinkBasin", Some("CounterTop"), &[]),
                thing("Fork", Some("SinkBasin"), &[]),
                thing("Apple", None, &["held"]),
            ],
        };
        assert_eq!(
            look(&view),
            [
                "This is a kitchen; its hand is empty.",
                "  CounterTop: Mug (dirty), SinkBasin",
                "  SinkBasin: Fork",
                "  Apple (held)"
            ]
        );
        assert_eq!(holding(&view), "holding Apple");
    }
}
