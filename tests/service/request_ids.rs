//! One request id belongs to one command. Through a real socket, each used id is sent again with
//! every other command, and is refused.

use std::path::Path;
use std::time::Duration;

use apprentice::client::{Client, ClientError, Command, OnClash, RejectionCode, Reply, fresh_id};
use apprentice::ids::{RequestId, Seq, UserId};
use apprentice::service::{Data, Service};
use apprentice::session;
use apprentice::world::Stage;
use apprentice_testkit::toy::config;

const LONG: Duration = Duration::from_secs(60);

fn bells(data: &Path) -> Service {
    let mut config = config(Data::Directory(data.to_owned()));
    config.listen = vec!["tcp://127.0.0.1:0".to_owned()];
    Service::start(config).unwrap()
}

fn ada(service: &Service) -> Client {
    Client::connect(service.endpoint().unwrap(), UserId::new("ada").unwrap()).unwrap()
}

/// A command that was carried out.
struct Asked {
    id: RequestId,
    command: Command,
    reply: Reply,
}

fn ask(client: &Client, asked: &mut Vec<Asked>, command: Command) -> Reply {
    let id = fresh_id();
    let reply = client.command_again(id, command.clone()).unwrap();
    asked.push(Asked { id, command, reply: reply.clone() });
    reply
}

fn say(utterance: &str) -> Command {
    Command::Say { utterance: utterance.to_owned() }
}

fn start(task: &str, seed: u64) -> Command {
    Command::StartEpisode { stage: Stage::Task { task: task.to_owned(), seed } }
}

fn teach(explains: Seq, actions: &[u32], on_clash: OnClash) -> Command {
    Command::Teach { explains, actions: actions.to_vec(), on_clash }
}

/// A history with every command that people may send; `close` is the last.
fn life(client: &Client) -> Vec<Asked> {
    let mut asked = Vec::new();
    let mut ask = |command| ask(client, &mut asked, command);
    let learned = || drop(client.wait_until_learned(LONG).unwrap());
    ask(start("Brass Glass", 1));
    let polish = ask(say("polish the brass bell")).first;
    let paint = ask(say("paint the brass bell")).first;
    ask(say("ring the brass bell"));
    ask(say("mute the brass bell"));
    ask(Command::Done);
    ask(teach(polish, &[1], OnClash::Ask));
    ask(teach(paint, &[], OnClash::Ask));
    ask(Command::FinishTeaching);
    learned();
    // From now on the words mean something else.
    ask(start("Brass Silver", 2));
    ask(say("ring the brass bell"));
    let polish = ask(say("polish the brass bell")).first;
    ask(say("mute the brass bell"));
    ask(Command::Done);
    let lesson = ask(teach(polish, &[2], OnClash::Replace)).last;
    ask(Command::FinishTeaching);
    learned();
    ask(Command::Forget { lesson });
    learned();
    let scene = String::new();
    ask(Command::StartEpisode { stage: Stage::Scene { scene, task: "Glass".to_owned() } });
    ask(say("ring the glass bell"));
    ask(Command::StartEpisode { stage: Stage::Seed { seed: 3 } });
    ask(Command::Close { reason: "enough".to_owned() });
    asked
}

/// Commands of every kind that are not in [`life`].
fn others() -> Vec<Command> {
    let seq = |seq| Seq::new(seq).unwrap();
    vec![
        start("Brass Glass", 9),
        start("Silver", 1),
        Command::StartEpisode { stage: Stage::Seed { seed: 1 } },
        Command::StartEpisode {
            stage: Stage::Scene { scene: String::new(), task: "Brass".to_owned() },
        },
        Command::StartEpisode {
            stage: Stage::Scene { scene: " ".repeat(400_000), task: "Glass".to_owned() },
        },
        start("Wood", 1),
        say("mute the glass bell"),
        say(""),
        teach(seq(3), &[1, 2], OnClash::Ask),
        teach(seq(3), &[], OnClash::Ask),
        teach(seq(4), &[1], OnClash::Ask),
        teach(seq(2), &[], OnClash::Keep),
        Command::Forget { lesson: seq(8) },
        Command::Close { reason: "no more".to_owned() },
    ]
}

/// Every id with every command of the history and with every other one.
fn every_pair(client: &Client, asked: &[Asked]) {
    let seq = client.status().unwrap().seq;
    let mut refused = 0;
    for used in asked {
        let again = client.command_again(used.id, used.command.clone()).unwrap();
        assert_eq!(again, used.reply, "{:?}", used.command);
        let commands = asked.iter().map(|asked| asked.command.clone()).chain(others());
        for other in commands.filter(|other| *other != used.command) {
            match client.command_again(used.id, other.clone()) {
                Err(ClientError::Rejected { code, message }) => {
                    assert_eq!(code, RejectionCode::RequestIdReused, "{other:?}: {message}");
                    let name = session::Command::from(used.command.clone()).name();
                    for part in [name, &used.id.to_string(), "new id"] {
                        assert!(message.contains(part), "{part:?} is missing in {message}");
                    }
                    refused += 1;
                }
                answer => panic!("{:?}, then {other:?}: {answer:?}", used.command),
            }
        }
    }
    assert!(refused > asked.len() * others().len());
    assert_eq!(client.status().unwrap().seq, seq, "nothing was recorded");
}

#[test]
fn a_used_id_with_another_command_is_refused_by_the_name_of_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let service = bells(&data);
    let client = ada(&service);
    let asked = life(&client);
    every_pair(&client, &asked);
    service.stop().unwrap();
    // The log remembers: this is another process, with nothing in memory.
    let service = bells(&data);
    every_pair(&ada(&service), &asked);
    service.stop().unwrap();
}

#[test]
fn a_refused_command_leaves_its_id_free() {
    let folder = tempfile::tempdir().unwrap();
    let service = bells(&folder.path().join("data"));
    let client = ada(&service);
    let id = fresh_id();
    let refused = client.command_again(id, say("ring the brass bell")).unwrap_err();
    assert!(
        matches!(refused, ClientError::Rejected { code: RejectionCode::WrongPhase, .. }),
        "{refused:?}"
    );
    client.command_again(id, start("Brass Glass", 1)).unwrap();
    // White space around an utterance does not count.
    let id = fresh_id();
    let reply = client.command_again(id, say("ring the brass bell")).unwrap();
    assert_eq!(client.command_again(id, say(" ring the brass bell ")).unwrap(), reply);
    service.stop().unwrap();
}

#[test]
fn what_a_lesson_would_have_done_about_a_clash_is_not_recorded_where_there_was_none() {
    let folder = tempfile::tempdir().unwrap();
    let service = bells(&folder.path().join("data"));
    let client = ada(&service);
    let mut asked = Vec::new();
    ask(&client, &mut asked, start("Brass Glass", 1));
    let polish = ask(&client, &mut asked, say("polish the brass bell")).first;
    ask(&client, &mut asked, say("ring the brass bell"));
    ask(&client, &mut asked, Command::Done);
    let id = fresh_id();
    let taught = client.command_again(id, teach(polish, &[1], OnClash::Ask)).unwrap();
    for on_clash in [OnClash::Ask, OnClash::Keep, OnClash::Replace] {
        assert_eq!(client.command_again(id, teach(polish, &[1], on_clash)).unwrap(), taught);
    }
    service.stop().unwrap();
}
