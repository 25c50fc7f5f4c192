use std::path::Path;

use apprentice::learning::Recipe;

use super::failure::Failure;

/// Bytes of a recipe file. A recipe is a page of settings.
const RECIPE_BYTES_MAX: u64 = 64 * 1024;

/// The text of a recipe: one that ships, by name, else a file.
///
/// - errors: no such name and no such file, or a file that is no recipe (line, column, what was
///   expected).
pub fn load(name: &str) -> Result<String, Failure> {
    if let Some(text) = Recipe::builtin(name) {
        return Ok(text.to_owned());
    }
    let known = Recipe::BUILTIN.join(", ");
    let unreadable = |error: std::io::Error| {
        Failure::bad_input(format!(
            "there is no recipe {name:?}, and it cannot be read as a file: {error}; the recipes are \
             {known}"
        ))
    };
    let path = Path::new(name);
    let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
    if bytes > RECIPE_BYTES_MAX {
        return Err(Failure::bad_input(format!(
            "recipe {name} has {bytes} bytes; the limit is {RECIPE_BYTES_MAX}"
        )));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    Recipe::parse(&text).map_err(|error| Failure::bad_input(format!("{name}: {error}")))?;
    Ok(text)
}
