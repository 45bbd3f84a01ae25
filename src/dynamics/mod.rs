//! Dynamics without contact: one file a pass.
