//! The compiler against MuJoCo 4.0.0, number by number, and what it promises beyond.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use penny::model::{Model, Requirements};
use serde::Deserialize;

use crate::sim::Sim;

#[derive(Deserialize)]
struct Golden {
    scenes: Vec<Scene>,
}

#[derive(Deserialize)]
struct Scene {
    name: String,
    xml: String,
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    geoms: Vec<Geom>,
    /// Of the inertia matrix at qpos0, tree by tree: the largest.
    condition: f64,
    dof_invweight0: Vec<f64>,
    qpos0: Vec<f64>,
    keys: Vec<Vec<f64>>,
    contacts: Vec<Contact>,
}

#[derive(Deserialize)]
struct Body {
    parent: usize,
    weld: usize,
    pose: [f64; 7],
    mass: f64,
    com: [f64; 3],
    tensor: [f64; 9],
    invweight0: [f64; 2],
}

#[derive(Deserialize)]
struct Joint {
    kind: usize,
    place: [f64; 6],
    range: Option<[f64; 2]>,
    stiffness: f64,
    springref: f64,
}

#[derive(Deserialize)]
struct Geom {
    kind: usize,
    pose: [f64; 7],
    size: [f64; 3],
    rbound: f64,
}

#[derive(Deserialize)]
struct Contact {
    geom: [usize; 2],
    condim: usize,
    friction: [f64; 5],
    solref: [f64; 2],
    solreffriction: [f64; 2],
    solimp: [f64; 5],
    margin: f64,
}

/// MuJoCo and Penny add up the same few numbers in another order: a few hundred roundings at most.
const TOLERANCE: f64 = 1e-12;
/// MuJoCo takes the shell of an ellipsoid as a difference of two solids that differ by 1e-6: ten digits are left.
const SHELL_ELLIPSOID: f64 = 1e-8;

/// Collects what differs, so that one run shows all of it.
struct Compare {
    place: String,
    tolerance: f64,
    differences: Vec<String>,
}

impl Compare {
    /// Largest difference, relative to the largest number of the group.
    fn numbers(&mut self, what: &str, penny: &[f64], mujoco: &[f64]) {
        let scale = mujoco.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        self.scaled(what, penny, mujoco, scale);
    }

    fn scaled(&mut self, what: &str, penny: &[f64], mujoco: &[f64], scale: f64) {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= self.tolerance * scale.max(1e-9);
        if penny.len() != mujoco.len() || !penny.iter().zip(mujoco).all(near) {
            self.differences.push(format!("{}: {what} {penny:?}, MuJoCo {mujoco:?}", self.place));
        }
    }

    /// What comes from solving with M, which costs as many digits as its condition number has.
    fn solved(&mut self, what: &str, penny: f64, mujoco: f64, scale: f64, condition: f64) {
        let tolerance = self.tolerance;
        self.tolerance = tolerance.max(condition * f64::EPSILON);
        self.scaled(what, &[penny], &[mujoco], scale);
        self.tolerance = tolerance;
    }

    fn same<T: PartialEq + std::fmt::Debug>(&mut self, what: &str, penny: T, mujoco: T) {
        if penny != mujoco {
            self.differences.push(format!("{}: {what} {penny:?}, MuJoCo {mujoco:?}", self.place));
        }
    }

    /// Poses; a quaternion and its negative are the same turn.
    fn pose(&mut self, pos: &Vector3<f64>, quat: &UnitQuaternion<f64>, mujoco: &[f64; 7]) {
        self.scaled("pos", pos.as_slice(), &mujoco[..3], pos.norm().max(1.0));
        let theirs = Quaternion::new(mujoco[3], mujoco[4], mujoco[5], mujoco[6]);
        let sign = quat.coords.dot(&theirs.coords).signum();
        self.numbers("quat", (quat.coords * sign).as_slice(), theirs.coords.as_slice());
    }
}

/// Compiles text as if it were that file of the repository, whose neighbours it may include.
fn model(name: &str, xml: &str) -> Model {
    match penny::parse(&crate::file(name).to_string_lossy(), xml) {
        Ok(scene) => scene.model,
        Err(failure) => panic!("{name}: {failure}\n{xml}"),
    }
}

fn golden() -> Golden {
    serde_json::from_str(include_str!("../golden/compile.json")).expect("golden file")
}

#[test]
fn bodies_joints_and_geoms_are_mujocos() {
    let golden = golden();
    assert!(golden.scenes.len() >= 60, "only {} scenes", golden.scenes.len());
    let mut differences = Vec::new();
    for scene in &golden.scenes {
        let tolerance = if scene.name == "ellipsoid, shell true" { SHELL_ELLIPSOID } else { TOLERANCE };
        let mut compare = Compare { place: scene.name.clone(), tolerance, differences: Vec::new() };
        let model = model(&scene.name, &scene.xml);
        compare_bodies(&mut compare, scene, &model);
        compare_joints(&mut compare, scene, &model);
        compare_geoms(&mut compare, scene, &model);
        differences.append(&mut compare.differences);
    }
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}

