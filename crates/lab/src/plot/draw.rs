//! Lays a figure out and draws it.

use plotters::backend::DrawingBackend;

use super::canvas::{Anchor, Canvas, Result, TEXT, Type, text_width};
use super::palette::{GREY, GRID, INK, PAPER, Rgb};
use super::scale::Scale;
use super::{Cells, Figure, Layer, Line, Note, Panel};

/// Distance of a page's content from its edge, px.
const EDGE: f64 = 18.0;
/// Height of one line of text with its spacing, px.
const LEADING: f64 = 17.0;
/// From the plot's right side to the curves' names, px.
const LEADER: f64 = 20.0;

const TITLE: Type = Type { size: 18.0, bold: true, color: INK, anchor: Anchor::Left };
const SUBTITLE: Type = Type { size: TEXT, bold: false, color: GREY, anchor: Anchor::Left };
const HEAD: Type = Type { size: 14.0, bold: true, color: INK, anchor: Anchor::Left };
const LABEL: Type = Type { size: TEXT, bold: false, color: INK, anchor: Anchor::Left };

/// Where everything goes.
pub struct Layout {
    /// Of the page.
    pub size: [f64; 2],
    /// Plot area of each panel: left, top, right, bottom.
    plots: Vec<[f64; 4]>,
    scales: Vec<[Scale; 2]>,
}

/// Height of what stands above the panels.
fn header(figure: &Figure) -> f64 {
    let lines = figure.subtitle.lines().count() as f64;
    let legend = if figure.legend.is_empty() { 0.0 } else { LEADING + 8.0 };
    EDGE + 22.0 + lines * LEADING + legend + 8.0
}

/// Height of a panel's title and of its y axis' label, above the plot.
fn panel_head(panel: &Panel) -> f64 {
    LEADING + if panel.title.is_empty() { 4.0 } else { LEADING + 4.0 }
}

impl Layout {
    pub fn new(figure: &Figure) -> Layout {
        let all: Vec<&Panel> = figure.panels.iter().collect();
        let scales: Vec<[Scale; 2]> = match all.first() {
            Some(first) if figure.shared => vec![scales(first, &all); all.len()],
            _ => all.iter().map(|panel| scales(panel, &[panel])).collect(),
        };
        let [w, h] = figure.panel_size;
        let columns = figure.columns.clamp(1, figure.panels.len().max(1));
        let left = figure.panels.iter().zip(&scales).map(|(_, s)| tick_width(&s[1], h)).fold(0.0, f64::max) + 12.0;
        let right = figure.panels.iter().map(label_width).fold(0.0, f64::max);
        let right = if right > 0.0 { right + LEADER + 10.0 } else { 22.0 };
        let head = figure.panels.iter().map(panel_head).fold(0.0, f64::max);
        let (across, down) = (left + w + right, head + h + 3.0 * LEADING);
        let top = header(figure);
        let plot = |i: usize| {
            let (column, row) = ((i % columns) as f64, (i / columns) as f64);
            let (x, y) = (EDGE + column * across + left, top + row * down + head);
            [x, y, x + w, y + h]
        };
        let rows = figure.panels.len().div_ceil(columns) as f64;
        let words = figure.subtitle.lines().map(|l| text_width(l, SUBTITLE)).fold(0.0, f64::max);
        let legend: f64 = figure.legend.iter().map(|(_, text)| legend_width(text)).sum();
        let width = (columns as f64 * across).max(words).max(text_width(&figure.title, TITLE)).max(legend);
        Layout {
            size: [2.0 * EDGE + width, top + rows * down + EDGE - LEADING].map(f64::ceil),
            plots: (0..figure.panels.len()).map(plot).collect(),
            scales,
        }
    }
}

/// Scales that hold what these panels show, on axes like this panel's.
fn scales(panel: &Panel, shown: &[&Panel]) -> [Scale; 2] {
    let values = |axis: usize| {
        shown.iter().flat_map(|p| &p.layers).flat_map(move |layer| -> Vec<f64> {
            match layer {
                Layer::Line(line) if line.fits => line.points.iter().map(|p| p[axis]).collect(),
                Layer::Cells(cells) => if axis == 0 { &cells.x } else { &cells.y }.clone(),
                _ => Vec::new(),
            }
        })
    };
    [Scale::fit(&panel.x, values(0)), Scale::fit(&panel.y, values(1))]
}

