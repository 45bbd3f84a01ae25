//! Contact laws: depth and rate in, force out. The list [`ALL`] is the only place that knows their names.
//!
//! All laws share one way, [`constrain`]:
//!
//!     contacts, limits, dry friction, equalities → islands → rows of J → solve(island) → a, f → qacc, qfrc_constraint
//!
//! | file | what |
//! |---|---|
//! | `joint_rows` | limits of joints that are near, and their dry friction |
//! | `ties` | equalities, and limits and dry friction of tendons |
//! | `islands`, `disjoint_sets` | which trees constraints hold together |
//! | `island` | the constraints of one island, and where its results go |
//! | `unit_mass`, `rows` | coordinates in which every tree has unit mass; rows of J in them, and Newton's matrix |
//! | `chains` | the same rows and matrix where each constraint acts on one chain of one tree |
//! | `impedance`, `per_mix`, `constants` | what `solref` and `solimp` mean |
//! | `cost`, `curvature`, `newton` | convex problems in the accelerations, and Newton's method for them |
//! | `block_factor`, `six` | linear systems: of blocks that trees share, and of six unknowns |
//! | `free_bodies` | free bodies without rows, where a law tries the last step's solution |
//! | `tangent` | forces at known accelerations and their derivatives, for implicit steps |
//! | `pointwise` | for laws that are a formula for one contact point |
//! | `describe` | what a law says of itself to `explain` and `compare` |
//! | `penalty`, `mujoco`, `tutorial` | the laws |

/// Calls a kernel with a size that the compiler knows, so that it unrolls the loops: 6 for free bodies, nearly all there is,
/// and even ones for a tree alone.
macro_rules! sized {
    ($size:expr, $n:ident => $work:expr) => {
        sized!($size, $n => $work, 6 8 10 12 14 16)
    };
    ($size:expr, $n:ident => $work:expr, $($known:literal)*) => {
        match $size {
            $($known => {
                let $n = $known;
                $work
            })*
            $n => $work,
        }
    };
}

mod block_factor;
mod chains;
pub mod constants;
mod cost;
mod curvature;
pub mod describe;
mod disjoint_sets;
pub mod free_bodies;
pub mod impedance;
pub mod island;
mod islands;
mod joint_rows;
pub mod mujoco;
mod newton;
pub mod penalty;
mod per_mix;
pub mod pointwise;
mod rows;
mod six;
pub mod tangent;
pub(crate) mod ties;
pub mod tutorial;
mod unit_mass;

use crate::data::{Contact, Data, Outcome, Scratchpad};
use crate::math::Vec3;
use crate::model::{Mix, Model};
use crate::state::{Start, State};
use describe::{Ask, Description, Unlike};
use free_bodies::{FreeBodies, Room};
use island::Island;
use islands::{Alone, Islands};

/// A contact law.
#[derive(Clone, Copy)]
pub struct Law {
    /// CLI name.
    pub name: &'static str,
    /// One line for `--help`, plots and docs.
    pub about: &'static str,
    /// Whether it also enforces limits and dry friction of joints and tendons, and equalities.
    pub joints: bool,
    /// What of the last step it starts from.
    pub start: Start,
    /// Whether its forces depend on the timestep: then an error estimate from one step does not see all.
    pub by_timestep: bool,
    /// What lets its search for forces come nearer where that did not converge; empty if it does not search.
    pub nearer: &'static str,
    /// Where its forces act.
    pub lever: Lever,
    /// Finds the forces of an island's constraints and the accelerations that they cause.
    ///
    /// Reads: the rows of the island, `smooth`. Writes: `w`, and `force` of the constraints.
    pub solve: fn(&Task, &mut Scratchpad, &mut Island) -> Outcome,
    /// Writes cone and bias of each constraint, if the forces depend on accelerations: then they are
    /// f = −∂s/∂x at x = J a + bias. `None`: `solve` finds the forces from positions and velocities alone.
    pub pose: Option<fn(&Task, &mut Scratchpad, &mut Island)>,
    /// A faster way to the same forces for free bodies; see [`Shortcut`].
    pub shortcut: Option<Shortcut>,
    /// A formula for a ball that touches one thing that never moves.
    pub balls: Option<Balls>,
    /// Coefficients of friction that it uses for a mix: two sliding (1), spinning (m), two rolling (m).
    pub friction: fn(&Model, &Mix) -> [f64; 5],
    /// What it makes of a contact, as far as it has formulas; [`describe::nothing`] if it has none.
    pub describe: fn(&Ask) -> Description,
    /// How its forces differ from MuJoCo's; `None` gives no reason.
    pub unlike: Option<Unlike>,
}

