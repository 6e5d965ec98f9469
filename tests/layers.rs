//! The rooms of the program stand one above the other: each uses only those that its line of the table names, all of
//! them further up in the table. What knows no PETSc stays so.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Modules that every room may use; `Error` and `Result` of the crate are those of `error`.
const BASE: &[&str] = &["error"];

/// The rooms from the lowest to the highest, and what each may use besides the base.
const ROOMS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("input", &[]),
    ("memory", &[]),
    ("scratch", &[]),
    ("dense", &[]),
    ("quadrature", &[]),
    ("parallel", &["scratch"]),
    ("progress", &[]),
    ("stop", &["parallel", "progress"]),
    ("friction", &[]),
    ("rails", &[]),
    ("random", &[]),
    ("job", &["input", "friction", "rails", "random"]),
    ("mesh", &["input", "parallel", "quadrature"]),
    ("grid", &["quadrature", "mesh"]),
    ("placement", &["input", "rails"]),
    ("roughness", &["input"]),
    ("petsc", &["memory", "scratch", "parallel"]),
    ("eigen", &["dense", "parallel", "petsc"]),
    ("fem", &["parallel", "quadrature", "mesh", "petsc"]),
    ("swept", &["dense", "quadrature", "rails", "fem"]),
    ("body", &["input", "dense", "parallel", "quadrature", "job", "mesh", "grid", "petsc", "eigen", "fem", "swept"]),
    ("model", &["parallel", "job", "grid", "body"]),
    ("contact", &["dense", "quadrature", "friction", "grid", "model"]),
    ("curving", &["friction", "placement", "contact"]),
    ("stability", &["dense", "parallel", "progress", "job", "petsc", "eigen", "body", "model", "contact"]),
    ("transient", &["dense", "friction", "grid", "roughness", "model", "contact"]),
    ("cycles", &["grid", "model", "transient"]),
    ("sound", &["parallel", "quadrature", "mesh", "fem", "swept", "body"]),
    (
        "output",
        &[
            "input",
            "memory",
            "parallel",
            "progress",
            "friction",
            "random",
            "job",
            "mesh",
            "grid",
            "model",
            "contact",
            "curving",
            "stability",
            "transient",
            "cycles",
        ],
    ),
    ("summary", &["job"]),
    (
        "case",
        &[
            "parallel",
            "progress",
            "friction",
            "rails",
            "job",
            "mesh",
            "grid",
            "petsc",
            "eigen",
            "fem",
            "placement",
            "roughness",
            "swept",
            "body",
            "model",
            "contact",
            "curving",
            "stability",
            "transient",
            "output",
            "summary",
        ],
    ),
    (
        "analysis",
        &[
            "input",
            "dense",
            "parallel",
            "progress",
            "friction",
            "random",
            "job",
            "mesh",
            "grid",
            "petsc",
            "eigen",
            "fem",
            "placement",
            "roughness",
            "swept",
            "body",
            "model",
            "contact",
            "stability",
            "transient",
            "cycles",
            "sound",
            "output",
            "stop",
            "summary",
            "case",
        ],
    ),
    ("plan", &["memory", "scratch", "job", "mesh", "body", "eigen", "case", "analysis"]),
];

/// Files that may use less than their room.
const FILES: &[(&str, &[&str])] = &[
    ("stability/reduced.rs", &["contact", "model"]),
    ("eigen/block.rs", &["parallel"]),
    ("eigen/check.rs", &["parallel"]),
    ("eigen/lanczos.rs", &["dense", "parallel"]),
    ("eigen/mod.rs", &["parallel"]),
    ("eigen/orthonormal.rs", &["parallel"]),
    ("eigen/slices.rs", &["parallel"]),
];

/// Bindings that one room alone may name.
const BINDINGS: &[&str] = &["petsc_sys", "slepc_sys", "mumps_sys"];

/// Beside the rooms: the list of them, and the program that drives them.
const OUTSIDE: &[&str] = &["lib.rs", "main.rs", "cli"];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Files of the program below `folder`, those of its tests left out.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            if !path.ends_with("tests") {
                found.extend(files(&path));
            }
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found
}

/// The text without its comments, whose links may lead anywhere, and without the tests at its end, which may look at
/// what is made of it.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end].lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

fn read(path: &Path) -> String {
    code(&std::fs::read_to_string(path).expect("a source file"))
}

/// The path of a file from `src`, as text.
fn name(path: &Path) -> String {
    path.strip_prefix(source()).expect("below src").display().to_string()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty())
}

/// First names of what follows `crate::`: one, or each of a list in braces.
fn heads(after: &str) -> Vec<&str> {
    let Some(list) = after.strip_prefix('{') else { return words(after).take(1).collect() };
    let (mut depth, mut start, mut heads) = (1, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 || (depth == 1 && c == ',') {
            heads.extend(words(&list[start..i]).next());
            start = i + 1;
        }
        if depth == 0 {
            break;
        }
    }
    heads
}

