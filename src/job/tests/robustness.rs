//! Harmed jobs are refused without a panic.

use super::*;

/// A small linear congruential generator: the mutations must be the same in every run.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) % n.max(1) as u64) as usize
    }
}

#[test]
fn no_mutation_of_a_job_panics() {
    let mut random = Lcg(20250101);
    let words: [&[u8]; 12] = [
        b"null",
        b"-1",
        b"1e308",
        b"0",
        b"{}",
        b"[]",
        b"\"\"",
        b"true",
        b"NaN",
        b"18446744073709551615",
        b"\\u0000",
        b"\xc3",
    ];
    let (mut refused, mut accepted) = (0, 0);
    for round in 0..4000 {
        let mut bytes = if round % 2 == 0 { TWO.to_vec() } else { ANNULUS.to_vec() };
        for _ in 0..1 + random.below(2) {
            let at = random.below(bytes.len());
            match random.below(5) {
                0 => bytes[at] = random.below(256) as u8,
                1 => drop(bytes.splice(at..at, words[random.below(words.len())].iter().copied())),
                2 => bytes.truncate(at.max(1)),
                3 => {
                    let end = (at + random.below(40)).min(bytes.len());
                    let piece = bytes[at..end].to_vec();
                    let to = random.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
                _ => {
                    let end = (at + random.below(40)).min(bytes.len());
                    bytes.drain(at..end);
                    bytes.push(b' ');
                }
            }
        }
        match read(&bytes, &[]) {
            Ok(_) => accepted += 1,
            Err(e) => {
                assert_eq!(e.exit_code(), 2, "{e}");
                assert!(!e.message().is_empty());
                refused += 1;
            }
        }
    }
    assert!(refused > 2000 && accepted > 100, "the mutations reach both sides: {refused} refused, {accepted} accepted");
}

/// Every scalar of the job replaced by every kind of value, through the typed path: no panic, and an error names a
/// path.
#[test]
fn no_replacement_of_a_value_panics() {
    fn paths(value: &Value, path: String, out: &mut Vec<String>) {
        out.push(path.clone());
        let inner = |k: String| if path.is_empty() { k } else { format!("{path}.{k}") };
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| paths(v, inner(k.clone()), out)),
            Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| paths(v, inner(i.to_string()), out)),
            _ => {}
        }
    }
    let mut all = Vec::new();
    paths(&serde_json::from_slice(TWO).unwrap(), String::new(), &mut all);
    assert!(all.len() > 50, "{}", all.len());
    let values = [
        "null",
        "true",
        "-1",
        "0",
        "1e-300",
        "1e300",
        "1e17",
        "text",
        "[]",
        "[0]",
        "{}",
        "{\"cylinder\":{}}",
        "9007199254740993",
    ];
    for path in all.iter().filter(|p| !p.is_empty()) {
        for value in values {
            let set = format!("{path}={value}");
            if let Err(e) = read(TWO, &[&set]) {
                assert_eq!(e.exit_code(), 2, "{set}: {e}");
                assert!(e.message().starts_with("folder/job.json: "), "{set}: {e}");
            }
        }
    }
}
