//! Mutations of inputs: of their bytes, of the words and numbers of a text, of their size.

use rand::{Rng, RngExt};

/// Larger inputs than this are cut: what is tried is the kind of input, not its length.
const LARGEST: usize = 1 << 20;

/// Numbers that break what trusts them, as text.
const NUMBERS: [&str; 30] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "3",
    "127",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "1000000000000000000",
    "1e308",
    "1e309",
    "-1e308",
    "5e-324",
    "1e-400",
    "nan",
    "inf",
    "-inf",
    "0x7fffffffffffffff",
];

/// What ends, begins or nests things in the formats that are read.
const TOKENS: [&str; 48] = [
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "(",
    ")",
    "<",
    ">",
    "</",
    "/>",
    "\"",
    "'",
    "\"\"\"",
    "=",
    ",",
    ".",
    ":",
    ";",
    "#",
    "-",
    "+",
    "*",
    "/",
    "^",
    "..",
    "\\",
    "\\u",
    "&",
    "&lt;",
    "_",
    " ",
    "\t",
    "\n",
    "\r\n",
    "\r",
    "\0",
    "\u{feff}",
    "\u{202e}",
    "é",
    "🦀",
    "null",
    "true",
    "[{}]",
    "a.b",
    "e",
    "1979-05-27T07:32:00Z",
];

/// Numbers that break what trusts them, as words of 64 bits.
const WORDS: [u64; 14] = [
    0,
    1,
    2,
    0xff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x1_0000_0000,
    1 << 40,
    1 << 61,
    i64::MAX as u64,
    u64::MAX,
    f64::NAN.to_bits(),
    f64::INFINITY.to_bits(),
];

/// An input made from one of `seeds`.
pub fn input(random: &mut impl Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    // Now and then nothing that was ever valid.
    if seeds.is_empty() || random.random_range(0..64) == 0 {
        let length = random.random_range(0..256);
        return (0..length).map(|_| random.random()).collect();
    }
    let mut bytes = pick(random, seeds).clone();
    let times = 1 << random.random_range(0..4);
    for _ in 0..times {
        change(random, &mut bytes, seeds);
        bytes.truncate(LARGEST);
    }
    bytes
}

fn pick<'a, T>(random: &mut impl Rng, all: &'a [T]) -> &'a T {
    &all[random.random_range(0..all.len())]
}

fn place(random: &mut impl Rng, bytes: &[u8]) -> usize {
    random.random_range(0..=bytes.len())
}

/// A stretch, seldom a long one.
fn stretch(random: &mut impl Rng, bytes: &[u8]) -> std::ops::Range<usize> {
    let start = place(random, bytes);
    let longest = 1 << random.random_range(0..12);
    start..(start + random.random_range(0..=longest)).min(bytes.len())
}

fn change(random: &mut impl Rng, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let range = stretch(random, bytes);
    match random.random_range(0..20) {
        0 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] ^= 1 << random.random_range(0..8);
        }
        1 if !bytes.is_empty() => {
            let at = random.random_range(0..bytes.len());
            bytes[at] = random.random();
        }
        2 => bytes.truncate(range.start),
        3 => drop(bytes.drain(range)),
        4 => {
            let copy = bytes[range].to_vec();
            let at = place(random, bytes);
            bytes.splice(at..at, copy);
        }
        5 => swap(bytes, &range, random),
        6 => {
            let other = pick(random, seeds);
            let (from, to) = (place(random, bytes), place(random, other));
            bytes.truncate(from);
            bytes.extend_from_slice(&other[to..]);
        }
        7 => {
            let other = pick(random, seeds);
            let part = other[stretch(random, other)].to_vec();
            bytes.splice(range, part);
        }
        8 => repeat(random, bytes, &range),
        9 => {
            let token = pick(random, &TOKENS).as_bytes();
            let deep = token.repeat(1 << random.random_range(0..16));
            bytes.splice(range.start..range.start, deep);
        }
        10..12 => {
            let token = pick(random, &TOKENS).as_bytes().to_vec();
            let end = if random.random() { range.start } else { range.end };
            bytes.splice(range.start..end, token);
        }
        12 => {
            let long = pick(random, b"019.ea_ \n").to_owned();
            let long = vec![long; 1 << random.random_range(0..14)];
            bytes.splice(range.start..range.start, long);
        }
        13 => word(random, bytes),
        14 if random.random_range(0..8) == 0 => *bytes = encoded(random, bytes),
        15 => exchange_words(random, bytes),
        _ => number(random, bytes),
    }
}

