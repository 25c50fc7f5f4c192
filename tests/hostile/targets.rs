//! Every decoder, with valid examples of what it reads.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use apprentice::client::wire::{self, Request};
use apprentice::client::{
    ArchiveAsk, Ask, Command, CurveKey, Endpoint, FeedMessage, Frame, HeadView, Heads, OnClash,
    Order, PersonAsk, PlainRecords, PlainView, Query, Response, SealedRecords, SealedView,
    ServiceAsk, TenantAsk, TenantVerb, read_public,
};
use apprentice::events::{self, EventKind, Head, Header};
use apprentice::evidence::{
    Checkpoint, Consistency, Inclusion, NoteSigner, Proof, Revealed, TreeHash, VerifierKey,
};
use apprentice::ids::{
    Digest, PublicKey, RequestId, Seq, StreamId, StreamKey, TenantId, Timestamp, UserId,
};
use apprentice::language::{Document, Program, Utterance};
use apprentice::learning::{Mind, Recipe};
use apprentice::session::State;
use apprentice::store::{self, DataKey, FaultPlan, SeededEntropy, Store, Walk, decoders};
use apprentice::tenancy::{Quotas, Role};
use apprentice::world::household::{Household, Scene, Task};
use apprentice::world::{Stage, World};
use apprentice_cli::TranscriptFile;
use apprentice_study::corpus::Corpus;

use apprentice_testkit::diary::Diary;
use apprentice_testkit::paths::root;
use apprentice_testkit::samples::samples;

/// True if the bytes were read. A refusal is just as good.
pub type Decoder = dyn Fn(&[u8]) -> bool + Send + Sync;

pub struct Target {
    pub name: &'static str,
    /// Its share of the cases: fast decoders get many.
    pub weight: u64,
    pub corpus: Vec<Vec<u8>>,
    pub read: Box<Decoder>,
}

fn target(
    name: &'static str,
    weight: u64,
    corpus: Vec<Vec<u8>>,
    read: impl Fn(&[u8]) -> bool + Send + Sync + 'static,
) -> Target {
    // If the examples cannot be read, nothing behind the first check is tested.
    for example in &corpus {
        assert!(read(example), "{name} does not read its own example");
    }
    assert!(!corpus.is_empty(), "{name} has no example");
    Target { name, weight, corpus, read: Box::new(read) }
}

fn files(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(root().join(folder))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|found| found == ending))
        .collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A decoder that reads a file, given the path of a file.
fn from_file(folder: &Path, name: &str, bytes: &[u8], read: impl Fn(&Path) -> bool) -> bool {
    let thread = std::thread::current().id();
    let path = folder.join(format!("{name}-{thread:?}"));
    std::fs::write(&path, bytes).unwrap();
    let done = read(&path);
    std::fs::remove_file(&path).unwrap();
    done
}

/// Requests of every kind.
pub fn requests() -> Vec<Vec<u8>> {
    let user = UserId::new("ada").unwrap();
    let stages = [
        Stage::Seed { seed: 7 },
        Stage::Task { task: "Brass Glass".to_owned(), seed: 1 },
        Stage::Scene {
            scene: "room = \"kitchen\"\n".to_owned(),
            task: "clean Mug CounterTop".to_owned(),
        },
    ];
    let say = Command::Say { utterance: "ring the brass bell".to_owned() };
    let explains = Seq::new(3).unwrap();
    let teach = Command::Teach { explains, actions: vec![1, 2], on_clash: OnClash::Ask };
    let asks = stages
        .map(|stage| Ask::Person(PersonAsk::Command(Command::StartEpisode { stage })))
        .into_iter()
        .chain([
            Ask::Person(PersonAsk::Command(say)),
            Ask::Person(PersonAsk::Command(Command::Done)),
            Ask::Person(PersonAsk::Command(teach)),
            Ask::Person(PersonAsk::Command(Command::FinishTeaching)),
            Ask::Person(PersonAsk::Command(Command::Forget { lesson: explains })),
            Ask::Person(PersonAsk::Command(Command::Close { reason: "enough".to_owned() })),
            Ask::Person(PersonAsk::Query(Query::Status)),
            Ask::Person(PersonAsk::Query(Query::Look)),
            Ask::Person(PersonAsk::Query(Query::Known)),
            Ask::Person(PersonAsk::Wait { seconds: 1 }),
            Ask::Service(ServiceAsk::Hello),
            Ask::Service(ServiceAsk::Feed),
            Ask::Archive(ArchiveAsk::Heads { after: Some(StreamKey([5; 16])), limit: 7 }),
            Ask::Archive(ArchiveAsk::Sealed {
                stream: StreamKey([5; 16]),
                from: explains,
                limit: 7,
            }),
            Ask::Archive(ArchiveAsk::Plain {
                stream: StreamKey([5; 16]),
                from: explains,
                limit: 7,
            }),
        ]);
    asks.map(|ask| {
        wire::encode_request(&Request { id: RequestId([7; 16]), user: user.clone(), ask })
    })
    .collect()
}

