//! Salvage, export and import of directories with several labs. What they say they kept is what the
//! database contains, record by record, for every lab. `APPRENTICE_SEED` repeats a run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use apprentice::actors::TenantRegistry;
use apprentice::events::{Head, Quotas, Role};
use apprentice::ids::{PublicKey, Seq, StreamId, StreamKey, TenantId};
use apprentice::learning::Recipe;
use apprentice::replay::{Scrutiny, Through, audit, streams_of};
use apprentice::service::{Data, Service};
use apprentice::store::conformance::{batch, stream};
use apprentice::store::{self, ExportError, SeededEntropy, Share, Store, open};
use apprentice::tenancy::Order;
use apprentice_testkit::chance::{below, number, seed};
use apprentice_testkit::diary::Diary;
use apprentice_testkit::toy::{self, Bells};
use apprentice_testkit::tree::copy_tree;

/// The framed records of every stream, sealed.
type Everything = BTreeMap<StreamId, Vec<Vec<u8>>>;

/// In memory if possible, because each record is synced.
fn room() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    match memory.is_dir() {
        true => tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir()).unwrap(),
        false => tempfile::tempdir().unwrap(),
    }
}

fn lab(name: &str) -> TenantId {
    TenantId::new(name).unwrap()
}

fn frames(store: &Store, who: &StreamId) -> Vec<Vec<u8>> {
    let sealed = store.log.sealed(who, Seq::FIRST).unwrap();
    sealed.map(|record| record.unwrap().frame).collect()
}

/// What the database contains.
fn everything(dir: &Path) -> Everything {
    let store = open(dir).unwrap();
    let streams = streams_of(&store, None).unwrap();
    streams.into_iter().map(|who| (who.clone(), frames(&store, &who))).collect()
}

fn of(all: &Everything, tenant: &TenantId) -> Everything {
    all.clone().into_iter().filter(|(who, _)| who.tenant == *tenant).collect()
}

/// What a salvage should say of a lab that lost nothing.
fn share(all: &Everything, tenant: &TenantId) -> Share {
    let (mut share, of) = (Share::default(), of(all, tenant));
    for (who, records) in &of {
        match who.is_tenants() {
            true => share.own += records.len() as u64,
            false => share.records += records.len() as u64,
        }
    }
    share.people = of.keys().filter(|who| !who.is_tenants()).count() as u64;
    share
}

/// The service starts in the directory, and an audit finds no difference.
fn starts_and_audits(dir: &Path) {
    Service::start(toy::config(Data::Directory(dir.to_owned()))).unwrap().stop().unwrap();
    let store = open(dir).unwrap();
    let streams = streams_of(&store, None).unwrap();
    let report = audit(&Arc::new(Bells::new()), &store, &streams, Scrutiny::default(), 2, &());
    let differences: Vec<_> = report.streams.iter().filter_map(|s| s.difference.as_ref()).collect();
    assert!(differences.is_empty(), "{differences:?}");
}

/// Salvage, and export and import of each lab, of an undamaged directory: everything is kept.
fn check_whole(dir: &Path) -> Everything {
    let parent = room();
    let all = everything(dir);
    let mut tenants: Vec<TenantId> = all.keys().map(|who| who.tenant.clone()).collect();
    tenants.dedup();

    let out = parent.path().join("rescued");
    let salvaged = store::salvage(dir, &out).unwrap();
    assert!(salvaged.is_complete(), "{salvaged:?}");
    let heads = |all: &Everything| -> Vec<_> {
        all.iter().map(|(who, records)| (who.clone(), records.len() as u64)).collect()
    };
    let said = salvaged.streams.iter().map(|found| (found.stream.clone(), found.valid.seq));
    assert_eq!(said.collect::<Vec<_>>(), heads(&all));
    let expected: Vec<_> = tenants.iter().map(|tenant| (tenant, share(&all, tenant))).collect();
    assert_eq!(salvaged.by_tenant().into_iter().collect::<Vec<_>>(), expected);
    assert!(everything(&out) == all, "the salvage holds something else");
    starts_and_audits(&out);

    // One after the other into one directory, which then contains what the first one contained.
    let moved = parent.path().join("moved");
    for tenant in &tenants {
        let file = parent.path().join(format!("{tenant}.apx"));
        let exported = store::export(dir, tenant, &file).unwrap();
        let Share { people, records, own, .. } = share(&all, tenant);
        assert_eq!((exported.people, exported.records), (people, records + own), "{tenant}");
        let imported = store::import(&moved, &file, &store::key_file_of(&file)).unwrap();
        assert_eq!((&imported.tenant, imported.counts), (tenant, exported));
        assert!(of(&everything(&moved), tenant) == of(&all, tenant), "{tenant} changed on its way");
    }
    assert!(everything(&moved) == all, "the labs together hold something else");
    starts_and_audits(&moved);
    let nobody = store::export(dir, &lab("nobody"), &parent.path().join("nobody.apx"));
    assert!(matches!(nobody, Err(ExportError::Empty { .. })), "{nobody:?}");
    all
}

