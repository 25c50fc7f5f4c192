//! The map must be the territory: the two tables of `ARCHITECTURE.md` are read from that file and
//! every `use` in `src/` is held against them. A change to a table is a design change. The tables of
//! `tests/README.md` are compared with the tests that there are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            out.push(path);
        }
    }
}

/// Where source files are: the service, and the crates below it, with the room that a crate's own
/// files belong to, if it has no rooms.
const SOURCES: [(&str, Option<&str>); 4] = [
    ("src", None),
    ("crates/core/src", None),
    ("crates/household/src", Some("household")),
    ("crates/mind/src", None),
];

/// Every source file with its path below its `src/`, comments and string contents blanked out. The
/// household is one room: its files stand below `household/`.
fn sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (folder, room) in SOURCES {
        let folder = root().join(folder);
        let mut files = Vec::new();
        rust_files(&folder, &mut files);
        for path in files {
            let below = path.strip_prefix(&folder).unwrap();
            let name = room.map_or(below.to_owned(), |room| Path::new(room).join(below));
            found.push((name.display().to_string(), strip(&read(&path))));
        }
    }
    found
}

/// The file or folder that stands for a room, or for a place inside one.
fn place_of(name: &str) -> Option<PathBuf> {
    SOURCES.iter().find_map(|(folder, room)| {
        let folder = root().join(folder);
        let below = match room {
            Some(room) => name.strip_prefix(*room)?.trim_start_matches('/'),
            None => name,
        };
        let (found, file) = (folder.join(below), folder.join(format!("{below}.rs")));
        [found, file].into_iter().find(|path| path.exists())
    })
}

/// Blanks line comments, block comments and string literals, so that words in them do not count.
fn strip(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '/' if chars.peek() == Some(&'/') => {
                while chars.peek().is_some_and(|&next| next != '\n') {
                    chars.next();
                }
            }
            '/' if chars.peek() == Some(&'*') => {
                let mut last = ' ';
                for next in chars.by_ref() {
                    if last == '*' && next == '/' {
                        break;
                    }
                    last = next;
                }
            }
            '"' => {
                let mut escaped = false;
                for next in chars.by_ref() {
                    match next {
                        '\\' if !escaped => escaped = true,
                        '"' if !escaped => break,
                        _ => escaped = false,
                    }
                }
                out.push_str("\"\"");
            }
            // A quote character must not open a string.
            '\'' => {
                out.push('\'');
                let mut ahead = chars.clone();
                if (ahead.next(), ahead.next()) == (Some('"'), Some('\'')) {
                    chars.next();
                }
            }
            other => out.push(other),
        }
    }
    out
}

