//! What the second edition of the names promises, over all types.

use std::collections::{BTreeMap, BTreeSet};

use super::super::facts::{embedded, facts};
use super::super::{Kind, Room, Scene, SceneBuilder};
use super::{Household, mention};
use crate::language::Utterance;
use crate::world::{Edition, Lexicon, Words};

const OVERLAY: &str = include_str!("../../data/names-2.toml");
const FIRST: &str = include_str!("../../data/names.toml");
const WORDS: &str = include_str!("../../data/words-2.toml");

type Table = BTreeMap<String, BTreeMap<String, u32>>;

/// What a type is called by itself: its plain name, and that or the type written as one word.
fn own_names(kind: Kind) -> BTreeSet<String> {
    let plain = kind.said().to_lowercase();
    let mut names = BTreeSet::from([plain.replace(' ', ""), kind.name().to_lowercase()]);
    names.insert(plain);
    let written_otherwise: &[&str] = match kind.name() {
        "TVStand" => &["television stand"],
        "Television" => &["tv", "t v"],
        "KeyChain" => &["keys", "keyring", "key ring"],
        "BasketBall" => &["basket ball"],
        "BathtubBasin" => &["bath tub", "tub"],
        "SinkBasin" => &["sink basin"],
        "Footstool" => &["foot stool"],
        "CounterTop" => &["counter"],
        "RemoteControl" => &["remote"],
        "CellPhone" => &["phone"],
        "Fridge" => &["refrigerator"],
        _ => &[],
    };
    names.extend(written_otherwise.iter().map(|name| (*name).to_owned()));
    names
}

fn second(household: &Household) -> &Lexicon {
    household.lexicon(Edition::Second)
}

fn means<'a>(lexicon: &'a Lexicon, name: &str) -> Vec<&'a str> {
    let meanings = lexicon.names.get(name).into_iter().flatten();
    meanings.map(|meaning| meaning.kind.as_str()).collect()
}

#[test]
fn every_type_has_its_own_names_and_they_mean_it_first() {
    let household = Household::new();
    let lexicon = second(&household);
    for kind in facts().all() {
        for name in own_names(kind) {
            assert_eq!(means(lexicon, &name).first(), Some(&kind.name()), "{name:?}");
        }
        // People write compounds with a hyphen, too, and the plural is no other thing.
        let plain = kind.said().to_lowercase();
        let hyphenated = Utterance::new(&plain.replace(' ', "-")).unwrap().tokens().join(" ");
        assert!(means(lexicon, &hyphenated).contains(&kind.name()), "{hyphenated:?}");
        let plural = means(lexicon, &format!("{plain}s"));
        assert!(plural.is_empty() || plural[0] == kind.name(), "{plain}s means {plural:?}");
    }
}

/// A thing of type `own`, far away or even shut in, and things of other types where the robot is.
fn far_from_others(own: Kind, others: &[Kind], shut_in: bool) -> Option<Scene> {
    let mut builder = SceneBuilder::new(Room::Kitchen);
    let robot = (builder.scene().robot.x, builder.scene().robot.y);
    for other in others {
        builder.stand_kind_at(*other, robot).unwrap();
    }
    if shut_in {
        let cabinet = builder.stand_kind_at(Kind::named("Cabinet")?, (0, 0)).unwrap();
        builder.put_kind(own, cabinet).ok()?;
    } else {
        builder.stand_kind_at(own, (0, 0)).unwrap();
    }
    Some(builder.build())
}

#[test]
fn an_own_name_means_its_own_thing_wherever_things_stand() {
    let household = Household::new();
    let mut shared = 0;
    for kind in facts().all() {
        for name in own_names(kind) {
            let said = mention(&household, Edition::Second, &name);
            let others: Vec<Kind> =
                said.types.iter().filter_map(|kind| Kind::named(kind.as_str())).collect();
            let others: Vec<Kind> = others.into_iter().filter(|other| *other != kind).collect();
            shared += usize::from(!others.is_empty());
            for shut_in in [false, true] {
                let Some(scene) = far_from_others(kind, &others, shut_in) else { continue };
                let found = household.resolve(Edition::Second, &scene, &said);
                assert_eq!(found[0], kind.name(), "{name:?}, shut in: {shut_in}");
            }
        }
    }
    // In the first edition these led elsewhere.
    assert!(shared >= 10, "{shared}");
    for (name, own, taken) in [
        ("knife", "Knife", "ButterKnife"),
        ("salt shaker", "SaltShaker", "PepperShaker"),
        ("towel", "Towel", "HandTowel"),
        ("cup", "Cup", "Mug"),
    ] {
        let (own, other) = (Kind::named(own).unwrap(), Kind::named(taken).unwrap());
        let scene = far_from_others(own, &[other], false).unwrap();
        let first = mention(&household, Edition::First, name);
        assert_eq!(household.resolve(Edition::First, &scene, &first)[0], taken, "{name:?}");
    }
}