/// Requests of operators, for the decoder alone.
fn orders() -> Vec<Vec<u8>> {
    let (key, new) = (PublicKey([3; 32]), PublicKey([4; 32]));
    let quotas = Quotas { utterances_per_second: Some(3), ..Quotas::default() };
    let orders = [
        Order::Add,
        Order::Admit { key, role: Role::Auditor, label: "a laptop".to_owned() },
        Order::Retire { key, overlap_seconds: 60 },
        Order::Rotate { old: key, new, overlap_seconds: 60 },
        Order::Disable { reason: "over".to_owned() },
        Order::Enable,
        Order::SetQuotas(quotas),
    ];
    let user = UserId::new("ada").unwrap();
    let erase = TenantVerb::Erase { user: user.clone() };
    let verbs = orders.map(TenantVerb::Give).into_iter().chain([TenantVerb::List, erase]);
    verbs
        .map(|verb| {
            let ask = Ask::Order(TenantAsk { tenant: Some(TenantId::new("lab-a").unwrap()), verb });
            wire::encode_request(&Request { id: RequestId([7; 16]), user: user.clone(), ask })
        })
        .collect()
}

/// A record in each kind of feed, as a message of the feed and as an answer at the endpoint.
fn feeds() -> (Vec<Vec<u8>>, Vec<Vec<u8>>) {
    let (stream, seq) = (StreamKey([5; 16]), Seq::new(1).unwrap());
    let digest = Digest::of(b"a record");
    let sealed = SealedView { stream, seq, digest, frame: Frame(vec![9; 300]) };
    let plain = PlainView {
        stream,
        seq,
        at: Timestamp(1),
        prev: Digest::of(b"the one before"),
        digest,
        kind: "Interpreted".to_owned(),
        event: serde_json::json!({"utterance": "ring the bell", "program": [1, 2, {"a": null}]}),
    };
    let message = |sealed, plain| {
        let start = RequestId([8; 16]);
        FeedMessage { v: wire::VERSION, start, number: 7, sealed, plain }.encode()
    };
    let messages = vec![
        message(Some(sealed.clone()), None),
        message(None, Some(plain.clone())),
        message(None, None),
    ];
    let answers = [
        Response::Heads(Heads { heads: vec![HeadView { stream, seq, digest }], more: true }),
        Response::Records(SealedRecords { records: vec![sealed], more: false }),
        Response::PlainRecords(PlainRecords { erased: false, records: vec![plain], more: false }),
    ];
    let answers = answers.map(|answer| wire::encode_response(RequestId([7; 16]), answer));
    (messages, answers.to_vec())
}

/// A history in the household: an export of it, its state, its mind.
struct Past {
    folder: tempfile::TempDir,
    household: Arc<Household>,
    recipe: Recipe,
    state: Vec<u8>,
    mind: Vec<u8>,
    scene: Vec<u8>,
    task: Vec<u8>,
    responses: Vec<Vec<u8>>,
}

impl Past {
    fn live() -> Past {
        let (folder, household) = (tempfile::tempdir().unwrap(), Arc::new(Household::new()));
        let store: Store = store::open(&folder.path().join("data")).unwrap();
        let recipe_text = Recipe::builtin("tiny").unwrap();
        let mut diary = Diary::new(&household, &store, "ada", recipe_text);
        diary.start("clean Mug CoffeeMachine");
        let reply = diary.say("go to the mug");
        diary.say("rinse the mug");
        diary.say("pick up the mug");
        diary.done();
        diary.teach(&[2]);
        diary.learn();
        let state = diary.session.state();
        let episode = state.episode.as_ref().unwrap();
        let json = |document: Document| document.as_json().to_string().into_bytes();
        let (scene, task) =
            (json(Document::of(&*episode.scene)), json(Document::of(&*episode.task)));
        let mut blob = vec![0; 3 * 32 + 8 + 32];
        blob.extend(rmp_serde::to_vec_named(state).unwrap());
        let mind = diary.minds.last().unwrap().to_bytes();
        let responses = [
            Response::Reply(reply),
            Response::Status(diary.session.status()),
            Response::Look(diary.session.look().unwrap()),
            Response::Known(diary.session.known()),
            Response::busy("not now", 100),
        ];
        let responses =
            responses.map(|response| wire::encode_response(RequestId([7; 16]), response)).to_vec();
        let recipe = Recipe::parse(recipe_text).unwrap();
        drop((diary, store));
        Past { folder, household, recipe, state: blob, mind, scene, task, responses }
    }
}

