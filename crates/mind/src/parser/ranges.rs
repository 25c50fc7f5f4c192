//! Bounds of settings, each refused by its name.

use std::fmt::Display;

use super::TrainFault;

/// - errors: `value` is not between 1 and `max`.
pub(super) fn size(field: &'static str, value: usize, max: usize) -> Result<(), TrainFault> {
    within(field, value, 1, max)
}

/// - errors: `value` is not between `low` and `high`, both included; a NaN never is.
pub(super) fn within<T: PartialOrd + Display>(
    field: &'static str,
    value: T,
    low: T,
    high: T,
) -> Result<(), TrainFault> {
    match low <= value && value <= high {
        true => Ok(()),
        false => {
            let (value, allowed) = (value.to_string(), format!("between {low} and {high}"));
            Err(TrainFault::Setting { field, value, allowed })
        }
    }
}
