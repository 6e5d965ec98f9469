//! Reader of Matrix Market files (<https://math.nist.gov/MatrixMarket/formats.html>): real square matrices,
//! coordinate or array.

/// A real square matrix in compressed rows, whole, duplicate entries added up.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr {
    /// Order.
    pub n: usize,
    /// Start of each row in `cols`, `[n + 1]`.
    pub indptr: Vec<usize>,
    /// 0-based column of each entry, ascending in a row.
    pub cols: Vec<u64>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl Csr {
    /// From entries (row, column, value) in any order; equal places are added up.
    pub fn from_entries(n: usize, mut entries: Vec<(usize, usize, f64)>) -> Csr {
        entries.sort_unstable_by_key(|&(i, j, _)| (i, j));
        let mut csr = Csr { n, indptr: vec![0; n + 1], cols: Vec::new(), values: Vec::new() };
        let mut last = None;
        for (i, j, v) in entries {
            if last == Some((i, j)) {
                if let Some(sum) = csr.values.last_mut() {
                    *sum += v;
                }
                continue;
            }
            last = Some((i, j));
            csr.cols.push(j as u64);
            csr.values.push(v);
            csr.indptr[i + 1] = csr.cols.len();
        }
        for i in 0..n {
            csr.indptr[i + 1] = csr.indptr[i + 1].max(csr.indptr[i]);
        }
        csr
    }

    /// Entry (i, j), 0 where none is stored.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let row = self.indptr[i]..self.indptr[i + 1];
        self.cols[row.clone()].binary_search(&(j as u64)).map_or(0.0, |k| self.values[row.start + k])
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> (&[u64], &[f64]) {
        let row = self.indptr[i]..self.indptr[i + 1];
        (&self.cols[row.clone()], &self.values[row])
    }

    /// The entry farthest from symmetry, (row, column, |a_ij − a_ji| / largest |a|); `None` for a symmetric matrix.
    pub fn asymmetry(&self) -> Option<(usize, usize, f64)> {
        let largest = self.values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut worst = None;
        for i in 0..self.n {
            let (cols, values) = self.row(i);
            for (&j, v) in cols.iter().zip(values) {
                let d = (v - self.get(j as usize, i)).abs() / largest;
                if d > worst.map_or(0.0, |(_, _, w)| w) {
                    worst = Some((i, j as usize, d));
                }
            }
        }
        worst
    }
}

/// How an entry above the diagonal follows from the one below.
#[derive(Clone, Copy, PartialEq)]
enum Symmetry {
    General,
    Symmetric,
    Skew,
}

/// Largest order: MUMPS numbers rows with 32 bits, and a torn header must not ask for memory without end.
const MAX_ORDER: usize = 100_000_000;

/// Matrices of up to so many rows may have empty ones, as a damping matrix of a few dashpots has: a file of a few
/// bytes must not ask for memory without end.
const UNCHECKED: usize = 4_000_000;

/// Line number and fault.
type Fault = (usize, String);

/// Parses a real square matrix.
pub(super) fn parse(text: &str) -> std::result::Result<Csr, Fault> {
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l.trim()));
    let (_, banner) = lines.next().ok_or((1, "the file is empty; expected a Matrix Market file".to_string()))?;
    let words: Vec<String> = banner.split_whitespace().map(str::to_ascii_lowercase).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (array, symmetry) = match words[..] {
        ["%%matrixmarket", "matrix", format @ ("coordinate" | "array"), "real" | "integer" | "double", symmetry] => {
            let symmetry = match symmetry {
                "general" => Symmetry::General,
                "symmetric" => Symmetry::Symmetric,
                "skew-symmetric" => Symmetry::Skew,
                other => return Err((1, format!("found the symmetry \"{other}\", expected general or symmetric"))),
            };
            (format == "array", symmetry)
        }
        _ => {
            let expected = "%%MatrixMarket matrix coordinate|array real|integer general|symmetric";
            return Err((1, format!("found \"{banner}\", expected \"{expected}\"")));
        }
    };
    let mut content = lines.filter(|(_, l)| !l.is_empty() && !l.starts_with('%'));
    let end = text.lines().count();
    let missing = |what: &str| (end, format!("the file ends before {what}; it is truncated"));
    let (at, sizes) = content.next().ok_or_else(|| missing("the sizes"))?;
    let sizes: Vec<&str> = sizes.split_whitespace().collect();
    let expected = if array { "two sizes: rows and columns" } else { "three sizes: rows, columns and entries" };
    let numbers: Vec<usize> = sizes.iter().map_while(|s| s.parse().ok()).collect();
    if numbers.len() != sizes.len() || numbers.len() != if array { 2 } else { 3 } {
        return Err((at, format!("found \"{}\", expected {expected}", sizes.join(" "))));
    }
    let (n, columns) = (numbers[0], numbers[1]);
    if n != columns || n == 0 {
        return Err((at, format!("found a matrix of {n} rows and {columns} columns, expected a square one")));
    }
    if n > MAX_ORDER {
        return Err((at, format!("found a matrix of {n} rows, expected at most {MAX_ORDER}")));
    }
    // An array lists whole columns, or their part on and below (skew: below) the diagonal.
    let first = |j: usize| match symmetry {
        Symmetry::General => 0,
        Symmetry::Symmetric => j,
        Symmetry::Skew => j + 1,
    };
    let places: Box<dyn Iterator<Item = (usize, usize)>> = if array {
        Box::new((0..n).flat_map(|j| (first(j)..n).map(move |i| (i, j))))
    } else {
        Box::new(std::iter::repeat_n((0, 0), numbers[2]))
    };
    let mut entries = Vec::new();
    for place in places {
        let (at, line) = content.next().ok_or_else(|| missing("its last entry"))?;
        let (i, j, v) = entry(line, array.then_some(place), n).map_err(|what| (at, what))?;
        if symmetry != Symmetry::General && (i < j || (i == j && symmetry == Symmetry::Skew)) {
            return Err((
                at,
                format!("found the entry ({}, {}), expected those below the diagonal only", i + 1, j + 1),
            ));
        }
        entries.push((i, j, v));
        if i != j && symmetry != Symmetry::General {
            entries.push((j, i, if symmetry == Symmetry::Skew { -v } else { v }));
        }
    }
    if let Some((at, line)) = content.next() {
        return Err((
            at,
            format!("found \"{line}\", expected the end of the file: all entries announced have been read"),
        ));
    }
    if n > entries.len().max(UNCHECKED) {
        let found = entries.len();
        return Err((
            at,
            format!(
                "found a matrix of {n} rows with {found} entries, expected at least one in each \
         row; the file is incomplete, or the order wrong"
            ),
        ));
    }
    Ok(Csr::from_entries(n, entries))
}