fn swap(bytes: &mut Vec<u8>, range: &std::ops::Range<usize>, random: &mut impl Rng) {
    let part: Vec<u8> = bytes.drain(range.clone()).collect();
    let at = place(random, bytes);
    bytes.splice(at..at, part);
}

fn repeat(random: &mut impl Rng, bytes: &mut Vec<u8>, range: &std::ops::Range<usize>) {
    let times = (1 << random.random_range(0..12)).min(LARGEST / range.len().max(1));
    let many = bytes[range.clone()].repeat(times);
    bytes.splice(range.clone(), many);
}

/// The text in another encoding, with a mark in front, or with other ends of lines.
fn encoded(random: &mut impl Rng, bytes: &[u8]) -> Vec<u8> {
    match random.random_range(0..3) {
        0 => [b"\xef\xbb\xbf", bytes].concat(),
        1 => {
            let wide = bytes.iter().flat_map(|byte| [*byte, 0]);
            b"\xff\xfe".iter().copied().chain(wide).collect()
        }
        _ => bytes.split(|byte| *byte == b'\n').collect::<Vec<_>>().join(&b"\r\n"[..]),
    }
}

/// Where the words of a text are, each of those for which `belongs` holds throughout.
fn words(bytes: &[u8], belongs: fn(&u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|byte| belongs(byte)).count();
        if length > 0 {
            found.push(at..at + length);
        }
        at += length + 1;
    }
    found
}

/// Another number in place of one of the text, or of a word of 4 or 8 bytes.
fn number(random: &mut impl Rng, bytes: &mut Vec<u8>) {
    let all = words(bytes, |byte| byte.is_ascii_digit() || b".-+".contains(byte));
    if all.is_empty() || random.random_range(0..8) == 0 {
        return word(random, bytes);
    }
    let range = pick(random, &all).clone();
    let new = match random.random_range(0..8) {
        0 => "9".repeat(1 << random.random_range(0..12)),
        1 => format!("0.{}1", "0".repeat(1 << random.random_range(0..10))),
        2 => random.random_range(-100..100i32).to_string(),
        3 => random.random::<f64>().to_string(),
        _ => pick(random, &NUMBERS).to_string(),
    };
    bytes.splice(range, new.into_bytes());
}

/// A word of 4 or 8 bytes, often where one may be.
fn word(random: &mut impl Rng, bytes: &mut [u8]) {
    let size = if random.random() { 8 } else { 4 };
    let Some(last) = bytes.len().checked_sub(size) else { return };
    let at = random.random_range(0..=last);
    let at = if random.random() { at / size * size } else { at };
    let mut new = *pick(random, &WORDS);
    if random.random() {
        new = new.wrapping_add(random.random_range(0..4)).wrapping_sub(2);
    }
    bytes[at..at + size].copy_from_slice(&new.to_le_bytes()[..size]);
}

/// Two words of a text change places, or one takes that of the other.
fn exchange_words(random: &mut impl Rng, bytes: &mut Vec<u8>) {
    let all = words(bytes, |byte| byte.is_ascii_alphanumeric() || b"_-.".contains(byte));
    if all.is_empty() {
        return;
    }
    let (from, to) = (pick(random, &all).clone(), pick(random, &all).clone());
    let new = bytes[from].to_vec();
    bytes.splice(to, new);
}
