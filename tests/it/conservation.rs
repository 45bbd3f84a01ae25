//! What no contact may change: momentum, and the sign of what it does to energy.

use penny::math::Vec3;

use crate::random_scene::{Joints, Motion, Recipe, Scene, closed_form};

/// Bodies that collide in empty space. Each is dynamically round about its own origin, so that semi-implicit Euler
/// itself conserves both momenta to rounding:
///
///     x' × v' = (x + h v') × v' = x × v',     R' ω' = R exp(h ω') ω' = R ω'
///
/// They start beyond their margins, so that no energy is stored in a contact.
const COLLISIONS: Recipe =
    Recipe { touch: closed_form, statics: false, gravity: false, round: true, gap: 7e-3, cone: "elliptic" };
const SCENES: u64 = 60;
/// Of 1 ms.
const STEPS: usize = 100;

const LAWS: [(&str, &str); 4] =
    [("penalty", "elliptic"), ("mujoco", "elliptic"), ("mujoco", "pyramidal"), ("tutorial", "elliptic")];

/// Mass and moment of inertia of each moving thing, in the order of [`Scene::motions`].
fn bodies(scene: &Scene) -> Vec<[f64; 2]> {
    scene.things.iter().filter_map(|t| t.round).collect()
}

/// Linear momentum, angular momentum about the world's origin, and what both are to be compared with.
fn momentum(bodies: &[[f64; 2]], motions: &[Motion]) -> ([Vec3; 2], [f64; 2]) {
    let (mut sum, mut scale) = ([Vec3::zeros(); 2], [0.0; 2]);
    for ([m, i], Motion { at, vel, omega }) in bodies.iter().zip(motions) {
        let (p, orbit, spin) = (vel * *m, at.pos.cross(vel) * *m, omega * *i);
        sum[0] += p;
        sum[1] += orbit + spin;
        scale[0] += p.norm();
        scale[1] += orbit.norm() + spin.norm();
    }
    (sum, scale)
}

fn kinetic(bodies: &[[f64; 2]], motions: &[Motion]) -> f64 {
    let of = |([m, i], motion): (&[f64; 2], &Motion)| {
        0.5 * (m * motion.vel.norm_squared() + i * motion.omega.norm_squared())
    };
    bodies.iter().zip(motions).map(of).sum()
}

/// Forces act equal and opposite at one point, torques equal and opposite: what remains is rounding, some hundred
/// steps of 1e-16, and at ratios of mass of 100 a hundred times that.
#[test]
fn collisions_conserve_both_momenta() {
    let mut condims = [0; 7];
    for (law, cone) in LAWS {
        let recipe = Recipe { cone, ..COLLISIONS };
        let mut collided = 0;
        for seed in 0..SCENES {
            let scene = Scene::random(seed, &recipe);
            let mut sim = scene.sim(law, Joints::Free, &recipe);
            let bodies = bodies(&scene);
            let (before, scale) = momentum(&bodies, &scene.motions(&sim));
            let mut pushed = false;
            for _ in 0..STEPS {
                sim.step();
                for c in sim.data.contacts.iter().filter(|c| c.force[0] > 0.0) {
                    condims[sim.model.mixes[c.mix as usize].condim] += 1;
                    pushed = true;
                }
            }
            let (after, _) = momentum(&bodies, &scene.motions(&sim));
            let off = (0..2).map(|k| (after[k] - before[k]).norm() / scale[k]).fold(0.0, f64::max);
            assert!(off < 1e-10, "{law}, {cone}, seed {seed}: momentum changed by {off:e} of itself");
            collided += u64::from(pushed);
        }
        assert!(collided > SCENES * 9 / 10, "something touched in {collided} of {SCENES} scenes");
    }
    assert!([1, 3, 4, 6].iter().all(|&k| condims[k] > 100), "contacts by condim: {condims:?}");
}

/// Never is there more kinetic energy than at the start. While a contact pushes, semi-implicit Euler adds up to
/// k h² v²/2 a step where the damper takes c h v². With k = m/(τ ζ)² and c = 2 m/τ that is a share of
///
///     k h / (2 c) = h / (4 τ ζ²) ≤ 1/6        at h = 1 ms, τ ≥ 6 ms, ζ ≥ 1/2
#[test]
fn collisions_add_no_energy() {
    for (law, cone) in LAWS {
        let recipe = Recipe { cone, ..COLLISIONS };
        for seed in 0..SCENES {
            let scene = Scene::random(seed, &recipe);
            let mut sim = scene.sim(law, Joints::Free, &recipe);
            let bodies = bodies(&scene);
            let start = kinetic(&bodies, &scene.motions(&sim));
            for _ in 0..STEPS {
                sim.step();
                let gain = kinetic(&bodies, &scene.motions(&sim)) / start - 1.0;
                assert!(gain < 1e-12, "{law}, {cone}, seed {seed} at {} s: {gain:e} of the energy", sim.state.time);
            }
        }
    }
}
