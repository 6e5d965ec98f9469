//! The JSON Schema of the job, and the check of a value against it: unknown keys, missing keys, types and bounds.

use super::model::Job;
use super::published::published;
use serde_json::{Map, Value};
use std::sync::OnceLock;

/// The JSON Schema (draft 2020-12) of the job, as `railsqueal schema` prints it.
///
/// ```
/// let schema = railsqueal::job::schema();
/// assert!(schema["properties"]["contact"].is_object());
/// ```
pub fn schema() -> Value {
    published(known().clone())
}

/// The schema that follows from the types, made once.
fn known() -> &'static Value {
    static KNOWN: OnceLock<Value> = OnceLock::new();
    KNOWN.get_or_init(|| schemars::schema_for!(Job).to_value())
}

/// Levels of a job in which a key is searched that is unknown where it stands, and places that are named.
const DEEPEST: usize = 7;
const PLACES: usize = 3;

/// Walks a value and the schema together and collects what is wrong, one message for each place.
pub struct Checker {
    root: &'static Value,
}

impl Default for Checker {
    fn default() -> Self {
        Self { root: known() }
    }
}

impl Checker {
    /// All faults of `value`, in the order of the file; empty if it fits the schema.
    pub fn check(&self, value: &Value) -> Vec<String> {
        let mut faults = Vec::new();
        self.walk(value, self.root, "", &mut faults);
        faults
    }

    /// The keys that the object at `path` (segments) may have, whatever of it the job gives; `None` if there is no such
    /// object. Arrays and free-form maps give an empty list.
    pub fn keys_at(&self, path: &[&str]) -> Option<Vec<String>> {
        let mut node = self.root;
        for segment in path {
            node = self.child(node, segment)?;
        }
        Some(self.keys(node))
    }

    /// Unit of the number at `path`, "-" where there is none.
    pub fn unit_at(&self, path: &[&str]) -> String {
        let mut node = self.root;
        for segment in path {
            let Some(child) = self.child(node, segment) else { return "-".into() };
            node = child;
        }
        let unit = |n: &Value| n.get("unit").and_then(Value::as_str).map(str::to_owned);
        let of_a_form = || self.alternatives(self.resolve(node))?.iter().find_map(|n| unit(n));
        unit(node).or_else(|| unit(self.resolve(node))).or_else(of_a_form).unwrap_or_else(|| "-".into())
    }

    fn resolve<'a>(&'a self, mut node: &'a Value) -> &'a Value {
        // References point into `$defs` and do not form cycles among themselves, so a few steps are enough.
        for _ in 0..16 {
            let Some(name) = node.get("$ref").and_then(Value::as_str) else { break };
            match self.root.pointer(name.trim_start_matches('#')) {
                Some(target) => node = target,
                None => break,
            }
        }
        node
    }

    fn alternatives<'a>(&'a self, node: &'a Value) -> Option<Vec<&'a Value>> {
        let list = node.get("anyOf").or_else(|| node.get("oneOf"))?.as_array()?;
        // Forms of a form are forms as well.
        let forms = list.iter().map(|n| self.resolve(n));
        Some(forms.flat_map(|n| self.alternatives(n).unwrap_or_else(|| vec![n])).collect())
    }

    fn child<'a>(&'a self, node: &'a Value, key: &str) -> Option<&'a Value> {
        let node = self.resolve(node);
        if let Some(found) = node.get("properties").and_then(|p| p.get(key)) {
            return Some(found);
        }
        if let Some(found) = node.get("items").filter(|_| key.parse::<usize>().is_ok()) {
            return Some(found);
        }
        if let Some(free) = node.get("additionalProperties").filter(|a| a.is_object()) {
            return Some(free);
        }
        self.alternatives(node)?.into_iter().find_map(|n| self.child(n, key))
    }

    fn keys(&self, node: &Value) -> Vec<String> {
        let node = self.resolve(node);
        let mut keys: Vec<String> =
            node.get("properties").and_then(Value::as_object).map(|p| p.keys().cloned().collect()).unwrap_or_default();
        for alternative in self.alternatives(node).unwrap_or_default() {
            keys.extend(self.keys(alternative));
        }
        keys
    }