/// Names at the root of the crate that a file uses, by `crate::` anywhere in its code or by `super::` as often as it
/// leads out of the room.
fn used(path: &Path, text: &str) -> BTreeSet<String> {
    let mut found: BTreeSet<String> = BTreeSet::new();
    for (at, _) in text.match_indices("crate::") {
        // Not the end of another word, nor the path of a macro.
        if !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
            found.extend(heads(&text[at + "crate::".len()..]).into_iter().map(String::from));
        }
    }
    // Modules between the file and the root.
    let name = name(path);
    let depth = name.split('/').filter(|part| *part != "mod.rs").count();
    let mut at = 0;
    while let Some(next) = text[at..].find("super::") {
        let begin = at + next;
        let count = text[begin..].split("super::").take_while(|part| part.is_empty()).count();
        let end = begin + count * "super::".len();
        if count >= depth {
            found.extend(heads(&text[end..]).into_iter().map(String::from));
        }
        at = end;
    }
    found.into_iter().map(|n| if n == "Error" || n == "Result" { "error".into() } else { n }).collect()
}

#[test]
fn no_function_is_allowed_more_than_seven_arguments() {
    // Clippy refuses them, unless it is told not to.
    let allowed = |path: &PathBuf| read(path).contains("too_many_arguments");
    let found: Vec<String> = files(&source()).iter().filter(|p| allowed(p)).map(|p| name(p)).collect();
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn no_room_uses_one_above_it() {
    let table: BTreeMap<&str, &[&str]> = ROOMS.iter().copied().collect();
    for (k, (room, uses)) in ROOMS.iter().enumerate() {
        let below: Vec<&str> = ROOMS[..k].iter().map(|r| r.0).collect();
        let up: Vec<_> = uses.iter().filter(|u| !below.contains(u)).collect();
        assert!(up.is_empty(), "the table lets {room} use {up:?}, which does not stand above it in the table");
    }
    let mut faults = Vec::new();
    let mut met = BTreeSet::new();
    for path in files(&source()) {
        let name = name(&path);
        let first = name.split('/').next().unwrap_or_default();
        if OUTSIDE.contains(&first) {
            continue;
        }
        let room = first.trim_end_matches(".rs");
        met.insert(room.to_owned());
        let Some(allowed) = table.get(room) else {
            faults.push(format!("{name}: the room {room} is not in the table of tests/layers.rs"));
            continue;
        };
        let allowed = FILES.iter().find(|f| f.0 == name).map_or(allowed, |f| &f.1);
        for other in used(&path, &read(&path)) {
            if other != room && !BASE.contains(&other.as_str()) && !allowed.contains(&other.as_str()) {
                faults.push(format!("{name} uses {other}; {room} may use {allowed:?}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let listed: BTreeSet<String> = ROOMS.iter().map(|r| r.0.to_owned()).collect();
    assert_eq!(met, listed, "rooms of src and of the table");
}

#[test]
fn one_room_alone_names_the_bindings() {
    for path in files(&source()) {
        let name = name(&path);
        if name.starts_with("petsc/") || OUTSIDE.contains(&name.split('/').next().unwrap_or_default()) {
            continue;
        }
        for binding in BINDINGS {
            assert!(words(&read(&path)).all(|w| w != *binding), "{name} names {binding}");
        }
    }
}

#[test]
fn what_a_path_leads_to_is_found() {
    assert_eq!(heads("body::fe::FeBody;"), ["body"]);
    assert_eq!(heads("{body::{fe, modes}, job, Error};\nuse crate::x;"), ["body", "job", "Error"]);
    // Imports, paths in the code, and ways out of the room by `super`, but none into it or in comments.
    let file = source().join("analysis/any.rs");
    let found = |text: &str| used(&file, text).into_iter().collect::<Vec<_>>();
    assert_eq!(
        found("use crate::{body::{fe, modes}, Result};\nfn f() { crate::petsc::eps::solve() }"),
        ["body", "error", "petsc"]
    );
    assert_eq!(
        found("use super::bodies;\nuse super::super::{job, output};\nuse super::super::mesh::Mesh;"),
        ["job", "mesh", "output"]
    );
    assert_eq!(found(&code("use crate::fem;\n#[cfg(test)]\nmod tests {\n    use crate::cli;")), ["fem"]);
    assert!(code("/// See [`crate::cli`].\nuse other_crate::x; // crate::cli").contains("other_crate"));
    assert_eq!(found(&code("/// See [`crate::cli`].\nuse other_crate::x; // crate::cli")), [""; 0]);
}
