//! What a person sees: pictures, videos, the stage and the game.
//!
//!     Model + State ─ scene → DrawList ─ paint → Image ─ video → GIF, PNG, APNG, MP4, WebM
//!
//! The view reads the physics; the physics never learns of frames, cameras or clocks.

pub mod camera;
pub mod clock;
pub mod controls;
pub mod depth;
pub mod draw;
pub mod energy_balance;
pub mod film;
pub mod fnv;
pub mod game;
mod ground;
pub mod history;
pub mod log;
mod mesh;
pub mod open;
pub mod paint;
pub mod pick;
mod project;
pub mod random;
mod raster;
pub mod scene;
pub mod session;
mod shade;
mod shadow;
pub mod stage;
pub mod video;

pub use mesh::Shape;
pub use raster::{M3, V3};
