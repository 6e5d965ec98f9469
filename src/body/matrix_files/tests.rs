//! Every format by a file written by hand, round trips against writers of their own, and what is refused.

use super::dofs::Dof;
use super::*;

mod harwell_boeing;

fn dense(m: &Csr) -> Vec<Vec<f64>> {
    (0..m.n).map(|i| (0..m.n).map(|j| m.get(i, j)).collect()).collect()
}

fn dof(node: i64, direction: u8) -> Dof {
    Dof { node, direction }
}

fn good(text: &str, format: Format, name: Option<&str>) -> LabelledMatrix {
    parse(text.as_bytes(), format, name).unwrap_or_else(|f| panic!("line {}: {}\n{text}", f.line, f.what))
}

#[track_caller]
fn refused(text: &str, format: Format, line: usize, says: &[&str]) {
    let fault = parse(text.as_bytes(), format, None).expect_err(text);
    assert!(fault.line == line, "line {}, expected {line}: {}\n{text}", fault.line, fault.what);
    assert!(says.iter().all(|s| fault.what.contains(s)), "{}; expected {says:?}", fault.what);
}

/// K of the hand-written files: node 3 with x and y, node 7 with x.
const HAND: [[f64; 3]; 3] = [[4.0, -1.0, 0.5], [-1.0, 3.0, 0.0], [0.5, 0.0, 2.5e5]];

fn is_hand(read: &LabelledMatrix, dofs: bool) {
    assert_eq!(dense(&read.matrix), HAND.map(|r| r.to_vec()));
    let expected = vec![dof(3, 1), dof(3, 2), dof(7, 1)];
    assert_eq!(read.dofs, dofs.then_some(expected));
}

#[test]
fn abaqus_files_by_hand() {
    let triangle = "3,1, 3,1, 4.0\n3,2, 3,1, -1.00000000e+00\n3,2, 3,2, 3\n7,1, 3,1,.5\n7,1, 7,1, 2.5D+05,\n";
    let square = format!("{triangle}3,1,3,2,-1\n3,1,7,1,0.5\n");
    let keyword = format!("** written\n*Matrix input, name=K, TYPE=Symmetric\n{triangle}");
    let scaled = triangle.replace("4.0", "2").replace("-1.0", "-.5").replace(",2, 3\n", ",2,1.5\n");
    let scaled = scaled.replace(".5\n7,1, 7", ".25\n7,1, 7").replace("2.5D", "1.25D");
    let scaled = format!("*MATRIX INPUT, SCALE FACTOR=2.\n{}", scaled.replace("1.25\n", "1.5\n"));
    for text in [triangle, &square, &keyword, &triangle.replace(',', " "), &triangle.replace('\n', "\r\n"), &scaled] {
        is_hand(&good(text, Format::Abaqus, None), true);
    }
    let marked = [b"\xef\xbb\xbf".to_vec(), triangle.as_bytes().to_vec()].concat();
    is_hand(&parse(&marked, Format::Abaqus, None).unwrap(), true);
    let coordinate = "1 1 4.0\n1 2 -1\n2 2 3\n1 3 .5\n3 3 2.5e5\n";
    is_hand(&good(coordinate, Format::Abaqus, None), false);
    // Two matrices in a file, by their names; an unsymmetric one is listed in full.
    let two =
        format!("*MATRIX INPUT, NAME=M\n1,1,1,1,2.\n{keyword}*MATRIX INPUT, NAME=C, TYPE=UNSYMMETRIC\n1,1,1,2,5.\n");
    is_hand(&good(&two, Format::Abaqus, Some("k")), true);
    assert_eq!(dense(&good(&two, Format::Abaqus, Some("C")).matrix), [[0.0, 5.0], [0.0, 0.0]]);
    refused(&two, Format::Abaqus, 0, &["M, K, C", "name it"]);
    // Nodes that Abaqus makes for itself.
    let internal = good("-1,1,-1,1,3.\n4,1,4,1,2\n", Format::Abaqus, None);
    assert_eq!(internal.dofs, Some(vec![dof(-1, 1), dof(4, 1)]));
}

