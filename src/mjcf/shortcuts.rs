//! What the kinds of actuator have from each other in default classes.
//!
//! A class has one default for all actuators, in the terms of `general`. What says how an actuator is controlled (`kp`,
//! `area`, …) a shortcut has from a default that was written as the same shortcut, or as `general` with the gain type of
//! the shortcut; else from the nearest class around that has such a one. `general` has it from every shortcut. All else
//! (`gear`, `ctrlrange`, …) is had from whichever was written last.
//!
//! Source: MuJoCo 4.0 manual, Modeling › Actuators › Shortcuts; checked by running MuJoCo 4.0.0.

use std::sync::Arc;

use super::defaults::{Class, Value, Values};

const SHORTCUTS: [&str; 11] = [
    "motor", "position", "velocity", "intvelocity", "damper", "cylinder",
    // These Penny lacks, but other actuators have something from their defaults.
    "orientation", "pid", "muscle", "adhesion", "dcmotor",
];

/// What says how an actuator is controlled, of the shortcuts and of `general`.
const CONTROL: [&str; 15] = [
    "kp", "kv", "dampratio", "timeconst", "area", "diameter", "bias", "inheritrange", "dyntype", "dynprm", "gaintype",
    "gainprm", "biastype", "biasprm", "actearly",
];

/// Whether this is an element of `<actuator>` that has its defaults from others.
pub fn is_actuator(element: &str) -> bool {
    element == "general" || SHORTCUTS.contains(&element)
}

/// Brings the actuators of a class to what was just written for one of them.
///
/// In: `outer`, what the class had from the one around it.
pub fn share<'a>(class: &mut Class<'a>, written: &'a str, outer: &Class<'a>) {
    if !is_actuator(written) {
        return;
    }
    let values = class.get(written).cloned().unwrap_or_default();
    let general = if written == "general" { (*values).clone() } else { as_general(written, &values) };
    for shortcut in SHORTCUTS {
        let of_class =
            written == shortcut || written == "general" && word(&general, "gaintype", "fixed") == gain_of(shortcut);
        let control = if of_class {
            as_shortcut(shortcut, &general)
        } else {
            outer.get(shortcut).map(|outer| outer.only(|name| CONTROL.contains(&name))).unwrap_or_default()
        };
        let mut all = general.only(|name| !CONTROL.contains(&name));
        control.iter().for_each(|(name, value)| all.put(name, value.clone()));
        class.insert(shortcut, Arc::new(all));
    }
    class.insert("general", Arc::new(general));
}

/// What an element's own attributes take the place of, although a class gives it.
///
/// In: `own`, the value of the element's own attribute of that name.
pub fn replaced<'v>(element: &str, own: impl Fn(&str) -> Option<&'v str>) -> Vec<&'static str> {
    let range = match element {
        "position" => "ctrlrange",
        "intvelocity" => "actrange",
        _ => return Vec::new(),
    };
    let inherits = own("inheritrange").is_some_and(|value| value.trim().parse() != Ok(0.0));
    let said = [("kv", "dampratio"), ("dampratio", "kv"), (range, "inheritrange")];
    let mut replaced: Vec<&str> =
        said.iter().filter(|(name, _)| own(name).is_some()).map(|(_, other)| *other).collect();
    replaced.extend(inherits.then_some(range));
    replaced.retain(|other| own(other).is_none());
    replaced
}

fn gain_of(shortcut: &str) -> &'static str {
    match shortcut {
        "damper" => "affine",
        "orientation" => "so3",
        "pid" => "pid",
        "muscle" => "muscle",
        "dcmotor" => "dcmotor",
        _ => "fixed",
    }
}

fn word<'a>(values: &Values<'a>, name: &str, default: &'a str) -> &'a str {
    match values.get(name) {
        Some(Value::Text(word)) => word,
        _ => default,
    }
}

/// The first numbers that are given.
fn array<const N: usize>(values: &Values, name: &str) -> Option<[f64; N]> {
    let Some(Value::Numbers(given)) = values.get(name) else { return None };
    Some(std::array::from_fn(|i| given.get(i).copied().unwrap_or(0.0)))
}

