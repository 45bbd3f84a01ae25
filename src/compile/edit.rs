//! A compiled scene is changed: numbers, not its structure. What follows from them is found anew.

use std::fmt;

use super::layout::label;
use super::{controls, invweight, layout, masses, pairs, requirements, ties};
use crate::dynamics::fluid;
use crate::integrate;
use crate::math::{MIN_VAL, Quat};
use crate::model::{Activation, Anchor, Bound, EqualityKind, GeomKind, JointKind, Model, Options, Pairs, Parts};

/// Why a change of a model was not taken. The model is as it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Invalid {
    what: String,
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.what)
    }
}

impl std::error::Error for Invalid {}

impl Invalid {
    pub(crate) fn new(what: impl Into<String>) -> Invalid {
        Invalid { what: what.into() }
    }
}

/// `Err` with a text.
fn invalid<T>(what: impl Into<String>) -> Result<T, Invalid> {
    Err(Invalid::new(what))
}

impl Model {
    /// Changes numbers of the scene; the next step takes them up, under every law.
    ///
    /// What follows from what was changed is found anew: free bodies from the masses of their bodies, damping and armature that
    /// actuators give by their gear, `invweight0`, at `qpos0` lengths of tendons and anchors of a `connect` or of a `weld` without
    /// `relpose`, the parameters of contacts from those of geoms (a `<pair>` keeps its own), bounding spheres, what a step needs. What
    /// is derived but changed directly (`mixes`, `invweight0`) stays until what it is derived from changes.
    ///
    ///     model.edit(|m| m.opt.gravity.z = -1.62)?;
    ///     model.edit(|m| m.geoms[floor].friction[0] = 0.2)?;
    ///
    /// Start values are `qpos0`, keyframes, [`Equality::active`](crate::model::Equality::active), and poses of mocap bodies:
    /// a state that runs keeps its own until it is reset. `opt.timestep` and `opt.integrator` are what a
    /// [`Method`](crate::forward::Method) begins with.
    ///
    /// Errors: [`Invalid`] if a number is not finite or has a sign that it cannot have, if a range is reversed, if nothing
    /// would hold a joint's motion (no mass), or if the structure was changed (lengths of lists, kinds, which geoms can
    /// touch): a new scene has to be compiled for that. The model then stays as it was. What the file has and is left as it
    /// is, is not refused.
    pub fn edit(&mut self, change: impl FnOnce(&mut Parts)) -> Result<(), Invalid> {
        self.edit_if(change, |_, _| Ok(()))
    }

    /// The same, if what it was before and what it would be suit the caller.
    pub(crate) fn edit_if(
        &mut self,
        change: impl FnOnce(&mut Parts),
        suits: impl FnOnce(&Parts, &Parts) -> Result<(), Invalid>,
    ) -> Result<(), Invalid> {
        let before = self.clone();
        change(self.parts_mut());
        let settled = same_structure(&before, self)
            .and_then(|()| {
                controls::geared(&before, self.parts_mut());
                sound(&before, self)
            })
            .and_then(|()| same_method(&before, self))
            .and_then(|()| suits(&before, self))
            .and_then(|()| settle(&before, self));
        match settled {
            Ok(()) => self.revise(),
            Err(_) => *self = before,
        }
        settled
    }

    /// The same scene with other pairs, which are not checked: to compare one way to find contacts with another.
    #[doc(hidden)]
    pub fn with_pairs(&self, pairs: Pairs) -> Model {
        let mut model = self.clone();
        let parts = model.parts_mut();
        parts.pairs = pairs;
        parts.requires = requirements::requirements(parts);
        model.revise();
        model
    }
}