    fn walk(&self, value: &Value, node: &Value, path: &str, faults: &mut Vec<String>) {
        // A schema without any demand: free values, checked where they are used.
        if node == &Value::Bool(true) {
            return;
        }
        let place = |path: &str| if path.is_empty() { "the job".to_string() } else { path.to_string() };
        if let Some(fixed) = node.get("const") {
            if value != fixed {
                faults.push(format!("{}: found {}, expected {fixed}", place(path), brief(value)));
            }
            return;
        }
        let bounds = node;
        let node = self.resolve(node);
        if let Some(list) = self.alternatives(node) {
            return self.walk_alternatives(value, &list, path, faults);
        }
        let types: Vec<&str> = match node.get("type") {
            Some(Value::String(t)) => vec![t],
            Some(Value::Array(ts)) => ts.iter().filter_map(Value::as_str).collect(),
            _ => Vec::new(),
        };
        if !types.is_empty() && !types.iter().any(|t| is_type(value, t)) {
            faults.push(format!("{}: found {}, expected {}", place(path), brief(value), expectation(node, bounds)));
            return;
        }
        match value {
            Value::Number(number) => {
                let x = number.as_f64().unwrap_or(f64::NAN);
                let limit = |key: &str| bounds.get(key).or_else(|| node.get(key)).and_then(Value::as_f64);
                let inside = limit("minimum").is_none_or(|m| x >= m)
                    && limit("maximum").is_none_or(|m| x <= m)
                    && limit("exclusiveMinimum").is_none_or(|m| x > m)
                    && limit("exclusiveMaximum").is_none_or(|m| x < m);
                if !inside {
                    faults.push(format!("{}: found {value}, expected {}", place(path), expectation(node, bounds)));
                }
            }
            Value::Array(items) => {
                if let Some(item) = node.get("items") {
                    for (i, v) in items.iter().enumerate() {
                        self.walk(v, item, &join(path, &i.to_string()), faults);
                    }
                }
            }
            Value::Object(map) => self.walk_object(map, node, path, faults),
            _ => {
                if let Some(allowed) = node.get("enum").and_then(Value::as_array) {
                    if !allowed.contains(value) {
                        faults.push(choice(&place(path), value, allowed.iter().filter_map(Value::as_str)));
                    }
                }
            }
        }
    }

