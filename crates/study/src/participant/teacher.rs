//! The parameters and the words of a simulated teacher, read from `data/study/teacher.toml`,
//! `teacher-2.toml`, or a file like them.

use std::collections::BTreeMap;

use apprentice::ids::Digest;
use apprentice::world::household::Task;
use serde::Deserialize;

/// How simulated teachers behave. `docs/study.md` describes every parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Teacher {
    pub whole: Share,
    pub part: Share,
    pub trust: Share,
    pub trust_gain: Share,
    pub trust_loss_wrong: Share,
    pub trust_loss_not_understood: Share,
    pub forgetfulness: Share,
    pub effort: Share,
    pub effort_primitives: Share,
    pub variety: Share,
    pub other_names: Share,
    pub walks_left_out: Share,
    pub typos: Share,
    /// Wordings tried for one primitive.
    pub attempts: usize,
    /// Utterances of one episode before it is given up.
    pub utterances_max: usize,
    /// How it speaks beside what it asks for; none of a teacher who says just that.
    pub manner: Option<Manner>,
    wordings: BTreeMap<(Size, String), Vec<String>>,
    digest: Digest,
}

/// How a teacher speaks who does not say just what it wants. No list is empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Manner {
    /// How often a request stands in a frame.
    pub framed: Share,
    /// With `{request}`: "could you please {request}?".
    pub frames: Vec<String>,
    /// How often two requests are made at once.
    pub two_at_once: Share,
    /// With `{first}` and `{second}`.
    pub joins: Vec<String>,
    /// How often a thing of which there are several is told apart.
    pub told_apart: Share,
    /// With `{name}` and `{number}`: "mug 2".
    pub numbered: Vec<String>,
    /// With `{name}`: "the other mug", of two, after the one.
    pub other: Vec<String>,
    /// With `{prep}` and `{place}`, perhaps `{name}`: "the one on the table".
    pub placed: Vec<String>,
}

/// A share in parts of ten thousand, so that trust is the same number on every machine and in every
/// journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Share(pub u32);

/// How much a request asks for at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Size {
    Primitive,
    Part,
    Whole,
}

/// Why a file is no teacher.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the teacher cannot be used: {0}")]
pub struct TeacherError(String);

impl Share {
    pub const ONE: Share = Share(10_000);

