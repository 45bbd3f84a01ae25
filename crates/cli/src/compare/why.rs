//! Why a law's run leaves MuJoCo's: measured where both laws can be asked about the same states.
//!
//! Along Penny's own run, up to the step that first differs, the `mujoco` law (MuJoCo's to rounding) is asked for the
//! forces at the same states. What the two laws differ by there is the cause; whether it goes away in a scene
//! without friction tells friction from the rest.

use crate::format::{count, si};
use penny::collision::exact;
use penny::contact::mujoco;
use penny::data::{Contact, Data};
use penny::forward::{Method, forward, step};
use penny::math::Vec3;
use penny::model::Model;
use penny::state::State;
use penny_lab::names::body as body_name;

/// Impulses by which two laws differ, N s.
#[derive(Default)]
struct Difference {
    /// Of all forces: normal, and friction with its torques over their lever.
    all: f64,
    /// Of the normal forces that would act without friction.
    bare: f64,
    /// Of joint limits and dry friction, N s or N m s.
    joints: f64,
    /// Of MuJoCo's forces: what the differences are measured by.
    size: f64,
    /// Where the laws differ most.
    worst: Option<Worst>,
}

struct Worst {
    /// N s
    impulse: f64,
    /// s
    time: f64,
    contact: Contact,
    /// Speeds of one surface along and on the other, m/s and rad/s.
    slip: f64,
    turn: f64,
    /// How many contacts the bodies have that touch here.
    contacts: usize,
}

/// Differences below this part of all impulses are rounding: eighty contacts of a stack make 3e-15.
const ROUNDING: f64 = 1e-13;

/// Why Penny's run under `method` has left MuJoCo's after `steps` steps: sentences that name cause and measure.
pub fn reasons(model: &Model, method: &Method, start: &State, steps: usize) -> Vec<String> {
    let law = method.contact.name;
    let mut reasons = Vec::new();
    // The law that this page asks for MuJoCo's forces.
    if std::ptr::eq(method.contact, &mujoco::LAW) {
        reasons.extend(inexact_contacts(model, method, start, steps));
        return reasons;
    }
    let difference = measure(model, method, start, steps);
    if difference.joints > ROUNDING * difference.size {
        reasons.push(match method.contact.joints {
            true => format!("dry friction of joints: {law} stops a joint with it, MuJoCo lets it creep (its R)"),
            false => format!("{}: {law} has none", held(model)),
        });
    }
    let Some(worst) = difference.worst.filter(|_| difference.all > ROUNDING * difference.size) else { return reasons };
    let friction = (1.0 - difference.bare / difference.all).max(0.0);
    let (time, place) = (si(worst.time, "s"), place(model, &worst.contact));
    let percent = |share: f64| format!("{:.0} % of the difference in force", 100.0 * share);
    let unlike = method.contact.unlike;
    let silent = || format!("why, the law {law} does not say");
    if friction > 0.01 {
        let [slip, turn] = [si(worst.slip, "m/s"), si(worst.turn, "rad/s")];
        reasons.push(format!(
            "friction: {} is gone without it. At {time} {place} slips at {slip} and turns at {turn}; {}",
            percent(friction),
            unlike.map_or_else(silent, |u| u.friction.to_owned())
        ));
    }
    if friction < 0.99 {
        let contacts = count(worst.contacts, "contact", "contacts");
        reasons.push(format!(
            "normal forces: {} is there without friction. At {time} {place} has {contacts}; {}",
            percent(1.0 - friction),
            unlike.map_or_else(silent, |u| (u.normal)(model, method.timestep))
        ));
    }
    reasons
}

/// What of a scene holds joints and bodies beside contacts.
fn held(model: &Model) -> String {
    let requires = &model.requires;
    let tendons = model.tendons.iter().any(|t| t.range.is_some() || t.frictionloss > 0.0);
    let all = [
        (requires.limits + requires.frictionloss > 0, "joint limits and dry friction"),
        (requires.equalities > 0, "equalities"),
        (tendons, "limits and dry friction of tendons"),
    ];
    all.iter().filter(|(has, _)| *has).map(|(_, what)| *what).collect::<Vec<_>>().join(", ")
}

