//! Text of input files: encoding, byte order mark, line ends.

/// Byte order mark of UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Bytes without the byte order mark of UTF-8 that editors may put in front.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(MARK).unwrap_or(bytes)
}

/// The text of a file: UTF-8 or UTF-16 by its byte order mark, else UTF-8, else Latin-1.
///
/// # Errors
/// Bytes that are no text in words, to be put behind the name of the file.
pub fn decode(bytes: &[u8]) -> Result<String, String> {
    let wide = |bytes: &[u8], from: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|b| from([b[0], b[1]]));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => return Ok(wide(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => return Ok(wide(rest, u16::from_be_bytes)),
        _ => {}
    }
    let bytes = without_mark(bytes);
    if bytes.contains(&0) {
        return Err("found bytes of zero, expected text: export the numbers as a text file".into());
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    })
}

/// Lines of a text with their numbers, from 1. Each of `\n`, `\r\n` and `\r` ends a line.
pub fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    let mut number = 0;
    std::iter::from_fn(move || {
        let here = rest.filter(|t| !t.is_empty())?;
        number += 1;
        let (line, behind) = match here.find(['\n', '\r']) {
            Some(end) => {
                let width = if here[end..].starts_with("\r\n") { 2 } else { 1 };
                (&here[..end], Some(&here[end + width..]))
            }
            None => (here, None),
        };
        rest = behind;
        Some((number, line))
    })
}

/// The beginning of a text for messages, control characters escaped.
pub fn excerpt(text: &str) -> String {
    text.trim()
        .chars()
        .take(60)
        .flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_and_line_end_gives_the_same_lines() {
        let plain = "y (µm)\n1\n\n2";
        let expected: Vec<(usize, &str)> = vec![(1, "y (µm)"), (2, "1"), (3, ""), (4, "2")];
        assert_eq!(lines(plain).collect::<Vec<_>>(), expected);
        let wide = |text: &str, to: fn(u16) -> [u8; 2], mark: [u8; 2]| -> Vec<u8> {
            mark.into_iter().chain(text.encode_utf16().flat_map(to)).collect()
        };
        for end in ["\n", "\r\n", "\r"] {
            let text = plain.replace('\n', end);
            let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
            let files = [
                text.clone().into_bytes(),
                [MARK, text.as_bytes()].concat(),
                latin,
                wide(&text, u16::to_le_bytes, [0xff, 0xfe]),
                wide(&text, u16::to_be_bytes, [0xfe, 0xff]),
            ];
            for bytes in files {
                let decoded = decode(&bytes).unwrap();
                assert_eq!(lines(&decoded).collect::<Vec<_>>(), expected);
            }
        }
        assert!(decode(b"1\0 2").unwrap_err().contains("bytes of zero"));
        assert_eq!(excerpt(" a\x1b[1m\tb "), "a\\u{1b}[1m\\tb");
    }
}
