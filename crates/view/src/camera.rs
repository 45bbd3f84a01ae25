//! The eye: orbit, pan, zoom and follow around a point, in MuJoCo's angles.

use penny::math::{Mat3, Vec3};

/// A camera that looks at `target` from `distance`.
///
///     forward = [cos e cos a, cos e sin a, sin e],   eye = target − distance · forward
///
/// with azimuth a and elevation e, as MuJoCo's free camera: azimuth 90° looks along +y, a negative elevation
/// looks down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// m
    pub target: Vec3,
    /// m
    pub distance: f64,
    /// rad
    pub azimuth: f64,
    /// rad
    pub elevation: f64,
    /// Vertical field of view, rad.
    pub fovy: f64,
    /// How far the eye leans to the right about its line of sight, rad.
    pub roll: f64,
}

impl Default for Camera {
    fn default() -> Camera {
        Camera {
            target: Vec3::zeros(),
            distance: 4.0,
            azimuth: 125f64.to_radians(),
            elevation: (-18f64).to_radians(),
            fovy: 40f64.to_radians(),
            roll: 0.0,
        }
    }
}

/// The camera's axes in the world: unit vectors to the right, up and into the picture.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    pub eye: Vec3,
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
}

const MAX_ELEVATION: f64 = 1.55;

impl Camera {
    pub fn axes(&self) -> Axes {
        let (sa, ca) = self.azimuth.sin_cos();
        let (se, ce) = self.elevation.sin_cos();
        let forward = Vec3::new(ce * ca, ce * sa, se);
        let level = Vec3::new(sa, -ca, 0.0);
        let upright = level.cross(&forward);
        let (sr, cr) = self.roll.sin_cos();
        let (right, up) = (level * cr - upright * sr, upright * cr + level * sr);
        Axes { eye: self.target - forward * self.distance, right, up, forward }
    }

    /// The camera at `eye` whose axes (columns) are right, up and against the line of sight, with its target `distance`
    /// before it.
    pub fn at(eye: &Vec3, axes: &Mat3, distance: f64, fovy: f64) -> Camera {
        let [right, up] = [0, 1].map(|i| axes.column(i).into_owned());
        let forward = -axes.column(2).into_owned();
        let level = forward.x.hypot(forward.y);
        // Straight up or down any azimuth will do: that of no roll.
        let azimuth = if level > 1e-9 { forward.y.atan2(forward.x) } else { right.x.atan2(-right.y) };
        let elevation = forward.z.atan2(level);
        let mut camera =
            Camera { target: eye + forward * distance, distance, azimuth, elevation, fovy, ..Camera::default() };
        let upright = camera.axes();
        camera.roll = up.dot(&upright.right).atan2(right.dot(&upright.right));
        camera
    }

    /// Turns around the target; positive numbers move the eye to the right and up. rad.
    pub fn orbit(&mut self, right: f64, up: f64) {
        self.azimuth = (self.azimuth + right).rem_euclid(std::f64::consts::TAU);
        self.elevation = (self.elevation - up).clamp(-MAX_ELEVATION, MAX_ELEVATION);
    }

    /// Looks from higher up where the eye would be below a level floor, or nearer to it than a fiftieth of the distance.
    ///
    ///     z_eye = z_target − distance sin e ≥ z_floor + distance/50
    ///
    /// A target below the floor is lifted to it.
    pub fn stay_above(&mut self, floor: f64) {
        self.target.z = self.target.z.max(floor);
        let highest = ((self.target.z - floor) / self.distance - 0.02).clamp(-1.0, 1.0).asin();
        self.elevation = self.elevation.min(highest.max(-MAX_ELEVATION));
    }

    /// Moves eye and target in the picture's plane, in parts of the picture's height.
    pub fn pan(&mut self, right: f64, up: f64) {
        let axes = self.axes();
        let scale = 2.0 * self.distance * (0.5 * self.fovy).tan();
        self.target += (axes.right * right + axes.up * up) * scale;
    }

    /// Multiplies the distance.
    pub fn zoom(&mut self, factor: f64) {
        self.distance = (self.distance * factor).clamp(0.01, 1e4);
    }

    /// The horizontal directions a player means by "right" and "forward".
    pub fn ground(&self) -> (Vec3, Vec3) {
        let (s, c) = self.azimuth.sin_cos();
        (Vec3::new(s, -c, 0.0), Vec3::new(c, s, 0.0))
    }

    /// The ray through a pixel of a picture of `size` pixels: origin and unit direction.
    pub fn ray(&self, pixel: [f64; 2], size: [f64; 2]) -> (Vec3, Vec3) {
        let axes = self.axes();
        let f = 0.5 * size[1] / (0.5 * self.fovy).tan();
        let d =
            axes.forward + axes.right * ((pixel[0] - 0.5 * size[0]) / f) - axes.up * ((pixel[1] - 0.5 * size[1]) / f);
        (axes.eye, d.normalize())
    }

    /// Where a point of the world is in the picture (pixels) and its depth (m); `None` behind the eye.
    pub fn project(&self, point: &Vec3, size: [f64; 2]) -> Option<[f64; 3]> {
        let axes = self.axes();
        let d = point - axes.eye;
        let depth = d.dot(&axes.forward);
        let f = 0.5 * size[1] / (0.5 * self.fovy).tan();
        (depth > 1e-6).then(|| {
            [0.5 * size[0] + f * d.dot(&axes.right) / depth, 0.5 * size[1] - f * d.dot(&axes.up) / depth, depth]
        })
    }

    /// Reads `azimuth,elevation,distance` in degrees and m, optionally followed by the target `x,y,z` in m; what
    /// is left out stays as it was.
    ///
    /// Errors: one sentence if it is not 2, 3 or 6 finite numbers, or the distance is not above 0.
    pub fn parse(&self, text: &str) -> Result<Camera, String> {
        let wrong =
            || format!("a camera is `azimuth,elevation[,distance[,x,y,z]]` in degrees and metres, not `{text}`");
        let numbers: Vec<f64> = text
            .split([',', ' '])
            .filter(|s| !s.is_empty())
            .map(|s| s.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(wrong))
            .collect::<Result<_, _>>()?;
        if !matches!(numbers.len(), 2 | 3 | 6) {
            return Err(wrong());
        }
        let mut camera = *self;
        camera.azimuth = numbers[0].to_radians();
        camera.elevation = numbers[1].to_radians().clamp(-MAX_ELEVATION, MAX_ELEVATION);
        if let Some(&distance) = numbers.get(2) {
            if distance <= 0.0 {
                return Err(format!("the camera's distance must be above 0 m, not {distance}"));
            }
            camera.distance = distance.max(0.01);
        }
        if let [_, _, _, x, y, z] = numbers[..] {
            camera.target = Vec3::new(x, y, z);
        }
        Ok(camera)
    }
}
