//! Gmsh files: the meshes of the repository, wrong files, and damaged ones.

use railsqueal::grid::ContactGrid;
use railsqueal::mesh::{inp, msh, CellKind, Facet, Mesh, MeshPieces};
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(name)
}

fn read(name: &str) -> Mesh {
    msh::read(&file(name)).expect(name)
}

#[test]
fn ascii_and_binary_hold_the_same_block() {
    let volume = 40e-3 * 32e-3 * 20e-3;
    for body in ["lower", "upper"] {
        let ascii = read(&format!("block-{body}.msh"));
        let binary = read(&format!("block-{body}-binary.msh"));
        assert_eq!((ascii.nodes.len(), ascii.cells.len()), (484, 300));
        assert!(ascii.identical(&binary), "{body}");
        let facets: Vec<(&str, usize)> = ascii.groups.iter().map(|(n, f)| (n.as_str(), f.len())).collect();
        assert_eq!(facets, [("base", 100), ("contact", 36), ("sides", 120)]);
        if body == "lower" {
            let error = ascii.volume() / volume - 1.0;
            assert!(error.abs() < 1e-14, "{error:e}");
        }
        for (name, direction) in [("contact", 1.0), ("base", -1.0)] {
            let up = if body == "lower" { direction } else { -direction };
            for &facet in &ascii.groups[name] {
                let f: Vec<u32> = ascii.cells.facet(facet).collect();
                let [a, b, c] = [f[0], f[1], f[2]].map(|n| ascii.nodes[n as usize]);
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!(up * area > 0.0, "a facet of {name} of the {body} body faces inwards");
            }
        }
    }
}

/// The files that Gmsh wrote of one kind of cell.
fn of_kind(kind: &str) -> [PathBuf; 4] {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/msh");
    ["4.1", "4.1-binary", "2.2", "2.2-binary"].map(|format| folder.join(format!("{kind}-{format}.msh")))
}

/// Gmsh's own order of the nodes: each lies in the middle of the corners around it; and four formats of one mesh.
#[test]
fn every_kind_of_cell_is_read_from_every_format() {
    for kind in CellKind::ALL {
        let name = format!("{kind:?}").to_lowercase();
        let meshes = of_kind(&name).map(|path| msh::read(&path).unwrap_or_else(|e| panic!("{e}")));
        let mesh = &meshes[0];
        assert!(mesh.cells.iter().all(|c| c.kind == kind), "{name}");
        assert!((mesh.volume() / 6e-3 - 1.0).abs() < 1e-12, "{name}: {} m³", mesh.volume());
        for cell in mesh.cells.iter() {
            let x = cell.places(&mesh.nodes);
            for (node, around) in x[kind.corners()..].iter().zip(kind.between()) {
                for c in 0..3 {
                    let mean = around.iter().map(|&i| x[i as usize][c]).sum::<f64>() / around.len() as f64;
                    assert!(
                        (node[c] - mean).abs() < 1e-12,
                        "{name}: a node at {node:?}, not in the middle of {around:?}"
                    );
                }
            }
        }
        for (group, z) in [("bottom", 0.0), ("top", 0.1)] {
            let area = |f: &Facet| {
                let x: Vec<[f64; 3]> = mesh.cells.facet(*f).map(|n| mesh.nodes[n as usize]).collect();
                assert!(x.iter().all(|p| (p[2] - z).abs() < 1e-12), "{name}, {group}: {x:?}");
                let n = mesh.cells.get(f.cell as usize).kind.faces()[f.face as usize].kind.corners();
                let [a, b] = [[2, 0], [n - 1, 1]].map(|[i, j]| [x[i][0] - x[j][0], x[i][1] - x[j][1]]);
                0.5 * (a[0] * b[1] - a[1] * b[0])
            };
            let area: f64 = mesh.groups[group].iter().map(area).sum();
            let outward = if z > 0.0 { 0.06 } else { -0.06 };
            assert!((area - outward).abs() < 1e-12, "{name}, {group}: {area} m²");
        }
        // Version 2.2 has 16 digits of a coordinate; the order of cells and nodes is the same.
        for other in &meshes[1..] {
            assert!(mesh.identical(other), "{name}");
        }
        assert_eq!(mesh.reflected().reflected(), *mesh, "{name}");
        let image = mesh.reflected();
        assert!((image.volume() / 6e-3 - 1.0).abs() < 1e-12, "{name}: {} m³ of the mirror image", image.volume());
    }
}

