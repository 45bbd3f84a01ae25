//! Charts as SVG and PNG: curves with their names at their ends, and maps of classes.
//!
//! Whoever draws says what ([`Figure`]); sizes, colours and places follow from that. All lengths are px of a page
//! on which text is 13 px high; a PNG has two pixels for each.
//!
//! Text in an SVG stays text: who shows it has the fonts. In a PNG letters come from DejaVu Sans, those that it lacks from
//! the bitmaps of GNU Unifont, which cover Unicode's first plane; what lies beyond it (emoji, ancient scripts) is a box.
//! Letters stand side by side in the order of the text: Arabic ones are not joined, nor turned to run from the right.

mod canvas;
mod draw;
mod output;
pub mod palette;
mod scale;

use std::path::Path;

pub use output::{png, svg};
pub use scale::{number, superscript};

use palette::{Marker, Rgb};

/// One page: a title and one or more panels beside each other.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    pub title: String,
    /// What else one has to know: scene, method, how it was measured. Grey, one or more lines.
    pub subtitle: String,
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// Plot area of one panel, without axes and labels.
    pub panel_size: [f64; 2],
    /// All panels have the axes of the first, stretched to hold them all.
    pub shared: bool,
    /// Colours of a map and what they mean.
    pub legend: Vec<(Rgb, String)>,
}

#[derive(Clone, Debug)]
pub struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// Drawn in this order.
    pub layers: Vec<Layer>,
}

/// An axis with its quantity and unit.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit: `timestep h [s]`.
    pub label: String,
    pub log: bool,
    /// Ends exactly at the data.
    pub tight: bool,
    /// Fixed ends instead of the data's.
    pub range: [Option<f64>; 2],
}

#[derive(Clone, Debug)]
pub enum Layer {
    Line(Line),
    Cells(Cells),
    Text(Note),
}

/// A curve; non-finite points break it.
#[derive(Clone, Debug)]
pub struct Line {
    pub points: Vec<[f64; 2]>,
    pub color: Rgb,
    /// 0 draws the markers only.
    pub width: f64,
    pub dash: &'static [f64],
    pub marker: Option<Marker>,
    /// Written at the curve's right end, in its colour.
    pub label: String,
    /// Whether the axes must hold this curve; theory drawn over data need not be held.
    pub fits: bool,
}

/// A rectangle of coloured cells: a map.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Edges of the columns and rows, ascending: one more than there are columns and rows.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Row by row from low y.
    pub colors: Vec<Rgb>,
}

/// A text at a place in the plot, on a patch of paper.
#[derive(Clone, Debug)]
pub struct Note {
    pub at: [f64; 2],
    pub text: String,
    pub color: Rgb,
}

impl Figure {
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>, panels: Vec<Panel>) -> Figure {
        let columns = panels.len().max(1);
        let panel_size = if columns == 1 { [560.0, 380.0] } else { [290.0, 320.0] };
        let (title, subtitle) = (title.into(), subtitle.into());
        Figure { title, subtitle, panels, columns, panel_size, shared: false, legend: Vec::new() }
    }
}

impl Panel {
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, layers: Vec<Layer>) -> Panel {
        Panel { title: title.into(), x, y, layers }
    }
}

impl Axis {
    pub fn linear(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), log: false, tight: false, range: [None, None] }
    }
    pub fn log(label: impl Into<String>) -> Axis {
        Axis { log: true, ..Axis::linear(label) }
    }
    pub fn tight(self) -> Axis {
        Axis { tight: true, ..self }
    }
    pub fn range(self, low: f64, high: f64) -> Axis {
        Axis { range: [Some(low), Some(high)], ..self }
    }
}

impl Line {
    pub fn new(label: impl Into<String>, color: Rgb, points: Vec<[f64; 2]>) -> Line {
        Line { points, color, width: 2.0, dash: &[], marker: None, label: label.into(), fits: true }
    }
    pub fn dashed(self, dash: &'static [f64]) -> Line {
        Line { dash, ..self }
    }
    pub fn marked(self, marker: Marker) -> Line {
        Line { marker: Some(marker), ..self }
    }
    pub fn wide(self, width: f64) -> Line {
        Line { width, ..self }
    }
    /// The axes do not stretch for this curve.
    pub fn over(self) -> Line {
        Line { fits: false, ..self }
    }
}

/// Whether charts can be written to that file: its name ends in .svg or .png.
pub fn can_save(path: &Path) -> bool {
    matches!(path.extension().and_then(|e| e.to_str()), Some("svg" | "png"))
}

/// Writes a figure as SVG or PNG, by the file's ending.
pub fn save(figure: &Figure, path: &Path) -> Result<(), String> {
    let bytes = match path.extension().and_then(|e| e.to_str()) {
        Some("svg") => svg(figure)?.into_bytes(),
        Some("png") => png(figure)?,
        _ => return Err(format!("`{}` must end in .svg or .png", path.display())),
    };
    penny::draft::write(path, bytes).map_err(|e| format!("cannot write `{}`: {}", path.display(), penny::reason(e)))
}