pub fn all() -> Vec<Target> {
    let past = Past::live();
    let Past { folder, household, recipe, state, mind, scene, task, responses } = past;
    let (messages, answers) = feeds();
    let data = folder.path().join("data");
    let local = TenantId::local();
    let exported = folder.path().join("local.export");
    store::export(&data, &local, &exported).unwrap();
    let read = |path: &Path| std::fs::read(path).unwrap();
    let secret = read(&store::key_file_of(&exported));
    let heads = read(&data.join("HEADS"));
    // Without the space that is allocated in advance: it would be most of each case.
    let heads_end = heads.iter().rposition(|&byte| byte != 0).unwrap() + 1;
    let users = data.join("keys/users/local");
    let user_file = std::fs::read_dir(&users).unwrap().next().unwrap().unwrap().path();
    let stream_key = user_file.file_stem().unwrap().to_str().unwrap().parse().unwrap();
    let stream = StreamId { tenant: local.clone(), key: stream_key };
    let keys = decoders::tenant_key(&local, &secret, Arc::new(SeededEntropy::new(1))).unwrap();
    let wrapped = read(&user_file);
    let scratch = Arc::new(tempfile::tempdir_in(ram()).unwrap());

    let mut targets = vec![
        target("wire request", 20, [requests(), orders()].concat(), |bytes| {
            wire::decode_request(bytes).is_ok()
        }),
        target("wire response", 20, [responses, answers].concat(), |bytes| {
            wire::decode_response(bytes).is_ok()
        }),
        target("feed message", 5, messages, |bytes| FeedMessage::decode(bytes).is_ok()),
        target("snapshot", 5, vec![state], |bytes| {
            decoders::snapshot::<State<Scene, Task>>(bytes).is_some()
        }),
        target("heads file", 10, vec![heads[..heads_end].to_vec()], |bytes| {
            decoders::heads(bytes).is_ok()
        }),
        target("layout", 5, vec![read(&data.join("LAYOUT"))], |bytes| {
            decoders::layout(bytes).is_some()
        }),
        target("export", 5, vec![read(&exported)], |bytes| decoders::export(bytes).is_ok()),
        target("tenant key", 5, vec![secret], move |bytes| {
            let entropy = Arc::new(SeededEntropy::new(1));
            decoders::tenant_key(&TenantId::local(), bytes, entropy).is_ok()
        }),
        target("wrapped key", 5, vec![wrapped], move |bytes| {
            decoders::user_key(&keys, &stream, bytes).is_ok()
        }),
        target("scene document", 5, vec![scene], |bytes| {
            serde_json::from_slice::<Document>(bytes)
                .is_ok_and(|document| document.decode::<Scene>().is_ok())
        }),
        target("task document", 5, vec![task], |bytes| {
            serde_json::from_slice::<Document>(bytes)
                .is_ok_and(|document| document.decode::<Task>().is_ok())
        }),
    ];
    targets.extend(records());
    targets.push(target("mind", 2, vec![mind], {
        let (household, recipe) = (household.clone(), recipe);
        move |bytes| Mind::from_bytes(&*household, &recipe, bytes).is_ok()
    }));
    targets.extend(texts(&household));
    targets.extend(of_files(&scratch));
    targets
}

/// Files of one case are not on a disk, if that is possible.
fn ram() -> PathBuf {
    let ram = PathBuf::from("/dev/shm");
    if ram.is_dir() { ram } else { std::env::temp_dir() }
}

