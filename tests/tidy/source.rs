//! Source files as the compiler reads them: paths, method calls and identifiers, without comments,
//! strings and tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use apprentice_testkit::paths::root;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Attribute, ExprMethodCall, ImplItemFn, Item, ItemMod, ItemUse, Macro, UseTree};

/// Where source files are, and the room that a crate's own files belong to, if it has no rooms.
pub const SOURCES: [(&str, Option<&str>); 7] = [
    ("src", None),
    ("crates/core/src", None),
    ("crates/household/src", Some("household")),
    ("crates/mind/src", None),
    ("crates/client/src", Some("client")),
    ("crates/study/src", Some("study")),
    ("crates/cli/src", Some("cli")),
];

/// The crates whose modules are rooms, as paths name them.
const CRATES_OF_ROOMS: [&str; 3] = ["apprentice", "apprentice_core", "apprentice_mind"];
/// The crates that are a room each, as paths name them.
const CRATES_AS_ROOMS: [(&str, &str); 4] = [
    ("apprentice_household", "household"),
    ("apprentice_client", "client"),
    ("apprentice_study", "study"),
    ("apprentice_migrations", "migrations"),
];

/// A source file without its tests.
pub struct Source {
    /// The path below the crate's `src/`; of a crate that is one room, below that room's name.
    pub name: String,
    /// Paths as they are written, the branches of a `use` one by one, and those in macro calls.
    pub paths: BTreeSet<Vec<String>>,
    /// The rooms that these paths lead to.
    pub rooms: BTreeSet<String>,
    /// All identifiers and keywords.
    pub words: BTreeSet<String>,
    /// The methods that are called.
    pub methods: BTreeSet<String>,
}

impl Source {
    fn read(text: &str, name: String, module: Vec<String>, room: Option<&str>) -> Source {
        let file = syn::parse_file(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut reader = Reader { module, room, ..Reader::default() };
        file.items.iter().for_each(|item| reader.visit_item(item));
        let Reader { paths, rooms, words, methods, .. } = reader;
        Source { name, paths, rooms, words, methods }
    }

    /// The room that the file belongs to: its folder below `src/`, or its own name.
    pub fn room(&self) -> &str {
        self.name.split(['/', '.']).next().expect("a split has a first part")
    }

    /// Whether a path begins with these segments.
    pub fn names(&self, path: &str) -> bool {
        let wanted: Vec<&str> = path.split("::").collect();
        self.paths
            .iter()
            .any(|path| path.len() >= wanted.len() && path.iter().zip(&wanted).all(|(a, b)| a == b))
    }
}

/// Every source file of the product, read once.
pub fn sources() -> &'static [Source] {
    static SOURCES: OnceLock<Vec<Source>> = OnceLock::new();
    SOURCES.get_or_init(read_sources)
}

fn read_sources() -> Vec<Source> {
    let mut found = Vec::new();
    for (folder, room) in SOURCES {
        let folder = root().join(folder);
        for path in rust_files(&folder) {
            let below = path.strip_prefix(&folder).expect("it was found below that folder");
            if is_test(below) {
                continue;
            }
            let name = room.map_or(below.to_owned(), |room| Path::new(room).join(below));
            let text = fs::read_to_string(&path).unwrap();
            found.push(Source::read(&text, name.display().to_string(), module_of(below), room));
        }
    }
    found
}

/// All Rust files below a folder, in the order of their paths.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let below = |path: PathBuf| match path.is_dir() {
        true => rust_files(&path),
        false => vec![path],
    };
    let files = paths.into_iter().flat_map(below);
    files.filter(|path| path.extension().is_some_and(|ending| ending == "rs")).collect()
}

/// Whether a file holds tests only.
fn is_test(file: &Path) -> bool {
    file.components()
        .any(|part| matches!(part.as_os_str().to_str(), Some("tests" | "tests.rs" | "bench.rs")))
}

/// `actors/seat/turn.rs` → `actors::seat::turn`.
fn module_of(file: &Path) -> Vec<String> {
    let parts = file.with_extension("");
    let mut module: Vec<String> =
        parts.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
    if module.last().is_some_and(|last| matches!(&**last, "mod" | "lib" | "main")) {
        module.pop();
    }
    module
}

#[derive(Default)]
struct Reader<'a> {
    /// The module whose code is being read.
    module: Vec<String>,
    /// The room of a crate that has no rooms.
    room: Option<&'a str>,
    paths: BTreeSet<Vec<String>>,
    rooms: BTreeSet<String>,
    words: BTreeSet<String>,
    methods: BTreeSet<String>,
}

