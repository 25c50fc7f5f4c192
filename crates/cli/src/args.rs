use std::process::ExitCode;

use apprentice::store;
use clap::{Parser, Subcommand};

use super::failure::Failure;
use super::logging::Logging;
use super::{
    audit, check_copy, checkpoint, converse, erase, eval, export, follow, import, keys, log, proof,
    replay, salvage, self_test, serve, study, talk, tenant, transcript, verify,
};

const AFTER_HELP: &str = "\
Examples:
  apprentice                                   talk to the robot; everything is saved
  apprentice --seed 7 --task 'clean Mug CounterTop'
                                               the same task and scene each time
  printf 'go to the mug\\n' | apprentice --data demo
                                               read sentences from a pipe; one line per answer
  apprentice serve --data lab --zmq tcp://127.0.0.1:7117
  apprentice talk --connect tcp://127.0.0.1:7117 --user ada
  apprentice transcript check tests/transcripts/*.txt
  apprentice log show --data demo --user you
  apprentice replay --data demo --user you --at 17
  apprentice audit --data demo --repropose --retrain
  apprentice study rerun --data demo --with tau=0.1..0.6/0.1
  apprentice salvage --data demo --out rescued
  apprentice checkpoint --data lab --out lab.checkpoint
  apprentice proof --data lab --user ada --seq 17 --out ada-17.proof
  apprentice verify ada-17.proof --key lab.pub

Exit codes:
  0  success
  1  the command failed, or it found differences
  2  the arguments are wrong, or a file or directory cannot be used";

/// A household robot that you control in your own words, and that you teach.
///
/// Without a command, apprentice starts a conversation in this terminal. If the robot does not
/// understand you, do the task in small steps. After the task, say which of those steps your words
/// meant. If standard input is a file or a pipe, apprentice reads one sentence per line from it.
#[derive(Debug, Parser)]
#[command(name = "apprentice", version, after_help = AFTER_HELP, args_conflicts_with_subcommands = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Verb>,
    #[command(flatten)]
    converse: converse::Arguments,
    #[command(flatten)]
    logging: Logging,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Serve(serve::Arguments),
    Talk(talk::Arguments),
    Keys(keys::Arguments),
    Tenant(tenant::Arguments),
    Transcript(transcript::Arguments),
    Eval(eval::Arguments),
    Study(study::Arguments),
    Log(log::Arguments),
    Replay(replay::Arguments),
    Audit(audit::Arguments),
    SelfTest(self_test::Arguments),
    Salvage(salvage::Arguments),
    Export(export::Arguments),
    Import(import::Arguments),
    Erase(erase::Arguments),
    Checkpoint(checkpoint::Arguments),
    Proof(proof::Arguments),
    Verify(verify::Arguments),
    Follow(follow::Arguments),
    #[command(hide = true)]
    CheckCopy(check_copy::Arguments),
}

/// Reads the command line, does what it says and gives the exit code.
pub fn main() -> ExitCode {
    let arguments = CommandLine::parse();
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

fn run(arguments: CommandLine) -> Result<(), Failure> {
    if let Some(Verb::CheckCopy(arguments)) = arguments.command {
        return check_copy::run(&arguments);
    }
    if let Ok(program) = std::env::current_exe() {
        store::check_with(program);
    }
    // An operator wants to see that the service runs. A person who talks wants only the conversation.
    let filter = match arguments.command {
        Some(Verb::Serve(_)) => "info",
        _ => "warn",
    };
    arguments.logging.start(filter)?;
    match arguments.command {
        None => converse::run(arguments.converse),
        Some(Verb::Serve(arguments)) => serve::run(arguments),
        Some(Verb::Talk(arguments)) => talk::run(arguments),
        Some(Verb::Keys(arguments)) => keys::run(arguments),
        Some(Verb::Tenant(arguments)) => tenant::run(arguments),
        Some(Verb::Transcript(arguments)) => transcript::run(arguments),
        Some(Verb::Eval(arguments)) => eval::run(arguments),
        Some(Verb::Study(arguments)) => study::run(arguments),
        Some(Verb::Log(arguments)) => log::run(arguments),
        Some(Verb::Replay(arguments)) => replay::run(arguments),
        Some(Verb::Audit(arguments)) => audit::run(arguments),
        Some(Verb::SelfTest(arguments)) => self_test::run(arguments),
        Some(Verb::Salvage(arguments)) => salvage::run(arguments),
        Some(Verb::Export(arguments)) => export::run(arguments),
        Some(Verb::Import(arguments)) => import::run(arguments),
        Some(Verb::Erase(arguments)) => erase::run(arguments),
        Some(Verb::Checkpoint(arguments)) => checkpoint::run(arguments),
        Some(Verb::Proof(arguments)) => proof::run(arguments),
        Some(Verb::Verify(arguments)) => verify::run(arguments),
        Some(Verb::Follow(arguments)) => follow::run(arguments),
        Some(Verb::CheckCopy(arguments)) => check_copy::run(&arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn every_command_says_how_it_ends() {
        let help = CommandLine::command().render_help().to_string();
        for part in ["Exit codes", "Examples", "--seed", "transcript", "--log-filter"] {
            assert!(help.contains(part), "{part} is missing in\n{help}");
        }
    }

    #[test]
    fn options_of_a_conversation_do_not_slip_before_a_command() {
        assert!(CommandLine::try_parse_from(["apprentice", "--seed", "7", "serve"]).is_err());
        let after = ["apprentice", "serve", "--data", "d", "--zmq", "tcp://127.0.0.1:1"];
        assert!(CommandLine::try_parse_from(after).is_ok());
        let logging = ["apprentice", "talk", "--connect", "ipc://x", "--log-format", "json"];
        assert!(CommandLine::try_parse_from(logging).is_ok());
    }
}