/// What follows from the numbers.
fn settle(before: &Parts, model: &mut Model) -> Result<(), Invalid> {
    let parts = model.parts_mut();
    if parts.geoms != before.geoms || parts.opt.contact_override != before.opt.contact_override {
        for geom in &mut parts.geoms {
            geom.rbound = layout::bounding_radius(geom.kind, &geom.size);
            let coef = geom.fluid.as_ref().map(|fluid| fluid.coef);
            geom.fluid = coef.map(|coef| fluid::virtual_inertia(coef, &fluid::semiaxes(geom)).into());
        }
        parts.mixes = pairs::remix(&parts.geoms, parts.opt.contact_override, &mut parts.pairs, &parts.mixes);
    }
    let inert = |m: &Parts| m.tendons.iter().map(|t| t.armature).collect::<Vec<_>>();
    let heavy = |m: &Parts| {
        let bodies = m.bodies.iter().map(|b| (b.mass, b.inertia, b.ipos, b.iquat)).collect::<Vec<_>>();
        (bodies, m.dofs.iter().map(|d| d.armature).collect::<Vec<_>>(), inert(m))
    };
    let posed = |m: &Parts| {
        let bodies = m.bodies.iter().map(|b| (b.pos, b.quat)).collect::<Vec<_>>();
        (bodies, m.joints.iter().map(|j| (j.pos, j.axis)).collect::<Vec<_>>(), m.qpos0.clone())
    };
    // What tendons run over.
    let strung = |m: &Parts| {
        let sites = m.sites.iter().map(|s| (s.pos, s.quat));
        let geoms = m.geoms.iter().map(|g| (g.pos, g.quat, g.size));
        (sites.collect::<Vec<_>>(), geoms.collect::<Vec<_>>())
    };
    let still = posed(parts) == posed(before);
    let same = still && heavy(parts) == heavy(before) && (parts.tendons.is_empty() || strung(parts) == strung(before));
    let medium = parts.opt.medium();
    let (joints, sites, geoms) = (&parts.joints, &parts.sites, &parts.geoms);
    let tendons = parts.tendons.iter().filter(|t| t.acts()).flat_map(|t| t.bodies(joints, sites, geoms));
    let actuators = parts.actuators.iter().filter(|a| a.depends_on_velocity());
    let driven = actuators.flat_map(|a| a.transmission.bodies(joints, sites, geoms, &parts.tendons));
    let pulled: Vec<usize> = tendons.chain(driven).filter_map(|b| parts.bodies[b].tree).collect();
    for (t, tree) in parts.trees.iter_mut().enumerate() {
        if medium || pulled.contains(&t) {
            tree.free = None;
        } else if tree.free.is_some() {
            tree.free = masses::free_body(tree, &parts.bodies, &parts.joints, &parts.dofs);
            // Not `<`: NaN is no mass.
            if let Some(free) = &tree.free
                && !(free.mass >= MIN_VAL && free.inertia.min() >= MIN_VAL)
            {
                let root = tree.bodies.start;
                let body = label("body", &parts.bodies[root].name, root);
                return invalid(format!("{body} moves freely: mass and inertia have to be above zero"));
            }
        }
    }
    parts.requires = requirements::requirements(parts);
    if !still {
        ties::hang(model);
    }
    match if same { Ok(()) } else { invweight::fill(model) } {
        Ok(()) => {
            if !same {
                ties::measure(model);
                ties::weigh(model);
            }
            Ok(())
        }
        Err(dof) => {
            invalid(format!("dof {dof} would move nothing: masses and inertias of what it moves are too small"))
        }
    }
}