/// Finds the forces of an island of free bodies and their accelerations (into the room, of their movers), and returns the residual
/// that is left, or says that it cannot: then the general way is taken.
pub type Shortcut = fn(&Task, &mut Scratchpad, &FreeBodies, &mut [Contact], &mut Room) -> Option<f64>;

/// The forces of balls of which each touches one thing that never moves, where they are a formula.
#[derive(Clone, Copy)]
pub struct Balls {
    /// Whether they are for contacts of that mix.
    pub has: fn(&Model, &Mix) -> bool,
    /// Finds the forces of the contacts, and the accelerations of the movers (into the room).
    pub solve: fn(&Task, &mut Scratchpad, &[Alone], &mut [Contact], &mut Room),
}

/// What contact laws need to know of how a step is taken.
#[derive(Clone, Copy)]
pub struct Settings {
    /// The law.
    pub law: &'static Law,
    /// s
    pub timestep: f64,
    /// Newton steps at most, in each island.
    pub rounds: usize,
    /// The state is that of the end of the step: velocities are not extrapolated.
    pub implicit: bool,
}

/// What a law is asked about.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The scene.
    pub model: &'a Model,
    /// Law, timestep and limits of the work.
    pub settings: &'a Settings,
    /// Positions and velocities.
    pub state: &'a State,
    /// Kinematics, contacts, accelerations without constraints.
    pub data: &'a Data,
}

/// Where contact forces act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lever {
    /// Midway between the two surfaces, as in MuJoCo.
    Midpoint,
    /// At a moving body's own surface if the other one never moves; midway between two moving bodies, so that action
    /// equals reaction. A sphere that has sunk in by 0.4 mm thus rolls on its full radius.
    Surface,
}

/// The default comes first.
pub const ALL: &[&Law] = &[&penalty::LAW, &mujoco::LAW, &tutorial::LAW];

/// The law of scenes that name none.
pub fn default() -> &'static Law {
    ALL[0]
}

/// The law of that name.
pub fn by_name(name: &str) -> Option<&'static Law> {
    ALL.iter().copied().find(|law| law.name == name)
}

/// What stays between steps, to allocate nothing.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    islands: Islands,
    island: Island,
    room: Room,
    own: Scratchpad,
}

impl Scratch {
    /// That of a pad, which is empty if the data is a clone.
    fn of<'a>(pad: &'a mut Scratchpad, model: &Model, data: &Data) -> &'a mut Scratch {
        let scratch = pad.get::<Scratch>();
        if !scratch.islands.fit(model) {
            *scratch = Scratch::new(model, data.contacts.len(), data.joint_rows.len(), data);
        }
        scratch
    }

    /// Room for all contacts and joint rows that a model can have, and all its ties.
    pub fn new(model: &Model, contacts: usize, joints: usize, data: &Data) -> Scratch {
        let mut scratch = Scratch::default();
        let (ties, numbers) = (data.plan.most_ties(model), data.plan.equality_numbers + 3 * data.plan.tendon_numbers);
        scratch.islands.reserve(model, contacts, joints, ties);
        scratch.room.reserve(model, contacts);
        // Rows of a tree are padded, to six numbers at least.
        scratch.island.reserve(model, &data.plan.pattern, contacts, joints, ties, 6 * numbers);
        scratch
    }
}

/// Forces of all contacts, joint limits and dry friction under the law of `settings`, and what they do.
///
///     M qacc = M qacc_smooth + qfrc_constraint,   qfrc_constraint = Jᵀ f
///
/// Reads:  state, kinematics, contacts, qacc_smooth. Writes: qacc, qfrc_constraint, forces of contacts and joint rows.
pub fn constrain(model: &Model, settings: &Settings, state: &State, data: &mut Data) {
    constrain_with(model, settings, state, data, chained);
}

