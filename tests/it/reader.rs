//! The reader: it knows all names of MJCF 4.0.0, and what it reads means what MuJoCo reads.

use std::collections::{BTreeMap, BTreeSet};

use penny::mjcf::schema::{self, Kind, Status};
use penny::mjcf::spec::{self, GeomKind};
use penny::mjcf::{self, Spec};
use serde::Deserialize;
use serde_json::{Value, json};

/// A row of MuJoCo's own schema.
#[derive(Deserialize)]
struct Row {
    element: String,
    parents: Vec<String>,
    attributes: Vec<String>,
}

fn rows() -> Vec<Row> {
    serde_json::from_str(include_str!("../golden/names.json")).unwrap()
}

/// Elements whose content is not looked at: they are refused as a whole.
fn refused(element: &str) -> bool {
    let opaque = |row: &schema::Element| row.silent == "*" || matches!(row.status, Status::Unsupported(..));
    schema::SCHEMA.iter().filter(|row| row.is(element)).all(opaque)
}

#[test]
fn every_name_of_mjcf_is_known() {
    let mut unknown = Vec::new();
    for row in rows() {
        // `instance` stands only in the plugins of `extension`, which is refused.
        for parent in row.parents.iter().filter(|_| row.element != "instance").filter(|parent| !refused(parent)) {
            let place = format!("{parent}/{}", row.element);
            let Some(known) = schema::find(parent, &row.element) else {
                unknown.push(place);
                continue;
            };
            for name in &row.attributes {
                let in_place =
                    known.attribute(name).map(|a| parent != "default" || row.element == "default" || a.in_default);
                if !in_place.unwrap_or(known.is_silent(name)) {
                    unknown.push(format!("{place} {name}"));
                }
            }
        }
    }
    assert!(unknown.is_empty(), "valid names that Penny would call unknown:\n{}", unknown.join("\n"));
}

#[test]
fn no_name_is_invented() {
    // What MuJoCo's schema does not list: what it expands before looking at the schema, and what it has removed.
    let outside = ["include", "frame", "replicate", "composite", "worldbody"];
    let theirs: BTreeSet<(String, String)> =
        rows().into_iter().flat_map(|row| row.attributes.into_iter().map(move |a| (row.element.clone(), a))).collect();
    let mut invented = Vec::new();
    for row in schema::SCHEMA.iter().filter(|row| row.silent != "*") {
        for element in row.names.split_whitespace().filter(|e| !outside.contains(e)) {
            // Sensors share one row, so a name counts if any of them has it.
            let family: Vec<&str> = row.names.split_whitespace().collect();
            for name in row.attribute_names() {
                if !family.iter().any(|e| theirs.contains(&(e.to_string(), name.to_string()))) {
                    invented.push(format!("{element} {name}"));
                }
            }
        }
    }
    assert!(invented.is_empty(), "names that MuJoCo refuses:\n{}", invented.join("\n"));
}

#[test]
fn every_default_of_the_schema_fits_its_own_column() {
    for row in schema::SCHEMA {
        for column in row.typed_attributes() {
            let words: Vec<&str> = column.default.split_whitespace().collect();
            let fits = match column.kind {
                Kind::Keyword(words) => column.default.is_empty() || words.contains(&column.default),
                Kind::Numbers(_, max) => words.len() <= max && words.iter().all(|w| w.parse::<f64>().is_ok()),
                Kind::Integers(_, max) => words.len() <= max && words.iter().all(|w| w.parse::<i32>().is_ok()),
                _ => true,
            };
            assert!(fits, "{} {}: {:?}", row.names, column.name, column.default);
        }
    }
}

/// MuJoCo 4.0.0 refuses the first of each and reads the second.
#[test]
fn what_changes_no_motion_is_checked_like_the_rest() {
    let body = |inside: &str| format!("<worldbody><body><joint/><geom size='0.1'/>{inside}</body></worldbody>");
    let cases = [
        ("<option ls_iterations='1.5'/>", "<option ls_iterations='1'/>", "not-an-integer"),
        ("<option ccd_tolerance='1e-6 1'/>", "<option ccd_tolerance='1e-6'/>", "wrong-count"),
        ("<compiler usethread='yes'/>", "<compiler usethread='false'/>", "unknown-keyword"),
        (
            "<compiler><lengthrange mode='al'/></compiler>",
            "<compiler><lengthrange mode='all'/></compiler>",
            "unknown-keyword",
        ),
        ("<size nconmax='many'/>", "<size nconmax='100'/>", "not-an-integer"),
        ("<statistic extent='0'/>", "<statistic extent='2' center='0 0 1'/>", "out-of-range"),
        ("<visual><global offwidth='1e3'/></visual>", "<visual><global offwidth='1000'/></visual>", "not-an-integer"),
        (
            "<visual><headlight ambient='.1 .1'/></visual>",
            "<visual><headlight ambient='.1 .1 .1'/></visual>",
            "wrong-count",
        ),
        ("<visual><map zfar='far'/></visual>", "<visual><map zfar='inf'/></visual>", "not-a-number"),
        ("<visual><rgba fog='1 0 0'/></visual>", "<visual><rgba fog='1 0 0 1'/></visual>", "wrong-count"),
        (
            "<asset><texture name='t' builtin='cheker' width='8' height='8'/></asset>",
            "<asset><texture name='t' type='2d' builtin='checker' rgb1='1 0 0' width='8' height='8'/></asset>",
            "unknown-keyword",
        ),
        (
            "<asset><material name='m' shininess='high'/></asset>",
            "<asset><material name='m' rgba='1 0 0 1'/></asset>",
            "not-a-number",
        ),
        (&body("<light pos='0 0'/>"), &body("<light pos='0 0 1' dir='0 0 -1' type='directional'/>"), "wrong-count"),
        (&body("<camera resolution='640'/>"), &body("<camera resolution='640 480'/>"), "wrong-count"),
        (&body("<site rgba='1 0 0'/>"), &body("<site rgba='1 0 0 1' group='2'/>"), "wrong-count"),
        (&body("<site type='mesh'/>"), &body("<site type='box'/>"), "missing-attribute"),
        (&body("<joint group='a' axis='1 0 0'/>"), &body("<joint group='1' axis='1 0 0'/>"), "not-an-integer"),
        ("<sensor><rangefinder/></sensor>", "<sensor><clock interval='0.1'/></sensor>", "missing-attribute"),
    ];
    for (wrong, right, kind) in cases {
        let check = |inside: &str| penny::parse("scene.xml", &format!("<mujoco>{inside}</mujoco>"));
        assert!(check(right).is_ok(), "{right}");
        let Err(failure) = check(wrong) else { panic!("{wrong} is not refused") };
        assert!(failure.to_string().contains(kind), "{wrong}\n{failure}");
    }
}