fn tick_width(scale: &Scale, height: f64) -> f64 {
    scale.ticks(room(height, 55.0)).iter().map(|(_, text)| text_width(text, LABEL)).fold(0.0, f64::max)
}

/// How many ticks fit, one per this many px.
fn room(length: f64, each: f64) -> usize {
    (length / each) as usize
}

fn label_width(panel: &Panel) -> f64 {
    lines(panel).map(|line| text_width(&line.label, LABEL)).fold(0.0, f64::max)
}

fn legend_width(text: &str) -> f64 {
    text_width(text, LABEL) + 44.0
}

fn lines(panel: &Panel) -> impl Iterator<Item = &Line> {
    panel.layers.iter().filter_map(|layer| match layer {
        Layer::Line(line) => Some(line),
        _ => None,
    })
}

pub fn draw<B: DrawingBackend>(figure: &Figure, layout: &Layout, canvas: &mut Canvas<B>) -> Result<()> {
    let [width, height] = layout.size;
    canvas.rect([0.0, 0.0, width, height], PAPER)?;
    canvas.text(&figure.title, [EDGE, EDGE + 8.0], TITLE)?;
    let mut y = EDGE + 30.0;
    for line in figure.subtitle.lines() {
        canvas.text(line, [EDGE, y], SUBTITLE)?;
        y += LEADING;
    }
    let mut x = EDGE;
    for (color, text) in &figure.legend {
        canvas.rect([x, y, x + 22.0, y + 14.0], *color)?;
        canvas.text(text, [x + 28.0, y + 7.0], LABEL)?;
        x += legend_width(text);
    }
    for ((panel, plot), scales) in figure.panels.iter().zip(&layout.plots).zip(&layout.scales) {
        Drawing { panel, plot: *plot, scales: *scales, canvas }.draw()?;
    }
    Ok(())
}

/// One panel on its way to the page.
struct Drawing<'a, B: DrawingBackend> {
    panel: &'a Panel,
    plot: [f64; 4],
    scales: [Scale; 2],
    canvas: &'a mut Canvas<B>,
}