/// Lists and kinds have to stay.
fn same_structure(before: &Parts, now: &Parts) -> Result<(), Invalid> {
    let lists = |m: &Parts| {
        let lengths = [m.bodies.len(), m.joints.len(), m.dofs.len(), m.geoms.len(), m.actuators.len(), m.mixes.len()];
        let sensors: Vec<_> = m.sensors.iter().map(|s| (s.kind, s.object, s.reference, s.adr)).collect();
        (m.nq, m.nv, m.na, m.qpos0.len(), lengths, m.nsensordata, sensors, m.mocap.clone())
    };
    let bodies = |m: &Parts| {
        let of = |b: &crate::model::Body| (b.parent, b.weld, b.tree, b.joints.clone(), b.dofs.clone(), b.geoms.clone());
        m.bodies.iter().map(of).collect::<Vec<_>>()
    };
    let trees = |m: &Parts| {
        let of = |t: &crate::model::Tree| (t.bodies.clone(), t.dofs.clone(), t.qpos.clone(), t.rotates);
        m.trees.iter().map(of).collect::<Vec<_>>()
    };
    // A closed form may be given up, but not asked for.
    let closed =
        |(before, now): (&crate::model::Tree, &crate::model::Tree)| before.free.is_some() || now.free.is_none();
    let joints = |m: &Parts| {
        m.joints.iter().map(|j| (j.kind, j.body, j.qposadr, j.dofadr, j.range.is_some())).collect::<Vec<_>>()
    };
    let dofs = |m: &Parts| m.dofs.iter().map(|d| (d.joint, d.body)).collect::<Vec<_>>();
    let geoms = |m: &Parts| m.geoms.iter().map(|g| (g.kind, g.body, g.contype, g.conaffinity)).collect::<Vec<_>>();
    let places = |m: &Parts| {
        let cameras: Vec<_> = m.cameras.iter().map(|c| (c.body, c.target, c.mode)).collect();
        let visuals: Vec<_> = m.visuals.iter().map(|v| v.body).collect();
        (m.sites.iter().map(|s| s.body).collect::<Vec<_>>(), cameras, visuals)
    };
    let actuators = |m: &Parts| {
        let of = |a: &crate::model::Actuator| (a.kind, a.transmission, a.act, std::mem::discriminant(&a.activation));
        m.actuators.iter().map(of).collect::<Vec<_>>()
    };
    let tendons = |m: &Parts| m.tendons.iter().map(|t| (t.path.clone(), t.range.is_some())).collect::<Vec<_>>();
    let equalities = |m: &Parts| m.equalities.iter().map(|e| held(&e.kind)).collect::<Vec<_>>();
    let keyframes = |m: &Parts| {
        let of = |k: &crate::model::Keyframe| {
            [k.qpos.len(), k.qvel.len(), k.ctrl.len(), k.act.len(), k.mocap_pos.len(), k.mocap_quat.len()]
        };
        m.keyframes.iter().map(of).collect::<Vec<_>>()
    };
    let same = lists(before) == lists(now)
        && bodies(before) == bodies(now)
        && trees(before) == trees(now)
        && before.trees.iter().zip(&now.trees).all(closed)
        && joints(before) == joints(now)
        && dofs(before) == dofs(now)
        && geoms(before) == geoms(now)
        && places(before) == places(now)
        && actuators(before) == actuators(now)
        && tendons(before) == tendons(now)
        && equalities(before) == equalities(now)
        && keyframes(before) == keyframes(now)
        && same_pairs(&before.pairs, &now.pairs)
        && before.opt.flags.filterparent == now.opt.flags.filterparent;
    if !same {
        return invalid(
            "bodies, joints, geoms and actuators, their kinds, lengths of lists and what can touch what cannot be \
             changed: compile a new scene",
        );
    }
    let touch = |o: &Options| o.flags.contact && o.flags.constraint;
    let none = now.pairs.listed.is_empty() && now.pairs.swept.is_empty();
    if none && touch(&now.opt) && !touch(&before.opt) {
        return invalid(
            "contacts cannot be switched on where none were compiled: compile the scene with them, and switch them off \
             by a change",
        );
    }
    Ok(())
}

/// As the compiler says: `implicit` is not `implicitfast` in every scene.
fn same_method(before: &Model, now: &Model) -> Result<(), Invalid> {
    let other = |m: &Model| {
        let name = m.opt.integrator.as_str();
        !integrate::implicitfast::supports(m, name) || m.opt.medium() && name == "implicit"
    };
    if other(now) && !other(before) {
        return invalid(
            "the integrator cannot be `implicit` in this scene: take `implicitfast`, or `RK4` for fast motion",
        );
    }
    Ok(())
}

/// What an equality holds: its kind and the indices in it.
fn held(kind: &EqualityKind) -> (std::mem::Discriminant<EqualityKind>, [Option<(bool, usize)>; 2]) {
    let anchor = |anchor: &Anchor| match *anchor {
        Anchor::Site(site) => Some((true, site)),
        Anchor::Body { body, .. } => Some((false, body)),
    };
    let of = match kind {
        EqualityKind::Joint { joints: (first, second), .. } | EqualityKind::Tendon { tendons: (first, second), .. } => {
            [Some(*first), *second].map(|index| index.map(|index| (true, index)))
        }
        EqualityKind::Connect([a, b]) | EqualityKind::Weld { anchors: [a, b], .. } => [anchor(a), anchor(b)],
    };
    (std::mem::discriminant(kind), of)
}

