//! Keyword lines, and keywords that say nothing about the mesh.

use super::lines::DeckLines;
use crate::{Error, Result};

/// A keyword with its parameters.
pub struct Keyword {
    /// Its name in capitals, without the star and without blanks: `ENDSTEP`.
    pub name: String,
    /// Parameters in capitals without blanks, with their values as they stand there.
    parameters: Vec<(String, String)>,
    /// An abbreviation of several keywords or parameters, or a parameter that changes the mesh and is not understood.
    /// Within a step it does no harm.
    pub fault: Option<Error>,
}

impl Keyword {
    /// The keyword at the last line; it goes on behind a comma at its end. Its name and parameters may be abbreviated
    /// as far as nothing else begins so.
    pub fn read(lines: &mut DeckLines) -> Result<Self> {
        let at = lines.place();
        let mut text = lines.text().to_string();
        while text.ends_with(',') && text.len() < 1 << 16 {
            if !lines.data()? {
                break;
            }
            text.push_str(lines.text());
        }
        let mut fields = fields(text.trim_start_matches('*'));
        let capitals = |s: &str| s.split_whitespace().collect::<String>().to_uppercase();
        let written = capitals(fields.next().unwrap_or_default());
        let all = || READ.iter().map(|r| r.0).chain(HARMLESS).chain(OTHERS);
        let mut fault = None;
        let name = match whole_name(&written, all()) {
            Name::One(name) => name.to_owned(),
            Name::Several(names) => {
                let text = format!("the keyword *{written} may be {}; expected more of its letters", names.join(", "));
                fault = Some(lines.error(at, text));
                written
            }
            Name::None => written,
        };
        let known = READ.iter().find(|r| r.0 == name).map(|r| r.1);
        let mut parameters: Vec<(String, String)> = Vec::new();
        for field in fields.filter(|f| !f.trim().is_empty()) {
            let (key, value) = field.split_once('=').unwrap_or((field, ""));
            let (mut key, value) = (capitals(key), value.trim().trim_matches('"').to_string());
            if let Some(known) = known {
                key = match whole_name(&key, known.iter().map(|k| k.trim_start_matches('-'))) {
                    Name::One(one) if known.contains(&one) => one.to_owned(),
                    // Those with a dash are no part of what is said about the mesh.
                    Name::One(_) => continue,
                    Name::Several(names) => {
                        let names = names.join(", ");
                        let text =
                            format!("the parameter {key} of *{name} may be {names}; expected more of its letters");
                        fault.get_or_insert_with(|| lines.error(at, text));
                        continue;
                    }
                    Name::None => {
                        let expected: Vec<&str> = known.iter().map(|k| k.trim_start_matches('-')).collect();
                        let text = format!(
                            "the parameter {} of *{name} is not understood, and might change the mesh; expected {}",
                            super::parse::quote(&key),
                            expected.join(", ")
                        );
                        fault.get_or_insert_with(|| lines.error(at, text));
                        continue;
                    }
                };
                if parameters.iter().any(|p| p.0 == key) {
                    let text = format!("the parameter {key} of *{name} twice; expected it once");
                    fault.get_or_insert_with(|| lines.error(at, text));
                }
            }
            parameters.push((key, value));
        }
        Ok(Keyword { name, parameters, fault })
    }

    /// The value of a parameter as it stands there.
    pub fn value(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|p| p.0 == key).map(|p| p.1.as_str())
    }

    /// A parameter that is a name, in lower case.
    pub fn title(&self, key: &str) -> Option<String> {
        self.value(key).map(str::to_lowercase)
    }

    /// Returns whether a parameter is there.
    pub fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }
}

/// Fields of a line between commas, of which those in quotes are part of a field.
pub fn fields(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let here = rest?;
        let mut quoted = false;
        let end = here.char_indices().find(|&(_, c)| {
            quoted ^= c == '"';
            c == ',' && !quoted
        });
        rest = end.map(|(at, _)| &here[at + 1..]);
        Some(end.map_or(here, |(at, _)| &here[..at]))
    })
}

/// The one name that a word is, or that begins with it.
enum Name<'a> {
    One(&'a str),
    Several(Vec<&'a str>),
    None,
}

fn whole_name<'a>(word: &str, names: impl Iterator<Item = &'a str>) -> Name<'a> {
    let begin: Vec<&str> = names.filter(|n| !word.is_empty() && n.starts_with(word)).collect();
    match begin.as_slice() {
        [] => Name::None,
        [one] => Name::One(one),
        all => all.iter().find(|n| **n == word).map_or_else(|| Name::Several(all.to_vec()), |n| Name::One(n)),
    }
}

/// Keywords that are read, with their parameters in the manual (Abaqus Keywords Reference Guide). Those with a dash say
/// nothing about the mesh; others that there are change it, are not understood and so not in the list.
const READ: [(&str, &[&str]); 12] = [
    ("PART", &["NAME", "-INTERNAL"]),
    ("ENDPART", &[]),
    ("ASSEMBLY", &["NAME"]),
    ("ENDASSEMBLY", &[]),
    ("INSTANCE", &["NAME", "PART", "-INTERNAL"]),
    ("ENDINSTANCE", &[]),
    ("NODE", &["NSET", "SYSTEM", "INPUT"]),
    ("ELEMENT", &["TYPE", "ELSET", "INPUT"]),
    ("NSET", &["NSET", "ELSET", "GENERATE", "INSTANCE", "-INTERNAL", "-UNSORTED"]),
    ("ELSET", &["ELSET", "GENERATE", "INSTANCE", "-INTERNAL", "-UNSORTED"]),
    ("SURFACE", &["NAME", "TYPE", "-INTERNAL"]),
    ("INCLUDE", &["INPUT"]),
];

