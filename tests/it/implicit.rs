//! The Jacobian of contact forces that implicit steps use, against differences of the whole.

use penny::collision::detect;
use penny::contact::tangent::{Tangent, constrain_at, tangent};
use penny::contact::{self, Settings};
use penny::data::Data;
use penny::dynamics;
use penny::integrate::displace;
use penny::model::Model;
use penny::state::State;

const H: f64 = 1e-3;

/// A ball and a tilted box that slide, spin and roll in the ground, and a pendulum that leans on its limit.
const SCENE: &str = r#"<mujoco><option cone="elliptic"/><worldbody>
  <geom type="plane" size="5 5 1" condim="6" friction="0.7 0.01 0.02"/>
  <body pos="0 0 0.0995"><freejoint/><geom size="0.1" mass="1" condim="6"/></body>
  <body pos="1 0 0.085" euler="20 10 5"><freejoint/><geom type="box" size="0.1 0.08 0.05" mass="2"/></body>
  <body pos="0 2 1"><joint axis="0 1 0" range="-20 20" frictionloss="0.3"/><geom type="capsule" fromto="0 0 0 0 0 -.4" size=".03"/></body>
</worldbody></mujoco>"#;

/// Jᵀ f at the end of a step of velocity v, that began at `start`.
fn forces(
    model: &Model,
    settings: &Settings,
    start: &State,
    v: &[f64],
    data: &mut Data,
) -> (State, Vec<f64>, Vec<f64>) {
    let mut end = start.clone();
    displace(model, &mut end.qpos, v, H);
    end.qvel.copy_from_slice(v);
    let a: Vec<f64> = v.iter().zip(&start.qvel).map(|(v, before)| (v - before) / H).collect();
    dynamics::kinematics(model, &end.qpos, data);
    detect::detect(model, data);
    dynamics::smooth(model, &end, data);
    constrain_at(model, settings, &end, &a, data);
    (end, a, data.qfrc_constraint.clone())
}

#[test]
fn the_jacobian_of_contact_forces_is_that_of_differences() {
    let model = penny::parse("implicit.xml", SCENE).unwrap_or_else(|e| panic!("{e}")).model;
    let mut start = State::new(&model);
    start.qvel = vec![0.3, -0.2, -0.05, 1.0, 2.0, 3.0, 0.5, 0.1, -0.4, -1.0, 0.7, 0.4, 0.9];
    start.qpos[14] = 21f64.to_radians();
    for law in contact::ALL {
        let settings = Settings { law, timestep: H, rounds: 100, implicit: true };
        let mut data = Data::new(&model);
        // What the step would do without constraints, and a little less.
        let v: Vec<f64> = start.qvel.iter().map(|v| 0.9 * v).collect();
        let (end, a, _) = forces(&model, &settings, &start, &v, &mut data);
        assert!(data.contacts.len() >= 2, "{}: the ball and a corner touch", law.name);
        let mut found = Tangent::default();
        tangent(&model, &settings, &end, &a, &mut data, &mut found);
        let (mut block, mut compared) = (0, 0);
        for island in found.starts.windows(2) {
            let dofs = &found.dofs[island[0]..island[1]];
            let matrix = &found.blocks[block..block + dofs.len() * dofs.len()];
            block += matrix.len();
            let largest = matrix.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for (column, &k) in dofs.iter().enumerate() {
                let shifted = |by: f64, data: &mut Data| {
                    let mut v = v.clone();
                    v[k] += by;
                    forces(&model, &settings, &start, &v, data).2
                };
                let shift = 1e-6;
                let (more, less) = (shifted(shift, &mut data), shifted(-shift, &mut data));
                for (row, &i) in dofs.iter().enumerate() {
                    let wanted = -H * (more[i] - less[i]) / (2.0 * shift);
                    // J counts as constant in the tangent, and turns in the differences.
                    let off = (matrix[row * dofs.len() + column] - wanted).abs();
                    assert!(
                        off <= 2e-4 * largest,
                        "{}: dof {i} by {k}: {} not {wanted}",
                        law.name,
                        matrix[row * dofs.len() + column]
                    );
                    compared += usize::from(wanted != 0.0);
                }
            }
        }
        assert!(compared > 30, "{}: {compared} entries", law.name);
    }
}
