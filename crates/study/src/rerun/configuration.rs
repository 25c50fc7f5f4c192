//! Which other configuration: what `--with` says.

use std::fmt;
use std::str::FromStr;

use apprentice::learning::Recipe;

/// Values of one sweep, at most: what a slip of the finger should not start.
pub const SWEEP_MAX: usize = 100;
/// No distance is larger: L2 between unit embeddings, and 1 − a probability.
const THRESHOLD_MAX: f32 = 2.0;
const POSSIBLE: &str = "tau=0.3, tau=0.1,0.3, tau=0.1..0.6/0.1 (from..to/step), condition=NAME or \
                        recipe=FILE";

/// What else might have answered: one configuration, or several that are held against the
/// recorded one each by itself.
#[derive(Debug, Clone, PartialEq)]
pub enum With {
    /// The recorded minds with another threshold; in the order given.
    Thresholds(Vec<f32>),
    /// Recipes that ship, by name.
    Conditions(Vec<String>),
    /// A recipe file.
    File(String),
}

/// One other configuration.
#[derive(Debug, Clone)]
pub struct Variant {
    /// As a person would write it: `tau=0.3`, `condition=paper`, `recipe=slow` (the recipe's own
    /// name, never the path of its file).
    pub name: String,
    pub other: Other,
}

#[derive(Debug, Clone)]
pub enum Other {
    /// The recorded mind of each moment; its threshold alone is replaced. In the unit of the
    /// parser's distances.
    Threshold(f32),
    /// Minds of this recipe, trained on the lessons that were recorded.
    Recipe(Box<Recipe>),
}

/// What is wrong with a `--with`, and what is possible.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WithError(String);

impl fmt::Display for WithError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WithError {}

impl Variant {
    pub fn threshold(tau: f32) -> Variant {
        Variant { name: format!("tau={tau}"), other: Other::Threshold(tau) }
    }

    pub fn condition(name: &str, recipe: Recipe) -> Variant {
        Variant { name: format!("condition={name}"), other: Other::Recipe(Box::new(recipe)) }
    }

    pub fn recipe(recipe: Recipe) -> Variant {
        let name = format!("recipe={}", recipe.name());
        Variant { name, other: Other::Recipe(Box::new(recipe)) }
    }
}

impl FromStr for With {
    type Err = WithError;

    fn from_str(text: &str) -> Result<With, WithError> {
        let wrong = |reason: String| WithError(format!("{reason}; possible are {POSSIBLE}"));
        let Some((key, value)) = text.split_once('=') else {
            return Err(wrong(format!("{text:?} does not name a configuration")));
        };
        match key.trim() {
            "tau" => thresholds(value.trim()).map(With::Thresholds).map_err(wrong),
            "condition" => conditions(value.trim()).map(With::Conditions).map_err(WithError),
            "recipe" if value.trim().is_empty() => Err(wrong("recipe= needs a file".to_owned())),
            "recipe" => Ok(With::File(value.trim().to_owned())),
            other => Err(wrong(format!("{other:?} is not a setting that can be changed"))),
        }
    }
}