fn key(number: u64) -> PublicKey {
    let mut bytes = [7; 32];
    bytes[..8].copy_from_slice(&number.to_be_bytes());
    PublicKey(bytes)
}

fn admit(number: u64, role: Role) -> Order {
    Order::Admit { key: key(number), role, label: format!("key {number}") }
}

fn quotas(awake: u32) -> Order {
    Order::SetQuotas(Quotas { awake_users: Some(awake), ..Quotas::default() })
}

/// A person with an episode that ended and one that is under way.
fn live(store: &Store, tenant: &TenantId, user: &str) -> StreamId {
    let tiny = Recipe::builtin("tiny").unwrap();
    let mut diary = Diary::new_in(&Arc::new(Bells::new()), store, tenant, user, tiny);
    diary.start("Brass Silver");
    diary.say("ring the brass bell");
    diary.done();
    diary.start("Glass");
    diary.say("polish the silver bell");
    diary.stream
}

/// The labs of the directory, with an open tenant registry.
fn begun(dir: &Path, names: &[&str]) -> (Store, TenantRegistry) {
    let store = open(dir).unwrap();
    let mut tenant_registry = TenantRegistry::open(store.clone()).unwrap();
    for name in names {
        tenant_registry.obey(&lab(name), &Order::Open).unwrap();
    }
    (store, tenant_registry)
}

