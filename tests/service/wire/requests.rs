//! One request for each verb.

use apprentice::client::{
    ArchiveAsk, Ask, Command, OnClash, Order, PersonAsk, Query, ServiceAsk, TenantAsk, TenantVerb,
};
use apprentice::ids::{TenantId, UserId};
use apprentice::tenancy::Role;
use apprentice::world::Stage;

use super::{STREAM, key, lab, quotas, seq};

pub fn requests() -> Vec<(&'static str, Ask)> {
    let task = "clean Mug CounterTop".to_owned();
    let command = |command: Command| Ask::from(command);
    let teach = |actions, on_clash| command(Command::Teach { explains: seq(3), actions, on_clash });
    let start = |stage| command(Command::StartEpisode { stage });
    vec![
        ("start_episode", start(Stage::Task { task: task.clone(), seed: 7 })),
        ("start_episode drawn", start(Stage::Seed { seed: 7 })),
        ("start_episode scene", start(Stage::Scene { scene: "room = \"kitchen\"\n".into(), task })),
        ("say", command(Command::Say { utterance: "wash the coffee mug".into() })),
        ("done", command(Command::Done)),
        ("teach", teach(vec![2, 3, 4], OnClash::Ask)),
        ("teach nothing", teach(vec![], OnClash::Ask)),
        ("teach replace", teach(vec![2, 3, 4], OnClash::Replace)),
        ("finish_teaching", command(Command::FinishTeaching)),
        ("forget", command(Command::Forget { lesson: seq(9) })),
        ("mark_wrong", command(Command::MarkWrong)),
        ("close", command(Command::Close { reason: "the study is over".into() })),
        ("status", Ask::Person(PersonAsk::Query(Query::Status))),
        ("look", Ask::Person(PersonAsk::Query(Query::Look))),
        ("known", Ask::Person(PersonAsk::Query(Query::Known))),
        ("wait", Ask::Person(PersonAsk::Wait { seconds: 20 })),
        ("hello", Ask::Service(ServiceAsk::Hello)),
        ("feed", Ask::Service(ServiceAsk::Feed)),
        ("heads", Ask::Archive(ArchiveAsk::Heads { after: Some(STREAM), limit: 1000 })),
        ("records", Ask::Archive(ArchiveAsk::Sealed { stream: STREAM, from: seq(40), limit: 100 })),
        (
            "plain_records",
            Ask::Archive(ArchiveAsk::Plain { stream: STREAM, from: seq(40), limit: 100 }),
        ),
        ("list", order(None, TenantVerb::List)),
        ("add", give(Order::Add)),
        (
            "admit",
            give(Order::Admit {
                key: key(1),
                role: Role::Gateway,
                label: "robot in room 7".into(),
            }),
        ),
        ("retire", give(Order::Retire { key: key(1), overlap_seconds: 0 })),
        ("rotate", give(Order::Rotate { old: key(1), new: key(2), overlap_seconds: 604_800 })),
        ("disable", give(Order::Disable { reason: "the study is over".into() })),
        ("enable", give(Order::Enable)),
        ("set_quotas", give(Order::SetQuotas(quotas()))),
        ("erase", order(Some(lab()), TenantVerb::Erase { user: UserId::new("grace").unwrap() })),
    ]
}

fn order(tenant: Option<TenantId>, verb: TenantVerb) -> Ask {
    Ask::Order(TenantAsk { tenant, verb })
}

fn give(this: Order) -> Ask {
    order(Some(lab()), TenantVerb::Give(this))
}
