//! A scene as canonical MJCF: one file, one section of a kind, no classes, frames, replicas or includes.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::frames;
use super::inertia;
use crate::draft::real;
use crate::math::{Mat3, Quat, Vec3, wxyz};
use crate::mjcf::schema::{self, Kind, Row};
use crate::mjcf::spec::{Compiler, Orientation, Pose};
use crate::mjcf::{self, Document, MAIN, NodeId, ORIENTATIONS, compiler, files_of, is_actuator, is_command};

/// Attributes by name, as they would be written.
type Values = BTreeMap<String, String>;

/// For each class, what it gives each element.
type Classes = BTreeMap<String, BTreeMap<String, Values>>;

/// The sections of a file in the order in which they are written. Of those before the assets several are one, whose later
/// values replace earlier ones.
const SECTIONS: [&str; 15] = [
    "compiler", "option", "size", "visual", "statistic", "asset", "worldbody", "contact", "tendon", "equality",
    "actuator", "sensor", "keyframe", "custom", "extension",
];
const MERGED: usize = 5;

/// Writes a scene that compiles as canonical MJCF: what its classes give to elements stands in the elements, what stands
/// in `<frame>`s has its pose in the body, and included files and replicas are written out. Numbers that had to be
/// computed have all their digits; the others stay as they were written, in the units that `<compiler>` says.
///
/// In: `folder`, where the file will be: the files of meshes and pictures are named from there.
pub fn canonical(document: &Document, folder: &Path) -> String {
    let compiler = compiler(document);
    let Some(root) = document.root() else { return String::new() };
    let sections = |name: &str| -> Vec<NodeId> {
        document.node(root).children.iter().copied().filter(|&n| document.node(n).name == name).collect()
    };
    let actuators = mjcf::Classes::read(document, &sections("default"), compiler.degree, &mut Vec::new());
    let mut writer = Writer { document, compiler, classes: Classes::new(), actuators, folder, out: String::new() };
    writer.classes.insert(MAIN.to_string(), BTreeMap::new());
    sections("default").into_iter().for_each(|node| writer.class(node, MAIN));
    let values = writer.own(root);
    writer.open("mujoco", Some(schema::root()), &values, 0, false);
    for (i, name) in SECTIONS.into_iter().enumerate() {
        let nodes = sections(name);
        if nodes.is_empty() {
            continue;
        }
        if i < MERGED {
            writer.merged(&nodes, "mujoco", name, 1);
            continue;
        }
        writer.open(name, None, &Values::new(), 1, false);
        for node in nodes {
            writer.children(node, name, &Context { class: MAIN, frames: &[] }, 2);
        }
        writer.close(name, 1);
    }
    writer.close("mujoco", 0);
    writer.out
}

/// What surrounds an element.
struct Context<'a> {
    class: &'a str,
    /// The `<frame>`s between the body and the element, outermost first.
    frames: &'a [Pose],
}

struct Writer<'a> {
    document: &'a Document,
    compiler: Compiler,
    classes: Classes,
    /// What they give actuators, which have it from each other.
    actuators: mjcf::Classes<'a>,
    folder: &'a Path,
    out: String,
}

