//! What a law derives from the contact parameters of a model, kept from step to step.

use super::Task;
use super::impedance::onset;
use crate::dynamics;
use crate::model::Mix;

/// What a law derives from the parameters of each mix of a model, made anew where the method has changed.
#[derive(Clone, Debug)]
pub struct PerMix<T> {
    timestep: f64,
    implicit: bool,
    all: Vec<T>,
}

impl<T> Default for PerMix<T> {
    fn default() -> PerMix<T> {
        PerMix { timestep: 0.0, implicit: false, all: Vec::new() }
    }
}

impl<T> PerMix<T> {
    /// One entry a mix. In: `new(mix, task, onset)`, with the depth over which contacts switch on, see [`onset`].
    #[inline]
    pub fn of(&mut self, task: &Task, new: impl Fn(&Mix, &Task, f64) -> T) -> &[T] {
        let (timestep, implicit) = (task.settings.timestep, task.settings.implicit);
        if self.timestep != timestep || self.implicit != implicit || self.all.len() != task.model.mixes.len() {
            (self.timestep, self.implicit) = (timestep, implicit);
            let onset = onset(implicit, timestep, dynamics::gravity(task.model).norm());
            self.all.clear();
            self.all.extend(task.model.mixes.iter().map(|mix| new(mix, task, onset)));
        }
        &self.all
    }
}