/// [`constrain`], where `chained` says which islands are assembled chain by chain.
fn constrain_with(
    model: &Model,
    settings: &Settings,
    state: &State,
    data: &mut Data,
    chained: impl Fn(&Task, &Islands, usize) -> bool,
) {
    data.qfrc_constraint.fill(0.0);
    data.solver = Outcome::default();
    let law = settings.law;
    find_rows(model, settings, state, data);
    if data.contacts.is_empty() && data.joint_rows.is_empty() && data.ties.is_empty() {
        return;
    }
    let mut pad = std::mem::take(&mut data.scratch);
    let scratch = Scratch::of(&mut pad, model, data);
    let islands = &mut scratch.islands;
    match law.balls.filter(|_| !data.plan.balls.is_empty() && !settings.implicit) {
        Some(balls) => islands.set_balls_apart(model, data, |mix| (balls.has)(model, mix)),
        None => islands.alone.clear(),
    }
    let all_alone = islands.alone.len() == data.contacts.len() && data.joint_rows.is_empty() && data.ties.is_empty();
    if law.start == Start::Forces && !all_alone {
        state.recall(model, data);
    }
    if let Some(balls) = law.balls.filter(|_| !islands.alone.is_empty()) {
        push_balls(&balls, model, settings, state, data, scratch);
    }
    if !all_alone {
        push_islands(model, settings, state, data, scratch, chained);
    }
    data.scratch = pad;
}

/// The forces of balls that are no island's, and what they do.
fn push_balls(
    balls: &Balls,
    model: &Model,
    settings: &Settings,
    state: &State,
    data: &mut Data,
    scratch: &mut Scratch,
) {
    let Scratch { islands: Islands { alone, .. }, room, own, .. } = scratch;
    let mut contacts = std::mem::take(&mut data.contacts);
    (balls.solve)(&Task { model, settings, state, data }, own, alone, &mut contacts, room);
    data.contacts = contacts;
    for &Alone { tree, contact, .. } in &*alone {
        data.counts.rows += model.mixes[data.contacts[contact].mix as usize].condim;
        finish_free(model, tree, room, data);
    }
}

/// The forces of all islands, and what they do.
fn push_islands(
    model: &Model,
    settings: &Settings,
    state: &State,
    data: &mut Data,
    scratch: &mut Scratch,
    chained: impl Fn(&Task, &Islands, usize) -> bool,
) {
    let Scratch { islands, island, room, own } = scratch;
    let law = settings.law;
    // Sweeps end where an island improves no more: without islands, where all together do not.
    if model.opt.noslip_iterations > 0 && !model.opt.flags.island {
        islands.find_one(model, data);
    } else {
        islands.find(model, data);
    }
    for group in 0..model.trees.len() {
        if islands.idle(group) {
            continue;
        }
        // An island has the number of its lowest tree.
        if let (Some(shortcut), Some(bodies)) = (law.shortcut, islands.free_bodies(model, data, group))
            && take(shortcut, model, settings, state, data, own, &bodies, room)
        {
            continue;
        }
        let task = Task { model, settings, state, data };
        let chained = chained(&task, islands, group);
        assemble(&task, islands, group, island, chained);
        let outcome = (law.solve)(&task, own, island);
        data.counts.rows += island.row_count();
        island.finish(model, data);
        data.counts.solves += outcome.iterations;
        data.solver.iterations = data.solver.iterations.max(outcome.iterations);
        data.solver.residual = data.solver.residual.max(outcome.residual);
    }
}

/// Finds the rows of joints, tendons and equalities, if the law has them.
fn find_rows(model: &Model, settings: &Settings, state: &State, data: &mut Data) {
    data.joint_rows.clear();
    data.ties.clear();
    if settings.law.joints && data.plan.joint_rows() {
        joint_rows::find(model, settings, state, data);
    }
    if settings.law.joints && data.plan.ties() {
        ties::find(model, settings, state, data);
    }
}

