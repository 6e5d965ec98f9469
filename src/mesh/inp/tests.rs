//! Input files against Gmsh files of the same meshes, against what the manuals say, and wrong ones.

mod generated;

use super::{parse, read};
use crate::mesh::{msh, Facet, Mesh, MeshPieces};
use std::path::{Path, PathBuf};

fn data(folder: &str, file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(folder).join(file)
}

fn of(text: &str) -> crate::Result<(Mesh, Vec<String>)> {
    parse(text.as_bytes(), "cube.inp")
}

/// Groups as sorted facets, of some names.
fn facets(mesh: &Mesh, name: &str) -> Vec<Facet> {
    let mut facets = mesh.groups.get(name).cloned().unwrap_or_default();
    facets.sort_unstable();
    facets
}

/// Gmsh wrote the same meshes in both formats: cells in our order of nodes and groups are the same, places of nodes
/// to the digits that it wrote.
#[test]
fn a_mesh_is_the_same_from_both_formats() {
    for kind in ["tet4", "tet10", "wedge6", "wedge15", "hex8", "hex20"] {
        let expected = msh::read(&data("msh", &format!("{kind}-4.1.msh"))).expect(kind);
        let (found, _) = read(&data("inp", &format!("{kind}.inp")), MeshPieces::One).unwrap_or_else(|e| panic!("{e}"));
        assert!(found.cells == expected.cells && found.nodes.len() == expected.nodes.len(), "{kind}");
        let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-14;
        assert!(found.nodes.iter().flatten().zip(expected.nodes.iter().flatten()).all(same), "{kind}");
        for group in ["bottom", "top"] {
            assert!(!facets(&expected, group).is_empty());
            assert_eq!(facets(&found, group), facets(&expected, group), "{kind}, {group}");
        }
    }
}

const NODES: &str = "*NODE, NSET=All\n1, 0, 0, 0\n2, 1., 0.\n3, 1.0E0, 1.D0, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, \
 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n\
    11, 0, 0, 2\n12, 1, 0, 2\n13, 1, 1, 2\n14, 0, 1, 2\n";
const ELEMENTS: &str = "*ELEMENT, TYPE=C3D8R, ELSET=Lower\n1, 1, 2, 3, 4,\n5, 6, 7, 8\n*Element, type=c3d8i, \
 elset=Upper\n2, 5,6,7,8, 11,12,13,14\n";