/// What MuJoCo 4.0.0 takes of two things to act on, each the last in its order.
#[test]
fn an_actuator_acts_on_what_mujoco_takes_and_the_rest_is_told() {
    let targets = [
        ("joint", "joint='j'"),
        ("jointinparent", "jointinparent='j'"),
        ("tendon", "tendon='t'"),
        ("cranksite", "cranksite='s' slidersite='r' cranklength='1'"),
        ("site", "site='s'"),
    ];
    for (i, (lesser, ignored)) in targets.iter().enumerate() {
        for (_, taken) in targets[i + 1..].iter().filter(|(name, _)| (*lesser, *name) != ("cranksite", "site")) {
            let scene = |target: &str| {
                let text = format!(
                    "<mujoco><worldbody><body><joint name='j'/><geom size='0.1' pos='0.2 0 0'/><site name='s'/>
                     <site name='r' pos='0.1 0 0'/></body></worldbody>
                     <tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon>
                     <actuator><general {target}/></actuator></mujoco>"
                );
                penny::parse("scene.xml", &text).unwrap_or_else(|failure| panic!("{failure}"))
            };
            let (both, alone) = (scene(&format!("{ignored} {taken}")), scene(taken));
            assert_eq!(
                both.model.actuators[0].transmission, alone.model.actuators[0].transmission,
                "{ignored} {taken}"
            );
            let report = mjcf::render(&both.document, &both.warnings, false);
            assert!(report.contains(&format!("`{lesser}` is ignored")), "{report}");
            assert!(alone.warnings.is_empty());
        }
    }
}

/// As MuJoCo 4.0.0: what ties a replica to something outside is left out unless it is a contact, a sensor or a tendon of
/// several sites or joints; and what refers to it.
#[test]
fn what_refers_to_replicas_and_to_something_else_is_copied_as_in_mujoco() {
    let [crank, site] = ["cranksite='s' slidersite='{}' cranklength='1'", "site='s' refsite='{}'"];
    let cases = [
        ("<contact><exclude body1='o' body2='b'/></contact>", [0, 0, 0, 0]),
        ("<equality><joint joint1='k' joint2='j'/></equality>", [0, 0, 0, 0]),
        ("<equality><connect site1='s' site2='w'/><connect site1='s' site2='t'/></equality>", [2, 0, 0, 0]),
        ("<equality><weld body1='b' body2='world'/></equality>", [2, 0, 0, 0]),
        (&format!("<actuator><motor {}/></actuator>", crank.replace("{}", "w")), [0, 0, 0, 0]),
        (&format!("<actuator><motor {}/></actuator>", crank.replace("{}", "t")), [0, 2, 0, 0]),
        (&format!("<actuator><motor {}/></actuator>", site.replace("{}", "w")), [0, 0, 0, 0]),
        ("<sensor><framepos objtype='body' objname='b' reftype='body' refname='o'/></sensor>", [0, 0, 2, 0]),
        ("<tendon><fixed><joint joint='k' coef='1'/><joint joint='j' coef='1'/></fixed></tendon>", [0, 0, 0, 2]),
        ("<tendon><spatial><site site='w'/><geom geom='g'/><site site='s'/></spatial></tendon>", [0, 0, 0, 2]),
        (
            "<tendon><spatial name='a'><site site='w'/><geom geom='g' sidesite='s'/><site site='s'/></spatial></tendon>
             <equality><tendon tendon1='a'/></equality><actuator><motor name='m' tendon='a'/></actuator>
             <sensor><tendonpos tendon='a'/><actuatorfrc actuator='m'/></sensor>",
            [0, 0, 0, 0],
        ),
    ];
    for (refer, expected) in cases {
        let text = format!(
            "<mujoco><worldbody><site name='w' pos='0 0 2'/>
             <body name='o'><joint name='k'/><geom name='g' pos='0 0 1' size='0.1'/></body>
             <replicate count='2'><body name='b'><joint name='j'/><geom size='0.1'/><site name='s'/>
             <body><joint/><geom size='0.1' pos='1 0 0'/><site name='t' pos='1 0 0'/></body></body></replicate>
             </worldbody>{refer}</mujoco>"
        );
        let model = penny::parse("scene.xml", &text).unwrap_or_else(|failure| panic!("{failure}")).model;
        let found = [model.equalities.len(), model.actuators.len(), model.sensors.len(), model.tendons.len()];
        assert_eq!(found, expected, "equalities, actuators, sensors, tendons of {refer}");
    }
}