#[test]
fn abaqus_files_that_are_not_certain_are_refused() {
    let refused = |text: &str, line, says: &[&str]| refused(text, Format::Abaqus, line, says);
    refused("", 0, &["no matrix"]);
    refused("*MATRIX INPUT, NAME=K\n", 0, &["truncated"]);
    refused("1,1,1,1,2.\n1,1,1,1,2.\n", 2, &["(node 1 x, node 1 x) again", "line 1"]);
    refused("1,1,1,2,2.\n1,2,1,1,2.\n1,3,1,1,1.\n", 3, &["(node 1 z, node 1 x) without (node 1 x, node 1 z)"]);
    refused("1,1,1,1,nan\n", 1, &["\"nan\"", "finite"]);
    refused("1,1,1,1\n", 1, &["expected \"row node"]);
    refused("1,8,1,8,2.\n", 1, &["direction 8 of node 1"]);
    refused("0,1,0,1,2.\n", 1, &["node 0"]);
    refused("1,1,1,1,1.\n1 1 2.\n", 2, &["three and of five"]);
    refused("*USER ELEMENT, NODES=2\n1,2\n", 1, &["*USER ELEMENT", "*MATRIX GENERATE"]);
    refused("*MATRIX INPUT, INPUT=other.mtx\n", 1, &["INPUT=other.mtx"]);
    refused("1 1 1.\n100000000 100000000 1.\n", 0, &["100000000 rows with 2 entries"]);
    refused("%%MatrixMarkt matrix\n1 1 1\n", 1, &["expected \"row node"]);
}

#[test]
fn calculix_files_by_hand() {
    is_hand(&good("1 1  4.0e+00\n1 2 -1\n2 2 3\n1 3 .5\n2 3 0.0\n3 3 2.5e5\n", Format::CalculiX, None), false);
    let refused = |text: &str, line, says: &[&str]| refused(text, Format::CalculiX, line, says);
    refused("1 1 4\n2 1 1\n2 2 1\n", 2, &["(2, 1) below the diagonal"]);
    refused("1 1 4\n3 3 1\n", 0, &["no diagonal entry in row 2"]);
    refused("1 1 4\n1 1 4\n", 2, &["again"]);
    refused("1 1\n", 1, &["expected row, column and value"]);
    refused("", 0, &["empty"]);
    refused("1 0 2\n", 1, &["column 0"]);
    let named = parse(b"1 1 4\n", Format::CalculiX, Some("K")).unwrap_err();
    assert!(named.what.contains("leave it out"), "{}", named.what);
}

#[test]
fn maps_of_degrees_of_freedom() {
    let expected = vec![dof(3, 1), dof(12, 2), dof(7, 6)];
    for text in [
        "3.1\n12.2\n7.6\n",
        "# node, direction\r\n3 1\r\n12,2\r\n7 6\r\n",
        " Matrix Eqn  Node  DOF\n 2 12 UY\n 1 3 UX\n 3 7 ROTZ\n",
    ] {
        assert_eq!(dofs::parse(text).unwrap(), expected, "{text}");
    }
    for (text, line, says) in [
        ("", 0, "no degree of freedom"),
        ("3.1\n3.1\n", 2, "node 3 x again, given in line 1"),
        ("3.7\n", 1, "direction 7"),
        ("3\n", 1, "node.direction"),
        ("1 3 UX\n3 4 UX\n", 2, "row 3"),
        ("1 3 UX\n4 1\n", 2, "with and without"),
        ("1 3 TEMP\n", 1, "\"TEMP\""),
        ("1 2 3 4\n", 1, "node and direction"),
    ] {
        let fault = dofs::parse(text).unwrap_err();
        assert!(fault.line == line && fault.what.contains(says), "line {}: {}\n{text}", fault.line, fault.what);
    }
}

