//! A session as a sequence of pictures: which steps lie between two frames, and where the camera is.

use super::camera::Camera;
use super::controls::Grab;
use super::draw::{DrawList, Trail};
use super::raster::V3;
use super::scene::{self, Notes, Scale};
use super::session::{Player, Session};
use penny::math::Vec3;

/// How to look at a session.
#[derive(Clone, Debug)]
pub struct Film {
    pub camera: Camera,
    /// Keep this body where it is in the picture.
    pub follow: Option<usize>,
    pub notes: Notes,
    /// Frames per second of film, and simulated seconds per second of film.
    pub fps: f64,
    pub speed: f64,
    /// The eye stays above this height, m.
    pub floor: Option<f64>,
    scale: Scale,
    /// Where the followed body was at first.
    anchor: Vec3,
    /// Simulated time that the steps so far have covered, s.
    filmed: f64,
    trails: Vec<(usize, Vec<V3>)>,
}

/// Bodies that get a trail at most: more are a tangle.
const TRAILS: usize = 4;

impl Film {
    pub fn new(session: &Session, camera: Camera, follow: Option<usize>, fps: f64, speed: f64) -> Film {
        let roots: Vec<usize> = session.model.trees.iter().map(|t| t.bodies.start).collect();
        let follow = follow.filter(|&b| b < session.model.bodies.len());
        let trails = if roots.len() > TRAILS { Vec::new() } else { roots.iter().map(|&b| (b, Vec::new())).collect() };
        let anchor = follow.map_or_else(Vec3::zeros, |b| session.data.xpos[b]);
        let scale = Scale::of(&session.model);
        let floor = scene::floor(&session.model);
        Film { camera, follow, notes: Notes::default(), fps, speed, floor, scale, anchor, filmed: 0.0, trails }
    }

    /// Pictures that show `duration` simulated seconds, both ends included.
    pub fn frames(&self, duration: f64) -> usize {
        ((duration / self.speed * self.fps + 1e-6).floor() as usize).saturating_add(1)
    }

    /// Pictures that show every step of a recorded session; the last one may come a little after its end.
    pub fn frames_to_end(&self, duration: f64) -> usize {
        ((duration / self.speed * self.fps - 1e-6).ceil().max(0.0) as usize).saturating_add(1)
    }

    /// Simulated time of a frame, s.
    fn time(&self, frame: usize) -> f64 {
        frame as f64 * self.speed / self.fps
    }

    /// Whether a step is missing before a frame can be drawn.
    pub fn wants_step(&self, frame: usize, session: &Session) -> bool {
        self.filmed < self.time(frame) - 1e-9 * session.method.timestep
    }

    /// A step of this length was taken, s.
    pub fn stepped(&mut self, timestep: f64) {
        self.filmed += timestep;
    }

    /// Takes the steps of the first `seconds` of simulated time, which are not filmed.
    ///
    /// Errors: as [`frame`](Film::frame).
    pub fn skip(&mut self, seconds: f64, session: &mut Session, mut player: Option<&mut Player>) -> Result<(), String> {
        let mut skipped = 0.0;
        while skipped < seconds - 1e-9 * session.method.timestep && self.step(session, player.as_deref_mut())? {
            skipped += session.method.timestep;
        }
        self.begin_again(session);
        Ok(())
    }

    /// Takes one step; false where a recorded run is over.
    fn step(&self, session: &mut Session, player: Option<&mut Player>) -> Result<bool, String> {
        if let Some(player) = player {
            player.feed(session)?;
            if player.finished(session) {
                return Ok(false);
            }
        }
        session.step().map(|()| true).map_err(|error| session.failure(&error))
    }

    /// Takes the steps up to a frame and draws it. A recorded run plays on through `player`.
    ///
    /// Errors: one sentence if the simulation diverges or the recorded run is damaged.
    pub fn frame(
        &mut self,
        index: usize,
        session: &mut Session,
        mut player: Option<&mut Player>,
    ) -> Result<DrawList, String> {
        while self.wants_step(index, session) && self.step(session, player.as_deref_mut())? {
            self.filmed += session.method.timestep;
        }
        let between = 1.0 - (self.filmed - self.time(index)) / session.method.timestep;
        Ok(self.draw(session, between))
    }