/// Two cubes on top of each other with sets and surfaces of all kinds.
#[test]
fn sets_and_surfaces_are_groups() {
    let text = format!(
        "*Heading\n a cube\n** a comment\n{NODES}{ELEMENTS}*NSET, NSET=Foot\n1, 2, 3,\n4\n*nset, nset=Ring, \
         generate\n11, 14, 1\n\
         *NSET, NSET=Both\nfoot, ring\n*NSET, NSET=Edge\n1, 2\n*ELSET, ELSET=Whole, GENERATE\n1, 2\n*SURFACE, \
         NAME=\"Top Side\", TYPE=ELEMENT\nUpper, S2\n\
         *SURFACE, NAME=Side\nWHOLE, S3\n1, S4\n*SURFACE, NAME=Skin\nWhole\n*SURFACE, TYPE=NODE, \
         NAME=Below\nFoot, 1.0\n\
         *MATERIAL, NAME=Steel\n*ELASTIC\n210e9, 0.3\n*SOLID SECTION, \
         ELSET=Whole,\nMATERIAL=Steel\n*STEP\n*FREQUENCY\n10\n*NSET, NSET=None\n99\n*END STEP\n"
    );
    let (mesh, remarks) = of(&text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((mesh.nodes.len(), mesh.cells.len()), (12, 2));
    assert!((mesh.volume() - 2.0).abs() < 1e-14);
    let f = |cell, face| Facet { cell, face };
    let expected = [
        ("foot", vec![f(0, 0)]),
        ("ring", vec![f(1, 1)]),
        ("both", vec![f(0, 0), f(1, 1)]),
        ("top side", vec![f(1, 1)]),
        ("side", vec![f(0, 2), f(0, 3), f(1, 2)]),
        ("skin", vec![f(0, 0), f(0, 2), f(0, 3), f(0, 4), f(0, 5), f(1, 1), f(1, 2), f(1, 3), f(1, 4), f(1, 5)]),
        ("below", vec![f(0, 0)]),
    ];
    for (name, faces) in &expected {
        assert_eq!(facets(&mesh, name), *faces, "{name}");
    }
    // A set of all nodes and one of an edge are no groups; nothing in a step is looked at.
    assert_eq!(mesh.groups.len(), expected.len(), "{:?}", mesh.groups.keys());
    let said = remarks.join("\n");
    for words in [
        "cube.inp, line 17: 1 elements C3D8R with reduced integration",
        "line 1: *HEADING is left out",
        "*MATERIAL is left out: the material comes from the job",
        "*STEP is left out",
        "the node set \"edge\" holds no whole face",
    ] {
        assert!(said.contains(words), "{words} not in:\n{said}");
    }
    let crlf = of(&text.replace('\n', "\r\n")).expect("with carriage returns").0;
    assert_eq!(crlf, mesh);
}

/// `*NSET` with `ELSET` has the nodes of the elements of the set, of a part or of an instance.
#[test]
fn node_sets_of_element_sets() {
    let deck = format!("{NODES}{ELEMENTS}*NSET, NSET=Above, ELSET=Upper\n");
    let (mesh, _) = of(&deck).unwrap_or_else(|e| panic!("{e}"));
    let f = |cell, face| Facet { cell, face };
    assert_eq!(facets(&mesh, "above"), vec![f(1, 1), f(1, 2), f(1, 3), f(1, 4), f(1, 5)]);
    let part = format!(
        "*PART, NAME=P\n{NODES}{ELEMENTS}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=P-1, PART=P\n*END INSTANCE\n\
         *NSET, NSET=Above, ELSET=P-1.Upper\n*END ASSEMBLY\n"
    );
    assert_eq!(of(&part).unwrap_or_else(|e| panic!("{e}")).0.groups["above"].len(), 5);
    for (text, says) in [
        (format!("{NODES}{ELEMENTS}*NSET, NSET=Above, ELSET=None\n"), "no element set \"none\""),
        (format!("{deck}1, 2\n"), "expected no data below *NSET with ELSET"),
        (
            format!("{NODES}{ELEMENTS}*ELEMENT, TYPE=S4, ELSET=Skin\n9, 11, 12, 13, 14\n*NSET, NSET=A, ELSET=Skin\n"),
            "a set with shells or membranes",
        ),
    ] {
        let Err(error) = of(&text) else { panic!("{text}") };
        assert!(error.message().contains(says), "{error}");
    }
}

/// A part, moved by (10, 0, 0) first and turned by a quarter about the axis from (10, 0, 0) along z then: from x = 10
/// … 11 to y = 0 … 1.
#[test]
fn an_instance_is_moved_and_turned() {
    let text = format!(
        "*PART, NAME=Cubes\n{NODES}{ELEMENTS}*NSET, NSET=Foot\n1, 2, 3, 4\n*END PART\n*ASSEMBLY, \
         NAME=A\n*INSTANCE, NAME=Cubes-1, PART=Cubes\n10, 0, 0\n\
         10, 0, 0, 10, 0, 1, 90\n*END INSTANCE\n*NSET, NSET=Ring, INSTANCE=Cubes-1\n11, 12, 13, 14\n*ELSET, \
         ELSET=Up, INSTANCE=cubes-1\n2\n\
         *SURFACE, NAME=Top\nup, S2\n*SURFACE, NAME=Bottom\nCubes-1.Lower, S1\n*SURFACE, NAME=Side\ncubes-1.1, \
         S3\n*END ASSEMBLY\n"
    );
    let (mesh, _) = of(&text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(mesh.nodes[1], [10.0, 1.0, 0.0]);
    assert_eq!(mesh.nodes[2], [9.0, 1.0, 0.0]);
    for (name, face) in [("foot", [0, 0]), ("ring", [1, 1]), ("top", [1, 1]), ("bottom", [0, 0]), ("side", [0, 2])] {
        assert_eq!(facets(&mesh, name), [Facet { cell: face[0], face: face[1] as u8 }], "{name}");
    }
    // Two instances at one place share no node.
    let twice = text.replace(
        "*END INSTANCE\n",
        "*END INSTANCE\n*INSTANCE, NAME=Cubes-2, PART=Cubes\n10, 0, 0\n10, 0, 0, 10, 0, 1, 90\n*END INSTANCE\n",
    );
    let error = of(&twice).expect_err("not joined").to_string();
    for words in
        ["1 of the instance cubes-1", "1 of the instance cubes-2", "same place", "along a seam", "2 pieces", "tied"]
    {
        assert!(error.contains(words), "{words} not in: {error}");
    }
    let apart = twice.replacen("\n10, 0, 0\n10", "\n50, 0, 0\n10", 1);
    let error = of(&apart).expect_err("in pieces").to_string();
    assert!(error.contains("2 pieces") && error.contains("1 of the instance cubes-2"), "{error}");
}

#[test]
fn files_include_files_and_no_circles() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    std::fs::create_dir(folder.path().join("parts")).expect("a folder");
    write("all.inp", "*HEADING\n*INCLUDE, INPUT=parts/nodes.inc\n*NSET, NSET=Foot\n1,2,3,4\n");
    write("parts/nodes.inc", &format!("{NODES}*INCLUDE, INPUT=elements.inc\n"));
    write("parts/elements.inc", ELEMENTS);
    let (mesh, remarks) = read(&folder.path().join("all.inp"), MeshPieces::One).unwrap_or_else(|e| panic!("{e}"));
    assert!(mesh.cells.len() == 2 && mesh.groups.contains_key("foot"));
    assert!(remarks.iter().any(|r| r.contains("elements.inc, line 1: 1 elements C3D8R")), "{remarks:?}");
    write("parts/elements.inc", &format!("{ELEMENTS}*INCLUDE, INPUT=../all.inp\n"));
    let error = read(&folder.path().join("all.inp"), MeshPieces::One).expect_err("a circle").to_string();
    assert!(error.contains("elements.inc, line 6") && error.contains("circle"), "{error}");
    write("all.inp", "*HEADING\n*INCLUDE, INPUT=no-such.inc\n");
    let error = read(&folder.path().join("all.inp"), MeshPieces::One).expect_err("no such file").to_string();
    assert!(error.contains("all.inp, line 2") && error.contains("no-such.inc"), "{error}");
}

#[test]
fn wrong_files_are_refused_with_the_place() {
    let whole = format!("{NODES}{ELEMENTS}");
    let more = |text: &str| format!("{whole}{text}");
    let cases: [(String, &[&str]); 26] = [
        (String::new(), &["cube.inp, line 1", "keyword"]),
        ("$MeshFormat\n".into(), &["line 1", "expected a keyword"]),
        (NODES.into(), &["no solid elements", "C3D20R"]),
        (whole.replace("7, 1, 1, 1", "7, 1, one, 1"), &["line 8", "one", "coordinates"]),
        (whole.replace("7, 1, 1, 1", "7, 1, inf, 1"), &["line 8", "coordinates"]),
        (whole.replace("7, 1, 1, 1", "0, 1, 1, 1"), &["line 8", "number of a node"]),
        (whole.replace("7, 1, 1, 1", "6, 1, 1, 1"), &["line 8", "a second node 6"]),
        (whole.replace("5,6,7,8, 11", "5,6,7,99, 11"), &["line 18", "hexahedron 2", "node 99"]),
        (whole.replace("2, 5,6,7,8", "1, 5,6,7,8"), &["line 18", "a second element 1"]),
        (whole.replace("13,14\n", "13,14, 15\n"), &["line 18", "8 nodes"]),
        (whole.replace(",13,14\n", "\n"), &["line 18", "6 of its 8 nodes"]),
        (whole.replace("c3d8i", "AC3D8"), &["line 17", "AC3D8", "C3D10M"]),
        (whole.replace(", type=c3d8i", ""), &["line 17", "TYPE"]),
        (
            whole.replace("5,6,7,8, 11,12,13,14", "11,12,13,14, 5,6,7,8"),
            &["line 18", "hexahedron 2 is inverted", "1 of 2"],
        ),
        (more("*TIE, NAME=T\na, b\n"), &["line 19", "*\"TIE\"", "not understood"]),
        (more("*NGEN\n1, 9, 1\n"), &["line 19", "NGEN"]),
        (more("*NSET, NSET=A\n1, 99\n"), &["line 19", "node 99"]),
        (more("*NSET, NSET=A\nB\n"), &["line 19", "no node set \"b\""]),
        (more("*NSET, NSET=A\nB\n*NSET, NSET=B\nA\n"), &["node sets within node sets"]),
        (more("*NSET, NSET=A, GENERATE\n4, 1, 1\n"), &["line 20", "first, last"]),
        (more("*ELSET, ELSET=A, GENERATE\n1, 4000000000, 0\n"), &["line 20", "first, last"]),
        (more("*SURFACE, NAME=A\nUpper, S7\n"), &["line 20", "S1 to S6"]),
        (more("*SURFACE, NAME=A\nNo, S1\n"), &["line 20", "no element set \"no\""]),
        (more("*SURFACE, NAME=A, TYPE=CUTTING SURFACE\n1\n"), &["line 19", "cutting surface"]),
        (more("*PART, NAME=P\n*END PART\n*INSTANCE, NAME=I, PART=Q\n"), &["line 21", "\"q\""]),
        (more("*INCLUDE\n"), &["line 19", "INPUT"]),
    ];
    for (text, words) in cases {
        let error = of(&text).expect_err(words[0]);
        assert_eq!(error.exit_code(), 3, "{error}");
        for word in words {
            assert!(
                error.message().starts_with("cube.inp, line ") && error.message().contains(word),
                "{word} not in: {error}"
            );
        }
    }
    let tet = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n*SURFACE,NAME=A\n1,S5\n";
    let error = of(tet).expect_err("four faces").to_string();
    assert!(error.contains("line 9") && error.contains("S5") && error.contains("4-node tetrahedron"), "{error}");
}

/// Keywords and parameters are abbreviated as far as they are unique; those that are not understood are refused.
#[test]
fn keywords_and_parameters_may_be_abbreviated() {
    let full =
        format!("{NODES}{ELEMENTS}*NSET, NSET=Foot, GENERATE\n1, 4, 1\n*SURFACE, NAME=Up, TYPE=ELEMENT\nUpper, S2\n");
    let expected = of(&full).expect("in full").0;
    for (from, to) in [
        ("GENERATE", "GEN"),
        ("GENERATE", "g"),
        ("NSET=Foot", "NS=Foot"),
        ("*NSET, ", "*NSE, "),
        ("TYPE=ELEMENT", "TY=ELEMENT"),
        ("*ELEMENT, TYPE=C3D8R, ELSET=Lower", "*ELEMENT, TY=C3D8R, EL=Lower"),
        ("*NODE, NSET=All", "*NODE, N=All, SYS=R"),
        ("GENERATE", "GENERATE, INTER, UNSORT"),
    ] {
        let found = of(&full.replace(from, to)).unwrap_or_else(|e| panic!("{e}")).0;
        assert_eq!(found, expected, "{from} as {to}");
    }
    for (from, to, words) in [
        ("GENERATE", "GENRATE", "parameter \"GENRATE\" of *NSET is not understood"),
        ("GENERATE", "GENERATE, IN", "parameter IN of *NSET may be INSTANCE, INTERNAL"),
        ("*NODE, NSET=All", "*NODE, NSET=All, SYS=C", "SYSTEM=\"C\""),
        ("TYPE=ELEMENT", "TYPE=ELEMENT, COMBINE=UNION", "\"COMBINE\" of *SURFACE"),
        ("TYPE=ELEMENT", "TYPE=ELEMENT, TRIM=YES", "\"TRIM\" of *SURFACE"),
        ("*ELEMENT, ", "*ELEM, ", "*ELEM may be ELEMENT"),
        ("*NSET, NSET=Foot", "*NSET, NSET=Foot, NSET=Hand", "NSET of *NSET twice"),
    ] {
        let error = of(&full.replace(from, to)).expect_err(to).to_string();
        assert!(error.contains(words), "{words} not in {error}");
    }
    // Nothing of a step is looked at.
    of(&format!("{full}*STEP, UNKNOWN=1\n*SURFACE, COMBINE=UNION, NAME=X\n*EL, X\n*END STEP\n")).expect("a step");
}

/// A set of a part and one of the assembly of the same name are two; the bare name is of neither.
#[test]
fn parts_and_the_assembly_have_names_of_their_own() {
    let deck = |part: &str, assembly: &str| {
        format!(
            "*PART, NAME=Cubes\n{NODES}{ELEMENTS}{part}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=C-1, PART=Cubes\n\
             *END INSTANCE\n{assembly}*END ASSEMBLY\n"
        )
    };
    let foot = "*NSET, NSET=Set-1\n1, 2, 3, 4\n";
    let (mut mesh, _) =
        of(&deck(foot, "*NSET, NSET=Set-1, INSTANCE=C-1\n11, 12, 13, 14\n")).unwrap_or_else(|e| panic!("{e}"));
    let f = |cell, face| vec![Facet { cell, face }];
    assert_eq!((facets(&mesh, "c-1.set-1"), facets(&mesh, "assembly.set-1")), (f(0, 0), f(1, 1)));
    let error = mesh.require_group("set-1", "the mesh").expect_err("two").to_string();
    assert!(error.contains("\"assembly.set-1\", \"c-1.set-1\""), "{error}");
    let name = "cubes.set-1".to_owned();
    mesh.add_aliases(std::iter::once(&name));
    assert_eq!(facets(&mesh, &name), f(0, 0));
    // One of them alone has its bare name, and the full ones if the job calls it so.
    let (mut mesh, _) = of(&deck(foot, "*NSET, NSET=Other, INSTANCE=C-1\n11, 12, 13, 14\n")).expect("one");
    let names = ["C-1.Set-1", "cubes.set-1", "assembly.other", "c-1.other"].map(str::to_owned);
    mesh.add_aliases(names.iter());
    assert_eq!(facets(&mesh, "set-1"), f(0, 0));
    assert_eq!(names.map(|n| facets(&mesh, &n)), [f(0, 0), f(0, 0), f(1, 1), vec![]]);
    // The same faces under one name are one group; so is a surface beside a set of other things.
    let (mesh, _) = of(&deck(foot, "*NSET, NSET=Set-1, INSTANCE=C-1\n1, 2, 3, 4\n")).expect("the same");
    assert_eq!(facets(&mesh, "set-1"), f(0, 0));
    let (mesh, _) =
        of(&deck("*ELSET, ELSET=Set-1\n1, 2\n", "*NSET, NSET=Set-1, INSTANCE=C-1\n1, 2, 3, 4\n")).expect("one");
    assert_eq!(facets(&mesh, "set-1"), f(0, 0));
}

/// A mesh within an instance is moved and turned with it, and has numbers of its own.
#[test]
fn an_instance_may_have_the_mesh() {
    let text = format!(
        "*PART, NAME=Cubes\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=C-1, PART=Cubes\n10, 0, 0\n\
         10, 0, 0, 10, 0, 1, 90\n\
         {NODES}{ELEMENTS}*NSET, NSET=Foot\n1, 2, 3, 4\n*END INSTANCE\n*NODE\n1, 0, 0, 0\n\
         *NSET, NSET=Ring, INSTANCE=C-1\n\
         11, 12, 13, 14\n*ELSET, ELSET=_u, INTERNAL, INSTANCE=C-1, GENERATE\n2, 2, 1\n\
         *SURFACE, NAME=Top\n_u, S2\n*END ASSEMBLY\n"
    );
    let (mesh, _) = of(&text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((mesh.nodes[1], mesh.nodes[2]), ([10.0, 1.0, 0.0], [9.0, 1.0, 0.0]));
    for (name, cell, face) in [("foot", 0, 0), ("ring", 1, 1), ("top", 1, 1)] {
        assert_eq!(facets(&mesh, name), [Facet { cell, face }], "{name}");
    }
    let twice = text.replace(
        "*END INSTANCE\n",
        &format!("*END INSTANCE\n*INSTANCE, NAME=C-2, PART=Cubes\n50\n{NODES}{ELEMENTS}*END INSTANCE\n"),
    );
    let error = of(&twice).expect_err("in pieces").to_string();
    assert!(error.contains("2 pieces") && error.contains("1 of the instance c-2"), "{error}");
    for (from, to, words) in [
        ("*END INSTANCE\n", "", "expected it in the assembly"),
        ("*END PART\n", "", "within a part; expected *END PART"),
        ("*NSET, NSET=Foot", "*NSET, NSET=Foot, INSTANCE=C-1", "expected it in the assembly"),
    ] {
        let error = of(&text.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(error.contains(words), "{words} not in {error}");
    }
    let cut = text.split("*END INSTANCE").next().expect("a text");
    assert!(of(cut).expect_err("cut off").to_string().contains("the file ends within an instance"));
}

/// Variants of solid elements are their base; shells, beams, masses and springs are left out, unless something gives
/// them a section or a value.
#[test]
fn elements_of_other_programs() {
    let whole = format!("{NODES}{ELEMENTS}");
    let expected = of(&whole).expect("plain").0.cells;
    for kind in ["C3D8RH", "C3D8H", "C3D8IH", "C3D8T", "C3D8P", "C3D8RT", "C3D8S"] {
        let (mesh, remarks) = of(&whole.replace("c3d8i", kind)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(mesh.cells, expected, "{kind}");
        assert!(remarks.iter().any(|r| r.contains(kind)), "{remarks:?}");
    }
    let beside = [
        ("MASS", "100, 1"),
        ("SPRINGA", "100, 1, 2"),
        ("B31", "100, 1, 2"),
        ("B32R", "100, 1, 2, 3"),
        ("T3D2", "100, 1, 2"),
        ("S4R", "100, 1, 2, 3, 4"),
        ("M3D4", "100, 1, 2, 3, 4"),
    ];
    for (kind, row) in beside {
        let (mesh, remarks) =
            of(&format!("{whole}*ELEMENT, TYPE={kind}, ELSET=E\n{row}\n")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(mesh.cells, expected, "{kind}");
        assert!(remarks.iter().any(|r| r.contains(kind) && r.contains("left out")), "{remarks:?}");
    }
    for kind in ["S4R", "CAX4P", "CPS4R", "M3D4", "R3D4"] {
        let text = format!("{whole}*ELEMENT, TYPE={kind}, ELSET=E\n100, 1, 2, 3, 4\n");
        assert_eq!(facets(&of(&text).unwrap_or_else(|e| panic!("{e}")).0, "e"), [Facet { cell: 0, face: 0 }], "{kind}");
    }
    // A shell beside the solid is left out of the group of its set as well.
    let rows = "100, 1, 2, 3, 4\n101, 5, 6, 2, 1\n102, 1, 2, 20, 21\n103, 1, 2, 7, 8";
    let text = format!(
        "{}*ELEMENT, TYPE=S4, ELSET=E\n{rows}\n",
        whole.replacen("14, 0, 1, 2\n", "14, 0, 1, 2\n20, 1, 0, -1\n21, 0, 0, -1\n", 1)
    );
    let mesh = of(&text).unwrap_or_else(|e| panic!("{e}")).0;
    assert_eq!(facets(&mesh, "e"), [Facet { cell: 0, face: 0 }, Facet { cell: 0, face: 2 }]);
    assert_eq!(mesh.nodes.len(), 12);
    for (keyword, advice) in [("MASS", "supports"), ("SPRING", "supports"), ("SHELL SECTION", "solid elements")] {
        let error = of(&format!("{whole}*{keyword}, ELSET=E\n0.1\n")).expect_err(keyword).to_string();
        assert!(error.contains("not understood") && error.contains(advice), "{error}");
    }
    let sets = "*NSET, NSET=\"Foot, left\"\n1, 2, 3, 4\n*NSET, NSET=All2\n\"Foot, left\"\n";
    let quoted = format!("\u{feff}{whole}{sets}*SURFACE, TYPE=NODE, NAME=S\n\"foot, Left\", 1.0\n");
    let mesh = of(&quoted).unwrap_or_else(|e| panic!("{e}")).0;
    for name in ["foot, left", "all2", "s"] {
        assert_eq!(facets(&mesh, name), [Facet { cell: 0, face: 0 }], "{name}");
    }
    let error = of(&whole.replace("11, 0, 0, 2", "4294967297, 0, 0, 2")).expect_err("a large number").to_string();
    assert!(error.contains("4294967297") && error.contains("number of a node"), "{error}");
}

/// Sets that double with every level end with an error, and soon; so do ranges beyond all numbers.
#[test]
fn nothing_is_read_for_ever() {
    let mut text = format!("{NODES}{ELEMENTS}*NSET, NSET=s0\n1,2,3,4\n");
    for i in 1..40 {
        text += &format!("*NSET, NSET=s{i}\ns{}\n*NSET, NSET=s{i}\ns{}\n", i - 1, i - 1);
    }
    let error = of(&text).expect_err("2^39 sets").to_string();
    assert!(error.contains("do they hold each other"), "{error}");
    let (mesh, _) = of(&format!(
        "{NODES}{ELEMENTS}*NSET, NSET=Far, GENERATE\n1, 4294967295, 1\n*NSET, NSET=foot, GENERATE\n1,4,1\n"
    ))
    .expect("a range");
    assert!(mesh.groups.contains_key("foot") && !mesh.groups.contains_key("far"));
}