/// Keywords that change the body, or of which abbreviations are to be told from those above.
const OTHERS: [&str; 57] = [
    "ACOUSTICMEDIUM",
    "BEAMGENERALSECTION",
    "BEAMSECTION",
    "COHESIVESECTION",
    "CONNECTORSECTION",
    "CONSTRAINTCONTROLS",
    "CONTACTCONTROLS",
    "COUPLING",
    "DASHPOT",
    "DISTRIBUTINGCOUPLING",
    "ELCOPY",
    "ELEMENTMATRIXOUTPUT",
    "ELEMENTPROPERTIES",
    "ELEMENTRESPONSE",
    "ELGEN",
    "EMBEDDEDELEMENT",
    "ENDSTEP",
    "EQUATION",
    "FASTENER",
    "GAP",
    "HOURGLASSCONTROLS",
    "IMPORT",
    "INERTIARELIEF",
    "INITIALSTATE",
    "KINEMATICCOUPLING",
    "MASS",
    "MASSFLOWRATE",
    "MATRIX",
    "MATRIXASSEMBLE",
    "MATRIXINPUT",
    "MEMBRANESECTION",
    "MPC",
    "NCOPY",
    "NFILL",
    "NGEN",
    "NMAP",
    "NODALTHICKNESS",
    "NODERESPONSE",
    "NONSTRUCTURALMASS",
    "ORNL",
    "PARAMETER",
    "PARTICLE",
    "PERIODICMEDIA",
    "REBARLAYER",
    "RELEASE",
    "RIGIDBODY",
    "RIGIDSURFACE",
    "ROTARYINERTIA",
    "SHELLGENERALSECTION",
    "SHELLSECTION",
    "SHELLTOSOLIDCOUPLING",
    "SPRING",
    "STEP",
    "SUBMODEL",
    "SURFACEPROPERTY",
    "SYSTEM",
    "TIE",
];

/// Keywords outside of steps that say nothing about the mesh.
const HARMLESS: [&str; 48] = [
    "HEADING",
    "PREPRINT",
    "RESTART",
    "PHYSICALCONSTANTS",
    "MATERIAL",
    "ELASTIC",
    "DENSITY",
    "EXPANSION",
    "PLASTIC",
    "CYCLICHARDENING",
    "HYPERELASTIC",
    "CREEP",
    "DAMPING",
    "CONDUCTIVITY",
    "SPECIFICHEAT",
    "DEPVAR",
    "USERMATERIAL",
    "SOLIDSECTION",
    "SURFACESECTION",
    "SECTIONCONTROLS",
    "HOURGLASSSTIFFNESS",
    "ORIENTATION",
    "DISTRIBUTION",
    "DISTRIBUTIONTABLE",
    "TRANSFORM",
    "AMPLITUDE",
    "TIMEPOINTS",
    "FILTER",
    "INITIALCONDITIONS",
    "BOUNDARY",
    "CLOAD",
    "DLOAD",
    "DSLOAD",
    "TEMPERATURE",
    "CONTACTPAIR",
    "CONTACT",
    "CONTACTINCLUSIONS",
    "CONTACTPROPERTYASSIGNMENT",
    "SURFACEINTERACTION",
    "SURFACEBEHAVIOR",
    "FRICTION",
    "NODEPRINT",
    "NODEFILE",
    "NODEOUTPUT",
    "ELPRINT",
    "ELFILE",
    "ELEMENTOUTPUT",
    "OUTPUT",
];

/// Returns whether a keyword may be left out.
pub fn is_harmless(name: &str) -> bool {
    HARMLESS.contains(&name)
}

/// Advice on a keyword that changes the body.
pub fn advice(name: &str) -> &'static str {
    match name {
        "MASS" | "NONSTRUCTURALMASS" | "ROTARYINERTIA" => {
            "Take it and its elements out of the file, and give masses in the job, by \"supports\" with a mass"
        }
        "SPRING" | "DASHPOT" | "CONNECTORSECTION" | "GAP" => {
            "Take it and its elements out of the file, and give springs and dashpots in the job, by \"supports\""
        }
        "SHELLSECTION" | "SHELLGENERALSECTION" | "BEAMSECTION" | "BEAMGENERALSECTION" | "MEMBRANESECTION" => {
            "Mesh that part of the body with solid elements, or take it out of the file"
        }
        _ => "Take it out of the file",
    }
}

/// Why a keyword is left out.
pub fn why(name: &str) -> &'static str {
    match name {
        "STEP" => "what a body is loaded by comes from the job",
        "BOUNDARY" => "supports come from the job (\"fixed\")",
        "MATERIAL" | "ELASTIC" | "DENSITY" | "DAMPING" => "the material comes from the job",
        _ => "it says nothing about the mesh",
    }
}