/// Runs the steps and adds up by how much the two laws differ at the states that come along.
fn measure(model: &Model, method: &Method, start: &State, steps: usize) -> Difference {
    let reference = Method { contact: &mujoco::LAW, ..*method };
    let mut slick = model.clone();
    let changed = slick.edit(|m| m.mixes.iter_mut().for_each(|mix| mix.condim = 1));
    debug_assert!(changed.is_ok(), "{changed:?}");
    let (mut state, mut data) = (start.clone(), Data::new(model));
    let [mut ours, mut theirs] = [Data::new(model), Data::new(model)];
    let [mut our_bare, mut their_bare] = [Data::new(&slick), Data::new(&slick)];
    let mut difference = Difference::default();
    for _ in 0..steps {
        forward(model, method, &state, &mut ours);
        forward(model, &reference, &state, &mut theirs);
        if ours.contacts.is_empty() {
            let pairs = ours.qfrc_constraint.iter().zip(&theirs.qfrc_constraint);
            difference.joints += pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() * method.timestep;
            difference.size += theirs.qfrc_constraint.iter().map(|f| f.abs()).sum::<f64>() * method.timestep;
        } else {
            forward(&slick, method, &state, &mut our_bare);
            forward(&slick, &reference, &state, &mut their_bare);
            difference.add(model, method.timestep, state.time, &ours, &theirs);
            let bare = our_bare.contacts.iter().zip(&their_bare.contacts);
            difference.bare += bare.map(|(a, b)| (a.force[0] - b.force[0]).abs()).sum::<f64>() * method.timestep;
        }
        if step(model, method, &mut state, &mut data).is_err() {
            break;
        }
    }
    difference
}

impl Difference {
    /// Adds the forces of a step.
    fn add(&mut self, model: &Model, timestep: f64, time: f64, ours: &Data, theirs: &Data) {
        for (a, b) in ours.contacts.iter().zip(&theirs.contacts) {
            let lever = a.body.iter().map(|&body| (a.pos - ours.movers[body as usize].com).norm()).fold(0.0, f64::max);
            let by = |range: std::ops::Range<usize>| range.map(|k| (a.force[k] - b.force[k]).powi(2)).sum::<f64>();
            let force = by(0..1).sqrt() + by(1..3).sqrt() + by(3..6).sqrt() / lever.max(f64::MIN_POSITIVE);
            let impulse = timestep * force;
            self.all += impulse;
            self.size += timestep * b.force[0].abs();
            if self.worst.as_ref().is_none_or(|w| impulse > w.impulse) {
                let shares = |c: &&Contact| c.body.iter().any(|&b| moves(model, b) && a.body.contains(&b));
                let contacts = ours.contacts.iter().filter(shares).count();
                let (slip, turn) = speeds(a, ours);
                self.worst = Some(Worst { impulse, time, contact: *a, slip, turn, contacts });
            }
        }
    }
}

fn moves(model: &Model, body: u32) -> bool {
    model.bodies[body as usize].tree.is_some()
}

/// Speeds at which the second surface slides along the first, m/s, and turns on it, rad/s.
fn speeds(contact: &Contact, data: &Data) -> (f64, f64) {
    let twist = |side: usize| {
        let mover = &data.movers[contact.body[side] as usize];
        let [linear, angular] = [0, 3].map(|i| Vec3::new(mover.vel[i], mover.vel[i + 1], mover.vel[i + 2]));
        let angular = mover.axes * angular;
        (linear + angular.cross(&(contact.pos - mover.com)), angular)
    };
    let [(v0, w0), (v1, w1)] = [twist(0), twist(1)];
    let (v, normal) = (v1 - v0, contact.frame.row(0).transpose());
    ((v - normal * v.dot(&normal)).norm(), (w1 - w0).norm())
}

/// The body that moves, or both that do.
fn place(model: &Model, contact: &Contact) -> String {
    let names: Vec<String> =
        contact.body.iter().filter(|&&b| moves(model, b)).map(|&b| body_name(model, b as usize)).collect();
    names.join(" on ")
}