/// As MuJoCo 4.0.0: a range that is inherited limits where one that is given would.
#[test]
fn what_is_limited_is_limited_by_an_inherited_range_as_by_its_own() {
    let read = |compiler: &str, tendon: &str, servo: &str| {
        let text = format!(
            "<mujoco><compiler {compiler}/><worldbody><body><joint name='j' type='slide' limited='true' range='-1 3'/>
             <geom size='.1'/></body></worldbody><tendon><fixed {tendon}><joint joint='j' coef='1'/></fixed></tendon>
             <actuator><position joint='j' {servo}/></actuator></mujoco>"
        );
        penny::parse("scene.xml", &text).map(|scene| scene.model.actuators[0].ctrlrange).map_err(|e| e.to_string())
    };
    let (half, manual) = (Some([0.0, 2.0]), "autolimits='false'");
    assert_eq!(read("", "", "inheritrange='.5'"), Ok(half));
    assert_eq!(read("", "", "inheritrange='.5' ctrllimited='true'"), Ok(half));
    assert_eq!(read("", "", "inheritrange='.5' ctrllimited='false'"), Ok(None));
    assert_eq!(read(manual, "", "inheritrange='.5' ctrllimited='true'"), Ok(half));
    let joint = |attributes: &str| {
        let text = format!(
            "<mujoco><compiler {manual}/><worldbody><body><joint {attributes}/><geom size='.1' pos='1 0 0'/></body></worldbody></mujoco>"
        );
        penny::parse("scene.xml", &text).map(|_| None).map_err(|e| e.to_string())
    };
    assert_eq!(joint("range='0 0' actuatorfrcrange='0 0'"), Ok(None));
    for refused in [
        joint("range='1 1'"),
        joint("range='1 -1'"),
        joint("actuatorfrcrange='1 1'"),
        read(manual, "", "inheritrange='.5'"),
        read("", "actuatorfrclimited='true'", ""),
        read("", "actuatorfrclimited='true' actuatorfrcrange='0 0'", ""),
    ] {
        assert!(refused.is_err_and(|why| why.contains("limited")));
    }
}

#[test]
fn warnings_of_numbers_say_what_the_physics_makes_of_them() {
    let solimp = "2 -1 -0.5 7 0.1";
    let text = format!(
        "<mujoco><worldbody><geom type='plane' size='1 1 1' friction='0'/><body pos='0 0 1'><freejoint/>
         <geom size='0.1' priority='1' condim='6' friction='0 1e-6 0' solimp='{solimp}'/></body></worldbody></mujoco>"
    );
    let scene = penny::parse("scene.xml", &text).unwrap_or_else(|failure| panic!("{failure}"));
    let report = mjcf::render(&scene.document, &scene.warnings, false);
    let says = |line: String| assert!(report.contains(&line), "`{line}` is missing in\n{report}");
    let given: Vec<f64> = solimp.split(' ').map(|word| word.parse().unwrap()).collect();
    let used = penny::contact::impedance::clamp(&given.try_into().unwrap());
    for (word, used) in solimp.split(' ').zip(used) {
        says(format!("`solimp` {word} counts as {used}: "));
    }
    says(format!("`friction` 1e-6 counts as {}, ", scene.model.mixes[0].friction[2]));
    // A friction of 0 raises no doubt.
    assert_eq!(scene.warnings.len(), 6, "{report}");
}

/// What MuJoCo reads from a file in tests/mjcf/good.
#[derive(Deserialize)]
struct Golden {
    name: String,
    option: BTreeMap<String, Value>,
    body: Vec<String>,
    geom: BTreeMap<String, Value>,
    joint: BTreeMap<String, Value>,
    dof: BTreeMap<String, Value>,
    pair: BTreeMap<String, Value>,
    actuator: BTreeMap<String, Value>,
    numeric: BTreeMap<String, Value>,
    text: BTreeMap<String, String>,
    key: BTreeMap<String, Value>,
}

fn goldens() -> Vec<Golden> {
    serde_json::from_str(include_str!("../golden/reader.json")).unwrap()
}

fn read(name: &str) -> mjcf::Loaded {
    let path = crate::file("tests/mjcf/good").join(name);
    mjcf::load(&path).unwrap_or_else(|failure| panic!("{failure}"))
}

