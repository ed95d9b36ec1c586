//! Turns `light.lamp.power_w=[80,60,40]` into requests to the simulator, one for each thing that changes.

use photonstream_protocol::Request;
use serde_json::{Map, Value};

/// Why an assignment makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}; {remedy}\n    {text}\n    {}^ character {at}", " ".repeat(at - 1))]
pub(crate) struct AssignmentError {
    /// The argument.
    text: String,
    /// The character at which it makes no sense, from 1.
    at: usize,
    /// What is wrong there.
    what: String,
    /// What would be right.
    remedy: String,
}

/// Kinds of things that can be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Light,
    Object,
    Material,
    Streaming,
    Vpls,
}

impl Kind {
    /// Whether there is only one of it, without a name.
    fn is_single(self) -> bool {
        matches!(self, Self::Streaming | Self::Vpls)
    }

    const ALL: [(&'static str, Self); 5] = [
        ("light", Self::Light),
        ("object", Self::Object),
        ("material", Self::Material),
        ("streaming", Self::Streaming),
        ("vpls", Self::Vpls),
    ];

    fn request(self, name: String, values: Map<String, Value>) -> Request {
        match self {
            Self::Light => Request::SetLight { name, values },
            Self::Object => Request::MoveObject { name, values },
            Self::Material => Request::SetMaterial { name, values },
            Self::Streaming => Request::SetStreaming { values },
            Self::Vpls => {
                Request::SetVpls { values: [("vpls".to_owned(), values.into())].into_iter().collect() }
            }
        }
    }
}

/// What a request changes, as it is written on the command line.
pub(crate) fn title(request: &Request) -> String {
    match request {
        Request::SetLight { name, .. } => format!("light.{name}"),
        Request::MoveObject { name, .. } => format!("object.{name}"),
        Request::SetMaterial { name, .. } => format!("material.{name}"),
        Request::SetStreaming { .. } => "streaming".into(),
        Request::SetVpls { .. } => "vpls".into(),
        Request::Pause => "pause".into(),
        Request::Resume => "resume".into(),
        Request::Step => "step".into(),
        Request::Reload => "reload".into(),
        other => format!("{other:?}"),
    }
}

/// The requests that `KEY=VALUE…` ask for, in the order in which their things are first named.
///
/// # Errors
/// An argument without `=`, an unknown kind of thing, a key or value that is no TOML, a key that is given twice.
pub(crate) fn requests(assignments: &[String]) -> Result<Vec<Request>, AssignmentError> {
    let mut things: Vec<(Kind, String, Map<String, Value>)> = Vec::new();
    for text in assignments {
        let Assignment { kind, name, path, value } = Assignment::parse(text)?;
        let at = match things.iter().position(|(k, n, _)| *k == kind && *n == name) {
            Some(at) => at,
            None => {
                things.push((kind, name, Map::new()));
                things.len() - 1
            }
        };
        put(&mut things[at].2, &path, value).map_err(|()| AssignmentError {
            text: text.clone(),
            at: 1,
            what: format!("{} has a value already", path.join(".")),
            remedy: "give each key once".into(),
        })?;
    }
    Ok(things.into_iter().map(|(kind, name, values)| kind.request(name, values)).collect())
}

/// Puts a value at a path of tables; fails where there is another value.
fn put(values: &mut Map<String, Value>, path: &[String], value: Value) -> Result<(), ()> {
    match path {
        [] => Err(()),
        [key] if values.contains_key(key) => Err(()),
        [key] => {
            values.insert(key.clone(), value);
            Ok(())
        }
        [table, rest @ ..] => {
            let table = values.entry(table).or_insert_with(|| Value::Object(Map::new()));
            put(table.as_object_mut().ok_or(())?, rest, value)
        }
    }
}

/// One argument, understood.
struct Assignment {
    kind: Kind,
    /// Empty for what there is only one of.
    name: String,
    /// The key, and the tables around it.
    path: Vec<String>,
    value: Value,
}

impl Assignment {
    fn parse(text: &str) -> Result<Self, AssignmentError> {
        let wrong = |byte: usize, what: String, remedy: &str| AssignmentError {
            text: text.to_owned(),
            at: text[..text.floor_char_boundary(byte)].chars().count() + 1,
            what,
            remedy: remedy.to_owned(),
        };
        let (parts, equals) = key(text).map_err(|(byte, what, remedy)| wrong(byte, what.into(), remedy))?;
        let mut parts = parts.into_iter();
        let first = parts.next().unwrap_or_default();
        let Some(&(_, kind)) = Kind::ALL.iter().find(|(name, _)| *name == first) else {
            let names = Kind::ALL.map(|(name, _)| name).join(", ");
            return Err(wrong(
                0,
                format!("\"{first}\" is no kind of thing"),
                &format!("expected one of {names}"),
            ));
        };
        let name = if kind.is_single() { Some(String::new()) } else { parts.next() };
        let path: Vec<String> = parts.collect();
        let (Some(name), false) = (name, path.is_empty()) else {
            let example = match kind {
                _ if kind.is_single() => format!("{first}.KEY=VALUE"),
                _ => format!("{first}.NAME.KEY=VALUE"),
            };
            return Err(wrong(equals, "the key is not complete".into(), &format!("write {example}")));
        };
        let begin = equals + 1;
        let value = text[begin..].trim();
        let table = |value: &str| toml::from_str::<toml::Table>(&format!("value = {value}"));
        let written =
            |value: &str| table(value).or_else(|error| table(&with_zeros(value)).map_err(|_| error));
        let parsed = if is_word(value) { table(&format!("\"{value}\"")) } else { written(value) };
        let parsed = parsed.map_err(|error| {
            let indent = begin + (text[begin..].len() - text[begin..].trim_start().len());
            let within = error.span().map_or(0, |span| span.start.saturating_sub("value = ".len()));
            let what = error.message().lines().next().unwrap_or("no TOML").to_owned();
            wrong(indent + within, what, "write a TOML value (a text as 'KEY=\"text\"')")
        })?;
        let value = Some(parsed).filter(|table| table.len() == 1);
        let value = value.and_then(|mut table| table.remove("value")).and_then(json);
        let value = value.ok_or_else(|| {
            wrong(
                begin,
                "no value that can be sent".into(),
                "write a number, true, false, a text, an array or a table",
            )
        })?;
        Ok(Self { kind, name, path, value })
    }
}

/// Whether a value is a text without quotes: a name such as `static-vpl`, and no value of TOML. Shells eat quotes.
fn is_word(value: &str) -> bool {
    let is_name = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    value.starts_with(char::is_alphabetic)
        && value.chars().all(is_name)
        && !["true", "false", "inf", "nan"].contains(&value)
}

/// Where a key makes no sense, why, and what would be right.
type KeyError = (usize, &'static str, &'static str);

/// The parts of the key before `=`, and the place of that sign. Parts are bare, of everything but blanks, quotes and dots,
/// or quoted as in TOML.
fn key(text: &str) -> Result<(Vec<String>, usize), KeyError> {
    let mut parts = Vec::new();
    let mut at = 0;
    loop {
        let rest = &text[at..];
        let length = match rest.chars().next() {
            Some(quote @ ('"' | '\'')) => {
                let length = quoted(rest, quote).ok_or((at, "a quote that does not end", "close it"))?;
                // TOML knows how to read what is between quotes.
                let part = toml::from_str::<toml::Table>(&format!("value = {}", &rest[..length])).ok();
                let part = part
                    .and_then(|mut table| table.remove("value"))
                    .and_then(|v| v.as_str().map(str::to_owned));
                parts.push(part.ok_or((
                    at,
                    "quotes around something that is no text",
                    "see TOML's strings",
                ))?);
                length
            }
            _ => {
                let length = rest.find(['.', '=', '"', '\'']).unwrap_or(rest.len());
                let part = rest[..length].trim();
                if part.is_empty() || part.contains(char::is_whitespace) {
                    return Err((
                        at,
                        "a part of the key is empty or has blanks",
                        "put names with blanks or dots in quotes",
                    ));
                }
                parts.push(part.to_owned());
                length
            }
        };
        at += length;
        at += text[at..].len() - text[at..].trim_start().len();
        match text[at..].chars().next() {
            Some('.') => at += 1,
            Some('=') => return Ok((parts, at)),
            Some(_) => return Err((at, "expected . or = here", "put names with blanks or dots in quotes")),
            None => return Err((at, "there is no value", "write KEY=VALUE")),
        }
    }
}

/// Bytes of the quoted text that `text` begins with, quotes included.
fn quoted(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' if quote == '"' => escaped = true,
            c if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// `.5` as `0.5`, which TOML insists on, outside of texts.
fn with_zeros(value: &str) -> String {
    let mut out = String::with_capacity(value.len() + 8);
    let mut quote = None;
    let mut last = ' ';
    let mut characters = value.chars().peekable();
    while let Some(c) = characters.next() {
        match quote {
            Some(end) if c == end && last != '\\' => quote = None,
            None if matches!(c, '"' | '\'') => quote = Some(c),
            None if c == '.'
                && !last.is_alphanumeric()
                && characters.peek().is_some_and(char::is_ascii_digit) =>
            {
                out.push('0');
            }
            _ => {}
        }
        out.push(c);
        last = c;
    }
    out
}

/// The same value in the language of control messages; `None` for dates and what is not finite.
fn json(value: toml::Value) -> Option<Value> {
    match value {
        toml::Value::String(text) => Some(Value::String(text)),
        toml::Value::Integer(number) => Some(number.into()),
        toml::Value::Float(number) => serde_json::Number::from_f64(number).map(Value::Number),
        toml::Value::Boolean(is) => Some(is.into()),
        toml::Value::Array(values) => values.into_iter().map(json).collect::<Option<_>>().map(Value::Array),
        toml::Value::Table(table) => {
            let entries = table.into_iter().map(|(key, value)| Some((key, json(value)?)));
            entries.collect::<Option<_>>().map(Value::Object)
        }
        toml::Value::Datetime(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn parsed(texts: &[&str]) -> Result<Vec<Request>, AssignmentError> {
        requests(&texts.iter().map(|&t| t.to_owned()).collect::<Vec<_>>())
    }

    fn values(value: Value) -> Map<String, Value> {
        value.as_object().unwrap().clone()
    }

    #[test]
    fn keys_of_one_thing_make_one_request() {
        let found = parsed(&[
            "light.lamp.power_w=[80,60,40]",
            "object.ball.position_m = [0, 1.5, 0]",
            "light.lamp.enabled=false",
            "material.red.albedo=[.6,.1,-.1]",
            "streaming.vsls=500",
            "streaming.sampling=\"fresh\"",
            "light.ball.spot.angle_deg=30",
        ]);
        let expected = [
            Request::SetLight {
                name: "lamp".into(),
                values: values(json!({"power_w": [80, 60, 40], "enabled": false})),
            },
            Request::MoveObject { name: "ball".into(), values: values(json!({"position_m": [0, 1.5, 0]})) },
            Request::SetMaterial { name: "red".into(), values: values(json!({"albedo": [0.6, 0.1, -0.1]})) },
            Request::SetStreaming { values: values(json!({"vsls": 500, "sampling": "fresh"})) },
            Request::SetLight { name: "ball".into(), values: values(json!({"spot": {"angle_deg": 30}})) },
        ];
        assert_eq!(found.unwrap(), expected);
    }

    #[test]
    fn names_may_be_paths_and_quoted() {
        for (text, name) in [
            ("object.room/door-1.scale=2", "room/door-1"),
            ("object.\"the ball no. 1\".scale=2", "the ball no. 1"),
            ("object.'a=b'.scale = 2", "a=b"),
            (r#"object."a \"b\" \u00e4".scale=2"#, "a \"b\" ä"),
            ("object.Türe.scale=2", "Türe"),
        ] {
            let expected = Request::MoveObject { name: name.into(), values: values(json!({"scale": 2})) };
            assert_eq!(parsed(&[text]).unwrap(), [expected], "{text}");
        }
    }

    #[test]
    fn words_need_no_quotes() {
        for text in [
            "streaming.method=static-vpl",
            "streaming.method = static-vpl ",
            "streaming.method=\"static-vpl\"",
        ] {
            let expected = Request::SetStreaming { values: values(json!({ "method": "static-vpl" })) };
            assert_eq!(parsed(&[text]).unwrap(), [expected], "{text}");
        }
        let expected = Request::SetStreaming { values: values(json!({ "adaptive": true })) };
        assert_eq!(parsed(&["streaming.adaptive=true"]).unwrap(), [expected]);
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        for (text, at, what) in [
            (
                "lamp.power_w=3",
                1,
                "\"lamp\" is no kind of thing; expected one of light, object, material, streaming",
            ),
            ("light.lamp=3", 11, "write light.NAME.KEY=VALUE"),
            ("streaming=3", 10, "write streaming.KEY=VALUE"),
            ("light.lamp.power_w", 19, "there is no value"),
            ("light..power_w=3", 7, "a part of the key is empty"),
            ("light.my lamp.power_w=3", 7, "put names with blanks or dots in quotes"),
            ("light.\"lamp.power_w=3", 7, "a quote that does not end"),
            ("light.ä.power_w=[1,", 20, "array"),
            ("material.red.name=white paint", 19, "'KEY=\"text\"'"),
            ("light.lamp.power_w=inf", 20, "no value that can be sent"),
            ("light.lamp.power_w=1\nx=2", 20, "no value that can be sent"),
            ("light.lamp.power_w=", 20, "write a TOML value"),
        ] {
            let error = parsed(&[text]).expect_err(text);
            assert!(error.to_string().contains(what) && error.at == at, "{text}: {error}");
        }
        for texts in [["light.a.x=1", "light.a.x=2"], ["light.a.x=1", "light.a.x.y=2"]] {
            assert!(parsed(&texts).expect_err("twice").to_string().contains("give each key once"));
        }
    }
}
