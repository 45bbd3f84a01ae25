//! What a shot was, and what the same shot would have been under the other contact laws.

use super::{Game, Outcome};
use crate::energy_balance::EnergyBalance;
use crate::log::Change;
use crate::session::Session;
use penny::contact;
use penny::forward::Method;
use penny::math::{Vec3, Vec6};

/// A shot under one law.
#[derive(Clone, Debug)]
pub struct Shot {
    pub law: &'static str,
    /// The ball's centre, every [`EVERY`] seconds.
    pub path: Vec<Vec3>,
    pub outcome: Outcome,
    /// Time at which it was decided, s after the serve.
    pub time: f64,
    /// Largest speed, m/s.
    pub fastest: f64,
    pub balance: EnergyBalance,
}

/// s
const EVERY: f64 = 0.02;
/// A law that never decides the round is given up after this long, s.
const LONGEST: f64 = 16.0;

/// The round that has just ended, played again under every law with the same pushes; the law it was played with
/// comes first. A law under which the scene diverges is left out.
pub fn report(game: &Game, session: &Session) -> Vec<Shot> {
    let played = session.method.contact.name;
    let mut laws: Vec<_> = contact::ALL.to_vec();
    laws.sort_by_key(|law| law.name != played);
    laws.into_iter().filter_map(|law| shoot(game, session, Method { contact: law, ..session.method })).collect()
}

fn shoot(game: &Game, session: &Session, method: Method) -> Option<Shot> {
    let mut again = Session::new(session.model.clone(), method, game.start.clone(), session.source.clone());
    let log = session.log();
    let mut pushes = log.inputs.iter().filter(|i| i.step >= game.start_step).peekable();
    let offset = game.start_step;
    let mut game = Game::new(&again, game.level, game.seed)?;
    let mut path = vec![game.rules.centre(&again)];
    let mut fastest = 0.0f64;
    let stride = (EVERY / method.timestep).round().max(1.0) as u64;
    while again.state.time - game.start.time < LONGEST {
        while let Some(input) = pushes.next_if(|i| i.step <= offset + again.steps) {
            if let Change::Push { body, wrench } = input.change {
                again.push(body, Vec6::from(wrench)).ok()?;
            }
        }
        let before = game.rules.centre(&again);
        again.step().ok()?;
        let now = game.rules.centre(&again);
        fastest = fastest.max((now - before).norm() / method.timestep);
        if again.steps.is_multiple_of(stride) {
            path.push(now);
        }
        if let Some(outcome) = game.watch(&again) {
            path.push(now);
            let time = game.time(&again);
            return Some(Shot { law: method.contact.name, path, outcome, time, fastest, balance: again.balance });
        }
    }
    None
}
