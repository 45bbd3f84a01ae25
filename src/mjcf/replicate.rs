//! `<replicate>`: copies of what stands in it, each turned and shifted against the one before, names with a suffix.
//!
//! Source: MuJoCo 4.0 manual, XML reference › replicate; order of what is copied checked by running MuJoCo 4.0.0.

use std::collections::BTreeSet;

use super::check::floats;
use super::document::{Attribute, Document, Node, NodeId};
use super::error::{Problem, ProblemKind};
use super::limits::Limits;
use super::parse::raise;
use super::schema::{self, Kind};
use super::spec::Compiler;
use crate::math::{self, Quat, Vec3};

/// What other elements call an element: (kind, name).
type Name = (&'static str, String);
type Named = BTreeSet<Name>;

/// Replaces what stands in every `<replicate>` by a `<frame>` for each replica.
///
///     Rᵢ = euler(i · angles),   p₀ = 0,   pᵢ = pᵢ₋₁ + Rᵢ₋₁ offset
///
/// The angles are multiplied: with more than one of them this is not the i-th power of one turn, as the manual has it.
///
/// Replica i of n appends `sep` and i, in as many digits as n − 1 has, to all names within. What refers to one of
/// these names from another section (contacts, equality constraints, tendons, actuators, sensors) is copied with it:
/// out of its place, to the end of its section, once for each replica. Inner replicates come before outer ones.
/// Keyframes are not copied.
///
/// What it refers to beside these names must stand before the replicate, for MuJoCo copies it when it comes to the
/// replicate's end. And one equality, one actuator, or one geom of a tendon with its side site cannot refer to both:
/// MuJoCo leaves it out without a word, and all that refers to it.
pub fn expand(document: &mut Document, compiler: &Compiler, limits: &Limits, problems: &mut Vec<Problem>) {
    let Some(root) = document.root() else { return };
    let mut replicates = Vec::new();
    for node in sections(document, root, &["worldbody"]) {
        find(document, node, &mut replicates);
    }
    for node in replicates {
        replicate(document, root, node, compiler, limits, problems);
    }
}

/// All replicates below a node, inner ones first.
fn find(document: &Document, node: NodeId, found: &mut Vec<NodeId>) {
    for &child in &document.node(node).children {
        find(document, child, found);
        if document.node(child).name == "replicate" {
            found.push(child);
        }
    }
}

fn sections(document: &Document, root: NodeId, names: &[&str]) -> Vec<NodeId> {
    let is = |&node: &NodeId| names.contains(&&*document.node(node).name);
    document.node(root).children.iter().copied().filter(is).collect()
}

fn replicate(
    document: &mut Document,
    root: NodeId,
    node: NodeId,
    compiler: &Compiler,
    limits: &Limits,
    problems: &mut Vec<Problem>,
) {
    for &child in &document.node(node).children {
        let element = document.node(child).name.to_string();
        if matches!(element.as_str(), "joint" | "freejoint" | "inertial") {
            let kind = ProblemKind::MisplacedElement { parent: "replicate".into(), element };
            problems.push(Problem::new(kind, document.span(child)).help("put it into a `<body>`"));
        }
    }
    let numbers = |name: &str| {
        let given = document.attribute(node, name).and_then(|a| floats(&a.value));
        given.and_then(|v| <[f64; 3]>::try_from(v).ok()).unwrap_or_default()
    };
    let (offset, euler) = (Vec3::from(numbers("offset")), numbers("euler"));
    let angle = |x: f64| if compiler.degree { x.to_radians() } else { x };
    let turned = |i: usize| math::euler(&compiler.eulerseq, &euler.map(|x| i as f64 * angle(x)));
    let text = |name: &str| document.attribute(node, name).map_or(String::new(), |a| a.value.to_string());
    let (count, sep) = (text("count").trim().parse::<usize>(), text("sep"));
    let inside = document.node(node).children.clone();
    let size: usize = inside.iter().map(|&child| self::size(document, child)).sum();
    // What is no number is reported by the check; then one replica stands for all, its names as they are.
    let names = if count.is_ok() { names_within(document, &inside) } else { Named::new() };
    let (mut count, most) = (count.unwrap_or(1), limits.elements);
    if count.saturating_mul(size + 1).saturating_add(document.nodes.len()) > most {
        let rule = format!("so small that the scene has no more than {most} elements");
        let kind = ProblemKind::OutOfRange { attribute: "count".into(), rule, word: count.to_string() };
        problems.push(Problem::new(kind, document.value_span(node, "count")));
        count = 1;
    }
    let digits = count.saturating_sub(1).to_string().len();
    let suffixes: Vec<String> = (0..count).map(|i| format!("{sep}{i:0digits$}")).collect();

    document.nodes[node.0 as usize].children.clear();
    let mut pos = Vec3::zeros();
    for (i, suffix) in suffixes.iter().enumerate() {
        let quat = turned(i);
        let frame = frame(document, node, &pos, &quat);
        document.nodes[node.0 as usize].children.push(frame);
        for &child in &inside {
            let copy = copy(document, child, &|what, name| names.contains(&(what, name.into())).then_some(suffix));
            document.nodes[frame.0 as usize].children.push(copy);
        }
        pos += quat * offset;
    }
    copy_references(document, root, node, names, &suffixes, limits, problems);
}

/// What comes after a replicate in what a node contains. Out: whether the replicate is there.
fn following(document: &Document, node: NodeId, replicate: NodeId, later: &mut Vec<NodeId>) -> bool {
    let children = &document.node(node).children;
    let at = children.iter().position(|&c| c == replicate || following(document, c, replicate, later));
    later.extend(at.map_or(&[][..], |i| &children[i + 1..]));
    at.is_some()
}

/// Copies what refers to one of the names: tendons first, since actuators refer to them, and sensors to all.
fn copy_references(
    document: &mut Document,
    root: NodeId,
    replicate: NodeId,
    mut names: Named,
    suffixes: &[String],
    limits: &Limits,
    problems: &mut Vec<Problem>,
) {
    if names.is_empty() {
        return;
    }
    let worlds = sections(document, root, &["worldbody"]);
    let mut later = Vec::new();
    let at = worlds.iter().position(|&world| following(document, world, replicate, &mut later));
    later.extend(at.map_or(&[][..], |i| &worlds[i + 1..]));
    let later = names_within(document, &later);
    let others = names_within(document, &[root]);
    let mut left_out = Named::new();
    for section in ["tendon", "contact", "equality", "actuator", "sensor", "deformable"] {
        let nodes = sections(document, root, &[section]);
        let mut copied = Vec::new();
        for &node in &nodes {
            let children = std::mem::take(&mut document.nodes[node.0 as usize].children);
            let (out, stay): (Vec<_>, Vec<_>) =
                children.into_iter().partition(|&child| refers(document, child, &names));
            document.nodes[node.0 as usize].children = stay;
            copied.extend(out);
        }
        names.extend(names_within(document, &copied));
        let Some(last) = nodes.last() else { continue };
        copied.retain(|&child| {
            let problem = judge(document, child, section, [&names, &later, &others, &left_out]);
            let keep = problem.as_ref().is_none_or(|p| !matches!(p.kind, ProblemKind::Ignored { .. }));
            if !keep {
                left_out.extend(names_within(document, &[child]));
            }
            problems.extend(problem);
            keep
        });
        let size: usize = copied.iter().map(|&child| size(document, child)).sum();
        if size.saturating_mul(suffixes.len()).saturating_add(document.nodes.len()) > limits.elements {
            let kind = ProblemKind::OverLimit { what: "elements", limit: limits.elements };
            problems.push(Problem::new(kind, document.span(replicate)).help(raise("elements", limits.elements)));
            return;
        }
        for suffix in suffixes {
            for &child in &copied {
                let copy = copy(document, child, &|what, name| names.contains(&(what, name.into())).then_some(suffix));
                document.nodes[last.0 as usize].children.push(copy);
            }
        }
    }
}

/// The frame of a replica, its pose in numbers that read back exactly.
fn frame(document: &mut Document, replicate: NodeId, pos: &Vec3, quat: &Quat) -> NodeId {
    let span = document.span(replicate);
    let attribute = |name: &str, numbers: &[f64]| Attribute {
        name: schema::name_of(name),
        name_span: span,
        value: numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ").into(),
        value_span: span,
    };
    let attributes = [attribute("pos", pos.as_slice()), attribute("quat", &math::wxyz(quat))];
    let node = Node { name: "frame".into(), span, end: None, attributes: 0..0, children: Vec::new() };
    push(document, node, attributes)
}

fn push(document: &mut Document, node: Node, attributes: impl IntoIterator<Item = Attribute>) -> NodeId {
    let start = document.attributes.len() as u32;
    document.attributes.extend(attributes);
    let attributes = start..document.attributes.len() as u32;
    document.nodes.push(Node { attributes, ..node });
    NodeId(document.nodes.len() as u32 - 1)
}

fn size(document: &Document, node: NodeId) -> usize {
    1 + document.node(node).children.iter().map(|&child| size(document, child)).sum::<usize>()
}

/// A copy of an element and all within; `suffix`: what a name gets appended.
fn copy<'a>(document: &mut Document, node: NodeId, suffix: &impl Fn(&str, &str) -> Option<&'a String>) -> NodeId {
    let mut clone = document.node(node).clone();
    let renamed = |attribute: &Attribute| {
        let mut renamed = attribute.clone();
        if let Some(suffix) = named(document, node, attribute).and_then(|what| suffix(what, &attribute.value)) {
            renamed.value = format!("{}{suffix}", &*attribute.value).into();
        }
        renamed
    };
    let attributes: Vec<_> = document.attributes(node).iter().map(renamed).collect();
    let children = std::mem::take(&mut clone.children);
    let id = push(document, clone, attributes);
    for child in children {
        let child = copy(document, child, suffix);
        document.nodes[id.0 as usize].children.push(child);
    }
    id
}