/// Pairs of shapes that have touched and for which MuJoCo may choose other points.
fn inexact_contacts(model: &Model, method: &Method, start: &State, steps: usize) -> Option<String> {
    let (mut state, mut data) = (start.clone(), Data::new(model));
    for _ in 0..steps {
        let outcome = step(model, method, &mut state, &mut data);
        let kinds = |c: &Contact| c.geom.map(|g| model.geoms[g as usize].kind);
        if let Some([a, b]) = data.contacts.iter().map(kinds).find(|[a, b]| !exact(*a, *b)) {
            let [a, b] = [a, b].map(|kind| format!("{kind:?}").to_lowercase());
            return Some(format!(
                "contact points: MuJoCo finds those of {a} and {b} by a search that stops early (at {})",
                si(state.time, "s")
            ));
        }
        if outcome.is_err() {
            break;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use penny::contact;
    use penny::integrate;

    fn scene(bodies: &str) -> Model {
        let text = format!(
            r#"<mujoco><option timestep="0.002" tolerance="0"/><default><geom condim="1"/></default><worldbody>
               <geom type="plane" size="9 9 1"/>{bodies}</worldbody></mujoco>"#
        );
        penny::parse("scene.xml", &text).unwrap_or_else(|e| panic!("{e}")).model
    }

    /// The reasons for what a law does in the first fifth of a second.
    fn why(law: &str, bodies: &str) -> Vec<String> {
        let model = scene(bodies);
        let contact = contact::by_name(law).expect("a law");
        let integrator = integrate::by_name("Euler").expect("an integrator");
        let method = Method { contact, integrator, timestep: 0.002, rounds: penny::forward::ROUNDS };
        let mut start = State::new(&model);
        start.qvel[0] = 1.0;
        reasons(&model, &method, &start, 100)
    }

    fn ball(more: &str) -> String {
        format!(r#"<body name="ball" pos="0 0 .105"><freejoint/><geom size=".1" {more}/></body>"#)
    }

    #[test]
    fn friction_is_told_from_the_rest() {
        assert!(why("penalty", &ball("")).is_empty(), "one contact without friction is MuJoCo's");
        let reasons = why("penalty", &ball(r#"condim="3""#));
        assert_eq!(reasons.len(), 1, "{reasons:?}");
        assert!(reasons[0].starts_with("friction: 100 %") && reasons[0].contains("ball slips at"), "{reasons:?}");
    }

    #[test]
    fn bodies_that_share_a_load_press_as_in_mujoco() {
        // Eighty contacts in one island, without friction at work: all normal forces are found together.
        let at = |i: usize| format!(r#"<body pos="{} 0 {}">"#, 0.001 * i as f64, 0.101 + 0.201 * i as f64);
        let body = |i| at(i) + r#"<freejoint/><geom type="box" size=".1 .1 .1" mass="1"/></body>"#;
        let reasons = why("penalty", &(0..20).map(body).collect::<String>());
        assert!(reasons.is_empty(), "{reasons:?}");
    }

    #[test]
    fn a_law_without_joint_limits_is_not_said_to_have_them() {
        let arm = |more: &str| {
            let geom = r#"<geom type="capsule" fromto="0 0 0 .5 0 0" size=".05" contype="0" conaffinity="0"/>"#;
            format!(r#"<body pos="0 0 5"><joint axis="0 1 0" {more}/>{geom}</body>"#)
        };
        let (limited, dry) = (arm(r#"range="-1 1""#), arm(r#"frictionloss="99""#));
        assert_eq!(why("tutorial", &limited), ["joint limits and dry friction: tutorial has none"]);
        let tied = format!("{}</worldbody><equality><joint joint1='a'/></equality><worldbody>", arm("name='a'"));
        assert_eq!(why("tutorial", &tied), ["equalities: tutorial has none"]);
        assert!(why("penalty", &limited).is_empty(), "one limit is MuJoCo's");
        assert!(why("penalty", &dry)[0].starts_with("dry friction of joints: penalty stops a joint"));
    }

    #[test]
    fn the_courses_law_names_its_constants() {
        // Standard solref (0.02, 1) and a ball of 4.19 kg: k = m/τ², c = 2m/τ.
        let reasons = why("tutorial", &ball(""));
        assert!(reasons[0].contains("k = 1.05e4 N/m (from solref)"), "{reasons:?}");
        assert!(reasons[0].contains("c = 4.19e2 N s/m"), "{reasons:?}");
    }

    #[test]
    fn a_law_that_gives_no_reason_is_said_to_give_none() {
        static OWN: contact::Law = contact::Law { name: "own", unlike: None, ..contact::tutorial::LAW };
        let model = scene(&ball(""));
        let integrator = integrate::by_name("Euler").expect("an integrator");
        let method = Method { contact: &OWN, integrator, timestep: 0.002, rounds: penny::forward::ROUNDS };
        let reasons = reasons(&model, &method, &State::new(&model), 100);
        assert!(reasons[0].ends_with("why, the law own does not say"), "{reasons:?}");
    }

    #[test]
    fn shapes_without_a_closed_form_are_named() {
        let can = |z: f64| format!(r#"<body pos="0 0 {z}"><freejoint/><geom type="cylinder" size=".1 .05"/></body>"#);
        let reasons = why("mujoco", &format!("{}{}", can(0.051), can(0.152)));
        assert!(reasons[0].contains("cylinder and cylinder"), "{reasons:?}");
        assert!(why("mujoco", &ball("")).is_empty());
    }
}