impl Writer<'_> {
    /// Reads a `<default>`: a class begins as its parent, and children begin from that.
    fn class(&mut self, node: NodeId, name: &str) {
        let document = self.document;
        let (nested, own): (Vec<NodeId>, Vec<NodeId>) =
            document.node(node).children.iter().partition(|&&child| document.node(child).name == "default");
        for child in own {
            let element = &document.node(child).name;
            let given = self.own(child);
            let class = self.classes.entry(name.to_string()).or_default();
            overlay(class.entry(element.to_string()).or_default(), given, schema::find("default", element));
        }
        for child in nested {
            let Some(class) = document.attribute(child, "class") else { continue };
            let inherited = self.classes.get(name).cloned().unwrap_or_default();
            self.classes.insert(class.value.to_string(), inherited);
            self.class(child, &class.value);
        }
    }

    fn own(&self, node: NodeId) -> Values {
        let attributes = self.document.attributes(node);
        attributes.iter().filter(|a| a.name != "class").map(|a| (a.name.to_string(), a.value.to_string())).collect()
    }

    /// The attributes of an element, those of its class included.
    fn values(&self, node: NodeId, parent: &str, class: &str) -> Values {
        let name = &self.document.node(node).name;
        let row = schema::find(parent, name);
        // What ties name is no element of the world.
        let element = match parent {
            "fixed" | "spatial" => "",
            "tendon" | "equality" => parent,
            _ => name,
        };
        let has_class = row.is_some_and(|row| row.attribute("class").is_some()) && name != "frame";
        let class = self.document.attribute(node, "class").map_or(class, |a| &*a.value);
        let mut values = if is_actuator(element) {
            self.actuator(class, parent, element)
        } else {
            let given = self.classes.get(class).and_then(|class| class.get(element)).filter(|_| has_class);
            given.cloned().unwrap_or_default()
        };
        // Each takes what it knows.
        values.retain(|name, _| row.is_some_and(|row| row.attribute(name).is_some() || row.is_silent(name)));
        overlay(&mut values, self.own(node), row);
        let own = |name: &str| self.document.attribute(node, name).map(|own| &*own.value);
        mjcf::replaced(name, own).into_iter().for_each(|other| drop(values.remove(other)));
        values
    }

    fn actuator(&self, class: &str, parent: &str, element: &str) -> Values {
        let given = self.actuators.values(class, parent, element);
        let written = given.iter().filter_map(|(name, value)| {
            let value = match value {
                mjcf::Value::Numbers(all) => all.iter().map(f64::to_string).collect::<Vec<_>>().join(" "),
                mjcf::Value::Text(text) => text.to_string(),
                mjcf::Value::Nothing => return None,
            };
            Some((name.to_string(), value))
        });
        written.collect()
    }

    fn children(&mut self, node: NodeId, parent: &str, context: &Context, depth: usize) {
        for &child in &self.document.node(node).children {
            self.element(child, parent, context, depth);
        }
    }

    fn element(&mut self, node: NodeId, parent: &str, context: &Context, depth: usize) {
        let document = self.document;
        let name = &*document.node(node).name;
        match name {
            // What stands in it is an element of what it stands in.
            "replicate" => return self.children(node, parent, context, depth),
            "frame" => {
                let values = self.values(node, parent, context.class);
                let frames: Vec<Pose> = context.frames.iter().cloned().chain([pose(&values)]).collect();
                let own = ["childclass", "class"].into_iter().filter_map(|name| document.attribute(node, name)).next();
                let class = own.map_or(context.class, |own| &*own.value);
                return self.children(node, parent, &Context { class, frames: &frames }, depth);
            }
            _ => {}
        }
        let mut values = self.values(node, parent, context.class);
        let written = values.clone();
        self.place(name, &mut values, context.frames);
        for (attribute, path) in files_of(document, node) {
            values.insert(attribute.to_string(), self.named(&path));
        }
        let class = values.remove("childclass").filter(|class| !class.is_empty());
        let class = class.as_deref().unwrap_or(context.class);
        let massless = name == "body" && !context.frames.is_empty() && !self.weighs(node, name, class);
        let empty = document.node(node).children.is_empty() && !massless;
        self.open(name, schema::find(parent, name), &values, depth, empty);
        if massless {
            self.put_massless(written, depth + 1);
        }
        if !empty {
            self.children(node, name, &Context { class, frames: &[] }, depth + 1);
            self.close(name, depth);
        }
    }

    /// Whether a body has mass, from `<inertial>` or from geoms.
    fn weighs(&self, node: NodeId, parent: &str, class: &str) -> bool {
        let document = self.document;
        document.node(node).children.iter().any(|&child| match &*document.node(child).name {
            "inertial" => true,
            "replicate" => self.weighs(child, parent, class),
            "frame" => {
                let own = ["childclass", "class"].into_iter().find_map(|name| document.attribute(child, name));
                self.weighs(child, parent, own.map_or(class, |own| &*own.value))
            }
            "geom" => {
                let values = self.values(child, parent, class);
                let is = |name: &str, x: f64| numbers(&values, name) == Some([x]);
                let [low, high] = self.compiler.inertiagrouprange.map(f64::from);
                let [group] = numbers(&values, "group").unwrap_or_default();
                let nothing = is("mass", 0.0) || !values.contains_key("mass") && is("density", 0.0);
                !nothing && (low..=high).contains(&group)
            }
            _ => false,
        })
    }

    /// The inertial frame of a body without mass is its pose as written, without the frames around it: see `masses`.
    fn put_massless(&mut self, mut written: Values, depth: usize) {
        written.retain(|name, _| name == "pos" || is_orientation(name));
        written.entry("pos".into()).or_insert_with(|| "0 0 0".into());
        put(&mut written, "mass", &[0.0]);
        put(&mut written, "diaginertia", &[0.0; 3]);
        self.open("inertial", schema::find("body", "inertial"), &written, depth, true);
    }

    /// Sections that are read as one.
    fn merged(&mut self, nodes: &[NodeId], parent: &str, name: &str, depth: usize) {
        let document = self.document;
        let row = schema::find(parent, name);
        let mut values = Values::new();
        let mut inside: Vec<(&str, Vec<NodeId>)> = Vec::new();
        for &node in nodes {
            overlay(&mut values, self.own(node), row);
            for &child in &document.node(node).children {
                let name = &*document.node(child).name;
                match inside.iter_mut().find(|(other, _)| *other == name) {
                    Some((_, all)) => all.push(child),
                    None => inside.push((name, vec![child])),
                }
            }
        }
        // The files' names have them.
        values.retain(|name, _| !["assetdir", "meshdir", "texturedir", "strippath"].contains(&name.as_str()));
        self.open(name, row, &values, depth, inside.is_empty());
        if !inside.is_empty() {
            inside.iter().for_each(|(child, all)| self.merged(all, name, child, depth + 1));
            self.close(name, depth);
        }
    }

    /// Takes an element out of the frames around it.
    fn place(&self, element: &str, values: &mut Values, around: &[Pose]) {
        let stretched = matches!(element, "geom" | "site") && values.contains_key("fromto");
        if stretched {
            unturn(values);
        }
        if around.is_empty() {
            return;
        }
        let compiler = &self.compiler;
        let vector = |name: &str, default: Vec3| numbers(values, name).map_or(default, Vec3::from);
        let unturned = |pos: Vec3| frames::in_frames(around, (pos, Quat::identity()), compiler).ok();
        match element {
            "body" | "camera" | "geom" | "site" if !stretched => {
                let whole = Pose { frames: around.into(), ..pose(values) };
                if let Ok((pos, quat)) = frames::pose(&whole, compiler) {
                    put_pose(values, &pos, &quat);
                }
            }
            "geom" | "site" => {
                let Some(Ok((pos, quat, half))) = numbers::<6>(values, "fromto").as_ref().map(frames::fromto) else {
                    return;
                };
                if let Ok((pos, quat)) = frames::in_frames(around, (pos, quat), compiler) {
                    put_pose(values, &pos, &quat);
                    put_size(element, values, half);
                    values.remove("fromto");
                }
            }
            "joint" if values.get("type").is_none_or(|kind| kind != "free") => {
                let (pos, axis) = (vector("pos", Vec3::zeros()), vector("axis", Vec3::z()));
                if let Some((pos, turn)) = unturned(pos) {
                    put(values, "pos", pos.as_slice());
                    put(values, "axis", (turn * (axis / axis.norm())).as_slice());
                }
            }
            "light" => {
                let (pos, dir) = (vector("pos", Vec3::zeros()), vector("dir", -Vec3::z()));
                if let Some((pos, turn)) = unturned(pos) {
                    put(values, "pos", pos.as_slice());
                    put(values, "dir", (turn * dir).as_slice());
                }
            }
            "inertial" => self.place_inertia(values, around),
            _ => {}
        }
    }

    /// A tensor that is turned becomes its principal moments.
    fn place_inertia(&self, values: &mut Values, around: &[Pose]) {
        let own = pose(values);
        let Ok(mut turn) = frames::orientation(&own.orientation, &self.compiler) else { return };
        if let Some([xx, yy, zz, xy, xz, yz]) = numbers(values, "fullinertia")
            && let Some((moments, _, axes)) = inertia::principal(&Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
        {
            values.remove("fullinertia");
            put(values, "diaginertia", moments.as_slice());
            turn *= axes;
        }
        if let Ok((pos, quat)) = frames::in_frames(around, (Vec3::from(own.pos), turn), &self.compiler) {
            put_pose(values, &pos, &quat);
        }
    }

    /// A file as it is called from the folder of the scene to be written.
    fn named(&self, path: &Path) -> String {
        let main = self.document.files.first().and_then(|file| file.path.parent()).unwrap_or(Path::new(""));
        let way = way(self.folder, main).map_or(path.to_owned(), |way| way.join(path));
        // MJCF's separator on all systems.
        way.to_string_lossy().replace('\\', "/")
    }

    fn open(&mut self, name: &str, row: Option<&'static Row>, values: &Values, depth: usize, empty: bool) {
        let _ = write!(self.out, "{:1$}<{name}", "", 2 * depth);
        let order: Vec<&str> = row.map_or(Vec::new(), |row| row.attribute_names().collect());
        let rest = values.keys().map(String::as_str).filter(|name| !order.contains(name));
        for attribute in order.iter().copied().chain(rest) {
            let Some(value) = values.get(attribute) else { continue };
            let value = match row.and_then(|row| row.attribute(attribute)).map(|column| column.kind) {
                Some(Kind::Numbers(..) | Kind::Integers(..)) => words(value).join(" "),
                _ => value.clone(),
            };
            let _ = write!(self.out, " {attribute}=\"{}\"", escaped(&value));
        }
        self.out.push_str(if empty { "/>\n" } else { ">\n" });
    }

    fn close(&mut self, name: &str, depth: usize) {
        let _ = writeln!(self.out, "{:1$}</{name}>", "", 2 * depth);
    }
}