/// The kind of element that an attribute names: its own, or one it refers to. What an element may be called does not
/// depend on where it stands.
fn named(document: &Document, node: NodeId, attribute: &Attribute) -> Option<&'static str> {
    let rows = schema::SCHEMA.iter().filter(|row| row.is(&document.node(node).name));
    rows.filter_map(|row| row.attribute(&attribute.name)).find_map(|column| match column.kind {
        Kind::Name(what) | Kind::Reference(what) => Some(what),
        Kind::ReferenceBy(by) => document.attribute(node, by).and_then(|a| schema::kind_named(&a.value)),
        _ => None,
    })
}

/// Elements and all within them.
fn within(document: &Document, nodes: &[NodeId]) -> Vec<NodeId> {
    let mut all = nodes.to_vec();
    let mut i = 0;
    while i < all.len() {
        all.extend(&document.node(all[i]).children);
        i += 1;
    }
    all
}

/// The names that elements and all within give themselves.
fn names_within(document: &Document, nodes: &[NodeId]) -> Named {
    let own = |node| {
        let name = document.attribute(node, "name")?;
        Some((named(document, node, name)?, name.value.to_string()))
    };
    within(document, nodes).into_iter().filter_map(own).collect()
}

/// What an element itself, without those within, refers to: things in bodies, tendons and actuators.
fn references(document: &Document, node: NodeId) -> Vec<(&Attribute, Name)> {
    let things = ["body", "joint", "geom", "site", "camera", "tendon", "actuator"];
    let given = document.attributes(node).iter().filter(|a| a.name != "name");
    let meant = |a| named(document, node, a).filter(|what| things.contains(what));
    given.filter_map(|a| Some((a, (meant(a)?, a.value.to_string())))).collect()
}