impl<B: DrawingBackend> Drawing<'_, B> {
    fn draw(&mut self) -> Result<()> {
        self.grid()?;
        let panel = self.panel;
        for layer in &panel.layers {
            match layer {
                Layer::Line(line) => self.line(line)?,
                Layer::Cells(cells) => self.cells(cells)?,
                Layer::Text(note) => self.note(note)?,
            }
        }
        self.axes()?;
        self.labels()
    }

    /// Where a value is on the page.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, right, bottom] = self.plot;
        let (u, v) = (self.scales[0].place(x), self.scales[1].place(y));
        [left + u * (right - left), bottom - v * (bottom - top)]
    }

    fn ticks(&self, axis: usize) -> Vec<(f64, String)> {
        let [left, top, right, bottom] = self.plot;
        self.scales[axis].ticks(if axis == 0 { room(right - left, 70.0) } else { room(bottom - top, 55.0) })
    }

    /// A line across the plot at a value of one axis, if it is within.
    fn rule(&mut self, axis: usize, value: f64, width: f64) -> Result<()> {
        let [left, top, right, bottom] = self.plot;
        let u = self.scales[axis].place(value);
        if !(0.0..=1.0).contains(&u) {
            return Ok(());
        }
        let (x, y) = (left + u * (right - left), bottom - u * (bottom - top));
        let ends = if axis == 0 { [[x, top], [x, bottom]] } else { [[left, y], [right, y]] };
        self.canvas.path(&ends, GRID, width)
    }

    fn grid(&mut self) -> Result<()> {
        for axis in [0, 1] {
            for value in self.scales[axis].minor() {
                self.rule(axis, value, 0.25)?;
            }
            for (value, _) in self.ticks(axis) {
                self.rule(axis, value, 1.0)?;
            }
        }
        Ok(())
    }

    fn axes(&mut self) -> Result<()> {
        let [left, top, right, bottom] = self.plot;
        self.canvas.path(&[[left, top], [left, bottom], [right, bottom]], INK, 1.0)?;
        for (value, text) in self.ticks(0) {
            let [x, _] = self.place([value, value]);
            self.canvas.path(&[[x, bottom], [x, bottom + 4.0]], INK, 1.0)?;
            self.canvas.text(&text, [x, bottom + 13.0], Type { anchor: Anchor::Middle, ..LABEL })?;
        }
        for (value, text) in self.ticks(1) {
            let [_, y] = self.place([value, value]);
            self.canvas.path(&[[left - 4.0, y], [left, y]], INK, 1.0)?;
            self.canvas.text(&text, [left - 8.0, y], Type { anchor: Anchor::Right, ..LABEL })?;
        }
        let middle = Type { anchor: Anchor::Middle, ..LABEL };
        self.canvas.text(&self.panel.x.label, [0.5 * (left + right), bottom + 32.0], middle)?;
        let start = left - 8.0 - tick_width(&self.scales[1], bottom - top);
        self.canvas.text(&self.panel.y.label, [start, top - 14.0], LABEL)?;
        self.canvas.text(&self.panel.title, [start, top - 14.0 - LEADING - 2.0], HEAD)
    }

    fn cells(&mut self, cells: &Cells) -> Result<()> {
        let columns = cells.x.len().saturating_sub(1);
        for (row, colors) in cells.colors.chunks(columns.max(1)).enumerate() {
            // Neighbours of one colour are one rectangle.
            let mut from = 0;
            while from < colors.len() {
                let to = (from..colors.len()).find(|&c| colors[c] != colors[from]).unwrap_or(colors.len());
                let [x0, y0] = self.place([cells.x[from], cells.y[row]]);
                let [x1, y1] = self.place([cells.x[to], cells.y[row + 1]]);
                self.canvas.rect([x0, y1, x1, y0], colors[from])?;
                from = to;
            }
        }
        Ok(())
    }

    fn note(&mut self, note: &Note) -> Result<()> {
        let look = Type { anchor: Anchor::Middle, color: note.color, ..LABEL };
        let ([x, y], half) = (self.place(note.at), 0.5 * text_width(&note.text, look) + 4.0);
        self.canvas.rect([x - half, y - 9.0, x + half, y + 9.0], PAPER)?;
        self.canvas.text(&note.text, [x, y], look)
    }

    fn line(&mut self, line: &Line) -> Result<()> {
        let places: Vec<[f64; 2]> = line.points.iter().map(|p| self.place(*p)).collect();
        if line.width > 0.0 {
            for piece in pieces(&thin(&places), self.plot) {
                self.canvas.dashed(&piece, line.color, line.width, line.dash)?;
            }
        }
        let Some(marker) = line.marker else { return Ok(()) };
        for place in places.into_iter().filter(|p| within(*p, self.plot)) {
            self.canvas.marker(marker, place, line.color)?;
        }
        Ok(())
    }

    /// The curves' names beside the plot, each at its curve's end, moved apart where they would overlap.
    fn labels(&mut self) -> Result<()> {
        let named: Vec<&Line> = lines(self.panel).filter(|l| !l.label.is_empty()).collect();
        let [_, top, right, bottom] = self.plot;
        let mut ends: Vec<(&Line, [f64; 2])> = named.iter().filter_map(|l| Some((*l, self.end(l)?))).collect();
        ends.sort_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let wanted: Vec<f64> = ends.iter().map(|e| e.1[1]).collect();
        for ((line, end), y) in ends.iter().zip(spread(&wanted, LEADING - 1.0, [top, bottom])) {
            let knee = [right + 6.0, end[1]];
            self.canvas.path(&[*end, knee, [right + LEADER - 4.0, y]], line.color, 0.5)?;
            self.canvas.text(&line.label, [right + LEADER, y], Type { color: dark(line.color), ..LABEL })?;
        }
        Ok(())
    }

    /// The rightmost visible point of a curve.
    fn end(&self, line: &Line) -> Option<[f64; 2]> {
        let places: Vec<[f64; 2]> = line.points.iter().map(|p| self.place(*p)).collect();
        let inside = pieces(&places, self.plot).into_iter().flatten();
        let single = places.into_iter().filter(|p| within(*p, self.plot));
        inside.chain(single).max_by(|a, b| a[0].total_cmp(&b[0]))
    }
}

/// A colour for text: darker than for an area.
fn dark(color: Rgb) -> Rgb {
    color.map(|c| (f64::from(c) * 0.8) as u8)
}

