use super::*;
use crate::friction::{Exponential, FrictionLaw};
use serde_json::{json, Value};

mod robustness;
mod sweeps;

const TWO: &[u8] = include_bytes!("../../jobs/two-cylinders.json");
const ANNULUS: &[u8] = include_bytes!("../../jobs/annulus.json");

fn read(bytes: &[u8], sets: &[&str]) -> Result<Job> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    Job::from_bytes(bytes, Path::new("folder/job.json"), &sets, None)
}

/// The message of the error that overriding the two-cylinder job gives; all job errors have exit code 2.
#[track_caller]
fn refused(sets: &[&str]) -> String {
    let error = read(TWO, sets).expect_err("must be refused");
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

#[track_caller]
fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
}

#[test]
fn the_two_jobs_resolve_with_defaults() {
    let job = read(TWO, &[]).unwrap();
    let contact = job.contact.as_ref().unwrap();
    assert_eq!(contact.load(), Load::Normal(70e3));
    assert_eq!(contact.friction, FrictionLaw::Constant(0.3));
    assert_eq!(job.analyses.names(), ["modes", "steady", "stability"]);
    assert_eq!(job.analyses.steady.as_ref().unwrap().max_iterations, 200);
    let json = job.to_json();
    assert_eq!(json["bodies"]["lower"]["mesh"]["cylinder"]["max_element_size"], json!(0.025));
    assert_eq!(json["solver"]["linear"], json!("mumps"));
    assert_eq!(json["output"]["fields"], json!(true));
    // What is written as resolved is a job again, and the same one.
    let again = read(&serde_json::to_vec(&json).unwrap(), &[]).unwrap();
    assert_eq!(again, job);

    let one = read(ANNULUS, &[]).unwrap();
    assert!(one.contact.is_none());
    assert_eq!(one.bodies().len(), 1);
    assert_eq!(one.analyses.modes.as_ref().unwrap().extent(), ModesExtent::Count(30));
}

/// Default rotation of a body: it rolls where there is an axle, a support, contact and modes, else it is at rest.
#[test]
fn rotation_is_that_of_rolling_unless_the_job_says_otherwise() {
    let lower = |sets: &[&str]| {
        let job = read(TWO, &[&["bodies.lower.rotation=null"], sets].concat()).unwrap();
        (job.to_json()["bodies"]["lower"]["rotation"].clone(), job.angular_velocity("lower"))
    };
    assert_eq!(lower(&[]), (json!("rolling"), 20.0));
    assert_eq!(lower(&["contact.speed=5"]), (json!("rolling"), 10.0));
    // Nothing is computed of its inertia.
    assert_eq!(lower(&["analyses.modes=null", "analyses.stability=null"]), (json!("none"), 0.0));
    // Free in space.
    assert_eq!(
        lower(&["bodies.lower.fixed=[]", "analyses.steady=null", "analyses.stability=null"]),
        (json!("none"), 0.0)
    );
    // A mesh file has no axle unless it is given.
    let file = "bodies.lower.mesh={\"file\": \"ring.msh\"}";
    assert_eq!(lower(&[file]), (json!("none"), 0.0));
    assert_eq!(lower(&[file, "bodies.lower.axle_distance=0.4"]), (json!("rolling"), 25.0));
    // What is said holds, and without contact nothing rolls.
    assert_eq!(read(TWO, &[]).unwrap().angular_velocity("lower"), 0.0);
    assert_eq!(read(TWO, &["bodies.lower.rotation=-3"]).unwrap().angular_velocity("lower"), -3.0);
    assert_eq!(read(ANNULUS, &[]).unwrap().to_json()["bodies"]["lower"]["rotation"], json!("none"));
    // The points of a sweep roll as the job does.
    let sweep = "analyses.sweep={\"keys\": {\"contact.speed\": [5, 20]}}";
    let job = read(TWO, &["bodies.lower.rotation=null", sweep]).unwrap();
    let points = &job.sweep.as_ref().unwrap().points;
    assert_eq!(points.iter().map(|p| p.angular_velocity("lower")).collect::<Vec<_>>(), [10.0, 40.0]);
    // A job of an earlier format is told, of the bodies that it concerns.
    let older = ["version=2", "bodies.lower.rotation=null"];
    let told = "bodies.lower.rotation is not given: \"rolling\" since format 3, \"none\" before";
    assert_eq!(read(TWO, &older).unwrap().changed_defaults, [told]);
    assert_eq!(read(TWO, &["version=2"]).unwrap().changed_defaults, [""; 0]);
    assert_eq!(read(ANNULUS, &["version=2"]).unwrap().changed_defaults, [""; 0]);
}

