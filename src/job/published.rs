//! The schema as it is published: the same jobs are valid as by the one that follows from the types, in a form that
//! lets validators and editors name what is wrong. Alternatives (`anyOf`, `oneOf`) make them answer a misspelt key with
//! "is not of type null" or "is not valid under any of the given schemas"; they are replaced by conditions on the type.

use serde_json::{json, Map, Value};

/// The published form of a schema.
pub(super) fn published(schema: Value) -> Value {
    let root = schema.clone();
    let mut schema = schema;
    rewrite(&mut schema, &root);
    schema
}

/// Rewrites a schema and all schemas in it.
fn rewrite(node: &mut Value, root: &Value) {
    match node {
        Value::Object(map) => {
            map.values_mut().for_each(|inner| rewrite(inner, root));
            rewrite_alternatives(map, root);
        }
        Value::Array(list) => list.iter_mut().for_each(|inner| rewrite(inner, root)),
        _ => {}
    }
}

/// Replaces the alternatives of one schema.
fn rewrite_alternatives(map: &mut Map<String, Value>, root: &Value) {
    for keyword in ["anyOf", "oneOf"] {
        let Some(Value::Array(list)) = map.get(keyword) else { continue };
        let mut list = list.clone();
        let before = list.len();
        list.retain(|form| form["type"] != json!("null"));
        let nullable = list.len() < before;
        let Some(made) = alternatives(keyword, list, root) else { continue };
        map.remove(keyword);
        let made = match nullable {
            true => condition("null", json!(true), Value::Object(made)),
            false => made,
        };
        // The text of the whole stays.
        for (key, value) in made {
            map.entry(key).or_insert(value);
        }
    }
}

/// Schema that is `then` for values of a type and `otherwise` for others.
fn condition(kind: &str, then: Value, otherwise: Value) -> Map<String, Value> {
    let keys = [("if", json!({ "type": kind })), ("then", then), ("else", otherwise)];
    keys.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Schema of values that one of the forms fits; none where their types do not tell them apart.
fn alternatives(keyword: &str, forms: Vec<Value>, root: &Value) -> Option<Map<String, Value>> {
    if let [only] = &forms[..] {
        return only.as_object().cloned();
    }
    let (objects, others): (Vec<Value>, Vec<Value>) = forms.into_iter().partition(|form| is_object(form, root));
    let objects = match &objects[..] {
        [] => None,
        [only] => Some(by_key(std::slice::from_ref(only)).unwrap_or_else(|| only.clone())),
        all => Some(by_key(all)?),
    };
    let others = match &others[..] {
        [] => None,
        [only] => Some(only.clone()),
        all => Some(words(all).unwrap_or_else(|| json!({ keyword: all }))),
    };
    match (objects, others) {
        (Some(objects), Some(others)) => Some(condition("object", objects, others)),
        (one, other) => one.or(other).and_then(|form| form.as_object().cloned()),
    }
}

/// True for forms of objects.
fn is_object(form: &Value, root: &Value) -> bool {
    let target = match form["$ref"].as_str() {
        Some(name) => root.pointer(name.trim_start_matches('#')).unwrap_or(form),
        None => form,
    };
    let all = |keyword: &str| target[keyword].as_array().is_some_and(|list| list.iter().all(|f| is_object(f, root)));
    target["type"] == json!("object") || all("oneOf") || all("anyOf")
}

/// One object in place of objects with one required key each: exactly one of these keys.
fn by_key(forms: &[Value]) -> Option<Value> {
    let mut properties = Map::new();
    for form in forms {
        let required = form["required"].as_array()?;
        let (key, value) =
            form["properties"].as_object().filter(|p| p.len() == 1 && required.len() == 1)?.iter().next()?;
        let mut value = value.as_object()?.clone();
        if let Some(text) = form.get("description") {
            value.insert("description".into(), text.clone());
        }
        properties.insert(key.clone(), value.into());
    }
    Some(json!({
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
        "minProperties": 1,
        "maxProperties": 1
    }))
}

/// One list of words in place of constants, each with its description.
fn words(forms: &[Value]) -> Option<Value> {
    let words: Vec<Value> = forms.iter().map(|form| form.get("const").cloned()).collect::<Option<_>>()?;
    let texts: Vec<Value> = forms.iter().map(|form| form.get("description").cloned().unwrap_or_default()).collect();
    Some(json!({ "type": "string", "enum": words, "enumDescriptions": texts }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::schema;

    /// Every alternative that is left, by its path.
    fn left(node: &Value, path: &str, found: &mut Vec<(String, Value)>) {
        match node {
            Value::Object(map) => map.iter().for_each(|(key, inner)| {
                if ["anyOf", "oneOf"].contains(&key.as_str()) && inner.is_array() {
                    found.push((path.to_owned(), inner.clone()));
                }
                left(inner, &format!("{path}/{key}"), found);
            }),
            Value::Array(list) => list.iter().for_each(|inner| left(inner, path, found)),
            _ => {}
        }
    }

    #[test]
    fn no_alternative_is_null_or_an_object_beside_other_types() {
        let mut found = Vec::new();
        left(&schema(), "", &mut found);
        let all_objects = |list: &Value| list.as_array().is_some_and(|l| l.iter().all(|f| is_object(f, &schema())));
        for (path, list) in found {
            assert!(!list.to_string().contains("\"null\""), "{path}: {list}");
            let object = list.as_array().is_some_and(|l| l.iter().any(|f| is_object(f, &schema())));
            assert!(!object || all_objects(&list), "{path}: {list}");
        }
    }

    #[test]
    fn forms_become_conditions_on_the_type() {
        let form = |key: &str| {
            json!({ "type": "object", "required": [key], "properties": { key: { "type": "number" } },
                    "additionalProperties": false, "description": format!("about {key}") })
        };
        let made = published(json!({
            "$defs": { "Law": { "oneOf": [form("a"), form("b")] } },
            "properties": {
                "law": { "description": "d", "anyOf": [{ "$ref": "#/$defs/Law" }, { "type": "null" }] },
                "friction": { "anyOf": [{ "type": "number" }, { "$ref": "#/$defs/Law" }] },
                "name": { "oneOf": [{ "const": "x", "description": "X." }, { "const": "y" }, form("file")] }
            }
        }));
        let law = json!({ "description": "d", "if": { "type": "null" }, "then": true,
                          "else": { "$ref": "#/$defs/Law" } });
        assert_eq!(made["properties"]["law"], law);
        assert_eq!(made["properties"]["friction"]["then"], json!({ "$ref": "#/$defs/Law" }));
        assert_eq!(made["properties"]["friction"]["else"], json!({ "type": "number" }));
        assert_eq!(made["$defs"]["Law"]["properties"]["b"], json!({ "type": "number", "description": "about b" }));
        assert_eq!(made["$defs"]["Law"]["maxProperties"], json!(1));
        assert_eq!(made["properties"]["name"]["else"]["enum"], json!(["x", "y"]));
        assert!(made["properties"]["name"]["then"]["properties"]["file"].is_object());
    }
}
