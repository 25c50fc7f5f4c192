//! `:known`: the requests that the robot knows.

use apprentice::client::KnownExemplar;
use apprentice::plain::count;

/// `:known`: what was taught, with the numbers that `:forget` takes, then the seeds.
pub fn known(known: &[KnownExemplar]) -> Vec<String> {
    let line = |known: &KnownExemplar| {
        let number = known.lesson.map(|seq| format!("#{seq}")).unwrap_or_default();
        format!("  {number:>5}  \"{}\" = {}", known.exemplar.utterance, known.exemplar.program)
    };
    let (taught, seeds): (Vec<_>, Vec<_>) = known.iter().partition(|known| known.lesson.is_some());
    let mut lines = Vec::new();
    lines.push(match taught.len() {
        0 => "You have taught me nothing yet.".to_owned(),
        n => format!("You taught me {}:", count(n as u32, "request")),
    });
    lines.extend(taught.into_iter().map(line));
    lines.push(format!("I came with {}:", count(seeds.len() as u32, "request")));
    lines.extend(seeds.into_iter().map(line));
    lines
}

#[cfg(test)]
mod tests {
    use apprentice::ids::Seq;
    use apprentice::language::{Exemplar, LiftedUtterance};

    use super::*;

    #[test]
    fn lessons_come_before_seeds_and_have_numbers() {
        let exemplar = |utterance: &str, lesson| KnownExemplar {
            exemplar: Exemplar {
                utterance: LiftedUtterance::parse(utterance),
                program: "GOTO <obj:1>".parse().unwrap(),
            },
            lesson,
        };
        let lines = known(&[exemplar("go to <obj>", None), exemplar("visit <obj>", Seq::new(23))]);
        assert_eq!(
            lines,
            [
                "You taught me 1 request:",
                "    #23  \"visit <obj>\" = GOTO <obj:1>",
                "I came with 1 request:",
                "         \"go to <obj>\" = GOTO <obj:1>"
            ]
        );
    }
}