/// Bodies in depth-first order, the world first.
fn bodies(spec: &Spec) -> Vec<&spec::Body> {
    fn walk<'a>(body: &'a spec::Body, all: &mut Vec<&'a spec::Body>) {
        all.push(body);
        body.children.iter().for_each(|child| walk(child, all));
    }
    let mut all = Vec::new();
    walk(&spec.world, &mut all);
    all
}

#[test]
fn good_files_give_no_warning() {
    for golden in goldens() {
        let loaded = read(&golden.name);
        assert!(loaded.warnings.is_empty(), "{}", mjcf::render(&loaded.document, &loaded.warnings, false));
    }
}

#[test]
fn options_are_read_as_mujoco_reads_them() {
    const DISABLE: &[&str] = &[
        "constraint", "equality", "frictionloss", "limit", "contact", "spring", "damper", "gravity", "clampctrl",
        "warmstart", "filterparent", "actuation", "refsafe", "sensor", "midphase", "eulerdamp", "autoreset",
        "nativeccd", "island",
    ];
    const ENABLE: &[(&str, u64)] = &[("override", 0), ("energy", 1), ("fwdinv", 2), ("diagexact", 5)];
    for golden in goldens() {
        let (spec, theirs) = (read(&golden.name).spec, &golden.option);
        let o = &spec.option;
        let integrators = ["Euler", "RK4", "implicit", "implicitfast", "discrete"];
        let integrator = integrators.iter().position(|name| *name == o.integrator);
        let disabled: u64 = DISABLE.iter().enumerate().map(|(bit, name)| u64::from(!spec.flags[name]) << bit).sum();
        let enabled: u64 = ENABLE.iter().map(|(name, bit)| u64::from(spec.flags[name]) << bit).sum();
        let ours = json!({
            "timestep": o.timestep, "gravity": o.gravity, "integrator": integrator, "cone": o.cone as i32,
            "impratio": o.impratio, "tolerance": o.tolerance, "iterations": o.iterations, "o_margin": o.o_margin,
            "o_solref": o.o_solref, "o_solimp": o.o_solimp, "o_friction": o.o_friction,
            "disableflags": disabled, "enableflags": enabled,
        });
        assert_eq!(ours, json!(theirs), "{}", golden.name);
    }
}

#[test]
fn classes_reach_every_geom_and_joint_as_in_mujoco() {
    for golden in goldens() {
        let spec = read(&golden.name).spec;
        let bodies = bodies(&spec);
        let name = |name: &Option<String>| name.clone().unwrap_or_default();
        assert_eq!(bodies.iter().map(|b| name(&b.name)).collect::<Vec<_>>(), golden.body, "{}", golden.name);

        let geoms: Vec<&spec::Geom> = bodies.iter().flat_map(|b| &b.geoms).collect();
        let kind = |k: GeomKind| [0, 2, 3, 4, 5, 6][k as usize];
        let ours = json!({
            "name": geoms.iter().map(|g| name(&g.name)).collect::<Vec<_>>(),
            "type": geoms.iter().map(|g| kind(g.kind)).collect::<Vec<_>>(),
            "condim": geoms.iter().map(|g| g.condim).collect::<Vec<_>>(),
            "contype": geoms.iter().map(|g| g.contype).collect::<Vec<_>>(),
            "conaffinity": geoms.iter().map(|g| g.conaffinity).collect::<Vec<_>>(),
            "group": geoms.iter().map(|g| g.group).collect::<Vec<_>>(),
            "priority": geoms.iter().map(|g| g.priority).collect::<Vec<_>>(),
            "friction": geoms.iter().map(|g| g.friction).collect::<Vec<_>>(),
            "solmix": geoms.iter().map(|g| g.solmix).collect::<Vec<_>>(),
            "solref": geoms.iter().map(|g| g.solref).collect::<Vec<_>>(),
            "solimp": geoms.iter().map(|g| g.solimp).collect::<Vec<_>>(),
            "margin": geoms.iter().map(|g| g.margin).collect::<Vec<_>>(),
            "gap": geoms.iter().map(|g| g.gap).collect::<Vec<_>>(),
            "rgba": geoms.iter().map(|g| g.rgba.map(f64::from)).collect::<Vec<_>>(),
        });
        assert_eq!(ours, json!(golden.geom), "{}", golden.name);

        let joints: Vec<&spec::Joint> = bodies.iter().flat_map(|b| &b.joints).collect();
        let limited = |j: &spec::Joint| j.limited.unwrap_or(j.range.is_some_and(|r| r[0] < r[1]));
        let ours = json!({
            "name": joints.iter().map(|j| name(&j.name)).collect::<Vec<_>>(),
            "type": joints.iter().map(|j| j.kind as usize).collect::<Vec<_>>(),
            "limited": joints.iter().map(|j| limited(j)).collect::<Vec<_>>(),
            "margin": joints.iter().map(|j| j.margin).collect::<Vec<_>>(),
            "stiffness": joints.iter().map(|j| j.stiffness).collect::<Vec<_>>(),
            "solref": joints.iter().map(|j| j.solreflimit).collect::<Vec<_>>(),
            "solimp": joints.iter().map(|j| j.solimplimit).collect::<Vec<_>>(),
        });
        assert_eq!(ours, json!(golden.joint), "{}", golden.name);

        let dofs: Vec<(usize, &spec::Joint)> =
            joints.iter().enumerate().flat_map(|(i, j)| std::iter::repeat_n((i, *j), j.kind.nv())).collect();
        let ours = json!({
            "joint": dofs.iter().map(|(i, _)| i).collect::<Vec<_>>(),
            "damping": dofs.iter().map(|(_, j)| j.damping).collect::<Vec<_>>(),
            "armature": dofs.iter().map(|(_, j)| j.armature).collect::<Vec<_>>(),
            "frictionloss": dofs.iter().map(|(_, j)| j.frictionloss).collect::<Vec<_>>(),
            "solref": dofs.iter().map(|(_, j)| j.solreffriction).collect::<Vec<_>>(),
            "solimp": dofs.iter().map(|(_, j)| j.solimpfriction).collect::<Vec<_>>(),
        });
        assert_eq!(ours, json!(golden.dof), "{}", golden.name);
    }
}

