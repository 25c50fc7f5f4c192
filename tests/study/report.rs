//! `study report` draws the figures of a finished study again, from its tables alone.

use std::fs;
use std::path::Path;
use std::process::Command;

const STUDY: &str = "seed = 7\nprogram = \"apprentice 0.0.0\"\n[design]\ntask_types = [\"cool\"]\n\
                     users = 1\nepisodes = 2\n[participants]\nsimulated = true\n[[condition]]\n\
                     name = \"paper\"\nrecipe = \"ab\"\n";
const UTTERANCES: &str = "condition,task_type,user,episode,turn,utterance,outcome,answered_by,\
                          guessed,meant,right,primitives,taught\n\
                          paper,cool,u1,1,1,\"chill it, please\",not_sure,,0,,,0,1\n";
const EPISODES: &str = "condition,task_type,user,episode,goal,utterances,understood,not_sure,\
                        impossible,wrong,primitives,fewest_actions,normalised_length,complexity,\
                        examples_taught,finished\n\
                        paper,cool,u1,1,chill a mug,12,11,1,0,0,12,10,1.2000,1.0000,45,1\n";
const SUMMARY: &str = "condition,task_type,episode,measure,users,mean,sd\n\
                       paper,all,1,complexity,1,1.0000,\npaper,all,2,complexity,1,2.5000,\n\
                       paper,all,1,examples_taught,1,45.0000,\n\
                       paper,all,1,normalised_length,1,1.2000,\n";
const ANSWERED: &str = "condition,answered_by,parses,share\npaper,exemplar,11,1.0000\n";

fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

fn report(folder: &Path) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(["study", "report", "--out"]).arg(folder).env_remove("APPRENTICE_LOG");
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_study_is_drawn_from_its_tables_and_drawn_again_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, text) in [
        ("study.toml", STUDY),
        ("utterances.csv", UTTERANCES),
        ("episodes.csv", EPISODES),
        ("summary.csv", SUMMARY),
        ("answered.csv", ANSWERED),
    ] {
        write(folder, name, text);
    }
    let (code, out, err) = report(folder);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert_eq!(out, "general.svg\ngeneral.png\nreport.html\n");
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("Simulated users, not people"), "{page}");
    let bytes = || {
        ["general.svg", "general.png", "report.html"]
            .map(|name| fs::read(folder.join(name)).unwrap())
    };
    let before = bytes();
    report(folder);
    assert!(bytes() == before, "the same tables give the same bytes");

    write(folder, "summary.csv", &SUMMARY.replace("2.5000", "much"));
    let (code, _, err) = report(folder);
    let expected = "apprentice: summary.csv, line 3: mean is \"much\"; expected a number\n";
    assert_eq!((code, err.as_str()), (Some(2), expected));
    write(folder, "summary.csv", &SUMMARY.replace("measure", "what"));
    let (code, _, err) = report(folder);
    assert_eq!(code, Some(2));
    assert!(err.contains("summary.csv, line 1: there is no column measure; expected"), "{err}");
    fs::remove_file(folder.join("study.toml")).unwrap();
    let (code, _, err) = report(folder);
    assert_eq!(code, Some(2));
    assert!(err.contains("study.toml cannot be read") && err.contains("of a study?"), "{err}");
}
