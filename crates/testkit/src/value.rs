//! A MessagePack value of any shape, as other programs see it, with a notation. The notation is
//! JSON, in which bytes are text: `0x` and hexadecimal digits. Maps keep their order.

use std::fmt::{self, Write};

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::ser::{SerializeMap, SerializeSeq};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Nil,
    Bool(bool),
    Int(i64),
    Unsigned(u64),
    /// Single precision: MessagePack distinguishes single and double, JSON does not.
    Single(f32),
    Double(f64),
    Text(String),
    Bytes(Vec<u8>),
    List(Vec<Value>),
    Map(Vec<(String, Value)>),
}

impl Value {
    /// Reads MessagePack.
    ///
    /// - panics: if `bytes` are not one value.
    pub fn from_wire(bytes: &[u8]) -> Value {
        rmp_serde::from_slice(bytes).expect("the message is MessagePack")
    }

    /// The value as MessagePack.
    pub fn to_wire(&self) -> Vec<u8> {
        rmp_serde::to_vec_named(self).unwrap()
    }

    /// Reads the notation.
    ///
    /// - panics: if `text` is not in the notation.
    pub fn from_notation(text: &str) -> Value {
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{error} in\n{text}"))
    }

    /// The notation, with line breaks if it is long.
    pub fn notation(&self) -> String {
        let mut out = String::new();
        self.write(&mut out, 0);
        out
    }

    fn write(&self, out: &mut String, depth: usize) {
        let flat = self.flat();
        if flat.len() + 2 * depth <= 96 {
            out.push_str(&flat);
            return;
        }
        let pad = "  ".repeat(depth + 1);
        match self {
            Value::List(items) => {
                out.push('[');
                for (index, item) in items.iter().enumerate() {
                    let comma = if index > 0 { "," } else { "" };
                    write!(out, "{comma}\n{pad}").unwrap();
                    item.write(out, depth + 1);
                }
                write!(out, "\n{}]", "  ".repeat(depth)).unwrap();
            }
            Value::Map(entries) => {
                out.push('{');
                for (index, (key, value)) in entries.iter().enumerate() {
                    let comma = if index > 0 { "," } else { "" };
                    write!(out, "{comma}\n{pad}{}: ", quoted(key)).unwrap();
                    value.write(out, depth + 1);
                }
                write!(out, "\n{}}}", "  ".repeat(depth)).unwrap();
            }
            _ => out.push_str(&flat),
        }
    }

    fn flat(&self) -> String {
        match self {
            Value::Nil => "null".to_owned(),
            Value::Bool(value) => value.to_string(),
            Value::Int(value) => value.to_string(),
            Value::Unsigned(value) => value.to_string(),
            Value::Single(value) => format!("{value:?}"),
            Value::Double(value) => format!("{value:?}"),
            Value::Text(text) => quoted(text),
            Value::Bytes(bytes) => {
                format!("\"0x{}\"", HEXLOWER.encode(bytes))
            }
            Value::List(items) => {
                let items: Vec<String> = items.iter().map(Value::flat).collect();
                format!("[{}]", items.join(", "))
            }
            Value::Map(entries) => {
                let entry =
                    |(key, value): &(String, Value)| format!("{}: {}", quoted(key), value.flat());
                let entries: Vec<String> = entries.iter().map(entry).collect();
                format!("{{{}}}", entries.join(", "))
            }
        }
    }
}

fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap()
}

fn bytes_of(text: &str) -> Option<Vec<u8>> {
    HEXLOWER_PERMISSIVE.decode(text.strip_prefix("0x")?.as_bytes()).ok()
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Nil => serializer.serialize_unit(),
            Value::Bool(value) => serializer.serialize_bool(*value),
            Value::Int(value) => serializer.serialize_i64(*value),
            Value::Unsigned(value) => serializer.serialize_u64(*value),
            Value::Single(value) => serializer.serialize_f32(*value),
            Value::Double(value) => serializer.serialize_f64(*value),
            Value::Text(text) => serializer.serialize_str(text),
            Value::Bytes(bytes) => serializer.serialize_bytes(bytes),
            Value::List(items) => {
                let mut list = serializer.serialize_seq(Some(items.len()))?;
                items.iter().try_for_each(|item| list.serialize_element(item))?;
                list.end()
            }
            Value::Map(entries) => {
                let mut map = serializer.serialize_map(Some(entries.len()))?;
                entries.iter().try_for_each(|(key, value)| map.serialize_entry(key, value))?;
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Value, D::Error> {
        struct AnyValue;
        impl<'de> Visitor<'de> for AnyValue {
            type Value = Value;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("any value")
            }
            fn visit_unit<E>(self) -> Result<Value, E> {
                Ok(Value::Nil)
            }
            fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
                Ok(Value::Bool(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
                Ok(match u64::try_from(value) {
                    Ok(value) => Value::Unsigned(value),
                    Err(_) => Value::Int(value),
                })
            }
            fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
                Ok(Value::Unsigned(value))
            }
            fn visit_f32<E>(self, value: f32) -> Result<Value, E> {
                Ok(Value::Single(value))
            }
            fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
                Ok(Value::Double(value))
            }
            fn visit_str<E>(self, text: &str) -> Result<Value, E> {
                Ok(match bytes_of(text) {
                    Some(bytes) => Value::Bytes(bytes),
                    None => Value::Text(text.to_owned()),
                })
            }
            fn visit_bytes<E>(self, bytes: &[u8]) -> Result<Value, E> {
                Ok(Value::Bytes(bytes.to_vec()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Value, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = seq.next_element()? {
                    items.push(item);
                }
                Ok(Value::List(items))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Value::Map(entries))
            }
        }
        deserializer.deserialize_any(AnyValue)
    }
}