fn words(value: &str) -> Vec<&str> {
    value.split_ascii_whitespace().collect()
}

fn is_orientation(name: &str) -> bool {
    ORIENTATIONS.contains(&name)
}

fn unturn(values: &mut Values) {
    values.retain(|name, _| !is_orientation(name));
}

/// Puts values over inherited ones: one form of orientation replaces all others, and fewer numbers the first ones.
fn overlay(values: &mut Values, own: Values, row: Option<&Row>) {
    if own.keys().any(|name| is_orientation(name)) {
        unturn(values);
    }
    for (name, value) in own {
        let of_numbers = match row.and_then(|row| row.attribute(&name)).map(|column| column.kind) {
            // One number stands for both.
            _ if name == "springlength" => false,
            Some(Kind::Numbers(_, most) | Kind::Integers(_, most)) => most < usize::MAX,
            Some(_) => false,
            None => words(&value).iter().all(|word| word.parse::<f64>().is_ok()),
        };
        let old = values.get(&name).filter(|_| of_numbers).cloned().unwrap_or_default();
        let rest = words(&old).into_iter().skip(words(&value).len());
        let all = if of_numbers { words(&value).into_iter().chain(rest).collect::<Vec<_>>().join(" ") } else { value };
        values.insert(name, all);
    }
}

