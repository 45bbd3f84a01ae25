//! Many worlds of one scene, stepped on all cores.

use rayon::prelude::*;

use crate::forward::StepError;
use crate::simulation::Simulation;

/// Worlds that begin as copies of one simulation, each with its own state and, where it was changed, its own model.
///
///     let mut batch = Batch::new(&sim, 1024);
///     for (i, world) in batch.worlds_mut().iter_mut().enumerate() {
///         world.state_mut().qvel[0] = 0.01 * i as f64;
///     }
///     batch.step_n(1000);
///
/// What becomes of a world has the same bits as if it ran alone: in a batch of any size, on any number of threads. The
/// worlds share the model until one is changed.
///
/// The number of threads is rayon's: all cores, or `RAYON_NUM_THREADS`, or that of the pool in which
/// [`step_n`](Batch::step_n) is called.
#[derive(Clone, Debug)]
pub struct Batch {
    worlds: Vec<Simulation>,
}

impl Batch {
    /// n copies of a simulation, in its present state.
    pub fn new(sim: &Simulation, n: usize) -> Batch {
        let mut world = sim.clone();
        world.stopped = None;
        Batch { worlds: vec![world; n] }
    }

    /// Takes n steps in every world that has not failed. A world that fails stays where it is, see
    /// [`failure`](Batch::failure); the others go on. It runs again once it was reset or restored, or another simulation was
    /// put in its place.
    ///
    /// Out: how many worlds stand still.
    pub fn step_n(&mut self, n: usize) -> usize {
        let advance = |world: &mut Simulation| {
            if world.stopped.is_none() {
                world.stopped = world.step_n(n).err();
            }
            usize::from(world.stopped.is_some())
        };
        self.worlds.par_iter_mut().map(advance).sum()
    }

    /// The worlds.
    pub fn worlds(&self) -> &[Simulation] {
        &self.worlds
    }

    /// The same, to be changed.
    pub fn worlds_mut(&mut self) -> &mut [Simulation] {
        &mut self.worlds
    }

    /// Why a world stopped; `None` as long as it goes on, and again after a reset.
    pub fn failure(&self, world: usize) -> Option<&StepError> {
        self.worlds.get(world)?.stopped.as_ref()
    }
}