#[test]
fn pairs_actuators_and_custom_data_are_read_as_mujoco_reads_them() {
    for golden in goldens() {
        let spec = read(&golden.name).spec;
        let pairs = &spec.pairs;
        let ours = json!({
            "dim": pairs.iter().map(|p| p.condim).collect::<Vec<_>>(),
            "friction": pairs.iter().map(|p| p.friction).collect::<Vec<_>>(),
            "solref": pairs.iter().map(|p| p.solref).collect::<Vec<_>>(),
            "solreffriction": pairs.iter().map(|p| p.solreffriction).collect::<Vec<_>>(),
            "solimp": pairs.iter().map(|p| p.solimp).collect::<Vec<_>>(),
            "margin": pairs.iter().map(|p| p.margin).collect::<Vec<_>>(),
            "gap": pairs.iter().map(|p| p.gap).collect::<Vec<_>>(),
        });
        assert_eq!(ours, json!(golden.pair), "{}", golden.name);

        let limited = |limited: Option<bool>, range: Option<[f64; 2]>| limited.unwrap_or(range.is_some());
        let ten = |first: &[f64]| {
            let mut ten = [0.0; 10];
            ten[..first.len()].copy_from_slice(first);
            ten
        };
        let actuators = &spec.actuators;
        let ours = json!({
            "gear": actuators.iter().map(|a| a.gear).collect::<Vec<_>>(),
            "ctrllimited": actuators.iter().map(|a| limited(a.ctrllimited, a.ctrlrange)).collect::<Vec<_>>(),
            "ctrlrange": actuators.iter().map(|a| a.ctrlrange.unwrap_or_default()).collect::<Vec<_>>(),
            "forcelimited": actuators.iter().map(|a| limited(a.forcelimited, a.forcerange)).collect::<Vec<_>>(),
            "forcerange": actuators.iter().map(|a| a.forcerange.unwrap_or_default()).collect::<Vec<_>>(),
            "gainprm": actuators.iter().map(|a| ten(&a.gain)).collect::<Vec<_>>(),
            "biasprm": actuators.iter().map(|a| ten(&a.bias)).collect::<Vec<_>>(),
        });
        assert_eq!(ours, json!(golden.actuator), "{}", golden.name);

        let numerics: BTreeMap<_, _> = spec.numerics.iter().map(|n| (n.name.clone(), n.data.clone())).collect();
        assert_eq!(json!(numerics), json!(golden.numeric), "{}", golden.name);
        let texts: BTreeMap<_, _> = spec.texts.iter().map(|t| (t.name.clone(), t.data.clone())).collect();
        assert_eq!(texts, golden.text, "{}", golden.name);
        let keys = json!({
            "name": spec.keyframes.iter().map(|k| k.name.clone().unwrap_or_default()).collect::<Vec<_>>(),
            "time": spec.keyframes.iter().map(|k| k.time).collect::<Vec<_>>(),
        });
        assert_eq!(keys, json!(golden.key), "{}", golden.name);
    }
}

/// A value that differs from the default, as it would be written.
fn another_value(column: &schema::Attribute) -> String {
    match column.kind {
        Kind::Name(_) => "new".into(),
        Kind::Reference("geom" | "joint") => "other".into(),
        Kind::Reference(what) => what.into(),
        Kind::ReferenceBy(_) => "body".into(),
        Kind::Class => "special".into(),
        Kind::Text => if column.name == "eulerseq" { "zyx" } else { "word" }.into(),
        Kind::Keyword(words) => words.iter().rfind(|w| **w != column.default).unwrap_or(&column.default).to_string(),
        Kind::Integers(min, _) => vec!["4"; min.max(1)].join(" "),
        Kind::Numbers(min, _) => (0..min).map(|i| format!("0.{}", 3 + i)).collect::<Vec<_>>().join(" "),
    }
}

/// A sensor of a row of the schema, with an attribute and all that it needs.
fn sensor(names: &str, attribute: &str) -> String {
    let name = names.split(' ').next().unwrap();
    let Some(row) = schema::find("sensor", name).filter(|row| row.names == names) else { return String::new() };
    let given = attribute.split('=').next().unwrap();
    let all = [
        "objtype='xbody'", "objname='world'", "joint='joint'", "actuator='other'", "tendon='second'", "site='other'",
        "body='world'",
    ];
    let needed = all.iter().filter(|a| {
        let name = a.split('=').next().unwrap();
        row.attribute(name).is_some() && name != given
    });
    format!("<{name} {} {attribute}/>", needed.copied().collect::<Vec<_>>().join(" "))
}