fn within([x, y]: [f64; 2], [left, top, right, bottom]: [f64; 4]) -> bool {
    (left - 0.5..=right + 0.5).contains(&x) && (top - 0.5..=bottom + 0.5).contains(&y)
}

/// Of very many points keeps the first, lowest, highest and last of each half px across.
fn thin(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if places.len() < 4000 {
        return places.to_vec();
    }
    let column = |p: &[f64; 2]| (2.0 * p[0]).floor();
    let mut kept = Vec::new();
    for group in places.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| group[*a][1].total_cmp(&group[*b][1]);
        let mut chosen = vec![0, group.len() - 1];
        chosen.extend((0..group.len()).min_by(by_height));
        chosen.extend((0..group.len()).max_by(by_height));
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|i| group[i]));
    }
    kept
}

/// The parts of a line that lie in the plot; non-finite points break it.
fn pieces(places: &[[f64; 2]], plot: [f64; 4]) -> Vec<Vec<[f64; 2]>> {
    let mut all: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in places.windows(2) {
        let Some([a, b]) = clip(pair[0], pair[1], plot) else { continue };
        match all.last_mut() {
            Some(piece) if piece.last() == Some(&a) => piece.push(b),
            _ => all.push(vec![a, b]),
        }
    }
    all
}

/// The part of a segment that lies in a rectangle (Liang and Barsky).
fn clip(a: [f64; 2], b: [f64; 2], [left, top, right, bottom]: [f64; 4]) -> Option<[[f64; 2]; 2]> {
    if !a.iter().chain(&b).all(|v| v.is_finite()) {
        return None;
    }
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, delta, low, high) in [(a[0], b[0] - a[0], left, right), (a[1], b[1] - a[1], top, bottom)] {
        if delta == 0.0 {
            if start < low || start > high {
                return None;
            }
            continue;
        }
        let (s, t) = ((low - start) / delta, (high - start) / delta);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    let at = |s: f64| [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])];
    let start = if from == 0.0 { a } else { at(from) };
    let end = if to == 1.0 { b } else { at(to) };
    (from <= to).then_some([start, end])
}

/// Moves sorted positions apart to at least `gap`, as little as possible in the least-squares sense.
///
///     minimise Σ (pᵢ − wᵢ)²  with  pᵢ₊₁ − pᵢ ≥ gap
///
/// which for qᵢ = pᵢ − i·gap is isotonic regression: neighbours that violate the order share their mean.
fn spread(wanted: &[f64], gap: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for (i, w) in wanted.iter().enumerate() {
        let mut block = (w - i as f64 * gap, 1);
        while let Some(last) = blocks.last().copied().filter(|last| last.0 > block.0) {
            blocks.pop();
            let n = last.1 + block.1;
            block = ((last.0 * last.1 as f64 + block.0 * block.1 as f64) / n as f64, n);
        }
        blocks.push(block);
    }
    let q = blocks.into_iter().flat_map(|(mean, n)| std::iter::repeat_n(mean, n));
    let most = high - wanted.len().saturating_sub(1) as f64 * gap;
    q.enumerate().map(|(i, q)| q.min(most).max(low) + i as f64 * gap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_move_apart_as_little_as_possible() {
        assert_eq!(spread(&[10.0, 50.0], 15.0, [0.0, 100.0]), [10.0, 50.0]);
        assert_eq!(spread(&[50.0, 50.0], 20.0, [0.0, 100.0]), [40.0, 60.0]);
        // At the edge they stay on the page.
        assert_eq!(spread(&[99.0, 100.0], 20.0, [0.0, 100.0]), [80.0, 100.0]);
    }

    #[test]
    fn a_line_is_cut_at_the_plots_edge_and_broken_by_what_is_no_number() {
        let plot = [0.0, 0.0, 10.0, 10.0];
        assert_eq!(clip([-10.0, 5.0], [20.0, 5.0], plot), Some([[0.0, 5.0], [10.0, 5.0]]));
        assert_eq!(clip([-10.0, 15.0], [20.0, 15.0], plot), None);
        let line = [[1.0, 1.0], [2.0, 2.0], [f64::NAN, 3.0], [4.0, 4.0], [5.0, 5.0]];
        assert_eq!(pieces(&line, plot).len(), 2);
    }
}
