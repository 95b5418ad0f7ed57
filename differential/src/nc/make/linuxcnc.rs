//! LinuxCNC programs.

use super::{Maker, Manner};

pub fn program(m: &mut Maker, head: &str) -> Vec<String> {
    let mut out: Vec<String> = head.lines().map(str::to_owned).collect();
    for name in ["one", "two"] {
        out.push(format!("o<{name}> sub"));
        m.loops = 1;
        for _ in 0..m.whole(1, 4) as i32 {
            out.extend(block(m, 1).into_iter().filter(|line| !line.contains("call")));
        }
        m.inch = false;
        out.push(format!("o<{name}> endsub"));
    }
    m.loops = 0;
    for line in
        ["#100=2.5", "#101=5", "#<_b>=10", "#<a>=7.5", "G90 G21 G17 G40 G94", "T1 M6", "G54", "G43 H1"]
    {
        out.push(line.to_owned());
    }
    out.push(full(m, "G0"));
    out.extend(m.body(block));
    out.push(m.pick(&["M2", "M30"]).to_owned());
    out
}

fn full(m: &mut Maker, word: &str) -> String {
    let six = m.six();
    let feed = m.pick(&["F600", "F1200", "F600"]);
    format!("{word} {six} {feed}")
}

fn formula(m: &mut Maker, letter: &str) -> String {
    let text = m.pick(&[
        "#101",
        "[#101+5]",
        "-#<_b>",
        "#<_b>",
        "[#100*2]",
        "[2**3-#100]",
        "[SIN[30]*#<_b>]",
        "SQRT[16]",
        "[7 MOD 4]",
        "[ATAN[1]/[1]/9]",
        "FIX[#100]",
        "#[100+1]",
        "#1",
    ]);
    format!("{letter}{text}")
}

fn part(m: &mut Maker) -> String {
    let some = m.some(formula);
    let word = m.pick(&["", "", "G1 ", "G0 ", "g1 "]);
    format!("{word}{some}")
}

fn restate(m: &mut Maker) -> String {
    m.inch = false;
    let frame = m.pick(&["G54", "G55", "G54"]);
    let full = full(m, "G1");
    format!("G90 G21 G17 G40 {frame} G43 H1 {full}")
}

fn arc(m: &mut Maker) -> Vec<String> {
    let round = m.round();
    let absolute = m.chance(0.15);
    let (begin, mut block) = round.words(m);
    if absolute {
        block.insert(0, "G90.1".to_owned());
    }
    let kind = m.whole(0, 9);
    if kind == 0.0 && !absolute {
        block.truncate(block.len() - 2);
    }
    if (1.0..=3.0).contains(&kind) {
        block.push(m.axis("R", round.radius()));
    } else {
        for (side, axis) in round.axes.into_iter().enumerate() {
            let from = if absolute { round.from[axis] } else { 0.0 };
            block.push(m.axis(["I", "J", "K"][axis], from + round.centre[side]));
        }
    }
    if kind == 4.0 {
        block.push(round.rise(m));
    }
    if kind == 5.0 {
        block.push("P2".to_owned());
    }
    let mut out = round.blocks(begin, &block);
    if absolute {
        out.push("G91.1".to_owned());
    }
    out
}