#[test]
fn the_kept_schema_is_the_generated_one() {
    let kept: Value = serde_json::from_str(include_str!("../../schemas/job.schema.json")).unwrap();
    assert_eq!(kept, schema(), "write it anew: railsqueal schema > schemas/job.schema.json");
}

#[test]
fn every_number_in_the_schema_has_a_unit_or_is_a_count_and_every_key_a_description() {
    fn visit(node: &Value, path: &str) {
        if let Some(map) = node.get("properties").and_then(Value::as_object) {
            for (key, child) in map {
                let described = child.get("description").and_then(Value::as_str).is_some_and(|d| d.len() > 10);
                assert!(described, "{path}/{key} has no description: {child}");
                let number = child["type"] == json!("number") || child["type"] == json!(["number", "null"]);
                assert!(!number || child.get("unit").is_some(), "{path}/{key} has no unit: {child}");
            }
        }
        match node {
            Value::Object(map) => map.iter().for_each(|(k, v)| visit(v, &format!("{path}/{k}"))),
            Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| visit(v, &format!("{path}/{i}"))),
            _ => {}
        }
    }
    visit(&schema(), "");
}

#[test]
fn the_documentation_names_every_key() {
    fn keys(node: &Value, out: &mut Vec<String>) {
        match node {
            Value::Object(map) => {
                if let Some(properties) = map.get("properties").and_then(Value::as_object) {
                    out.extend(properties.keys().cloned());
                }
                map.values().for_each(|v| keys(v, out));
            }
            Value::Array(list) => list.iter().for_each(|v| keys(v, out)),
            _ => {}
        }
    }
    let mut all = Vec::new();
    keys(&schema(), &mut all);
    assert!(all.len() > 40, "{all:?}");
    let text = include_str!("../../docs/reference/job.md");
    let named = |key: &str| text.contains(&format!("`{key}`")) || text.contains(&format!(".{key}`"));
    let missing: Vec<&String> = all.iter().filter(|k| !named(k)).collect();
    // Groups of keys are named by the keys in them.
    let groups = [
        "material",
        "damping",
        "creepage",
        "patch",
        "modes",
        "steady",
        "sweep",
        "receptance",
        "transient",
        "start",
        "random",
        "histories",
        "sound_power",
    ];
    let missing: Vec<_> = missing.into_iter().filter(|k| !groups.contains(&k.as_str())).collect();
    assert!(missing.is_empty(), "docs/reference/job.md does not name {missing:?}");
}

#[test]
fn the_job_in_the_readme_is_valid() {
    let text = include_str!("../../README.md");
    let job = text.split("```json").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert_eq!(read(job.as_bytes(), &[]).unwrap().analyses.names(), ["steady"]);
}

#[test]
fn syntax_errors_point_at_the_place() {
    let of = |text: &str| read(text.as_bytes(), &[]).unwrap_err().to_string();
    says(
        &of("{\n  \"version\" 1\n}"),
        &["folder/job.json: line 2, column 13", "\n  |   \"version\" 1\n  |             ^"],
    );
    says(&of("{\"version\": NaN}"), &["line 1, column 13", "NaN and Infinity are not JSON"]);
    says(&of("{\"version\": -Infinity}"), &["NaN and Infinity are not JSON"]);
    says(&of("{\"version\": 1,}"), &["trailing comma"]);
    says(&of("{\"version\": 1e999}"), &["out of range", "double precision"]);
    says(&of("{\"version\": 1, \"version\": 1}"), &["\"version\" is given twice", "line 1"]);
    says(&of("// a remark\n{}"), &["line 1", "no comments"]);
    for text in ["{\"version\": 1, // a remark\n}", "{\"version\": 1 # a remark\n}", "{\"version\": /* a remark */ 1}"]
    {
        says(&of(text), &["line 1", "no comments"]);
    }
    // Text is no comment.
    let address = of("{\"title\": \"https://a\", \"version\" 1}");
    assert!(!address.contains("comments"), "{address}");
    for text in ["{\"version\": 1,, \"title\": \"a\"}", "{\"version\": [1, , 2]}"] {
        says(&of(text), &["line 1", "two commas with nothing between them"]);
    }
    says(&of("{} {}"), &["trailing characters"]);
    says(&of(" \n\t "), &["empty"]);
    says(&of(""), &["empty"]);
    says(&of("\u{feff}{}"), &["byte order mark"]);
    for cut in [1, 20, TWO.len() / 2, TWO.len() - 3] {
        says(&read(&TWO[..cut], &[]).unwrap_err().to_string(), &["truncated"]);
    }
    let wrong = [b"{\"title\": \"".as_slice(), &[0xff, 0xfe], b"\"}"].concat();
    says(&read(&wrong, &[]).unwrap_err().to_string(), &["byte 0xff at offset 11 is not UTF-8"]);
}