    pub fn of(self, whole: Share) -> Share {
        Share((u64::from(self.0) * u64::from(whole.0) / u64::from(Share::ONE.0)) as u32)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    whole: f64,
    part: f64,
    trust: f64,
    trust_gain: f64,
    trust_loss_wrong: f64,
    trust_loss_not_understood: f64,
    forgetfulness: f64,
    effort: f64,
    effort_primitives: f64,
    variety: f64,
    other_names: f64,
    walks_left_out: f64,
    typos: f64,
    attempts: usize,
    utterances_max: usize,
    manner: Option<FileManner>,
    #[serde(rename = "primitives")]
    words_primitives: BTreeMap<String, Vec<String>>,
    #[serde(rename = "parts")]
    words_parts: BTreeMap<String, Vec<String>>,
    #[serde(rename = "whole_tasks")]
    words_whole: BTreeMap<String, Vec<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileManner {
    framed: f64,
    frames: Vec<String>,
    two_at_once: f64,
    joins: Vec<String>,
    told_apart: f64,
    numbered: Vec<String>,
    other: Vec<String>,
    placed: Vec<String>,
}

/// What every teacher has words for.
const PRIMITIVES: [&str; 7] = ["goto", "pickup", "put", "open", "close", "on", "off"];
const PARTS: [&str; 6] = ["fetch", "clean", "heat", "cool", "deliver", "light"];
/// What stands in braces in a wording.
pub(super) const PLACEHOLDERS: [&str; 6] =
    ["{thing}", "{things}", "{place}", "{prep}", "{carrier}", "{light}"];
/// Far fewer than an episode may have, so that every request of an episode is still remembered when
/// a study goes on.
const UTTERANCES_MAX: usize = 300;
const ATTEMPTS_MAX: usize = 20;

impl Teacher {
    /// The teacher that ships.
    pub const TEXT: &'static str = include_str!("../../data/study/teacher.toml");
    /// The names of the teachers that ship.
    pub const BUILTIN: [&'static str; 2] = ["teacher", "teacher-2"];

    /// The text of a teacher that ships.
    pub fn builtin(name: &str) -> Option<&'static str> {
        match name {
            "teacher" => Some(Teacher::TEXT),
            "teacher-2" => Some(include_str!("../../data/study/teacher-2.toml")),
            _ => None,
        }
    }

    /// - errors: no TOML, an unknown or missing field, a share above 1, a kind of request without
    ///   words, or a brace that means nothing.
    pub fn parse(text: &str) -> Result<Teacher, TeacherError> {
        let file: File =
            toml::from_str(text).map_err(|error| TeacherError(error.to_string().trim().into()))?;
        let bad = |what: String| Err(TeacherError(what));
        let share = |name: &str, value: f64| match (0.0..=1.0).contains(&value) {
            true => Ok(Share((value * f64::from(Share::ONE.0)).round() as u32)),
            false => Err(TeacherError(format!("{name} is {value}; a share is from 0 to 1"))),
        };
        if file.whole + file.part > 1.0 {
            return bad(format!("whole {} and part {} are more than 1", file.whole, file.part));
        }
        for (name, value, most) in [
            ("attempts", file.attempts, ATTEMPTS_MAX),
            ("utterances_max", file.utterances_max, UTTERANCES_MAX),
        ] {
            if value < 1 || value > most {
                return bad(format!("{name} is {value}; it is from 1 to {most}"));
            }
        }
        let manner = file.manner.map(|manner| {
            Ok::<Manner, TeacherError>(Manner {
                framed: share("framed", manner.framed)?,
                two_at_once: share("two_at_once", manner.two_at_once)?,
                told_apart: share("told_apart", manner.told_apart)?,
                frames: templates("frames", manner.frames, &["{request}"], &[])?,
                joins: templates("joins", manner.joins, &["{first}", "{second}"], &[])?,
                numbered: templates("numbered", manner.numbered, &["{name}", "{number}"], &[])?,
                other: templates("other", manner.other, &["{name}"], &[])?,
                placed: templates("placed", manner.placed, &["{prep}", "{place}"], &["{name}"])?,
            })
        });
        let manner = manner.transpose()?;
        let mut wordings = BTreeMap::new();
        for (size, section, words, keys) in [
            (Size::Primitive, "primitives", file.words_primitives, &PRIMITIVES[..]),
            (Size::Part, "parts", file.words_parts, &PARTS[..]),
            (Size::Whole, "whole_tasks", file.words_whole, &Task::KINDS[..]),
        ] {
            check_words(section, &words, keys).map_err(TeacherError)?;
            wordings.extend(words.into_iter().map(|(key, list)| ((size, key), list)));
        }
        Ok(Teacher {
            whole: share("whole", file.whole)?,
            part: share("part", file.part)?,
            trust: share("trust", file.trust)?,
            trust_gain: share("trust_gain", file.trust_gain)?,
            trust_loss_wrong: share("trust_loss_wrong", file.trust_loss_wrong)?,
            trust_loss_not_understood: share(
                "trust_loss_not_understood",
                file.trust_loss_not_understood,
            )?,
            forgetfulness: share("forgetfulness", file.forgetfulness)?,
            effort: share("effort", file.effort)?,
            effort_primitives: share("effort_primitives", file.effort_primitives)?,
            variety: share("variety", file.variety)?,
            other_names: share("other_names", file.other_names)?,
            walks_left_out: share("walks_left_out", file.walks_left_out)?,
            typos: share("typos", file.typos)?,
            attempts: file.attempts,
            utterances_max: file.utterances_max,
            manner,
            wordings,
            digest: Digest::of(text.as_bytes()),
        })
    }

    /// What the teacher may say for a kind of request; not empty.
    pub fn wordings(&self, size: Size, key: &str) -> &[String] {
        let list = self.wordings.get(&(size, key.to_owned()));
        list.expect("parsing checked that every kind of request has words")
    }

    /// Of the file's text.
    pub fn digest(&self) -> Digest {
        self.digest
    }
}

/// - errors: no template, one that lacks what it needs, or a brace that means nothing there.
fn templates(
    list: &str,
    templates: Vec<String>,
    needed: &[&str],
    allowed: &[&str],
) -> Result<Vec<String>, TeacherError> {
    let bad = |what: String| Err(TeacherError(format!("{list} of [manner] {what}")));
    if templates.is_empty() {
        return bad("is empty".to_owned());
    }
    for template in &templates {
        if let Some(missing) = needed.iter().find(|name| template.matches(**name).count() != 1) {
            return bad(format!("has {template:?}, which needs {missing} once"));
        }
        let known = needed.iter().chain(allowed);
        let rest = known.fold(template.clone(), |rest, name| rest.replace(name, ""));
        if rest.contains(['{', '}']) {
            return bad(format!("has {template:?} with an unknown brace"));
        }
    }
    Ok(templates)
}

fn check_words(
    section: &str,
    words: &BTreeMap<String, Vec<String>>,
    keys: &[&str],
) -> Result<(), String> {
    if let Some(missing) = keys.iter().find(|key| words.get(**key).is_none_or(Vec::is_empty)) {
        return Err(format!("[{section}] has no words for {missing}"));
    }
    if let Some(other) = words.keys().find(|key| !keys.contains(&key.as_str())) {
        return Err(format!("[{section}] does not know {other}; it has {}", keys.join(", ")));
    }
    for wording in words.values().flatten() {
        let rest = PLACEHOLDERS.iter().fold(wording.clone(), |rest, name| rest.replace(name, ""));
        if rest.contains(['{', '}']) {
            let known = PLACEHOLDERS.join(", ");
            return Err(format!(
                "{wording:?} of [{section}] has a brace that is not one of {known}"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_teacher_that_ships_can_be_used() {
        let teacher = Teacher::parse(Teacher::TEXT).unwrap();
        assert_eq!(teacher.trust, Share(7_000));
        assert!(teacher.wordings(Size::Part, "cool").len() > 3);
    }

    #[test]
    fn the_teachers_that_ship_have_their_manners() {
        let read = |name: &str| Teacher::parse(Teacher::builtin(name).unwrap()).unwrap();
        assert_eq!(Teacher::builtin("teacher-3"), None);
        let [plain, polite] = Teacher::BUILTIN.map(read);
        assert_eq!(plain.manner, None);
        let manner = polite.manner.clone().unwrap();
        assert!(manner.frames.len() >= 10 && manner.framed > Share(3_000), "{manner:?}");
        assert!(manner.told_apart > Share(0) && manner.two_at_once > Share(0), "{manner:?}");
        assert!(polite.wordings(Size::Part, "cool").len() > 3);
    }

    #[test]
    fn a_manner_that_makes_no_sense_is_refused() {
        let text = Teacher::builtin("teacher-2").unwrap();
        let check = |from: &str, to: &str, expected: &str| {
            assert!(text.contains(from), "{from}");
            let error = Teacher::parse(&text.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        check("framed = ", "framed = 1", "framed is 1");
        check("the other {name}", "the other {thing}", "needs {name} once");
        check("please {request}", "please {request} {thing}", "an unknown brace");
        check("{first} and {second}", "{first} and {first}", "needs {first} once");
    }

    #[test]
    fn a_teacher_that_makes_no_sense_is_refused_with_what_is_wrong() {
        let check = |from: &str, to: &str, expected: &str| {
            assert!(Teacher::TEXT.contains(from), "{from}");
            let error = Teacher::parse(&Teacher::TEXT.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        check("effort = 0.9", "effort = 1.5", "effort is 1.5");
        check("effort = 0.9", "diligence = 0.9", "diligence");
        check("whole = 0.35", "whole = 0.95", "more than 1");
        check("attempts = 4", "attempts = 0", "attempts is 0");
        check("\"fetch the {thing}\"", "\"fetch the {think}\"", "{think}");
        check("light = [", "lamps = [", "no words for light");
    }
}