fn change(m: &mut Maker) -> Vec<String> {
    let one = |line: String| vec![line];
    match m.whole(0, 27) as i32 {
        0 | 1 => one("G91".into()),
        2 | 3 => one("G90".into()),
        4 => {
            m.inch = true;
            one("G20".into())
        }
        5 => {
            m.inch = false;
            one("G21".into())
        }
        6 | 7 => one(m.pick(&["G54", "G55", "G56", "G57", "G59.1"]).into()),
        8 if m.features.presets => {
            let (x, more) = (m.whole(-2, 4) * 5.0, m.pick(&["", " Y5"]));
            let x = m.axis("X", x);
            one(format!("G92 {x}{more}"))
        }
        9 if m.features.presets => one(m.pick(&["G92.1", "G92 X0 Y0 Z0", "G92.2", "G92.3"]).into()),
        8 | 9 => one("G90".into()),
        10 => {
            let (x, z) = (m.pick(&[0.0, 10.0, -5.0]), m.pick(&[0.0, 5.0]));
            let (x, z) = (m.axis("X", x), m.axis("Z", z));
            one(format!("G52 {x} {z}"))
        }
        11 if m.features.presets && m.chance(0.4) => one("G10 L20 P1 X5 Y0".into()),
        11 if m.features.presets && m.chance(0.1) => {
            let (number, axis) = (m.pick(&[1, 2, 3]), m.pick(&["A", "B", "C"]));
            one(format!("G10 L2 P{number} {axis}{}", m.pick(&[0, 5])))
        }
        11 => {
            // A frame that is told whole lies where others do.
            let [x, y, z] = m.centre;
            let (number, turn) = (m.pick(&[1, 2, 3]), m.pick(&["", " R180", " R165", " R180 A0 B0 C0"]));
            let (x, y, z) = (m.axis("X", x + 5.0), m.axis("Y", y), m.axis("Z", z + 10.0));
            one(format!("G10 L2 P{number} {x} {y} {z}{turn}"))
        }
        12 => one(m.pick(&["T1 M6", "T2 M6", "T3 M6", "T2"]).into()),
        13 => one(m.pick(&["G43 H1", "G43 H2", "G43", "G49", "G43 H3", "G43.1 Z10"]).into()),
        14 => vec!["M70".into(), m.pick(&["G91", "G20", "G18"]).into(), "M72".into()],
        15 => vec!["G53 G0 Z0".into(), part(m)],
        16 => {
            let value = m.whole(-2, 5) * 2.5;
            one(format!("{}={value}", m.pick(&["#100", "#101", "#<_b>", "#<a>", "#5"])))
        }
        17 => one(format!("#101=[#101+2.5] {}", part(m))),
        18 => one(m.pick(&["G28 Z0", "G30", "G28.1", "G53 G0 X0"]).into()),
        19 => vec![format!("G41.1 D1 {}", part(m)).replace("G41.1", "G41"), format!("G40 {}", part(m))],
        20 => one("G38.2 Z-10 F10".into()),
        21 => one(m.pick(&["G18", "G19", "G17"]).into()),
        22 | 23 => {
            one(format!("o<{}> call{}", m.pick(&["one", "two"]), m.pick(&["", " [1] [2.5]", " [#101]"])))
        }
        24 => one(m.pick(&["M8", "M9", "M3 S2000", "G4 P.5", "M1", "S900", "G64 P0.01"]).into()),
        25 => {
            let p = m.place();
            let (x, y) = (m.axis("X", p[0]), m.axis("Y", p[1]));
            vec![format!("G81 {x} {y} Z-5 R2"), "G80".into(), full(m, "G1")]
        }
        26 => one(format!("G1 {} (no point) ", part(m))
            .replace("G1 G1", "G1")
            .replace("G1 G0", "G0")
            .replace("G1 g1", "g1")),
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
    restate: |m| vec![restate(m)],
};

fn block(m: &mut Maker, depth: u32) -> Vec<String> {
    m.block(&MANNER, depth)
}

fn flow(m: &mut Maker, kind: f64, depth: u32) -> Vec<String> {
    let label = m.label();
    let inner = |m: &mut Maker| -> Vec<String> { (0..2).flat_map(|_| block(m, depth + 1)).collect() };
    let condition = format!(
        "[{} {} {}]",
        m.pick(&["#100", "#101", "#<_b>"]),
        m.pick(&["gt", "LE", "ne"]),
        m.pick(&[0, 5, 10])
    );
    let mut out = Vec::new();
    if kind < 0.8 {
        out.push(format!("o{label} if {condition}"));
        out.extend(inner(m));
        if m.chance(0.5) {
            out.push(format!("o{label} else"));
            out.extend(inner(m));
        }
        out.push(format!("o{label} endif"));
        return out;
    }
    if kind < 0.86 {
        out.push(format!("o{label} repeat [{}]", m.pick(&[0, 1, 2, 3])));
        out.extend(inner(m));
        out.push(format!("o{label} endrepeat"));
        return out;
    }
    if kind < 0.94 {
        let counter = 200 + label;
        out.push(format!("#{counter}=0"));
        let last = m.pick(&[0, 1, 2, 3]);
        if m.chance(0.5) {
            out.push(format!("o{label} while [#{counter} lt {last}]"));
            out.extend(inner(m));
            out.push(format!("#{counter}=[#{counter}+1]"));
            out.push(format!("o{label} endwhile"));
        } else {
            out.push(format!("o{label} do"));
            out.extend(inner(m));
            out.push(format!("#{counter}=[#{counter}+1]"));
            out.push(format!("o{label} while [#{counter} lt {last}]"));
        }
        return out;
    }
    vec![restate(m)]
}