impl Reader<'_> {
    fn note(&mut self, path: Vec<String>) {
        self.rooms.extend(self.room_of(&path));
        self.paths.insert(path);
    }

    /// The room that a path leads to, if it leads to one of ours.
    fn room_of(&self, path: &[String]) -> Option<String> {
        let (first, rest) = path.split_first()?;
        let supers = path.iter().take_while(|segment| *segment == "super").count();
        let absolute: Vec<String> = match &**first {
            "crate" => rest.to_vec(),
            "self" => [&self.module, rest].concat(),
            "super" => {
                let kept = self.module.len().checked_sub(supers)?;
                [&self.module[..kept], &path[supers..]].concat()
            }
            name if CRATES_OF_ROOMS.contains(&name) => rest.to_vec(),
            name => {
                let known = CRATES_AS_ROOMS.iter().find(|(krate, _)| *krate == name);
                return known.map(|(_, room)| (*room).to_owned());
            }
        };
        let own_crate = matches!(&**first, "crate" | "self" | "super");
        if let (true, Some(room)) = (own_crate, self.room) {
            return Some(room.to_owned());
        }
        match absolute.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["world", "household", ..] => Some("household".to_owned()),
            [room, ..] => Some(room.to_owned()),
            [] => None,
        }
    }

    fn note_use(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: String| [before, &[name]].concat();
        match tree {
            UseTree::Path(path) => self.note_use(&with(path.ident.to_string()), &path.tree),
            UseTree::Name(name) => self.note(with(name.ident.to_string())),
            UseTree::Rename(name) => self.note(with(name.ident.to_string())),
            UseTree::Glob(_) => self.note(before.to_vec()),
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.note_use(before, tree));
            }
        }
    }

    /// What a macro call names: nothing but tokens is known of it.
    fn note_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(ident) => {
                    if colons != 2 && !path.is_empty() {
                        self.note(std::mem::take(&mut path));
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                other => {
                    if !path.is_empty() {
                        self.note(std::mem::take(&mut path));
                    }
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.note_tokens(group.stream());
                    }
                }
            }
        }
        if !path.is_empty() {
            self.note(path);
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_test_code(attributes(item)) {
            return;
        }
        if !matches!(item, Item::Mod(_)) {
            note_words(item.to_token_stream(), &mut self.words);
        }
        visit::visit_item(self, item);
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        let Some((_, items)) = &item.content else { return };
        self.module.push(item.ident.to_string());
        items.iter().for_each(|item| self.visit_item(item));
        self.module.pop();
    }

    fn visit_impl_item_fn(&mut self, item: &'ast ImplItemFn) {
        if !is_test_code(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.note_use(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.note(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_expr_method_call(&mut self, call: &'ast ExprMethodCall) {
        self.methods.insert(call.method.to_string());
        visit::visit_expr_method_call(self, call);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.note_tokens(call.tokens.clone());
        visit::visit_macro(self, call);
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        // The texts of errors name values and laws.
        if let syn::Meta::List(list) = &attribute.meta {
            self.note_tokens(list.tokens.clone());
        }
    }
}

fn note_words(tokens: TokenStream, words: &mut BTreeSet<String>) {
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => drop(words.insert(ident.to_string())),
            TokenTree::Group(group) => note_words(group.stream(), words),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Whether code is compiled for tests alone.
fn is_test_code(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let is_cfg_test = || {
            attribute.path().is_ident("cfg")
                && attribute.parse_args::<syn::Ident>().is_ok_and(|argument| argument == "test")
        };
        attribute.path().is_ident("test") || is_cfg_test()
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

#[test]
fn paths_are_seen_however_they_are_written() {
    let text = r#"
        use crate::{ids::Digest, world::household::{Mug, self}};
        use super::super::store as kept;
        #[cfg(test)]
        mod tests { use crate::actors; }
        /// crate::service
        fn f() { println!("crate::cli {}", crate::replay::x()); let c: Vec<session::S> = g.tanh(); }
    "#;
    let module = ["events", "codec", "deep"].map(str::to_owned).to_vec();
    let source = Source::read(text, "events/codec/deep.rs".to_owned(), module, None);
    let rooms: Vec<&str> = source.rooms.iter().map(String::as_str).collect();
    assert_eq!(rooms, ["events", "household", "ids", "replay"]);
    assert!(source.names("crate::world::household") && !source.names("crate::service"));
    assert!(source.words.contains("Digest") && source.methods.contains("tanh"));
    assert!(!source.words.contains("actors"));
}
