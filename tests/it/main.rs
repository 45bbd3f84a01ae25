//! All integration tests in one binary: linking costs more than running.

mod bad_input;
mod cli;
mod collision;
mod compile;
mod conservation;
mod contact_forces;
mod explain;
mod extremes;
mod invariance;
mod models;
mod mujoco_law;
mod own;
mod penalty;
mod picture;
mod random_scene;
mod reader;
mod sim;
mod smooth;
mod sweep;
mod trade;
mod tutorial;
mod validation;
mod view;
#[cfg(feature = "play")]
mod window;
