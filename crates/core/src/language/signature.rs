use super::{Step, Symbol};

/// A primitive of a world and the sorts of its arguments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Operator {
    /// As programs name it: `PICKUP`.
    pub name: Symbol,
    /// One sort per argument.
    pub args: Vec<Symbol>,
}

/// The primitives of a world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature {
    /// In no particular order.
    pub operators: Vec<Operator>,
}

impl Signature {
    /// Whether `step` names a known primitive with the right number of arguments.
    ///
    /// - errors: a sentence that names what was found and what is known.
    pub fn check(&self, step: &Step) -> Result<(), String> {
        let Some(operator) = self.operators.iter().find(|o| o.name == step.operator) else {
            let known: Vec<&str> = self.operators.iter().map(|o| o.name.as_str()).collect();
            return Err(format!(
                "there is no primitive {}; known are {}",
                step.operator,
                known.join(", ")
            ));
        };
        if operator.args.len() != step.args.len() {
            return Err(format!(
                "{} takes {} arguments, {step:?} has {}",
                operator.name,
                operator.args.len(),
                step.args.len(),
                step = step.to_string(),
            ));
        }
        Ok(())
    }
}
