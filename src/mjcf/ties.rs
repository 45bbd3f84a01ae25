//! Tendons and equalities: what ties joints, bodies and sites together.

use super::defaults::MAIN;
use super::document::NodeId;
use super::error::{Problem, ProblemKind};
use super::item::Item;
use super::read::Reader;
use super::spec::*;

impl Reader<'_> {
    pub fn tendons(&mut self, section: NodeId) -> Vec<Tendon> {
        let nodes = &self.document.node(section).children;
        nodes.iter().filter_map(|&node| self.tendon(node)).collect()
    }

    fn tendon(&mut self, node: NodeId) -> Option<Tendon> {
        let item = self.item(node, "tendon", MAIN)?;
        let path = match &*self.document.node(node).name {
            "fixed" => Path::Fixed(self.parts(node)),
            _ => Path::Spatial(self.waypoints(node)),
        };
        let [low, high] = item.array("range");
        let (kind, help) = match item.maybe("limited") {
            Some(true) if !item.given("range") => (Some(ProblemKind::LimitedWithoutRange), "add `range=\"low high\"`"),
            Some(true) if low >= high => (Some(ProblemKind::RangeEmpty { low, high }), "give the smaller number first"),
            None if low > high && item.given("range") => {
                (Some(ProblemKind::RangeLost), "give the smaller number first")
            }
            _ => (None, ""),
        };
        if let Some(kind) = kind {
            self.problems.push(Problem::new(kind, self.document.value_span(node, "range")).help(help));
        }
        Some(Tendon {
            node,
            name: item.name(),
            path,
            range: item.optional("range").filter(|[low, high]| low < high),
            limited: item.maybe("limited"),
            margin: item.number("margin"),
            solreflimit: item.array("solreflimit"),
            solimplimit: item.array("solimplimit"),
            solreffriction: item.array("solreffriction"),
            solimpfriction: item.array("solimpfriction"),
            stiffness: item.array("stiffness"),
            springlength: self.springlength(&item),
            damping: item.array("damping"),
            frictionloss: item.number("frictionloss"),
            armature: item.number("armature"),
            actuatorfrcrange: item.optional("actuatorfrcrange"),
            actuatorfrclimited: item.maybe("actuatorfrclimited"),
            width: item.number("width"),
            rgba: item.array::<4>("rgba").map(|c| c as f32),
        })
    }

    /// One number is both ends of the range in which a spring is slack.
    fn springlength(&mut self, item: &Item) -> [f64; 2] {
        let [low, high] = item.array("springlength");
        let own = self.document.attribute(item.node, "springlength");
        let one = own.map_or(high == -1.0, |own| own.value.split_ascii_whitespace().count() == 1);
        if one {
            return [low, low];
        }
        if low > high {
            let span = self.document.value_span(item.node, "springlength");
            let problem = Problem::new(ProblemKind::RangeEmpty { low, high }, span);
            self.problems.push(problem.help("give the smaller number first"));
        }
        [low, high]
    }

    fn parts(&mut self, tendon: NodeId) -> Vec<(NodeId, String, f64)> {
        let mut parts: Vec<(NodeId, String, f64)> = Vec::new();
        for &node in &self.document.node(tendon).children {
            let Some(item) = self.item(node, "fixed", MAIN) else { continue };
            let joint = item.word("joint").to_string();
            if let Some((first, ..)) = parts.iter().find(|(_, other, _)| *other == joint) {
                let what = format!("joint `{joint}` is part of this tendon already");
                let span = self.document.value_span(node, "joint");
                let problem = Problem::new(ProblemKind::Meaningless { what }, span);
                let problem = problem.help("give the sum of the two as `coef`");
                self.problems.push(problem.related(self.document.span(*first), "first given here"));
                continue;
            }
            parts.push((node, joint, item.number("coef")));
        }
        if parts.is_empty() {
            self.empty_path(tendon, "put `<joint joint=… coef=…/>` into it");
        }
        parts
    }

    fn waypoints(&mut self, tendon: NodeId) -> Vec<(NodeId, Waypoint)> {
        let mut points = Vec::new();
        for &node in &self.document.node(tendon).children {
            let Some(item) = self.item(node, "spatial", MAIN) else { continue };
            let word = |name: &str| item.word(name).to_string();
            points.push(match &*self.document.node(node).name {
                "site" => (node, Waypoint::Site(word("site"))),
                "geom" => {
                    let side = item.given("sidesite").then(|| word("sidesite"));
                    (node, Waypoint::Geom { geom: word("geom"), side })
                }
                _ => (node, Waypoint::Pulley(item.number("divisor"))),
            });
        }
        self.order(tendon, &points);
        points
    }

    /// Every branch begins and ends at a site, and between two geoms there is one.
    fn order(&mut self, tendon: NodeId, points: &[(NodeId, Waypoint)]) {
        let site = |p: Option<&(NodeId, Waypoint)>| matches!(p, Some((_, Waypoint::Site(_))));
        if !points.iter().any(|p| site(Some(p))) {
            return self.empty_path(tendon, "put two `<site site=…/>` into it");
        }
        for (i, (node, point)) in points.iter().enumerate() {
            let before = i.checked_sub(1).and_then(|i| points.get(i));
            let sites = [site(before), site(points.get(i + 1))];
            if let (Waypoint::Site(one), Some((_, Waypoint::Site(next)))) = (point, points.get(i + 1))
                && one == next
            {
                let what = format!("site `{one}` follows itself in the tendon");
                let problem = Problem::new(ProblemKind::Meaningless { what }, self.document.span(points[i + 1].0));
                self.problems.push(problem.help("leave one of the two out"));
            }
            let what = match point {
                Waypoint::Geom { .. } if sites != [true, true] => "a geom stands between two sites of the tendon",
                Waypoint::Pulley(_) if points.get(i + 1).is_none() => "a branch of the tendon follows a pulley",
                Waypoint::Pulley(_) if i > 0 && !sites[0] => "a branch of the tendon ends at a site",
                Waypoint::Pulley(_) if !sites[1] => "a branch of the tendon begins at a site",
                Waypoint::Site(_) if sites == [false, false] && !lonely(points, i) => continue,
                Waypoint::Site(_) if lonely(points, i) => "a branch of the tendon has at least two sites",
                _ => continue,
            };
            let kind = ProblemKind::Meaningless { what: what.to_string() };
            let problem = Problem::new(kind, self.document.span(*node));
            self.problems.push(problem.help("add the `<site site=…/>` that is missing"));
        }
    }

    fn empty_path(&mut self, tendon: NodeId, help: &str) {
        let what = "a tendon without a path has no length".to_string();
        let problem = Problem::new(ProblemKind::Meaningless { what }, self.document.span(tendon));
        self.problems.push(problem.help(help));
    }

    pub fn equalities(&mut self, section: NodeId) -> Vec<Equality> {
        let nodes = &self.document.node(section).children;
        nodes.iter().filter_map(|&node| self.equality(node)).collect()
    }

    fn equality(&mut self, node: NodeId) -> Option<Equality> {
        let item = self.item(node, "equality", MAIN)?;
        let word = |name: &str| item.word(name).to_string();
        let maybe = |name: &str| item.given(name).then(|| word(name));
        let element = self.document.node(node).name.to_string();
        let kind = match element.as_str() {
            "joint" => {
                let joints = (word("joint1"), maybe("joint2"));
                EqualityKind::Joint { joints, polycoef: item.array("polycoef") }
            }
            "tendon" => {
                let tendons = (word("tendon1"), maybe("tendon2"));
                EqualityKind::Tendon { tendons, polycoef: item.array("polycoef") }
            }
            _ => self.frames_of(&item, &element)?,
        };
        Some(Equality {
            node,
            name: item.name(),
            active: item.yes("active"),
            solref: item.array("solref"),
            solimp: item.array("solimp"),
            kind,
        })
    }

    /// What a `connect` or `weld` holds: two sites, or points of two bodies.
    fn frames_of(&mut self, item: &Item, element: &str) -> Option<EqualityKind> {
        let word = |name: &str| item.word(name).to_string();
        let weld = element == "weld";
        let bodies = ["body1", "body2", "anchor", "relpose"].into_iter().find(|name| item.given(name));
        if let (Some(bodies), Some(site)) = (bodies, ["site1", "site2"].into_iter().find(|s| item.given(s))) {
            self.conflict(item.node, site, bodies, "it holds two sites, or two bodies");
            return None;
        }
        let mut needs = |name: &str| {
            let kind = ProblemKind::MissingAttribute { element: element.into(), attribute: name.into() };
            let problem = Problem::new(kind, self.document.span(item.node));
            self.problems.push(problem.help("give two sites, or a body and a point of it"));
        };
        if item.given("site1") || item.given("site2") {
            if let Some(missing) = ["site1", "site2"].into_iter().find(|s| !item.given(s)) {
                needs(missing);
                return None;
            }
            let torquescale = weld.then(|| item.number("torquescale"));
            return Some(EqualityKind::Sites { sites: [word("site1"), word("site2")], torquescale });
        }
        if !item.given("body1") {
            needs("body1");
            return None;
        }
        if !weld && !item.given("anchor") {
            needs("anchor");
            return None;
        }
        Some(EqualityKind::Bodies {
            body1: word("body1"),
            body2: item.given("body2").then(|| word("body2")),
            anchor: item.array("anchor"),
            weld: weld.then(|| Weld { relpose: item.array("relpose"), torquescale: item.number("torquescale") }),
        })
    }
}

/// Whether a site is a branch by itself.
fn lonely(points: &[(NodeId, Waypoint)], i: usize) -> bool {
    let ends = |p: Option<&(NodeId, Waypoint)>| p.is_none_or(|(_, p)| matches!(p, Waypoint::Pulley(_)));
    ends(i.checked_sub(1).and_then(|i| points.get(i))) && ends(points.get(i + 1))
}
