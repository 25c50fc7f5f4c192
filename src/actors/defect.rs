use std::any::Any;

use crate::client::{ErrorCode, Response};

/// The answer to a request during which the service panicked. Writes it into the log for the
/// operator, too.
///
/// - `doing`: what the service was doing, for the message.
pub(super) fn defect(doing: &str, panic: &(dyn Any + Send)) -> Response {
    let words = panic_words(panic);
    // The message of a panic may contain what a person said, so only the debug level has it.
    tracing::error!(doing, "a defect; the actor is replaced by one from the log");
    tracing::debug!(doing, %words, "what the defect said");
    Response::error(
        ErrorCode::Internal,
        format!(
            "a defect of apprentice while {doing}; nothing was lost, please report it: {words}"
        ),
    )
}

/// The message of a panic.
pub(super) fn panic_words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned())
}