#[test]
fn dmig_entries_by_hand() {
    let small = "$ punched\nDMIG    KAAX           0       6       2       0                       0\n\
        DMIG    KAAX           3       1               3       1     4.0\n\
        +              3       2    -1.0\n\
        DMIG    KAAX           3       2               3       2     3.0\n\
        DMIG    KAAX           7       1               3       1      .5\n\
        +              7       1   2.5+5\n";
    let large = "DMIG    KAAX           0       6       2       0\n\
        DMIG*   KAAX                           3               1\n\
        *                      3               1 4.000000000D+00\n\
        *                      3               2-1.000000000D+00\n\
        *                      7               1 5.000000000D-01\n\
        DMIG*   KAAX                           3               2\n\
        *                      3               2 3.000000000D+00\n\
        DMIG*   KAAX                           7               1\n\
        *                      7               1 2.500000000D+05\n";
    let free = "DMIG,KAAX,0,6,1\nGRID,3,,0.,0.,0.\nDMIG,KAAX,3,1,,3,1,4.,,+A\n+A,3,2,-1.,,7,1,.5\n\
        dmig,kaax,3,2,,3,2,3.\nDMIG*,KAAX,7,1\n*,7,1,2.5+5\n";
    let square = "DMIG,KAAX,0,1,2,0\nDMIG,KAAX,3,1,,3,1,4.,0.\n,3,2,-1.,,7,1,.5\nDMIG,KAAX,3,2,,3,1,-1.,,\n,3,2,3.\n\
        DMIG,KAAX,7,1,,3,1,.5\n,7,1,2.5+5\n";
    for text in [small, large, free, square, &large.replace('\n', "\r\n")] {
        is_hand(&good(text, Format::Dmig, None), true);
    }
    let two = format!("{free}DMIG,MAAX,0,6,1\nDMIG,MAAX,3,0,,3,,2.\n");
    is_hand(&good(&two, Format::Dmig, Some("KAAX")), true);
    assert_eq!(good(&two, Format::Dmig, Some("maax")).dofs, Some(vec![dof(3, 0)]));
    refused(&two, Format::Dmig, 0, &["KAAX, MAAX", "name it"]);
    // A matrix that is not taken does not stand in the way of others.
    let other = format!("DMIG,QHH,0,9,3,,,,2\nDMIG,QHH,1,0,,1,1,2.,3.\n{free}");
    is_hand(&good(&other, Format::Dmig, Some("kaax")), true);
    let fault = parse(other.as_bytes(), Format::Dmig, Some("QHH")).unwrap_err();
    assert!(fault.line == 1 && fault.what.contains("TIN \"3\""), "{}", fault.what);
}

