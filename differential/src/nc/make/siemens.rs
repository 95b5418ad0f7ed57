//! Siemens 840D programs.

use super::{Maker, Manner};

pub fn program(m: &mut Maker, head: &str) -> Vec<String> {
    let mut out: Vec<String> = head.lines().map(str::to_owned).collect();
    for line in ["DEF REAL DEPTH=5", "DEF INT COUNT=0, MORE=2", "R1=2.5", "R2=5", "R3=10"] {
        out.push(line.to_owned());
    }
    for line in ["G90 G71 G17 G40 G94 G64", "T1 D1 M6", "G54", "TRAORI"] {
        out.push(line.to_owned());
    }
    out.push(full(m, "G0"));
    out.extend(m.body(block));
    out.push("M30".to_owned());
    out
}

/// A tool vector near the one that points up.
fn vector(m: &mut Maker) -> String {
    let (x, y) = (m.pick(&[0.0, 0.0, 0.1, -0.1]), m.pick(&[0.0, 0.05, -0.15]));
    let spin = m.pick(&[" THETA=0", " THETA=10", ""]);
    format!("A3={x} B3={y} C3=0.99{spin}")
}

fn full(m: &mut Maker, word: &str) -> String {
    let feed = m.pick(&["F600", "F1200", "F600"]);
    if m.chance(0.2) {
        let p = m.place();
        let words: Vec<String> = (0..3).map(|at| m.axis(["X", "Y", "Z"][at], p[at])).collect();
        let vector = vector(m);
        return format!("{word} {} {vector} {feed}", words.join(" "));
    }
    let six = m.six();
    format!("{word} {six} {feed}")
}

fn formula(m: &mut Maker, letter: &str) -> String {
    let text = m.pick(&[
        "R2",
        "R2+5",
        "-R3",
        "R1*2",
        "(R3-R1)/2",
        "SIN(30)*R3",
        "DEPTH",
        "IC(5)",
        "IC(-R1)",
        "AC(10)",
        "AC(R2)",
        "SQRT(16)",
        "7 MOD 4",
        "POT(2)",
    ]);
    let text = text.replace("7 MOD 4", "(7 MOD 4)");
    format!("{letter}={text}")
}

fn part(m: &mut Maker) -> String {
    let some = m.some(formula);
    let word = m.pick(&["", "", "G1 ", "G0 "]);
    let more = if m.chance(0.04) { m.pick(&[" RND=2", " CHF=1"]) } else { "" };
    format!("{word}{some}{more}")
}

fn restate(m: &mut Maker) -> Vec<String> {
    m.inch = false;
    let frame = m.pick(&["G54", "G55", "G54", "G500"]);
    let full = full(m, "G1");
    vec!["TRANS".into(), "T1 D1 M6".into(), format!("G90 G71 G17 G40 {frame}"), "TRAORI".into(), full]
}

fn arc(m: &mut Maker) -> Vec<String> {
    let round = m.round();
    let (begin, mut block) = round.words(m);
    let kind = m.whole(0, 11);
    if kind == 0.0 {
        block.truncate(block.len() - 2);
    }
    if (1.0..=3.0).contains(&kind) {
        let text = m.length(round.radius());
        block.push(format!("CR={text}"));
    } else if kind == 6.0 {
        block.push(format!("AR={:.4}", round.opening()));
    } else {
        for (side, axis) in round.axes.into_iter().enumerate() {
            let offset = ["I", "J", "K"][axis];
            if kind == 7.0 {
                let text = m.length(round.from[axis] + round.centre[side]);
                block.push(format!("{offset}=AC({text})"));
            } else {
                block.push(m.axis(offset, round.centre[side]));
            }
        }
    }
    if kind == 4.0 {
        block.push(round.rise(m));
    }
    if kind == 5.0 {
        block.push("TURN=1".to_owned());
    }
    round.blocks(begin, &block)
}