/// One entry: its place (0-based) and value.
fn entry(line: &str, place: Option<(usize, usize)>, n: usize) -> std::result::Result<(usize, usize, f64), String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let value = |w: &str| match w.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("found the value \"{w}\", expected a finite number")),
    };
    match (place, &words[..]) {
        (Some((i, j)), [v]) => Ok((i, j, value(v)?)),
        (None, [i, j, v]) => {
            let index = |w: &str| match w.parse::<usize>() {
                Ok(k) if (1..=n).contains(&k) => Ok(k - 1),
                _ => Err(format!("found the index \"{w}\", expected one of 1 to {n}")),
            };
            Ok((index(i)?, index(j)?, value(v)?))
        }
        (Some(_), _) => Err(format!("found \"{line}\", expected one value")),
        (None, _) => Err(format!("found \"{line}\", expected row, column and value")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dense(text: &str) -> Vec<Vec<f64>> {
        let m = parse(text).unwrap();
        (0..m.n).map(|i| (0..m.n).map(|j| m.get(i, j)).collect()).collect()
    }

    #[test]
    fn formats_and_symmetries_give_the_same_matrix() {
        let full = vec![vec![2.0, -1.0], vec![-1.0, 3.5]];
        let texts = [
            "%%MatrixMarket matrix coordinate real general\n% remark\n2 2 4\n1 1 2\n2 2 3.5\n\n1 2 -1\n2 1 -1e0\n",
            "%%MatrixMarket MATRIX coordinate real symmetric\n2 2 4\n1 1 1\n2 1 -1\n2 2 3.5\n1 1 1\n",
            "%%MatrixMarket matrix array real general\n2 2\n2\n-1\n-1\n3.5\n",
            "%%MatrixMarket matrix array real symmetric\n2 2\n2\n-1\n3.5\n",
        ];
        for text in texts {
            assert_eq!(dense(text), full, "{text}");
        }
        let skew = "%%MatrixMarket matrix coordinate integer skew-symmetric\n2 2 1\n2 1 4\n";
        assert_eq!(dense(skew), [[0.0, -4.0], [4.0, 0.0]]);
        assert_eq!(parse(skew).unwrap().asymmetry(), Some((0, 1, 2.0)));
        assert_eq!(parse(texts[0]).unwrap().asymmetry(), None);
    }

    #[test]
    fn faults_name_the_line() {
        let head = "%%MatrixMarket matrix coordinate real general\n";
        for (text, line, says) in [
            (String::new(), 1, "empty"),
            ("1 2 3\n".into(), 1, "expected \"%%MatrixMarket"),
            ("%%MatrixMarket matrix coordinate complex general\n".into(), 1, "complex"),
            ("%%MatrixMarket matrix coordinate real hermitian\n".into(), 1, "hermitian"),
            (head.into(), 1, "truncated"),
            (format!("{head}2 3 1\n1 1 1\n"), 2, "2 rows and 3 columns"),
            (format!("{head}2 2\n"), 2, "three sizes"),
            (format!("{head}9000000000000000000 9000000000000000000 0\n"), 2, "at most 100000000"),
            (format!("{head}100000000 100000000 1\n1 1 2.0\n"), 2, "100000000 rows with 1 entries"),
            (format!("{head}2 2 2\n1 1 1\n"), 3, "truncated"),
            (format!("{head}2 2 1\n1 3 1\n"), 3, "\"3\", expected one of 1 to 2"),
            (format!("{head}2 2 1\n1 1 nan\n"), 3, "finite"),
            (format!("{head}2 2 1\n1 1\n"), 3, "row, column and value"),
            (format!("{head}2 2 1\n1 1 1\n2 2 1\n"), 4, "end of the file"),
        ] {
            let (at, what) = parse(&text).unwrap_err();
            assert!(at == line && what.contains(says), "line {at}: {what}; expected line {line} and \"{says}\"");
        }
    }
}