#[test]
fn deep_nesting_is_an_error_and_no_overflow() {
    for (open, close) in [("[", "]"), ("{\"a\":", "}")] {
        let text = open.repeat(200_000) + &close.repeat(200_000);
        let error = read(text.as_bytes(), &[]).unwrap_err();
        says(&error.to_string(), &["nested too deeply"]);
        assert!(error.to_string().len() < 1000);
    }
}

#[test]
fn unknown_keys_suggest_the_near_one() {
    let message = refused(&["contact.fricton=0.3"]);
    says(
        &message,
        &["--set contact.fricton=0.3", "contact.fricton: unknown key; did you mean \"friction\"?", "\"speed\""],
    );
    let mut job: Value = serde_json::from_slice(TWO).unwrap();
    job["bodies"]["lower"]["material"]["yuong"] = json!(1);
    job["contact"]["zzz"] = json!(1);
    let message = read(job.to_string().as_bytes(), &[]).unwrap_err().to_string();
    says(&message, &["2 faults", "bodies.lower.material.yuong: unknown key; did you mean \"young\"?"]);
    says(&message, &["contact.zzz: unknown key. Allowed here: \"friction\""]);
    // Of a key that stands elsewhere its places are named.
    job["contact"] = json!({ "max_frequency": 1 });
    let message = read(job.to_string().as_bytes(), &[]).unwrap_err().to_string();
    let places = "\"max_frequency\" is a key at analyses.modes.max_frequency, analyses.stability.max_frequency";
    says(&message, &["contact.max_frequency: unknown key", places]);
    says(&refused(&["bodies.lower.mesh.cilinder.thickness=1"]), &["did you mean \"cylinder\""]);
    says(&refused(&["nonsense=1"]), &["unknown key \"nonsense\"", "\"version\", \"title\""]);
    says(&refused(&["contact.speed.x=1"]), &["\"contact.speed\" has no keys inside"]);
    says(&refused(&["contact.speed"]), &["expected PATH=VALUE"]);
    says(&refused(&["contact..speed=1"]), &["empty part"]);
}