fn compare_bodies(compare: &mut Compare, scene: &Scene, model: &Model) {
    compare.same("number of bodies", model.bodies.len(), scene.bodies.len());
    for (i, (ours, theirs)) in model.bodies.iter().zip(&scene.bodies).enumerate() {
        compare.place = format!("{}, body {i}", scene.name);
        compare.same("parent", ours.parent, theirs.parent);
        compare.same("weld", ours.weld, theirs.weld);
        compare.pose(&ours.pos, &ours.quat, &theirs.pose);
        if i == 0 {
            continue; // MuJoCo gives the world a mass where geoms have some; nothing asks for it.
        }
        compare.numbers("mass", &[ours.mass], &[theirs.mass]);
        compare.scaled("com", ours.ipos.as_slice(), &theirs.com, 1.0);
        let r = ours.iquat.to_rotation_matrix().into_inner();
        let tensor = r * Matrix3::from_diagonal(&ours.inertia) * r.transpose();
        compare.numbers("tensor", tensor.transpose().as_slice(), &theirs.tensor);
        // What cannot move in a direction has weight 0 there, up to rounding of what it can do elsewhere.
        let scale = theirs.invweight0[0].max(theirs.invweight0[1]);
        for k in 0..2 {
            let own = if theirs.invweight0[k] > 1e-9 * scale { theirs.invweight0[k] } else { scale };
            compare.solved("invweight0", ours.invweight0[k], theirs.invweight0[k], own, scene.condition);
        }
    }
}

fn compare_joints(compare: &mut Compare, scene: &Scene, model: &Model) {
    compare.place = scene.name.clone();
    compare.same("number of joints", model.joints.len(), scene.joints.len());
    compare.numbers("qpos0", &model.qpos0, &scene.qpos0);
    for (i, (dof, theirs)) in model.dofs.iter().zip(&scene.dof_invweight0).enumerate() {
        compare.solved(&format!("dof {i} invweight0"), dof.invweight0, *theirs, *theirs, scene.condition);
    }
    let keys: Vec<Vec<f64>> = model.keyframes.iter().map(|k| [&k.qpos[..], &k.qvel, &k.ctrl].concat()).collect();
    compare.same("number of keyframes", keys.len(), scene.keys.len());
    for (ours, theirs) in keys.iter().zip(&scene.keys) {
        compare.numbers("keyframe", ours, theirs);
    }
    for (i, (ours, theirs)) in model.joints.iter().zip(&scene.joints).enumerate() {
        compare.place = format!("{}, joint {i}", scene.name);
        compare.same("kind", ours.kind as usize, theirs.kind);
        if theirs.kind > 1 {
            compare.scaled("pos", ours.pos.as_slice(), &theirs.place[..3], 1.0);
            compare.numbers("axis", ours.axis.as_slice(), &theirs.place[3..]);
            compare.numbers("springref", &[ours.springref], &[theirs.springref]);
        }
        compare.same("has limits", ours.range.is_some(), theirs.range.is_some());
        compare.numbers("range", &ours.range.unwrap_or_default(), &theirs.range.unwrap_or_default());
        compare.numbers("stiffness", &[ours.stiffness], &[theirs.stiffness]);
    }
}

fn compare_geoms(compare: &mut Compare, scene: &Scene, model: &Model) {
    compare.place = scene.name.clone();
    compare.same("number of geoms", model.geoms.len(), scene.geoms.len());
    // MuJoCo numbers its shapes with two more in between: height field 1, and none of ours beyond box 6.
    let kinds = [0, 2, 3, 4, 5, 6];
    for (i, (ours, theirs)) in model.geoms.iter().zip(&scene.geoms).enumerate() {
        compare.place = format!("{}, geom {i}", scene.name);
        compare.same("kind", kinds[ours.kind as usize], theirs.kind);
        compare.pose(&ours.pos, &ours.quat, &theirs.pose);
        compare.numbers("size", ours.size.as_slice(), &theirs.size);
        compare.numbers("rbound", &[ours.rbound], &[theirs.rbound]);
    }
}

#[test]
fn contact_parameters_are_mujocos() {
    let mut differences = Vec::new();
    let mut seen = 0;
    for scene in golden().scenes {
        let model = model(&scene.name, &scene.xml);
        let mut compare = Compare { place: String::new(), tolerance: TOLERANCE, differences: Vec::new() };
        for contact in &scene.contacts {
            seen += 1;
            compare.place = format!("{}, geoms {:?}", scene.name, contact.geom);
            let Some(pair) = model.pairs.listed.iter().find(|p| p.geom == contact.geom) else {
                compare.same("listed", false, true);
                continue;
            };
            let mix = &model.mixes[pair.mix];
            compare.same("condim", mix.condim, contact.condim);
            compare.numbers("friction", &mix.friction, &contact.friction);
            compare.numbers("solref", &mix.solref, &contact.solref);
            compare.numbers("solreffriction", &mix.solreffriction, &contact.solreffriction);
            compare.numbers("solimp", &mix.solimp, &contact.solimp);
            compare.numbers("margin", &[mix.margin], &[contact.margin]);
        }
        differences.append(&mut compare.differences);
    }
    assert!(seen > 200, "only {seen} contacts compared");
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}