fn same_pairs(before: &Pairs, now: &Pairs) -> bool {
    let listed = before.listed.iter().zip(&now.listed);
    before.listed.len() == now.listed.len()
        && listed.into_iter().all(|(a, b)| (a.geom, a.kind, a.mix, a.given) == (b.geom, b.kind, b.mix, b.given))
        && before.swept == now.swept
        && before.excluded == now.excluded
        && before.class == now.class
        && before.mix_table == now.mix_table
}

/// Numbers have to be what they can be. What was wrong before is not looked at: some of it the reader takes with a warning.
fn sound(before: &Parts, now: &Parts) -> Result<(), Invalid> {
    let found = doubts(now);
    if found.is_empty() {
        return Ok(());
    }
    let old = doubts(before);
    match found.into_iter().find(|doubt| !old.contains(doubt)) {
        Some(doubt) => invalid(doubt),
        None => Ok(()),
    }
}

/// What a number can be.
#[derive(Clone, Copy, PartialEq)]
enum Rule {
    Finite,
    NotNegative,
    Positive,
    /// Infinite too: no bound.
    NotNan,
}
use Rule::{Finite, NotNan, NotNegative, Positive};

impl Rule {
    fn allows(self, x: f64) -> bool {
        match self {
            Finite => x.is_finite(),
            NotNegative => x.is_finite() && x >= 0.0,
            Positive => x.is_finite() && x > 0.0,
            NotNan => !x.is_nan(),
        }
    }

    fn cure(self) -> &'static str {
        match self {
            Finite | NotNan => "",
            NotNegative => ": it is zero or above",
            Positive => ": it is above zero",
        }
    }
}

/// Where a number is: "geom", its name and index; of the scene itself there is one.
type Place<'a> = Option<(&'static str, &'a str, usize)>;

/// What is wrong with the numbers of a scene.
#[derive(Default)]
struct Doubts(Vec<String>);

impl Doubts {
    #[cold]
    fn add(&mut self, what: &str, place: Place, wrong: &str) {
        let of = place.map(|(of, name, index)| format!(" of {}", label(of, name, index))).unwrap_or_default();
        self.0.push(format!("{what}{of} {wrong}"));
    }

    fn numbers(&mut self, rule: Rule, what: &str, place: Place, numbers: &[f64]) {
        for x in numbers.iter().filter(|x| !rule.allows(**x)) {
            self.add(what, place, &format!("cannot be {x}{}", rule.cure()));
        }
    }

    /// Single precision: colours.
    fn colour(&mut self, place: Place, rgba: &[f32; 4]) {
        self.numbers(Finite, "rgba", place, &rgba.map(f64::from));
    }

    fn turn(&mut self, what: &str, place: Place, quat: &Quat) {
        self.numbers(Finite, what, place, quat.coords.as_slice());
        self.unit(what, place, quat.coords.norm());
    }

    /// Lengths that rounding does not explain.
    fn unit(&mut self, what: &str, place: Place, norm: f64) {
        if (norm - 1.0).abs() > 1e-6 {
            self.add(what, place, &format!("cannot have length {norm}: it has length 1"));
        }
    }

    fn range(&mut self, what: &str, place: Place, range: Option<[f64; 2]>) {
        let Some([low, high]) = range else { return };
        self.numbers(NotNan, what, place, &[low, high]);
        if low > high || low == f64::INFINITY || high == f64::NEG_INFINITY {
            self.add(what, place, &format!("cannot be {low} {high}: give the smaller number first"));
        }
    }

    fn solref(&mut self, what: &str, place: Place, solref: [f64; 2]) {
        self.numbers(Finite, what, place, &solref);
        let [first, second] = solref;
        if (first > 0.0) != (second > 0.0) {
            let cure = "either both are above 0 (timeconst, dampratio), or both at most 0 (-stiffness, -damping)";
            self.add(what, place, &format!("cannot be {first} {second}: {cure}"));
        }
    }

    fn condim(&mut self, place: Place, condim: usize) {
        if !matches!(condim, 1 | 3 | 4 | 6) {
            self.add("condim", place, &format!("cannot be {condim}: it is 1, 3, 4 or 6"));
        }
    }
}

