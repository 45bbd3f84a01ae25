//! The chapter docs/trade.md says what the program says today.

use std::path::Path;

#[path = "../../examples/trade/chapter.rs"]
mod chapter;

#[test]
fn the_chapter_is_what_its_experiments_give() {
    let docs = Path::new(crate::ROOT).join("docs");
    let committed = std::fs::read_to_string(docs.join("trade.md")).expect("docs/trade.md");
    let chapter = chapter::write().unwrap_or_else(|e| panic!("{e}"));
    for (old, new) in committed.lines().zip(chapter.text.lines()) {
        assert_eq!(old, new, "docs/trade.md is out of date: cargo run --release --example trade");
    }
    assert_eq!(committed.lines().count(), chapter.text.lines().count());
    for (name, figure) in &chapter.figures {
        assert!(committed.contains(&format!("(trade/{name})")), "{name} is not in the chapter");
        let svg = std::fs::read_to_string(docs.join("trade").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(svg.contains(&figure.title) && svg.contains(&figure.panels[0].x.label), "{name} shows something else");
    }
}