/// Takes a law's shortcut for free bodies; says whether that was possible.
fn take(
    shortcut: Shortcut,
    model: &Model,
    settings: &Settings,
    state: &State,
    data: &mut Data,
    own: &mut Scratchpad,
    bodies: &FreeBodies,
    room: &mut Room,
) -> bool {
    let mut contacts = std::mem::take(&mut data.contacts);
    let found = shortcut(&Task { model, settings, state, data }, own, bodies, &mut contacts, room);
    data.contacts = contacts;
    let Some(residual) = found else { return false };
    data.solver.residual = data.solver.residual.max(residual);
    let rows = |&c: &usize| model.mixes[data.contacts[c].mix as usize].condim;
    data.counts.rows += bodies.contacts.iter().map(rows).sum::<usize>();
    bodies.trees.iter().for_each(|&t| finish_free(model, t, room, data));
    true
}

/// qacc and qfrc_constraint of a free body, or one that is uncoupled, from the acceleration in the room.
fn finish_free(model: &Model, t: usize, room: &Room, data: &mut Data) {
    let (tree, a) = (&model.trees[t], room.acceleration[t]);
    match &tree.free {
        Some(free) => {
            let change = a - data.movers[tree.bodies.start].acc;
            unit_mass::finish_free(free, data.plan.aligned[t], tree, data, &a.into(), &change.into());
        }
        None => {
            let Data { plan, movers, qacc, qfrc_constraint, .. } = data;
            let (Some(uncoupled), mover) = (&plan.uncoupled[t], &movers[tree.bodies.start]) else { return };
            uncoupled.on_dofs(&a, &mut qacc[tree.dofs.clone()]);
            uncoupled.on_dofs(&(a - mover.acc).component_div(&mover.minv), &mut qfrc_constraint[tree.dofs.clone()]);
        }
    }
}

/// Whether an island is one tree with joints, and each of its constraints acts on one chain of it.
fn chained(task: &Task, islands: &Islands, group: usize) -> bool {
    let Task { model, data, .. } = *task;
    let (trees, contacts, _) = islands.group(group);
    let moves = |b: u32| model.bodies[b as usize].tree.is_some();
    let one_side = |c: &usize| data.contacts[*c].body.map(moves) != [true; 2];
    let single = trees.len() == 1 && islands.ties(group).is_empty();
    // Sweeps over friction take row by row.
    let sweeps = model.opt.noslip_iterations > 0;
    single && !sweeps && model.trees[trees[0]].free.is_none() && contacts.iter().all(one_side)
}

/// The rows of one island.
fn assemble(task: &Task, islands: &mut Islands, group: usize, island: &mut Island, chained: bool) {
    let Task { model, settings, state, data } = *task;
    island.reset(chained);
    islands.number(group, |tree| island.add_tree(model, data, &state.qvel, tree));
    island.start();
    let (_, contacts, joints) = islands.group(group);
    let unit = |tree: Option<usize>| tree.map(|t| islands.unit[t]);
    for &i in islands.ties(group) {
        island.add_tie(model, data, i, |tree| islands.unit[tree]);
    }
    for &j in joints {
        let tree = model.bodies[model.dofs[data.joint_rows[j].dof].body].tree;
        island.add_joint_row(model, data, j, unit(tree).unwrap_or(0));
    }
    for &c in contacts {
        let contact = &data.contacts[c];
        let units = contact.body.map(|b| unit(model.bodies[b as usize].tree));
        let points = match settings.law.lever {
            Lever::Midpoint => [contact.pos; 2],
            Lever::Surface => surface_points(contact, units),
        };
        island.add_contact(model, data, c, model.mixes[contact.mix as usize].condim, units, points);
    }
    island.finish_assembly();
}

/// The rows of all islands as if they were one.
fn assemble_all(task: &Task, island: &mut Island) {
    let mut islands = Islands::default();
    islands.reserve(task.model, 0, 0, 0);
    islands.find_one(task.model, task.data);
    assemble(task, &mut islands, 0, island, false);
}

