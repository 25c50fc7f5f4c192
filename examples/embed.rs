//! The service inside another program: start it, talk to it, teach it, stop it.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use apprentice::ids::UserId;
use apprentice::service::{Config, Data, Service};
use apprentice::session::{OnClash, Told};
use apprentice::world::Stage;
use apprentice::world::household::Household;

pub fn main() -> Result<(), Box<dyn Error>> {
    let service = Service::start(Config::new(Arc::new(Household::new()), Data::Memory))?;
    let robot = service.connect(UserId::new("ada")?)?;

    robot.start(Stage::Task { task: "place Mug SinkBasin".to_owned(), seed: 7 })?;
    for utterance in ["tidy the mug", "go to the mug", "pick up the mug", "go to the sink"] {
        robot.say(utterance)?;
    }
    robot.say("put the mug in the sink")?;
    let mut status = robot.status()?;
    let lesson = status.to_teach.remove(0);
    let actions = status.actions.iter().map(|action| action.number).collect();
    robot.teach(lesson.seq, actions, OnClash::Ask)?;
    robot.finish_teaching()?;
    robot.wait_until_learned(Duration::from_secs(60))?;

    robot.start(Stage::Task { task: "place Tomato SinkBasin".to_owned(), seed: 8 })?;
    for told in robot.say("tidy the tomato")?.told {
        if let Told::Answered { answer, .. } = told {
            println!("{:?}", answer.outcome);
        }
    }
    service.stop()?;
    Ok(())
}