/// Bodies, frames and sealed frames. The checks in front of a body refuse nearly every changed
/// byte. So each changed body is also tried behind correct checks.
fn records() -> Vec<Target> {
    let bodies: Vec<Vec<u8>> = samples()
        .iter()
        .map(|(_, event)| {
            let kind = event.kind();
            let mut bytes = (kind as u16).to_be_bytes().to_vec();
            bytes.extend(kind.version().to_be_bytes());
            bytes.extend(events::encode(event));
            bytes
        })
        .collect();
    // A former version, whose fields are also in today's.
    let former = samples().into_iter().find(|(name, _)| *name == "retrain_completed").map(|it| {
        let mut bytes = (EventKind::RetrainCompleted as u16).to_be_bytes().to_vec();
        bytes.extend(1_u16.to_be_bytes());
        bytes.extend(events::encode(&it.1));
        bytes
    });
    let key = DataKey::from_bytes([3; 32]);
    let stream = StreamKey([5; 16]);
    let frames: Vec<Vec<u8>> = samples()
        .into_iter()
        .map(|(_, event)| {
            let batch = events::Batch {
                request: RequestId([1; 16]),
                at: Timestamp(1),
                events: vec![event],
            };
            let draft = store::Draft::encode(batch).unwrap();
            draft.seal(&key, &SeededEntropy::new(2), stream, Head::EMPTY).frames.remove(0)
        })
        .collect();
    let goldens: Vec<Vec<u8>> = files("schema/golden", "rec");
    let open = move |bytes: &[u8]| Walk::after(stream, Head::EMPTY).open(&key, bytes).is_ok();
    let remade = {
        let open = open.clone();
        move |bytes: &[u8]| {
            // The checksum is no secret: an attacker can correct it.
            let mut bytes = bytes.to_vec();
            if bytes.len() >= Header::BYTES {
                let length = ((bytes.len() - Header::BYTES) as u32).to_be_bytes();
                bytes[120..124].copy_from_slice(&length);
                let mut hasher = crc32fast::Hasher::new();
                hasher.update(&bytes[..124]);
                hasher.update(&bytes[128..]);
                let checksum = hasher.finalize().to_be_bytes();
                bytes[124..128].copy_from_slice(&checksum);
            }
            open(&bytes)
        }
    };
    vec![
        target("record body", 20, bodies.into_iter().chain(former).collect(), |bytes| {
            let Some((kind, rest)) = bytes.split_first_chunk() else { return false };
            let Some((version, body)) = rest.split_first_chunk() else { return false };
            let (kind, version) = (u16::from_be_bytes(*kind), u16::from_be_bytes(*version));
            events::decode(kind, version, body).is_ok()
        }),
        target("record frame", 10, goldens, |bytes| Header::unframe(bytes).is_ok()),
        target("sealed frame", 5, frames.clone(), open),
        target("sealed frame, checksum made good", 5, frames, remade),
    ]
}

fn texts(household: &Arc<Household>) -> Vec<Target> {
    let recipes = ["default", "paper", "tiny"];
    let recipes = recipes.map(|name| Recipe::builtin(name).unwrap().as_bytes().to_vec());
    let scenes = files("crates/household/data", "toml");
    let example = read_example(&scenes);
    let tasks = ["clean Mug CoffeeMachine", "heat Apple CounterTop", "free kitchen"];
    let (scene_world, task_world) = (household.clone(), household.clone());
    let signer = NoteSigner::new("lab", &[9; 32]).unwrap();
    let public = signer.public();
    let note = checkpoint(&signer);
    let shown = public.to_string().into_bytes();
    let proof = proofs(&note);
    vec![
        target("proof", 10, proof, |bytes| Proof::parse(bytes).is_ok()),
        target("recipe", 2, recipes.to_vec(), |bytes| Recipe::parse(&text(bytes)).is_ok()),
        target("scene file", 3, vec![example], move |bytes| {
            let stage =
                Stage::Scene { scene: text(bytes), task: "clean Mug CounterTop".to_owned() };
            scene_world.stage(&stage).is_ok()
        }),
        target("task", 1, tasks.map(|task| task.as_bytes().to_vec()).to_vec(), move |bytes| {
            let stage = Stage::Task { task: text(bytes), seed: 1 };
            task_world.stage(&stage).is_ok()
        }),
        target("program", 5, vec![b"GOTO Mug; PICKUP Mug".to_vec()], |bytes| {
            text(bytes).parse::<Program>().is_ok()
        }),
        target("utterance", 5, vec![b"go to the mug and pick it up".to_vec()], |bytes| {
            Utterance::new(&text(bytes)).is_ok()
        }),
        target("names", 5, vec![b"lab-a".to_vec()], |bytes| {
            let text = text(bytes);
            let _ = (UserId::new(&text), text.parse::<Digest>());
            TenantId::new(&text).is_ok()
        }),
        target("endpoint", 5, endpoints(), |bytes| Endpoint::parse(&text(bytes)).is_ok()),
        target("checkpoint", 3, vec![note.into_bytes()], move |bytes| {
            Checkpoint::open(&text(bytes), &public).is_ok()
        }),
        target("verifier key", 3, vec![shown], |bytes| text(bytes).parse::<VerifierKey>().is_ok()),
    ]
}

