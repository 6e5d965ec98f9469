//! Sweeps, and other forms of a key.

use super::*;

/// The job with stability and this sweep.
fn swept(sweep: Value) -> crate::Result<Job> {
    let sweep = format!("analyses.sweep={sweep}");
    read(TWO, &["analyses.stability={}", &sweep])
}

#[test]
fn sweeps_are_expanded_and_checked_before_anything_is_computed() {
    let plan = |keys: Value| swept(json!({ "keys": keys })).unwrap().sweep.unwrap();
    let p = plan(json!({
        "contact.friction": { "from": 0.1, "to": 0.3, "step": 0.1 },
        "contact.creepage.lateral": [0.01, -0.01]
    }));
    assert_eq!(p.keys, ["contact.friction", "contact.creepage.lateral"], "the order of the job");
    assert_eq!((&p.shape[..], &p.units[..]), (&[3, 2][..], &["1".to_string(), "1".to_string()][..]));
    assert_eq!(p.values[0], [0.1, 0.1, 0.2, 0.2, 0.3, 0.3].map(|v| json!(v)), "the last key runs fastest");
    let at = |i: usize| p.points[i].contact.clone().unwrap();
    assert_eq!((at(3).friction, at(3).creepage.lateral), (FrictionLaw::Constant(0.2), -0.01));
    assert_eq!(p.points[0].analyses.names(), ["modes", "stability"]);
    let p = plan(json!({ "contact.speed": { "from": 20, "to": 10, "count": 3 } }));
    assert_eq!((p.values[0].clone(), &p.units[0][..]), ([20.0, 15.0, 10.0].map(|v| json!(v)).to_vec(), "m/s"));
    // Defaults follow the swept keys as they follow keys of a job.
    let p = plan(json!({ "bodies.lower.mesh.cylinder.thickness": [0.1, 0.2] }));
    let size = |i: usize| match &p.points[i].bodies.lower.as_ref().unwrap().mesh {
        Some(MeshSource::Cylinder(c)) => c.max_element_size,
        _ => None,
    };
    assert_eq!((size(0), size(1)), (Some(0.025), Some(0.05)));
    let zip = json!({ "keys": { "contact.friction": [0.1, 0.2], "contact.speed": [5, 6] }, "combine": "zip" });
    let p = swept(zip).unwrap().sweep.unwrap();
    assert_eq!((p.shape, p.points.len(), p.values[1].clone()), (vec![2], 2, vec![json!(5), json!(6)]));
    for (keys, parts) in [
        (json!({}), vec!["analyses.sweep.keys: the sweep is empty"]),
        (json!({ "contact.friction": [] }), vec!["contact.friction: the list of values is empty"]),
        (
            json!({ "contact.fricton": [0.1] }),
            vec!["analyses.sweep.keys", "contact.fricton: unknown key; did you mean \"friction\"?"],
        ),
        (json!({ "title": ["a"] }), vec!["\"title\" cannot be swept"]),
        (json!({ "analyses.sweep.combine": ["zip"] }), vec!["cannot be swept"]),
        (
            json!({ "contact.friction": ["rough"] }),
            vec!["at contact.friction = \"rough\"", "found the string \"rough\", expected a number"],
        ),
        (json!({ "contact.friction": [0.2, -0.2] }), vec!["at contact.friction = -0.2", "expected a number ≥ 0"]),
        (
            json!({ "contact.friction": 0.3 }),
            vec!["keys.contact.friction: found the number 0.3, expected a list or an object"],
        ),
        (json!({ "contact.friction": { "from": 0.1 } }), vec!["contact.friction.to: missing"]),
        (json!({ "contact.friction": { "from": 0.1, "to": 0.2 } }), vec!["give exactly one of count and step"]),
        (
            json!({ "contact.friction": { "from": 0.1, "to": 0.2, "step": -0.1 } }),
            vec!["a step of -0.1 does not lead from 0.1 to 0.2"],
        ),
        (json!({ "contact.friction": { "from": 0.1, "to": 0.2, "step": 1e-9 } }), vec!["more than 100000"]),
        (
            json!({ "contact.friction": { "from": 0.1, "to": 0.2, "count": 0 } }),
            vec!["count: found 0, expected a whole number ≥ 1"],
        ),
        (json!({ "contact.approach": [1e-4] }), vec!["at contact.approach = 0.0001", "both normal_load and approach"]),
        (
            json!({ "contact.creepage": [{}], "analyses.stability.direction": ["rigid"] }),
            vec!["direction of sliding is undefined"],
        ),
    ] {
        let error = swept(json!({ "keys": keys })).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        says(&error.to_string(), &parts);
    }
    let alone = ["analyses.stability=null", "analyses.sweep={\"keys\":{\"contact.friction\":[0.1]}}"];
    says(&refused(&alone), &["analyses.stability: missing; analyses.sweep computes it"]);
    let uneven = json!({ "keys": { "contact.friction": [0.1, 0.2], "contact.speed": [5] }, "combine": "zip" });
    says(&swept(uneven).unwrap_err().to_string(), &["contact.friction has 2 values and contact.speed has 1"]);
}

#[test]
fn another_form_of_the_mesh_takes_the_place_of_the_first() {
    let mut job: Value = serde_json::from_slice(ANNULUS).unwrap();
    job["bodies"]["lower"]["mesh"] = json!({"file": "meshes/ring.msh"});
    let job = read(job.to_string().as_bytes(), &[]).unwrap();
    let file = &job.bodies.lower.as_ref().unwrap().mesh;
    let expected = std::env::current_dir().unwrap().join("folder/meshes/ring.msh");
    assert_eq!(
        *file,
        Some(MeshSource::File(MeshFile::Path(expected))),
        "relative to the job file, and absolute from then on"
    );
    let mut job: Value = serde_json::from_slice(ANNULUS).unwrap();
    job["bodies"]["lower"]["mesh"] = json!({"file": {"path": "meshes/ring.msh", "scale": 1e-3}});
    let long = read(job.to_string().as_bytes(), &[]).unwrap();
    let Some(MeshSource::File(file)) = &long.bodies.lower.as_ref().unwrap().mesh else { panic!("no file") };
    let expected = std::env::current_dir().unwrap().join("folder/meshes/ring.msh");
    assert_eq!((file.path(), file.scale(), file.linear_tetrahedra()), (&expected, 1e-3, false));
    job["bodies"]["lower"]["mesh"] = json!({"file": {"path": "ring.msh", "scale": 0, "unit": "mm"}});
    let wrong = read(job.to_string().as_bytes(), &[]).unwrap_err().to_string();
    says(&wrong, &["bodies.lower.mesh.file.scale: found 0", "bodies.lower.mesh.file.unit: unknown key"]);
    let both = read(ANNULUS, &["bodies.lower.mesh.file=x.msh"]).unwrap_err().to_string();
    says(&both, &["give exactly one of the keys \"cylinder\", \"file\", \"revolved\", \"extruded\"; found 2"]);
}

#[test]
fn only_keeps_one_analysis() {
    let path = Path::new("job.json");
    let job = Job::from_bytes(TWO, path, &[], Some("steady")).unwrap();
    assert_eq!(job.analyses.names(), ["steady"]);
    let error = Job::from_bytes(TWO, path, &[], Some("stedy")).unwrap_err();
    says(&error.to_string(), &["--only stedy", "did you mean \"steady\"?", "\"modes\", \"steady\""]);
    assert_eq!(error.exit_code(), 2);
}
