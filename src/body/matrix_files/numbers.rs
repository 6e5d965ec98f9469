//! Numbers as Fortran programs and Nastran print them.

/// A finite real number: decimal point optional, exponents of E or D, or Nastran's without a letter (`1.5+3`).
pub(super) fn real(word: &str) -> Result<f64, String> {
    let word = word.trim();
    let fail = || format!("found the value \"{}\", expected a finite number", crate::input::text::excerpt(word));
    if word.is_empty() || !word.bytes().all(|b| b.is_ascii_digit() || b"+-.eEdD".contains(&b)) {
        return Err(fail());
    }
    let mut plain = word.to_ascii_lowercase().replace('d', "e");
    if !plain.contains('e') {
        // A sign behind the first character begins the exponent.
        if let Some(at) = plain.char_indices().skip(1).find(|(_, c)| matches!(c, '+' | '-')).map(|(at, _)| at) {
            plain.insert(at, 'e');
        }
    }
    match plain.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(fail()),
    }
}

/// A whole number.
pub(super) fn integer(word: &str, what: &str) -> Result<i64, String> {
    let word = word.trim();
    word.parse()
        .map_err(|_| format!("found \"{}\", expected {what}, a whole number", crate::input::text::excerpt(word)))
}

/// A row or a column of a matrix, 0-based, from a number that counts from 1.
pub(super) fn index(word: &str, what: &str) -> Result<usize, String> {
    match integer(word, what)? {
        i if (1..=super::MAX_ORDER as i64).contains(&i) => Ok(i as usize - 1),
        i => Err(format!("found the {what} {i}, expected one of 1 to {}", super::MAX_ORDER)),
    }
}

/// Characters `from..from + width` of a line of fixed columns, blank beyond its end.
pub(super) fn columns(line: &str, from: usize, width: usize) -> &str {
    let end = (from + width).min(line.len());
    line.get(from.min(end)..end).unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_of_fortran_and_nastran_are_read() {
        for (word, value) in [
            ("1.5", 1.5),
            (" -2.5E+3 ", -2500.0),
            ("1.234D-02", 0.01234),
            ("3.+5", 3e5),
            ("-7.1-3", -7.1e-3),
            ("+4", 4.0),
            ("1e5", 1e5),
            (".5", 0.5),
        ] {
            assert_eq!(real(word), Ok(value), "{word}");
        }
        for word in ["", "nan", "inf", "1e999", "1,5", "0x1", "1.0.0", "1e5e5", "--1", "*****", "infinity", "1_0"] {
            assert!(real(word).is_err(), "{word}");
        }
        assert!(integer("1.0", "a node").is_err() && integer("12", "a node") == Ok(12));
        assert!(index("0", "row").is_err() && index("3", "row") == Ok(2));
    }
}
