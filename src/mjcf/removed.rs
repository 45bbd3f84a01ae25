//! Names that older files carry and MuJoCo 4.0 no longer knows: since when, and what to write instead.
//!
//! Source: MuJoCo 4.0 manual, Changelog.

use quick_xml::escape::escape;

use super::document::Attribute;
use super::error::Edit;

/// Parent of an element or element of an attribute, its name, the version that has removed it, and a cure.
const ELEMENTS: &[(&str, &str, &str, &str)] = &[
    ("equality", "distance", "2.2.2", "limit a `<spatial>` tendon between two sites"),
    ("equality", "flexvert", "4.0.0", "use rigid bodies"),
];
/// The same of attributes, and the change that does it: another name for it, in which `{}` is its value; empty, it is left
/// out. `None`: there is something to decide.
const ATTRIBUTES: &[(&str, &str, &str, &str, Option<&str>)] = &[
    ("option", "collision", "3.0.0", "choose by `contype` and `conaffinity`, `<pair>` and `<exclude>`", None),
    ("option", "apirate", "3.3.7", "it had no effect: leave it out", Some("")),
    ("option", "mpr_iterations", "3.2.3", "write `ccd_iterations`", Some("ccd_iterations")),
    ("option", "mpr_tolerance", "3.2.3", "write `ccd_tolerance`", Some("ccd_tolerance")),
    ("flag", "sensornoise", "3.1.4", "leave it out: `noise` is a number for whoever uses the values", Some("")),
    ("flag", "passive", "3.3.6", "write `spring` and `damper`", Some("spring=\"{}\" damper")),
    ("compiler", "convexhull", "3.2.5", "leave it out", Some("")),
    ("compiler", "exactmeshinertia", "3.2.5", "write `inertia=\"exact\"` in the `<mesh>`", None),
];
const VALUES: &[(&str, &str, &str, &str)] =
    &[("coordinate", "global", "2.3.4", "write positions and orientations in the frame of the body around")];

fn look_up(table: &[(&str, &str, &str, &str)], of: &str, name: &str) -> Option<String> {
    let (.., since, cure) = table.iter().find(|row| row.0 == of && row.1 == name)?;
    Some(told(since, cure))
}

fn told(since: &str, cure: &str) -> String {
    format!("MuJoCo {since} has removed it: {cure}")
}

/// What to do about an element within a parent.
pub fn element(parent: &str, name: &str) -> Option<String> {
    look_up(ELEMENTS, parent, name)
}

/// What to do about an attribute of an element, and the change that does it.
pub fn attribute(element: &str, attribute: &Attribute) -> Option<(String, Option<Edit>)> {
    let (.., since, cure, name) = ATTRIBUTES.iter().find(|row| row.0 == element && row.1 == attribute.name)?;
    let edit = name.map(|name| match name {
        "" => Edit { span: attribute.whole(), text: String::new() },
        _ => Edit { span: attribute.name_span, text: name.replace("{}", &escape(&*attribute.value)) },
    });
    Some((told(since, cure), edit))
}

/// What to do about the value of an attribute.
pub fn value(attribute: &str, value: &str) -> Option<String> {
    look_up(VALUES, attribute, value)
}