#[test]
fn the_two_labs_of_the_walk_through_keep_their_keys_and_quotas() {
    let dir = room();
    let (store, mut tenant_registry) = begun(dir.path(), &["mug-lab", "fridge-lab"]);
    for (number, name) in ["mug-lab", "fridge-lab"].into_iter().enumerate() {
        tenant_registry.obey(&lab(name), &admit(number as u64, Role::Gateway)).unwrap();
        tenant_registry.obey(&lab(name), &quotas(50)).unwrap();
    }
    drop((store, tenant_registry));
    let all = check_whole(dir.path());
    assert_eq!(all.values().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
}

#[test]
fn two_labs_with_people_erased_retired_and_disabled_are_kept_whole() {
    let dir = room();
    let (store, mut tenant_registry) = begun(dir.path(), &["mug-lab", "fridge-lab"]);
    let fridge = lab("fridge-lab");
    for (number, name) in ["mug-lab", "fridge-lab"].into_iter().enumerate() {
        tenant_registry.obey(&lab(name), &admit(number as u64, Role::Gateway)).unwrap();
        tenant_registry.obey(&lab(name), &quotas(50)).unwrap();
        for user in ["ada", "bob"] {
            live(&store, &lab(name), user);
        }
        tenant_registry.sign(&lab(name), Through::Episodes).unwrap();
    }
    tenant_registry.obey(&fridge, &admit(9, Role::Operator)).unwrap();
    tenant_registry.obey(&fridge, &Order::Retire { key: key(9), overlap_seconds: 0 }).unwrap();
    let bob = stream(&store.keys, "fridge-lab", "bob");
    tenant_registry.erase(&bob).unwrap();
    tenant_registry.obey(&fridge, &Order::Disable { reason: "over".to_owned() }).unwrap();
    tenant_registry.sign(&fridge, Through::Head).unwrap();
    drop((store, tenant_registry));
    check_whole(dir.path());
    let out = dir.path().join("out");
    store::salvage(dir.path(), &out).unwrap();
    let tenant_registry = TenantRegistry::open(open(&out).unwrap()).unwrap();
    let registry = tenant_registry.registry(&fridge);
    assert!(registry.erased().contains_key(&bob.key));
    assert_eq!(registry.standing().disabled(), Some("over"));
    assert!(registry.standing().keys()[&key(9)].retired.is_some());
    assert_eq!(registry.standing().quotas().awake_users, Some(50));
}

#[test]
fn a_thousand_own_records_beside_two_are_kept_and_the_two_as_well() {
    let dir = room();
    let (store, mut tenant_registry) = begun(dir.path(), &["large", "local"]);
    tenant_registry.obey(&lab("local"), &admit(0, Role::Gateway)).unwrap();
    for awake in 1..1_000 {
        tenant_registry.obey(&lab("large"), &quotas(awake)).unwrap();
    }
    drop((store, tenant_registry));
    let all = check_whole(dir.path());
    assert_eq!(all.values().map(Vec::len).collect::<Vec<_>>(), [1_000, 2]);
}

/// Three labs, of which two share a secret. So one name gives one stream key in both. The records
/// have many chunks, the same lengths and the same keys.
fn twins(dir: &Path) {
    let (store, tenant_registry) = begun(dir, &["one", "other"]);
    drop((store, tenant_registry));
    fs::copy(dir.join("keys/one.key"), dir.join("keys/two.key")).unwrap();
    let store = open(dir).unwrap();
    for round in 0..4 {
        for name in ["one", "two", "other"] {
            let own = StreamId::of_tenant(&lab(name));
            for who in [own, stream(&store.keys, name, "ada")] {
                let long = format!("{name} {round} ").repeat(60_000 / (name.len() + 3));
                let head = store.log.head(&who).unwrap();
                store.log.append(&who, head, batch(["short", &long[..54_000]])).wait().unwrap();
            }
        }
    }
    let [one, two] = ["one", "two"].map(|name| stream(&store.keys, name, "ada").key);
    assert_eq!(one, two);
}

/// What a salvage of `dir` says, and what its result contains after missing secrets are restored.
fn salvaged(dir: &Path, secrets: &[(&Path, &str)]) -> (store::Salvaged, Everything) {
    let parent = room();
    let out = parent.path().join("rescued");
    let salvaged = store::salvage(dir, &out).unwrap();
    for (from, name) in secrets {
        fs::copy(from, out.join("keys").join(name)).unwrap();
    }
    (salvaged, everything(&out))
}

#[test]
fn records_of_many_chunks_under_one_key_are_not_mixed() {
    let dir = room();
    twins(dir.path());
    let all = everything(dir.path());
    let (said, found) = salvaged(dir.path(), &[]);
    assert!(said.is_complete() && found == all, "{:?}", said.by_tenant());
    for name in ["one", "two", "other"] {
        let file = dir.path().join(format!("{name}.apx"));
        let exported = store::export(dir.path(), &lab(name), &file).unwrap();
        let expected = of(&all, &lab(name)).values().map(Vec::len).sum::<usize>();
        assert_eq!(exported.records, expected as u64, "{name}");
    }
    // Only the records themselves say where they belong.
    fs::remove_file(dir.path().join("HEADS")).unwrap();
    let (said, found) = salvaged(dir.path(), &[]);
    assert!(!said.is_complete() && said.unclaimed == 0 && found == all, "{:?}", said.by_tenant());
}

#[test]
fn a_lab_whose_secrets_are_elsewhere_is_kept_sealed() {
    let dir = room();
    twins(dir.path());
    let all = everything(dir.path());
    let elsewhere = dir.path().join("elsewhere");
    fs::rename(dir.path().join("keys/two.key"), &elsewhere).unwrap();
    fs::remove_dir_all(dir.path().join("keys/users/two")).unwrap();
    let (said, found) = salvaged(dir.path(), &[(&elsewhere, "two.key")]);
    assert!(found == all);
    let shares = said.by_tenant();
    assert_eq!(shares[&lab("two")], Share { hurt: 2, ..share(&all, &lab("two")) });
    assert_eq!(shares[&lab("one")], share(&all, &lab("one")));
    // The same without heads: the tree that contains them has the lab's name.
    fs::remove_file(dir.path().join("HEADS")).unwrap();
    let (said, found) = salvaged(dir.path(), &[(&elsewhere, "two.key")]);
    assert!(found == all && said.unclaimed == 0, "{:?}", said.by_tenant());
}

fn program(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(arguments).env_remove("APPRENTICE_LOG").output().unwrap()
}

#[test]
fn the_command_says_of_every_lab_what_was_kept_and_lost() {
    let dir = room();
    let (store, mut tenant_registry) = begun(dir.path(), &["mug-lab", "fridge-lab"]);
    tenant_registry.obey(&lab("mug-lab"), &quotas(50)).unwrap();
    live(&store, &lab("fridge-lab"), "ada");
    drop((store, tenant_registry));
    let (data, out) = (dir.path().to_str().unwrap(), dir.path().join("out"));
    let salvage = || program(&["salvage", "--data", data, "--out", out.to_str().unwrap()]);
    let run = salvage();
    let said = String::from_utf8(run.stdout).unwrap();
    let kept = of(&everything(&out), &lab("fridge-lab")).into_values().map(|r| r.len()).max();
    let mug = "tenant mug-lab: kept 0 records of 0 people and 2 records of its own \
               (keys, quotas, erasures); lost nothing";
    let fridge = format!(
        "tenant fridge-lab: kept {} records of 1 people and 1 records of its own \
         (keys, quotas, erasures); lost nothing",
        kept.unwrap()
    );
    assert!(said.contains(mug) && said.contains(&fridge), "{said}");
    assert_eq!(run.status.code(), Some(0), "{said}");
    fs::remove_dir_all(&out).unwrap();
    let own = format!("keys/users/mug-lab/{}.key", StreamKey::TENANT);
    fs::remove_file(dir.path().join(own)).unwrap();
    let run = salvage();
    let said = String::from_utf8(run.stdout).unwrap();
    let mug = mug.replace("lost nothing", "lost something in 1 stream (at least 0 records)");
    assert!(said.contains(&mug) && said.contains(&fridge), "{said}");
    assert!(said.contains("lost: stream mug-lab/"), "{said}");
    assert_eq!(run.status.code(), Some(1), "{said}");
}

/// A random directory of one to five labs: people, erasures, retired keys, disabled labs, segments
/// and checkpoints, and several openings.
fn any_directory(dir: &Path, dice: &SeededEntropy) {
    let count = 1 + below(dice, 5);
    let names = &["local", "mug-lab", "fridge-lab", "a", "z-9"][..count];
    let (mut store, mut tenant_registry) = begun(dir, names);
    let mut people: Vec<StreamId> = Vec::new();
    let mut numbers = 0;
    for name in names {
        let many = [0, 1, 5, 60][below(dice, 4)];
        for awake in 0..many {
            tenant_registry.obey(&lab(name), &quotas(awake + 1)).unwrap();
        }
        for person in 0..below(dice, 6) {
            people.push(live(&store, &lab(name), &format!("person {person}")));
        }
    }
    for _ in 0..below(dice, 30) {
        let tenant = lab(names[below(dice, names.len())]);
        match below(dice, 9) {
            0 => drop(tenant_registry.sign(&tenant, Through::Episodes).unwrap()),
            1 => drop(tenant_registry.sign(&tenant, Through::Head).unwrap()),
            2 if !people.is_empty() => {
                let erased = people.swap_remove(below(dice, people.len()));
                tenant_registry.erase(&erased).unwrap();
            }
            3 => drop(
                tenant_registry.obey(&tenant, &Order::Disable { reason: "over".into() }).unwrap(),
            ),
            4 => drop(tenant_registry.obey(&tenant, &Order::Enable).unwrap()),
            5 => {
                let known = tenant_registry.registry(&tenant);
                let keys: Vec<_> = known.standing().keys().keys().copied().collect();
                if !keys.is_empty() {
                    let key = keys[below(dice, keys.len())];
                    tenant_registry
                        .obey(&tenant, &Order::Retire { key, overlap_seconds: 0 })
                        .unwrap();
                }
            }
            6 => {
                drop((store, tenant_registry));
                (store, tenant_registry) = begun(dir, &[]);
            }
            _ => {
                numbers += 1;
                let role = Role::ALL[below(dice, 3)];
                tenant_registry.obey(&tenant, &admit(numbers, role)).unwrap();
            }
        }
    }
}

#[test]
fn of_any_directory_salvage_and_export_keep_exactly_what_the_database_holds() {
    let dice = SeededEntropy::new(seed());
    for case in 0..number("APPRENTICE_DIRECTORIES", 40) {
        let dir = room();
        any_directory(dir.path(), &dice);
        println!("case {case}: {} streams", check_whole(dir.path()).len());
    }
}

/// In any damaged directory no lab gets another lab's record, and every loss is reported.
#[test]
fn of_a_damaged_directory_every_lab_keeps_a_prefix_of_its_own_and_is_told_what_it_lost() {
    let dice = SeededEntropy::new(seed());
    let (dir, hurt) = (room(), room());
    let names = ["one", "two", "three"];
    let (store, mut tenant_registry) = begun(dir.path(), &names);
    for round in 0..20 {
        for name in names {
            tenant_registry.obey(&lab(name), &quotas(round + 1)).unwrap();
            let ada = stream(&store.keys, name, "ada");
            let long = "x".repeat(below(&dice, 9_000));
            let head = store.log.head(&ada).unwrap();
            store.log.append(&ada, head, batch([long.as_str()])).wait().unwrap();
        }
    }
    drop((store, tenant_registry));
    let all = everything(dir.path());
    let database = fs::read(dir.path().join("log/db")).unwrap();
    let used: Vec<usize> = (0..database.len()).filter(|&at| database[at] != 0).collect();
    let mut kept = 0;
    let cases = number("APPRENTICE_WOUNDS", 40);
    for case in 0..cases {
        let (wounded, out) = (hurt.path().join("data"), hurt.path().join("out"));
        copy_tree(dir.path(), &wounded);
        let mut bytes = database.clone();
        for _ in 0..1 + below(&dice, 12) {
            bytes[used[below(&dice, used.len())]] ^= 1 << below(&dice, 8);
        }
        fs::write(wounded.join("log/db"), bytes).unwrap();
        let (blind, mute) = (below(&dice, 2) == 0, below(&dice, 3) == 0);
        if blind {
            fs::remove_file(wounded.join("HEADS")).unwrap();
        }
        if mute {
            fs::remove_dir_all(wounded.join("keys/users").join(names[below(&dice, 3)])).unwrap();
        }
        let said = store::salvage(&wounded, &out).unwrap();
        let found = everything(&out);
        let what = format!("case {case}, heads lost {blind}, keys lost {mute}: {said:?}");
        for (who, records) in &all {
            let rescued = found.get(who).map_or(&[][..], |records| records);
            assert!(records.starts_with(rescued), "{who} has others' records; {what}");
            let told = said.streams.iter().any(|f| f.stream == *who && !f.losses.is_empty());
            let told = told || said.heads_damage.is_some();
            assert!(rescued.len() == records.len() || told, "{who} lost in silence; {what}");
            kept += rescued.len();
        }
        assert!(found.keys().all(|who| all.contains_key(who)), "{what}");
        fs::remove_dir_all(&wounded).unwrap();
        fs::remove_dir_all(&out).unwrap();
    }
    let whole = all.values().map(Vec::len).sum::<usize>() * usize::try_from(cases).unwrap();
    println!("{kept} of {whole} records of wounded directories were kept");
    assert!(kept * 10 > whole * 8, "{kept} of {whole}");
}

/// The head of an erased person does not change.
#[test]
fn an_erased_person_of_labs_with_one_secret_is_kept_by_the_head() {
    let dir = room();
    twins(dir.path());
    let store = open(dir.path()).unwrap();
    let erased = stream(&store.keys, "two", "ada");
    store.erase(&erased).unwrap();
    let head = store.log.head(&erased).unwrap();
    assert_ne!(head, Head::EMPTY);
    drop(store);
    let all = everything(dir.path());
    let (said, found) = salvaged(dir.path(), &[]);
    assert!(said.is_complete() && found == all, "{:?}", said.by_tenant());
}