    fn walk_object(&self, map: &Map<String, Value>, node: &Value, path: &str, faults: &mut Vec<String>) {
        let properties = node.get("properties").and_then(Value::as_object);
        // Beside known keys those of free names are objects.
        let free = node.get("additionalProperties").filter(|a| a.is_object());
        for (key, value) in map {
            let inner = join(path, key);
            if let Some(child) = properties.and_then(|p| p.get(key)) {
                self.walk(value, child, &inner, faults);
            } else if let Some(free) = free.filter(|_| properties.is_none() || value.is_object()) {
                self.walk(value, free, &inner, faults);
            } else {
                let allowed: Vec<String> = properties.map(|p| p.keys().cloned().collect()).unwrap_or_default();
                faults.push(self.unknown(&inner, key, &allowed));
            }
        }
        for key in node.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str) {
            if !map.contains_key(key) {
                let about = properties
                    .and_then(|p| p.get(key))
                    .map(|child| self.expectation(child))
                    .unwrap_or_else(|| "a value".into());
                faults.push(format!("{}: missing; expected {about}", join(path, key)));
            }
        }
    }

    /// Message for an unknown key: with the nearest allowed one, else with the places where the job has such a key.
    fn unknown(&self, path: &str, key: &str, allowed: &[String]) -> String {
        let text = unknown_key(path, key, allowed);
        match (nearest(key, allowed), self.elsewhere(key)) {
            (None, places) if !places.is_empty() => {
                format!("{text}. \"{key}\" is a key at {}", places.join(", "))
            }
            _ => text,
        }
    }

    /// Places of the job that have a key of this name, the shortest paths first.
    fn elsewhere(&self, key: &str) -> Vec<String> {
        let mut level = vec![(String::new(), self.root)];
        let mut found = Vec::new();
        for _ in 0..DEEPEST {
            let mut next = Vec::new();
            for (path, node) in level {
                for name in self.keys(node) {
                    let place = join(&path, &name);
                    if name == key {
                        found.push(place.clone());
                    }
                    next.extend(self.child(node, &name).map(|inner| (place, inner)));
                }
                let items = self.resolve(node).get("items").filter(|items| items.is_object());
                next.extend(items.map(|inner| (join(&path, "0"), inner)));
            }
            if found.len() >= PLACES {
                break;
            }
            level = next;
        }
        found.truncate(PLACES);
        found
    }

    /// One of several forms: `null`, a word from a list, an object whose one key selects the form, or different types.
    fn walk_alternatives(&self, value: &Value, list: &[&Value], path: &str, faults: &mut Vec<String>) {
        let place = if path.is_empty() { "the job" } else { path };
        if value.is_null() && list.iter().any(|n| n.get("type").and_then(Value::as_str) == Some("null")) {
            return;
        }
        let forms: Vec<&Value> =
            list.iter().copied().filter(|n| n.get("type").and_then(Value::as_str) != Some("null")).collect();
        if let [only] = forms[..] {
            return self.walk(value, only, path, faults);
        }
        let words: Vec<&str> = forms.iter().filter_map(|n| n.get("const").and_then(Value::as_str)).collect();
        // Of words beside forms of other types a string is meant as a word.
        if words.len() == forms.len() || (value.is_string() && !words.is_empty()) {
            if !value.as_str().is_some_and(|v| words.contains(&v)) {
                faults.push(choice(place, value, words.into_iter()));
            }
            return;
        }
        if forms.iter().all(|n| n.get("type").and_then(Value::as_str) == Some("object")) {
            let keys: Vec<String> = forms.iter().flat_map(|n| self.keys(n)).collect();
            let Some(map) = value.as_object() else {
                faults.push(format!(
                    "{place}: found {}, expected an object with one of the keys {}",
                    brief(value),
                    quoted(&keys)
                ));
                return;
            };
            for key in map.keys().filter(|k| !keys.contains(k)) {
                faults.push(self.unknown(&join(path, key), key, &keys));
            }
            let given: Vec<&String> = map.keys().filter(|k| keys.contains(k)).collect();
            match given[..] {
                [key] => {
                    if let Some(child) = forms.iter().find_map(|n| n.get("properties").and_then(|p| p.get(key))) {
                        self.walk(&map[key], child, &join(path, key), faults);
                    }
                }
                _ => faults.push(format!(
                    "{place}: give exactly one of the keys {}; found {}",
                    quoted(&keys),
                    given.len()
                )),
            }
            return;
        }
        // Forms of different types: those whose type fits speak; if none does, name them all.
        let fitting = |n: &&Value| n.get("type").and_then(Value::as_str).is_some_and(|t| is_type(value, t));
        match forms.iter().copied().filter(fitting).collect::<Vec<_>>()[..] {
            [form] => self.walk(value, form, path, faults),
            [_, ..] if value.is_object() => {
                self.walk_alternatives(value, &forms.iter().copied().filter(fitting).collect::<Vec<_>>(), path, faults);
            }
            [form, ..] => self.walk(value, form, path, faults),
            [] => {
                let expected: Vec<String> = forms.iter().map(|n| self.expectation(n)).collect();
                faults.push(format!("{place}: found {}, expected {}", brief(value), expected.join(" or ")));
            }
        }
    }

    /// Expected values at `node`: every form, and the keys of forms that are told apart by them.
    fn expectation(&self, node: &Value) -> String {
        let resolved = self.resolve(node);
        let null = |n: &Value| n.get("type").and_then(Value::as_str) == Some("null");
        if let Some(list) = self.alternatives(resolved) {
            let mut forms: Vec<String> = list.iter().filter(|n| !null(n)).map(|n| self.expectation(n)).collect();
            forms.dedup();
            return forms.join(" or ");
        }
        let text = expectation(resolved, node);
        match resolved.get("required").and_then(Value::as_array).map(|r| &r[..]) {
            Some([Value::String(only)]) if text == "an object" => format!("an object with the key \"{only}\""),
            _ => text,
        }
    }
}

