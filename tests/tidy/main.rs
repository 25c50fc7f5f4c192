//! Compares every `use` in `src/` and `crates/` with the two tables of `ARCHITECTURE.md`. A change to
//! such a table is a change of the design. Also compares the tables of `tests/README.md` with the
//! tests, and checks the links between pages.

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use apprentice_testkit::paths::root;
use source::{SOURCES, Source, rust_files, sources};

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
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

#[test]
fn rooms_import_only_what_the_map_allows() {
    let walls = table("room");
    let shared = ["ids", "limits", "invariants", "plain"];
    let mut wrong = Vec::new();
    for source in sources() {
        let here = source.room();
        if here == "lib" || shared.contains(&here) {
            continue;
        }
        let allowed = walls.get(here).unwrap_or_else(|| {
            panic!("{}: the room `{here}` has no row in ARCHITECTURE.md", source.name)
        });
        if allowed == "everything" {
            continue;
        }
        let allowed = quoted(allowed);
        for named in &source.rooms {
            let fine = named == here
                || shared.contains(&named.as_str())
                || allowed.contains(named)
                || allows_what_is_named(&allowed, named, source)
                || !walls.contains_key(named);
            if !fine {
                wrong.push(format!("{} imports `{named}`, which `{here}` may not", source.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whether a room may import all that a file names of another one: single names, as `store::Durable`.
fn allows_what_is_named(allowed: &[String], room: &str, source: &Source) -> bool {
    let named = source.paths.iter().filter(|path| path.len() > 1 && path[..2] == ["crate", room]);
    let mut names = named.map(|path| path.get(2).map(|name| format!("{room}::{name}")));
    let known = |name: Option<String>| name.is_some_and(|name| allowed.contains(&name));
    names.all(known) && allowed.iter().any(|name| name.starts_with(&format!("{room}::")))
}

/// The folders and files of the store, and the files of each folder, from each to those it imports.
fn arrows_in_the_store() -> BTreeMap<String, BTreeSet<String>> {
    let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in sources() {
        let Some(below) = source.name.strip_prefix("store/").filter(|it| *it != "mod.rs") else {
            continue;
        };
        let parts: Vec<&str> = below.trim_end_matches(".rs").split('/').collect();
        let unit = parts[0];
        let of_store =
            source.paths.iter().filter(|path| path.len() > 2 && path[..2] == ["crate", "store"]);
        let named: BTreeSet<String> = of_store.map(|path| path[2].clone()).collect();
        for name in &named {
            let fine = place_of(&format!("store/{name}")).is_some();
            assert!(fine, "{below} imports `store::{name}`; name the file that holds it");
        }
        let others = named.into_iter().filter(|name| name != unit);
        arrows.entry(unit.to_owned()).or_default().extend(others);
        // A folder's `mod.rs` declares the files beside it.
        if let [folder, file, ..] = parts[..]
            && file != "mod"
        {
            let beside = source.paths.iter().filter(|path| path.len() > 1 && path[0] == "super");
            let beside = beside.map(|path| format!("{folder}/{}", path[1]));
            let beside = beside.filter(|name| place_of(&format!("store/{name}")).is_some());
            let itself = format!("{folder}/{file}");
            arrows.entry(itself.clone()).or_default().extend(beside.filter(|name| *name != itself));
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
    let mut wrong = Vec::new();
    for (package, allowed) in &table("package") {
        let allowed = quoted(allowed);
        for place in &allowed {
            assert!(place_of(place).is_some(), "the package table names {place}");
        }
        let package = package.replace('-', "_");
        for source in sources().iter().filter(|source| source.names(&package)) {
            let fine = allowed.iter().any(|place| {
                source.name == *place
                    || source.room() == place
                    || source.name.starts_with(&format!("{place}/"))
            });
            if !fine {
                let name = &source.name;
                wrong.push(format!("{name} uses `{package}`, which the map keeps elsewhere"));
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
    // A version is written in one place.
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
    for source in sources() {
        let here = source.room();
        if here != "lib" {
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

/// The names of the modules in a folder, which are files and folders, without the ending `.rs`.
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

    // A file that is not declared would never be run.
    let mut waiting = vec![tests];
    while let Some(folder) = waiting.pop() {
        let paths = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        waiting.extend(paths.filter(|path| path.is_dir()));
        let Some(head) = head_of(&folder) else { continue };
        let declared = read(&head);
        for module in modules_in(&folder) {
            let is_head = folder.join(format!("{module}.rs")) == head;
            let line = format!("mod {module};");
            let fine = is_head || declared.lines().any(|it| it.trim().ends_with(&line));
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
    let banned_paths =
        ["std::time", "std::fs", "std::net", "std::env", "std::thread", "std::process"];
    let banned_words = [
        "HashMap",
        "HashSet",
        "SystemTime",
        "Instant",
        "getrandom",
        "mul_add",
        "par_iter",
        "rayon",
        "general_mat_mul",
    ];
    // Of floating-point numbers: their bits differ between machines.
    let banned_methods = ["exp", "ln", "tanh", "sin", "cos", "powf", "exp2"];
    let mut wrong = Vec::new();
    for source in sources().iter().filter(|source| core.contains(&source.room())) {
        let paths = banned_paths.iter().filter(|path| source.names(path));
        let words = banned_words.iter().filter(|word| source.words.contains(**word));
        let methods = banned_methods.iter().filter(|word| source.methods.contains(**word));
        wrong.extend(
            paths.chain(words).chain(methods).map(|found| format!("{} uses {found}", source.name)),
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// All decisions must be in the code that the simulator drives.
#[test]
fn what_decides_for_the_actors_has_no_actix_no_clock_no_thread_and_no_file() {
    let pure = [
        "actors/seat/",
        "actors/directory/mod.rs",
        "actors/directory/erasure.rs",
        "actors/registrar/mod.rs",
        "actors/registrar/effect.rs",
        "actors/registrar/error.rs",
        "actors/registrar/plan.rs",
    ];
    let banned = [
        "actix",
        "tokio",
        "async",
        "Instant",
        "SystemTime",
        "fs",
        "thread",
        "env",
        "getrandom",
        "fresh_request",
        "HashMap",
        "HashSet",
        "Mutex",
        "EventLog",
        "Clock",
        "mpsc",
    ];
    let mut seen = 0;
    for source in sources() {
        if pure.iter().any(|path| source.name.starts_with(path)) {
            seen += 1;
            let found = banned.iter().find(|word| source.words.contains(**word));
            assert_eq!(found, None, "{}", source.name);
        }
    }
    assert!(seen >= 10, "{seen} files");
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
    let mut tests = String::new();
    let others = ["tests", "crates/testkit/src"].into_iter();
    for folder in SOURCES.iter().map(|(folder, _)| *folder).chain(others) {
        for path in rust_files(&root().join(folder)).iter().filter(|path| !path.ends_with(file!()))
        {
            let text = read(path);
            // Of a file of the product, what stands behind its own tests' head.
            let is_product = folder != "tests" && !path.ends_with("tests.rs");
            let from = if is_product { text.find("mod tests {") } else { Some(0) };
            tests += from.map_or("", |from| &text[from..]);
        }
    }
    for law in laws {
        let ends = |path: &Vec<String>| path.ends_with(&["Invariant".to_owned(), law.clone()]);
        let asserts =
            |source: &&Source| source.name != "invariants.rs" && source.paths.iter().any(ends);
        assert!(sources().iter().any(|source| asserts(&source)), "nothing asserts {law}");
        let named = [format!("Invariant::{law}"), format!("\"{law}\"")];
        assert!(named.iter().any(|name| tests.contains(name)), "no test breaks {law}");
    }
}

#[test]
fn every_limit_is_used() {
    let limits = names_in("crates/core/src/limits.rs", "pub const ");
    assert!(limits.len() > 50, "{} limits", limits.len());
    for limit in limits {
        let users = sources().iter().filter(|source| source.name != "limits.rs");
        let used = |source: &Source| {
            source.words.contains(&limit)
                || source.paths.iter().any(|path| path.last() == Some(&limit))
        };
        assert!(users.into_iter().any(used), "nothing enforces {limit}");
    }
}

#[test]
fn nothing_is_left_undone_in_the_code() {
    for source in sources() {
        for word in ["todo", "unimplemented", "dbg"] {
            assert!(!source.names(word), "{} has {word}!(…)", source.name);
        }
    }
}
