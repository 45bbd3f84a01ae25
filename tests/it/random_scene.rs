//! Random scenes in which things really touch, as data: so that a test can write the same scene in several ways.

use std::fmt::Write;

use penny::collision::{collider, exact};
use penny::math::{Mat3, Quat, Vec3, exp, mat, quat, vec3, wxyz};
use penny::model::GeomKind;

use crate::sim::Sim;

pub const KINDS: [GeomKind; 6] =
    [GeomKind::Plane, GeomKind::Sphere, GeomKind::Capsule, GeomKind::Ellipsoid, GeomKind::Cylinder, GeomKind::Box];

/// Position and orientation.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    pub pos: Vec3,
    pub quat: Quat,
}

impl Pose {
    fn then(&self, local: &Pose) -> Pose {
        Pose { pos: self.pos + self.quat * local.pos, quat: self.quat * local.quat }
    }
}

#[derive(Clone, Debug)]
pub struct Shape {
    pub kind: GeomKind,
    pub size: Vec3,
    /// In the frame of its thing.
    pub at: Pose,
    pub mass: f64,
    pub condim: usize,
    pub friction: [f64; 3],
    pub solref: [f64; 2],
    pub margin: f64,
}

/// A body that moves freely, or one that never does.
#[derive(Clone, Debug)]
pub struct Thing {
    pub name: String,
    pub moves: bool,
    pub shapes: Vec<Shape>,
    /// Where it is and how it moves (world axes): at first, or at the end.
    pub motion: Motion,
    /// Mass and one moment of inertia for all axes about the body's origin, instead of those of the shapes.
    pub round: Option<[f64; 2]>,
}

#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub at: Pose,
    /// Velocity of the body's origin, m/s; angular velocity, rad/s. World axes.
    pub vel: Vec3,
    pub omega: Vec3,
}

#[derive(Clone, Debug)]
pub struct Scene {
    pub gravity: Vec3,
    pub things: Vec<Thing>,
}

/// The joints of a moving body. Both have the same seven positions and six velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Joints {
    Free,
    SlidesAndBall,
}

/// What random scenes are made of.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// Which kinds, the lower first, may touch. Others pass through each other.
    pub touch: fn(GeomKind, GeomKind) -> bool,
    pub statics: bool,
    pub gravity: bool,
    /// Bodies that are dynamically round and whose centre of mass is their origin: their angular momentum is exact
    /// in every integrator.
    pub round: bool,
    /// The least gap at the start, m.
    pub gap: f64,
    /// The MJCF keyword.
    pub cone: &'static str,
}

impl Recipe {
    fn touches(&self, a: GeomKind, b: GeomKind) -> bool {
        (self.touch)(a.min(b), a.max(b))
    }
    /// Whether a body of this kind may touch anything.
    fn movable(&self, kind: GeomKind) -> bool {
        let statics = if self.statics { 0 } else { 1 };
        kind != GeomKind::Plane && KINDS[statics..].iter().any(|&k| self.touches(k, kind))
    }
    /// Whether something that moves may touch this kind.
    fn has_partner(&self, kind: GeomKind) -> bool {
        KINDS[1..].iter().any(|&k| self.touches(k, kind))
    }
}

/// Pairs that have a closed form.
pub fn closed_form(a: GeomKind, b: GeomKind) -> bool {
    collider(a, b).is_some() && exact(a, b)
}

/// Pairs that are found by iteration.
pub fn iterated(a: GeomKind, b: GeomKind) -> bool {
    collider(a, b).is_some() && !exact(a, b)
}

