use apprentice::client::Phase;
use apprentice::ids::TenantId;
use apprentice::plain::count;
use apprentice::session::Session;
use apprentice::world::Domain;
use serde_json::{Value, json};

use crate::shown;

/// A session as one JSON object. The state is printed without what differs between two runs of one
/// history: the time of the last record and the ids of requests.
pub fn json<D: Domain>(tenant: &TenantId, session: &Session<D>, head: u64) -> String {
    let mut state = serde_json::to_value(session.state()).expect("a state is plain data");
    if let Value::Object(fields) = &mut state {
        for left_out in ["head", "last_at", "requests"] {
            fields.remove(left_out);
        }
    }
    let user = session.state().opened.as_ref().map(|opened| opened.user.as_str());
    let object = json!({
        "tenant": tenant.as_str(),
        "user": user,
        "at": session.head().seq,
        "head": head,
        "record_digest": session.head().digest,
        "state_digest": session.state_digest(),
        "mind_digest": session.state().mind,
        "state": state,
    });
    shown::json_pretty(&object)
}

/// A session for a person.
pub fn readable<D: Domain>(tenant: &TenantId, session: &Session<D>, head: u64) -> Vec<String> {
    let (state, status) = (session.state(), session.status());
    let user = state.opened.as_ref().map_or("", |opened| opened.user.as_str());
    let recipe = session.recipe();
    let mut lines = vec![
        format!("{user} of tenant {tenant}, after record {} of {head}", session.head().seq),
        format!("record  {}", session.head().digest),
        format!("state   {}", session.state_digest()),
        format!("mind    {}", status.mind),
        format!(
            "recipe {} {}, {}: {} taught by this user",
            recipe.name(),
            recipe.digest().short(),
            count(status.exemplars, "example"),
            state.trained.len()
        ),
        format!("{}, {}", count(status.episodes, "episode"), phase(status.phase)),
    ];
    for live in &state.lessons {
        let known = if state.trained.contains(&live.seq) { "" } else { " (not learned yet)" };
        let (utterance, program) = (live.lesson.utterance.as_str(), &live.lesson.program);
        lines.push(format!("lesson #{} {utterance:?} means {program}{known}", live.seq));
    }
    if let Some(goal) = &status.goal {
        let utterances = count(status.utterances, "utterance");
        let actions = count(status.actions.len() as u32, "action");
        lines.push(format!("goal: {goal} ({utterances}, {actions})"));
    }
    for (part, holds) in &status.progress {
        lines.push(format!("  [{}] {part}", if *holds { "x" } else { " " }));
    }
    for action in &status.actions {
        lines.push(format!("  {:>3}  {}", action.number, action.sentence));
    }
    for said in &status.to_teach {
        lines.push(format!("to teach: {:?} (record {})", said.utterance, said.seq));
    }
    lines
}

fn phase(phase: Phase) -> &'static str {
    match phase {
        Phase::Idle => "between episodes",
        Phase::Interacting => "in an episode",
        Phase::Teaching => "teaching",
        Phase::Learning => "learning",
        Phase::Closed => "closed",
    }
}
