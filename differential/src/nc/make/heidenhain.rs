//! Heidenhain conversational programs.

use super::round::radius;
use super::{Maker, Manner};

pub fn program(m: &mut Maker, head: &str) -> Vec<String> {
    m.inch = m.chance(0.1);
    let unit = if m.inch { "INCH" } else { "MM" };
    let mut out = vec![format!("BEGIN PGM TEST {unit}")];
    out.extend(head.lines().map(str::to_owned));
    for line in [
        "BLK FORM 0.1 Z X+0 Y+0 Z-40",
        "Q1 = +2.5",
        "FN 0: Q2 = +5",
        "QL1 = 10",
        "TOOL CALL 1 Z S1000",
        "M128",
    ] {
        out.push(line.to_owned());
    }
    let six = m.six();
    out.push(format!("L {six} R0 FMAX"));
    out.extend(m.body(block));
    out.push("M30".to_owned());
    for name in [1, 2] {
        out.push(format!("LBL {name}"));
        m.loops = 1;
        for _ in 0..m.whole(1, 4) as i32 {
            out.extend(block(m, 1).into_iter().filter(|line| !line.contains("CALL LBL")));
        }
        out.push("LBL 0".to_owned());
    }
    out.push(format!("END PGM TEST {unit}"));
    let numbered = m.chance(0.8);
    let mut number = 0;
    let mut count = |line: String| {
        if line.starts_with(';') || !numbered {
            return line;
        }
        number += 1;
        match line.strip_prefix('/') {
            Some(rest) => format!("/{} {rest}", number - 1),
            None => format!("{} {line}", number - 1),
        }
    };
    out.into_iter().map(&mut count).collect()
}

fn full(m: &mut Maker) -> String {
    let six = m.six();
    let feed = m.pick(&["F600", "F1200", "FMAX", ""]);
    format!("L {six} R0 {feed}").trim_end().to_owned()
}

fn formula(m: &mut Maker, letter: &str) -> String {
    let text = m.pick(&["+Q1", "-Q2", "+Q2", "Q1", "+QL1", "-QL1"]);
    format!("{letter}{text}")
}

fn part(m: &mut Maker) -> String {
    let mut some = m.some(formula);
    if m.chance(0.15) {
        // One axis in increments.
        let at = some.split(' ').next().unwrap_or_default().to_owned();
        let letter = at.chars().next().unwrap_or('X').to_string();
        let by = m.whole(-4, 4) * 2.5;
        let new = if "XYZ".contains(&letter) { m.axis(&letter, by) } else { m.angle(&letter, 1.0) };
        some = some.replacen(&at, &format!("I{new}"), 1);
    }
    let feed = m.pick(&["", "", "", " F500", " FMAX"]);
    format!("L {some}{feed}")
}

fn restate(m: &mut Maker) -> Vec<String> {
    let six = m.six();
    vec![
        "TRANS DATUM RESET".into(),
        m.pick(&["CYCL DEF 247 DATUM SETTING Q339=+1", "CYCL DEF 247 DATUM SETTING Q339=+3"]).into(),
        "TOOL CALL 1 Z S1000".into(),
        format!("L {six} R0 F600 M128"),
    ]
}

fn arc(m: &mut Maker) -> Vec<String> {
    let (end, centre, anticlockwise) = m.bow();
    let p = m.place();
    let sign = if anticlockwise { "DR+" } else { "DR-" };
    let (x, y) = (m.axis("X", p[0]), m.axis("Y", p[1]));
    let mut out = vec![format!("L {x} {y}")];
    let (u, v) = (m.axis("X", p[0] + end[0]), m.axis("Y", p[1] + end[1]));
    if m.chance(0.5) {
        let (cx, cy) = (m.axis("X", p[0] + centre[0]), m.axis("Y", p[1] + centre[1]));
        out.push(format!("CC {cx} {cy}"));
        out.push(if m.chance(0.1) { format!("C {x} {y} {sign}") } else { format!("C {u} {v} {sign}") });
    } else {
        let r = m.axis("R", radius(end, centre, anticlockwise));
        out.push(format!("CR {u} {v} {r} {sign}"));
    }
    out
}

