//! From values to places on an axis, and which values to write there.

use super::Axis;

/// Maps values to 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

impl Scale {
    /// A scale that holds all finite values (all positive ones on a logarithmic axis), with a little air.
    pub fn fit(axis: &Axis, values: impl Iterator<Item = f64>) -> Scale {
        let log = axis.log;
        let usable = values.filter(|v| v.is_finite() && (!log || *v > 0.0)).map(|v| if log { v.log10() } else { v });
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let size = low.abs().max(high.abs());
        // What changes by less than that would need numbers too long to read.
        let least = if log || size == 0.0 { 1.0 } else { 1e-5 * size };
        let (low, high) = if high - low < least { (low - 0.5 * least, high + 0.5 * least) } else { (low, high) };
        let air = if axis.tight { 0.0 } else { 0.04 * (high - low) };
        let bound = |given: Option<f64>, found: f64| given.map_or(found, |v| if log { v.log10() } else { v });
        Scale { low: bound(axis.range[0], low - air), high: bound(axis.range[1], high + air), log }
    }

    /// 0 at the axis' low end and 1 at its high end; beyond the ends outside of that.
    pub fn place(&self, value: f64) -> f64 {
        // What a logarithm cannot show lies far below the axis.
        let v = if !self.log {
            value
        } else if value > 0.0 {
            value.log10()
        } else {
            self.low - 10.0 * (self.high - self.low)
        };
        (v - self.low) / (self.high - self.low)
    }

    /// Values to write at the axis with their texts: about `room` of them.
    pub fn ticks(&self, room: usize) -> Vec<(f64, String)> {
        if self.log { self.log_ticks(room) } else { self.linear_ticks(room) }
    }

    fn log_ticks(&self, room: usize) -> Vec<(f64, String)> {
        let (first, last) = ((self.low - 1e-9).ceil() as i32, (self.high + 1e-9).floor() as i32);
        let every = ((last - first) as usize / room.max(1) + 1) as i32;
        let decades: Vec<i32> = (first..=last).filter(|k| k % every == 0).collect();
        let decades: Vec<(f64, String)> = decades.into_iter().map(|k| (10f64.powi(k), power(1, k))).collect();
        if decades.len() >= 3 {
            return decades;
        }
        // Less than three decades: 2 and 5 between them too, where there is room for them.
        let all = ((self.low.floor() as i32)..=(self.high.ceil() as i32)).flat_map(|k| [1, 2, 5].map(|m| (m, k)));
        let value = |m: i32, k: i32| f64::from(m) * 10f64.powi(k);
        let inside = |v: f64| (self.low - 1e-9..=self.high + 1e-9).contains(&v.log10());
        let finer: Vec<(f64, String)> =
            all.filter(|&(m, k)| inside(value(m, k))).map(|(m, k)| (value(m, k), power(m, k))).collect();
        if finer.len() > room + 1 && decades.len() > 1 { decades } else { finer }
    }

    fn linear_ticks(&self, room: usize) -> Vec<(f64, String)> {
        let raw = (self.high - self.low) / room.max(1) as f64;
        let unit = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * unit).find(|s| *s >= raw * 0.999).unwrap_or(unit);
        let (first, last) = ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        let largest = (first.abs().max(last.abs())) as f64 * step;
        (first..=last).map(|i| (i as f64 * step, plain(i as f64 * step, step, largest))).collect()
    }

    /// The fine lines between ticks of a logarithmic axis: 2 to 9 of each decade, if there are few decades.
    pub fn minor(&self) -> Vec<f64> {
        if !self.log || self.high - self.low > 8.0 {
            return Vec::new();
        }
        let decades = (self.low.floor() as i32)..=(self.high.ceil() as i32);
        decades.flat_map(|k| (2..10).map(move |m| f64::from(m) * 10f64.powi(k))).collect()
    }
}

/// A number for a sentence: two digits, powers of ten raised.
pub fn number(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let text = format!("{x:.1e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    match exponent.parse::<i32>() {
        Ok(k) if !(-2..4).contains(&k) => format!("{mantissa}·10{}", superscript(k)),
        _ => format!("{:.*}", (1 - x.abs().log10().floor() as i32).max(0) as usize, x),
    }
}

/// m·10ᵏ as people write it: 0.01, 1, 200, 10⁻⁶.
fn power(m: i32, k: i32) -> String {
    match k {
        0..=3 => format!("{m}{}", "0".repeat(k as usize)),
        -2..=-1 => format!("0.{}{m}", "0".repeat((-k - 1) as usize)),
        _ if m == 1 => format!("10{}", superscript(k)),
        _ => format!("{m}·10{}", superscript(k)),
    }
}

/// A number on a linear axis whose ticks are `step` apart and whose largest is `largest`.
fn plain(value: f64, step: f64, largest: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let k = largest.log10().floor() as i32;
    let minus = |text: String| text.replace('-', "−");
    if (-3..5).contains(&k) {
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        return minus(format!("{value:.decimals$}"));
    }
    let decimals = (f64::from(k) - step.log10().floor()).max(0.0) as usize;
    minus(format!("{:.decimals$}·10{}", value / 10f64.powi(k), superscript(k)))
}

/// An integer as raised digits.
pub fn superscript(k: i32) -> String {
    let raise = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        d => char::from_u32(d as u32 - '4' as u32 + '⁴' as u32).unwrap_or(d),
    };
    k.to_string().chars().map(raise).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: Axis, low: f64, high: f64) -> Vec<String> {
        Scale::fit(&axis, [low, high].into_iter()).ticks(6).into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round_numbers_in_peoples_notation() {
        assert_eq!(texts(Axis::linear("t [s]"), 0.0, 1.0), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(texts(Axis::linear(""), -2e-6, 2e-6), ["−2·10⁻⁶", "−1·10⁻⁶", "0", "1·10⁻⁶", "2·10⁻⁶"]);
        assert_eq!(texts(Axis::linear(""), 0.38348479, 0.3834848), ["0.383483", "0.383484", "0.383485", "0.383486"]);
        assert_eq!(texts(Axis::log("h [s]"), 1e-5, 1e-1), ["10⁻⁵", "10⁻⁴", "10⁻³", "0.01", "0.1"]);
        assert_eq!(texts(Axis::log(""), 0.1, 2.0), ["0.1", "0.2", "0.5", "1", "2"]);
        assert_eq!(texts(Axis::log(""), 1e-15, 1.0), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "1"]);
    }

    #[test]
    fn a_constant_or_empty_set_of_values_still_has_an_axis() {
        for axis in [Axis::linear(""), Axis::log("")] {
            for values in [vec![], vec![3.0], vec![f64::NAN, f64::INFINITY], vec![0.0, 0.0]] {
                let scale = Scale::fit(&axis, values.into_iter());
                assert!(scale.place(3.0).is_finite());
                assert!(!scale.ticks(5).is_empty(), "{scale:?}");
            }
        }
    }
}