/// What the scene's default class, `<equality>` and `<tendon>` hold, with one more attribute in one element.
fn ties(element: &str, attribute: &str) -> [String; 3] {
    let name = attribute.split('=').next().unwrap();
    // What the element needs, but for what is given.
    let needed = |always: &[&str]| {
        let rest = always.iter().filter(|a| a.split('=').next() != Some(name));
        rest.copied().chain([attribute]).collect::<Vec<_>>().join(" ")
    };
    let (mut default, mut equality) = (String::new(), "<joint joint1='joint'/>".to_string());
    let fixed = |name: &str| format!("<fixed name='{name}'><joint joint='joint' coef='1'/></fixed>");
    let mut tendon = fixed("tendon") + &fixed("second");
    let sites = ["site1='site'", "site2='other'"];
    match element {
        "default equality" => default = format!("<equality {attribute}/>"),
        "default tendon" => default = format!("<tendon {attribute}/>"),
        "connect" | "weld" if name.starts_with("site") => equality = format!("<{element} {}/>", needed(&sites)),
        "connect" => equality = format!("<connect {}/>", needed(&["body1='world'", "anchor='1 2 3'"])),
        "weld" => equality = format!("<weld {}/>", needed(&["body1='world'"])),
        "equality joint" => equality = format!("<joint {}/>", needed(&["joint1='joint'"])),
        "equality tendon" => equality = format!("<tendon {}/>", needed(&["tendon1='second'"])),
        "fixed" => tendon += &format!("<fixed {attribute}><joint joint='joint' coef='1'/></fixed>"),
        "fixed joint" => {
            tendon += &format!("<fixed><joint {}/></fixed>", needed(&["joint='joint'", "coef='1'"]));
        }
        "spatial" => tendon += &format!("<spatial {attribute}><site site='site'/><site site='other'/></spatial>"),
        "spatial site" => {
            tendon += &format!("<spatial><site site='site'/><site {}/></spatial>", needed(&["site='other'"]))
        }
        "spatial geom" => {
            let geom = needed(&["geom='geom'"]);
            tendon += &format!("<spatial><site site='site'/><geom {geom}/><site site='other'/></spatial>");
        }
        "spatial pulley" => {
            let pulley = needed(&["divisor='7'"]);
            tendon += &format!("<spatial><pulley {pulley}/><site site='site'/><site site='other'/></spatial>");
        }
        _ => {}
    }
    [default, equality, tendon]
}

/// A scene with one more attribute in one element, and what else that element needs.
fn scene_with(element: &str, attribute: &str) -> String {
    let tag = |name: &str, always: &str| {
        let more = if name == element { attribute } else { "" };
        format!(
            "<{name} {} {more}/>",
            if more.is_empty() || !always.contains(more.split('=').next().unwrap()) { always } else { "" }
        )
    };
    // Of an actuator: what it acts on, unless the attribute says.
    let target = match attribute.split('=').next() {
        Some("joint" | "jointinparent" | "site" | "tendon") => "",
        Some("cranksite") => "slidersite='other' cranklength='1'",
        Some("slidersite") => "cranksite='other' cranklength='1'",
        Some("cranklength") => "cranksite='site' slidersite='other'",
        Some("refsite") => "site='site'",
        _ => "joint='joint'",
    };
    let only = |name: &str, always: &str| if name == element { tag(name, always) } else { String::new() };
    let [default, equality, tendon] = ties(element, attribute);
    format!(
        "<mujoco {root}>{size}{compiler}{option}<option>{flag}</option>
        <default>{default}<default class='special'><geom condim='1'/><joint damping='9'/><pair condim='1'/>
          <equality solref='7 1'/><tendon damping='7'/>
          <motor gear='7'/><site pos='7 0 0'/><camera fovy='7'/></default></default>
        <asset><material name='material'/></asset>
        <worldbody><body name='body'>{joint}<joint name='other' type='slide'/>{inertial}{geom}<geom name='other' size='1'/>{site}<site name='other'/>{camera}
          <frame {frame}><geom size='1'/></frame></body>
          {replicate}<body {body}><geom size='1'/></body><body>{freejoint}<geom size='1'/></body></worldbody>
        <contact>{pair}{exclude}</contact><equality>{equality}</equality><tendon>{tendon}</tendon>
        <actuator>{motor}{position}{velocity}{intvelocity}{damper}{cylinder}{general}<motor name='other' joint='other'/></actuator><sensor>{sensor}</sensor>
        <custom>{numeric}{text}</custom><keyframe>{key}</keyframe></mujoco>",
        root = if element == "mujoco" { attribute } else { "" },
        frame = if element == "frame" { attribute } else { "" },
        body = if element == "body" { attribute } else { "" },
        replicate = if element == "replicate" {
            let count = if attribute.contains("count") { "" } else { "count='2'" };
            format!("<replicate {count} {attribute}><body name='copied'/></replicate>")
        } else {
            String::new()
        },
        size = only("size", ""),
        compiler = only("compiler", ""),
        option = only("option", ""),
        flag = only("flag", ""),
        joint = tag("joint", "name='joint'"),
        freejoint = tag("freejoint", ""),
        inertial = only("inertial", "pos='0 0 0' mass='1'"),
        geom = match attribute.split('=').next() {
            Some("fluidcoef") => format!("<geom name='geom' size='1' fluidshape='ellipsoid' {attribute}/>"),
            _ => tag("geom", "name='geom' size='1'"),
        },
        site = tag("site", "name='site'"),
        camera = tag("camera", "name='camera'"),
        sensor = sensor(element, attribute),
        pair = only("pair", "geom1='geom' geom2='other'"),
        exclude = only("exclude", "body1='world' body2='body'"),
        intvelocity = only("intvelocity", target),
        damper = only("damper", &format!("{target} ctrlrange='0 1'")),
        cylinder = only("cylinder", target),
        motor = if element == "motor" { only("motor", target) } else { "<motor name='actuator' joint='joint'/>".into() },
        position = only("position", target),
        velocity = only("velocity", target),
        general = only("general", &format!("{target} biastype='affine' dyntype='filter'")),
        numeric = only("numeric", "name='numeric' data='1'"),
        text = only("text", "name='text' data='a'"),
        key = only("key", ""),
    )
}

