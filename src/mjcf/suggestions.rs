//! What was probably meant by a word that is no number: the correction, as a sentence and as text.

use super::error::Advice;

/// Units that people write behind a number: the one that MJCF wants, and what to multiply by.
const UNITS: &[(&str, &str, f64)] = &[
    ("s", "s", 1.0),
    ("ms", "s", 1e-3),
    ("us", "s", 1e-6),
    ("µs", "s", 1e-6),
    ("m", "m", 1.0),
    ("cm", "m", 1e-2),
    ("mm", "m", 1e-3),
    ("um", "m", 1e-6),
    ("µm", "m", 1e-6),
    ("km", "m", 1e3),
    ("kg", "kg", 1.0),
    ("g", "kg", 1e-3),
    ("t", "kg", 1e3),
    ("%", "1", 1e-2),
    ("m/s²", "m/s²", 1.0),
    ("m/s^2", "m/s²", 1.0),
    ("m/s2", "m/s²", 1.0),
    ("g/cm³", "kg/m³", 1e3),
    ("g/cm^3", "kg/m³", 1e3),
    ("kg/m³", "kg/m³", 1.0),
    ("kg/m^3", "kg/m³", 1.0),
    ("deg", "angle", 1.0),
    ("°", "angle", 1.0),
    ("rad", "angle", 1.0),
];

/// The unit of the `index`-th number in a column's "1, m, m"; the last one holds for all that follow.
pub fn unit_of(units: &str, index: usize) -> &str {
    units.split(", ").take(index + 1).last().unwrap_or("")
}

/// For a word that is no number. `unit`: what the number is measured in.
pub fn number(word: &str, unit: &str) -> Advice {
    if let Some(meant) = retyped(word).filter(|w| w.parse::<f64>().is_ok()) {
        return Advice::Word(did_you_mean(word, &meant), meant);
    }
    if let Some((value, suffix)) = with_suffix(word)
        && let Some((_, base, scale)) = UNITS.iter().find(|(name, ..)| *name == suffix)
    {
        return match *base {
            "angle" if unit.ends_with("angle") => {
                format!("write `{value}`; `<compiler angle=…>` says whether angles are in degrees or radians").into()
            }
            base if base == unit || unit.starts_with(&format!("{base} or ")) => {
                let meant = neat(value * scale);
                Advice::Word(format!("write `{meant}`: numbers stand without a unit, this one is in {base}"), meant)
            }
            _ => format!("write the number alone{}", in_unit(unit)).into(),
        };
    }
    if word.contains(['/', '*', '(']) || word.contains("pi") {
        return "formulas are not computed: write the number itself, such as `1.5708`".into();
    }
    a_number(unit).into()
}

/// Where nothing tells what was meant.
pub fn a_number(unit: &str) -> String {
    format!("write a number such as `0.5` or `1e-3`{}", in_unit(unit))
}

/// For a word that is no whole number.
pub fn integer(word: &str) -> Advice {
    let whole = |w: &String| w.parse::<i32>().is_ok();
    if let Some(meant) = retyped(word).filter(whole) {
        return Advice::Word(did_you_mean(word, &meant), meant);
    }
    match word.parse::<f64>().ok().filter(|x| x.fract() == 0.0).map(neat).filter(whole) {
        Some(meant) => Advice::Word(format!("write `{meant}`, without a point"), meant),
        None => "write a whole number such as `1`".into(),
    }
}

/// ", in m"; nothing for what has no unit.
fn in_unit(unit: &str) -> String {
    if matches!(unit, "" | "1") { String::new() } else { format!(", in {unit}") }
}