#[test]
fn wrong_types_and_values_name_path_found_and_expected() {
    let lower = "bodies.lower.material";
    for (set, parts) in [
        (
            format!("{lower}.young=stiff"),
            vec!["bodies.lower.material.young: found the string \"stiff\"", "a number > 0 (Pa)"],
        ),
        (format!("{lower}.young=NaN"), vec!["\"NaN\" (numbers must be finite)", "expected a number"]),
        (format!("{lower}.young=0"), vec!["young: found 0, expected a number > 0 (Pa)"]),
        (format!("{lower}.density=-7800"), vec!["density: found -7800, expected a number > 0 (kg/m³)"]),
        (format!("{lower}.poisson=0.5"), vec!["poisson: found 0.5, expected a number > -1 and < 0.5"]),
        (format!("{lower}.poisson=-1"), vec!["poisson: found -1, expected"]),
        (format!("{lower}.young=null"), vec!["young: missing; expected a number > 0 (Pa)"]),
        ("bodies.lower.damping.beta=-1".into(), vec!["damping.beta: found -1, expected a number ≥ 0 (s)"]),
        ("bodies.lower.fixed=inner".into(), vec!["fixed: found the string \"inner\", expected a list"]),
        ("bodies.lower.fixed=[1]".into(), vec!["fixed.0: found the number 1, expected a string"]),
        ("bodies.lower.fixed=[\"iner\"]".into(), vec!["no group \"iner\"; did you mean \"inner\"?", "\"side_plus\""]),
        ("bodies.lower.fixed=[\"inner\",\"inner\"]".into(), vec!["fixed.1", "twice"]),
        ("bodies.lower.fixed=[\"contact\"]".into(), vec!["cannot be clamped"]),
        ("bodies.lower.fixed=[]".into(), vec!["bodies.lower.fixed: no fixed support", "static problem"]),
        ("bodies.lower.supports=[{\"group\":\"iner\",\"mass\":1}]".into(), vec!["supports.0.group: the cylinder \
         has no group \"iner\"; did you mean \"inner\"?"]),
        ("bodies.lower.supports=[{\"group\":\"inner\"}]".into(), vec!["supports.0: nothing is given for the \
         group \"inner\"", "absorbing"]),
        ("bodies.lower.supports=[{\"group\":\"contact\",\"mass\":1}]".into(), vec!["supports.0.group: the \
         contact surface cannot be supported"]),
        ("bodies.lower.supports=[{\"group\":\"inner\",\"mass\":-1}]".into(), vec!["supports.0.mass: found -1, \
         expected a number ≥ 0 (kg)"]),
        (
            "bodies.lower.supports=[{\"group\":\"inner\",\"stiffness\":{\"x\":1},\"loss_factor\":0.1}]".into(),
            vec!["supports.0.loss_frequency: missing"],
        ),
        ("bodies.lower.mesh={}".into(), vec!["mesh: give exactly one of the keys \"cylinder\", \"file\", \
         \"revolved\", \"extruded\"; found 0"]),
        ("bodies.lower.mesh=5".into(), vec!["mesh: found the number 5, expected an object with one of the keys"]),
        ("contact.speed=0".into(), vec!["contact.speed: found 0, expected a number > 0 (m/s)"]),
        ("contact.friction=-0.1".into(), vec!["contact.friction: found -0.1, expected a number ≥ 0"]),
        ("contact.friction=[]".into(), vec!["contact.friction: found a list of 0, expected a number ≥ 0"]),
        (
            "contact.friction=rough".into(),
            vec!["friction: found the string \"rough\", expected a number ≥ 0 or an object with the key \
             \"exponential\""],
        ),
        ("contact.friction={}".into(), vec!["contact.friction: give exactly one of the keys \"exponential\", \
         \"rational\""]),
        ("contact.friction={\"exponentail\":{}}".into(), vec!["exponentail: unknown key; did you mean \
         \"exponential\"?"]),
        (
            "contact.friction.exponential={\"static\":0.4,\"kinetic\":0.3}".into(),
            vec!["contact.friction.exponential.decay_velocity: missing; expected a number > 0 (m/s)"],
        ),
        (
            "contact.friction.exponential={\"static\":0.2,\"kinetic\":0.3,\"decay_velocity\":1}".into(),
            vec!["exponential.kinetic: found 0.3, expected at most static (0.2)"],
        ),
        (
            "bodies.lower.damping.modal={\"by_mode\":[0.01]}".into(),
            vec!["bodies.lower.damping: both modal and Rayleigh damping"],
        ),
        (
            "bodies.lower.damping={\"modal\":{}}".into(),
            vec!["damping.modal: give exactly one of the keys \"by_mode\", \"by_frequency\", \"by_diameter\"; found 0"],
        ),
        ("bodies.lower.damping={\"modal\":{\"by_mode\":[]}}".into(), vec!["modal.by_mode: the list is empty"]),
        (
            "bodies.lower.damping={\"modal\":{\"by_mode\":[0.01,-1]}}".into(),
            vec!["damping.modal.by_mode.1: found -1, expected a number ≥ 0"],
        ),
        (
            "bodies.lower.damping={\"modal\":{\"by_frequency\":[{\"loss_factor\":0.1},{\"loss_factor\":0.2}]}}".into(),
            vec!["by_frequency.0.up_to: missing; only the last band may do without (Hz)"],
        ),
        (
            "bodies.lower.damping={\"modal\":{\"by_frequency\":[{\"up_to\":900,\"loss_factor\":0.1},{\"up_to\":900,\"loss_factor\":0.2}]}}".into(),
            vec!["by_frequency.1.up_to: found 900 Hz, expected more than 900 Hz"],
        ),
        ("bodies.lower.damping={\"modal\":{\"by_frequency\":[{}]}}".into(), vec!["loss_factor: missing; \
         expected a number ≥ 0"]),
        ("contact.normal_load=0".into(), vec!["contact.normal_load: found 0"]),
        ("contact.approach=1e-4".into(), vec!["both normal_load and approach"]),
        ("contact.normal_load=null".into(), vec!["give exactly one of normal_load (N) and approach (m)"]),
        (
            "contact.compliance=halfspace".into(),
            vec!["expected one of \"fe\", \"half_space\", \"hybrid\"; did you mean \"half_space\"?"],
        ),
        ("contact.patch.half_width=0.06".into(), vec!["half_width: found 0.06 m, expected at most 0.05"]),
        ("contact.patch.half_width=0.001".into(), vec!["at least two elements of bodies.lower", "at least two \
         elements of bodies.upper"]),
        ("contact.patch=null".into(), vec!["contact.patch: missing; a built-in cylinder needs it"]),
        ("contact=null".into(), vec!["contact: missing; analyses.steady needs it"]),
        ("bodies.upper=null".into(), vec!["bodies.upper: missing; contact needs both"]),
        ("analyses={}".into(), vec!["analyses: nothing to compute"]),
        ("analyses.modes={}".into(), vec!["exactly one of count and max_frequency"]),
        ("analyses.modes.max_frequency=100".into(), vec!["both count and max_frequency"]),
        ("analyses.modes.count=1.5".into(), vec!["count: found the number 1.5, expected a whole number"]),
        ("analyses.modes.count=0".into(), vec!["count: found 0, expected a whole number ≥ 1"]),
        ("analyses.receptance={\"frequency\":[]}".into(), vec!["analyses.receptance.frequency: the list is empty"]),
        ("analyses.receptance={\"frequency\":[-1]}".into(), vec!["receptance.frequency.0: found -1, expected a \
         number ≥ 0"]),
        ("analyses.receptance={}".into(), vec!["receptance.frequency: missing; expected a list or an object"]),
        ("version=0".into(), vec!["version: found 0, expected a whole number ≥ 1"]),
        (format!("version={}", FORMAT + 1), vec!["the job is written for a later railsqueal"]),
        ("solver.linear=gamg".into(), vec!["solver.linear: found \"gamg\"", "analyses.modes", "\"mumps\""]),
        ("solver.linear=lu".into(), vec!["solver.linear", "\"mumps\", \"gamg\""]),
        ("petsc_options.ksp_type={}".into(), vec!["petsc_options.ksp_type: found an object"]),
        ("output.fields=1".into(), vec!["output.fields: found the number 1, expected true or false"]),
    ] {
        says(&refused(&[&set]), &parts);
    }
    for (supports, parts) in [
        ("\"mass\":1", vec!["supports.0: found a mass, but bodies.lower.rotation turns the body"]),
        (
            "\"stiffness\":{\"x\":1e6,\"z\":2e6}",
            vec!["stiffnesses along x and z that differ by 0.500 of the larger one", "of revolution"],
        ),
    ] {
        let set = format!("bodies.lower.supports=[{{\"group\":\"inner\",{supports}}}]");
        says(&refused(&["bodies.lower.rotation=rolling", &set]), &parts);
    }
    let cylinder = "bodies.lower.mesh.cylinder";
    for (set, parts) in [
        ("inner_radius=0.6", vec!["inner_radius: found 0.6 m, expected less than outer_radius (0.5 m)"]),
        ("inner_radius=-1", vec!["inner_radius: found -1, expected a number > 0 (m)"]),
        ("thickness=0", vec!["thickness: found 0"]),
        ("contact_offset=0.05", vec!["contact_offset: found 0.05 m, expected less than half the thickness (0.05 m)"]),
        ("crown_radius=0.05", vec!["crown_radius: found 0.05 m, expected more than 0.05 m"]),
        ("element_size=0.2", vec!["element_size: found 0.2 m, expected at most 0.1 m"]),
        ("element_size=0.002", vec!["found 0.001 m, expected 0.002 m as in bodies.lower, or contact.grid"]),
        ("growth=0.9", vec!["growth: found 0.9, expected a number ≥ 1"]),
        ("max_element_size=0.0001", vec!["max_element_size", "at least element_size"]),
    ] {
        says(&refused(&[&format!("{cylinder}.{set}")]), &parts);
    }
}