/// All numbers of a scene, part by part.
fn doubts(m: &Parts) -> Vec<String> {
    let mut doubts = Doubts::default();
    of_options(&m.opt, &mut doubts);
    of_bodies(m, &mut doubts);
    of_joints(m, &mut doubts);
    of_geoms(m, &mut doubts);
    of_contacts(m, &mut doubts);
    of_forces(m, &mut doubts);
    of_start(m, &mut doubts);
    doubts.0
}

fn of_options(opt: &Options, doubts: &mut Doubts) {
    if !Positive.allows(opt.timestep) {
        doubts.add("the timestep", None, &format!("cannot be {} s{}", opt.timestep, Positive.cure()));
    }
    if integrate::by_name(&opt.integrator).is_none() {
        let known: Vec<&str> = integrate::ALL.iter().map(|i| i.name).collect();
        doubts.add("the integrator", None, &format!("cannot be `{}`: Penny has {}", opt.integrator, known.join(", ")));
    }
    let vectors = [("gravity", &opt.gravity), ("wind", &opt.wind), ("magnetic", &opt.magnetic)];
    vectors.into_iter().for_each(|(what, v)| doubts.numbers(Finite, what, None, v.as_slice()));
    let scalars = [
        ("density", opt.density),
        ("viscosity", opt.viscosity),
        ("tolerance", opt.tolerance),
        ("noslip_tolerance", opt.noslip_tolerance),
    ];
    scalars.into_iter().for_each(|(what, x)| doubts.numbers(NotNegative, what, None, &[x]));
    doubts.numbers(Positive, "impratio", None, &[opt.impratio]);
    if let Some(over) = &opt.contact_override {
        doubts.numbers(Positive, "o_friction", None, &over.friction);
        doubts.solref("o_solref", None, over.solref);
        doubts.numbers(Finite, "o_solimp", None, &over.solimp);
        doubts.numbers(Finite, "o_margin", None, &[over.margin]);
    }
}

fn of_bodies(m: &Parts, doubts: &mut Doubts) {
    for (i, body) in m.bodies.iter().enumerate() {
        let place = Some(("body", body.name.as_str(), i));
        doubts.numbers(NotNegative, "mass", place, &[body.mass]);
        doubts.numbers(NotNegative, "inertia", place, body.inertia.as_slice());
        doubts.numbers(NotNegative, "invweight0", place, &body.invweight0);
        doubts.numbers(Finite, "gravcomp", place, &[body.gravcomp]);
        doubts.numbers(Finite, "pos", place, body.pos.as_slice());
        doubts.numbers(Finite, "ipos", place, body.ipos.as_slice());
        doubts.turn("quat", place, &body.quat);
        doubts.turn("iquat", place, &body.iquat);
    }
    for (i, site) in m.sites.iter().enumerate() {
        let place = Some(("site", site.name.as_str(), i));
        doubts.numbers(Finite, "pos", place, site.pos.as_slice());
        doubts.numbers(NotNegative, "size", place, site.size.as_slice());
        doubts.turn("quat", place, &site.quat);
    }
    for (i, camera) in m.cameras.iter().enumerate() {
        let place = Some(("camera", camera.name.as_str(), i));
        doubts.numbers(Finite, "pos", place, camera.pos.as_slice());
        doubts.numbers(Positive, "fovy", place, &[camera.fovy]);
        doubts.turn("quat", place, &camera.quat);
    }
    for (i, visual) in m.visuals.iter().enumerate() {
        let place = Some(("mesh", "", i));
        doubts.numbers(Finite, "pos", place, visual.pos.as_slice());
        doubts.turn("quat", place, &visual.quat);
        doubts.colour(place, &visual.rgba);
    }
}