/// In these scenes everything that may touch does, in one point each: MuJoCo's contacts are the list of pairs.
#[test]
fn pairs_and_their_order_are_mujocos() {
    let everything_touches = ["mixed parameters", "bit masks", "pairs and excludes", "override", "contacts disabled"];
    let mut scenes = 0;
    for scene in golden().scenes {
        if everything_touches.iter().any(|name| scene.name.starts_with(name)) {
            let model = model(&scene.name, &scene.xml);
            let ours: Vec<[usize; 2]> = model.pairs.listed.iter().map(|p| p.geom).collect();
            let theirs: Vec<[usize; 2]> = scene.contacts.iter().map(|c| c.geom).collect();
            assert_eq!(ours, theirs, "{}", scene.name);
            scenes += 1;
        }
    }
    assert!(scenes >= 14, "only {scenes} scenes");
}

fn body_of(geoms: &str) -> String {
    format!("<mujoco><worldbody><geom type='plane' size='1 1 1'/>{geoms}</worldbody></mujoco>")
}

#[test]
fn many_geoms_are_swept_with_the_parameters_of_listed_ones() {
    let ball = |i: usize| {
        let friction = 0.1 * (i % 5) as f64;
        format!("<body pos='{i} 0 0'><freejoint/><geom size='0.1' friction='{friction}' solmix='{}'/></body>", i % 3)
    };
    let scene = |n: usize| model("balls", &body_of(&(1..=n).map(ball).collect::<String>()));
    let (few, many) = (scene(24), scene(25));
    assert_eq!((few.pairs.listed.len(), few.pairs.swept.len()), (24 + 24 * 23 / 2, 0));
    assert_eq!((many.pairs.listed.len(), many.pairs.swept.len()), (25, 25));
    for pair in few.pairs.listed.iter().filter(|p| p.geom[0] > 0) {
        let [a, b] = pair.geom;
        let class = |g: usize| many.pairs.class[g] as usize;
        let classes = many.pairs.mix_table.len().isqrt();
        let mix = many.pairs.mix_table[class(a) * classes + class(b)] as usize;
        assert_eq!(many.mixes[mix], few.mixes[pair.mix], "geoms {a} and {b}");
    }
    assert!(many.mixes.len() <= 15 * 15 + 15, "{} mixes for 15 kinds of geom", many.mixes.len());
}

#[test]
fn a_free_body_and_what_is_welded_to_it_are_one() {
    let whole = model(
        "whole",
        &body_of(
            "<body><freejoint/><geom type='box' size='.1 .2 .3' pos='1 0 0'/><geom size='.2' pos='0 1 0'/></body>",
        ),
    );
    let welded = model(
        "welded",
        &body_of(
            "<body><freejoint/><geom type='box' size='.1 .2 .3' pos='1 0 0'/>
           <body pos='0 .4 0' euler='20 30 40'><body euler='0 0 10'/></body>
           <body pos='0 .5 0'><geom size='.2' pos='0 .5 0'/></body></body>",
        ),
    );
    let (a, b) = (whole.trees[0].free.as_ref().unwrap(), welded.trees[0].free.as_ref().unwrap());
    let tensor = |f: &penny::model::FreeBody| f.axes * Matrix3::from_diagonal(&f.inertia) * f.axes.transpose();
    // Exact up to roundings.
    assert!((a.mass - b.mass).abs() < 1e-12 * a.mass && (a.com - b.com).norm() < 1e-14);
    assert!((tensor(a) - tensor(b)).norm() < 1e-13 * tensor(a).norm());
    assert!((a.axes.determinant() - 1.0).abs() < 1e-14, "axes must be right-handed");
}

#[test]
fn only_a_bare_free_joint_has_the_closed_form() {
    let free = |joint: &str| {
        model("free", &body_of(&format!("<body>{joint}<geom size='.1'/></body>"))).trees[0].free.is_some()
    };
    assert!(free("<freejoint/>") && free("<joint type='free'/>"));
    for attribute in ["armature", "damping", "stiffness", "frictionloss"] {
        assert!(!free(&format!("<joint type='free' {attribute}='0.1'/>")), "{attribute} needs the general path");
    }
    assert!(!free("<joint type='ball'/>"));
}

