fn main() {
    use penny::view::{open, paint::paint, stage::{Stage, Held}};
    let a: Vec<String> = std::env::args().collect();
    let path = std::path::Path::new(&a[1]);
    let o = open::open(path).unwrap();
    let s = open::session(o.model, path, o.hash, 1).unwrap();
    let mut stage = Stage::new(s, 1, None, true);
    for _ in 0..600 { stage.step(); }
    stage.hold(Held { forward: 1.0, ..Held::default() });
    stage.step();
    let list = stage.draw();
    let n: usize = a[2].parse().unwrap();
    for _ in 0..n { std::hint::black_box(paint(&list, 1280, 720, 1)); }
}
