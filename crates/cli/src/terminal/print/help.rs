//! What can be typed.

/// `:help`, outside teaching.
pub fn help() -> Vec<String> {
    let text = "\
Say what the robot should do, in your own words: \"go to the mug and pick it up\".
If it does not understand you, do the task in small steps. You can teach it when the task is over.
  :look      show what the robot sees and holds
  :why       show the reason for the last answer
  :known     list every request it knows; your lessons have numbers
  :status    show the task, its goal and the actions so far
  :done      end this task now (done works too)
  :task T    choose the next task, for example :task clean Mug CounterTop
  :wrong     say that the last thing it did is not what you meant; you can then teach it
  :forget N  forget the lesson that :known shows as #N
  :quit      leave; everything is saved";
    text.lines().map(str::to_owned).collect()
}

/// `:help`, while teaching.
pub fn teaching_help() -> Vec<String> {
    let text = "\
Say which actions your words meant:
  3-7        actions 3 to 7 (for one action: 3)
  all        all the actions shown
  none       none of them
  skip       do not teach this
  done       skip the rest and learn
  teach \"wash the mug\" 3-7   teach another of your sentences";
    text.lines().map(str::to_owned).collect()
}
