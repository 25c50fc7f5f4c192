use super::{Household, kitchen, run};
use crate::language::{Mention, Symbol};
use crate::world::{Edition, Features, Show, Words};

fn mention(household: &Household, surface: &str) -> Mention {
    super::mention(household, Edition::First, surface)
}

#[test]
fn a_shared_name_means_what_is_nearest_and_here() {
    let (household, mut scene, task) = kitchen("free");
    // There is no Cup, only mugs; and one dining table among the tables.
    assert_eq!(household.resolve(Edition::First, &scene, &mention(&household, "cup"))[0], "Mug");
    assert_eq!(
        household.resolve(Edition::First, &scene, &mention(&household, "table")),
        ["DiningTable"]
    );
    // Sink and faucet are at the same place: people mean the basin.
    run(&household, &mut scene, &task, "GOTO SinkBasin").unwrap();
    assert_eq!(
        household.resolve(Edition::First, &scene, &mention(&household, "sink")),
        ["SinkBasin", "Faucet", "CounterTop"]
    );
    // Hardly anybody calls a plate a bowl; but when there is no bowl, somebody may.
    assert_eq!(household.resolve(Edition::First, &scene, &mention(&household, "bowl")), ["Plate"]);
    assert_eq!(household.resolve(Edition::First, &scene, &mention(&household, "pan")), ["Plate"]);
    // Nothing of the name is here: the mention's own order, so that somebody can say so.
    assert_eq!(
        household.resolve(Edition::First, &scene, &mention(&household, "lamp")),
        ["DeskLamp", "FloorLamp"]
    );
}

#[test]
fn turning_off_what_is_off_contradicts_the_scene() {
    let (household, mut scene, task) = kitchen("free");
    run(&household, &mut scene, &task, "GOTO Microwave").unwrap();
    let says = |scene: &_, text: &str, program: &str| {
        let words: Vec<String> = text.split(' ').map(str::to_owned).collect();
        household.contradiction(scene, &words, &program.parse().unwrap())
    };
    let once = "TOGGLE Microwave";
    let off = Some((0, "the Microwave is already off".to_owned()));
    assert_eq!(says(&scene, "turn off the microwave", once), off);
    assert_eq!(says(&scene, "turn the microwave on the counter off", once), off);
    assert_eq!(says(&scene, "turn on the microwave", once), None);
    assert_eq!(says(&scene, "toggle the microwave on the counter", once), None);
    assert_eq!(says(&scene, "turn it off", "TOGGLE Microwave; TOGGLE Microwave"), None);
    run(&household, &mut scene, &task, once).unwrap();
    let on = Some((0, "the Microwave is already on".to_owned()));
    assert_eq!(says(&scene, "turn the microwave on", once), on);
    assert_eq!(says(&scene, "turn off the microwave", once), None);
}

#[test]
fn a_dirty_mug_is_no_clean_mug_and_of_others_nothing_is_said() {
    let (household, mut scene, task) = kitchen("clean Mug DiningTable");
    let mug = Symbol::new("Mug");
    assert!(household.unlike(&scene, &mug, "clean"));
    assert!(!household.unlike(&scene, &mug, "cold"));
    assert!(!household.unlike(&scene, &mug, "blue"));
    let wash = "GOTO Mug; PICKUP Mug; GOTO SinkBasin; PUT Mug SinkBasin; TOGGLE Faucet";
    run(&household, &mut scene, &task, wash).unwrap();
    assert!(!household.unlike(&scene, &mug, "clean"));
}

#[test]
fn goals_progress_views_and_steps_read_as_sentences() {
    let (household, mut scene, task) = kitchen("cool Mug DiningTable closed");
    assert_eq!(
        household.goal(&task),
        "cool a mug and put it on the dining table, and leave every door closed"
    );
    let progress = household.progress(&scene, &task);
    assert_eq!(progress.len(), 3);
    assert_eq!(progress[1], ("a cold mug is on the dining table".to_owned(), false));
    run(&household, &mut scene, &task, "GOTO Mug; PICKUP Mug").unwrap();
    let view = household.look(&scene);
    assert_eq!(
        view.summary,
        ["this is a kitchen", "the robot stands at the CounterTop", "it holds the Mug 1"]
    );
    let step = "PUT Mug Fridge".parse().unwrap();
    let binding = ["Mug 1".to_owned(), "Fridge".to_owned()];
    assert_eq!(household.narrate(&step, &binding), "puts the mug 1 in the fridge");
    assert_eq!(household.held(&scene).unwrap(), "Mug");
}

#[test]
fn features_have_a_fixed_length_and_range() {
    let (household, scene, _) = kitchen("free");
    for program in ["PICKUP Apple", "GOTO Potato; PICKUP Potato", "PUT Mug Fridge", "FLY Nowhere"] {
        let features = household.features(&scene, &program.parse().unwrap());
        assert_eq!(features.len(), household.feature_count());
        assert!(features.iter().all(|f| (-1.0..=1.0).contains(f)), "{program}: {features:?}");
    }
    let near = household.features(&scene, &"PICKUP Apple".parse().unwrap());
    let far = household.features(&scene, &"PICKUP Mug".parse().unwrap());
    assert_eq!((near[0], far[0]), (1.0, -1.0));
}
