//! The examples run, and what they assert is so.

#[path = "../../examples/branch.rs"]
mod branch;
#[path = "../../examples/cart_pole.rs"]
mod cart_pole;
#[path = "../client/src/main.rs"]
mod client;
#[path = "../../examples/fall.rs"]
mod fall;
#[path = "../../examples/slope.rs"]
mod slope;
#[path = "../../examples/study.rs"]
mod study;

#[test]
fn examples_run() {
    for (name, main) in [
        ("fall", fall::main as fn() -> _),
        ("slope", slope::main),
        ("cart_pole", cart_pole::main),
        ("study", study::main),
        ("branch", branch::main),
        ("tests/client", client::main),
    ] {
        main().unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}