fn refers(document: &Document, node: NodeId, names: &Named) -> bool {
    within(document, &[node]).into_iter().any(|n| references(document, n).iter().any(|(_, name)| names.contains(name)))
}

/// What is wrong with an element that is copied because of `names`, in MuJoCo's eyes; `others`: all names of the scene.
fn judge(
    document: &Document,
    node: NodeId,
    section: &str,
    [names, later, others, left_out]: [&Named; 4],
) -> Option<Problem> {
    let ignored = |lost| {
        let kind = ProblemKind::Ignored { name: document.node(node).name.to_string(), lost };
        Some(Problem::new(kind, document.span(node)))
    };
    for part in within(document, &[node]) {
        let references = references(document, part);
        if let Some((attribute, (what, name))) = references.iter().find(|(_, name)| later.contains(name)) {
            let what = format!("the {what} `{name}` comes after the `<replicate>` whose copies are meant here, too");
            let help = "what refers to copies may refer only to what comes before their `<replicate>`: move it down";
            return Some(Problem::new(ProblemKind::Meaningless { what }, attribute.value_span).help(help));
        }
        if let Some((_, (what, name))) = references.iter().find(|(_, name)| left_out.contains(name)) {
            return ignored(format!("the {what} `{name}` is, too"));
        }
        let (copied, other): (Vec<_>, Vec<_>) = references.iter().partition(|(_, name)| names.contains(name));
        let other = other.iter().find(|(_, name)| name.1 != "world" && others.contains(name));
        if let Some((_, (what, name))) = other
            && !copied.is_empty()
            && !matches!(section, "contact" | "sensor")
        {
            let lost = format!("it ties copies in a `<replicate>` to the {what} `{name}`, which MuJoCo 4.0 leaves out");
            return ignored(lost);
        }
    }
    None
}
