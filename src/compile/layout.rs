//! Bodies, joints, dofs, geoms and trees, numbered in MuJoCo's depth-first order; everything but masses.

use std::cell::OnceCell;

use super::frames::{self, EPS, NoDirection};
use super::{Log, Names};
use crate::dynamics::fluid;
use crate::math::{Quat, Vec3};
use crate::mesh::Mesh;
use crate::mjcf::{NodeId, ProblemKind, Spec, spec};
use crate::model::{Body, Camera, Dof, Geom, GeomKind, Joint, JointKind, Site, Tree, Visual};

/// The scene laid out, each item with the element it came from.
pub struct World<'a> {
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    pub dofs: Vec<Dof>,
    pub geoms: Vec<Geom>,
    pub sites: Vec<Site>,
    pub cameras: Vec<Camera>,
    pub visuals: Vec<Visual>,
    pub trees: Vec<Tree>,
    pub mocap: Vec<usize>,
    pub qpos0: Vec<f64>,
    pub body_specs: Vec<&'a spec::Body>,
    pub joint_specs: Vec<&'a spec::Joint>,
    pub geom_specs: Vec<&'a spec::Geom>,
    pub camera_specs: Vec<&'a spec::Camera>,
    /// Each with its body.
    pub visual_specs: Vec<(usize, &'a spec::Visual)>,
}

impl World<'_> {
    pub fn body_names(&self) -> Names<'_> {
        Names::new("body", self.bodies.iter().map(|b| b.name.as_str()))
    }
    pub fn geom_names(&self) -> Names<'_> {
        let seen = self.visual_specs.iter().filter_map(|(_, visual)| visual.name.as_deref()).collect();
        Names { only_seen: seen, ..Names::new("geom", self.geoms.iter().map(|g| g.name.as_str())) }
    }
    pub fn site_names(&self) -> Names<'_> {
        Names::new("site", self.sites.iter().map(|s| s.name.as_str()))
    }
    pub fn joint_names(&self) -> Names<'_> {
        Names::new("joint", self.joints.iter().map(|j| j.name.as_str()))
    }
}

pub fn lay_out<'a>(spec: &'a Spec, log: &mut Log) -> World<'a> {
    let mut world = World {
        bodies: Vec::new(),
        joints: Vec::new(),
        dofs: Vec::new(),
        geoms: Vec::new(),
        sites: Vec::new(),
        cameras: Vec::new(),
        visuals: Vec::new(),
        trees: Vec::new(),
        mocap: Vec::new(),
        qpos0: Vec::new(),
        body_specs: Vec::new(),
        joint_specs: Vec::new(),
        geom_specs: Vec::new(),
        camera_specs: Vec::new(),
        visual_specs: Vec::new(),
    };
    reserve(&mut world, &spec.world);
    add_body(&mut world, &spec.world, 0, &spec.compiler, log);
    world.bodies[0].name = "world".into();
    let targets = targets(&world, log);
    world.cameras.iter_mut().zip(targets).for_each(|(camera, target)| camera.target = target);
    world
}

/// Room for a body, what is attached to it, and its children: large arrays are not moved while they grow.
fn reserve(world: &mut World, body: &spec::Body) {
    let (mut bodies, mut geoms, mut joints, mut dofs) = (0, 0, 0, 0);
    let mut open = vec![body];
    while let Some(body) = open.pop() {
        (bodies, geoms, joints) = (bodies + 1, geoms + body.geoms.len(), joints + body.joints.len());
        dofs += body.joints.iter().map(|j| j.kind.nv()).sum::<usize>();
        open.extend(&body.children);
    }
    world.bodies.reserve_exact(bodies);
    world.body_specs.reserve_exact(bodies);
    world.trees.reserve_exact(body.children.len());
    world.geoms.reserve_exact(geoms);
    world.geom_specs.reserve_exact(geoms);
    world.joints.reserve_exact(joints);
    world.joint_specs.reserve_exact(joints);
    world.dofs.reserve_exact(dofs);
}

