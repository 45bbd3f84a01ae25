//! "A module uses only modules above it": read from the sources of the engine.

use std::collections::BTreeSet;
use std::path::Path;

/// The engine's modules, from what needs nothing to what needs all. A file belongs to the longest name that fits it.
const LAYERS: &[&str] = &[
    "math", "kind", "draft", "mesh", "mjcf", "model", "collision", "contact/impedance", "dynamics/spatial",
    "dynamics/links", "dynamics/factor", "dynamics/plane", "dynamics/uncoupled", "dynamics/blocks", "dynamics/plan",
    "data", "state", "snapshot", "collision/detect", "dynamics", "contact", "sensors", "quantities", "prepare",
    "method", "diverged", "forward", "integrate", "compile", "lib", "control", "simulation", "batch",
];

/// The layer of a path such as `contact/mujoco/rows` or `math/Vec3`.
fn layer(path: &str) -> usize {
    let fits = |name: &str| path.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let found = (0..LAYERS.len()).filter(|&i| fits(LAYERS[i])).max_by_key(|&i| LAYERS[i].len());
    // What stands in lib.rs itself: `crate::load`.
    found.unwrap_or_else(|| layer("lib"))
}

/// The paths after `crate::` and `super::` in a source, groups taken apart; comments and unit tests left out.
///
/// In: `parent`, what `super` is, with a `/` behind if it is not the crate itself.
fn uses(source: &str, parent: &str) -> BTreeSet<String> {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let code: String = code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    let mut found = BTreeSet::new();
    let after = |root: &'static str, place: String| code.split(root).skip(1).map(move |text| (place.clone(), text));
    for (place, text) in after("crate::", String::new()).chain(after("super::", parent.to_owned())) {
        let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(text.len());
        let (path, rest) = text.split_at(end);
        let path = place + &path.replace("::", "/");
        match rest.strip_prefix('{') {
            Some(group) => found.extend(members(group).iter().map(|name| format!("{path}{name}"))),
            None => drop(found.insert(path)),
        }
    }
    found
}

/// The first word of each member of a group whose `{` was read.
fn members(group: &str) -> Vec<String> {
    let (mut depth, mut words, mut word) = (0, Vec::new(), String::new());
    for c in group.chars() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => words.push(std::mem::take(&mut word)),
            _ if depth == 0 => word.push(c),
            _ => {}
        }
    }
    words.push(word);
    words.iter().map(|w| w.trim().replace("::", "/")).filter(|w| !w.is_empty()).collect()
}

/// Hands on every source file below a folder, named as in [`LAYERS`].
fn each_source(folder: &Path, name: &str, found: &mut impl FnMut(&str, &str)) {
    for entry in std::fs::read_dir(folder).expect("src/") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let inner = if name.is_empty() { stem.clone() } else { format!("{name}/{stem}") };
        if path.is_dir() {
            each_source(&path, &inner, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).expect("a source");
            found(if stem == "mod" { name } else { &inner }, &text);
        }
    }
}

/// Every import that points up, as (file, what it uses).
fn upward(file: &str, source: &str) -> Vec<(String, String)> {
    let up = |used: &String| layer(used) > layer(file);
    let parent = file.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
    uses(source, &parent).into_iter().filter(up).map(|used| (file.to_owned(), used)).collect()
}

#[test]
fn a_module_uses_only_modules_above_it() {
    let mut arrows = Vec::new();
    let mut files = 0;
    each_source(&crate::file("src"), "", &mut |file, source| {
        files += 1;
        assert!(file == "lib" || LAYERS[layer(file)] != "lib", "src/{file}.rs is in no layer: name it in LAYERS");
        arrows.extend(upward(file, source));
    });
    assert!(files > 50, "{files} files read");
    let found: Vec<String> =
        arrows.iter().map(|(from, to)| format!("src/{from} uses crate::{}", to.replace('/', "::"))).collect();
    assert!(found.is_empty(), "imports that point up:\n{}", found.join("\n"));
}

#[test]
fn an_upward_import_is_found_however_it_is_written() {
    let found = |source: &str| upward("dynamics/bias", source).into_iter().map(|(_, to)| to).collect::<Vec<_>>();
    assert_eq!(found("use crate::forward::Method;"), ["forward/Method"]);
    assert_eq!(found("use crate::{\n    data::{Data, Contact},\n    contact::mujoco,\n};"), ["contact/mujoco"]);
    assert_eq!(found("fn f() { crate::compile::compile() }"), ["compile/compile"]);
    assert_eq!(found("fn f() { crate::load() }"), ["load"]);
    let fine =
        "use crate::data::Data; // crate::forward\n/// [`crate::forward`]\n#[cfg(test)]\nuse crate::forward::step;";
    assert!(found(fine).is_empty() && !uses(fine, "").is_empty());
    assert_eq!(upward("collision/mod", "use crate::collision::detect::room;").len(), 1);
}
