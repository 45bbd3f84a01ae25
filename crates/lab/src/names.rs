//! What bodies, geoms and joints are called where their file gives them no name: by what they are.

use penny::model::Model;

/// "crate", or "body 3, a box".
pub fn body(model: &Model, body: usize) -> String {
    let b = &model.bodies[body];
    if !b.name.is_empty() {
        return b.name.clone();
    }
    let mut kinds: Vec<&str> = model.geoms[b.geoms.clone()].iter().map(|g| g.kind.name()).collect();
    kinds.dedup();
    match kinds[..] {
        [one] => format!("body {body}, {} {one}", if one.starts_with('e') { "an" } else { "a" }),
        _ => format!("body {body}"),
    }
}

/// "ground"; without a name "crate", as its body whose only geom it is, "sphere 3 of crate", or "plane 0".
pub fn geom(model: &Model, geom: usize) -> String {
    let g = &model.geoms[geom];
    let body = &model.bodies[g.body];
    match (g.name.as_str(), body.name.as_str()) {
        ("", of) if g.body != 0 && !of.is_empty() => match body.geoms.len() {
            1 => of.to_owned(),
            _ => format!("{} {geom} of {of}", g.kind.name()),
        },
        ("", _) => format!("{} {geom}", g.kind.name()),
        (name, _) => name.to_owned(),
    }
}

/// "elbow", or "hinge 2".
pub fn joint(model: &Model, joint: usize) -> String {
    let j = &model.joints[joint];
    if j.name.is_empty() { format!("{} {joint}", j.kind.name()) } else { j.name.clone() }
}

/// "string", or "0".
pub fn tendon(model: &Model, tendon: usize) -> String {
    let t = &model.tendons[tendon];
    if t.name.is_empty() { tendon.to_string() } else { t.name.clone() }
}

/// "servo", or "actuator 0".
pub fn actuator(model: &Model, actuator: usize) -> String {
    let a = &model.actuators[actuator];
    if a.name.is_empty() { format!("actuator {actuator}") } else { a.name.clone() }
}