/// Random numbers that are the same everywhere (Knuth's MMIX generator).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        (0..4).for_each(|_| _ = random.next());
        random
    }
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0 >> 11
    }
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next() as f64 / (1u64 << 53) as f64
    }
    /// Uniform in the logarithm.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }
    pub fn chance(&mut self, p: f64) -> bool {
        self.within(0.0, 1.0) < p
    }
    pub fn below(&mut self, n: usize) -> usize {
        self.within(0.0, n as f64) as usize
    }
    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
    pub fn vec3(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| self.within(-size, size))
    }
    fn unit(&mut self) -> Vec3 {
        loop {
            let v = self.vec3(1.0);
            if (0.1..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }
    pub fn quat(&mut self) -> Quat {
        let v = self.unit() * self.within(0.2, 3.0);
        exp(&v)
    }
}

/// The point of a shape furthest along the unit direction `d`; of a plane, the point above its origin.
fn support(shape: &Shape, at: &Pose, d: &Vec3) -> Vec3 {
    let (l, s) = (at.quat.inverse() * d, shape.size);
    let across = Vec3::new(l.x, l.y, 0.0).try_normalize(1e-9).unwrap_or(Vec3::x());
    let local = match shape.kind {
        GeomKind::Plane => Vec3::zeros(),
        GeomKind::Sphere => l * s.x,
        GeomKind::Capsule => l * s.x + Vec3::z() * s.y.copysign(l.z),
        GeomKind::Ellipsoid => l.component_mul(&s).component_mul(&s) / l.component_mul(&s).norm(),
        GeomKind::Cylinder => across * s.x + Vec3::z() * s.y.copysign(l.z),
        GeomKind::Box => Vec3::from_fn(|k, _| s[k].copysign(l[k])),
    };
    at.pos + at.quat * local
}

impl Scene {
    /// The scene of that seed: up to three static things and one to four bodies, each set against an earlier one and
    /// moving towards it; half of them nearly flat against it.
    pub fn random(seed: u64, recipe: &Recipe) -> Scene {
        let mut random = Random::new(seed);
        let gravity = if recipe.gravity { random.vec3(3.0) - Vec3::z() * 9.81 } else { Vec3::zeros() };
        let mut scene = Scene { gravity, things: Vec::new() };
        let (least, statics) = if recipe.statics { (1, 1 + random.below(3)) } else { (2, 0) };
        let useful: Vec<GeomKind> = KINDS.into_iter().filter(|&k| recipe.has_partner(k)).collect();
        for i in 0..statics {
            let kind = random.pick(&useful);
            let pos = random.vec3(0.3);
            let shape = Shape { at: Pose { pos: Vec3::zeros(), quat: Quat::identity() }, ..shape(&mut random, kind) };
            let at = Pose { pos, quat: random.quat() };
            scene.things.push(Thing::new(format!("static{i}"), false, vec![shape], at));
        }
        for i in 0..least + random.below(5 - least) {
            for _ in 0..30 {
                let body = body(&mut random, format!("body{i}"), &scene, recipe);
                scene.things.push(body);
                if scene.deepest(recipe) < recipe.gap.max(-2e-3) {
                    scene.things.pop();
                } else {
                    break;
                }
            }
        }
        scene
    }

    /// The least distance between two things, as far as it is below 1 cm.
    fn deepest(&self, recipe: &Recipe) -> f64 {
        let mut near = self.clone();
        near.things.iter_mut().flat_map(|t| &mut t.shapes).for_each(|s| s.margin = 0.005);
        let Sim { model, state, mut data, .. } = near.sim("mujoco", Joints::Free, recipe);
        penny::dynamics::kinematics(&model, &state.qpos, &mut data);
        penny::collision::detect(&model, &mut data);
        data.contacts.iter().map(|c| c.dist).fold(0.01, f64::min)
    }

    /// The scene as MJCF. Every number is written with all its digits.
    pub fn xml(&self, joints: Joints, recipe: &Recipe) -> String {
        let g = self.gravity;
        let mut xml = format!(
            "<mujoco><option timestep='0.001' tolerance='1e-18' cone='{}' gravity='{} {} {}'/>\n\
             <custom><numeric name='penny.alpha' data='2'/></custom><worldbody>\n",
            recipe.cone, g.x, g.y, g.z
        );
        for thing in &self.things {
            // A moving body is at the world's origin in `qpos0`: then slides and a ball have a free joint's numbers.
            let joints = match joints {
                Joints::Free => "<freejoint/>",
                Joints::SlidesAndBall => {
                    "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/>\
                     <joint type='slide' axis='0 0 1'/><joint type='ball'/>"
                }
            };
            if thing.moves {
                write!(xml, "<body name='{}'>{joints}", thing.name).unwrap();
            } else {
                write!(xml, "<body name='{}'{}>", thing.name, pose(&thing.motion.at)).unwrap();
            }
            if let Some([mass, i]) = thing.round {
                write!(xml, "<inertial pos='0 0 0' mass='{mass}' diaginertia='{i} {i} {i}'/>").unwrap();
            }
            for shape in &thing.shapes {
                shape.write(&mut xml, recipe);
            }
            xml += "</body>\n";
        }
        xml + "</worldbody></mujoco>"
    }

    /// The scene at its start.
    pub fn sim(&self, law: &str, joints: Joints, recipe: &Recipe) -> Sim {
        let mut sim = Sim::law(&self.xml(joints, recipe), law);
        let moving = self.things.iter().filter(|t| t.moves);
        for (k, Motion { at, vel, omega }) in moving.map(|t| t.motion).enumerate() {
            let spin = at.quat.inverse() * omega;
            sim.state.qpos[7 * k..][..3].copy_from_slice(at.pos.as_slice());
            sim.state.qpos[7 * k + 3..][..4].copy_from_slice(&wxyz(&at.quat));
            sim.state.qvel[6 * k..][..3].copy_from_slice(vel.as_slice());
            sim.state.qvel[6 * k + 3..][..3].copy_from_slice(spin.as_slice());
        }
        sim
    }

    /// How the moving things move in a state, in the order of their names.
    pub fn motions(&self, sim: &Sim) -> Vec<Motion> {
        let (q, v) = (&sim.state.qpos, &sim.state.qvel);
        let moving = self.things.iter().filter(|t| t.moves).enumerate();
        let mut motions: Vec<_> = moving
            .map(|(k, thing)| {
                let at = Pose { pos: vec3(&q[7 * k..]), quat: quat(&q[7 * k + 3..]) };
                (&thing.name, Motion { at, vel: vec3(&v[6 * k..]), omega: at.quat * vec3(&v[6 * k + 3..]) })
            })
            .collect();
        motions.sort_by_key(|(name, _)| *name);
        motions.into_iter().map(|(_, motion)| motion).collect()
    }
}

impl Thing {
    fn new(name: String, moves: bool, shapes: Vec<Shape>, at: Pose) -> Thing {
        let motion = Motion { at, vel: Vec3::zeros(), omega: Vec3::zeros() };
        Thing { name, moves, shapes, motion, round: None }
    }
}

fn pose(at: &Pose) -> String {
    let (p, [w, x, y, z]) = (at.pos, wxyz(&at.quat));
    format!(" pos='{} {} {}' quat='{w} {x} {y} {z}'", p.x, p.y, p.z)
}

impl Shape {
    /// Kinds that may touch share a bit: contype has one bit a kind, conaffinity those of its partners.
    fn write(&self, xml: &mut String, recipe: &Recipe) {
        let Shape { kind, size, at, mass, condim, friction: [slide, spin, roll], solref: [tau, zeta], margin } = self;
        let bit = |kind: GeomKind| 1 << kind as usize;
        let partners: u32 = KINDS.into_iter().filter(|&k| recipe.touches(k, *kind)).map(bit).sum();
        write!(
            xml,
            "<geom type='{}' size='{} {} {}'{} mass='{mass}' condim='{condim}' friction='{slide} {spin} {roll}' \
             solref='{tau} {zeta}' margin='{margin}' contype='{}' conaffinity='{partners}'/>",
            kind.name(),
            size.x,
            size.y,
            size.z,
            pose(at),
            bit(*kind),
        )
        .unwrap();
    }
}

/// A shape of 3 to 12 cm, somewhat off the origin of its body.
fn shape(random: &mut Random, kind: GeomKind) -> Shape {
    Shape {
        kind,
        size: Vec3::from_fn(|_, _| random.within(0.03, 0.12)),
        at: Pose { pos: random.vec3(0.03), quat: random.quat() },
        mass: random.scale(0.1, 10.0),
        condim: random.pick(&[1, 3, 4, 6]),
        friction: [random.within(0.1, 1.0), random.within(1e-3, 1e-2), random.within(1e-4, 1e-3)],
        solref: [random.within(0.006, 0.03), random.within(0.5, 1.5)],
        margin: if random.chance(0.3) { random.within(0.0, 3e-3) } else { 0.0 },
    }
}

/// A body of one or two shapes against one of the things that are there.
fn body(random: &mut Random, name: String, scene: &Scene, recipe: &Recipe) -> Thing {
    let targets: Vec<&Thing> = scene.things.iter().filter(|t| recipe.has_partner(t.shapes[0].kind)).collect();
    let target = (!targets.is_empty()).then(|| random.pick(&targets));
    let movable: Vec<GeomKind> = KINDS[1..].iter().copied().filter(|&k| recipe.movable(k)).collect();
    let fits = |&kind: &GeomKind| target.is_none_or(|t| recipe.touches(kind, t.shapes[0].kind));
    let fitting: Vec<GeomKind> = movable.iter().copied().filter(fits).collect();
    let kind = random.pick(&fitting);
    let mut shapes = vec![shape(random, kind)];
    if random.chance(0.4) {
        let kind = random.pick(&movable);
        let second = shape(random, kind);
        shapes.push(Shape { at: Pose { pos: random.vec3(0.08), ..second.at }, ..second });
    }
    let mut thing = Thing::new(name, true, shapes, Pose { pos: random.vec3(0.3), quat: random.quat() });
    thing.motion.omega = random.vec3(3.0);
    thing.motion.vel = random.vec3(0.2);
    if recipe.round {
        let mass = random.scale(0.1, 10.0);
        thing.round = Some([mass, 0.4 * mass * random.within(0.05, 0.12).powi(2)]);
    }
    let Some(target) = target else { return thing };

    // Set the first shape's nearest point against the target's, along a random direction, or along one of its axes
    // and nearly turned like it.
    let (its, first) = (&target.shapes[0], thing.shapes[0].clone());
    let target_at = target.motion.at.then(&its.at);
    let flat = random.chance(0.5);
    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
    let d = match its.kind {
        GeomKind::Plane => target_at.quat * Vec3::z(),
        _ if flat => target_at.quat * Vec3::ith(random.below(3), sign),
        _ => random.unit(),
    };
    if flat {
        let quarter = exp(&(Vec3::ith(random.below(3), std::f64::consts::FRAC_PI_2) * random.below(2) as f64));
        let lean = random.unit() * random.within(0.01, 0.1);
        thing.motion.at.quat = exp(&lean) * target_at.quat * quarter * first.at.quat.inverse();
    }
    let gap = recipe.gap + random.within(0.0, 2e-3);
    let reach = |from: Vec3, s: &Shape, at: &Pose, d: &Vec3| d * d.dot(&(support(s, at, d) - from));
    let lateral = random.vec3(0.04);
    let placed = thing.motion.at.then(&first.at);
    let (to, from) = if flat {
        // Centres above one another, some way off.
        let aside = lateral - d * d.dot(&lateral);
        (reach(target_at.pos, its, &target_at, &d) + target_at.pos + aside, reach(placed.pos, &first, &placed, &-d))
    } else {
        (
            support(its, &target_at, &d) + (lateral - d * d.dot(&lateral)) * 0.2,
            support(&first, &placed, &-d) - placed.pos,
        )
    };
    let center = to + d * gap - from;
    thing.motion.at.pos += center - placed.pos;
    thing.motion.vel += target.motion.vel - d * random.within(0.3, 1.2);
    thing
}

/// A change of the world that leaves its physics as it is: first a mirror (y → −y), then a turn, then a shift.
#[derive(Clone, Copy, Debug)]
pub struct Isometry {
    pub mirror: bool,
    pub turn: Quat,
    pub shift: Vec3,
}

impl Isometry {
    pub fn identity() -> Isometry {
        Isometry { mirror: false, turn: Quat::identity(), shift: Vec3::zeros() }
    }
    fn mirrored(&self, v: &Vec3) -> Vec3 {
        if self.mirror { Vec3::new(v.x, -v.y, v.z) } else { *v }
    }
    pub fn vector(&self, v: &Vec3) -> Vec3 {
        self.turn * self.mirrored(v)
    }
    /// An angular velocity turns the other way round in a mirror.
    fn axial(&self, v: &Vec3) -> Vec3 {
        self.vector(v) * if self.mirror { -1.0 } else { 1.0 }
    }
    /// A pose within a body. All shapes look the same in the mirror planes of their own axes, so that the mirror image
    /// of R is S R S with S = diag(1, −1, 1).
    fn local(&self, at: &Pose) -> Pose {
        let [w, x, y, z] = wxyz(&at.quat);
        let quat = if self.mirror { quat(&[w, -x, y, -z]) } else { at.quat };
        Pose { pos: self.mirrored(&at.pos), quat }
    }
    pub fn motion(&self, m: &Motion) -> Motion {
        let image = self.local(&m.at);
        let at = Pose { pos: self.turn * image.pos + self.shift, quat: self.turn * image.quat };
        Motion { at, vel: self.vector(&m.vel), omega: self.axial(&m.omega) }
    }
    pub fn scene(&self, scene: &Scene) -> Scene {
        let mut image = scene.clone();
        image.gravity = self.vector(&scene.gravity);
        for thing in &mut image.things {
            thing.motion = self.motion(&thing.motion);
            thing.shapes.iter_mut().for_each(|s| s.at = self.local(&s.at));
        }
        image
    }
}

/// The largest difference between two motions: m, rad, m/s, rad/s.
pub fn difference(a: &[Motion], b: &[Motion]) -> f64 {
    let of = |(a, b): (&Motion, &Motion)| {
        let axes: [Mat3; 2] = [mat(&a.at.quat), mat(&b.at.quat)];
        let turn = (axes[0] - axes[1]).abs().max();
        let [pos, vel, omega] = [a.at.pos - b.at.pos, a.vel - b.vel, a.omega - b.omega].map(|v| v.abs().max());
        pos.max(turn).max(vel).max(omega)
    };
    assert_eq!(a.len(), b.len());
    // A number that is not one must not pass for a small difference.
    a.iter().zip(b).map(of).fold(0.0, |worst, x| if x.is_nan() { f64::INFINITY } else { worst.max(x) })
}