/// Adds a body, what is attached to it, and its children.
fn add_body<'a>(world: &mut World<'a>, body: &'a spec::Body, parent: usize, compiler: &spec::Compiler, log: &mut Log) {
    let id = world.bodies.len();
    let (pos, quat) = pose_or_report(&body.pose, body.node, compiler, log);

    // What moves with this body: itself where it has joints, otherwise whatever moves its parent.
    let moves = !body.joints.is_empty();
    let placed = body.mocap && !moves;
    let inherited = if id == 0 { (0, None) } else { (world.bodies[parent].weld, world.bodies[parent].tree) };
    let starts_tree = moves && inherited.1.is_none();
    let tree = if starts_tree { Some(world.trees.len()) } else { inherited.1 };
    let joints = world.joints.len()..world.joints.len() + body.joints.len();
    let dofs = world.dofs.len()..world.dofs.len() + body.joints.iter().map(|j| j.kind.nv()).sum::<usize>();
    let geoms = world.geoms.len()..world.geoms.len() + body.geoms.len();
    let qpos_start = world.qpos0.len();
    world.bodies.push(Body {
        name: body.name.clone().unwrap_or_default(),
        parent,
        pos,
        quat,
        ipos: Vec3::zeros(),
        iquat: Quat::identity(),
        mass: 0.0,
        inertia: Vec3::zeros(),
        joints,
        dofs,
        geoms,
        weld: if moves || placed { id } else { inherited.0 },
        tree,
        invweight0: [0.0; 2],
        gravcomp: body.gravcomp,
    });
    if placed {
        world.mocap.push(id);
    }
    world.body_specs.push(body);
    if starts_tree {
        let dof = world.dofs.len();
        let tree = Tree { bodies: id..id, dofs: dof..dof, qpos: qpos_start..qpos_start, free: None, rotates: false };
        world.trees.push(tree);
    }

    check_joints(body, log);
    for joint in &body.joints {
        add_joint(world, joint, id, compiler, log);
    }
    for geom in &body.geoms {
        add_geom(world, geom, id, compiler, log);
    }
    for site in &body.sites {
        add_site(world, site, id, compiler, log);
    }
    for visual in &body.visuals {
        let (pos, quat) = pose_or_report(&visual.pose, visual.node, compiler, log);
        let shown = visual.mesh.clone().filter(|mesh| !visual.fitted && Mesh::is_known(&mesh.path));
        world.visuals.extend(shown.map(|mesh| Visual { body: id, pos, quat, mesh, rgba: visual.rgba }));
        world.visual_specs.push((id, visual));
    }
    for camera in &body.cameras {
        let (pos, quat) = pose_or_report(&camera.pose, camera.node, compiler, log);
        let name = camera.name.clone().unwrap_or_default();
        // Which body that is shows when all bodies are there.
        let (mode, fovy) = (camera.mode, camera.fovy.to_radians());
        world.cameras.push(Camera { name, body: id, pos, quat, mode, target: None, fovy });
        world.camera_specs.push(camera);
    }
    for child in &body.children {
        add_body(world, child, id, compiler, log);
    }
    if let (true, Some(t)) = (starts_tree, tree) {
        let root = id;
        let tree = &mut world.trees[t];
        tree.bodies.end = world.bodies.len();
        tree.dofs.end = world.dofs.len();
        tree.qpos.end = world.qpos0.len();
        let joints = &world.joints[world.bodies[root].joints.start..];
        // What hangs on a mocap body is turned with it.
        let carried = world.bodies[parent].weld != 0;
        tree.rotates = carried || joints.iter().any(|j| j.kind != JointKind::Slide);
    }
}

/// The pose of a body or geom, or the identity after a report.
#[inline(never)]
fn pose_or_report(pose: &spec::Pose, node: NodeId, compiler: &spec::Compiler, log: &mut Log) -> (Vec3, Quat) {
    frames::pose(pose, compiler).unwrap_or_else(|kind| {
        no_direction(node, kind, log);
        (Vec3::zeros(), Quat::identity())
    })
}

/// Reports a direction that is none, at the attribute that holds it.
pub fn no_direction(node: NodeId, what: NoDirection, log: &mut Log) {
    let kind = ProblemKind::NoDirection {
        element: log.document.node(node).name.to_string(),
        attribute: what.attribute.into(),
        why: what.why.into(),
    };
    if what.in_frame {
        log.error(node, kind, "it stands in a `<frame>` around this element");
    } else {
        log.value_error(node, what.attribute, kind, "");
    }
}

/// Rules about the joints of one body together.
#[inline(never)]
fn check_joints(body: &spec::Body, log: &mut Log) {
    let joints = &body.joints;
    let dofs: usize = joints.iter().map(|j| j.kind.nv()).sum();
    if dofs > 6 {
        log.error(body.node, ProblemKind::TooManyDofs { dofs }, "remove joints, or split the body in two");
    }
    let turns = |j: &&spec::Joint| matches!(j.kind, JointKind::Ball | JointKind::Hinge);
    if let Some(ball) = joints.iter().position(|j| j.kind == JointKind::Ball)
        && let Some(other) = joints[ball + 1..].iter().find(turns)
    {
        log.error(other.node, ProblemKind::TurnAfterBall, "a ball joint already turns the body in all ways");
        log.related(joints[ball].node, "the ball joint");
    }
}

