//! What a person sees: pictures, videos, the window and the game.
//!
//!     Model + State ─ scene → DrawList ─ paint → Image ─ video → GIF, PNG, APNG, MP4, WebM
//!
//! The view reads the physics; the physics never learns of frames, cameras or clocks.

pub mod camera;
pub mod draw;
mod ground;
mod mesh;
pub mod paint;
mod raster;
mod shade;
mod shadow;

pub use mesh::Shape;
pub use raster::{M3, V3};
