//! Colours, markers and dashes that stay apart for the colour-blind, on paper and in grey.

/// Red, green, blue.
pub type Rgb = [u8; 3];

pub const INK: Rgb = [34, 34, 34];
pub const GREY: Rgb = [110, 110, 110];
pub const GRID: Rgb = [226, 226, 226];
pub const PAPER: Rgb = [255, 255, 255];

/// Colours of curves, in order of use: Okabe and Ito's set without its yellow, which paper swallows.
/// Source: M. Okabe, K. Ito, Color Universal Design, 2008.
pub const CURVES: [Rgb; 6] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [120, 90, 20]];

/// Colours of classes from harmless to bad: each is darker than the one before, so that order survives grey.
pub const CLASSES: [Rgb; 4] = [[229, 240, 247], [135, 190, 226], [230, 134, 20], [122, 24, 20]];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Plus,
}

pub const MARKERS: [Marker; 6] =
    [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross, Marker::Plus];

/// Lengths of dash and gap in px, in order of use; empty is a solid line.
pub const DASHES: [&[f64]; 4] = [&[], &[7.0, 3.0], &[2.0, 2.5], &[9.0, 3.0, 2.0, 3.0]];