#[test]
fn the_plan_holds_what_the_scene_requires_and_no_more() {
    let nothing = model("empty", "<mujoco/>");
    assert_eq!(nothing.requires, Requirements::default());
    let ball = model("ball", &body_of("<body pos='0 0 1'><freejoint/><geom size='.1' condim='1'/></body>"));
    assert_eq!((ball.requires.free_trees, ball.requires.articulated_trees, ball.requires.pairs), (1, 0, 1));
    assert_eq!((ball.requires.condim, ball.requires.coupled, ball.requires.colliding_geoms.len()), (3, false, 2));
    let slider =
        model("slider", &body_of("<body pos='0 0 1'><joint type='slide'/><geom size='.1' contype='0'/></body>"));
    assert_eq!((slider.requires.rotating_trees, slider.requires.articulated_trees), (0, 1));
    let arm = model("arm", "<mujoco><worldbody><body><joint range='-30 30' stiffness='1' damping='2' armature='3'/>
        <geom size='.1'/><body pos='1 0 0'><joint frictionloss='0.1'/><geom size='.1'/></body></body></worldbody></mujoco>");
    let requires = &arm.requires;
    assert_eq!(
        (requires.coupled, requires.largest_matrix, requires.pairs, requires.condim),
        (true, 2, 0, 0),
        "parent and child do not touch"
    );
    assert_eq!(
        (requires.limits, requires.springs, requires.dampers, requires.armature, requires.frictionloss),
        (1, 1, 1, 1, 1)
    );
}

#[test]
fn tutorial_parameters_come_from_custom_numbers() {
    let scene = model(
        "custom",
        "<mujoco><custom><numeric name='penny.k' data='2500'/><numeric name='penny.mu_roll' data='0'/>
        <text name='penny.contact' data='tutorial'/></custom></mujoco>",
    );
    assert_eq!((scene.tutorial.k, scene.tutorial.c, scene.tutorial.mu_roll), (Some(2500.0), None, Some(0.0)));
    assert_eq!(scene.contact_law(), Some("tutorial"));
}
/// So that no pair is ever missed in silence. Planes alone never move, and never meet.
#[test]
fn every_two_shapes_that_can_meet_have_a_collider() {
    use penny::model::GeomKind::*;
    let kinds = [Plane, Sphere, Capsule, Ellipsoid, Cylinder, Box];
    for (i, &a) in kinds.iter().enumerate() {
        for &b in kinds[i..].iter().filter(|&&b| b != Plane) {
            assert!(penny::collision::collider(a, b).is_some(), "{a:?} and {b:?}");
        }
    }
}

/// Any number of a file may be absurd: the answer is a model or a report, never a panic.
#[test]
fn absurd_numbers_never_panic() {
    let absurd = ["0", "-1", "1e-300", "1e300", "-1e300", "1e17", "4e9"];
    let scenes = golden().scenes;
    let mut refused = 0;
    for scene in scenes.iter().filter(|s| s.xml.len() < 2500) {
        let words: Vec<&str> = scene.xml.split_inclusive([' ', '"']).collect();
        let numbers = words.iter().enumerate().filter(|(_, w)| w.trim_end_matches([' ', '"']).parse::<f64>().is_ok());
        for (k, (i, word)) in numbers.enumerate() {
            let end = word.len() - 1;
            let wrong = format!("{}{}", absurd[k % absurd.len()], &word[end..]);
            let xml: String = words.iter().enumerate().map(|(j, w)| if j == i { wrong.as_str() } else { w }).collect();
            refused += usize::from(penny::parse("absurd", &xml).is_err());
        }
    }
    assert!(refused > 100, "only {refused} absurd scenes refused");
}

/// Two geoms, neither along the axes of the whole: MuJoCo's `body_iquat`, its sign too, of which a sensor of the body's frame shows all.
#[test]
fn principal_axes_are_mujocos_in_order_and_direction() {
    for (euler, y, mujoco) in [
        ("10 20 30", 0.1, [0.90874352914, 0.10441305319, 0.01776025231, 0.40369256372]),
        ("90 150 70", 0.3, [0.55743835758, 0.15192016323, -0.58529615214, 0.56886831147]),
    ] {
        let geoms = format!(r#"<geom type="box" size=".1 .2 .3" euler="{euler}"/><geom size=".1" pos=".2 {y} -.3"/>"#);
        let xml = format!("<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>");
        let found = penny::math::wxyz(&model("axes", &xml).bodies[1].iquat);
        assert!(found.iter().zip(mujoco).all(|(f, m)| (f - m).abs() < 1e-10), "{found:?}");
    }
    // Of equal moments the axes stay where they are.
    let geoms = r#"<geom size=".1"/><geom size=".2" euler="10 20 30"/>"#;
    let xml = format!("<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>");
    assert_eq!(penny::math::wxyz(&model("axes", &xml).bodies[1].iquat), [1.0, 0.0, 0.0, 0.0]);
}

/// A crank and its slider on one body: their distance changes by rounding only, and the damping of such a servo was 1e16.
#[test]
fn a_servo_that_moves_nothing_damps_nothing() {
    let xml = r#"<mujoco><worldbody><body pos=".3 .2 .1" euler="20 30 40"><joint name="j" axis="1 2 3"/>
        <geom size=".1" pos=".1 .2 .3"/><site name="s" pos=".1 .05 .2" euler="10 20 3"/><site name="c" pos=".2 .15 .1"/>
        </body></worldbody><actuator><position slidersite="s" cranksite="c" cranklength=".3" kp="2" dampratio="1"/>
        <position joint="j" gear="1e-6" kp="2" dampratio="1"/></actuator></mujoco>"#;
    let model = model("servo", xml);
    // MuJoCo 4.0.0 gives the first 0, too.
    assert_eq!(model.actuators[0].bias, [0.0, -2.0, 0.0]);
    assert!(model.actuators[1].bias[2] < -1e5, "{:?}", model.actuators[1].bias);
}

/// A joint's `springdamper` says its own damping; an actuator's comes on top, as MuJoCo's `dof_damping` and
/// `actuator_damping` do.
#[test]
fn an_actuator_damps_a_springdamper_too() {
    let damping = |joint: &str, actuator: &str| {
        let xml = format!(
            r#"<mujoco><worldbody><body><joint name="j" springdamper=".1 1" {joint}/><geom size=".1" pos=".3 0 0"/></body></worldbody>
            <actuator><motor joint="j" {actuator}/></actuator></mujoco>"#
        );
        model("springdamper", &xml).dofs[0].damping
    };
    let alone = damping("", "");
    assert!((alone - 7.87492558).abs() < 1e-8, "{alone}");
    assert_eq!(damping(r#"damping="1""#, ""), alone);
    assert!((damping("", r#"damping=".5" gear="2""#) - alone - 2.0).abs() < 1e-12);
}

/// What MuJoCo 4.0.0 makes of a hinge's actuator (the first three numbers of `gainprm` and `biasprm`) by the defaults of its
/// class and of the class around.
#[test]
fn actuators_have_from_defaults_what_mujoco_gives_them() {
    let servo = r#"<position kp="5" kv="2" ctrlrange="-1 1"/>"#;
    let cases = [
        // A shortcut has its numbers from the same shortcut, and from no other.
        (servo, "", "position", [5.0, 0.0, 0.0], [0.0, -5.0, -2.0]),
        (servo, "", "velocity", [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
        (servo, "", "intvelocity", [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        (servo, r#"<velocity kv="3"/>"#, "position", [5.0, 0.0, 0.0], [0.0, -5.0, -2.0]),
        (servo, r#"<muscle ctrlrange="-1 1"/>"#, "motor", [1.0, 0.0, 0.0], [0.0; 3]),
        (r#"<cylinder diameter="2" ctrlrange="-1 1"/>"#, "", r#"cylinder area="3""#, [3.0, 0.0, 0.0], [0.0; 3]),
        // `general` from every one, and every one from `general` with its kind of gain.
        (servo, "", "general", [5.0, 0.0, 0.0], [0.0, -5.0, -2.0]),
        (servo, r#"<general gainprm="7"/>"#, "position", [7.0, 0.0, 0.0], [0.0, -7.0, -2.0]),
        (r#"<general gainprm="6" ctrlrange="-1 1"/>"#, "", "position", [6.0, 0.0, 0.0], [0.0, -6.0, 0.0]),
        (servo, r#"<general gaintype="affine"/>"#, "position", [5.0, 0.0, 0.0], [0.0, -5.0, -2.0]),
        // What the element says itself takes the place of its counterpart.
        (r#"<position dampratio="1" ctrlrange="-1 1"/>"#, "", r#"position kv="9""#, [1.0, 0.0, 0.0], [0.0, -1.0, -9.0]),
        (r#"<position inheritrange="1"/>"#, "", r#"position ctrlrange="-1 1""#, [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
    ];
    for (outer, inner, actuator, gain, bias) in cases {
        let xml = format!(
            r#"<mujoco><default>{outer}<default class="c">{inner}</default></default>
            <worldbody><body><joint name="j" range="-90 90"/><geom size=".1"/></body></worldbody>
            <actuator><{actuator} class="c" joint="j"/></actuator></mujoco>"#
        );
        let model = model("actuator", &xml);
        let flat = penny::parse("actuator.xml", &xml).unwrap_or_else(|failure| panic!("{failure}"));
        let flat = penny::compile::canonical(&flat.document, std::path::Path::new("."));
        for model in [model, self::model("flat", &flat)] {
            let found = &model.actuators[0];
            assert_eq!((found.gain, found.bias), (gain, bias), "{xml}\n{flat}");
            assert_eq!(found.ctrlrange, Some([-1.0, 1.0]), "{xml}\n{flat}");
        }
    }
    // Without numbers a damper does not damp.
    let damper = r#"<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
        <actuator><damper joint="j" ctrlrange="0 1"/></actuator></mujoco>"#;
    assert_eq!(model("damper", damper).actuators[0].gain, [0.0; 3]);
}

/// What a class gives to actuators of another kind and they cannot have, as MuJoCo 4.0.0 takes and refuses it.
#[test]
fn actuators_of_other_classes_are_taken_as_by_mujoco() {
    let scene = |class: &str, actuator: &str| {
        format!(
            r#"<mujoco><default>{class}</default><worldbody><body><joint name="j" range="-90 90"/><geom size=".1"/></body></worldbody>
            <actuator><{actuator} joint="j"/></actuator></mujoco>"#
        )
    };
    // A range is inherited by servos only.
    let servo = r#"<position kp="3" inheritrange="1"/>"#;
    let range = |actuator: &str| model("servo", &scene(servo, actuator)).actuators[0].ctrlrange.is_some();
    assert_eq!(["general", r#"general gainprm="4""#].map(range), [true, false]);
    let refused = |class: &str, actuator: &str| penny::parse("class.xml", &scene(class, actuator)).is_err();
    let backwards = r#"<general gaintype="affine" gainprm="0 0 2" ctrlrange="0 1"/>"#;
    assert!(refused(backwards, "damper") && !refused(backwards, r#"damper kv="1""#));
    // Damping in two forms, whatever the numbers; what the actuator says takes the place of what its class says.
    assert!(refused(r#"<position kv="1" dampratio="1"/>"#, "motor"));
    assert!(
        refused("", r#"position kv="0" dampratio="1""#)
            && !refused(r#"<position kv="1"/>"#, r#"position dampratio="1""#)
    );
    // So is a range in two forms, and one that a damper cannot have. Of a `general` the joint's range counts.
    assert!(refused(r#"<position inheritrange="1" ctrlrange="0 1"/>"#, "motor"));
    assert!(refused(r#"<intvelocity inheritrange="1" actrange="0 1"/>"#, "motor"));
    assert!(refused(r#"<general inheritrange="1" ctrlrange="0 1"/>"#, "position"));
    assert!(refused(r#"<damper ctrlrange="-1 1"/>"#, "motor") && !refused(r#"<damper ctrlrange="0 1"/>"#, "motor"));
    let both = r#"general inheritrange="1" ctrlrange="0 1" biastype="affine" biasprm="0 -1""#;
    let half_turn = std::f64::consts::FRAC_PI_2;
    assert_eq!(model("both", &scene("", both)).actuators[0].ctrlrange, Some([-half_turn, half_turn]));
    // Like a damper, adhesion asks for a range, of all in its class.
    assert!(refused(r#"<adhesion gain="2"/>"#, "motor") && !refused(r#"<adhesion ctrlrange="0 1"/>"#, "motor"));
}

/// Ranges that MuJoCo 4.0.0 refuses, and one that it takes against what is written.
#[test]
fn ranges_without_their_meaning_are_refused() {
    let scene = |tendon: &str, actuator: &str| {
        format!(
            r#"<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
            <tendon><fixed name="t" {tendon}><joint joint="j" coef="1"/></fixed></tendon>
            <actuator><intvelocity tendon="t" {actuator}/></actuator></mujoco>"#
        )
    };
    let refused = |tendon: &str, actuator: &str| penny::parse("range.xml", &scene(tendon, actuator)).is_err();
    for range in ["0.5 1", "-2 -1"] {
        assert!(refused(&format!(r#"actuatorfrcrange="{range}""#), ""));
        assert!(!refused(&format!(r#"actuatorfrcrange="{range}" actuatorfrclimited="false""#), ""));
    }
    assert!(!refused(r#"actuatorfrcrange="0 1""#, "") && !refused(r#"actuatorfrcrange="-1 0""#, ""));
    // Only a `general` can be unlimited against its range.
    let unlimited = |class: &str, actuator: &str| {
        let xml = format!(
            r#"<mujoco><default>{class}</default><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
            <actuator><{actuator} joint="j"/></actuator></mujoco>"#
        );
        model("unlimited", &xml).actuators[0].actrange.is_none()
    };
    let general = r#"<general actrange="-1 1" actlimited="false"/>"#;
    let shortcut = r#"<intvelocity actrange="-1 1" actlimited="false"/>"#;
    let filter = r#"general dyntype="filter""#;
    assert!(unlimited(general, filter) && !unlimited(general, "cylinder"));
    assert!(!unlimited(shortcut, filter) && !unlimited(shortcut, "cylinder") && !unlimited(shortcut, "intvelocity"));
    // There the activation would be limited all the same.
    assert!(refused("", r#"actrange="-1 1" actlimited="false""#));
    assert!(!refused("", r#"actrange="-1 1" actlimited="true""#) && !refused("", r#"actlimited="false""#));
}

/// A body without geoms in a frame, which `boundmass` makes heavy: where, as MuJoCo 4.0.0 has it.
#[test]
fn mass_by_boundmass_is_where_mujoco_has_it() {
    let xml = r#"<mujoco><compiler boundmass="2" boundinertia=".1"/><worldbody>
        <frame pos="1 2 3" euler="0 0 90"><body pos=".1 .2 .3" euler="90 0 0"><joint/></body></frame></worldbody></mujoco>"#;
    let model = model("boundmass", xml);
    let body = &model.bodies[1];
    assert_eq!((body.mass, body.ipos), (2.0, Vector3::new(0.1, 0.2, 0.3)));
    let turned = penny::math::wxyz(&body.iquat);
    assert!(
        turned.iter().zip([0.5f64.sqrt(), 0.5f64.sqrt(), 0.0, 0.0]).all(|(f, m)| (f - m).abs() < 1e-15),
        "{turned:?}"
    );
}

/// What follows from axes and places of joints, and from what a tendon runs over, is found anew where they are changed.
#[test]
fn an_edited_scene_has_the_numbers_of_a_fresh_one() {
    let scene = |axis: &str, anchor: &str, site: &str, radius: f64| {
        let xml = format!(
            r#"<mujoco><worldbody><site name="w" pos="0 0 2"/><geom name="drum" size="{radius}" pos=".1 .1 1.6"/>
            <body pos="0 0 1"><joint axis="{axis}" pos="{anchor}"/><geom type="box" size=".1 .2 .3" pos=".2 .1 0"/>
            <body pos=".3 0 .2"><joint axis="1 0 0"/><geom size=".1" pos=".1 .1 0"/><site name="s" pos="{site}"/></body></body>
            </worldbody><tendon><spatial name="t" armature="0"><site site="w"/><geom geom="drum"/><site site="s"/></spatial></tendon></mujoco>"#
        );
        model("edited", &xml)
    };
    let numbers = |model: &Model| {
        let tendon = &model.tendons[0];
        let dofs = model.dofs.iter().map(|d| d.invweight0);
        let bodies = model.bodies.iter().flat_map(|b| b.invweight0);
        [tendon.length0, tendon.invweight0].into_iter().chain(dofs).chain(bodies).collect::<Vec<f64>>()
    };
    let fresh = numbers(&scene("0 .6 .8", ".1 0 .05", ".3 .1 .2", 0.2));
    let mut edited = scene("0 0 1", "0 0 0", ".1 0 0", 0.1);
    edited
        .edit(|m| {
            (m.joints[0].axis, m.joints[0].pos) = (Vector3::new(0.0, 0.6, 0.8), Vector3::new(0.1, 0.0, 0.05));
            m.sites[1].pos = Vector3::new(0.3, 0.1, 0.2);
            m.geoms[0].size.x = 0.2;
        })
        .expect("a change");
    let found = numbers(&edited);
    assert!(found.iter().zip(&fresh).all(|(f, g)| (f - g).abs() < 1e-12 * g.abs().max(1.0)), "{found:?}\n{fresh:?}");
}

/// An actuator's damping and armature act times gear², and points and frames that a file leaves to the pose at `qpos0` follow it, as
/// MuJoCo's do after `mj_setConst`.
#[test]
fn gears_and_anchors_of_an_edited_scene_are_those_of_a_fresh_one() {
    let scene = |pos: &str, gear: f64| {
        let xml = format!(
            r#"<mujoco><worldbody><body name="a" pos="0 0 1"><joint name="j" armature=".1"/><geom size=".1" pos=".2 0 0"/></body>
            <body name="b" pos="{pos}"><joint name="k" axis="0 1 0"/><geom size=".1" pos=".2 0 0"/></body></worldbody>
            <equality><connect body1="a" body2="b" anchor="0 0 .1"/><weld body1="a" body2="b"/>
            <weld body1="a" body2="b" relpose="0 0 .1 1 0 0 0"/></equality>
            <tendon><fixed name="t"><joint joint="j" coef="1"/><joint joint="k" coef="2"/></fixed></tendon>
            <actuator><motor joint="j" gear="{gear}" armature=".5" damping=".3"/>
            <motor tendon="t" gear="{gear}" armature=".2" damping=".7"/></actuator></mujoco>"#
        );
        model("edited", &xml)
    };
    let fresh = scene(".3 .5 1.2", 3.0);
    let mut edited = scene("0 .5 1", 2.0);
    let change = |gear: f64| {
        move |m: &mut penny::model::Parts| {
            m.bodies[2].pos = Vector3::new(0.3, 0.5, 1.2);
            m.actuators.iter_mut().for_each(|a| a.gear[0] = gear);
        }
    };
    edited.edit(change(3.0)).expect("a change");
    let kinds = |model: &Model| model.equalities.iter().map(|e| e.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&edited), kinds(&fresh));
    let close = |found: f64, right: f64| assert!((found - right).abs() < 1e-12, "{found} {right}");
    for (dof, right) in edited.dofs.iter().zip(&fresh.dofs) {
        close(dof.armature, right.armature);
        close(dof.damping, right.damping);
        close(dof.invweight0, right.invweight0);
    }
    close(edited.tendons[0].armature, fresh.tendons[0].armature);
    close(edited.tendons[0].damping[0], fresh.tendons[0].damping[0]);
    edited.edit(change(0.0)).expect("a change");
    close(edited.dofs[0].armature, 0.1);
}

/// MuJoCo has a body for simple only where its parent is the world or stands directly in it, and what slides comes before what
/// turns. Numbers: MuJoCo 4.0.0.
#[test]
fn a_body_that_stands_deeper_or_turns_first_is_not_simple() {
    let box_on = |mount: [&str; 2], [first, last]: [&str; 2]| {
        format!(
            "<mujoco><option integrator='implicitfast' density='10' viscosity='10'/><worldbody>{}<body>{first}
            <joint type='slide' axis='1 0 0' damping='3'/><joint type='slide' axis='0 0 1' armature='3'/>{last}
            <geom type='box' size='.1 .2 .3' mass='2'/></body>{}</worldbody></mujoco>",
            mount[0], mount[1]
        )
    };
    let (deep, hinge) = (["<body><body>", "</body></body>"], "<joint axis='0 1 0'/>");
    let slides = model("slides", &box_on(deep, [""; 2]));
    let weights = [slides.dofs[0].invweight0, slides.dofs[1].invweight0, slides.bodies[3].invweight0[0]];
    assert!(weights.iter().zip([0.5, 0.2, 0.7 / 3.0]).all(|(w, right)| (w - right).abs() < 1e-15), "{weights:?}");
    let cases = [
        (box_on(deep, ["", hinge]), [0.1329341167430722, 0.19732571462239618, 0.05328551176141764]),
        (box_on([""; 2], [hinge, ""]), [0.3709122665444354, 0.11901695238277268, 0.21371863168572253]),
    ];
    for (xml, right) in cases {
        let mut sim = Sim::new(&xml);
        sim.state.qvel.fill(1.0);
        sim.run(0.1);
        assert!(sim.state.qvel.iter().zip(right).all(|(v, right)| (v - right).abs() < 1e-12), "{:?}", sim.state.qvel);
    }
}

/// A free joint of a file has one number for all six dofs; a change may give one of them its own. Numbers: exact.
#[test]
fn one_dof_of_a_free_joint_can_be_changed() {
    let xml = "<mujoco><option gravity='0 0 -10'/><worldbody><body><freejoint/><geom size='.1' mass='2'/></body></worldbody></mujoco>";
    let mut sim = Sim::new(xml);
    sim.model.edit(|m| (m.dofs[1].damping, m.dofs[2].armature) = (4.0, 3.0)).expect("a change");
    assert_eq!((sim.model.requires.dampers, sim.model.requires.armature), (1, 1));
    sim.state.qvel[1] = 1.0;
    let h = sim.method.timestep;
    sim.step();
    // The damper is implicit: (m + h d) a = −d v. The weight, 20 N, moves 5 kg.
    let right = [0.0, 1.0 - h * 4.0 / (2.0 + h * 4.0), -4.0 * h];
    assert!(sim.state.qvel.iter().zip(right).all(|(v, right)| (v - right).abs() < 1e-15), "{:?}", sim.state.qvel);
}

/// As MuJoCo 4.0.0: half a turn that came through single precision is still half a turn about X, not about −Y.
#[test]
fn directions_are_the_same_and_none_below_a_ten_millionth() {
    let load = |text: &str| penny::parse("scene.xml", &format!("<mujoco><worldbody>{text}</worldbody></mujoco>"));
    let of = |zaxis: &str| load(&format!("<body zaxis='{zaxis}'/>")).unwrap().model.bodies[1].quat;
    assert_eq!(of("-8.742278e-08 0 -1"), of("0 0 -1"));
    assert_eq!(of("0 -4.371139e-08 1"), of("0 0 1"));
    assert_ne!(of("2e-7 0 1"), of("0 0 1"));
    for short in [
        "<body zaxis='0 0 {}'/>",
        "<body axisangle='0 {} 0 30'/>",
        "<body xyaxes='1 0 0 1 {} 0'/>",
        "<body><joint axis='{} 0 0'/><geom size='1'/></body>",
        "<geom type='capsule' size='1' fromto='0 0 0 0 0 {}'/>",
    ] {
        assert!(load(&short.replace("{}", "9e-8")).is_err_and(|e| e.to_string().contains("no-direction")), "{short}");
        assert!(load(&short.replace("{}", "1.1e-7")).is_ok(), "{short}");
    }
}