#[inline(never)]
fn add_joint<'a>(world: &mut World<'a>, joint: &'a spec::Joint, body: usize, compiler: &spec::Compiler, log: &mut Log) {
    // Free joints have neither anchor nor axis: they are the body's frame.
    let (pos, axis) = match joint.kind {
        JointKind::Free => (Vec3::zeros(), Vec3::z()),
        _ => anchor_and_axis(joint, compiler, log),
    };
    let id = world.joints.len();
    let qposadr = world.qpos0.len();
    let dofadr = world.dofs.len();
    let radian = |x: f64| if compiler.degree && joint.kind == JointKind::Hinge { x.to_radians() } else { x };
    match joint.kind {
        JointKind::Free => {
            let place = &world.bodies[body];
            let (p, q) = (place.pos, crate::math::wxyz(&place.quat));
            world.qpos0.extend([p.x, p.y, p.z, q[0], q[1], q[2], q[3]]);
        }
        JointKind::Ball => world.qpos0.extend([1.0, 0.0, 0.0, 0.0]),
        JointKind::Slide | JointKind::Hinge => world.qpos0.push(radian(joint.reference)),
    }
    world.joints.push(Joint {
        name: joint.name.clone().unwrap_or_default(),
        kind: joint.kind,
        body,
        pos,
        axis,
        qposadr,
        dofadr,
        // One that is to be found has some for the time being.
        stiffness: if joint.springdamper.is_some() { 1.0 } else { joint.stiffness },
        springref: radian(joint.springref),
        range: range(joint, compiler, log),
        margin: joint.margin,
        actfrcrange: force_range(joint, compiler, log),
        actgravcomp: joint.actuatorgravcomp,
        solref_limit: joint.solreflimit,
        solimp_limit: joint.solimplimit,
        solref_friction: joint.solreffriction,
        solimp_friction: joint.solimpfriction,
    });
    world.joint_specs.push(joint);
    let damping = if joint.springdamper.is_some() { 0.0 } else { joint.damping };
    let (armature, frictionloss) = (joint.armature, joint.frictionloss);
    let dof = Dof { joint: id, body, damping, armature, frictionloss, invweight0: 0.0 };
    world.dofs.extend(std::iter::repeat_n(dof, joint.kind.nv()));
}

/// The bounds of all actuators of a slide or hinge together.
fn force_range(joint: &spec::Joint, compiler: &spec::Compiler, log: &mut Log) -> Option<[f64; 2]> {
    if !matches!(joint.kind, JointKind::Slide | JointKind::Hinge) {
        return None;
    }
    let [low, high] = joint.actuatorfrcrange.unwrap_or_default();
    let limited = joint.actuatorfrclimited.unwrap_or(low < high);
    if limited && low >= high {
        let help = "give the smaller number first";
        log.value_error(joint.node, "actuatorfrcrange", ProblemKind::RangeEmpty { low, high }, help);
    }
    if joint.actuatorfrclimited.is_none() && [low, high] != [0.0, 0.0] && !compiler.autolimits {
        let help = "say whether it is limited, or drop `autolimits=\"false\"` from `<compiler>`";
        log.value_error(joint.node, "actuatorfrcrange", ProblemKind::RangeWithoutLimited, help);
    }
    limited.then_some([low, high])
}

fn anchor_and_axis(joint: &spec::Joint, compiler: &spec::Compiler, log: &mut Log) -> (Vec3, Vec3) {
    let place = (Vec3::from(joint.pos), Quat::identity());
    let (pos, turn) = frames::in_frames(&joint.frames, place, compiler).unwrap_or_else(|kind| {
        no_direction(joint.node, kind, log);
        place
    });
    let axis = Vec3::from(joint.axis);
    if joint.kind == JointKind::Ball {
        return (pos, Vec3::z());
    }
    if axis.norm() < EPS {
        no_direction(joint.node, NoDirection::new("axis", frames::TOO_SHORT), log);
        return (pos, Vec3::z());
    }
    (pos, turn * (axis / axis.norm()))
}

