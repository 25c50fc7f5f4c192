//! Compares every `use` in `src/` and `crates/` with the two tables of `ARCHITECTURE.md`. A change to
//! such a table is a change of the design. Also compares the tables of `tests/README.md` with the
//! tests, and checks the links between pages.

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use apprentice_testkit::paths::root;
use source::{SOURCES, sources};

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
                || !walls.contains_key(named);
            if !fine {
                wrong.push(format!("{} imports `{named}`, which `{here}` may not", source.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
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
fn only_the_store_gives_receipts() {
    for source in sources() {
        let fine = source.room() == "store" || source.name == "events/receipt.rs";
        assert!(fine || !source.words.contains("mint"), "{} makes a receipt", source.name);
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

#[test]
fn nothing_is_left_undone_in_the_code() {
    for source in sources() {
        for word in ["todo", "unimplemented", "dbg"] {
            assert!(!source.names(word), "{} has {word}!(…)", source.name);
        }
    }
}