fn of_joints(m: &Parts, doubts: &mut Doubts) {
    for (i, joint) in m.joints.iter().enumerate() {
        let place = Some(("joint", joint.name.as_str(), i));
        doubts.numbers(Finite, "pos", place, joint.pos.as_slice());
        doubts.numbers(Finite, "axis", place, joint.axis.as_slice());
        if matches!(joint.kind, JointKind::Slide | JointKind::Hinge) {
            doubts.unit("axis", place, joint.axis.norm());
        }
        doubts.numbers(Finite, "stiffness", place, &[joint.stiffness]);
        doubts.numbers(Finite, "springref", place, &[joint.springref]);
        doubts.numbers(Finite, "margin", place, &[joint.margin]);
        doubts.range("range", place, joint.range);
        if let (JointKind::Ball, Some([low, _])) = (joint.kind, joint.range)
            && low != 0.0
        {
            doubts.add("range", place, &format!("cannot begin at {low}: a ball joint is limited by its angle alone"));
        }
        doubts.range("actuatorfrcrange", place, joint.actfrcrange);
        doubts.solref("solreflimit", place, joint.solref_limit);
        doubts.solref("solreffriction", place, joint.solref_friction);
        doubts.numbers(Finite, "solimplimit", place, &joint.solimp_limit);
        doubts.numbers(Finite, "solimpfriction", place, &joint.solimp_friction);
    }
    for (i, dof) in m.dofs.iter().enumerate() {
        let place = Some(("dof", "", i));
        let scalars = [
            ("damping", dof.damping),
            ("armature", dof.armature),
            ("frictionloss", dof.frictionloss),
            ("invweight0", dof.invweight0),
        ];
        scalars.into_iter().for_each(|(what, x)| doubts.numbers(NotNegative, what, place, &[x]));
    }
}

fn of_geoms(m: &Parts, doubts: &mut Doubts) {
    for (i, geom) in m.geoms.iter().enumerate() {
        let place = Some(("geom", geom.name.as_str(), i));
        doubts.numbers(Finite, "pos", place, geom.pos.as_slice());
        doubts.turn("quat", place, &geom.quat);
        let lengths = match geom.kind {
            GeomKind::Plane => 0,
            GeomKind::Sphere => 1,
            GeomKind::Capsule | GeomKind::Cylinder => 2,
            GeomKind::Ellipsoid | GeomKind::Box => 3,
        };
        let (lengths, others) = geom.size.as_slice().split_at(lengths);
        doubts.numbers(Positive, "size", place, lengths);
        doubts.numbers(NotNegative, "size", place, others);
        doubts.condim(place, geom.condim);
        doubts.numbers(NotNegative, "friction", place, &geom.friction);
        doubts.numbers(NotNegative, "solmix", place, &[geom.solmix]);
        doubts.solref("solref", place, geom.solref);
        doubts.numbers(Finite, "solimp", place, &geom.solimp);
        doubts.numbers(Finite, "margin", place, &[geom.margin]);
        doubts.numbers(Finite, "gap", place, &[geom.gap]);
        if let Some(fluid) = &geom.fluid {
            doubts.numbers(NotNegative, "fluidcoef", place, &fluid.coef);
        }
        doubts.colour(place, &geom.rgba);
    }
}

fn of_contacts(m: &Parts, doubts: &mut Doubts) {
    for (i, mix) in m.mixes.iter().enumerate() {
        let place = Some(("mix", "", i));
        doubts.condim(place, mix.condim);
        doubts.numbers(Positive, "friction", place, &mix.friction);
        doubts.solref("solref", place, mix.solref);
        doubts.solref("solreffriction", place, mix.solreffriction);
        doubts.numbers(Finite, "solimp", place, &mix.solimp);
        doubts.numbers(Finite, "margin", place, &[mix.margin]);
        doubts.numbers(Finite, "gap", place, &[mix.gap]);
    }
    for (i, pair) in m.pairs.listed.iter().enumerate() {
        if let Bound::Height(x) | Bound::Distance2(x) = pair.bound {
            doubts.numbers(NotNan, "bound", Some(("pair", "", i)), &[x]);
        }
    }
    let of_tutorial = [
        ("penny.k", m.tutorial.k),
        ("penny.c", m.tutorial.c),
        ("penny.alpha", m.tutorial.alpha),
        ("penny.mu", m.tutorial.mu),
        ("penny.mu_roll", m.tutorial.mu_roll),
    ];
    of_tutorial.into_iter().for_each(|(what, x)| doubts.numbers(NotNegative, what, None, x.as_slice()));
    for (i, equality) in m.equalities.iter().enumerate() {
        let place = Some(("equality", equality.name.as_str(), i));
        doubts.solref("solref", place, equality.solref);
        doubts.numbers(Finite, "solimp", place, &equality.solimp);
        let anchors = match &equality.kind {
            EqualityKind::Joint { polycoef, .. } | EqualityKind::Tendon { polycoef, .. } => {
                doubts.numbers(Finite, "polycoef", place, polycoef);
                continue;
            }
            EqualityKind::Connect(anchors) => anchors,
            EqualityKind::Weld { anchors, torquescale, .. } => {
                doubts.numbers(NotNegative, "torquescale", place, &[*torquescale]);
                anchors
            }
        };
        for anchor in anchors {
            if let Anchor::Body { pos, quat, .. } = anchor {
                doubts.numbers(Finite, "anchor", place, pos.as_slice());
                doubts.turn("relpose", place, quat);
            }
        }
    }
}