/// The limits of a joint in m or rad, if it has any. An empty range was reported by the reader.
fn range(joint: &spec::Joint, compiler: &spec::Compiler, log: &mut Log) -> Option<[f64; 2]> {
    let held = joint.kind == JointKind::Ball && joint.limited == Some(true);
    let given = if held { Some(joint.range.unwrap_or_default()) } else { joint.range };
    if joint.kind == JointKind::Free || joint.limited == Some(false) {
        return None;
    }
    // Also where it is empty; 0 0 is none.
    if joint.limited.is_none() && !compiler.autolimits && given.is_some_and(|range| range != [0.0, 0.0]) {
        let help = "write `limited=\"true\"`, or drop `autolimits=\"false\"` from `<compiler>`";
        log.value_error(joint.node, "range", ProblemKind::RangeWithoutLimited, help);
    }
    let [low, high] = given.filter(|[low, high]| held || low < high)?;
    if joint.kind == JointKind::Ball && low != 0.0 {
        let help = format!("a ball joint is limited by its angle alone: \"0 {high}\"");
        log.value_error(joint.node, "range", ProblemKind::BallRangeStart { low }, help);
    }
    let turns = matches!(joint.kind, JointKind::Ball | JointKind::Hinge);
    let radian = |x: f64| if compiler.degree && turns { x.to_radians() } else { x };
    Some([radian(low), radian(high)])
}

#[inline(never)]
fn add_geom<'a>(world: &mut World<'a>, geom: &'a spec::Geom, body: usize, compiler: &spec::Compiler, log: &mut Log) {
    if geom.kind == GeomKind::Plane && world.bodies[body].weld != 0 {
        let help = "a plane is the surface of a half-space: attach it to `worldbody`, or use a flat box here";
        log.error(geom.node, ProblemKind::PlaneMoves { body: label("body", &world.bodies[body].name, body) }, help);
    }
    let (pos, quat, size) = place(geom, compiler, log);
    let mut made = Geom {
        name: geom.name.clone().unwrap_or_default(),
        kind: geom.kind,
        body,
        pos,
        quat,
        size,
        rbound: bounding_radius(geom.kind, &size),
        contype: geom.contype,
        conaffinity: geom.conaffinity,
        condim: geom.condim,
        group: geom.group,
        priority: geom.priority,
        friction: geom.friction,
        solmix: geom.solmix,
        solref: geom.solref,
        solimp: geom.solimp,
        margin: geom.margin,
        gap: geom.gap,
        fluid: None,
        rgba: geom.rgba,
    };
    made.fluid = geom.fluid.as_deref().map(|coef| fluid::virtual_inertia(*coef, &fluid::semiaxes(&made)).into());
    world.geoms.push(made);
    world.geom_specs.push(geom);
}

fn add_site(world: &mut World, site: &spec::Site, body: usize, compiler: &spec::Compiler, log: &mut Log) {
    let between = site.fromto.as_ref().map(frames::fromto).transpose().and_then(|between| match between {
        Some((pos, quat, half)) => {
            frames::in_frames(&site.pose.frames, (pos, quat), compiler).map(|(pos, quat)| (pos, quat, Some(half)))
        }
        None => frames::pose(&site.pose, compiler).map(|(pos, quat)| (pos, quat, None)),
    });
    let (pos, quat, half) = between.unwrap_or_else(|kind| {
        no_direction(site.node, kind, log);
        (Vec3::zeros(), Quat::identity(), None)
    });
    if let Some(kind) = site.kind {
        check_site(site, kind, log);
    }
    let [x, y, z] = site.size;
    let size = match (half, site.kind) {
        (Some(half), Some(GeomKind::Capsule | GeomKind::Cylinder)) => Vec3::new(x, half, z),
        (Some(half), Some(GeomKind::Box | GeomKind::Ellipsoid)) => Vec3::new(x, x, half),
        _ => Vec3::new(x, y, z),
    };
    let name = site.name.clone().unwrap_or_default();
    world.sites.push(Site { name, body, pos, quat, kind: site.kind, size });
}

/// Reports a site whose shape has no size or cannot lie between two points, as MuJoCo does.
fn check_site(site: &spec::Site, kind: GeomKind, log: &mut Log) {
    if site.fromto.is_some() && kind == GeomKind::Sphere {
        return fromto_shape(site.node, kind, log);
    }
    let needs = if site.fromto.is_some() { &dimensions(kind)[..1] } else { dimensions(kind) };
    if let Some((what, &value)) = needs.iter().zip(&site.size).find(|(_, size)| **size <= 0.0) {
        not_positive(site.node, kind, what, value, log);
    }
}

fn fromto_shape(node: NodeId, kind: GeomKind, log: &mut Log) {
    let help = "`fromto` is for capsule, cylinder, box and ellipsoid; give this one `pos`";
    log.value_error(node, "fromto", ProblemKind::FromtoShape { shape: kind.name() }, help);
}

fn not_positive(node: NodeId, kind: GeomKind, what: &'static str, value: f64, log: &mut Log) {
    let problem = ProblemKind::SizeNotPositive { shape: kind.name(), what, value };
    log.value_error(node, "size", problem, "sizes are lengths in metres, above zero");
}