/// A shortcut in the terms of `general`. Some damping ratio is a positive third number of `biasprm`.
fn as_general<'a>(shortcut: &str, values: &Values<'a>) -> Values<'a> {
    let number = |name: &str, default: f64| array::<1>(values, name).map_or(default, |[x]| x);
    let (kp, kv, filter) = (number("kp", 1.0), number("kv", 0.0), number("timeconst", 0.0));
    let servo = ([kp, 0.0, 0.0], [0.0, -kp, number("dampratio", 0.0) - kv]);
    let (dyntype, dynprm, (gainprm, biasprm)) = match shortcut {
        "position" if filter > 0.0 => ("filterexact", filter, servo),
        "position" => ("none", 1.0, servo),
        "intvelocity" => ("integrator", 1.0, servo),
        "velocity" => {
            let kv = number("kv", 1.0);
            ("none", 1.0, ([kv, 0.0, 0.0], [0.0, 0.0, -kv]))
        }
        "damper" => ("none", 1.0, ([0.0, 0.0, -kv], [0.0; 3])),
        "cylinder" => {
            let circle = array(values, "diameter").map(|[d]: [f64; 1]| 0.25 * std::f64::consts::PI * d * d);
            let area = circle.unwrap_or(number("area", 1.0));
            ("filter", number("timeconst", 1.0), ([area, 0.0, 0.0], array(values, "bias").unwrap_or_default()))
        }
        _ => ("none", 1.0, ([1.0, 0.0, 0.0], [0.0; 3])),
    };
    // `actlimited` says something in `general` only.
    let passed = |name: &str| (!CONTROL.contains(&name) || name == "inheritrange") && name != "actlimited";
    let mut general = values.only(passed);
    general.put("dyntype", Value::Text(dyntype));
    general.put("dynprm", Value::Numbers(vec![dynprm]));
    general.put("gaintype", Value::Text(gain_of(shortcut)));
    general.put("gainprm", Value::Numbers(gainprm.to_vec()));
    general.put("biastype", Value::Text(if matches!(shortcut, "motor" | "damper") { "none" } else { "affine" }));
    general.put("biasprm", Value::Numbers(biasprm.to_vec()));
    if matches!(shortcut, "damper" | "adhesion") {
        general.put("ctrllimited", Value::Text("true"));
    }
    general
}

/// What a shortcut reads out of the numbers of `general`, as far as they are given.
fn as_shortcut<'a>(shortcut: &str, general: &Values<'a>) -> Values<'a> {
    let mut values = Values::default();
    let mut put = |name, number: f64| values.put(name, Value::Numbers(vec![number]));
    let (gain, bias) = (array::<3>(general, "gainprm"), array::<3>(general, "biasprm"));
    let time = array::<1>(general, "dynprm").map(|[time]| time);
    match shortcut {
        "position" | "intvelocity" => {
            gain.into_iter().for_each(|gain| put("kp", gain[0]));
            match bias.map_or(0.0, |bias| bias[2]) {
                ratio if ratio > 0.0 => put("dampratio", ratio),
                damping if damping < 0.0 => put("kv", -damping),
                _ => {}
            }
            if shortcut == "position" && word(general, "dyntype", "none") == "filterexact" {
                put("timeconst", time.unwrap_or(1.0));
            }
            array(general, "inheritrange").into_iter().for_each(|[x]| put("inheritrange", x));
        }
        "velocity" => gain.into_iter().for_each(|gain| put("kv", gain[0])),
        "damper" => gain.into_iter().for_each(|gain| put("kv", -gain[2])),
        "cylinder" => {
            gain.into_iter().for_each(|gain| put("area", gain[0]));
            time.into_iter().for_each(|time| put("timeconst", time));
            bias.into_iter().for_each(|bias| values.put("bias", Value::Numbers(bias.to_vec())));
        }
        _ => {}
    }
    values
}
