//! Two labs on one service, each with its own people, keys and words.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use apprentice::client::{
    ArchiveAsk, Ask, Client, Command, CurveKey, OnClash, Response, ServiceAsk, Status, wire,
};
use apprentice::frontends::Counts;
use apprentice::ids::{PublicKey, RequestId, StreamId, StreamKey, TenantId};
use apprentice::learning::Recipe;
use apprentice::service::{self, Config, Data};
use apprentice::tenancy::{Order, Role};
use apprentice::world::Stage;
use apprentice::world::household::Household;
use apprentice_testkit::lab::{self, FREE_PORT};

const BOUND: Duration = Duration::from_secs(60);

pub struct Service(service::Service);

pub struct Lab {
    pub name: String,
    /// The person whose name the other lab knows.
    pub known: &'static str,
    /// The request in which that person said this lab's words.
    pub said: RequestId,
    canary: String,
    keys: BTreeMap<&'static str, CurveKey>,
    /// The stream of one of its people, when they have talked.
    person: StreamKey,
    client: Client,
    /// A person whose name is the secret word.
    hidden: Client,
}

impl Service {
    pub fn start(dir: &Path) -> Service {
        let mut config =
            Config::new(std::sync::Arc::new(Household::new()), Data::Directory(dir.to_owned()));
        config.recipe_text = Recipe::builtin("default").unwrap().to_owned();
        config.listen_curve = vec![FREE_PORT.to_owned()];
        Service(service::Service::start(config).unwrap())
    }

    /// A socket that sends any bytes.
    pub fn wire(&self, key: &CurveKey) -> Wire {
        let socket = lab::socket(&self.0, key, zmq::DEALER);
        socket.set_rcvtimeo(BOUND.as_millis() as i32).unwrap();
        socket.connect(&self.0.curve_endpoints()[0]).unwrap();
        Wire { socket, waiting: BTreeMap::new() }
    }

    /// Retires a key while its connection is open.
    pub fn make_stale(&self, lab: &Lab, key: &str, wire: &mut Wire) {
        let id = RequestId([0x77; 16]);
        let (user, ask) = (lab::user("ada"), Ask::Service(ServiceAsk::Hello));
        wire.send(&[wire::encode_request(&wire::Request { id, user, ask })]);
        wire.reply_to(id);
        let key = lab.public(key);
        lab::order(&self.0, &lab.name, Order::Retire { key, overlap_seconds: 0 });
    }

    pub fn counts(&self) -> Counts {
        self.0.counts()
    }

    pub fn stop(self) {
        self.0.stop().unwrap();
    }
}

pub struct Wire {
    socket: zmq::Socket,
    waiting: BTreeMap<RequestId, Vec<Vec<u8>>>,
}

impl Wire {
    pub fn send(&mut self, frames: &[Vec<u8>]) {
        self.socket.send_multipart(frames, 0).unwrap();
    }

    /// The bytes of the answer to `id`; answers that come before it are kept.
    pub fn reply_to(&mut self, id: RequestId) -> Vec<u8> {
        loop {
            if let Some(reply) = self.waiting.get_mut(&id).and_then(Vec::pop) {
                return reply;
            }
            let frames =
                self.socket.recv_multipart(0).expect("every request with an id is answered");
            let bytes = frames.last().unwrap().clone();
            let (answered, _) = wire::decode_response(&bytes).unwrap();
            self.waiting.entry(answered).or_default().push(bytes);
        }
    }
}

impl Lab {
    /// Opens the tenant and admits a key for each role, and one that will be retired.
    pub fn found(service: &Service, name: &str) -> Lab {
        let canary = format!("zyx{name}quux");
        lab::order(&service.0, name, Order::Open);
        let admit = |role| {
            let (key, label) = (CurveKey::new().unwrap(), canary.clone());
            lab::order(&service.0, name, Order::Admit { key: *key.public(), role, label });
            key
        };
        let keys = BTreeMap::from([
            ("gateway", admit(Role::Gateway)),
            ("operator", admit(Role::Operator)),
            ("auditor", admit(Role::Auditor)),
            ("stale", admit(Role::Operator)),
        ]);
        let own = admit(Role::Gateway);
        let [client, hidden] =
            ["ada", &canary].map(|person| lab::connect(&service.0, &own, person));
        let said = RequestId([name.len() as u8; 16]);
        Lab {
            name: name.to_owned(),
            known: "ada",
            said,
            canary,
            person: StreamKey::TENANT,
            keys,
            client,
            hidden,
        }
    }

    /// Talks and teaches with its own words.
    pub fn live(&mut self, service: &Service) {
        for client in [&self.client, &self.hidden] {
            client.start(Stage::Task { task: "place Mug SinkBasin".to_owned(), seed: 7 }).unwrap();
            let say = Command::Say { utterance: self.canary.clone() };
            client.command_again(self.said, say).unwrap();
            client.say("go to the sink").unwrap();
            client.done().unwrap();
            let lesson = client.status().unwrap().to_teach.remove(0);
            client.teach(lesson.seq, vec![1], OnClash::Ask).unwrap();
            client.finish_teaching().unwrap();
            client.wait_until_learned(BOUND).unwrap();
            client.start(Stage::Task { task: "place Mug SinkBasin".to_owned(), seed: 8 }).unwrap();
        }
        let id = RequestId([0x78; 16]);
        let (user, ask) = (
            lab::user("auditor"),
            Ask::Archive(ArchiveAsk::Heads { after: Some(StreamKey::TENANT), limit: 10 }),
        );
        let mut wire = service.wire(&self.keys["auditor"]);
        wire.send(&[wire::encode_request(&wire::Request { id, user, ask })]);
        match wire::decode_response(&wire.reply_to(id)).unwrap() {
            (_, Response::Heads(heads)) => self.person = heads.heads[0].stream,
            (_, other) => panic!("no heads: {other:?}"),
        }
    }

    /// What was taught still works.
    pub fn still_lives(&self) {
        let reply = self.client.say(&self.canary).unwrap();
        assert!(format!("{reply:?}").contains("Understood"), "{reply:?}");
    }

    /// What an attacker could have changed.
    pub fn facts(&self, service: &Service) -> (Vec<Status>, String) {
        let admissions = service.0.registrar().admissions();
        let standing = admissions.standing(&self.tenant()).unwrap();
        let people = [&self.client, &self.hidden].map(|client| client.status().unwrap());
        (people.into(), format!("{standing:?}"))
    }

    pub fn tenant(&self) -> TenantId {
        lab::tenant(&self.name)
    }

    pub fn keys(&self) -> impl Iterator<Item = (&'static str, &CurveKey)> {
        self.keys.iter().map(|(name, key)| (*name, key))
    }

    pub fn public(&self, key: &str) -> PublicKey {
        *self.keys[key].public()
    }

    /// The stream of one of its people.
    pub fn person(&self) -> StreamKey {
        self.person
    }

    /// The name of a stream in logs and proofs.
    pub fn stream_text(&self) -> String {
        StreamId::of_tenant(&self.tenant()).to_string()
    }

    /// True if `bytes` contain words of this lab.
    pub fn is_in(&self, bytes: &[u8]) -> bool {
        super::contains(bytes, self.canary.as_bytes())
    }
}