fn conditions(text: &str) -> Result<Vec<String>, String> {
    let mut names: Vec<String> = Vec::new();
    for name in text.split(',').map(str::trim) {
        if Recipe::builtin(name).is_none() {
            let known = Recipe::BUILTIN.join(", ");
            return Err(format!("there is no condition {name:?}; there are {known}"));
        }
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    Ok(names)
}

fn thresholds(text: &str) -> Result<Vec<f32>, String> {
    let mut values: Vec<f32> = Vec::new();
    for part in text.split(',').map(str::trim) {
        let more = match part.split_once("..") {
            Some((from, rest)) => range(part, from, rest)?,
            None => vec![decimal(part)?.value()],
        };
        for value in more {
            if !(0.0..=THRESHOLD_MAX).contains(&value) {
                return Err(format!("tau is {value}; it is between 0 and {THRESHOLD_MAX}"));
            }
            if !values.contains(&value) {
                values.push(value);
            }
        }
        if values.len() > SWEEP_MAX {
            return Err(format!("{text:?} has more than {SWEEP_MAX} values"));
        }
    }
    Ok(values)
}

/// `from..to/step`, both ends included. Counted in decimal, so that 0.1..0.6/0.1 has the 0.3 that
/// `tau=0.3` has.
fn range(part: &str, from: &str, rest: &str) -> Result<Vec<f32>, String> {
    let (to, step) = rest
        .split_once('/')
        .ok_or_else(|| format!("{part:?} has no step; write it as 0.1..0.6/0.1"))?;
    let ends = [decimal(from)?, decimal(to)?, decimal(step)?];
    let places = ends.iter().map(|end| end.places).max().unwrap_or(0);
    let [from, to, step] = ends.map(|end| end.at(places));
    if step == 0 {
        return Err(format!("{part:?} has a step of 0"));
    }
    if from > to {
        return Err(format!("{part:?} goes backwards; write the smaller number first"));
    }
    if ((to - from) / step) as usize >= SWEEP_MAX {
        return Err(format!("{part:?} has more than {SWEEP_MAX} values"));
    }
    let digits = (from..=to).step_by(step as usize);
    Ok(digits.map(|digits| Decimal { digits, places }.value()).collect())
}

/// A number as it is written: `digits` / 10^`places`.
#[derive(Debug, Clone, Copy)]
struct Decimal {
    digits: u64,
    places: u32,
}

impl Decimal {
    fn at(self, places: u32) -> u64 {
        self.digits * 10_u64.pow(places - self.places)
    }

    fn value(self) -> f32 {
        let text = format!("{}e-{}", self.digits, self.places);
        text.parse().expect("digits with an exponent are a number")
    }
}

fn decimal(text: &str) -> Result<Decimal, String> {
    let text = text.trim();
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = format!("{whole}{fraction}");
    // At most 6 + 6 digits, so that no sum or product of them overflows.
    let fits = !digits.is_empty()
        && whole.len() <= 6
        && fraction.len() <= 6
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    match digits.parse() {
        Ok(digits) if fits => Ok(Decimal { digits, places: fraction.len() as u32 }),
        _ => Err(format!("{text:?} is not a number such as 0.35")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taus(text: &str) -> Vec<f32> {
        match text.parse() {
            Ok(With::Thresholds(values)) => values,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_sweep_is_a_list_or_a_range_and_its_numbers_are_those_that_were_written() {
        assert_eq!(taus("tau=0.3"), [0.3]);
        assert_eq!(taus("tau=0.1..0.6/0.1"), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        assert_eq!(taus("tau=0.1, 0.3,0.1,2"), [0.1, 0.3, 2.0]);
        assert_eq!(taus("tau=0,0.5..1/0.25"), [0.0, 0.5, 0.75, 1.0]);
        assert_eq!(taus("tau=.5"), [0.5]);
        assert_eq!(Variant::threshold(taus("tau=0.1..0.6/0.1")[2]).name, "tau=0.3");
    }

    #[test]
    fn conditions_are_recipes_that_ship_and_recipes_are_files() {
        let some = |text: &str| text.parse::<With>();
        let names = ["paper", "grammar"].map(str::to_owned).to_vec();
        assert_eq!(some("condition=paper, grammar,paper"), Ok(With::Conditions(names)));
        assert_eq!(some("recipe=my.toml"), Ok(With::File("my.toml".to_owned())));
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_can() {
        let refused = |text: &str| text.parse::<With>().unwrap_err().to_string();
        assert_eq!(
            refused("condition=papr"),
            "there is no condition \"papr\"; there are default-1, default-2, paper, grammar, \
             seq2seq, seq2seq-grammar"
        );
        for (text, part) in [
            ("tau", "\"tau\" does not name a configuration; possible are tau=0.3"),
            ("speed=3", "\"speed\" is not a setting that can be changed; possible are tau=0.3"),
            ("tau=", "\"\" is not a number such as 0.35; possible"),
            ("tau=-1", "\"-1\" is not a number such as 0.35; possible"),
            ("tau=NaN", "\"NaN\" is not a number"),
            ("tau=2.5", "tau is 2.5; it is between 0 and 2"),
            ("tau=0.1..0.6", "has no step; write it as 0.1..0.6/0.1"),
            ("tau=0.1..0.6/0", "has a step of 0"),
            ("tau=0.6..0.1/0.1", "goes backwards"),
            ("tau=0..2/0.000001", "has more than 100 values"),
            ("tau=99999999999999999999", "is not a number"),
            ("recipe=", "recipe= needs a file; possible"),
            ("condition=", "there is no condition \"\""),
        ] {
            assert!(refused(text).contains(part), "{text}: {}", refused(text));
        }
    }
}