#[test]
fn dmig_entries_that_are_not_certain_are_refused() {
    let refused = |text: &str, line, says: &[&str]| refused(text, Format::Dmig, line, says);
    refused("", 0, &["no matrix"]);
    refused("DMIG,K,0,6,3\n", 1, &["TIN \"3\"", "complex"]);
    refused("DMIG,K,0,9,1,,,,4\n", 1, &["IFO \"9\"", "rectangular"]);
    refused("DMIG,K,0,7,1\n", 1, &["IFO \"7\""]);
    refused("DMIG,K,0,6,1,,1\n", 1, &["POLAR"]);
    refused("DMIG,K,0,6,1\n", 0, &["truncated"]);
    refused("DMIG,K,0,6,1\nDMIG,K,0,6,1\n", 2, &["second header"]);
    refused("DMIG,K,1,1,,1,1,2.\n", 1, &["its header in front"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,1,,1,1,2.,3.\n", 2, &["imaginary part"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,1,,1,2,2.\nDMIG,K,1,2,,1,1,2.\n", 3, &["of a symmetric matrix", "lines 2 and 3"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,1,,1,1,2.\nDMIG,K,1,1,,1,1,2.\n", 3, &["again", "line 2"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,1,,1,1\n", 2, &["column node 1 x", "finite number"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,7,,1,1,2.\n", 2, &["direction 7"]);
    refused("DMIG,K,0,6,1\nDMIG,K,1,1,,1,1,NaN\n", 2, &["finite"]);
    refused("DMIG    K              0       6       1\nDMIG    K\t1\t1\n", 2, &["tab"]);
    refused("*  1  2\n", 1, &["continuation"]);
    refused("INCLUDE 'k.pch'\n", 1, &["INCLUDE"]);
    refused("DMIG,1K,0,6,1\n", 1, &["begins with a letter"]);
    // Fields that stand beside their columns.
    refused(
        "DMIG    K              0       6       1\nDMIG    K            1 1       1       1       1     2.0\n",
        2,
        &["one field"],
    );
}

/// A value of OUTPUT4 in `width` columns.
fn e(value: f64, width: usize) -> String {
    let text = format!("{value:.16E}");
    let (mantissa, exponent) = text.split_once('E').unwrap();
    let exponent: i32 = exponent.parse().unwrap();
    format!("{:>width$}", format!("{mantissa}E{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs()))
}

#[test]
fn op4_text_by_hand() {
    let dense = "       3       3       6       2K       1P,3E23.16\n       1       1       3\n".to_owned()
        + &format!("{}{}{}\n", e(4.0, 23), e(-1.0, 23), e(0.5, 23))
        + "       2       1       2\n"
        + &format!("{}{}\n", e(-1.0, 23), e(3.0, 23))
        + "       3       1       3\n"
        + &format!("{}{}{}\n", e(0.5, 23), e(0.0, 23), e(2.5e5, 23))
        + &format!("       4       1       1\n{}\n", e(1.0, 23));
    let short = "       3       3       1       2K       1P,2E23.16\n       1       0       7\n".to_owned()
        + &format!("{}\n{}{}\n{}\n", 1 + 65536 * 7, e(4.0, 23), e(-1.0, 23), e(0.5, 23))
        + &format!("       2       0       5\n{}\n{}{}\n", 1 + 65536 * 5, e(-1.0, 23), e(3.0, 23))
        + &format!(
            "       3       0       6\n{}\n{}\n{}\n{}\n",
            1 + 65536 * 3,
            e(0.5, 23),
            3 + 65536 * 3,
            e(2.5e5, 23)
        )
        + &format!("       4       1       1\n{}\n", e(1.0, 23));
    let long = "       3      -3       6       2K       1P,2E23.16\n       1       0       8\n".to_owned()
        + &format!("       7       1\n{}{}\n{}\n", e(4.0, 23), e(-1.0, 23), e(0.5, 23))
        + &format!("       2       0       6\n       5       1\n{}{}\n", e(-1.0, 23), e(3.0, 23))
        + &format!("       3       0       8\n       3       1\n{}\n       3       3\n{}\n", e(0.5, 23), e(2.5e5, 23))
        + &format!("       4       1       1\n{}\n", e(1.0, 23));
    for text in [&dense, &short, &long, &dense.replace('E', "D"), &dense.replace('\n', "\r\n")] {
        is_hand(&good(text, Format::Op4, None), false);
    }
    let second = dense.replace("2K  ", "2M  ");
    is_hand(&good(&format!("{second}{short}"), Format::Op4, Some("k")), false);
    let refused = |text: &str, line, says: &[&str]| refused(text, Format::Op4, line, says);
    refused(&format!("{dense}{second}"), 0, &["K, M"]);
    refused("", 0, &["no matrix"]);
    refused(&dense.replace("6       2K", "6       4K"), 1, &["type 4", "complex"]);
    refused(&dense.replace("6       2K", "3       2K"), 1, &["form 3"]);
    refused(&dense.replacen("       3       3", "       3       4", 1), 1, &["4 rows and 3 columns"]);
    refused(&dense.replace("1P,3E23.16", "1P,3X23.16"), 1, &["format"]);
    refused(&dense.split_inclusive('\n').take(6).collect::<String>(), 6, &["truncated"]);
    refused(&dense.replace(&e(0.5, 23), &e(0.75, 23)).replacen(&e(0.75, 23), &e(0.5, 23), 1), 0, &["form is 6"]);
    refused(&dense.replace(&e(3.0, 23), "                    NaN"), 5, &["finite"]);
    refused(&dense.replace("       2       1       2", "       1       1       2"), 4, &["column 1", "behind 1"]);
    refused(&dense.replace("       1       1       3", "       1       2       3"), 3, &["row 4"]);
    refused(
        &short.replace(&format!("{}", 1 + 65536 * 5), &format!("{}", 1 + 65536 * 9)),
        7,
        &["longer than its column"],
    );
}

/// A record of Fortran in one byte order.
fn record(content: &[u8], big: bool) -> Vec<u8> {
    let length = content.len() as i32;
    let length = if big { length.to_be_bytes() } else { length.to_le_bytes() };
    [&length[..], content, &length[..]].concat()
}

/// A binary OUTPUT4 file: dense (0), strings (1), long strings (2), of numbers of four bytes or of eight.
fn op4_binary(name: &str, matrix: &[Vec<f64>], way: u8, (big, wide): (bool, bool)) -> Vec<u8> {
    let int = |v: i64| {
        let bytes = if big { v.to_be_bytes() } else { v.to_le_bytes() }.to_vec();
        match (wide, big) {
            (true, _) => bytes,
            (false, true) => bytes[4..].to_vec(),
            (false, false) => bytes[..4].to_vec(),
        }
    };
    let per = if wide { 1 } else { 2 };
    let real = |v: f64| if big { v.to_be_bytes() } else { v.to_le_bytes() }.to_vec();
    let n = matrix.len() as i64;
    let head = [n, if way == 2 { -n } else { n }, 1, 2].map(int).concat();
    let mut all =
        record(&[head, if wide { format!("{name:16}") } else { format!("{name:8}") }.into_bytes()].concat(), big);
    for j in 0..matrix.len() {
        let column: Vec<f64> = matrix.iter().map(|row| row[j]).collect();
        let mut strings: Vec<(usize, Vec<f64>)> = Vec::new();
        for (i, &v) in column.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            match strings.last_mut().filter(|(first, s)| first + s.len() == i) {
                Some((_, s)) => s.push(v),
                None => strings.push((i, vec![v])),
            }
        }
        let Some(first) = strings.first().map(|s| s.0) else { continue };
        let content = if way == 0 {
            let values: Vec<u8> = column[first..].iter().flat_map(|v| real(*v)).collect();
            [[j as i64 + 1, first as i64 + 1, per * (n - first as i64)].map(int).concat(), values].concat()
        } else {
            let mut data = Vec::new();
            let mut words = 0;
            for (first, s) in &strings {
                let length = per * s.len() as i64;
                let place = if way == 2 {
                    vec![length + 1, *first as i64 + 1]
                } else {
                    vec![*first as i64 + 1 + 65536 * (length + 1)]
                };
                words += place.len() as i64 + length;
                data.extend(place.into_iter().flat_map(int));
                data.extend(s.iter().flat_map(|v| real(*v)));
            }
            [[j as i64 + 1, 0, words].map(int).concat(), data].concat()
        };
        all.extend(record(&content, big));
    }
    all.extend(record(&[[n + 1, 1, per].map(int).concat(), real(1.0)].concat(), big));
    all
}

/// Numbers of a generator, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }

    fn value(&mut self) -> f64 {
        (self.below(2_000_001) as f64 - 1e6) * 10f64.powi(self.below(13) as i32 - 6)
    }
}

/// Writers of symmetric matrices for the round trips.
fn files(matrix: &[Vec<f64>], dofs: &[Dof]) -> Vec<(Format, Vec<u8>, bool)> {
    let n = matrix.len();
    let pairs = |below: bool| {
        let inside = move |i: usize, j: usize| if below { i >= j } else { i <= j };
        (0..n)
            .flat_map(move |j| (0..n).map(move |i| (i, j)))
            .filter(move |&(i, j)| inside(i, j) && (i == j || matrix[i][j] != 0.0))
    };
    let mut all = Vec::new();
    let abaqus = |full: bool| -> String {
        (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .filter(|&(i, j)| (full || i >= j) && (i == j || matrix[i][j] != 0.0))
            .map(|(i, j)| {
                format!(
                    "{},{}, {},{}, {:.17e}\n",
                    dofs[i].node, dofs[i].direction, dofs[j].node, dofs[j].direction, matrix[i][j]
                )
            })
            .collect()
    };
    all.push((Format::Abaqus, abaqus(false).into_bytes(), true));
    all.push((Format::Abaqus, abaqus(true).into_bytes(), true));
    let ccx: String = pairs(false).map(|(i, j)| format!("{} {} {:.17e}\n", i + 1, j + 1, matrix[i][j])).collect();
    all.push((Format::CalculiX, ccx.into_bytes(), false));
    let mut dmig = "DMIG    KAAX           0       6       2       0\n".to_owned();
    let mut free = "DMIG,KAAX,0,6,2\n".to_owned();
    for j in 0..n {
        dmig += &format!("DMIG*   {:16}{:16}{:16}\n", "KAAX", dofs[j].node, dofs[j].direction);
        free += &format!("DMIG,KAAX,{},{}", dofs[j].node, dofs[j].direction);
        let mut fields = 4;
        for (i, _) in pairs(true).filter(|p| p.1 == j) {
            let value = e(matrix[i][j], 24);
            // Sixteen columns hold ten digits: the round trip of large field is of those.
            let short = format!("{:.9e}", matrix[i][j]);
            let (mantissa, exponent) = short.split_once('e').unwrap();
            let short = format!("{mantissa}{:+}", exponent.parse::<i32>().unwrap());
            dmig += &format!("*       {:16}{:16}{short:>16}\n", dofs[i].node, dofs[i].direction);
            if fields == 4 {
                free += ",";
            } else if fields % 8 == 0 {
                free += "\n";
            }
            free += &format!(",{},{},{},", dofs[i].node, dofs[i].direction, value.trim());
            fields += 4;
        }
        free += "\n";
    }
    all.push((Format::Dmig, dmig.into_bytes(), true));
    all.push((Format::Dmig, free.into_bytes(), true));
    let mut op4 = format!("{n:8}{n:8}{:8}{:8}{:8}1P,3E24.16\n", 6, 2, "K");
    for j in 0..n {
        op4 += &format!("{:8}{:8}{n:8}\n", j + 1, 1);
        for chunk in (0..n).collect::<Vec<_>>().chunks(3) {
            op4 += &chunk.iter().map(|&i| e(matrix[i][j], 24)).collect::<String>();
            op4 += "\n";
        }
    }
    op4 += &format!("{:8}{:8}{:8}\n{}\n", n + 1, 1, 1, e(1.0, 24));
    all.push((Format::Op4, op4.into_bytes(), false));
    for way in 0..3 {
        all.push((Format::Op4, op4_binary("K", matrix, way, (way == 1, false)), false));
        all.push((Format::Op4, op4_binary("K", matrix, way, (way == 2, true)), false));
    }
    let entries: Vec<(usize, usize)> = pairs(true).collect();
    let mut pointers = vec![1];
    for j in 0..n {
        pointers.push(pointers[j] + entries.iter().filter(|p| p.1 == j).count());
    }
    let block = |words: Vec<String>, per: usize| -> (usize, String) {
        let lines: Vec<String> = words.chunks(per).map(|c| c.concat() + "\n").collect();
        (lines.len(), lines.concat())
    };
    let (p, pointers) = block(pointers.iter().map(|p| format!("{p:8}")).collect(), 7);
    let (r, rows) = block(entries.iter().map(|e| format!("{:8}", e.0 + 1)).collect(), 9);
    let (v, values) = block(entries.iter().map(|&(i, j)| e(matrix[i][j], 25)).collect(), 3);
    let mut hb = format!("{:72}{:8}\n{:14}{p:14}{r:14}{v:14}\n", "round trip", "K", p + r + v);
    hb += &format!(
        "{:14}{n:14}{n:14}{:14}{:14}\n{:16}{:16}{:20}\n",
        "RSA",
        entries.len(),
        0,
        "(7I8)",
        "(9I8)",
        "(1P,3E25.16)"
    );
    all.push((Format::HarwellBoeing, (hb + &pointers + &rows + &values).into_bytes(), false));
    let head = format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}\n", entries.len());
    let body: String = entries.iter().map(|&(i, j)| format!("{} {} {:.17e}\n", i + 1, j + 1, matrix[i][j])).collect();
    all.push((Format::MatrixMarket, (head + &body).into_bytes(), false));
    all
}

#[test]
fn round_trips_give_the_matrix_back() {
    let mut dice = Dice(7);
    for _ in 0..300 {
        let n = 1 + dice.below(14) as usize;
        let mut matrix = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                let value = if i == j || dice.below(3) == 0 { dice.value() } else { 0.0 };
                (matrix[i][j], matrix[j][i]) = (value, value);
            }
            matrix[i][i] = matrix[i][i].abs() + 1.0;
        }
        let mut dofs: Vec<Dof> = Vec::new();
        while dofs.len() < n {
            let next = dof(1 + dice.below(9) as i64, 1 + dice.below(6) as u8);
            if !dofs.contains(&next) {
                dofs.push(next);
            }
        }
        dofs.sort();
        for (format, bytes, labelled) in files(&matrix, &dofs) {
            let read = parse(&bytes, format, None).unwrap_or_else(|f| {
                panic!("{format:?}: line {}: {}\n{}", f.line, f.what, String::from_utf8_lossy(&bytes))
            });
            assert_eq!(read.dofs, labelled.then(|| dofs.clone()), "{format:?}");
            for (i, row) in dense(&read.matrix).iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    let off = (value - matrix[i][j]).abs();
                    let digits = if format == Format::Dmig { 1e-9 } else { 0.0 };
                    assert!(off <= digits * value.abs(), "{format:?}: ({i}, {j}) {value}, expected {}", matrix[i][j]);
                }
            }
        }
    }
}