/// Where a law's force acts on each of the two bodies of a contact. World, m.
pub fn points_of(model: &Model, law: &Law, contact: &Contact) -> [Vec3; 2] {
    match law.lever {
        Lever::Midpoint => [contact.pos; 2],
        Lever::Surface => surface_points(contact, contact.body.map(|b| model.bodies[b as usize].tree)),
    }
}

/// Where each side's body is touched under [`Lever::Surface`]; `moves`: the trees, or whatever stands for them. World, m.
fn surface_points(contact: &Contact, moves: [Option<usize>; 2]) -> [Vec3; 2] {
    if moves[0].is_some() && moves[1].is_some() {
        return [contact.pos; 2];
    }
    let half = contact.frame.row(0).transpose() * (0.5 * contact.dist);
    [contact.pos - half, contact.pos + half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{forward, integrate, parse};

    /// Two ways to an island of one tree: rows chain by chain, and dense rows. A leg that moves in a plane, and a body on three
    /// legs; they fall, lie on the ground and are at limits of their joints.
    #[test]
    fn islands_assembled_chain_by_chain_move_as_dense_ones() {
        let leg = |axes: &str, x: f64, y: f64, condim: usize| {
            format!(
                "<body pos='{x} {y} 0'><joint axis='{axes}' range='-50 50' damping='.1' frictionloss='.2'/>
                 <geom type='capsule' fromto='0 0 0 {x} {y} -.3' size='.04' condim='{condim}' contype='0'/>
                 <body pos='{x} {y} -.3'><joint axis='{axes}' range='-30 60' armature='.01'/>
                 <geom type='capsule' fromto='0 0 0 0 0 -.3' size='.04' condim='{condim}' contype='0'/></body></body>"
            )
        };
        let planar = "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/>";
        let bodies = [
            format!("{planar}<geom size='.1' contype='0'/>{}", leg("0 1 0", 0.1, 0.0, 3)),
            format!(
                "<freejoint/><geom size='.1' contype='0'/>{}{}{}",
                leg("0 1 0", 0.2, 0.0, 1),
                leg("1 1 0", -0.1, 0.1, 4),
                leg("1 0 .2", -0.1, -0.1, 6)
            ),
        ];
        for (law, body) in
            ALL.iter().filter(|law| law.joints).flat_map(|law| bodies.iter().map(move |body| (*law, body)))
        {
            let text = format!(
                "<mujoco><option tolerance='0' cone='elliptic'/><worldbody><geom type='plane' size='9 9 1'/>
                 <body pos='0 0 .8' euler='3 2 0'>{body}</body></worldbody></mujoco>"
            );
            let Ok(scene) = parse("legs.xml", &text) else { panic!("{text}") };
            let model = &scene.model;
            let integrator = integrate::by_name("semi-implicit-euler").unwrap();
            let method = forward::Method { contact: law, integrator, timestep: 0.002, rounds: forward::ROUNDS };
            let (mut state, mut data) = (State::new(model), Data::new(model));
            let mut asked = [0, 0];
            for _ in 0..500 {
                forward::step(model, &method, &mut state, &mut data).unwrap();
                let (mut own, mut dense) = (Data::new(model), Data::new(model));
                forward::forward(model, &method, &state, &mut own);
                forward::forward(model, &method, &state, &mut dense);
                for data in [&mut own, &mut dense] {
                    data.qacc.copy_from_slice(&data.qacc_smooth);
                }
                constrain_with(model, &method.settings(), &state, &mut own, |task, islands, group| {
                    let by_chains = chained(task, islands, group);
                    assert!(by_chains, "{}", law.name);
                    by_chains
                });
                constrain_with(model, &method.settings(), &state, &mut dense, |_, _, _| false);
                asked[0] += usize::from(!own.contacts.is_empty());
                asked[1] += usize::from(own.joint_rows.len() > 1);
                let size = dense.qacc.iter().fold(10.0f64, |size, a| size.max(a.abs()));
                for (own, dense) in own.qacc.iter().zip(&dense.qacc) {
                    assert!((own - dense).abs() < 1e-9 * size, "{}, {} s: {own} and {dense}", law.name, state.time);
                }
            }
            assert!(asked[0] > 100 && asked[1] > 50, "{}: {asked:?}", law.name);
        }
    }
}