/// The rows of the table in `ARCHITECTURE.md` whose header's first cell is `head`: from each name
/// in backquotes of the first cell to the text of the second.
fn table(head: &str) -> BTreeMap<String, String> {
    let map = read(&root().join("ARCHITECTURE.md"));
    let cells = |line: &str| -> Vec<String> {
        line.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let mut lines = map.lines().skip_while(|line| !line.starts_with(&format!("| {head}")));
    assert!(lines.next().is_some(), "ARCHITECTURE.md has no table whose header begins with {head}");
    let mut rows = BTreeMap::new();
    for line in lines.skip(1).take_while(|line| line.starts_with('|')) {
        let cells = cells(line);
        for name in quoted(&cells[0]) {
            rows.insert(name, cells[1].clone());
        }
    }
    assert!(!rows.is_empty(), "the table {head} in ARCHITECTURE.md is empty");
    rows
}

fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The room a file belongs to: its folder below `src/`, or its own name.
fn room(file: &str) -> &str {
    file.split(['/', '.']).next().unwrap()
}

/// Whether a file holds tests only.
fn is_test(file: &str) -> bool {
    let mut parts = file.split('/');
    parts.any(|part| matches!(part, "tests" | "tests.rs" | "bench.rs"))
}

/// The rooms that a source text names as `crate::room`, nested imports included.
fn rooms_named(text: &str) -> BTreeSet<String> {
    named_behind("crate::", text)
}

/// The names that follow `path` in a source text, nested imports included.
fn named_behind(path: &str, text: &str) -> BTreeSet<String> {
    let name = |rest: &str| -> String {
        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut found = BTreeSet::new();
    for (place, _) in text.match_indices(path) {
        if text[..place].ends_with('$') {
            continue;
        }
        let rest = &text[place + path.len()..];
        match rest.strip_prefix('{') {
            Some(list) => {
                let mut depth = 0;
                let mut start = true;
                for (index, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => start = true,
                        c if start && depth == 0 && (c.is_alphanumeric() || c == '_') => {
                            found.insert(name(&list[index..]));
                            start = false;
                        }
                        _ => {}
                    }
                }
            }
            None => {
                found.insert(name(rest));
            }
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

/// Whether a room may name what `text` names of `room`: all of it, or single names.
fn allows(allowed: &[String], room: &str, text: &str) -> bool {
    let single = |name: &String| allowed.contains(&format!("{room}::{name}"));
    let named = named_behind(&format!("crate::{room}::"), text);
    // A list of rooms would hide what it takes of each.
    let only_single = || !text.contains("crate::{") && named.iter().all(single);
    allowed.iter().any(|each| each == room) || (!named.is_empty() && only_single())
}

#[test]
fn rooms_import_only_what_the_map_allows() {
    let walls = table("room");
    let shared = ["ids", "limits", "invariants", "plain"];
    let mut wrong = Vec::new();
    for (file, text) in sources() {
        let here = room(&file).to_owned();
        if file.ends_with("lib.rs") || shared.contains(&here.as_str()) {
            continue;
        }
        // `main.rs` sees the library from outside.
        let text = if file == "main.rs" { text.replace("apprentice::", "crate::") } else { text };
        let allowed = walls
            .get(&here)
            .unwrap_or_else(|| panic!("{file}: the room `{here}` has no row in ARCHITECTURE.md"));
        if allowed == "everything" {
            continue;
        }
        let allowed = quoted(allowed);
        for named in rooms_named(&text) {
            let fine = named == here
                || shared.contains(&named.as_str())
                || allows(&allowed, &named, &text)
                || !walls.contains_key(&named);
            if !fine {
                wrong.push(format!("src/{file} imports `{named}`, which `{here}` may not"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A source text without the module `tests` at its end.
fn product(text: &str) -> &str {
    text.split("#[cfg(test)]\nmod tests {").next().unwrap()
}

/// The folders and files of the store, and the files of each folder, from each to those it imports.
fn arrows_in_the_store() -> BTreeMap<String, BTreeSet<String>> {
    let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, text) in sources() {
        let Some(below) = file.strip_prefix("store/") else { continue };
        if is_test(&file) || below == "mod.rs" {
            continue;
        }
        let unit = room(below);
        let mut named = named_behind("crate::store::", product(&text));
        for name in &named {
            let fine = place_of(&format!("store/{name}")).is_some();
            assert!(fine, "src/{file} imports `store::{name}`; name the file that holds it");
        }
        named.remove(unit);
        arrows.entry(unit.to_owned()).or_default().extend(named);
        // A folder's `mod.rs` declares the files beside it.
        if let Some((folder, name)) = below.rsplit_once('/').filter(|(_, name)| *name != "mod.rs") {
            let beside = named_behind("super::", product(&text)).into_iter();
            let beside = beside.map(|name| format!("{folder}/{name}"));
            let beside = beside.filter(|name| place_of(&format!("store/{name}")).is_some());
            let name = format!("{folder}/{}", room(name));
            arrows.entry(name).or_default().extend(beside);
        }
    }
    arrows
}

/// What is left when everything is taken away that imports nothing that is left.
fn circle(mut arrows: BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    loop {
        let before = arrows.len();
        let left: BTreeSet<String> = arrows.keys().cloned().collect();
        arrows.retain(|_, named| named.iter().any(|name| left.contains(name)));
        if arrows.len() == before {
            return left.into_iter().collect();
        }
    }
}

#[test]
fn imports_inside_the_store_make_no_circle() {
    let arrows = arrows_in_the_store();
    assert!(arrows.len() > 30 && arrows["directory"].contains("sled"), "{arrows:?}");
    assert_eq!(circle(arrows), Vec::<String>::new());
    let arrow = |from: &str, to: &str| (from.to_owned(), BTreeSet::from([to.to_owned()]));
    let round = BTreeMap::from([arrow("a", "b"), arrow("b", "c"), arrow("c", "b")]);
    assert_eq!(circle(round).len(), 3, "the check can fail");
}

#[test]
fn packages_appear_only_where_the_map_allows() {
    let packages = table("package");
    let mut wrong = Vec::new();
    for (package, allowed) in &packages {
        let allowed = quoted(allowed);
        for place in &allowed {
            assert!(place_of(place).is_some(), "the package table names {place}");
        }
        let needle = format!("{}::", package.replace('-', "_"));
        for (file, text) in sources() {
            let used = text.match_indices(&needle).any(|(place, _)| {
                let before = text[..place].chars().next_back();
                !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
            });
            let fine = allowed.iter().any(|place| {
                file == *place || room(&file) == place || file.starts_with(&format!("{place}/"))
            });
            if used && !fine && !is_test(&file) {
                wrong.push(format!("src/{file} uses `{package}`, which the map keeps elsewhere"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_dependency_stands_in_the_map_or_the_list_with_its_reason() {
    let manifest: toml::Table = read(&root().join("Cargo.toml")).parse().unwrap();
    let reasons = read(&root().join("docs/dependencies.md"));
    let declared = manifest["workspace"]["dependencies"].as_table().unwrap();
    for name in declared.keys() {
        let row = format!("| `{name}` |");
        assert!(reasons.contains(&row), "docs/dependencies.md has no line for `{name}`");
    }
    // A version stands in one place.
    for (folder, _) in SOURCES {
        let manifest = root().join(folder).parent().unwrap().join("Cargo.toml");
        let manifest: toml::Table = read(&manifest).parse().unwrap();
        for section in ["dependencies", "dev-dependencies"] {
            let Some(section) = manifest.get(section) else { continue };
            for (name, value) in section.as_table().unwrap() {
                assert!(
                    value.get("workspace").is_some(),
                    "{folder}: `{name}` has a version of its own"
                );
            }
        }
    }
}

#[test]
fn every_room_and_every_link_of_the_map_exists() {
    let map = read(&root().join("ARCHITECTURE.md"));
    for (file, _) in sources() {
        let here = room(&file);
        if here != "lib" && here != "lib.rs" {
            assert!(map.contains(&format!("`{here}")), "ARCHITECTURE.md does not name `{here}`");
        }
    }
    for name in table("room").into_keys() {
        assert!(
            place_of(&name).is_some(),
            "ARCHITECTURE.md describes {name}, which does not exist"
        );
    }
}

#[test]
fn links_between_pages_lead_somewhere() {
    let mut pages = vec![];
    for folder in ["", "docs", "docs/adr", "deploy", "schema", "tests"] {
        let Ok(entries) = fs::read_dir(root().join(folder)) else { continue };
        let paths = entries.map(|entry| entry.unwrap().path());
        pages.extend(paths.filter(|path| path.extension().is_some_and(|e| e == "md")));
    }
    assert!(pages.len() > 5, "found only {} pages", pages.len());
    let mut dead = Vec::new();
    for page in pages {
        for piece in read(&page).split("](").skip(1) {
            let target = piece.split([')', '#', ' ']).next().unwrap();
            if target.is_empty() || target.contains("://") {
                continue;
            }
            if !page.parent().unwrap().join(target).exists() {
                dead.push(format!("{} links to {target}", page.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

/// The names of what lies in a folder, without the ending `.rs`; folders of code have one, too.
fn modules_in(folder: &Path) -> BTreeSet<String> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let code = paths.filter(|path| {
        path.extension().is_some_and(|ending| ending == "rs") || head_of(path).is_some()
    });
    code.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
}

/// The file of a folder that declares the modules in it.
fn head_of(folder: &Path) -> Option<PathBuf> {
    ["main.rs", "mod.rs"].map(|name| folder.join(name)).into_iter().find(|path| path.is_file())
}

#[test]
fn every_test_module_is_compiled_and_has_its_line() {
    let tests = root().join("tests");
    let page = read(&tests.join("README.md"));
    let section = |title: &str| page.split("\n## ").find(|part| part.lines().next() == Some(title));
    let lines = |section: &str| -> BTreeSet<String> {
        let rows = section.lines().filter_map(|line| line.strip_prefix("| `"));
        rows.map(|row| row.split('`').next().unwrap().to_owned()).collect()
    };
    let mut alone = BTreeSet::new();
    for executable in modules_in(&tests) {
        let folder = tests.join(&executable);
        match section(&executable) {
            None => drop(alone.insert(executable)),
            Some(section) => {
                let mut modules = modules_in(&folder);
                modules.remove("main");
                assert_eq!(lines(section), modules, "tests/README.md and tests/{executable}/");
            }
        }
    }
    let own = section("Executables of their own").expect("the page has their section");
    assert_eq!(lines(own), alone, "tests/README.md and the executables of their own");

    // A file that nobody declares would never be run.
    let mut waiting = vec![tests];
    while let Some(folder) = waiting.pop() {
        let paths = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        waiting.extend(paths.filter(|path| path.is_dir()));
        let Some(head) = head_of(&folder) else { continue };
        let declared = strip(&read(&head));
        for module in modules_in(&folder) {
            let is_head = folder.join(format!("{module}.rs")) == head;
            let fine = is_head || declared.contains(&format!("mod {module};"));
            assert!(fine, "{} does not declare {module}", head.display());
        }
    }
}

#[test]
fn the_core_has_no_clock_no_entropy_and_no_unordered_map() {
    let core = [
        "fairness",
        "language",
        "numerics",
        "events",
        "evidence",
        "world",
        "household",
        "parser",
        "grounding",
        "learning",
        "session",
        "tenancy",
        "ids",
        "limits",
        "invariants",
        "plain",
    ];
    let banned = [
        "std::time",
        "std::fs",
        "std::net",
        "std::env",
        "std::thread",
        "std::process",
        "HashMap",
        "HashSet",
        "SystemTime",
        "Instant",
        "getrandom",
        "mul_add",
        "par_iter",
        "rayon",
        "general_mat_mul",
        ".exp()",
        ".ln()",
        ".tanh()",
        ".sin()",
        ".cos()",
        ".powf(",
        ".exp2()",
    ];
    let mut wrong = Vec::new();
    for (file, text) in sources() {
        if !core.contains(&room(&file)) || is_test(&file) {
            continue;
        }
        let product = text.split("#[cfg(test)]").next().unwrap();
        wrong.extend(
            banned
                .iter()
                .filter(|word| product.contains(**word))
                .map(|word| format!("src/{file} uses {word}")),
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the simulator drives must be all that decides.
#[test]
fn seats_and_the_directory_have_no_actix_no_clock_no_thread_and_no_file() {
    let pure = ["actors/seat/", "actors/directory/mod.rs", "actors/directory/erasure.rs"];
    let banned = [
        "actix",
        "tokio",
        "async",
        "Instant",
        "SystemTime",
        "std::fs",
        "std::thread",
        "std::env",
        "getrandom",
        "fresh_request",
        "HashMap",
        "HashSet",
        "Mutex",
        "EventLog",
    ];
    let mut seen = 0;
    for (file, text) in sources() {
        if pure.iter().any(|path| file.starts_with(path)) {
            seen += 1;
            let found = banned.iter().find(|word| text.contains(**word));
            assert_eq!(found, None, "src/{file}");
        }
    }
    assert!(seen >= 6, "{seen} files");
}

/// The names behind `before` at the beginning of the lines of a file, up to what is no name.
fn names_in(path: &str, before: &str) -> Vec<String> {
    let text = read(&root().join(path));
    let lines = text.lines().filter_map(|line| line.strip_prefix(before));
    let names = lines.map(|rest| {
        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
    });
    names.filter(|name| !name.is_empty()).collect()
}

#[test]
fn shipped_code_and_a_test_name_each_invariant() {
    let laws = names_in("crates/core/src/invariants.rs", "    ");
    let laws: Vec<String> =
        laws.into_iter().filter(|name| name.starts_with(char::is_uppercase)).collect();
    assert!(laws.len() >= 10, "{laws:?}");
    let (mut shipped, mut tests) = (String::new(), String::new());
    for (folder, _) in SOURCES {
        let mut files = Vec::new();
        rust_files(&root().join(folder), &mut files);
        for path in files.iter().filter(|path| !path.ends_with("core/src/invariants.rs")) {
            let text = read(path);
            let product = if is_test(&path.display().to_string()) { "" } else { product(&text) };
            shipped += &strip(product);
            tests += &text[product.len()..];
        }
    }
    let mut files = Vec::new();
    rust_files(&root().join("tests"), &mut files);
    tests.extend(files.iter().filter(|path| !path.ends_with("tidy.rs")).map(|path| read(path)));
    for law in laws {
        assert!(shipped.contains(&format!("Invariant::{law}")), "nothing asserts {law}");
        let named = [format!("Invariant::{law}"), format!("\"{law}\"")];
        assert!(named.iter().any(|name| tests.contains(name)), "no test breaks {law}");
    }
}

#[test]
fn every_limit_is_used() {
    let limits = names_in("crates/core/src/limits.rs", "pub const ");
    assert!(limits.len() > 50, "{} limits", limits.len());
    let words: BTreeSet<String> = sources()
        .iter()
        .filter(|(file, _)| file != "limits.rs" && !is_test(file))
        .flat_map(|(_, text)| {
            let words = product(text).split(|c: char| !c.is_alphanumeric() && c != '_');
            words.map(str::to_owned).collect::<Vec<_>>()
        })
        .collect();
    for limit in limits {
        assert!(words.contains(&limit), "nothing enforces {limit}");
    }
}

#[test]
fn nothing_is_left_undone_in_the_code() {
    let unfinished = ["todo!(", "unimplemented!(", "dbg!("];
    for (file, text) in sources() {
        for word in unfinished {
            assert!(!text.contains(word), "src/{file} has {word}…)");
        }
    }
}

#[test]
fn the_checks_of_this_file_can_fail() {
    assert_eq!(
        rooms_named("use crate::{ids::Digest, world::{Domain, Stage}}; crate::store::open()"),
        ["ids", "store", "world"].map(str::to_owned).into()
    );
    let allowed = ["events".to_owned(), "store::Durable".to_owned()];
    assert!(allows(&allowed, "store", "use crate::store::Durable;"));
    for text in
        ["use crate::store::{Durable, open};", "use crate::{store::Durable};", "crate::store"]
    {
        assert!(!allows(&allowed, "store", text), "{text}");
    }
    assert_eq!(strip("a // crate::x\n\"crate::y\" b"), "a \n\"\" b");
}