#[test]
fn a_thing_that_can_be_carried_is_hardly_ever_taken_for_another() {
    let household = Household::new();
    let lexicon = second(&household);
    let mut rare = Vec::new();
    for (name, meanings) in &lexicon.names {
        for meaning in meanings {
            let kind = Kind::named(meaning.kind.as_str()).unwrap();
            if kind.pickupable() && lexicon.rarely_means(name, &meaning.kind) {
                rare.push(format!("{name}: {kind}"));
            }
        }
    }
    assert_eq!(
        rare,
        [
            "coffee cup: Cup",
            "cup: Mug",
            "knife: ButterKnife",
            "pan: Pot",
            "spoon: Ladle",
            "towel: HandTowel",
            "vase: Glassbottle",
        ]
    );
}

#[test]
fn nothing_that_opens_is_opened_for_something_else() {
    let household = Household::new();
    let lexicon = second(&household);
    for name in ["cabinet", "cupboard", "shelf", "dresser", "desk", "counter", "table", "oven"] {
        let opens = |kind: &&str| Kind::named(kind).is_some_and(|kind| kind.openable());
        let found: Vec<&str> = means(lexicon, name).into_iter().filter(opens).collect();
        let expected: &[&str] = match name {
            "cabinet" | "cupboard" => &["Cabinet"],
            _ => &[],
        };
        assert_eq!(found, expected, "{name:?}");
    }
    assert_eq!(means(lexicon, "drawer"), ["Drawer"]);
}

#[test]
fn slips_of_single_people_are_gone_and_shared_names_stay() {
    let household = Household::new();
    let lexicon = second(&household);
    let check = |name: &str, expected: &str| {
        assert_eq!(means(lexicon, name).join(" "), expected, "{name:?}");
    };
    check("bat", "BaseballBat");
    check("bowl", "Bowl");
    check("plate", "Plate");
    check("pan", "Pan Pot");
    check("potato", "Potato");
    check("pencil", "Pencil");
    check("box", "Box");
    check("tissue", "TissueBox");
    check("salt", "SaltShaker");
    check("pepper mill", "PepperShaker");
    for gone in
        ["bar", "baking pan", "nail polish", "bottle of nail polish", "oven", "jar", "toast"]
    {
        check(gone, "");
    }
    check("glass", "Cup");
    check("lamp", "DeskLamp FloorLamp");
    check("couch", "Sofa ArmChair");
    check("bin", "GarbageCan");
    check("soap", "SoapBar SoapBottle");
    check("bottle", "SoapBottle WineBottle SprayBottle Glassbottle");
}

#[test]
fn everyday_names_are_known() {
    let household = Household::new();
    let lexicon = second(&household);
    for (kind, names) in [
        ("RemoteControl", "remote, tv remote, remote controller, clicker"),
        ("Television", "tv, telly, television set, flat screen"),
        ("Faucet", "tap, kitchen tap, water tap"),
        ("GarbageCan", "trash can, garbage bin, trash, rubbish bin, dustbin, waste basket"),
        ("Fridge", "fridge, refrigerator"),
        ("StoveBurner", "stove, burner, hob, cooktop, cooker"),
        ("CoffeeMachine", "coffee maker, coffeemaker, espresso maker"),
        ("CounterTop", "worktop, countertop, counter, kitchen counter, benchtop"),
        ("Sofa", "sofa, couch, settee, loveseat, divan"),
        ("Laptop", "laptop, notebook computer, computer"),
        ("CellPhone", "phone, mobile phone, smartphone, cell"),
        ("KeyChain", "keys, key, set of keys, house key"),
        ("SprayBottle", "spray, spray cleaner, sprayer"),
        ("TissueBox", "tissue, tissues, box of tissues, kleenex"),
        ("ToiletPaper", "loo roll, toilet roll, roll of toilet paper"),
        ("HousePlant", "plant, potted plant, pot plant"),
        ("ScrubBrush", "brush, scrubbing brush, toilet brush"),
        ("SideTable", "nightstand, bedside table, end table"),
        ("LaundryHamper", "laundry basket, hamper, washing basket"),
        ("PaperTowelRoll", "paper towel, kitchen roll"),
        ("TowelHolder", "bath towel rack"),
        ("SaltShaker", "salt, salt cellar"),
    ] {
        for name in names.split(", ") {
            assert_eq!(means(lexicon, name).first(), Some(&kind), "{name:?}");
        }
    }
}

#[test]
fn the_overlay_changes_what_it_lists_and_nothing_else() {
    let (first, overlay): (Table, Table) =
        (embedded("names.toml", FIRST), embedded("names-2.toml", OVERLAY));
    for (name, meanings) in &overlay {
        assert_ne!(first.get(name), Some(meanings), "{name} changes nothing");
        assert!(first.contains_key(name) || !meanings.is_empty(), "{name} is gone already");
    }
    let household = Household::new();
    let (old, new) = (household.lexicon(Edition::First), second(&household));
    assert_eq!(old.names.len(), first.len());
    for (name, meanings) in &old.names {
        assert!(overlay.contains_key(name) || new.names.get(name) == Some(meanings), "{name}");
    }
    assert_eq!((&old.pronouns, &old.adjectives), (&new.pronouns, &new.adjectives));
    assert_eq!((&old.fixtures, &old.roles), (&new.fixtures, &new.roles));

    let words: BTreeMap<String, BTreeMap<String, String>> = embedded("words-2.toml", WORDS);
    for (plural, singular) in &words["plurals"] {
        assert!(!old.plurals.contains_key(plural), "{plural}");
        assert!(new.names.contains_key(singular), "{singular} is no name");
    }
}