fn change(m: &mut Maker) -> Vec<String> {
    let one = |line: String| vec![line];
    match m.whole(0, 28) as i32 {
        0 | 1 => one("G91".into()),
        2 | 3 => one("G90".into()),
        4 => {
            m.inch = true;
            one("G70".into())
        }
        5 => {
            m.inch = false;
            one("G71".into())
        }
        6 | 7 => one(m.pick(&["G54", "G55", "G56", "G57", "G500"]).into()),
        8 | 9 => {
            let (x, z) = (m.pick(&[0.0, 10.0, -5.0]), m.pick(&[0.0, 5.0]));
            let (x, z) = (m.axis("X", x), m.axis("Z", z));
            one(format!("{} {x} {z}", m.pick(&["TRANS", "ATRANS"])))
        }
        10 => one(m.pick(&["TRANS", "ROT", "TRANS"]).into()),
        11 => one(m.pick(&["ROT Z15", "AROT Z-10", "AROT Z90", "ROT Z=R2"]).into()),
        12 => one(m.pick(&["T1 D1 M6", "T2 D1 M6", "T3 D1 M6", "T1 D2 M6"]).into()),
        13 => vec![m.pick(&["TRAFOOF", "STOPRE"]).into(), part(m), "TRAORI".into()],
        14 => vec![m.pick(&["MIRROR X0", "SCALE X2"]).into(), part(m), m.pick(&["MIRROR", "TRANS"]).into()],
        15 => vec![m.pick(&["SUPA G0 Z0", "G53 G0 Z0", "G74 Z1=0"]).replace("G74 Z1=0", "G75 Z0"), part(m)],
        16 => {
            let value = m.whole(-2, 5) * 2.5;
            one(format!("{}={value}", m.pick(&["R1", "R2", "R3", "DEPTH"])))
        }
        17 => one(m.pick(&["R2=R2+2.5", "R3=R1*2+R2", "DEPTH=DEPTH+1"]).into()),
        18 => {
            let p = m.place();
            let (x, y, u, v) =
                (m.axis("X", p[0]), m.axis("Y", p[1]), m.length(p[0] + 7.0), m.length(p[1] - 9.0));
            vec![format!("CIP {x} {y} I1={u} J1={v} K1=3"), full(m, "G1")]
        }
        19 => vec![format!("G41 {}", part(m)), format!("G40 {}", part(m))],
        20 => {
            let [x, y, z] = m.centre;
            one(format!(
                "$P_UIFR[{}]=CTRANS(X,{},Y,{},Z,{}):CROT(Z,180)",
                m.pick(&[1, 2]),
                x + 5.0,
                y,
                z + 10.0
            ))
        }
        21 => one(m.pick(&["G18", "G19", "G17"]).into()),
        22 => one(m.pick(&["L100", "CYCLE81(50,0,2,-5)", "G33 Z5 K1"]).into()),
        23 => one(m.pick(&["MSG(\"STEP; NEXT\")", "CYCLE832(0.05,_FINISH,1)", "G60", "G64"]).into()),
        24 => one(m.pick(&["M8", "M9", "M3 S2000", "G4 F1", "M1", "S900"]).into()),
        25 => {
            one(m.pick(&["G58 X10 Y5", "$P_PFRAME=CTRANS(X,10)", "$P_PFRAME=CTRANS(X,5):CROT(Z,10)"]).into())
        }
        26 => vec![format!("G1 {}", vector(m)), part(m)],
        27 => one("THETA=5".into()),
        _ => one(format!("/{}", part(m))),
    }
}

const MANNER: Manner = Manner {
    changes: 0.7,
    change,
    flow,
    full: |m| {
        let word = m.pick(&["G1", "G0", "G1"]);
        full(m, word)
    },
    part,
    arc,
    restate,
};

fn block(m: &mut Maker, depth: u32) -> Vec<String> {
    m.block(&MANNER, depth)
}

fn flow(m: &mut Maker, kind: f64, depth: u32) -> Vec<String> {
    let label = m.label();
    let inner = |m: &mut Maker| -> Vec<String> { (0..2).flat_map(|_| block(m, depth + 1)).collect() };
    let condition =
        format!("{}{}{}", m.pick(&["R1", "R2", "(R3)"]), m.pick(&[">", "<=", "<>"]), m.pick(&[0, 5, 10]));
    let mut out = Vec::new();
    if kind < 0.76 {
        out.push(format!("IF {condition} GOTOF M_{label}"));
        out.extend(inner(m));
        out.push(format!("M_{label}:"));
        return out;
    }
    if kind < 0.82 {
        out.push(format!("IF ({condition}) AND (R3<50)"));
        out.extend(inner(m));
        if m.chance(0.5) {
            out.push("ELSE".into());
            out.extend(inner(m));
        }
        out.push("ENDIF".into());
        return out;
    }
    if kind < 0.88 {
        let counter = 100 + label;
        out.push(format!("FOR R{counter}=1 TO {}", m.pick(&[0, 1, 2, 3])));
        out.extend(inner(m));
        out.push("ENDFOR".into());
        return out;
    }
    if kind < 0.94 {
        let counter = 100 + label;
        let last = m.pick(&[1, 2, 3]);
        out.push(format!("R{counter}=0"));
        let (begin, end) = if m.chance(0.5) {
            (format!("WHILE R{counter}<{last}"), "ENDWHILE".to_owned())
        } else {
            ("REPEAT".to_owned(), format!("UNTIL R{counter}>={last}"))
        };
        out.push(begin);
        out.extend(inner(m));
        out.push(format!("R{counter}=R{counter}+1"));
        out.push(end);
        return out;
    }
    if kind < 0.97 {
        out.push(format!("A_{label}:"));
        out.extend(inner(m));
        out.push(format!("E_{label}: {}", part(m)));
        out.push(format!("REPEAT A_{label} E_{label} P={}", m.pick(&[1, 2])));
        return out;
    }
    restate(m)
}