/// Faces of nine nodes are four rectangles of the grid; of other faces it is said what they are.
#[test]
fn contact_grids_of_second_order() {
    let grid = |kind: &str| ContactGrid::from_mesh(&msh::read(&of_kind(kind)[0]).expect(kind), "top");
    let (linear, full) = (grid("hex8").expect("a grid"), grid("hex27").expect("a grid"));
    assert_eq!((linear.x.len(), linear.y.len()), (3, 3));
    assert_eq!((full.x.len(), full.y.len()), (5, 5));
    assert!(full.x.iter().zip([0.0, 0.075, 0.15, 0.225, 0.3]).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", full.x);
    for (kind, word) in
        [("hex20", "no node in its middle"), ("tet10", "6-node triangle"), ("wedge6", "3-node triangle")]
    {
        let error = grid(kind).expect_err(kind);
        assert!(error.exit_code() == 3 && error.message().contains(word), "{error}");
    }
}

#[test]
fn the_blocks_have_matching_contact_grids() {
    let lower = ContactGrid::from_mesh(&read("block-lower.msh"), "contact").expect("lower grid");
    let upper = ContactGrid::from_mesh(&read("block-upper-binary.msh").reflected(), "contact").expect("upper grid");
    ContactGrid::matched(&lower, &upper, 1e-12).expect("the same grid");
    assert_eq!((lower.x.len(), lower.y.len()), (7, 7));
    assert!(lower.z.iter().all(|z| z.abs() < 1e-15));
    for (j, y) in upper.y.iter().enumerate() {
        for (i, x) in upper.x.iter().enumerate() {
            let exact = -(0.1 - (0.01 - x * x).sqrt() + 0.2 - (0.04 - y * y).sqrt());
            let found = upper.z[i + 7 * j];
            assert!((found - exact).abs() < 1e-12, "({i}, {j}): {found} {exact}");
        }
    }
    let error = ContactGrid::from_mesh(&read("block-upper.msh"), "contact").expect_err("not in lower form");
    assert!(error.message().contains("faces -z"), "{error}");
}

#[test]
fn a_missing_group_names_those_there_are() {
    let mesh = read("block-lower.msh");
    assert!(mesh.require_group("base", "block-lower.msh").is_ok());
    let error = mesh.require_group("inner", "block-lower.msh").expect_err("no such group");
    assert_eq!(error.exit_code(), 3);
    assert!(error.message().contains("\"base\", \"contact\", \"sides\""), "{error}");
    assert!(error.message().contains("physical group in Gmsh"), "{error}");
    // Gmsh tells BASE from base.
    assert!(mesh.require_group("BASE", "block-lower.msh").is_err());
    let deck = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/inp/hex8.inp");
    let mesh = inp::read(&deck, MeshPieces::One).expect("a deck").0;
    for mesh in [&mesh, &mesh.reflected()] {
        let error = mesh.require_group("inner", "hex8.inp").expect_err("no such group").to_string();
        assert!(error.contains("\"bottom\"") && error.contains("*SURFACE"), "{error}");
        assert!(!error.contains("Gmsh"), "{error}");
    }
}

/// A cube of one hexahedron with tags far apart, in pieces that the tests below exchange.
struct File {
    format: &'static str,
    names: &'static str,
    entities: &'static str,
    nodes: String,
    elements: String,
}

const NODES: &str = "1 9 10 5000000000\n3 1 0 9\n10\n20\n30\n40\n50\n60\n70\n5000000000\n77\n\
    0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n9 9 9\n";
const ELEMENTS: &str = "2 2 1 2\n2 7 3 1\n1 10 20 30 40\n3 1 5 1\n2 10 20 30 40 50 60 70 5000000000\n";

impl File {
    fn new() -> Self {
        File {
            format: "4.1 0 8",
            names: "2\n2 4 \"bottom of it\"\n3 1 \"body\"\n",
            entities: "0 0 1 1\n7 0 0 0 1 1 0 1 4 0\n1 0 0 0 1 1 1 0 0\n",
            nodes: NODES.into(),
            elements: ELEMENTS.into(),
        }
    }

    fn text(&self) -> String {
        format!(
            "$MeshFormat\n{}\n$EndMeshFormat\n$Comments\nanything $ \
             here\n$EndComments\n$PhysicalNames\n{}$EndPhysicalNames\n\
             $Entities\n{}$EndEntities\n$Nodes\n{}$EndNodes\n$Elements\n{}$EndElements\n",
            self.format, self.names, self.entities, self.nodes, self.elements
        )
    }

    fn parse(&self) -> railsqueal::Result<Mesh> {
        msh::parse(self.text().as_bytes(), "cube.msh")
    }
}

#[test]
fn sparse_tags_unused_nodes_and_facets_turned_inwards_are_read() {
    let mesh = File::new().parse().expect("a cube");
    assert_eq!((mesh.nodes.len(), mesh.cells.len()), (8, 1));
    assert_eq!(mesh.cells.get(0).nodes, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(mesh.groups["bottom of it"], [Facet { cell: 0, face: 0 }]);
    assert!(mesh.cells.facet(mesh.groups["bottom of it"][0]).eq([0, 3, 2, 1]));
    let crlf = File::new().text().replace('\n', "\r\n");
    assert_eq!(msh::parse(crlf.as_bytes(), "cube.msh").expect("with carriage returns"), mesh);
}

/// A partitioned mesh has its groups in entities of its own, which are parts of those of the model.
#[test]
fn groups_of_partitioned_entities_are_read() {
    let whole = File::new().parse().expect("a cube");
    let text =
        File { elements: ELEMENTS.replace("2 7 3 1", "2 12 3 1").replace("3 1 5 1", "3 5 5 1"), ..File::new() }.text();
    let parted = |surface: &str| {
        let section = format!(
            "$EndEntities\n$PartitionedEntities\n2\n1\n99 1\n\
             1 1 2 1\n9 0 3 1 2 0 0 0 0\n8 1 3 2 1 2 0 0 0 1 0 0 0 2 9 -9\n{surface}\n\
             13 2 1 2 1 2 0 0 0 0 1 1 0 0\n5 3 1 1 1 0 0 0 1 1 1 0 2 12 -13\n$EndPartitionedEntities\n"
        );
        msh::parse(text.replace("$EndEntities\n", &section).as_bytes(), "cube.msh")
    };
    // The group at the part of the surface, or at the surface alone that it is a part of.
    for surface in ["12 2 7 1 1 0 0 0 1 1 0 1 4 4 1 2 3 4", "12 2 7 1 1 0 0 0 1 1 0 0 0"] {
        assert_eq!(parted(surface).expect("a partitioned cube"), whole);
    }
    let without = parted("12 2 6 1 1 0 0 0 1 1 0 0 0").expect("of a surface without a group");
    assert!(without.groups.is_empty());
    let error = parted("12 2 7 1 1 0 0 0 1 1 0 x 4").expect_err("no number").to_string();
    assert!(error.contains("cube.msh, line 24") && error.contains("physical groups"), "{error}");
}

/// A cube in version 2.2, with or without parameters of the nodes on curves and surfaces.
#[test]
fn nodes_with_parameters_are_read_in_version_2() {
    let file = |kind: &str, on: [&str; 8]| {
        let corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"];
        let nodes: String = (0..8).map(|i| format!("{} {}{}\n", i + 1, corners[i], on[i])).collect();
        let text = format!(
            "\u{feff}$MeshFormat\n2.2 0 8\n$EndMeshFormat\n${kind}Nodes\n8\n{nodes}$End{kind}Nodes\n$Elements\n2\n\
             1 3 2 4 7 1 2 3 4\n2 5 2 1 1 1 2 3 4 5 6 7 8\n$EndElements\n"
        );
        msh::parse(text.as_bytes(), "cube.msh")
    };
    let plain = file("", [""; 8]).expect("without parameters");
    assert_eq!(plain.groups["4"], [Facet { cell: 0, face: 0 }]);
    let on = [" 0 1", " 1 2 0.5", " 2 7 0.25 0.75", " 3 1", " 0 5", " 0 6", " 1 3 0", " 2 8 1 0"];
    assert_eq!(file("Parametric", on).expect("with parameters"), plain);
    let error = file("Parametric", [" 1 3"; 8]).expect_err("no parameter").to_string();
    assert!(error.contains("cube.msh, line"), "{error}");
}

/// A tetrahedron of 10 nodes whose opposite edges nearly cross, `height` apart: its middle nodes meet, and no seam is
/// open.
#[test]
fn flat_tetrahedra_are_told_and_those_too_flat_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = |height: f64| {
        let corners = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, height], [1.0, 0.0, height]];
        let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|c| 0.5 * (corners[a][c] + corners[b][c]));
        let edges = [[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]].map(middle);
        let nodes = corners.iter().chain(&edges).enumerate();
        let nodes: String = nodes.map(|(i, [x, y, z])| format!("{} {x} {y} {z:e}\n", i + 1)).collect();
        let path = folder.path().join("flat.msh");
        let text = format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n{nodes}$EndNodes\n$Elements\n1\n\
             17 11 2 1 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n"
        );
        std::fs::write(&path, text).expect("write");
        msh::read_remarked(&path, MeshPieces::One)
    };
    let (mesh, remarks) = read(1e-5).unwrap_or_else(|e| panic!("{e}"));
    // A third of the height; the longest edge is √2.
    assert!((mesh.volume() / (1e-5 / 3.0) - 1.0).abs() < 1e-9);
    let [remark] = &remarks[..] else { panic!("{remarks:?}") };
    for word in ["flat.msh", "10-node tetrahedron 17 is flat", "nodes 5 and 9", "1.2e-6", "1 of 1 cells"] {
        assert!(remark.contains(word), "{word} not in {remark}");
    }
    assert!(read(0.3).expect("a good one").1.is_empty());
    let error = read(1e-9).expect_err("too flat").to_string();
    assert!(error.contains("line 19") && error.contains("1.2e-10") && error.contains("optimize_netgen"), "{error}");
}