fn change(m: &mut Maker) -> Vec<String> {
    let one = |line: String| vec![line];
    let p = m.place();
    match m.whole(0, 24) as i32 {
        0 | 1 => {
            let (x, z) = (m.pick(&[0.0, 10.0, -5.0]), m.pick(&[0.0, 5.0]));
            let (x, z) = (m.axis("X", x), m.axis("Z", z));
            vec!["CYCL DEF 7.0 DATUM SHIFT".into(), format!("CYCL DEF 7.1 {x}"), format!("CYCL DEF 7.2 {z}")]
        }
        2 => vec![
            "CYCL DEF 7.0 DATUM SHIFT".into(),
            m.pick(&["CYCL DEF 7.1 IX+5", "CYCL DEF 7.1 X+0 Y+0 Z+0"]).into(),
        ],
        3 => one(m.pick(&["TRANS DATUM RESET", "TRANS DATUM AXIS X+5 Z+5", "TRANS DATUM RESET"]).into()),
        4 | 5 => one(format!("CYCL DEF 247 DATUM SETTING Q339=+{}", m.pick(&[1, 2, 3, 5]))),
        6 | 7 => one(format!("TOOL CALL {} Z S{}", m.pick(&[1, 2, 3]), m.pick(&[500, 1000]))),
        8 => one(m.pick(&["TOOL CALL S500", "TOOL CALL 1 Z S500 DL+5", "TOOL CALL 2 Z S1000 DL+0"]).into()),
        9 => vec!["M129".into(), part(m), "M128".into()],
        10 => vec![
            "CYCL DEF 8.0 MIRROR IMAGE".into(),
            "CYCL DEF 8.1 X".into(),
            part(m),
            "CYCL DEF 8.0 MIRROR IMAGE".into(),
            "CYCL DEF 8.1".into(),
        ],
        11 => vec![
            "CYCL DEF 10.0 ROTATION".into(),
            "CYCL DEF 10.1 ROT+30".into(),
            part(m),
            "CYCL DEF 10.1 ROT+0".into(),
        ],
        12 => vec!["PLANE SPATIAL SPA+0 SPB+20 SPC+0 STAY".into(), part(m), "PLANE RESET STAY".into()],
        13 => vec!["L Z+0 M91".into(), part(m)],
        14 => {
            let value = m.whole(-2, 5) * 2.5;
            let value = m.number_of(value);
            one(format!("{} = {value}", m.pick(&["Q1", "Q2", "QL1"])))
        }
        15 => one(m
            .pick(&[
                "Q2 = Q1 * 2 + 5",
                "FN 1: Q1 = +Q2 + +2.5",
                "FN 4: Q1 = +Q2 DIV +2",
                "Q2 = SIN 30 * 10",
                "Q1 = ( Q2 + 3 ) / 2",
                "FN 2: Q2 = +Q1 - +5",
                "Q1 = 2 ^ 3 - SQ 2",
                "QL1 = 7 % 4",
            ])
            .into()),
        16 => {
            let (x, y) = (m.axis("X", p[0]), m.axis("Y", p[1]));
            vec!["CYCL DEF 200 DRILLING".into(), format!("L {x} {y} M99")]
        }
        17 => vec![format!("{} RL", part(m)), format!("{} R0", part(m))],
        18 => one(m.pick(&["CALL LBL 1", "CALL LBL 2", "CALL LBL 1"]).into()),
        19 => one(m.pick(&["M8", "M9", "M3", "CALL PGM B.H", "STOP", "CYCL CALL"]).into()),
        20 => vec![part(m), "RND R2".into(), full(m)],
        21 => {
            let (x, y) = (m.axis("X", p[0]), m.axis("Y", p[1]));
            vec![format!("CT {x} {y}"), full(m)]
        }
        22 => {
            let words: Vec<String> = (0..3).map(|at| m.axis(["X", "Y", "Z"][at], p[at])).collect();
            let tilt = m.pick(&["TX+0 TY+0 TZ+1", "TX+0.1 TY+0 TZ+0.99"]);
            one(format!("LN {} {tilt}", words.join(" ")))
        }
        23 => one(format!("; {}", "note")),
        _ => one(format!("/{}", part(m))),
    }
}

const MANNER: Manner = Manner { changes: 0.75, change, flow, full, part, arc, restate };

fn block(m: &mut Maker, depth: u32) -> Vec<String> {
    m.block(&MANNER, depth)
}

fn flow(m: &mut Maker, kind: f64, depth: u32) -> Vec<String> {
    let label = m.label();
    let inner = |m: &mut Maker| -> Vec<String> { (0..2).flat_map(|_| block(m, depth + 1)).collect() };
    let mut out = Vec::new();
    if kind < 0.85 {
        let number = m.pick(&[("9", "EQU"), ("10", "NE"), ("11", "GT"), ("12", "LT")]);
        out.push(format!(
            "FN {}: IF +{} {} +{} GOTO LBL {label}",
            number.0,
            m.pick(&["Q1", "Q2"]),
            number.1,
            m.pick(&["5", "0", "Q2"])
        ));
        out.extend(inner(m));
        out.push(format!("LBL {label}"));
        return out;
    }
    if kind < 0.95 {
        out.push(format!("LBL {label}"));
        out.extend(inner(m));
        out.push(format!("CALL LBL {label} REP {}", m.pick(&[1, 2])));
        return out;
    }
    restate(m)
}
