//! Finds keys of a file that have no effect.

use toml::{Table, Value};

/// Groups of interchangeable words.
const WORDS: [&[&str]; 18] = [
    &["metrology", "taught"],
    &["uframe", "oframe"],
    &["base", "other"],
    &["a", "b"],
    &["tPointer", "tGrind"],
    &["raster", "spiral", "contour"],
    &["zigzag", "one-way"],
    &["fixed", "feed"],
    &["x", "y"],
    &["u", "v"],
    &["fine", "z0", "z1", "z5"],
    &["unknown", "sequence", "random"],
    &["rapid", "krl", "fanuc"],
    &["printed", "sound"],
    &["rad", "deg"],
    &["as-measured", "position", "distance"],
    &["irb120-1024", "irb120-1024-position"],
    &["identified", "ambiguous"],
];

/// Path to a value: keys and indices in lists of tables.
type Way = Vec<Step>;

#[derive(Debug, Clone)]
enum Step {
    Key(String),
    Place(usize),
}

fn ways(value: &Value, way: &Way, out: &mut Vec<Way>) {
    match value {
        Value::Table(table) => {
            for (key, inner) in table {
                ways(inner, &[way.clone(), vec![Step::Key(key.clone())]].concat(), out);
            }
        }
        Value::Array(list) if list.iter().any(Value::is_table) => {
            for (place, inner) in list.iter().enumerate() {
                ways(inner, &[way.clone(), vec![Step::Place(place)]].concat(), out);
            }
        }
        _ => out.push(way.clone()),
    }
}

fn at<'v>(value: &'v mut Value, way: &[Step]) -> &'v mut Value {
    way.iter().fold(value, |value, step| match step {
        Step::Key(key) => &mut value[key.as_str()],
        Step::Place(place) => &mut value[*place],
    })
}

/// Plausible alternatives for a value.
fn others(value: &Value) -> Vec<Value> {
    match value {
        // A small change, a large one, and a value so small that a range no longer contains what it should.
        Value::Float(x) => [x * 1.01 + 0.37, x * 3.0 + 50.0, x / 5.0].map(Value::Float).to_vec(),
        Value::Integer(n) => [n + 1, n * 3 + 50, n / 5].map(Value::Integer).to_vec(),
        Value::Boolean(b) => vec![Value::Boolean(!b)],
        Value::String(text) => match WORDS.iter().find(|words| words.contains(&text.as_str())) {
            Some(words) => {
                words.iter().filter(|word| *word != text).map(|word| Value::String((*word).into())).collect()
            }
            None => vec![Value::String(format!("{text}x"))],
        },
        Value::Array(list) => list.first().map_or_else(Vec::new, |first| {
            let changed = |other: Value| Value::Array([vec![other], list[1..].to_vec()].concat());
            others(first).into_iter().map(changed).collect()
        }),
        _ => Vec::new(),
    }
}

/// The keys of a file that have no effect. `seen` returns what a user sees of the file, or the reason for its refusal.
pub fn unread(text: &str, seen: impl Fn(&str) -> Result<String, String>) -> Vec<String> {
    let whole = Value::Table(text.parse::<Table>().unwrap());
    let written = |value: &Value| toml::to_string(value).unwrap();
    let before = seen(&written(&whole)).unwrap();
    let mut all = Vec::new();
    ways(&whole, &Vec::new(), &mut all);
    assert!(all.len() > 5, "{text}");
    let read = |way: &Way| {
        let changed = others(at(&mut whole.clone(), way)).into_iter().any(|other| {
            let mut new = whole.clone();
            *at(&mut new, way) = other;
            seen(&written(&new)).map_or(true, |after| after != before)
        });
        let mut without = whole.clone();
        let Some((Step::Key(last), above)) = way.split_last() else { return changed };
        at(&mut without, above).as_table_mut().unwrap().remove(last);
        changed || seen(&written(&without)).is_ok_and(|after| after != before)
    };
    all.iter().filter(|way| !read(way)).map(|way| format!("{way:?}")).collect()
}
