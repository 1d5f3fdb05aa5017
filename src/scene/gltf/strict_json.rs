//! JSON as glTF requires it: UTF-8 without duplicate names in an object. Integral numbers in any
//! notation are read as integers.

use std::fmt;

use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::fault::{Read, fault};

/// Largest integer up to which all integers are exact in f64.
const MAX_EXACT: f64 = 9_007_199_254_740_992.0;

/// Parses a whole text. Nesting is limited by serde_json, to 128 levels.
pub(super) fn parse(text: &[u8]) -> Read<Value> {
    let text = std::str::from_utf8(text)
        .or_else(|error| fault("JSON", format!("byte {} is not UTF-8", error.valid_up_to())))?;
    let Strict(value) = serde_json::from_str(text).or_else(|error| fault("JSON", error.to_string()))?;
    Ok(value)
}

/// The elements of a list of objects, each read as a `T`; none where the list is missing.
pub(super) fn elements<T: DeserializeOwned>(object: &mut Map<String, Value>, name: &str) -> Read<Vec<T>> {
    let list = objects(object, name)?;
    let mut elements = Vec::with_capacity(list.len());
    for (i, element) in list.into_iter().enumerate() {
        elements.push(typed(&element, format_args!("{name}[{i}]"))?);
    }
    Ok(elements)
}

/// The elements of a list as they are, which must be objects; none where the list is missing.
pub(super) fn objects(object: &mut Map<String, Value>, name: &str) -> Read<Vec<Value>> {
    let list = match object.remove(name) {
        None => return Ok(Vec::new()),
        Some(Value::Array(list)) => list,
        Some(_) => return fault(name, "is not a list"),
    };
    match list.iter().position(|element| !element.is_object()) {
        Some(i) => fault(format!("{name}[{i}]"), "is not an object"),
        None => Ok(list),
    }
}

/// A member read as a `T`; none where it is missing.
pub(super) fn member<T: DeserializeOwned>(object: &mut Map<String, Value>, name: &str) -> Read<Option<T>> {
    let Some(value) = object.remove(name) else { return Ok(None) };
    typed(&value, name).map(Some)
}

/// A value at JSON path `place`, read as a `T`. Errors name the innermost place in it that is at
/// fault.
pub(super) fn typed<T: DeserializeOwned>(value: &Value, place: impl fmt::Display) -> Read<T> {
    T::deserialize(value).or_else(|error| {
        let problem = error.to_string();
        // What lacks a member alone lacks others too: the object is not looked for.
        let is_missing = problem.starts_with("missing field");
        let path = if is_missing { String::new() } else { path_to_fault::<T>(value, &problem, &|value| value) };
        fault(format!("{place}{path}"), problem)
    })
}

/// Path from a part of a value to the innermost part of it with which alone, as `whole` makes the
/// value of it, the problem stays the same. With an element twice too: otherwise, the length of the
/// list is at fault.
fn path_to_fault<T: DeserializeOwned>(part: &Value, problem: &str, whole: &dyn Fn(Value) -> Value) -> String {
    let is_at_fault = |part: Value| T::deserialize(whole(part)).is_err_and(|error| error.to_string() == problem);
    match part {
        Value::Array(list) => {
            let times = |count: usize, element: &Value| Value::Array(vec![element.clone(); count]);
            let at = list.iter().position(|element| (1..=2).all(|count| is_at_fault(times(count, element))));
            at.map_or(String::new(), |i| {
                format!("[{i}]{}", path_to_fault::<T>(&list[i], problem, &|element| whole(times(1, &element))))
            })
        }
        Value::Object(members) => {
            let alone = |name: &String, member: Value| Value::Object(Map::from_iter([(name.clone(), member)]));
            let at = members.iter().find(|(name, member)| is_at_fault(alone(name, (*member).clone())));
            at.map_or(String::new(), |(name, member)| {
                format!(".{name}{}", path_to_fault::<T>(member, problem, &|member| whole(alone(name, member))))
            })
        }
        _ => String::new(),
    }
}

/// Value whose objects have no duplicate names.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Strict)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        let is_whole = value.is_sign_positive() && value <= MAX_EXACT && value.fract() == 0.0;
        Ok(if is_whole { (value as u64).into() } else { value.into() })
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(Strict(element)) = elements.next_element()? {
            list.push(element);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(name) = members.next_key::<String>()? {
            if object.contains_key(&name) {
                return Err(A::Error::custom(format_args!("the name {name:?} is there twice in one object")));
            }
            let Strict(value) = members.next_value()?;
            object.insert(name, value);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &[u8]) -> String {
        format!("{:?}", parse(text).expect_err("it must be refused"))
    }

    #[test]
    fn whole_numbers_are_integers_and_others_stay() {
        let value = parse(b"[5.0, 5, 5.5, -5, -0.0, 1e3, 1e30, null, true, \"x\", {\"a\": [1]}]").expect("it is JSON");
        let expected = serde_json::json!([5, 5, 5.5, -5, -0.0, 1000, 1e30, null, true, "x", { "a": [1] }]);
        assert_eq!(value, expected);
    }

    #[test]
    fn faults_are_named_by_their_innermost_place() {
        #[derive(Debug, serde::Deserialize)]
        #[allow(dead_code, reason = "only read")]
        struct Shape {
            name: String,
            sizes: [f32; 2],
            #[serde(default)]
            parts: Vec<Shape>,
        }
        let place = |value: Value| format!("{:?}", typed::<Shape>(&value, "shape").expect_err("it must be refused"));
        let of = |sizes: Value| serde_json::json!({ "name": "a", "sizes": sizes });
        let with =
            |part: Value| serde_json::json!({ "name": "a", "sizes": [1, 2], "parts": [of([1, 2].into()), part] });
        assert!(typed::<Shape>(&with(of([3, 4].into())), "shape").is_ok());
        for (value, expected) in [
            (of([1, 2, 3].into()), "shape.sizes"),
            (of([1].into()), "shape.sizes"),
            (of(serde_json::json!([1, "b"])), "shape.sizes[1]"),
            (with(of([1].into())), "shape.parts[1].sizes"),
            (with(with(of("b".into()))), "shape.parts[1].parts[1].sizes"),
            (with(Value::Null), "shape.parts[1]"),
            (serde_json::json!({ "name": "a" }), "shape"),
            (with(serde_json::json!({ "sizes": [1, 2] })), "shape"),
            (Value::Null, "shape"),
        ] {
            let found = place(value);
            assert!(found.starts_with(&format!("Fault {{ place: {expected:?}, ")), "{found}, expected {expected}");
        }
    }

    #[test]
    fn what_is_no_json_is_refused() {
        assert!(refused(b"{\"a\": 1, \"b\": {\"a\": 1, \"a\": 2}}").contains(r#"the name \"a\" is there twice"#));
        assert!(refused(b"{\"\xff\": 1}").contains("byte 2 is not UTF-8"));
        assert!(refused(&b"[".repeat(100_000)).contains("recursion limit exceeded"));
        assert!(refused(&b"{\"a\":".repeat(100_000)).contains("recursion limit exceeded"));
        assert!(refused(b"[1e999]").contains("number out of range"));
        assert!(refused(b"[1] 2").contains("trailing characters"));
    }
}