#[test]
fn overrides_take_json_or_text_in_order_and_reach_new_keys() {
    let sets = [
        "contact.friction=0.4",
        "contact.friction=0.5",
        "title=no JSON here",
        "bodies.lower.fixed.0=side_plus",
        "petsc_options.eps_view=true",
        "analyses.modes=null",
        "analyses.stability=null",
        "contact.compliance=half_space",
        "solver.memory_limit=1e9",
    ];
    let job = read(TWO, &sets).unwrap();
    assert_eq!(job.contact.as_ref().unwrap().friction, FrictionLaw::Constant(0.5));
    assert_eq!(job.title.as_deref(), Some("no JSON here"));
    assert_eq!(job.bodies.lower.as_ref().unwrap().fixed, ["side_plus"]);
    assert_eq!(job.petsc_options["eps_view"], OptionValue::Switch(true));
    assert_eq!(job.analyses.names(), ["steady"]);
    assert_eq!(job.solver.memory_limit, Some(1e9));
    says(&refused(&["bodies.lower.fixed.3=inner"]), &["a list of 1", "\"3\" is not an index"]);
    // The name of a rail, not 540.
    assert_eq!(read(TWO, &["title=54E1"]).unwrap().title.as_deref(), Some("54E1"));
}

#[test]
fn friction_and_damping_have_several_forms() {
    let mut job: Value = serde_json::from_slice(TWO).unwrap();
    job["contact"].as_object_mut().unwrap().remove("friction");
    let message = read(job.to_string().as_bytes(), &[]).unwrap_err().to_string();
    says(&message, &["contact.friction: missing; expected a number ≥ 0 or an object with the key \"exponential\""]);
    let job = read(
        TWO,
        &[
            "contact.friction.exponential={\"static\":0.4,\"kinetic\":0.3,\"decay_velocity\":0.5}",
            "bodies.lower.damping={\"modal\":{\"by_mode\":[0.002,0.001]}}",
            "bodies.upper.damping={\"modal\":{\"by_frequency\":[{\"up_to\":900,\"loss_factor\":0.002},{\"loss_factor\":0.001}]}}",
        ],
    )
    .unwrap();
    let law = Exponential::new(0.4, 0.3, 0.5);
    let contact = job.contact.as_ref().unwrap();
    assert_eq!(contact.friction, law.into());
    // The resolved job can be read again.
    assert_eq!(read(job.to_json().to_string().as_bytes(), &[]).unwrap(), job);
}