/// For numbers that something other than blanks separates: commas, semicolons, blanks out of a typeset page.
///
/// `value`: the whole attribute, which takes `min` to `max` numbers. `None` if that is not what is wrong with it.
pub fn separators(value: &str, min: usize, max: usize) -> Option<Advice> {
    let fits =
        |words: &[String]| (min..=max).contains(&words.len()) && words.iter().all(|word| word.parse::<f64>().is_ok());
    // A decimal comma has a digit on either side; where one could as well separate, both readings are named.
    let points: Vec<String> = value.split_ascii_whitespace().map(|word| word.replacen(',', ".", 1)).collect();
    let decimal = Some(points)
        .filter(|words| words.iter().all(|w| !w.starts_with('.') && !w.ends_with('.')))
        .filter(|words| fits(words))
        .map(|words| words.join(" "));
    let parts: Vec<String> = value
        .split(|c: char| c.is_whitespace() || c == ',' || c == ';')
        .filter(|word| !word.is_empty())
        .map(str::to_string)
        .collect();
    let apart = Some(parts).filter(|words| fits(words)).map(|words| words.join(" "));
    match (decimal, apart) {
        (Some(decimal), Some(apart)) => {
            Some(format!("a decimal point: `{decimal}`; or a blank between two: `{apart}`").into())
        }
        (Some(decimal), None) => {
            Some(Advice::Value(format!("the decimal sign is a point: write `{decimal}`"), decimal))
        }
        (None, Some(apart)) => Some(Advice::Value(format!("plain blanks separate numbers: write `{apart}`"), apart)),
        (None, None) => None,
    }
}

/// The word with digits and minus signs in place of the letters and dashes that look like them, if it has any.
fn retyped(word: &str) -> Option<String> {
    let meant: String = word
        .chars()
        .map(|c| match c {
            'O' | 'o' => '0',
            'l' | 'I' => '1',
            // Minus, hyphens and dashes of all kinds.
            '\u{2212}' | '\u{2010}'..='\u{2015}' | '\u{FE63}' | '\u{FF0D}' => '-',
            _ => c,
        })
        .collect();
    (meant != word).then_some(meant)
}

fn did_you_mean(word: &str, meant: &str) -> String {
    let why = match word.chars().zip(meant.chars()).find(|(a, b)| a != b) {
        Some((letter, '0')) => format!("a zero, not the letter {letter}"),
        Some((letter, '1')) => format!("a one, not the letter {letter}"),
        _ => "a plain minus sign, not a dash".to_string(),
    };
    format!("did you mean `{meant}`? ({why})")
}

/// A number and what stands behind it.
fn with_suffix(word: &str) -> Option<(f64, &str)> {
    let ends = word.char_indices().map(|(i, _)| i).skip(1);
    ends.filter_map(|i| Some((word[..i].parse().ok()?, &word[i..]))).last()
}

/// As a person would write it: 12 digits, so that 3 · 1e-3 is 0.003.
pub fn neat(x: f64) -> String {
    format!("{x:.11e}").parse::<f64>().unwrap_or(x).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_hand_find_their_number() {
        let number = |word, unit| number(word, unit).help().to_string();
        let integer = |word| integer(word).help().to_string();
        assert_eq!(number("O.001", "s"), "did you mean `0.001`? (a zero, not the letter O)");
        assert_eq!(number("\u{2011}0.5", "m"), "did you mean `-0.5`? (a plain minus sign, not a dash)");
        assert_eq!(number("−1", "m"), "did you mean `-1`? (a plain minus sign, not a dash)");
        assert_eq!(number("3ms", "s"), "write `0.003`: numbers stand without a unit, this one is in s");
        assert_eq!(number("1e-3s", "s"), "write `0.001`: numbers stand without a unit, this one is in s");
        assert_eq!(number("5kg", "m"), "write the number alone, in m");
        assert_eq!(number("half", "1"), "write a number such as `0.5` or `1e-3`");
        assert_eq!(integer("3.0"), "write `3`, without a point");
        assert_eq!(integer("l"), "did you mean `1`? (a one, not the letter l)");
        assert_eq!(unit_of("1, m, m", 0), "1");
        assert_eq!(unit_of("1, m, m", 7), "m");
    }

    #[test]
    fn commas_are_read_as_what_fits() {
        let help = |value, min, max| separators(value, min, max).map_or(String::new(), |a| a.help().to_string());
        assert_eq!(help("0,001", 1, 1), "the decimal sign is a point: write `0.001`");
        assert_eq!(help("0, 0, -9.81", 3, 3), "plain blanks separate numbers: write `0 0 -9.81`");
        assert_eq!(help("0,0;-9.81", 3, 3), "plain blanks separate numbers: write `0 0 -9.81`");
        assert_eq!(help("0 0\u{a0}1", 3, 3), "plain blanks separate numbers: write `0 0 1`");
        assert_eq!(help("0,5 0,1 0", 3, 3), "the decimal sign is a point: write `0.5 0.1 0`");
        assert_eq!(help("0,1", 1, 3), "a decimal point: `0.1`; or a blank between two: `0 1`");
        assert_eq!(separators("a,b", 1, 3), None);
    }
}