fn of_forces(m: &Parts, doubts: &mut Doubts) {
    for (i, actuator) in m.actuators.iter().enumerate() {
        let place = Some(("actuator", actuator.name.as_str(), i));
        doubts.numbers(Finite, "gear", place, &actuator.gear);
        doubts.numbers(Finite, "gain", place, &actuator.gain);
        doubts.numbers(Finite, "bias", place, &actuator.bias);
        let rotor = [actuator.damping, actuator.armature];
        doubts.numbers(NotNegative, "damping and armature", place, &rotor);
        if rotor != [0.0; 2] && !controls::bears_rotor(&m.joints, actuator.transmission) {
            doubts.add("damping and armature", place, "have to be zero: it acts on no slide, hinge or tendon");
        }
        doubts.range("ctrlrange", place, actuator.ctrlrange);
        doubts.range("forcerange", place, actuator.forcerange);
        doubts.range("actrange", place, actuator.actrange);
        if let Activation::Filter(tau) | Activation::ExactFilter(tau) = actuator.activation {
            doubts.numbers(NotNegative, "timeconst", place, &[tau]);
        }
    }
    for (i, tendon) in m.tendons.iter().enumerate() {
        let place = Some(("tendon", tendon.name.as_str(), i));
        doubts.range("range", place, tendon.range);
        doubts.range("actuatorfrcrange", place, tendon.actfrcrange);
        doubts.range("springlength", place, Some(tendon.lengthspring));
        doubts.numbers(Finite, "springlength", place, &tendon.lengthspring);
        doubts.numbers(Finite, "stiffness", place, &tendon.stiffness);
        doubts.numbers(Finite, "damping", place, &tendon.damping);
        doubts.numbers(Finite, "margin", place, &[tendon.margin]);
        doubts.solref("solreflimit", place, tendon.solref_limit);
        doubts.solref("solreffriction", place, tendon.solref_friction);
        doubts.numbers(Finite, "solimplimit", place, &tendon.solimp_limit);
        doubts.numbers(Finite, "solimpfriction", place, &tendon.solimp_friction);
        doubts.numbers(Finite, "length0", place, &[tendon.length0]);
        let scalars = [
            ("frictionloss", tendon.frictionloss),
            ("armature", tendon.armature),
            ("invweight0", tendon.invweight0),
            ("width", tendon.width),
        ];
        scalars.into_iter().for_each(|(what, x)| doubts.numbers(NotNegative, what, place, &[x]));
        doubts.colour(place, &tendon.rgba);
        if tendon.armature != 0.0 && tendon.goes_round() {
            doubts.add("armature", place, "has to be zero: it goes round a geom");
        }
    }
    for (i, sensor) in m.sensors.iter().enumerate() {
        let place = Some(("sensor", sensor.name.as_str(), i));
        doubts.numbers(NotNegative, "cutoff", place, &[sensor.cutoff]);
        doubts.numbers(NotNegative, "noise", place, &[sensor.noise]);
    }
}

fn of_start(m: &Parts, doubts: &mut Doubts) {
    doubts.numbers(Finite, "qpos0", None, &m.qpos0);
    for (i, key) in m.keyframes.iter().enumerate() {
        let place = Some(("keyframe", key.name.as_str(), i));
        doubts.numbers(Finite, "time", place, &[key.time]);
        let lists = [
            ("qpos", &key.qpos[..]),
            ("qvel", &key.qvel),
            ("ctrl", &key.ctrl),
            ("act", &key.act),
            ("mpos", key.mocap_pos.as_flattened()),
            ("mquat", key.mocap_quat.as_flattened()),
        ];
        lists.into_iter().for_each(|(what, x)| doubts.numbers(Finite, what, place, x));
    }
}