#[test]
fn binary_files_that_are_damaged_are_refused() {
    let matrix = HAND.map(|r| r.to_vec());
    for (way, kind) in [(0, (false, false)), (1, (true, false)), (2, (false, true)), (1, (true, true))] {
        let bytes = op4_binary("K", &matrix, way, kind);
        is_hand(&parse(&bytes, Format::Op4, None).unwrap(), false);
        is_hand(&parse(&bytes, Format::Op4, Some("k")).unwrap(), false);
        for end in 4..bytes.len() {
            assert!(parse(&bytes[..end], Format::Op4, None).is_err(), "{end} bytes");
        }
        assert!(parse(&bytes, Format::Op4, Some("M")).unwrap_err().what.contains("the matrices K"));
        let mut wrong = bytes.clone();
        wrong[0] ^= 4;
        assert!(parse(&wrong, Format::Op4, None).is_err());
    }
    let mut nan = matrix.clone();
    nan[1][1] = f64::NAN;
    let fault = parse(&op4_binary("K", &nan, 0, (false, false)), Format::Op4, None).unwrap_err();
    assert!(fault.what.contains("finite"), "{}", fault.what);
}

#[test]
fn formats_follow_the_ending() {
    let by = |name: &str, bytes: &[u8]| Format::by_ending(Path::new(name), bytes);
    assert_eq!(by("a.mtx", b"%%MatrixMarket matrix"), Ok(Format::MatrixMarket));
    assert_eq!(by("a.mtx", b"\xef\xbb\xbf%%matrixmarket matrix"), Ok(Format::MatrixMarket));
    assert_eq!(by("a.MTX", b"1,1,1,1,2."), Ok(Format::Abaqus));
    assert_eq!(by("a.sti", b""), Ok(Format::CalculiX));
    assert_eq!(by("a.pch", b""), Ok(Format::Dmig));
    assert_eq!(by("a.op4", b""), Ok(Format::Op4));
    assert_eq!(by("a.rsa", b""), Ok(Format::HarwellBoeing));
    assert!(by("a.txt", b"").unwrap_err().contains("name the format"));
}
