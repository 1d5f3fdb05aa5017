//! Mutations of glTF files that keep the JSON well formed: of its values, and of the bytes in its
//! buffers.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use libfuzzer_sys::fuzzer_mutate;
use serde_json::{Map, Value, json};

/// Mutates the first `size` bytes of `data` in place. Returns the new size.
pub fn mutate(data: &mut [u8], size: usize, max_size: usize, seed: u32) -> usize {
    let mut dice = Dice(u64::from(seed) ^ 0x9e37_79b9_7f4a_7c15);
    // Mutates the raw bytes now and then, so that containers, encodings and syntax are covered too.
    if dice.one_in(12) {
        return fuzzer_mutate(data, size, max_size);
    }
    let Some((mut root, mut bin)) = parse(&data[..size]) else {
        return fuzzer_mutate(data, size, max_size);
    };
    for _ in 0..=dice.below(3) {
        match (&mut bin, dice.below(8)) {
            (Some(bin), 0) => {
                mutate_bytes(bin);
                if !dice.one_in(8) {
                    set_length(&mut root, 0, bin.len());
                }
            }
            (_, 1) => mutate_uri(&mut root, &mut dice),
            _ => mutate_value(&mut root, &mut dice),
        }
    }
    let written = assemble(&root, bin.as_deref());
    if written.len() > max_size {
        return fuzzer_mutate(data, size, max_size);
    }
    data[..written.len()].copy_from_slice(&written);
    written.len()
}

/// Parses the JSON and, in a GLB, the binary chunk.
fn parse(bytes: &[u8]) -> Option<(Value, Option<Vec<u8>>)> {
    if !bytes.starts_with(b"glTF") {
        return Some((serde_json::from_slice(bytes).ok()?, None));
    }
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let end = word(12)?.checked_add(20)?;
    let root = serde_json::from_slice(bytes.get(20..end)?).ok()?;
    Some((root, Some(bytes.get(end.checked_add(8)?..).unwrap_or_default().to_vec())))
}

fn assemble(root: &Value, bin: Option<&[u8]>) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    let Some(bin) = bin else { return text };
    text.resize(text.len().next_multiple_of(4), b' ');
    let bin_size = bin.len().next_multiple_of(4);
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    let total = 12 + 8 + text.len() + 8 + bin_size;
    let mut file = words(&[0x4654_6c67, 2, total as u32, text.len() as u32, 0x4e4f_534a]);
    file.extend(text);
    file.extend(words(&[bin_size as u32, 0x004e_4942]));
    file.extend(bin);
    file.resize(total, 0);
    file
}

fn mutate_bytes(bytes: &mut Vec<u8>) {
    let size = bytes.len();
    let room = size + 16;
    bytes.resize(room, 0);
    let size = fuzzer_mutate(bytes, size, room);
    bytes.truncate(size);
}

/// Mutates the bytes in the data URI of a buffer or an image.
fn mutate_uri(root: &mut Value, dice: &mut Dice) {
    let list = if dice.one_in(2) { "images" } else { "buffers" };
    let Some(items) = root.get_mut(list).and_then(Value::as_array_mut).filter(|list| !list.is_empty()) else {
        return;
    };
    let index = dice.below(items.len());
    let Some(Value::String(uri)) = items[index].get_mut("uri") else { return };
    let Some(mut bytes) = uri.split_once(";base64,").and_then(|(_, data)| STANDARD.decode(data).ok()) else { return };
    mutate_bytes(&mut bytes);
    *uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes));
    if list == "buffers" && !dice.one_in(8) {
        set_length(root, index, bytes.len());
    }
}

fn set_length(root: &mut Value, buffer: usize, length: usize) {
    if let Some(Value::Object(buffer)) = root.get_mut("buffers").and_then(|buffers| buffers.get_mut(buffer)) {
        buffer.insert("byteLength".to_owned(), length.into());
    }
}