#[test]
fn nothing_supported_is_dropped() {
    // References that only pictures need.
    let pictures = ["material", "mesh", "hfield"];
    let supported = |row: &&schema::Element| row.status == Status::Supported;
    let mut dropped = Vec::new();
    for row in schema::SCHEMA.iter().filter(supported).filter(|row| !row.is("include") && !row.is("default")) {
        for column in row.typed_attributes().filter(|c| c.status == Status::Supported && !pictures.contains(&c.name)) {
            let attribute = format!("{}='{}'", column.name, another_value(column));
            let read = |text: &str| match mjcf::parse("scene.xml", text) {
                Ok(loaded) => format!("{:?}", loaded.spec),
                // Refused is not dropped, if it is this that is refused.
                Err(failure) => failure.to_string(),
            };
            let within = ["equality", "fixed", "spatial", "default"].into_iter().find(|p| *p == row.parents);
            let element = match within {
                Some(parent) if !matches!(row.names, "connect" | "weld") => format!("{parent} {}", row.names),
                _ => row.names.to_string(),
            };
            let with = read(&scene_with(&element, &attribute));
            if with == read(&scene_with(&element, "")) {
                dropped.push(format!("{} {attribute}", row.names));
            }
        }
    }
    assert!(dropped.is_empty(), "read, but without effect:\n{}", dropped.join("\n"));
}

/// Every scene that stands in the golden data, and those of the repository.
fn scenes() -> Vec<(String, String)> {
    fn texts(value: &Value, found: &mut Vec<String>) {
        match value {
            Value::String(text) if text.trim_start().starts_with("<mujoco") => found.push(text.clone()),
            Value::Array(all) => all.iter().for_each(|value| texts(value, found)),
            Value::Object(all) => all.values().for_each(|value| texts(value, found)),
            _ => {}
        }
    }
    let mut scenes = Vec::new();
    let each =
        |folder: &str| std::fs::read_dir(crate::file(folder)).expect("a folder").map(|e| e.expect("a file").path());
    for path in each("models").chain(each("tests/mjcf/good")).filter(|p| p.extension().is_some_and(|e| e == "xml")) {
        scenes.push((path.display().to_string(), std::fs::read_to_string(&path).expect("a scene")));
    }
    for path in each("tests/golden").filter(|p| p.extension().is_some_and(|e| e == "json")) {
        let mut found = Vec::new();
        texts(&serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap(), &mut found);
        let name = path.display();
        scenes.extend(found.into_iter().enumerate().map(|(i, text)| (format!("{name} {i}"), text)));
    }
    scenes
}

/// Whether two models, as they are printed, have the same fields with the same numbers.
///
/// `exact`: to the bit. Else to 1e-15: a pose taken out of its frame has its own rounding, which the inverse of the
/// inertia matrix, and the axes of inertia, multiply.
fn same(a: &str, b: &str, exact: bool) -> Result<(), String> {
    let apart = |c: char| c.is_whitespace() || "[](){},:".contains(c);
    let (mut one, mut two, mut field) = (a.split(apart), b.split(apart), "");
    loop {
        let tolerance = match field {
            _ if exact => 0.0,
            "invweight0" | "inertia" | "ipos" | "iquat" => 1e-12,
            _ => 1e-15,
        };
        match (one.next(), two.next()) {
            (None, None) => return Ok(()),
            (Some(x), Some(y)) if x == y => field = if x.starts_with(char::is_alphabetic) { x } else { field },
            (Some(x), Some(y)) => match (x.parse::<f64>(), y.parse::<f64>()) {
                (Ok(p), Ok(q)) if (p - q).abs() <= tolerance * p.abs().max(1.0) => {}
                _ => return Err(format!("{field}: {x} is {y}")),
            },
            (x, y) => return Err(format!("{field}: {x:?} is {y:?}")),
        }
    }
}

