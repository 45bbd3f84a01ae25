use std::alloc::System;
use std::process::ExitCode;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

/// Counts, so that `penny bench` can show that a step does not allocate.
#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn main() -> ExitCode {
    penny::cli::main(|| {
        let stats = ALLOCATOR.stats();
        stats.allocations + stats.reallocations
    })
}
