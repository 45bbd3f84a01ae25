//! The files that assets name: MuJoCo refuses a scene whose meshes or pictures are missing, drawn or not.

use std::path::{Path, PathBuf};

use super::document::{Attribute, Document, NodeId};
use super::error::{Problem, ProblemKind};
use super::parse::similar_file;

/// The attributes that name a file, and the attribute of `<compiler>` that names its folder.
const FILES: &[(&str, &[&str], &str)] = &[
    ("mesh", &["file"], "meshdir"),
    ("hfield", &["file"], "meshdir"),
    ("skin", &["file"], "meshdir"),
    ("texture", &["file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"], "texturedir"),
    ("model", &["file"], ""),
];

/// A problem for each file that is not where MuJoCo looks: `meshdir` or `texturedir`, else `assetdir`, in the main
/// file's folder.
pub fn missing(document: &Document, root: NodeId) -> Vec<Problem> {
    let sections = |name: &'static str| {
        document.node(root).children.iter().copied().filter(move |&n| document.node(n).name == name)
    };
    let setting = |name: &str| sections("compiler").filter_map(|n| document.attribute(n, name)).next_back();
    let strip = setting("strippath").is_some_and(|a| a.value == "true");
    let folder = |file: u32| document.files.get(file as usize).and_then(|f| Path::new(&f.name).parent());
    let mut problems = Vec::new();
    for node in sections("asset").flat_map(|asset| document.node(asset).children.iter().copied()) {
        let Some((_, attributes, dir)) = FILES.iter().find(|(element, ..)| *element == document.node(node).name) else {
            continue;
        };
        let dir = setting(dir).or_else(|| setting("assetdir").filter(|_| !dir.is_empty()));
        for file in attributes.iter().filter_map(|name| document.attribute(node, name)).filter(|a| !a.value.is_empty())
        {
            let within = path(file, dir, strip);
            // The main file's folder; an included file's own, as MuJoCo has it for files that are not there.
            let places = [0, file.value_span.file].map(|f| folder(f).unwrap_or(Path::new("")).join(&within));
            if !places.iter().any(|place| place.is_file()) {
                let why = "there is no such file".to_string();
                let kind = ProblemKind::CannotRead { file: places[0].display().to_string(), why };
                let problem = Problem::new(kind, file.value_span);
                problems.push(problem.suggest(similar_file(&places[0]).as_deref()));
            }
        }
    }
    problems
}

fn path(file: &Attribute, dir: Option<&Attribute>, strip: bool) -> PathBuf {
    let file = Path::new(&file.value);
    let file = if strip { file.file_name().map_or(file, Path::new) } else { file };
    dir.map_or(PathBuf::new(), |dir| PathBuf::from(&dir.value)).join(file)
}