fn endpoints() -> Vec<Vec<u8>> {
    let texts = ["tcp://127.0.0.1:7700", "tcp://[::1]:7700", "ipc:///run/apprentice"];
    texts.map(|text| text.as_bytes().to_vec()).to_vec()
}

fn read_example(scenes: &[Vec<u8>]) -> Vec<u8> {
    let example = scenes.iter().find(|bytes| text(bytes).contains("[[thing]]"));
    example.expect("crates/household/data/example_scene.toml").clone()
}

fn checkpoint(signer: &NoteSigner) -> String {
    let (origin, root) = (signer.name().to_owned(), TreeHash::of_leaf(b"one"));
    Checkpoint { origin, size: 1, root }.sign(signer)
}

fn proofs(checkpoint: &str) -> Vec<Vec<u8>> {
    let path = vec![TreeHash::of_leaf(b"one"), TreeHash::of_leaf(b"two")];
    let record = Inclusion {
        frame: vec![7; 300],
        revealed: Some(Revealed { salt: [1; 32], body: vec![2; 90] }),
        stream: StreamKey([5; 16]),
        first: Seq::FIRST,
        last: Seq::FIRST.next().next(),
        head: Digest::of(b"head"),
        segment_path: path.clone(),
        leaf: 3,
        tree_path: path.clone(),
    };
    let since = Consistency { size: 2, path };
    [(Some(record.clone()), None), (None, Some(since.clone())), (Some(record), Some(since))]
        .map(|(record, since)| Proof { record, since, checkpoint: checkpoint.to_owned() })
        .map(|proof| proof.to_text().into_bytes())
        .to_vec()
}

fn of_files(scratch: &Arc<tempfile::TempDir>) -> Vec<Target> {
    let corpus_lines = concat!(
        r#"{"id":"1/0/0","u":"Pick up the clock.","act":"PickupObject","prims":["PICKUP AlarmClock"],"#,
        r#""scene":301,"task":"look_at_obj_in_light","user":"u9","votes":[3,3]}"#,
        "\n",
        r#"{"id":"1/0","goal":"Pick up the clock and turn on the lamp.","prims":["GOTO Dresser"],"#,
        r#""scene":301,"task":"look_at_obj_in_light","user":"u9","expressible":true}"#,
        "\n"
    );
    let zipped = {
        use std::io::Write;
        let mut zip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        zip.write_all(corpus_lines.as_bytes()).unwrap();
        zip.finish().unwrap()
    };
    let plan = "seed = 4\nscript = [\"refused\"]\nheld_answers = 20\n";
    let curve = {
        let path = scratch.path().join("curve");
        let public = CurveKey::new().unwrap().write_new(&path).unwrap();
        [std::fs::read(&path).unwrap(), std::fs::read(public).unwrap()]
    };
    let [one, two, three, four, five] = [(); 5].map(|()| scratch.clone());
    let [secret, public] = curve;
    vec![
        target("transcript", 2, files("tests/transcripts", "txt"), move |bytes| {
            from_file(one.path(), "transcript", bytes, |path| TranscriptFile::read(path).is_ok())
        }),
        target("corpus", 2, vec![corpus_lines.as_bytes().to_vec(), zipped], move |bytes| {
            from_file(two.path(), "corpus", bytes, |path| Corpus::read(path).is_ok())
        }),
        target("fault plan", 2, vec![plan.as_bytes().to_vec()], move |bytes| {
            from_file(three.path(), "plan", bytes, |path| FaultPlan::read(path).is_ok())
        }),
        target("CURVE secret", 1, vec![secret], move |bytes| {
            use std::os::unix::fs::PermissionsExt;
            from_file(four.path(), "curve", bytes, |path| {
                let private = std::fs::Permissions::from_mode(0o600);
                std::fs::set_permissions(path, private).unwrap();
                CurveKey::read(path).is_ok()
            })
        }),
        target("CURVE public key", 1, vec![public], move |bytes| {
            from_file(five.path(), "public", bytes, |path| {
                read_public(path.to_str().unwrap()).is_ok()
            })
        }),
    ]
}