fn numbers<const N: usize>(values: &Values, name: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = words(values.get(name)?).into_iter().map(|word| word.parse().ok()).collect();
    all?.try_into().ok()
}

/// The pose that an element gives itself.
fn pose(values: &Values) -> Pose {
    let forms = [
        numbers(values, "quat").map(Orientation::Quat),
        numbers(values, "axisangle").map(Orientation::AxisAngle),
        numbers(values, "xyaxes").map(Orientation::XyAxes),
        numbers(values, "zaxis").map(Orientation::ZAxis),
        numbers(values, "euler").map(Orientation::Euler),
    ];
    let orientation = forms.into_iter().flatten().next().map(Box::new);
    Pose { pos: numbers(values, "pos").unwrap_or_default(), orientation, frames: [].into() }
}

fn put(values: &mut Values, name: &str, numbers: &[f64]) {
    // Minus zero is none.
    let text: Vec<String> = numbers.iter().map(|x| (x + 0.0).to_string()).collect();
    values.insert(name.to_string(), text.join(" "));
}

fn put_pose(values: &mut Values, pos: &Vec3, quat: &Quat) {
    unturn(values);
    put(values, "pos", pos.as_slice());
    put(values, "quat", &wxyz(quat));
}

/// The size of what was stretched between two points `2 half` apart.
fn put_size(element: &str, values: &mut Values, half: f64) {
    let given = values.get("size").into_iter().flat_map(|size| words(size)).filter_map(|word| word.parse().ok());
    let mut size: Vec<f64> = given.collect();
    if element == "site" {
        size.resize(3, 0.005);
    }
    match values.get("type").map(String::as_str) {
        Some("capsule" | "cylinder") => {
            size.resize(size.len().max(2), half);
            size[1] = half;
        }
        Some("box" | "ellipsoid") => {
            let width = size.first().copied().unwrap_or_default();
            size = vec![width, width, half];
        }
        _ => return,
    }
    put(values, "size", &size);
}

/// The way from one folder to another, by names.
fn way(from: &Path, to: &Path) -> Option<PathBuf> {
    let absolute =
        |folder: &Path| real(&if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.into() });
    let (from, to) = (absolute(from), absolute(to));
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    (shared > 0).then(|| {
        let up = from.components().skip(shared).map(|_| "..");
        up.map(PathBuf::from).chain(to.components().skip(shared).map(|part| part.as_os_str().into())).collect()
    })
}

/// A value between quotes.
fn escaped(value: &str) -> String {
    let mut out = String::with_capacity(value.len());
    for c in value.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Line ends would be read as blanks; and a terminal is given no commands.
            _ if is_command(c) || c.is_control() => drop(write!(out, "&#{};", c as u32)),
            _ => out.push(c),
        }
    }
    out
}
