//! Calls into a library that panics where it should return an error.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
    static MESSAGE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// What an operator is told of a panic. Its own message speaks to programmers, and goes to the log
/// file at level debug.
const GAVE_UP: &str = "the database's own code gave up over what it found";

/// Runs `call`; a panic inside comes back as a sentence and prints nothing.
///
/// The first call puts a hook before the process's panic hook. Panics of other threads, and of
/// this one outside of `call`, go on to the hook that was there.
pub(in crate::store) fn guarded<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let sled_helper =
                std::thread::current().name().is_some_and(|name| name.starts_with("sled-io-"));
            if GUARDED.get() {
                MESSAGE.set(Some(text_of(info.payload())));
            } else if !sled_helper {
                before(info);
            }
        }));
    });
    let outer = GUARDED.replace(true);
    // What the library leaves half done is its own; the caller gives up on it after an error.
    let result = panic::catch_unwind(AssertUnwindSafe(call));
    GUARDED.set(outer);
    result.map_err(|payload| {
        let message = MESSAGE.take().unwrap_or_else(|| text_of(&*payload));
        tracing::debug!(%message, "a panic of the database's code was caught");
        GAVE_UP.to_owned()
    })
}

fn text_of(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned());
    let text = text.unwrap_or_else(|| "a panic without a message".to_owned());
    // One line: it becomes part of a sentence.
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    line.chars().take(200).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_comes_back_as_one_sentence_without_its_message() {
        assert_eq!(guarded(|| 3), Ok(3));
        let damaged = guarded(|| -> u8 { panic!("page {} is\n  damaged", 7) });
        assert_eq!(damaged, Err(GAVE_UP.to_owned()));
        assert!(!GUARDED.get());
    }
}