#[test]
fn a_converted_scene_is_the_same_model() {
    let (mut compared, mut failed) = (0, Vec::new());
    for (name, text) in scenes() {
        let Ok(scene) = penny::parse(&name, &text) else { continue };
        let folder = std::path::Path::new(&name).parent().unwrap();
        let converted = penny::compile::canonical(&scene.document, folder);
        let again = penny::parse(&name, &converted).unwrap_or_else(|failure| panic!("{name}: {failure}\n{converted}"));
        for gone in ["<default", "<frame ", "<frame>", "<replicate", "<include", " class=", "childclass="] {
            assert!(!converted.contains(gone), "{name}: {gone}\n{converted}");
        }
        if let Err(why) = same(
            &format!("{:?}", *scene.model),
            &format!("{:?}", *again.model),
            !text.contains("<frame") && !text.contains("<replicate"),
        ) {
            failed.push(format!("{name}: {why}\n"));
        }
        let twice = penny::compile::canonical(&again.document, folder);
        assert_eq!(converted, twice, "{name}: converted again it changes");
        compared += 1;
    }
    assert!(compared > 150, "only {compared} scenes");
    assert!(failed.is_empty(), "{}", failed.concat());
}

/// As MuJoCo 4.0.0; two `inertial` it mixes.
#[test]
fn what_no_scene_can_mean_is_refused() {
    let refused = |inside: &str, after: &str| {
        let text = format!(
            "<mujoco><worldbody><body><joint name='j'/><geom size='.1'/>{inside}</body></worldbody>{after}</mujoco>"
        );
        penny::parse("scene.xml", &text).is_err()
    };
    let numeric = |attributes: &str| refused("", &format!("<custom><numeric name='n' {attributes}/></custom>"));
    assert!(numeric("size='0' data='1'") && numeric("size='0'") && numeric("") && !numeric("size='1'"));
    let sensor = |attributes: &str| refused("", &format!("<sensor><jointpos joint='j' {attributes}/></sensor>"));
    for wrong in ["interval='-1'", "interval='.01 .001'", "interval='.01 -.01'", "interval='0 1'", "delay='.1'"] {
        assert!(sensor(wrong), "{wrong}");
    }
    for right in ["interval='.01 -.005'", "interval='0 -1'", "delay='.1' nsample='2'"] {
        assert!(!sensor(right), "{right}");
    }
    let inertial = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
    assert!(refused(&format!("{inertial}<frame>{inertial}</frame>"), ""));
    assert!(refused(&format!("<frame>{inertial}</frame><frame>{inertial}</frame>"), ""));
    assert!(!refused(&format!("<frame>{inertial}</frame>"), ""));
}

#[test]
fn a_motor_takes_nothing_from_its_class_that_only_servos_have() {
    let text = "<mujoco><default><position inheritrange='1' dampratio='1'/></default><worldbody><body>
         <joint name='x' type='slide' range='-2 2'/><geom size='0.1'/></body></worldbody>
         <actuator><motor joint='x' ctrlrange='-3 3'/><position joint='x'/></actuator></mujoco>";
    let model = penny::parse("scene.xml", text).unwrap_or_else(|failure| panic!("{failure}")).model;
    let ranges: Vec<_> = model.actuators.iter().map(|a| a.ctrlrange).collect();
    assert_eq!(ranges, [Some([-3.0, 3.0]), Some([-2.0, 2.0])]);
    assert_eq!(model.actuators[0].bias, [0.0; 3]);
}

/// MuJoCo has the inertial frame of a body without mass where its pose as written is, without the frames around it: a converted
/// scene, which has no frames, says so.
#[test]
fn a_converted_mount_in_a_frame_keeps_its_inertial_frame() {
    let text = "<mujoco><default><default class='drawn'><geom density='0'/></default></default><worldbody><body><joint/><geom size='.1'/>
         <frame pos='1 2 3' euler='0 0 90'><body pos='.1 .2 .3' euler='10 0 0' childclass='drawn'><geom size='.1'/><frame><geom size='.1' group='6'
         density='9'/></frame><body pos='1 0 0'><joint/><geom size='.1' mass='1'/></body></body><body/></frame></body></worldbody></mujoco>";
    let scene = penny::parse("scene.xml", text).unwrap_or_else(|failure| panic!("{failure}"));
    let converted = penny::compile::canonical(&scene.document, std::path::Path::new(""));
    let again = penny::parse("scene.xml", &converted).unwrap_or_else(|failure| panic!("{failure}"));
    for (body, other) in scene.model.bodies.iter().zip(&again.model.bodies) {
        assert!((body.ipos - other.ipos).norm() < 1e-12, "{converted}");
        assert!((body.invweight0[0] - other.invweight0[0]).abs() <= 1e-12 * body.invweight0[0], "{converted}");
        assert_eq!(body.mass, other.mass);
    }
    assert_eq!(again.model.bodies[2].ipos, penny::math::Vec3::new(0.1, 0.2, 0.3));
}

/// About the middle of a range without an end there is none: the control's range was NaN.
#[test]
fn a_servo_inherits_no_range_without_ends() {
    let text =
        "<mujoco><worldbody><body><joint name='j' type='slide' range='-1 inf'/><geom size='.1'/></body></worldbody>
         <actuator><position joint='j' inheritrange='1'/></actuator></mujoco>";
    let refused = penny::parse("scene.xml", text).map(|_| ()).expect_err("no range").to_string();
    assert!(refused.contains("with a finite `range`"), "{refused}");
}