    /// Forgets the trails and takes the followed body from where it is.
    pub fn begin_again(&mut self, session: &Session) {
        self.trails.iter_mut().for_each(|(_, points)| points.clear());
        self.anchor = self.follow.map_or_else(Vec3::zeros, |b| session.data.xpos[b]);
    }

    /// Follows a body from where it is, or lets go of it where the camera is then.
    pub fn set_follow(&mut self, session: &Session, body: Option<usize>) {
        if let Some(old) = self.follow {
            let moved = session.data.xpos[old] - self.anchor;
            self.camera.target += Vec3::new(moved.x, moved.y, 0.0);
        }
        self.follow = body;
        self.anchor = body.map_or_else(Vec3::zeros, |b| session.data.xpos[b]);
    }

    /// The camera as it is now that the followed body has moved.
    pub fn eye(&self, pos: &[Vec3]) -> Camera {
        let mut camera = self.camera;
        if let Some(body) = self.follow {
            let moved = pos[body] - self.anchor;
            // Height stays, so that falling and bouncing are seen.
            camera.target += Vec3::new(moved.x, moved.y, 0.0);
        }
        if let Some(floor) = self.floor {
            camera.stay_above(floor);
        }
        camera
    }

    /// The spring between a held body and the mouse.
    pub fn spring(&self, list: &mut DrawList, session: &Session, grab: &Grab) {
        let from = session.data.xpos[grab.body] + session.data.xmat[grab.body] * grab.point;
        scene::spring(list, &from, &grab.to, &self.scale);
    }

    /// The path of a shot: the played one (0) strong, those of other laws in their own colours.
    pub fn path(&self, list: &mut DrawList, points: &[Vec3], index: usize) {
        const COLORS: [[f32; 4]; 4] =
            [[0.85, 0.13, 0.25, 0.9], [0.16, 0.45, 0.86, 0.8], [0.55, 0.30, 0.75, 0.8], [0.10, 0.55, 0.40, 0.8]];
        let points = points.iter().map(|p| V3::new(p.x as f32, p.y as f32, p.z as f32)).collect();
        let width = if index == 0 { 3.0 } else { 2.0 };
        list.trails.push(Trail { points, color: COLORS[index % COLORS.len()], width });
    }

    /// The picture of now, or of a moment between the last two steps.
    pub fn draw(&mut self, session: &Session, between: f64) -> DrawList {
        let poses = session.poses(between);
        let mut list = scene::draw(&session.model, &poses, self.eye(&poses.pos));
        if self.notes.contacts {
            scene::contacts(&mut list, &session.data, &self.scale);
        }
        if self.notes.velocity {
            for tree in &session.model.trees {
                let (at, velocity) = session.motion(tree.bodies.start);
                scene::velocity(&mut list, &at, &velocity, &self.scale);
            }
        }
        for (body, wrench) in session.state.xfrc_applied.iter().enumerate().filter(|_| self.notes.pushes) {
            let force = wrench.fixed_rows::<3>(0).into_owned();
            if force.norm() > 0.0 {
                scene::push(&mut list, &poses.pos[body], &force, &self.scale);
            }
        }
        for (body, points) in &mut self.trails {
            let p = poses.pos[*body];
            let p = V3::new(p.x as f32, p.y as f32, p.z as f32);
            if points.last().is_none_or(|last| (last - p).norm() > 0.1 * self.scale.size as f32) {
                points.push(p);
            }
            if self.notes.trail && points.len() > 1 {
                let mut points = points.clone();
                points.push(p);
                list.trails.push(Trail { points, color: [0.35, 0.40, 0.50, 0.55], width: 1.6 });
            }
        }
        list
    }
}