#[track_caller]
fn refused(file: File, words: &[&str]) {
    let error = file.parse().expect_err(words[0]);
    assert_eq!(error.exit_code(), 3, "{error}");
    for word in words {
        assert!(error.message().contains(word), "{word} not in: {error}");
    }
}

#[test]
fn wrong_files_are_refused_with_the_place() {
    let f = File::new;
    refused(File { format: "2.1 0 8", ..f() }, &["cube.msh, line 2", "2.1", "4.1 or 2.2"]);
    refused(File { format: "4 0 8", ..f() }, &["line 2", "\"4\""]);
    refused(File { format: "4.1 0 4", ..f() }, &["line 2", "data size"]);
    refused(File { format: "4.1 2 8", ..f() }, &["line 2", "file type"]);
    refused(File { format: "4.1", ..f() }, &["line 2", "4.1 0 8"]);
    refused(File { names: "1\n2 4 bottom\n", ..f() }, &["line 9", "bottom", "\"name\""]);
    refused(File { entities: "0 0 1 x\n", ..f() }, &["line 13", "found \"x\""]);
    refused(File { nodes: NODES.replace("1 0 1", "1 zero 1"), ..f() }, &["line 34", "zero", "coordinate"]);
    refused(File { nodes: NODES.replace("1 0 1", "1 nan 1"), ..f() }, &["line 34", "nan", "finite"]);
    refused(File { nodes: NODES.replace("1 0 1", "1 0 1 5"), ..f() }, &["line 34", "end of the line"]);
    refused(File { nodes: NODES.replace("\n20\n", "\n10\n"), ..f() }, &["line 21", "a second node 10"]);
    refused(File { nodes: NODES.replace("1 9 10 ", "1 8 10 "), ..f() }, &["8 nodes announced, 9 found"]);
    refused(File { nodes: NODES.replace("3 1 0 9", "3 1 0 99999999999999"), ..f() }, &["line", "node tag"]);
    refused(File { nodes: NODES.replace("1 9 10", "1 99999999999999999999 10"), ..f() }, &["line 18", "whole number"]);
    refused(
        File { nodes: NODES.replace("0 1 1\n", "0 0 1\n"), ..f() },
        &["cube.msh, line 44", "inverted", "8-node hexahedron 2", "at its node 50"],
    );
    let high = "1 1 1 1\n3 1 92 1\n1 10 20 30 50\n".to_string();
    refused(File { elements: high, ..f() }, &["line 41", "64-node hexahedron", "8-node hexahedron (5)"]);
    let hex20 = ELEMENTS.replace("3 1 5 1", "3 1 17 1");
    refused(File { elements: hex20, ..f() }, &["line 45", "node tag of an element"]);
    // A tetrahedron on top of the cube, on half of its face; and one on half of the bottom, in the file as well.
    let mut nodes = NODES.replace("1 9 10", "1 10 10").replace("3 1 0 9", "3 1 0 10").replace("\n77\n", "\n77\n78\n");
    nodes.push_str("0.2 0.5 2\n");
    let elements = format!("{}3 1 4 1\n3 50 60 70 78\n", ELEMENTS.replace("2 2 1 2", "3 3 1 3"));
    refused(File { nodes, elements, ..f() }, &["hexahedron 2", "tetrahedron 3", "not joined", "pyramids"]);
    refused(File { elements: ELEMENTS.replace("3 1 5 1", "3 1 999 1"), ..f() }, &["element type 999"]);
    let triangle = "2 2 1 2\n2 7 2 1\n1 10 20 30\n3 1 5 1\n2 10 20 30 40 50 60 70 5000000000\n".to_string();
    refused(File { elements: triangle, ..f() }, &["3-node triangle 1", "not a face"]);
    let cubic = "2 2 1 2\n2 7 36 1\n1 10 20 30\n3 1 5 1\n2 10 20 30 40 50 60 70 5000000000\n".to_string();
    refused(File { elements: cubic, ..f() }, &["16-node quadrilateral", "boundary"]);
    refused(File { elements: ELEMENTS.replace(" 70 5", " 71 5"), ..f() }, &["hexahedron 2", "node 71"]);
    refused(File { elements: ELEMENTS.replace(" 70 5", " 5"), ..f() }, &["line 45", "found \"$EndElements\""]);
    refused(File { elements: ELEMENTS.replace(" 70 5", " 70 60 5"), ..f() }, &["line 44", "end of the line"]);
    refused(File { elements: ELEMENTS.replace("2 2 1 2", "2 3 1 2"), ..f() }, &["3 elements announced, 2 found"]);
    refused(
        File { elements: ELEMENTS.replace("1 10 20 30 40", "1 10 20 30 77"), ..f() },
        &["quadrilateral 1", "no cell"],
    );
    refused(
        File { elements: ELEMENTS.replace("1 10 20 30 40", "1 10 20 30 60"), ..f() },
        &["quadrilateral 1", "not a face"],
    );
    refused(File { elements: "1 1 1 1\n2 7 3 1\n1 10 20 30 40\n".into(), ..f() }, &["no cells"]);
    let left = ELEMENTS.replace("10 20 30 40 50 60 70 5000000000", "50 60 70 5000000000 10 20 30 40");
    refused(File { elements: left, ..f() }, &["hexahedron 2 is inverted", "-1.250e-1", "left-handed"]);
    let two = "2 17 1 17\n3 1 0 9\n10\n20\n30\n40\n50\n60\n70\n5000000000\n77\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 \
     1\n1 0 1\n1 1 1\n0 1 1\n9 9 9\n\
        3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n";
    let both = "2 3 1 3\n2 7 3 1\n1 10 20 30 40\n3 1 5 2\n2 10 20 30 40 50 60 70 5000000000\n3 1 2 3 4 5 6 7 8\n";
    let apart = "0 0 2\n1 0 2\n1 1 2\n0 1 2\n0 0 3\n1 0 3\n1 1 3\n0 1 3\n";
    refused(
        File { nodes: format!("{two}{apart}"), elements: both.into(), ..f() },
        &["line 62", "2 pieces", "hexahedron 3"],
    );
    let onto = "0 0 1\n1 0 1\n1 1 1\n0 1 1\n0 0 2\n1 0 2\n1 1 2\n0 1 2\n";
    refused(
        File { nodes: format!("{two}{onto}"), elements: both.into(), ..f() },
        &["same place", "50 and 1 ", "merged", "4 pairs", "along a seam", "2 pieces"],
    );
    for text in ["", "\n\n", "solid cube", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"] {
        let error = msh::parse(text.as_bytes(), "empty.msh").expect_err("nothing in it");
        assert!(error.exit_code() == 3 && error.message().contains("empty.msh"), "{error}");
    }
    let error = msh::read(&file("no-such.msh")).expect_err("no such file");
    assert!(error.exit_code() == 3 && error.message().contains("no-such.msh"), "{error}");
    let error = msh::read(&file(".")).expect_err("a directory");
    assert_eq!(error.exit_code(), 3);
}

#[test]
fn truncated_files_are_refused_at_every_length() {
    let files = ["block-upper.msh", "block-upper-binary.msh"].map(file);
    let [_, _, text, binary] = of_kind("tet10");
    for path in files.into_iter().chain([text, binary]) {
        let name = path.file_name().and_then(|n| n.to_str()).expect("a name");
        let data = std::fs::read(&path).expect(name);
        let end = data.len() - "$EndElements\n".len();
        for length in (0..end).step_by(97).chain(end - 50..end) {
            let error = msh::parse(&data[..length], name).expect_err("truncated");
            assert_eq!(error.exit_code(), 3);
            assert!(error.message().contains(name), "{error}");
        }
        let error = msh::parse(&data[..data.len() / 2], name).expect_err("truncated");
        let place = if name.contains("binary") { "byte " } else { "line " };
        assert!(error.message().contains(place) && error.message().contains("truncated"), "{error}");
    }
}
