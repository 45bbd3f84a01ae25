//! Writes the chapter "The trade" with its figures: docs/trade.md and docs/trade/*.svg.
//!
//!     cargo run --release --example trade

mod chapter;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    std::fs::create_dir_all(docs.join("trade"))?;
    let chapter = chapter::write()?;
    for (name, figure) in &chapter.figures {
        penny_lab::plot::save(figure, &docs.join("trade").join(name))?;
    }
    std::fs::write(docs.join("trade.md"), chapter.text)?;
    Ok(())
}