/// Mutates one value of the tree.
fn mutate_value(root: &mut Value, dice: &mut Dice) {
    let donor = descend(&mut root.clone(), dice).clone();
    let value = descend(root, dice);
    if dice.one_in(10) {
        *value = if dice.one_in(2) { donor } else { strange(dice) };
        return;
    }
    match value {
        Value::Number(_) => *value = number(value.as_f64().unwrap_or(0.0), dice),
        Value::String(text) => match dice.below(4) {
            0 => text.push_str(dice.word(&["/", "..", "%20", "%00", "%ff", "é", ",", "\n", "\u{1b}[7m"])),
            1 => text.truncate(text.char_indices().nth(dice.below(9)).map_or(text.len(), |(at, _)| at)),
            _ => *text = dice.word(WORDS).to_owned(),
        },
        Value::Bool(flag) => *flag = !*flag,
        Value::Array(list) => mutate_list(list, donor, dice),
        Value::Object(map) => mutate_map(map, donor, dice),
        Value::Null => *value = donor,
    }
}

fn mutate_list(list: &mut Vec<Value>, donor: Value, dice: &mut Dice) {
    if list.is_empty() {
        list.push(donor);
        return;
    }
    let (i, j) = (dice.below(list.len()), dice.below(list.len()));
    match dice.below(6) {
        0 => drop(list.remove(i)),
        1 => list.insert(j, list[i].clone()),
        2 => list.swap(i, j),
        3 => list.push(donor),
        4 => list.truncate(i),
        _ => list.extend_from_within(..),
    }
}

fn mutate_map(map: &mut Map<String, Value>, donor: Value, dice: &mut Dice) {
    let keys: Vec<String> = map.keys().cloned().collect();
    match dice.below(4) {
        0 if !keys.is_empty() => drop(map.remove(dice.pick(&keys).as_str())),
        1 => drop(map.insert(dice.word(WORDS).to_owned(), donor)),
        2 if !keys.is_empty() => {
            if let Some(value) = map.remove(dice.pick(&keys).as_str()) {
                map.insert(dice.word(WORDS).to_owned(), value);
            }
        }
        _ => {
            let (place, text) = *dice.pick(PIECES);
            let piece: Value = serde_json::from_str(text).unwrap_or_default();
            map.insert(place.to_owned(), piece);
        }
    }
}

/// Chooses a value of the tree at any depth.
fn descend<'a>(value: &'a mut Value, dice: &mut Dice) -> &'a mut Value {
    if dice.one_in(6) {
        return value;
    }
    let inner = match value {
        Value::Array(list) => list.len(),
        Value::Object(map) => map.len(),
        _ => 0,
    };
    if inner == 0 {
        return value;
    }
    let at = dice.below(inner);
    match value {
        Value::Array(list) => descend(&mut list[at], dice),
        Value::Object(map) => descend(map.values_mut().nth(at).expect("below the length"), dice),
        _ => unreachable!("other values hold none"),
    }
}

/// Chooses a number near `now`, or one at a limit of the formats.
fn number(now: f64, dice: &mut Dice) -> Value {
    match dice.below(5) {
        0 => json!((now as i64).saturating_add(1)),
        1 => json!((now as i64).saturating_sub(1)),
        2 => json!(now * 2.0),
        3 => json!(dice.below(9)),
        _ => serde_json::from_str(dice.word(NUMBERS)).unwrap_or_default(),
    }
}

fn strange(dice: &mut Dice) -> Value {
    let values = ["null", "true", "[]", "{}", "\"\"", "[[]]", "[{}]", "-1", "1e308", "[0]", "{\"extras\":0}"];
    serde_json::from_str(dice.word(&values)).unwrap_or_default()
}

const NUMBERS: &[&str] = &[
    "0", "1", "-1", "2", "3", "4", "12", "0.5", "-0.0", "127", "128", "255", "256", "32767", "65535", "65536", "16777216",
    "2147483647", "2147483648", "4294967295", "4294967296", "9007199254740993", "18446744073709551615", "1e-45", "1e-38",
    "1e-6", "1e6", "1e18", "1e19", "3.4e38", "1e39", "-3.4e38", "1e308", "3.141592653589793", "5120", "5121", "5122", "5123",
    "5125", "5126",
];

const WORDS: &[&str] = &include!("gltf_words.rs");

/// Fragments of files that the corpus may lack, with their keys.
const PIECES: &[(&str, &str)] = &include!("gltf_pieces.rs");

/// Random number generator SplitMix64 (Steele, Lea, Flood 2014).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0 to `limit` - 1.
    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }

    fn one_in(&mut self, chances: usize) -> bool {
        self.below(chances) == 0
    }

    fn word(&mut self, list: &[&'static str]) -> &'static str {
        list[self.below(list.len())]
    }

    fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}