/// The body that each camera looks at.
fn targets(world: &World, log: &mut Log) -> Vec<Option<usize>> {
    let names = OnceCell::new();
    let mut target = |camera: &&spec::Camera| {
        let name = camera.target.as_ref()?;
        names.get_or_init(|| world.body_names()).find(name, camera.node, "target", log)
    };
    world.camera_specs.iter().map(&mut target).collect()
}

/// Pose in the body's frame, and size (m).
fn place(geom: &spec::Geom, compiler: &spec::Compiler, log: &mut Log) -> (Vec3, Quat, Vec3) {
    let Some(points) = &geom.fromto else {
        let (pos, quat) = pose_or_report(&geom.pose, geom.node, compiler, log);
        return (pos, quat, size(geom, None, log));
    };
    if matches!(geom.kind, GeomKind::Plane | GeomKind::Sphere) {
        fromto_shape(geom.node, geom.kind, log);
        return (Vec3::zeros(), Quat::identity(), size(geom, None, log));
    }
    let between = frames::fromto(points);
    let half = between.as_ref().ok().map(|b| b.2);
    let placed = between.and_then(|b| frames::in_frames(&geom.pose.frames, (b.0, b.1), compiler));
    let (pos, quat) = placed.unwrap_or_else(|kind| {
        no_direction(geom.node, kind, log);
        (Vec3::zeros(), Quat::identity())
    });
    (pos, quat, size(geom, Some(half.unwrap_or(1.0)), log))
}

/// "1 number", "3 numbers"
pub fn numbers(n: usize) -> String {
    format!("{n} number{}", if n == 1 { "" } else { "s" })
}

/// "1 is", "3 are"
pub fn given(n: usize) -> String {
    format!("{n} {}", if n == 1 { "is" } else { "are" })
}

/// What the numbers of `size` mean for a shape.
fn dimensions(kind: GeomKind) -> &'static [&'static str] {
    match kind {
        GeomKind::Plane => &["half-width along x", "half-width along y", "grid spacing"],
        GeomKind::Sphere => &["radius"],
        GeomKind::Capsule | GeomKind::Cylinder => &["radius", "half-length"],
        GeomKind::Ellipsoid => &["half-axis x", "half-axis y", "half-axis z"],
        GeomKind::Box => &["half-width x", "half-width y", "half-width z"],
    }
}

/// The size of a geom, m; `half` is the half-length of one that has `fromto`.
fn size(geom: &spec::Geom, half: Option<f64>, log: &mut Log) -> Vec3 {
    let kind = geom.kind;
    let needs = dimensions(kind);
    let mut size = [0.0; 3];
    for (i, what) in needs.iter().enumerate() {
        if half.is_some() && i > 0 {
            break;
        }
        let Some(&value) = geom.size[..geom.sizes].get(i) else {
            let needs = if half.is_some() { &needs[..1] } else { needs };
            let problem =
                ProblemKind::SizeMissing { shape: kind.name(), needs: numbers(needs.len()), given: given(geom.sizes) };
            log.value_error(geom.node, "size", problem, format!("`size` is: {}", needs.join(", ")));
            return Vec3::repeat(1.0);
        };
        // The half-widths of a plane say only how much of it is drawn; 0 is "without end".
        let fine = value > 0.0 || (kind == GeomKind::Plane && i < 2 && value >= 0.0);
        if !fine {
            not_positive(geom.node, kind, what, value, log);
            return Vec3::repeat(1.0);
        }
        size[i] = value;
    }
    match (half, kind) {
        (Some(half), GeomKind::Capsule | GeomKind::Cylinder) => Vec3::new(size[0], half, 0.0),
        (Some(half), _) => Vec3::new(size[0], size[0], half),
        (None, _) => Vec3::from(size),
    }
}

/// Radius (m) of a ball about the centre that holds the whole shape; 0 for a plane, which has no such ball.
pub fn bounding_radius(kind: GeomKind, size: &Vec3) -> f64 {
    match kind {
        GeomKind::Plane => 0.0,
        GeomKind::Sphere => size.x,
        GeomKind::Capsule => size.x + size.y,
        GeomKind::Cylinder => size.x.hypot(size.y),
        GeomKind::Ellipsoid => size.max(),
        GeomKind::Box => size.norm(),
    }
}

/// A body, geom or joint as messages call it: by its name, or else by its number.
pub fn label(of: &str, name: &str, index: usize) -> String {
    if name.is_empty() { format!("{of} {index}") } else { format!("{of} `{name}`") }
}
