//! From the wall's time to whole steps: the only place where frames and steps meet.

/// Collects the time that passes and hands it out in steps of fixed length.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Simulated seconds per second.
    pub speed: f64,
    /// Simulated time not yet handed out, s.
    rest: f64,
}

/// A frame never asks for more than this much of the wall's time, s: after a stall the simulation goes on, it does
/// not catch up.
const LONGEST_FRAME: f64 = 0.1;

impl Default for Clock {
    fn default() -> Clock {
        Clock::at(1.0)
    }
}

impl Clock {
    /// A clock that lets this many simulated seconds pass in a second.
    pub fn at(speed: f64) -> Clock {
        Clock { speed, rest: 0.0 }
    }

    /// Steps to take now that `elapsed` seconds have passed.
    pub fn steps(&mut self, elapsed: f64, timestep: f64) -> usize {
        self.rest += elapsed.clamp(0.0, LONGEST_FRAME) * self.speed;
        let steps = (self.rest / timestep).floor();
        self.rest -= steps * timestep;
        steps as usize
    }

    /// How far the picture is from the last step but one (0) to the last step (1).
    pub fn between(&self, timestep: f64) -> f64 {
        (self.rest / timestep).clamp(0.0, 1.0)
    }
}
