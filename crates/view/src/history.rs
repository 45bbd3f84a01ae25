//! The last seconds in numbers, for the live plots.

use std::collections::VecDeque;

use super::session::Session;

/// One moment of the selected body, and of the scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// s
    pub time: f64,
    /// Of the body's centre of mass: m, m/s.
    pub height: f64,
    pub speed: f64,
    /// Of the whole scene, J.
    pub kinetic: f64,
    pub potential: f64,
    pub lost: f64,
    /// Deepest contact, m, and the sum of all normal forces, N.
    pub penetration: f64,
    pub force: f64,
    /// The ghost's height and speed.
    pub ghost: Option<[f64; 2]>,
}

#[derive(Clone, Debug, Default)]
pub struct History {
    pub moments: VecDeque<Moment>,
}

/// Time between two moments, s of simulation, and how many are kept.
const EVERY: f64 = 0.01;
const LENGTH: usize = 800;

/// A line in a plot.
pub struct Line {
    pub name: &'static str,
    pub of: fn(&Moment) -> Option<f64>,
}

/// What can be plotted over time.
pub struct Plot {
    pub name: &'static str,
    pub unit: &'static str,
    pub lines: &'static [Line],
}

pub const PLOTS: &[Plot] = &[
    Plot {
        name: "height",
        unit: "m",
        lines: &[
            Line { name: "height", of: |m| Some(m.height) },
            Line { name: "ghost", of: |m| m.ghost.map(|g| g[0]) },
        ],
    },
    Plot {
        name: "speed",
        unit: "m/s",
        lines: &[Line { name: "speed", of: |m| Some(m.speed) }, Line { name: "ghost", of: |m| m.ghost.map(|g| g[1]) }],
    },
    Plot {
        name: "energy",
        unit: "J",
        lines: &[
            Line { name: "kinetic", of: |m| Some(m.kinetic) },
            Line { name: "potential", of: |m| Some(m.potential) },
            Line { name: "lost", of: |m| Some(m.lost) },
        ],
    },
    Plot { name: "penetration", unit: "mm", lines: &[Line { name: "deepest", of: |m| Some(1e3 * m.penetration) }] },
    Plot { name: "contact force", unit: "N", lines: &[Line { name: "normal", of: |m| Some(m.force) }] },
];

impl History {
    pub fn new() -> History {
        History::default()
    }

    /// Notes the step just taken if it is time to. Only reads.
    pub fn record(&mut self, session: &Session, body: usize, ghost: &Option<Session>) {
        let time = session.state.time;
        let last = self.moments.back().map_or(f64::MIN, |m| m.time);
        if time < last {
            self.moments.clear();
        } else if time - last < EVERY * (1.0 - 1e-9) {
            return;
        }
        if self.moments.len() == LENGTH {
            self.moments.pop_front();
        }
        let balance = &session.balance;
        let contacts = &session.data.contacts;
        self.moments.push_back(Moment {
            time,
            height: height(session, body),
            speed: session.speed(body),
            kinetic: balance.now.kinetic,
            potential: balance.now.potential,
            lost: balance.lost(),
            penetration: contacts.iter().map(|c| -c.dist).fold(0.0, f64::max),
            force: contacts.iter().map(|c| c.force[0]).sum(),
            ghost: ghost.as_ref().map(|g| [height(g, body), g.speed(body)]),
        });
    }
}

fn height(session: &Session, body: usize) -> f64 {
    let data = &session.data;
    (data.xpos[body] + data.xmat[body] * session.model.bodies[body].ipos).z
}