/// A job of a disc with pads goes back to what it was: bodies by their names and contacts, nothing made of them.
#[test]
fn named_bodies_take_their_places_and_keep_their_names() {
    let text = include_bytes!("../../jobs/disc-and-pads.json");
    let job = Job::from_bytes(text, Path::new("jobs/disc-and-pads.json"), &[], Some("stability")).unwrap();
    let contact = job.contact.as_ref().unwrap();
    assert_eq!(contact.names(), ["outer pad", "inner pad"]);
    let slips: Vec<f64> = contact.points.iter().flatten().filter_map(|p| p.slip_velocity).collect();
    assert!(slips.iter().zip([4.4, 4.4, 5.9, 5.9]).all(|(a, b)| (a - b).abs() < 1e-12), "{slips:?}");
    assert_eq!((job.angular_velocity("lower"), job.angular_velocity("upper")), (50.0, 0.0));
    assert_eq!(job.bodies.with_names("bodies.upper.matrices".into()), "bodies.pads.matrices");
    let value = job.to_json();
    assert!(value.get("contact").is_none() && value["bodies"]["lower"].is_null(), "{value}");
    assert_eq!(value["bodies"]["disc"]["rotation"], 50.0);
    let again = Job::from_bytes(value.to_string().as_bytes(), Path::new("/job.json"), &[], None).unwrap();
    assert_eq!(again.to_json(), value);
    // Names of their own are for contacts.
    let wrong = read(TWO, &["bodies.lowr={\"mesh\": {}}"]).unwrap_err().to_string();
    says(&wrong, &["bodies.lowr"]);
}
