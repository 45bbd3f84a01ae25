//! LZW as GIF has it, quick where one symbol repeats: a run of n takes as many operations as codes, about √(2 n), and most of a
//! film's pictures is "as before".
//!
//! A code stands for a string of symbols; after each code but the last, the string with the next symbol gets the next code.
//! Codes grow from 9 to 12 bits; when they are used up, all are forgotten.
//!
//! Source: GIF89a specification, appendix F.

/// Bits of a symbol.
const SYMBOL: u32 = 8;
const CLEAR: u16 = 1 << SYMBOL;
const END: u16 = CLEAR + 1;
/// Bits of the longest code.
const LONGEST: u32 = 12;
const SLOTS: usize = 1 << 13;

/// Symbols of which `often` comes in runs. Out: the size of a symbol in bits, then the codes' bytes.
pub fn encode(symbols: &[u8], often: u8) -> Vec<u8> {
    let mut codes = Codes { out: vec![SYMBOL as u8], bits: 0, filled: 0, size: SYMBOL + 1 };
    let mut strings = Strings::new(often);
    codes.put(CLEAR);
    let mut i = 0;
    while i < symbols.len() {
        // The longest string that is known, or a part of it: any will do.
        let (mut code, mut run) = (u16::from(symbols[i]), 0);
        if symbols[i] == often {
            let known = strings.runs.len();
            run = symbols[i..].iter().take(known).take_while(|s| **s == often).count();
            code = strings.runs[run - 1];
        }
        i += run.max(1);
        while let Some((longer, symbol)) = symbols.get(i).and_then(|s| Some((strings.find(code, *s)?, s))) {
            debug_assert!(run == 0 || *symbol != often);
            (code, run) = (longer, 0);
            i += 1;
        }
        codes.put(code);
        let Some(&next) = symbols.get(i) else { break };
        let new = strings.next;
        if run > 0 && next == often {
            strings.runs.push(new);
        } else {
            strings.insert(code, next);
        }
        strings.next += 1;
        if new == 1 << codes.size {
            codes.size += 1;
        }
        if strings.next == (1 << LONGEST) - 1 {
            codes.put(CLEAR);
            codes.size = SYMBOL + 1;
            strings.forget();
        }
    }
    codes.put(END);
    codes.flush()
}

/// The strings that have codes, each as the code of all but its last symbol, and that symbol.
struct Strings {
    /// Codes of the runs of 1, 2 … of the symbol that comes often.
    runs: Vec<u16>,
    /// Of all others: the last time that all was forgotten when it was filled, prefix and symbol, code.
    slots: Vec<(u32, u32, u16)>,
    age: u32,
    next: u16,
}

impl Strings {
    fn new(often: u8) -> Strings {
        Strings { runs: vec![u16::from(often)], slots: vec![(0, 0, 0); SLOTS], age: 1, next: END + 1 }
    }

    fn forget(&mut self) {
        self.runs.truncate(1);
        self.age += 1;
        self.next = END + 1;
    }

    /// The slot of a string, or the free one that it would take.
    fn slot(&self, key: u32) -> usize {
        let mut at = (key.wrapping_mul(0x9e37_79b1) >> 19) as usize;
        while self.slots[at].0 == self.age && self.slots[at].1 != key {
            at = (at + 1) % SLOTS;
        }
        at
    }

    fn find(&self, prefix: u16, symbol: u8) -> Option<u16> {
        let (age, _, code) = self.slots[self.slot(u32::from(prefix) << SYMBOL | u32::from(symbol))];
        (age == self.age).then_some(code)
    }

    fn insert(&mut self, prefix: u16, symbol: u8) {
        let key = u32::from(prefix) << SYMBOL | u32::from(symbol);
        let at = self.slot(key);
        self.slots[at] = (self.age, key, self.next);
    }
}

/// Codes one after the other, the lowest bit first.
struct Codes {
    out: Vec<u8>,
    bits: u32,
    filled: u32,
    size: u32,
}

impl Codes {
    fn put(&mut self, code: u16) {
        self.bits |= u32::from(code) << self.filled;
        self.filled += self.size;
        while self.filled >= 8 {
            self.out.push(self.bits as u8);
            self.bits >>= 8;
            self.filled -= 8;
        }
    }

    fn flush(mut self) -> Vec<u8> {
        if self.filled > 0 {
            self.out.push(self.bits as u8);
        }
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::encode;

    /// Runs, noise, and both, longer than all codes last.
    #[test]
    fn what_is_encoded_is_decoded() {
        let noise = |n: u32| (0..n).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8);
        let mixed = (0..300u32).flat_map(|i| std::iter::repeat_n(255, (i * i % 977) as usize).chain(noise(i % 37)));
        let cases: [Vec<u8>; 7] = [
            vec![7],
            vec![255; 3],
            vec![255; 12_000_000],
            noise(100_000).collect(),
            mixed.collect(),
            (0..90_000u32).map(|i| if i % 5 == 0 { 3 } else { 255 }).collect(),
            [vec![255; 70_000], vec![1], vec![255; 70_000]].concat(),
        ];
        for symbols in cases {
            let (width, height) = match symbols.len() {
                n if n > 60_000 => (1000, n / 1000),
                n => (n, 1),
            };
            let symbols = &symbols[..width * height];
            let (width, height) = (width as u16, height as u16);
            let mut file = Vec::new();
            let mut encoder = gif::Encoder::new(&mut file, width, height, &[0; 768]).expect("a header");
            let mut frame = gif::Frame { width, height, ..gif::Frame::default() };
            frame.buffer = encode(symbols, 255).into();
            encoder.write_lzw_pre_encoded_frame(&frame).expect("a frame");
            drop(encoder);
            let mut options = gif::DecodeOptions::new();
            options.set_color_output(gif::ColorOutput::Indexed);
            let mut decoder = options.read_info(&file[..]).expect("a GIF");
            let found = decoder.read_next_frame().expect("whole").expect("a frame");
            assert!(found.buffer == symbols, "{} symbols", symbols.len());
        }
    }
}
