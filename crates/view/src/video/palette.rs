//! The 255 colours that show a picture best: median cut (Heckbert 1982).

/// Bits of each channel that are told apart: 64 levels look smooth, and their table of 262,144 colours is quick.
const BITS: u32 = 6;
const CELLS: usize = 1 << (3 * BITS);
/// One of GIF's 256 colours means "as before".
pub const COLORS: usize = 255;

pub struct Palette {
    pub colors: Vec<[u8; 3]>,
    /// Nearest colour of each cell, found when it is first asked for.
    nearest: Vec<Option<u8>>,
}

fn cell(rgb: [u8; 3]) -> usize {
    rgb.iter().fold(0, |cell, &c| cell << BITS | (c >> (8 - BITS)) as usize)
}

/// Mean colour of what was counted in a cell.
#[derive(Clone, Copy, Default)]
struct Count {
    n: u64,
    sum: [u64; 3],
}

impl Palette {
    /// The palette of a picture given as RGBA.
    pub fn of(rgba: &[u8]) -> Palette {
        let mut counts = vec![Count::default(); CELLS];
        for p in rgba.chunks_exact(4) {
            let count = &mut counts[cell([p[0], p[1], p[2]])];
            count.n += 1;
            (0..3).for_each(|c| count.sum[c] += u64::from(p[c]));
        }
        let mut boxes = vec![counts.into_iter().filter(|c| c.n > 0).collect::<Vec<_>>()];
        while boxes.len() < COLORS {
            let Some((worst, _)) = boxes
                .iter()
                .enumerate()
                .filter(|(_, b)| b.len() > 1)
                .map(|(i, b)| (i, spread(b)))
                .reduce(|a, b| if b.1.1 > a.1.1 { b } else { a })
            else {
                break;
            };
            let mut cells = boxes.swap_remove(worst);
            let (axis, _) = spread(&cells);
            cells.sort_by_key(|c| c.sum[axis] / c.n);
            let upper = cells.split_off(middle(&cells));
            boxes.extend([cells, upper]);
        }
        let colors = boxes.iter().filter(|b| !b.is_empty()).map(|b| mean(b)).collect();
        Palette { colors, nearest: vec![None; CELLS] }
    }

    /// Index of the nearest colour, and how far off it is (largest channel).
    pub fn find(&mut self, rgb: [u8; 3]) -> (u8, u8) {
        let cell = cell(rgb);
        let index = self.nearest[cell].unwrap_or_else(|| {
            let distance = |c: &[u8; 3]| (0..3).map(|i| (i32::from(c[i]) - i32::from(rgb[i])).pow(2)).sum::<i32>();
            let best = (0..self.colors.len()).min_by_key(|&i| distance(&self.colors[i])).unwrap_or(0) as u8;
            self.nearest[cell] = Some(best);
            best
        });
        let color = self.colors[index as usize];
        (index, (0..3).map(|i| color[i].abs_diff(rgb[i])).max().unwrap_or(0))
    }

    /// As a GIF wants it.
    pub fn bytes(&self) -> Vec<u8> {
        self.colors.iter().flatten().copied().collect()
    }
}

/// The channel in which a box is widest, and how much cutting it there is worth.
fn spread(cells: &[Count]) -> (usize, f64) {
    let n: u64 = cells.iter().map(|c| c.n).sum();
    let width = |axis: usize| {
        let values = cells.iter().map(|c| c.sum[axis] / c.n);
        let (low, high) = values.fold((u64::MAX, 0), |(low, high), v| (low.min(v), high.max(v)));
        high - low
    };
    let axis = (0..3).max_by_key(|&axis| width(axis)).unwrap_or(0);
    // Small things (a ball, an arrow) deserve colours too, so the count enters by its square root.
    (axis, (n as f64).sqrt() * (width(axis) as f64).powi(2))
}

/// Where a sorted box is cut: half of its pixels, but never nothing.
fn middle(cells: &[Count]) -> usize {
    let half = cells.iter().map(|c| c.n).sum::<u64>() / 2;
    let mut seen = 0;
    let at = cells.iter().position(|c| {
        seen += c.n;
        seen > half
    });
    at.unwrap_or(1).clamp(1, cells.len() - 1)
}

fn mean(cells: &[Count]) -> [u8; 3] {
    let n: u64 = cells.iter().map(|c| c.n).sum();
    [0, 1, 2].map(|axis| (cells.iter().map(|c| c.sum[axis]).sum::<u64>() / n) as u8)
}
