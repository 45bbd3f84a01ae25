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
    let mut problems = Vec::new();
    for asset in children(document, root, "asset") {
        for (file, places) in document.node(asset).children.iter().flat_map(|&node| places(document, node)) {
            if !places.iter().any(|place| folder(document, 0).join(place).is_file()) {
                let (why, place) = ("there is no such file".to_string(), folder(document, 0).join(&places[0]));
                let kind = ProblemKind::CannotRead { file: place.display().to_string(), why };
                let problem = Problem::new(kind, file.value_span);
                problems.push(problem.suggest(similar_file(&place).as_deref()));
            }
        }
    }
    problems
}

/// The attributes of an element of `<asset>` that name files, each with the file's path from the main file's folder.
pub fn files_of(document: &Document, node: NodeId) -> Vec<(&str, PathBuf)> {
    let found = |[own, beside]: [PathBuf; 2]| {
        let there = |place: &PathBuf| folder(document, 0).join(place).is_file();
        if !there(&own) && there(&beside) { beside } else { own }
    };
    places(document, node).into_iter().map(|(file, places)| (&*file.name, found(places))).collect()
}

/// The file of that number lies in this folder.
fn folder(document: &Document, file: u32) -> &Path {
    document.files.get(file as usize).and_then(|f| Path::new(&f.name).parent()).unwrap_or(Path::new(""))
}

fn children<'a>(document: &'a Document, node: NodeId, name: &'static str) -> impl Iterator<Item = NodeId> + 'a {
    document.node(node).children.iter().copied().filter(move |&n| document.node(n).name == name)
}

/// Where the files of an asset are looked for, from the main file's folder: as `<compiler>` says, and in an included
/// file's own folder, as MuJoCo has it for files that are not there.
fn places(document: &Document, node: NodeId) -> Vec<(&Attribute, [PathBuf; 2])> {
    let Some((_, attributes, dir)) = FILES.iter().find(|(element, ..)| *element == document.node(node).name) else {
        return Vec::new();
    };
    let compilers = || document.root().into_iter().flat_map(|root| children(document, root, "compiler"));
    let setting = |name: &str| compilers().filter_map(|n| document.attribute(n, name)).last();
    let strip = setting("strippath").is_some_and(|a| &*a.value == "true");
    let dir = setting(dir).or_else(|| setting("assetdir").filter(|_| !dir.is_empty()));
    let files = attributes.iter().filter_map(|name| document.attribute(node, name)).filter(|a| !a.value.is_empty());
    let main = folder(document, 0);
    let place = |file: &Attribute| {
        let within = path(file, dir, strip);
        let own = folder(document, file.value_span.file);
        let beside = own.strip_prefix(main).unwrap_or(own).join(&within);
        [within, beside]
    };
    files.map(|file| (file, place(file))).collect()
}

fn path(file: &Attribute, dir: Option<&Attribute>, strip: bool) -> PathBuf {
    let file = Path::new(&*file.value);
    let file = if strip { file.file_name().map_or(file, Path::new) } else { file };
    dir.map_or(PathBuf::new(), |dir| PathBuf::from(&*dir.value)).join(file)
}
