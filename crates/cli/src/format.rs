//! Numbers for people: three or four digits, an SI prefix, aligned columns.

use std::path::Path;

/// A quantity with its unit and the prefix that suits it: 9.91e-6 m is "9.91 µm".
pub fn si(x: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 8] =
        [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p")];
    // 2500 kg, not 2.5 Mg; 0.318 kg m².
    if unit.starts_with("kg") {
        return format!("{} {unit}", if (1e3..1e6).contains(&x.abs()) { format!("{x:.0}") } else { short(x) });
    }
    if x == 0.0 || !x.is_finite() || x.abs() < 1e-14 || x.abs() >= 1e13 {
        return format!("{} {unit}", short(x));
    }
    // 0.9995 of a unit already reads as 1.00 of it.
    let (scale, prefix) = PREFIXES.into_iter().find(|(s, _)| x.abs() >= s * 0.9995).unwrap_or((1e-12, "p"));
    format!("{} {prefix}{unit}", short(x / scale))
}

/// Three significant digits without trailing zeros; powers of ten only where the number is very small or large.
pub fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    if !x.is_finite() || x.abs() < 1e-4 || x.abs() >= 1e6 {
        return format!("{x:.2e}");
    }
    let decimals = (2 - x.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A fixed number of decimals; what is zero but for rounding reads as zero.
pub fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
}

/// A column with its heading: each number with the digits that the largest of them has five of; zero is what is zero but
/// for rounding. Small quantities get a prefix: "energy mJ".
pub fn column(name: &str, unit: &str, values: &[f64]) -> Vec<String> {
    const PREFIXES: [(f64, &str); 4] = [(1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")];
    const ROUNDING: f64 = 1e-12;
    let largest = values.iter().filter(|x| x.is_finite()).fold(0.0, |m: f64, x| m.max(x.abs()));
    let prefixed = matches!(unit, "m" | "J" | "N" | "N m" | "rad" | "m/s" | "rad/s");
    let small = |(scale, _): &(f64, &str)| largest >= 0.9999 * scale * if *scale == 1.0 { 1e-2 } else { 1.0 };
    let (scale, prefix) = match largest {
        x if x < ROUNDING || !prefixed => (1.0, ""),
        _ => PREFIXES.into_iter().find(small).unwrap_or(PREFIXES[3]),
    };
    let magnitude = if largest < ROUNDING { 0.0 } else { (largest / scale).log10().floor() };
    let decimals = (4.0 - magnitude).clamp(0.0, 7.0) as usize;
    let heading = if unit.is_empty() { name.to_owned() } else { format!("{name} {prefix}{unit}") };
    let cell = |x: &f64| match x {
        x if x.abs() < ROUNDING => "0".to_owned(),
        x if (1e-9..1e9).contains(&largest) || largest == 0.0 => fixed(x / scale, decimals),
        x => format!("{:.4e}", x / scale),
    };
    std::iter::once(heading).chain(values.iter().map(cell)).collect()
}

/// Rows of cells as lines; the first column is flush left, the others flush right.
pub fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::from(" ");
        for (c, cell) in row.iter().enumerate() {
            let pad = " ".repeat(widths[c] - cell.chars().count());
            line += &if c == 0 { format!(" {cell}{pad}") } else { format!("  {pad}{cell}") };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// "1 body", "3 bodies".
pub fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Without the folders, for titles.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_read_well() {
        assert_eq!(si(9.91e-6, "m"), "9.91 µm");
        assert_eq!(si(10_000.0, "N/m"), "10 kN/m");
        assert_eq!(si(0.9999, "s"), "1 s");
        assert_eq!(si(-0.0025, "m"), "-2.5 mm");
        assert_eq!(si(0.0, "m"), "0 m");
        assert_eq!(si(8.9e-15, "m"), "8.90e-15 m");
        assert_eq!(short(123_456.0), "123456");
        assert_eq!(short(0.05), "0.05");
        assert_eq!((si(2500.0, "kg"), si(0.32, "kg m²")), ("2500 kg".to_owned(), "0.32 kg m²".to_owned()));
    }

    #[test]
    fn a_column_has_the_digits_that_its_largest_number_needs() {
        let of = |values: &[f64]| column("energy", "J", values);
        assert_eq!(of(&[8.123456e-4, 1e-5]), ["energy µJ", "812.35", "10.00"]);
        assert_eq!(of(&[9.81, -1e-20]), ["energy J", "9.8100", "0"]);
        assert_eq!(column("speed", "m/s", &[1e-32, 0.0]), ["speed m/s", "0", "0"]);
        assert_eq!(column("x", "m", &[0.05, 0.0]), ["x m", "0.050000", "0"]);
        assert_eq!(of(&[12345.678])[1], "12346");
    }
}
