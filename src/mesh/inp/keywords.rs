//! Keyword lines, and keywords that say nothing about the mesh.

use super::lines::Lines;
use crate::Result;

/// A keyword with its parameters.
pub struct Keyword {
    /// Its name in capitals, without the star and without blanks: `ENDSTEP`.
    pub name: String,
    /// Parameters in capitals without blanks, with their values as they stand there.
    parameters: Vec<(String, String)>,
}

impl Keyword {
    /// The keyword at the last line; it goes on behind a comma at its end.
    pub fn read(lines: &mut Lines) -> Result<Self> {
        let mut text = lines.text().to_string();
        while text.ends_with(',') && text.len() < 1 << 16 {
            if !lines.data()? {
                break;
            }
            text.push_str(lines.text());
        }
        let mut fields = text.trim_start_matches('*').split(',');
        let capitals = |s: &str| s.split_whitespace().collect::<String>().to_uppercase();
        let name = capitals(fields.next().unwrap_or_default());
        let parameters = fields.filter(|f| !f.trim().is_empty()).map(|f| match f.split_once('=') {
            Some((key, value)) => (capitals(key), value.trim().trim_matches('"').to_string()),
            None => (capitals(f), String::new()),
        });
        Ok(Keyword { name, parameters: parameters.collect() })
    }

    /// The value of a parameter as it stands there.
    pub fn value(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|p| p.0 == key).map(|p| p.1.as_str())
    }

    /// A parameter that is a name, in lower case.
    pub fn title(&self, key: &str) -> Option<String> {
        self.value(key).map(str::to_lowercase)
    }

    /// Whether a parameter is there.
    pub fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }
}

/// Keywords outside of steps that say nothing about the mesh.
const HARMLESS: [&str; 50] = [
    "HEADING",
    "PREPRINT",
    "RESTART",
    "PHYSICALCONSTANTS",
    "ASSEMBLY",
    "ENDASSEMBLY",
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

/// Whether a keyword may be left out.
pub fn is_harmless(name: &str) -> bool {
    HARMLESS.contains(&name)
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