/// Message for an unknown key, with the nearest allowed one.
pub fn unknown_key(path: &str, key: &str, allowed: &[String]) -> String {
    let near = nearest(key, allowed).map_or_else(|| ".".into(), |n| format!("; did you mean \"{n}\"?"));
    let list = if allowed.is_empty() { String::new() } else { format!(" Allowed here: {}", quoted(allowed)) };
    format!("{path}: unknown key{near}{list}")
}

fn choice<'a>(place: &str, value: &Value, words: impl Iterator<Item = &'a str>) -> String {
    let words: Vec<String> = words.map(String::from).collect();
    let near =
        value.as_str().and_then(|v| nearest(v, &words)).map(|n| format!("; did you mean \"{n}\"?")).unwrap_or_default();
    format!("{place}: found {}, expected one of {}{near}", brief(value), quoted(&words))
}

/// The word of `words` that is most like `word`, if any is like it at all.
pub fn nearest<'a>(word: &str, words: &'a [String]) -> Option<&'a str> {
    let word = word.to_lowercase();
    let like = words.iter().map(|w| (strsim::jaro_winkler(&word, w), w));
    like.filter(|(s, _)| *s > 0.75).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, w)| w.as_str())
}

pub(super) fn quoted(words: &[String]) -> String {
    words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ")
}

fn join(path: &str, key: &str) -> String {
    // A key is free text when it is wrong: keep messages on one line and of bearable length.
    let mut shown: String = key.chars().take(80).map(|c| if c.is_control() { '?' } else { c }).collect();
    if key.chars().count() > 80 {
        shown.push('…');
    }
    if path.is_empty() {
        shown
    } else {
        format!("{path}.{shown}")
    }
}

fn is_type(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}

/// Found value, short enough for a message.
fn brief(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(b) => format!("the boolean {b}"),
        Value::Number(n) => format!("the number {n}"),
        Value::String(s) => {
            let cut: String = s.chars().take(60).map(|c| if c.is_control() { '?' } else { c }).collect();
            let dots = if s.chars().count() > 60 { "…" } else { "" };
            let hint = match s.to_ascii_lowercase().trim_start_matches(['+', '-']) {
                "nan" | "inf" | "infinity" => " (numbers must be finite)",
                _ => "",
            };
            format!("the string \"{cut}{dots}\"{hint}")
        }
        Value::Array(a) => format!("a list of {}", a.len()),
        Value::Object(_) => "an object".into(),
    }
}

/// Expected value, with bounds and unit.
fn expectation(node: &Value, bounds: &Value) -> String {
    if let Some(fixed) = node.get("const").or_else(|| bounds.get("const")) {
        return fixed.to_string();
    }
    let types: Vec<&str> = match node.get("type") {
        Some(Value::String(t)) => vec![t],
        Some(Value::Array(ts)) => ts.iter().filter_map(Value::as_str).filter(|t| *t != "null").collect(),
        _ => return "an object".into(),
    };
    let kind = types.iter().map(|t| match *t {
        "boolean" => "true or false",
        "integer" => "a whole number",
        "number" => "a number",
        "string" => "a string",
        "array" => "a list",
        _ => "an object",
    });
    let mut text = kind.collect::<Vec<_>>().join(" or ");
    let limit = |key: &str| bounds.get(key).or_else(|| node.get(key)).and_then(Value::as_f64);
    let limits: Vec<String> =
        [("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")]
            .iter()
            .filter_map(|(key, sign)| limit(key).map(|v| format!("{sign} {v}")))
            .collect();
    if !limits.is_empty() {
        text += &format!(" {}", limits.join(" and "));
    }
    if let Some(unit) = bounds.get("unit").or_else(|| node.get("unit")).and_then(Value::as_str).filter(|u| *u != "1") {
        text += &format!(" ({unit})");
    }
    text
}
